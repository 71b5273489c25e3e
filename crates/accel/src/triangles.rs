//! Triangles: eight Möller-Trumbore tests at once, both sides.

use fearless_simd::{Simd, SimdBase, SimdFloat, SimdMask, f32x8};
use math::Vec3;

use crate::bvh::{Bvh, Found, Geometry, PrimRef, RaySimd, WIDTH};
use crate::{Ray, TriangleHit};

/// One set of triangles.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'a> {
    /// Corners.
    pub positions: &'a [Vec3],
    /// Three indices into the corners each.
    pub indices: &'a [[u32; 3]],
}

/// All sets together, while building; afterwards only the leaves matter.
#[derive(Debug)]
pub(crate) struct TriangleGeometry {
    corners: Vec<[Vec3; 3]>,
    /// Triangles before each set.
    firsts: Vec<u32>,
    count: usize,
}

#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct TriangleLeaf {
    corner: [[f32; WIDTH]; 3],
    edge1: [[f32; WIDTH]; 3],
    edge2: [[f32; WIDTH]; 3],
    id: [u32; WIDTH],
}

impl TriangleGeometry {
    pub(crate) fn new(sets: &[Triangles<'_>]) -> Self {
        let mut corners = Vec::with_capacity(sets.iter().map(|s| s.indices.len()).sum());
        let mut firsts = Vec::with_capacity(sets.len());
        for set in sets {
            firsts.push(corners.len() as u32);
            corners.extend(set.indices.iter().map(|t| t.map(|i| set.positions[i as usize])));
        }
        let count = corners.len();
        Self { corners, firsts, count }
    }
}

impl Geometry for TriangleGeometry {
    type Leaf = TriangleLeaf;

    fn len(&self) -> usize {
        self.count
    }

    fn bounds(&self, primitive: u32) -> (Vec3, Vec3) {
        let [a, b, c] = self.corners[primitive as usize];
        (a.min(b).min(c), a.max(b).max(c))
    }

    fn pack(&self, primitives: &[PrimRef]) -> TriangleLeaf {
        // Unused lanes hold a triangle without area, which nothing meets.
        let mut leaf = TriangleLeaf {
            corner: [[0.0; WIDTH]; 3],
            edge1: [[0.0; WIDTH]; 3],
            edge2: [[0.0; WIDTH]; 3],
            id: [0; WIDTH],
        };
        for (lane, primitive) in primitives.iter().enumerate() {
            let [a, b, c] = self.corners[primitive.id() as usize];
            for axis in 0..3 {
                leaf.corner[axis][lane] = a[axis];
                leaf.edge1[axis][lane] = b[axis] - a[axis];
                leaf.edge2[axis][lane] = c[axis] - a[axis];
            }
            leaf.id[lane] = primitive.id();
        }
        leaf
    }

    #[inline(always)]
    fn test<S: Simd>(&self, simd: S, leaf: &TriangleLeaf, r: &RaySimd<'_, S>, t_max: f32) -> Option<(f32, usize)> {
        let (e1, e2, corner) = (load3(simd, &leaf.edge1), load3(simd, &leaf.edge2), load3(simd, &leaf.corner));
        let d = r.axes[2];
        let p = cross(d, e2);
        let det = dot(e1, p);
        let s = [r.origin[0] - corner[0], r.origin[1] - corner[1], r.origin[2] - corner[2]];
        let q = cross(s, e1);
        // Scaled by |det| instead of divided: the sign test needs no division.
        let sign = f32x8::splat(simd, 1.0).copysign(det);
        let size = det.abs();
        let u = dot(s, p) * sign;
        let v = dot(d, q) * sign;
        let t = dot(e2, q) / det;
        let zero = f32x8::splat(simd, 0.0);
        let hit = size.simd_gt(zero)
            & u.simd_ge(zero)
            & v.simd_ge(zero)
            & (u + v).simd_le(size)
            & t.simd_gt(f32x8::splat(simd, r.ray.t_min))
            & t.simd_lt(f32x8::splat(simd, t_max));
        nearest(hit.to_bitmask(), &t.to_array())
    }

    fn packed(&mut self) {
        self.corners = Vec::new();
    }
}

/// The smallest `t` among the lanes of a mask.
#[inline(always)]
pub(crate) fn nearest(mask: u64, t: &[f32; WIDTH]) -> Option<(f32, usize)> {
    let mut mask = mask as u32;
    let mut best: Option<(f32, usize)> = None;
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        if best.is_none_or(|(least, _)| t[lane] < least) {
            best = Some((t[lane], lane));
        }
    }
    best
}

/// Eight vectors.
#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, v: &[[f32; WIDTH]; 3]) -> [f32x8<S>; 3] {
    [f32x8::load_array_ref(simd, &v[0]), f32x8::load_array_ref(simd, &v[1]), f32x8::load_array_ref(simd, &v[2])]
}

#[inline(always)]
fn cross<S: Simd>(a: [f32x8<S>; 3], b: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: [f32x8<S>; 3], b: [f32x8<S>; 3]) -> f32x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Bvh<TriangleGeometry> {
    pub(crate) fn hit(&self, ray: &Ray, found: &Found) -> TriangleHit {
        let leaf = self.leaf(found.leaf);
        let lane = found.lane as usize;
        let at = |v: &[[f32; WIDTH]; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        let (a, e1, e2) = (at(&leaf.corner), at(&leaf.edge1), at(&leaf.edge2));
        let p = ray.dir.cross(e2);
        let inverse = 1.0 / e1.dot(p);
        let s = ray.origin - a;
        let u = (s.dot(p) * inverse).clamp(0.0, 1.0);
        let v = (ray.dir.dot(s.cross(e1)) * inverse).clamp(0.0, 1.0 - u);
        let id = leaf.id[lane];
        let firsts = &self.geometry().firsts;
        let set = firsts.partition_point(|&first| first <= id) - 1;
        TriangleHit {
            t: found.t,
            set: set as u32,
            triangle: id - firsts[set],
            barycentric: [u, v],
            normal: e1.cross(e2).normalize_or(Vec3::Y),
            // From the triangle, not from the ray: closer to the plane by far.
            position: a + e1 * u + e2 * v,
            reach: a.abs().max((a + e1).abs()).max((a + e2).abs()).max_element(),
        }
    }
}
