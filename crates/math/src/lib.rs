//! What several crates of Cuticle share: vectors, colours, frames, hashing and the normal
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

pub mod hash;
pub mod normal;
pub mod warp;

mod frame;
mod real;
mod rgb;

pub use frame::Frame;
pub use glam::{Affine3A, DVec3, Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
pub use real::Real;
pub use rgb::{LUMINANCE, Rgb};

/// Straight interpolation: `a` at 0, `b` at 1.
#[inline]
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}
