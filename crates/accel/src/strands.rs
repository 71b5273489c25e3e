//! Strands as chains of straight pieces: eight round cones or ribbons tested at once.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x8};
use math::Vec3;

use crate::curve;

use crate::bvh::{Bvh, Found, Geometry, PrimRef, RaySimd, WIDTH};
use crate::triangles::{dot, load3, nearest};
use crate::{Ray, StrandHit};

/// What a strand is in cross-section.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// A chain of hulls of two spheres.
    #[default]
    Round,
    /// A flat ribbon that faces the ray.
    Ribbon,
}

/// What lies between two control points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Basis {
    /// A Catmull-Rom span through the points; beyond its ends the strand is continued straight.
    #[default]
    CatmullRom,
    /// A straight line.
    Linear,
}

/// One set of strands.
#[derive(Clone, Copy, Debug)]
pub struct Strands<'a> {
    /// Control points of all strands, root to tip.
    pub points: &'a [Vec3],
    /// Radius at every point.
    pub radii: &'a [f32],
    /// Strand `s` owns points `offsets[s]..offsets[s + 1]`; at least two.
    pub offsets: &'a [u32],
}

/// How far pieces may lie off the curve: the larger of this many radii ...
const TOLERANCE_RADII: f32 = 0.5;
/// ... and this share of the span's length, which bounds the bend between pieces to about nine degrees.
const TOLERANCE_SPAN: f32 = 0.02;
/// Most pieces a span is cut into.
const MAX_PIECES: f32 = 16.0;

/// All sets together: points stay, because hits need the curve.
#[derive(Debug)]
pub(crate) struct StrandGeometry {
    shape: Shape,
    basis: Basis,
    points: Vec<Vec3>,
    radii: Vec<f32>,
    /// Over all sets, into `points`.
    offsets: Vec<u32>,
    /// Strands and points before each set.
    firsts: Vec<(u32, u32)>,
    /// While building.
    pieces: Vec<Piece>,
}

/// A stretch of a span.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// Index of the span's first point.
    point: u32,
    /// Which of `of` equal stretches.
    index: u8,
    of: u8,
}

#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct StrandLeaf {
    a: [[f32; WIDTH]; 3],
    b: [[f32; WIDTH]; 3],
    radius_a: [f32; WIDTH],
    radius_b: [f32; WIDTH],
    strand: [u32; WIDTH],
    point: [u32; WIDTH],
    index: [u8; WIDTH],
    of: [u8; WIDTH],
}

impl StrandGeometry {
    pub(crate) fn new(sets: &[Strands<'_>], shape: Shape, basis: Basis) -> Self {
        let total: usize = sets.iter().map(|s| s.points.len()).sum();
        let mut geometry = Self {
            shape,
            basis,
            points: Vec::with_capacity(total),
            radii: Vec::with_capacity(total),
            offsets: vec![0],
            firsts: Vec::with_capacity(sets.len()),
            pieces: Vec::with_capacity(total),
        };
        for set in sets {
            let base = geometry.points.len() as u32;
            geometry.firsts.push((geometry.offsets.len() as u32 - 1, base));
            geometry.points.extend_from_slice(set.points);
            geometry.radii.extend_from_slice(set.radii);
            geometry.offsets.extend(set.offsets[1..].iter().map(|o| o + base));
        }
        for strand in 0..geometry.offsets.len() - 1 {
            let (first, end) = (geometry.offsets[strand], geometry.offsets[strand + 1]);
            for point in first..end.saturating_sub(1) {
                let of = geometry.piece_count(strand, point);
                geometry.pieces.extend((0..of).map(|index| Piece { point, index, of }));
            }
        }
        geometry
    }

    /// The four control points of a span; beyond the ends of the strand its first and last segment are
    /// continued straight on, so that a strand of two points stays straight.
    #[inline]
    fn span(&self, strand: usize, point: u32) -> [Vec3; 4] {
        let (first, last) = (self.offsets[strand], self.offsets[strand + 1] - 1);
        let at = |i: u32| self.points[i as usize];
        let (p1, p2) = (at(point), at(point + 1));
        let p0 = if point > first { at(point - 1) } else { p1 + p1 - p2 };
        let p3 = if point + 1 < last { at(point + 2) } else { p2 + p2 - p1 };
        [p0, p1, p2, p3]
    }

    fn piece_count(&self, strand: usize, point: u32) -> u8 {
        if self.basis == Basis::Linear {
            return 1;
        }
        let p = self.span(strand, point);
        // Largest second derivative over the span bounds the sagitta of n pieces: |p''| / (8 n²).
        let start = p[0] * 2.0 - p[1] * 5.0 + p[2] * 4.0 - p[3];
        let end = p[1] * 4.0 - p[0] - p[2] * 5.0 + p[3] * 2.0;
        // What matters is the part across the span: along it, points only bunch.
        let chord = p[2] - p[1];
        let along = chord.normalize_or_zero();
        let across = |v: Vec3| (v - along * along.dot(v)).length();
        let bend = across(start).max(across(end));
        let radius = self.radii[point as usize].min(self.radii[point as usize + 1]).max(1e-30);
        let tolerance = (TOLERANCE_RADII * radius).max(TOLERANCE_SPAN * chord.length());
        (bend / (8.0 * tolerance)).sqrt().ceil().clamp(1.0, MAX_PIECES) as u8
    }

    fn strand_of(&self, point: u32) -> usize {
        self.offsets.partition_point(|&first| first <= point) - 1
    }

    /// Ends of a piece: positions and radii.
    fn ends(&self, strand: usize, piece: Piece) -> ([Vec3; 2], [f32; 2]) {
        let (from, to) =
            (f32::from(piece.index) / f32::from(piece.of), f32::from(piece.index + 1) / f32::from(piece.of));
        let point = piece.point as usize;
        let radius = |t: f32| math::lerp(self.radii[point], self.radii[point + 1], t);
        let positions = if self.basis == Basis::Linear {
            [self.points[point], self.points[point + 1]]
        } else {
            let span = self.span(strand, piece.point);
            [curve::catmull_rom(span, from), curve::catmull_rom(span, to)]
        };
        (positions, [radius(from), radius(to)])
    }
}

/// Eight points in the ray's frame.
#[inline(always)]
fn to_ray<S: Simd>(simd: S, r: &RaySimd<'_, S>, points: &[[f32; WIDTH]; 3]) -> [f32x8<S>; 3] {
    let p = load3(simd, points);
    let d = [p[0] - r.origin[0], p[1] - r.origin[1], p[2] - r.origin[2]];
    [dot(d, r.axes[0]), dot(d, r.axes[1]), dot(d, r.axes[2])]
}

impl Geometry for StrandGeometry {
    type Leaf = StrandLeaf;

    fn len(&self) -> usize {
        self.pieces.len()
    }

    fn bounds(&self, primitive: u32) -> (Vec3, Vec3) {
        let piece = self.pieces[primitive as usize];
        let ([a, b], [ra, rb]) = self.ends(self.strand_of(piece.point), piece);
        // A hair wider than the cone itself: rounding in the leaf's own frame must stay inside.
        let (ra, rb) = (ra * 1.0001, rb * 1.0001);
        ((a - ra).min(b - rb), (a + ra).max(b + rb))
    }

    fn pack(&self, primitives: &[PrimRef]) -> StrandLeaf {
        // Unused lanes have a negative radius far away: nothing comes close enough.
        let mut leaf = StrandLeaf {
            a: [[0.0; WIDTH]; 3],
            b: [[0.0; WIDTH]; 3],
            radius_a: [-1.0; WIDTH],
            radius_b: [-1.0; WIDTH],
            strand: [u32::MAX; WIDTH],
            point: [0; WIDTH],
            index: [0; WIDTH],
            of: [1; WIDTH],
        };
        for (lane, primitive) in primitives.iter().enumerate() {
            let piece = self.pieces[primitive.id() as usize];
            let strand = self.strand_of(piece.point);
            let ([a, b], [ra, rb]) = self.ends(strand, piece);
            for axis in 0..3 {
                leaf.a[axis][lane] = a[axis];
                leaf.b[axis][lane] = b[axis];
            }
            (leaf.radius_a[lane], leaf.radius_b[lane]) = (ra, rb);
            leaf.strand[lane] = strand as u32;
            leaf.point[lane] = piece.point;
            (leaf.index[lane], leaf.of[lane]) = (piece.index, piece.of);
        }
        leaf
    }

    #[inline(always)]
    fn test<S: Simd>(&self, simd: S, leaf: &StrandLeaf, r: &RaySimd<'_, S>, t_max: f32) -> Option<(f32, usize)> {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        // Both ends in the ray's frame: x and y across it, z along it from the origin.
        let [ax, ay, az] = to_ray(simd, r, &leaf.a);
        let [bx, by, bz] = to_ray(simd, r, &leaf.b);
        let ra = f32x8::load_array_ref(simd, &leaf.radius_a);
        let rb = f32x8::load_array_ref(simd, &leaf.radius_b);
        let (ex, ey, ez) = (bx - ax, by - ay, bz - az);

        // Where the axis passes the ray closest, as seen along the ray: no digits are lost here.
        let e2 = ex * ex + ey * ey;
        let s = (zero - (ax * ex + ay * ey)) / e2.max(1e-30);
        let s = s.max(zero).min(one);
        let (cx, cy, cz) = (ax + s * ex, ay + s * ey, az + s * ez);
        let distance2 = cx * cx + cy * cy;
        let reach = match self.shape {
            Shape::Ribbon => ra + s * (rb - ra),
            Shape::Round => ra.max(rb),
        };
        let close = distance2.simd_le(reach * reach) & reach.simd_gt(zero);
        if close.to_bitmask() == 0 {
            return None;
        }

        let (t, met) = match self.shape {
            Shape::Ribbon => (cz, close),
            Shape::Round => {
                // The surface is the envelope of the spheres |p - s e| = ra - s Δ, with p seen from end a, e
                // the axis and Δ = ra - rb. Setting the derivative by s to zero gives s = w/D with
                // w = p·e - ra Δ and D = |e|² - Δ², and the quadric D (|p|² - ra²) - w² = 0. Along the ray,
                // p = o + t z, that is A t² + 2 B t + C = 0. The origin o lies beside the closest point, so
                // that all terms are of the fiber's own size.
                let (ox, oy, oz) = (zero - ax, zero - ay, cz - az);
                let taper = ra - rb;
                let (shrink, lean) = (taper * taper, taper * ra);
                let length2 = e2 + ez * ez;
                let along = ex * ox + ey * oy + ez * oz;
                let o2 = ox * ox + oy * oy + oz * oz;
                // |e|²|o|² - (e·o)² as the square of a cross product: the difference would lose its digits.
                let (nx, ny, nz) = (ey * oz - ez * oy, ez * ox - ex * oz, ex * oy - ey * ox);
                let apart = nx * nx + ny * ny + nz * nz;
                let qa = e2 - shrink;
                let qb = qa * oz - (ex * ox + ey * oy) * ez + ez * lean;
                let qc = apart - shrink * o2 + along * lean * 2.0 - length2 * (ra * ra);
                let discriminant = qb * qb - qa * qc;
                let side_t = (zero - discriminant.max(zero).sqrt() - qb) / qa;
                // s D, which must lie between the ends.
                let place = along - lean + side_t * ez;
                // Nearly along the slant the quadric has no crossing; the spheres at the ends take over.
                let slanted = qa.abs().simd_le(length2 * 1e-9);
                let on_side =
                    discriminant.simd_ge(zero) & place.simd_gt(zero) & place.simd_lt(length2 - shrink) & !slanted;

                let half_a = ra * ra - (ax * ax + ay * ay);
                let half_b = rb * rb - (bx * bx + by * by);
                let far = f32x8::splat(simd, f32::INFINITY);
                let end_a = half_a.simd_gt(zero).select(zero - oz - half_a.max(zero).sqrt(), far);
                let end_b = half_b.simd_gt(zero).select(ez - oz - half_b.max(zero).sqrt(), far);
                let local = on_side.select(side_t, end_a.min(end_b));
                (cz + local, close & local.simd_lt(far))
            }
        };
        let hit = met & t.simd_gt(f32x8::splat(simd, r.ray.t_min)) & t.simd_lt(f32x8::splat(simd, t_max));
        let mut mask = hit.to_bitmask();
        if mask == 0 {
            return None;
        }
        let t = t.to_array();
        if let Some(leaving) = r.ray.leaving {
            for (lane, (&strand, &t)) in leaf.strand.iter().zip(&t).enumerate() {
                if strand == leaving.strand && t < leaving.distance {
                    mask &= !(1 << lane);
                }
            }
        }
        nearest(mask, &t)
    }

    fn packed(&mut self) {
        self.pieces = Vec::new();
    }
}

impl Bvh<StrandGeometry> {
    /// Bytes of what hits need beside the hierarchy.
    pub(crate) fn geometry_bytes(&self) -> usize {
        let g = self.geometry();
        size_of_val(g.points.as_slice()) + size_of_val(g.radii.as_slice()) + size_of_val(g.offsets.as_slice())
    }

    pub(crate) fn hit(&self, ray: &Ray, found: &Found) -> StrandHit {
        let geometry = self.geometry();
        let leaf = self.leaf(found.leaf);
        let lane = found.lane as usize;
        let at = |v: &[[f32; WIDTH]; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        let (a, b) = (at(&leaf.a), at(&leaf.b));
        let axis = b - a;
        // From the end of the piece, not from the ray's origin: small numbers keep their digits.
        let from_a = (ray.origin - a) + ray.dir * found.t;
        let s = (from_a.dot(axis) / axis.length_squared().max(1e-30)).clamp(0.0, 1.0);
        let radius = math::lerp(leaf.radius_a[lane], leaf.radius_b[lane], s);

        let strand = leaf.strand[lane] as usize;
        let point = leaf.point[lane];
        let fraction = ((f32::from(leaf.index[lane]) + s) / f32::from(leaf.of[lane])).clamp(0.0, 1.0);
        let straight = axis.normalize_or(Vec3::X);
        let tangent = match geometry.basis {
            Basis::Linear => straight,
            Basis::CatmullRom => {
                curve::catmull_rom_derivative(geometry.span(strand, point), fraction).normalize_or(straight)
            }
        };

        let across = straight.cross(ray.dir).normalize_or_zero();
        let h = (from_a.dot(across) / radius.max(1e-30)).clamp(-1.0, 1.0);
        let radial = from_a - axis * s;
        let facing = {
            // A unit vector across the strand on the side that the ray comes from.
            let back = -ray.dir;
            (back - tangent * tangent.dot(back)).normalize_or(math::Frame::around(tangent).v)
        };
        let (normal, offset) = match geometry.shape {
            Shape::Ribbon => (facing, tangent.cross(facing) * (-h * radius)),
            Shape::Round => {
                let normal = (radial - tangent * tangent.dot(radial)).normalize_or(facing);
                (normal, normal * radius)
            }
        };

        let set = geometry.firsts.partition_point(|&(first, _)| first as usize <= strand) - 1;
        let (first, end) = (geometry.offsets[strand], geometry.offsets[strand + 1]);
        StrandHit {
            t: found.t,
            strand: strand as u32,
            set: set as u32,
            point: point - geometry.firsts[set].1,
            fraction,
            u: ((point - first) as f32 + fraction) / (end - first - 1) as f32,
            position: ray.origin + ray.dir * found.t,
            tangent,
            normal,
            offset,
            h,
            radius,
        }
    }

    /// Strands before the set, so that an index over all sets becomes one within its set.
    pub(crate) fn first_strand(&self, set: u32) -> u32 {
        self.geometry().firsts[set as usize].0
    }
}
