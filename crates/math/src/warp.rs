//! Maps from the unit square to the shapes that are sampled.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

/// A direction uniform over the sphere; density `1 / 4π`.
#[inline]
pub fn uniform_sphere([a, b]: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * a;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = (TAU * b).sin_cos();
    Vec3::new(r * c, r * s, z)
}

/// A point of the unit disk, area-preserving and without the polar map's pinch.
///
/// Source: Shirley & Chiu 1997.
#[inline]
pub fn disk([a, b]: [f32; 2]) -> Vec2 {
    let (x, y) = (2.0 * a - 1.0, 2.0 * b - 1.0);
    if x == 0.0 && y == 0.0 {
        return Vec2::ZERO;
    }
    let (r, phi) = if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    let (s, c) = phi.sin_cos();
    Vec2::new(r * c, r * s)
}

/// A direction around +x with density `cos / π`; `x` is the cosine.
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = disk(u);
    Vec3::new((1.0 - d.length_squared()).max(0.0).sqrt(), d.x, d.y)
}

/// Barycentric coordinates uniform over a triangle.
#[inline]
pub fn triangle([a, b]: [f32; 2]) -> [f32; 3] {
    let s = a.sqrt();
    [1.0 - s, s * (1.0 - b), s * b]
}
