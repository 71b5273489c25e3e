use groom::{Groom, Mesh};
use math::Rgb;

use crate::error::AssetError;

/// Where grooms, meshes and environments come from: a disk, dropped files, a test's memory.
///
/// A path is passed on exactly as the scene file has it; what it is relative to is up to the implementation.
pub trait Assets {
    /// A groom in its own units and with its own up axis.
    ///
    /// # Errors
    /// When there is none under that path, or it cannot be read.
    fn groom(&self, path: &str) -> Result<Groom, AssetError>;

    /// A triangle mesh in its own units.
    ///
    /// # Errors
    /// As for [`groom`](Self::groom).
    fn mesh(&self, path: &str) -> Result<Mesh, AssetError>;

    /// An environment image.
    ///
    /// # Errors
    /// As for [`groom`](Self::groom).
    fn environment(&self, path: &str) -> Result<EnvironmentImage, AssetError>;
}

/// Assets for scenes that need none: every question is an error.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAssets;

impl Assets for NoAssets {
    fn groom(&self, _: &str) -> Result<Groom, AssetError> {
        Err(AssetError::new("there are no files here"))
    }

    fn mesh(&self, _: &str) -> Result<Mesh, AssetError> {
        Err(AssetError::new("there are no files here"))
    }

    fn environment(&self, _: &str) -> Result<EnvironmentImage, AssetError> {
        Err(AssetError::new("there are no files here"))
    }
}

/// Radiance from all directions as a lat-long image.
///
/// Rows run from the zenith (+y) to the nadir. With `u` in `[0, 1)` from left to right and no rotation, `u` is
/// `atan2(x, -z) / 2π`, wrapped: the left edge lies at -z, a quarter is +x, the middle is +z.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentImage {
    /// Texels per row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Radiance, linear Rec.709, row after row from the top; finite and `>= 0` once a scene holds it.
    pub pixels: Vec<Rgb>,
}

impl EnvironmentImage {
    /// Checks the size and every texel.
    ///
    /// # Errors
    /// When the size does not fit the number of texels, or texels are negative, infinite or not numbers; then
    /// with their count and the first place.
    pub fn check(&self) -> Result<(), AssetError> {
        let expected = u64::from(self.width) * u64::from(self.height);
        if expected == 0 || expected != self.pixels.len() as u64 {
            return Err(AssetError::new(format_args!(
                "an image of {} x {} texels cannot have {} of them",
                self.width,
                self.height,
                self.pixels.len()
            )));
        }
        let bad = |texel: &Rgb| !texel.0.iter().all(|x| x.is_finite() && *x >= 0.0);
        let Some(first) = self.pixels.iter().position(bad) else { return Ok(()) };
        let count = self.pixels.iter().filter(|texel| bad(texel)).count();
        let (x, y) = (first % self.width as usize, first / self.width as usize);
        let [r, g, b] = self.pixels[first].0;
        Err(AssetError::new(format_args!(
            "{count} texels are negative, infinite or not numbers; the first is [{r}, {g}, {b}] at column {x}, row {y}"
        )))
    }
}
