//! Ray intersection of strands and triangles: a wide bounding volume hierarchy with SIMD leaves.
//!
//! The crate knows curve segments and triangles as numbers (control points, radii, indices) and nothing
//! of what they are part of.
//!
//! ```
//! use accel::{Accel, Options, Ray, Strands};
//! use math::Vec3;
//!
//! // One straight strand along y, a tenth thick; a ray that meets it off its axis.
//! let points = [Vec3::new(0.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
//! let strands = Strands { points: &points, radii: &[0.1, 0.1], offsets: &[0, 2] };
//! let accel = Accel::build(&[strands], &[], &Options::default());
//!
//! let hit = accel.closest(&Ray::new(Vec3::new(0.05, 0.0, 5.0), -Vec3::Z)).unwrap();
//! let accel::Hit::Strand(hit) = hit else { unreachable!() };
//! assert!((hit.h.abs() - 0.5).abs() < 1e-3);
//! assert!((hit.tangent - Vec3::Y).length() < 1e-6);
//! ```
//!
//! # What a hit is
//!
//! - [`Shape::Round`]: the surface of a chain of round cones (hulls of two spheres). Only entering it
//!   counts; a ray that starts inside one does not meet it.
//! - [`Shape::Ribbon`]: a ribbon that faces the ray, met where the ray passes the axis closest.
//! - [`Basis::CatmullRom`] strands are cut into straight pieces until they lie within half a radius or 2 %
//!   of the span's length of the curve; the tangent at a hit is the curve's own, so highlights do not show
//!   the pieces.
//!
//! # Leaving a fiber
//!
//! Scattering models describe the fiber as a whole, so light that goes through continues on the far
//! side. A ray that leaves a strand carries a [`Leaving`]: hits on that strand nearer than its
//! `distance` are ignored. [`StrandHit::leave`] gives the distance: 1.05 times the chord through the local
//! cylinder plus one diameter, at most 200 radii. Nothing depends on epsilons in world units.
//!
//! # Determinism
//!
//! All levels of SIMD use eight lanes and no fused multiply-add, so that a hit is the same to the bit on
//! every machine; a test holds the levels against each other.

mod bvh;
mod curve;
mod simd;
mod strands;
mod triangles;

use math::Vec3;

pub use simd::SimdLevel;
pub use strands::{Basis, Shape, Strands};
pub use triangles::Triangles;

use bvh::{Bvh, Traverse};
use strands::StrandGeometry;
use triangles::TriangleGeometry;

/// A half line with an interval.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Unit direction.
    pub dir: Vec3,
    /// Hits nearer than this do not count, `>= 0`.
    pub t_min: f32,
    /// Hits farther than this do not count.
    pub t_max: f32,
    /// The strand that the ray leaves, if any.
    pub leaving: Option<Leaving>,
}

impl Ray {
    /// From `origin` along unit `dir` to infinity.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, dir, t_min: 0.0, t_max: f32::INFINITY, leaving: None }
    }
}

/// The strand a ray leaves, and how far it takes to be out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaving {
    /// Index of the strand over all sets.
    pub strand: u32,
    /// Hits on that strand nearer than this are ignored.
    pub distance: f32,
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hit {
    /// A strand.
    Strand(StrandHit),
    /// A triangle.
    Triangle(TriangleHit),
}

impl Hit {
    /// Distance along the ray.
    pub fn t(&self) -> f32 {
        match self {
            Self::Strand(hit) => hit.t,
            Self::Triangle(hit) => hit.t,
        }
    }
}

/// A point on a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrandHit {
    /// Distance along the ray.
    pub t: f32,
    /// Index of the strand, counted over all sets in order.
    pub strand: u32,
    /// Index of the set.
    pub set: u32,
    /// Index, within the set's points, of the control point at which the hit span starts.
    pub point: u32,
    /// Position within the span, `0..=1`.
    pub fraction: f32,
    /// Position along the strand, 0 at the root and 1 at the tip, even in control points.
    pub u: f32,
    /// Where the ray met the strand.
    pub position: Vec3,
    /// Unit tangent, root to tip.
    pub tangent: Vec3,
    /// Unit vector from the axis to the hit, across the strand.
    pub normal: Vec3,
    /// From the axis to `position`, across the strand: on the surface of a round strand, within the plane of
    /// a ribbon.
    pub offset: Vec3,
    /// Offset across the strand in `[-1, 1]`: `-N·t` with `t = normalize(tangent × towards the viewer)`.
    pub h: f32,
    /// Radius of the strand here.
    pub radius: f32,
}

impl StrandHit {
    /// What a ray from this hit along unit `dir` must carry so that it does not meet the same fiber
    /// again on its way out.
    #[inline]
    pub fn leave(&self, dir: Vec3) -> Leaving {
        let across = dir - self.tangent * self.tangent.dot(dir);
        // Where the ray leaves the infinite cylinder: |o + t d⊥| = r. Along the fiber it grows without
        // bound; a real strand has curved away long before 200 radii.
        let (b, q) = (self.offset.dot(across), across.length_squared().max(1e-12));
        let inside = (self.radius * self.radius - self.offset.length_squared()).max(0.0);
        let exit = ((-b + (b * b + q * inside).sqrt()) / q).max(0.0);
        Leaving { strand: self.strand, distance: (1.05 * exit + 2.0 * self.radius).min(200.0 * self.radius) }
    }
}

/// A point on a triangle; both sides count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance along the ray.
    pub t: f32,
    /// Index of the set.
    pub set: u32,
    /// Index of the triangle within its set.
    pub triangle: u32,
    /// Barycentric weights of the second and third corner.
    pub barycentric: [f32; 2],
    /// Unit geometric normal by the order of the corners; not turned towards the ray.
    pub normal: Vec3,
    /// Where the ray met the triangle.
    pub position: Vec3,
    /// Largest coordinate of the corners, in size: what the precision of the hit follows from.
    pub reach: f32,
}

impl TriangleHit {
    /// A start for a ray that leaves along `dir`: the hit moved off the plane on the side of `dir`, by a
    /// millionth (2⁻²⁰) of the triangle's largest coordinate, that is sixteen times what single precision
    /// can say about a point on it.
    #[inline]
    pub fn leave(&self, dir: Vec3) -> Vec3 {
        let n = if self.normal.dot(dir) >= 0.0 { self.normal } else { -self.normal };
        self.position + n * (self.reach * (1.0 / 1_048_576.0))
    }
}

/// How to build.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Round or flat strands.
    pub shape: Shape,
    /// Curve through the points, or straight lines between them.
    pub basis: Basis,
    /// Instruction set; the best there is by default.
    pub level: SimdLevel,
}

/// How large a structure came out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stats {
    /// Straight pieces of strands.
    pub pieces: usize,
    /// Triangles.
    pub triangles: usize,
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// Bytes kept: hierarchy, leaves, and the control points that hits need.
    pub bytes: usize,
}

/// Strands and triangles, ready to be met by rays.
#[derive(Debug)]
pub struct Accel {
    level: SimdLevel,
    strands: Bvh<StrandGeometry>,
    triangles: Bvh<TriangleGeometry>,
}

impl Accel {
    /// Builds over sets of strands and sets of triangles, on the threads of the current rayon pool. The
    /// result does not depend on how many there are.
    ///
    /// Points and radii must be finite and in step with the offsets.
    pub fn build(strands: &[Strands<'_>], triangles: &[Triangles<'_>], options: &Options) -> Self {
        let (strands, triangles) = rayon::join(
            || Bvh::build(StrandGeometry::new(strands, options.shape, options.basis)),
            || Bvh::build(TriangleGeometry::new(triangles)),
        );
        Self { level: options.level.resolved(), strands, triangles }
    }

    /// The nearest hit.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut ray = *ray;
        let triangle = if self.triangles.is_empty() { None } else { self.level.run(Closest(&self.triangles, &ray)) };
        if let Some(found) = triangle {
            ray.t_max = found.t;
        }
        if !self.strands.is_empty()
            && let Some(found) = self.level.run(Closest(&self.strands, &ray))
        {
            return Some(Hit::Strand(self.strands.hit(&ray, &found)));
        }
        triangle.map(|found| Hit::Triangle(self.triangles.hit(&ray, &found)))
    }

    /// Whether anything lies within the ray's interval.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        (!self.triangles.is_empty() && self.level.run(Any(&self.triangles, ray)))
            || (!self.strands.is_empty() && self.level.run(Any(&self.strands, ray)))
    }

    /// Corners of the box around everything; `None` if there is nothing.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        match (self.strands.bounds(), self.triangles.bounds()) {
            (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
            (some, None) | (None, some) => some,
        }
    }

    /// Number of strands in the sets before `set`: takes [`StrandHit::strand`] to an index in its set.
    pub fn first_strand(&self, set: u32) -> u32 {
        self.strands.first_strand(set)
    }

    /// The instruction set in use.
    pub fn level(&self) -> SimdLevel {
        self.level
    }

    /// How large it came out.
    pub fn stats(&self) -> Stats {
        Stats {
            pieces: self.strands.primitives(),
            triangles: self.triangles.primitives(),
            nodes: self.strands.nodes() + self.triangles.nodes(),
            leaves: self.strands.leaves() + self.triangles.leaves(),
            bytes: self.strands.bytes() + self.strands.geometry_bytes() + self.triangles.bytes(),
        }
    }
}

struct Closest<'a, G: bvh::Geometry>(&'a Bvh<G>, &'a Ray);
struct Any<'a, G: bvh::Geometry>(&'a Bvh<G>, &'a Ray);

impl<G: bvh::Geometry> simd::WithSimd for Closest<'_, G> {
    type Output = Option<bvh::Found>;

    #[inline(always)]
    fn with_simd<S: fearless_simd::Simd>(self, simd: S) -> Self::Output {
        self.0.traverse(simd, self.1, Traverse::Closest)
    }
}

impl<G: bvh::Geometry> simd::WithSimd for Any<'_, G> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: fearless_simd::Simd>(self, simd: S) -> Self::Output {
        self.0.traverse(simd, self.1, Traverse::Any).is_some()
    }
}
