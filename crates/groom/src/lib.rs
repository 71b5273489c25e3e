//! Hair as data: strands with their widths and attributes, what can be said about them, meshes to grow them on
//! and a procedural groomer.
//!
//! - [`Groom`] holds strands, [`Attributes`] what rides along.
//! - [`Report`] measures a groom and says what looks odd; [`clean`] repairs what can be repaired.
//! - [`Mesh`] and [`DistanceGrid`] describe what hair grows on and stays out of; [`head::mannequin`] is the
//!   built-in shop-window bust.
//! - [`grow::grow`] makes a groom from a [`grow::Recipe`].
//!
//! ```
//! use groom::{Groom, Report};
//! use math::Vec3;
//!
//! // Two strands of two and three points, in centimetres.
//! let points = vec![
//!     Vec3::ZERO,
//!     Vec3::new(0.0, -3.0, 0.0),
//!     Vec3::new(1.0, 0.0, 0.0),
//!     Vec3::new(1.0, -1.0, 0.0),
//!     Vec3::new(1.0, -2.0, 0.0),
//! ];
//! let mut groom = Groom::new(points, [2, 3])?;
//! groom.metres_per_unit = Some(0.01);
//! // 40 micrometres at the root, half of that at the tip.
//! groom.set_radius_profile(|u| 0.004 * (1.0 - 0.5 * u))?;
//!
//! let report = Report::of(&groom);
//! assert_eq!(report.length.max, 3.0);
//! assert_eq!(groom::guess_up(&groom), Some(groom::UpAxis::Y)); // hair falls
//! # Ok::<(), groom::GroomError>(())
//! ```

pub mod grow;
pub mod head;

mod attribute;
mod collider;
mod mesh;
mod report;
mod strands;

pub use attribute::{Attribute, AttributeError, Attributes, Domain, Values};
pub use collider::{DistanceGrid, GridError};
pub use grow::{GrowError, Recipe, Scalp, grow};
pub use head::{Head, mannequin};
pub use mesh::{Mesh, MeshError};
pub use report::{CleanCounts, Report, Spread, clean};
pub use strands::{Groom, GroomError, UpAxis, guess_up};
