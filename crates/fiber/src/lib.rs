//! Scattering of light by one hair fiber.
//!
//! A [`Fiber`] is one of a closed set of models, each with its value, an exact sampler and the density
//! of that sampler. The crate knows no geometry and no renderer: a shading point is a [`Hit`], that is a
//! known direction and an offset across the fiber, and everything else follows.
//!
//! ```
//! use fiber::{Chiang, Dir, Hit, Model, Scatter};
//! use math::Rgb;
//!
//! // Brown hair seen straight on, a third of the way from its axis to its edge.
//! let hair = Chiang::<f64>::with_absorption(fiber::absorption::from_melanin(1.3, 0.0, Default::default()));
//! let point = hair.prepare(&Hit::new(Dir::new(0.0, 0.0), 0.33));
//!
//! // One sample carries its weight: the light it brings is multiplied by it, no cosine added.
//! let sample = point.sample([0.3, 0.6, 0.1, 0.5, 0.5]).unwrap();
//! let weight: Rgb<f64> = sample.weight.sum();
//! let ratio = point.eval(sample.dir).sum() / sample.pdf.unwrap();
//! assert!((weight - ratio).0.iter().all(|d| d.abs() < 1e-9));
//! // Blue is absorbed most by melanin: what goes through the fiber comes out reddish.
//! assert!(weight[0] >= weight[2]);
//! ```
//!
//! # Conventions
//!
//! - Frame: `u = +x` is the fiber's tangent from root to tip; a direction has inclination `theta` to the
//!   normal plane (positive towards the tip) and azimuth `phi` around the tangent. Radians.
//! - Both directions point **away** from the fiber. Index `k` is the known one (the viewer, for a path
//!   from the camera), `s` the sampled one (towards the light).
//! - Values are `fcos = S cos(theta_s)`: the scattering function with the fiber's cosine included. A
//!   renderer multiplies by nothing else; outgoing radiance is `∫ fcos L dω` over the whole sphere.
//! - `pdf` is per steradian.
//! - The offset `h` in `[-1, 1]` is where the ray of the known direction meets the fiber's cross-section.
//! - `alpha`, the tilt of the cuticle scales, has d'Eon's sign: the R lobe sits at `-theta_k + 2 alpha`,
//!   so real hair, whose scales lean to the root, has `alpha < 0` with tangents from root to tip.
//! - Absorption is per fiber radius, per linear Rec.709 channel.

pub mod absorption;
pub mod convert;
pub mod lobe;
pub mod multiple;
pub mod quadrature;
pub mod shader;
pub mod table;

#[cfg(feature = "conformance")]
pub mod conformance;

mod dir;
mod model;

pub use dir::{Dir, Hit, wrap_angle};
pub use lobe::caustic::Caustic;
pub use lobe::roots::Roots;
pub use model::chiang::{Chiang, ChiangGroom, ChiangSetup};
pub use model::deon::{Attenuation, Deon, DeonGroom, DeonSetup, Weights};
pub use model::field::Field;
pub use model::fur::{Fur, FurSetup, Medulla};
pub use model::hery::{Hery, HeryLobe, HeryMode, HerySetup};
pub use model::kajiya_kay::{Highlight, KajiyaKay, KajiyaKayMode, KajiyaKaySetup};
pub use model::lambertian::{Lambertian, LambertianSetup};
pub use model::marschner::{Marschner, MarschnerNorm, MarschnerSetup};
pub use model::sadeghi::{ArtistLobe, Glint, Sadeghi, SadeghiMode, SadeghiSetup};
pub use model::{DIMS, Fiber, FiberSetup, GroomFiber, LOBE_NAMES, Lobes, Model, R, RESIDUAL, Sample, Scatter, TRT, TT};
