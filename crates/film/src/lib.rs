//! Pixels: what the samples add up to, the files it is stored in, how it is shown, and how two
//! pictures are compared.
//!
//! - [`Film`] holds one [`Pixel`] of sums per pixel; a tracer adds [`Sample`]s to it.
//! - [`write_exr`] stores everything, scene-linear; [`write_png`] stores one [`View`] of it.
//! - [`image::read`] reads `.exr`, `.hdr` and `.png` into an [`Image`].
//! - [`Comparison`] measures how far one image is from another.
//!
//! Colours are linear Rec.709/sRGB and colours with an alpha are associated (already multiplied by
//! it), as in EXR. Only PNG files and [`View::to_display`] are sRGB-encoded.
//!
//! ```
//! use film::{Film, Sample, View};
//! use math::Rgb;
//!
//! let mut film = Film::new(2, 1)?;
//! for light in [0.12, 0.24] {
//!     film.pixels_mut()[0].add(&Sample { beauty: Rgb::splat(light), alpha: 1.0, ..Sample::default() });
//! }
//!
//! // The two samples average to mid-grey, which every view shows as mid-grey.
//! let grey = film.mean_beauty(0, 0);
//! assert!((grey[0] - 0.18).abs() < 1e-6);
//! for view in View::ALL {
//!     assert!((view.to_display(grey, 0.0)[0] - 0.461).abs() < 1e-3);
//! }
//!
//! // Two samples that far apart are still a noisy estimate.
//! assert!(film.noise() > 0.3);
//! # Ok::<(), film::SizeError>(())
//! ```

pub mod image;

mod atomic;
mod compare;
mod exr_out;
mod frame;
mod view;

pub use self::image::{Defects, Image, ReadImageError};
pub use atomic::{WriteError, write_bytes};
pub use compare::{CompareError, Comparison, difference_image};
pub use exr_out::{Metadata, write_exr, write_image_exr};
pub use frame::{Film, MAX_PIXELS, MAX_SIDE, NO_STRAND, Pixel, Sample, SizeError};
pub use view::{BitDepth, ParseViewError, PngOptions, View, decode_srgb, encode_srgb, write_png};
