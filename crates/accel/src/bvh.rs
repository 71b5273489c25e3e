//! The hierarchy: eight boxes a node, eight primitives a leaf; binned surface area heuristic.

use fearless_simd::{Simd, SimdBase, SimdMask, f32x8};
use math::{Vec3, Vec4};
use rayon::prelude::*;

use crate::Ray;

/// Lanes of a node and of a leaf.
pub(crate) const WIDTH: usize = 8;

/// Primitives of one kind, behind the hierarchy.
pub(crate) trait Geometry: Sync + Send {
    /// Eight primitives as SIMD wants them.
    type Leaf: Send + Sync;

    fn len(&self) -> usize;

    /// Box around a primitive.
    fn bounds(&self, primitive: u32) -> (Vec3, Vec3);

    /// Packs up to eight primitives.
    fn pack(&self, primitives: &[PrimRef]) -> Self::Leaf;

    /// The nearest hit within a leaf nearer than `t_max`: `(t, lane)`.
    fn test<S: Simd>(&self, simd: S, leaf: &Self::Leaf, ray: &RaySimd<S>, t_max: f32) -> Option<(f32, usize)>;

    /// Called once after packing, when individual primitives are not needed any more.
    fn packed(&mut self) {}
}

/// What traversal found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub(crate) t: f32,
    pub(crate) leaf: u32,
    pub(crate) lane: u32,
}

/// Whether to look for the nearest hit or for any.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Traverse {
    Closest,
    Any,
}

/// A primitive while building: the corners of its box, the last component unused but for the id.
///
/// Four components, so that the compiler keeps a corner in one register.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrimRef {
    /// The fourth component is the id's bits.
    lo: Vec4,
    hi: Vec4,
}

impl PrimRef {
    fn new(id: u32, lo: Vec3, hi: Vec3) -> Self {
        Self { lo: lo.extend(f32::from_bits(id)), hi: hi.extend(0.0) }
    }

    pub(crate) fn id(&self) -> u32 {
        self.lo.w.to_bits()
    }

    /// Twice the centre; the fourth component means nothing.
    fn centre2(&self) -> Vec4 {
        self.lo + self.hi
    }
}

/// A box; the fourth components mean nothing.
#[derive(Clone, Copy, Debug)]
struct Aabb {
    lo: Vec4,
    hi: Vec4,
}

impl Aabb {
    const EMPTY: Self = Self { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    #[inline]
    fn grow(&mut self, lo: Vec4, hi: Vec4) {
        self.lo = self.lo.min(lo);
        self.hi = self.hi.max(hi);
    }

    #[inline]
    fn join(mut self, other: Self) -> Self {
        self.grow(other.lo, other.hi);
        self
    }

    fn half_area(&self) -> f32 {
        let d = self.hi - self.lo;
        if d.x < 0.0 { 0.0 } else { d.x * d.y + d.y * d.z + d.z * d.x }
    }
}

/// Eight boxes with what lies in them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    lo: [[f32; WIDTH]; 3],
    hi: [[f32; WIDTH]; 3],
    /// Index of a node, or of a leaf with [`LEAF`] set. Unused lanes have empty boxes.
    child: [u32; WIDTH],
}

const LEAF: u32 = 1 << 31;
/// What an unused lane holds.
const NOTHING: u32 = u32::MAX;

impl Node {
    const EMPTY: Self =
        Self { lo: [[f32::INFINITY; WIDTH]; 3], hi: [[f32::NEG_INFINITY; WIDTH]; 3], child: [NOTHING; WIDTH] };
}

/// A hierarchy over one kind of geometry.
#[derive(Debug)]
pub(crate) struct Bvh<G: Geometry> {
    geometry: G,
    nodes: Vec<Node>,
    leaves: Vec<G::Leaf>,
    bounds: Option<(Vec3, Vec3)>,
    primitives: usize,
}

/// A ray as the boxes see it, splatted over the lanes.
pub(crate) struct RaySimd<'a, S: Simd> {
    pub(crate) ray: &'a Ray,
    pub(crate) origin: [f32x8<S>; 3],
    inverse: [f32x8<S>; 3],
    /// Three axes of a frame whose last is the ray's direction.
    pub(crate) axes: [[f32x8<S>; 3]; 3],
}

/// A vector in every lane. Functions like this one must be `inline(always)` and free of closures over
/// vectors: only then does the compiler see the instruction set they run under.
#[inline(always)]
fn splat<S: Simd>(simd: S, v: Vec3) -> [f32x8<S>; 3] {
    [f32x8::splat(simd, v.x), f32x8::splat(simd, v.y), f32x8::splat(simd, v.z)]
}

/// Distances at which a ray crosses eight planes across one axis.
#[inline(always)]
fn slab<S: Simd>(simd: S, planes: &[f32; WIDTH], origin: f32x8<S>, inverse: f32x8<S>) -> f32x8<S> {
    (f32x8::load_array_ref(simd, planes) - origin) * inverse
}

impl<'a, S: Simd> RaySimd<'a, S> {
    #[inline(always)]
    fn new(simd: S, ray: &'a Ray) -> Self {
        // Never zero, so that no slab distance is NaN.
        let inverse = Vec3::from_array(ray.dir.to_array().map(|d| {
            let tiny = 1e-18_f32;
            1.0 / if d.abs() < tiny { tiny.copysign(d) } else { d }
        }));
        let frame = math::Frame::around(ray.dir);
        Self {
            ray,
            origin: splat(simd, ray.origin),
            inverse: splat(simd, inverse),
            axes: [splat(simd, frame.v), splat(simd, frame.w), splat(simd, ray.dir)],
        }
    }
}

/// The planes that a ray meets first and last.
#[inline(always)]
fn order<'n>(lo: &'n [f32; WIDTH], hi: &'n [f32; WIDTH], positive: bool) -> (&'n [f32; WIDTH], &'n [f32; WIDTH]) {
    if positive { (lo, hi) } else { (hi, lo) }
}

const STACK: usize = 256;
/// From this depth on ranges are halved, which bounds the depth and so the stack.
const SAH_DEPTH: usize = 20;

impl<G: Geometry> Bvh<G> {
    pub(crate) fn build(mut geometry: G) -> Self {
        let count = geometry.len();
        let mut refs: Vec<PrimRef> = (0..count as u32)
            .into_par_iter()
            .with_min_len(4096)
            .map(|id| {
                let (lo, hi) = geometry.bounds(id);
                PrimRef::new(id, lo, hi)
            })
            .collect();
        let all = enclose(&refs);
        let bounds = (count > 0).then(|| (all.bounds.lo.truncate(), all.bounds.hi.truncate()));
        let mut tree = Subtree::default();
        if count > 0 {
            tree = build_node(Part { refs: &mut refs, first: 0, extent: all }, 0);
        }
        // Leaves are packed once the tree stands: they are by far the largest part and are never moved.
        let leaves = tree
            .leaves
            .par_iter()
            .with_min_len(1024)
            .map(|&(first, len)| geometry.pack(&refs[first as usize..][..usize::from(len)]))
            .collect();
        drop(refs);
        geometry.packed();
        Self { geometry, nodes: tree.nodes, leaves, bounds, primitives: count }
    }

    #[inline(always)]
    pub(crate) fn traverse<S: Simd>(&self, simd: S, ray: &Ray, mode: Traverse) -> Option<Found> {
        let r = RaySimd::new(simd, ray);
        let positive = ray.dir.to_array().map(|d| d >= 0.0 && !(d == 0.0 && d.is_sign_negative()));
        let mut best = None;
        let mut t_max = ray.t_max;
        let mut stack = [(0_u32, 0.0_f32); STACK];
        let mut top = 1;
        // The root is entered whatever its box: its children's boxes are tested anyway.
        stack[0] = (0, 0.0);
        while top > 0 {
            top -= 1;
            let (child, near) = stack[top];
            if near > t_max {
                continue;
            }
            if child & LEAF != 0 {
                let leaf = child & !LEAF;
                if let Some((t, lane)) = self.geometry.test(simd, &self.leaves[leaf as usize], &r, t_max) {
                    best = Some(Found { t, leaf, lane: lane as u32 });
                    if mode == Traverse::Any {
                        return best;
                    }
                    t_max = t;
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            let (near_x, far_x) = order(&node.lo[0], &node.hi[0], positive[0]);
            let (near_y, far_y) = order(&node.lo[1], &node.hi[1], positive[1]);
            let (near_z, far_z) = order(&node.lo[2], &node.hi[2], positive[2]);
            let enter = slab(simd, near_x, r.origin[0], r.inverse[0])
                .max(slab(simd, near_y, r.origin[1], r.inverse[1]))
                .max(slab(simd, near_z, r.origin[2], r.inverse[2]));
            let leave = slab(simd, far_x, r.origin[0], r.inverse[0])
                .min(slab(simd, far_y, r.origin[1], r.inverse[1]))
                .min(slab(simd, far_z, r.origin[2], r.inverse[2]));
            // Three roundings a side: this much slack keeps boxes watertight (Ize 2013).
            let leave = leave * 1.000_000_5;
            let enter = enter.max(ray.t_min);
            let hit = enter.simd_le(leave) & enter.simd_le(f32x8::splat(simd, t_max));
            let mut mask = hit.to_bitmask() as u32;
            if mask == 0 {
                continue;
            }
            let near = enter.to_array();
            let first = top;
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let entry = (node.child[lane], near[lane]);
                // Insertion keeps the farthest below, so that the nearest is taken next.
                let mut at = top;
                while at > first && stack[at - 1].1 < entry.1 {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = entry;
                top += 1;
            }
        }
        best
    }

    pub(crate) fn geometry(&self) -> &G {
        &self.geometry
    }

    pub(crate) fn leaf(&self, index: u32) -> &G::Leaf {
        &self.leaves[index as usize]
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    pub(crate) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    pub(crate) fn primitives(&self) -> usize {
        self.primitives
    }

    pub(crate) fn nodes(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn leaves(&self) -> usize {
        self.leaves.len()
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.leaves.as_slice())
    }
}

#[derive(Default)]
struct Subtree {
    /// The first node is the root.
    nodes: Vec<Node>,
    /// First primitive and number of primitives of each leaf.
    leaves: Vec<(u32, u8)>,
}

/// A range of the primitives.
struct Part<'r> {
    refs: &'r mut [PrimRef],
    /// Where the range begins among all.
    first: u32,
    extent: Extent,
}

/// What a range of primitives spans: their boxes, and their centres.
#[derive(Clone, Copy, Debug)]
struct Extent {
    bounds: Aabb,
    centres: Aabb,
}

fn enclose(refs: &[PrimRef]) -> Extent {
    let mut all = Extent { bounds: Aabb::EMPTY, centres: Aabb::EMPTY };
    for r in refs {
        all.bounds.grow(r.lo, r.hi);
        let c = r.centre2();
        all.centres.grow(c, c);
    }
    all
}

/// Above this many primitives children are built side by side.
const PARALLEL: usize = 32_768;

/// Splits a range into up to eight, always the most expensive first, and makes the node over them.
fn split(part: Part<'_>, depth: usize) -> (Node, Vec<Part<'_>>) {
    let mut parts = Vec::with_capacity(WIDTH);
    parts.push(part);
    while parts.len() < WIDTH {
        let Some((index, _)) = parts
            .iter()
            .enumerate()
            .filter(|(_, part)| part.refs.len() > WIDTH)
            .map(|(i, part)| {
                // Deep down only the count matters: it bounds the depth, and so the stack.
                let area = if depth < SAH_DEPTH { part.extent.bounds.half_area() } else { 1.0 };
                (i, area * part.refs.len() as f32)
            })
            .reduce(|a, b| if b.1 > a.1 { b } else { a })
        else {
            break;
        };
        let Part { refs, first, extent } = parts.swap_remove(index);
        let at = partition(refs, &extent, depth);
        let (left, right) = refs.split_at_mut(at);
        let (a, b) = if left.len() + right.len() > PARALLEL {
            rayon::join(|| enclose(left), || enclose(right))
        } else {
            (enclose(left), enclose(right))
        };
        parts.push(Part { refs: left, first, extent: a });
        parts.push(Part { refs: right, first: first + at as u32, extent: b });
    }
    let mut node = Node::EMPTY;
    for (lane, part) in parts.iter().enumerate() {
        for axis in 0..3 {
            node.lo[axis][lane] = part.extent.bounds.lo[axis];
            node.hi[axis][lane] = part.extent.bounds.hi[axis];
        }
    }
    (node, parts)
}

/// A subtree of its own; large ones in parallel, joined at the end.
fn build_node(part: Part<'_>, depth: usize) -> Subtree {
    let mut tree = Subtree::default();
    if part.refs.len() <= PARALLEL {
        build_into(part, depth, &mut tree);
        return tree;
    }
    let (node, parts) = split(part, depth);
    let children: Vec<Subtree> = parts
        .into_par_iter()
        .map(|part| {
            if part.refs.len() <= WIDTH {
                Subtree { nodes: Vec::new(), leaves: vec![(part.first, part.refs.len() as u8)] }
            } else {
                build_node(part, depth + 1)
            }
        })
        .collect();
    tree.nodes.reserve_exact(1 + children.iter().map(|c| c.nodes.len()).sum::<usize>());
    tree.leaves.reserve_exact(children.iter().map(|c| c.leaves.len()).sum());
    tree.nodes.push(node);
    for (lane, child) in children.into_iter().enumerate() {
        let (node_base, leaf_base) = (tree.nodes.len() as u32, tree.leaves.len() as u32);
        tree.nodes[0].child[lane] = if child.nodes.is_empty() { LEAF | leaf_base } else { node_base };
        tree.nodes.extend(child.nodes.into_iter().map(|mut node| {
            for child in &mut node.child {
                if *child & LEAF == 0 {
                    *child += node_base;
                } else if *child != NOTHING {
                    *child += leaf_base;
                }
            }
            node
        }));
        tree.leaves.extend(child.leaves);
    }
    tree
}

/// Appends a node and all below it; returns its index.
fn build_into(part: Part<'_>, depth: usize, tree: &mut Subtree) -> u32 {
    let index = tree.nodes.len();
    let (node, parts) = split(part, depth);
    tree.nodes.push(node);
    for (lane, part) in parts.into_iter().enumerate() {
        let child = if part.refs.len() <= WIDTH {
            tree.leaves.push((part.first, part.refs.len() as u8));
            LEAF | (tree.leaves.len() as u32 - 1)
        } else {
            build_into(part, depth + 1, tree)
        };
        tree.nodes[index].child[lane] = child;
    }
    index as u32
}

const BINS: usize = 16;
/// How many primitives are looked at to judge where to cut.
const JUDGES: usize = 4096;

/// Reorders the range and returns where to cut it; both sides are non-empty.
fn partition(refs: &mut [PrimRef], extent: &Extent, depth: usize) -> usize {
    let low = extent.centres.lo;
    let size = (extent.centres.hi - low).truncate();
    if depth < SAH_DEPTH && size.max_element() > 0.0 {
        let scale =
            Vec3::select(size.cmpgt(Vec3::ZERO), Vec3::splat(BINS as f32 * 0.999_99) / size, Vec3::ZERO).extend(0.0);
        let bin = |r: &PrimRef| (r.centre2() - low) * scale;
        let mut bins = [[(Aabb::EMPTY, 0_u32); BINS]; 3];
        // A few thousand primitives judge a cut as well as millions do.
        for r in refs.iter().step_by(refs.len().div_ceil(JUDGES)) {
            let at = bin(r);
            for axis in 0..3 {
                let slot = &mut bins[axis][(at[axis] as usize).min(BINS - 1)];
                slot.0.grow(r.lo, r.hi);
                slot.1 += 1;
            }
        }
        // Cost in leaves of eight: a leaf costs the same half empty, so full ones are preferred.
        let cost = |bounds: &Aabb, count: u32| bounds.half_area() * count.div_ceil(WIDTH as u32) as f32;
        let mut best: Option<(f32, usize, usize)> = None;
        for (axis, bins) in bins.iter().enumerate() {
            if size[axis] <= 0.0 {
                continue;
            }
            let mut right = [(Aabb::EMPTY, 0_u32); BINS];
            let mut sum = (Aabb::EMPTY, 0);
            for i in (1..BINS).rev() {
                sum = (sum.0.join(bins[i].0), sum.1 + bins[i].1);
                right[i] = sum;
            }
            let mut left = (Aabb::EMPTY, 0);
            for i in 1..BINS {
                left = (left.0.join(bins[i - 1].0), left.1 + bins[i - 1].1);
                if left.1 == 0 || right[i].1 == 0 {
                    continue;
                }
                let total = cost(&left.0, left.1) + cost(&right[i].0, right[i].1);
                if best.is_none_or(|(least, ..)| total < least) {
                    best = Some((total, axis, i));
                }
            }
        }
        if let Some((_, axis, cut)) = best {
            // The same arithmetic as `bin`, so that no primitive changes sides.
            let (low, scale, cut) = (low[axis], scale[axis], cut as f32);
            return partition_in_place(refs, |r| (r.lo[axis] + r.hi[axis] - low) * scale < cut);
        }
    }
    // All centres coincide, or the tree is too deep: halve along the longest extent.
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = refs.len() / 2;
    refs.select_nth_unstable_by(middle, |a, b| {
        a.centre2()[axis].total_cmp(&b.centre2()[axis]).then(a.id().cmp(&b.id()))
    });
    middle
}

fn partition_in_place(refs: &mut [PrimRef], is_left: impl Fn(&PrimRef) -> bool) -> usize {
    let (mut i, mut j) = (0, refs.len());
    loop {
        while i < j && is_left(&refs[i]) {
            i += 1;
        }
        while i < j && !is_left(&refs[j - 1]) {
            j -= 1;
        }
        if i >= j {
            return i;
        }
        refs.swap(i, j - 1);
    }
}
