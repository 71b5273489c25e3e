//! What several crates of Cuticle share: vectors, colours, frames, hashing, curves and the normal
//! distribution.
//!
//! Two rules keep this crate small: nothing here mentions hair, and nothing here has fewer than two
//! users. What only one crate needs lives in that crate.
//!
//! ```
//! use math::{Frame, Vec3};
//!
//! // A frame around a tangent is right-handed and orthonormal, whatever the tangent.
//! let frame = Frame::around(Vec3::new(0.0, 0.0, -1.0));
//! assert!((frame.u.cross(frame.v) - frame.w).length() < 1e-6);
//! ```

pub mod curve;
pub mod hash;
pub mod normal;
pub mod warp;

mod frame;
mod real;
mod rgb;

pub use frame::Frame;
pub use glam::{Affine3A, DVec3, Mat3, Quat, Vec2, Vec3, Vec4};
pub use real::Real;
pub use rgb::Rgb;

/// `x` wrapped into `[-π, π]`, by whole turns.
#[inline]
pub fn wrap_angle<F: Real>(x: F) -> F {
    x - F::TAU() * (x / F::TAU()).round()
}

/// Hermite step from 0 at `a` to 1 at `b`.
#[inline]
pub fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Straight interpolation: `a` at 0, `b` at 1.
#[inline]
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_the_direction() {
        for x in [-1e4_f64, -7.0, -3.2, 0.0, 3.2, 7.0, 1e4] {
            let w = wrap_angle(x);
            assert!(w.abs() <= std::f64::consts::PI + 1e-12);
            assert!((w.sin() - x.sin()).abs() < 1e-9, "{x}");
        }
    }
}
