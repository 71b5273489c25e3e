//! The interactive renderer: a scene, drawn on a GPU, by techniques that can be exchanged and measured.
//!
//! A [`Renderer`] holds a scene on the device and draws it as [`Settings`] say: how strands become fragments, which
//! model shades them, what casts shadows, how fragments become pixels. Every frame comes with a [`Report`] of what each
//! pass and each buffer cost. No window is needed: [`Renderer::image`] reads the picture back as linear radiance, in
//! the same units as the path tracer's.
//!
//! - Everything stays within the default limits of WebGPU (four bind groups, eight storage buffers a stage, bindings of
//!   128 MiB, no 64-bit atomics); [`Tier::Native`] only makes buffers larger and sums finer.
//! - What a scene's lights become is said in [`Report::notes`]: a rasteriser has no area lights.
//! - Nothing here panics on what a user can give: adapters that lack something, sizes that are too large, and lost
//!   devices are errors.
//!
//! ```no_run
//! use std::sync::Arc;
//!
//! let scene = Arc::new(scene::Scene::load(scene::builtin(), &[], &scene::NoAssets)?);
//! let gpu = raster::Gpu::new(&raster::GpuOptions::default())?;
//! let mut renderer = raster::Renderer::new(&gpu, scene.clone(), &raster::Settings::default())?;
//! let report = renderer.draw(&scene.camera, [scene.film.width, scene.film.height])?;
//! println!("{}", report.table());
//! let picture = renderer.image()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod frame;
mod gpu;
mod lights;
mod meter;
mod palette;
mod renderer;
mod settings;
mod shade;
mod shadow;
mod sky;
mod solid;
mod stage;
mod strands;
mod transparency;
mod view;

#[cfg(test)]
mod tests;

pub use fiber::convert::Kind;
pub use gpu::{AdapterDescription, Gpu, GpuError, GpuOptions, Tier};
pub use meter::{Allocation, Fragments, Report, Span};
pub use renderer::Renderer;
pub use settings::{
    DepthShift, DualScattering, Filter, Geometry, KAPPA, KPlusForm, Lighting, SettingError, Settings, Shading,
    ShadingSource, ShadingTime, Shadow, ShadowTechnique, Shape, Sort, Transparency,
};
pub use shadow::OpacityMap;

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A setting.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// More of something than fits.
    #[error("{what}: {found} are too many; there can be {most}")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much there is.
        found: u64,
        /// How much there can be.
        most: u64,
    },
    /// A picture without pixels, or one that the device has no texture for.
    #[error("a picture of {0} x {1} pixels cannot be drawn; sides must be 1 to {2}", .size[0], .size[1], .most)]
    Size {
        /// Pixels, supersampling included.
        size: [u32; 2],
        /// The longest side that the device has.
        most: u32,
    },
    /// More kinds of fibers than a shader has room for.
    #[error("the looks use {} models ({}); at most {most} can be drawn at once: choose one model for all", .found.len(), .found.join(", "))]
    TooManyModels {
        /// Their names.
        found: Vec<&'static str>,
        /// How many there can be.
        most: usize,
    },
    /// Fragments were dropped, again and again, however much room was made.
    #[error("{dropped} fragments found no room after {attempts} attempts; draw a smaller picture or fewer strands")]
    Overflow {
        /// How many were lost in the last attempt.
        dropped: u64,
        /// How often it was tried.
        attempts: u32,
    },
    /// A picture was asked for before one was drawn, or after that had failed.
    #[error("there is no picture: nothing has been drawn yet, or drawing failed")]
    NotDrawn,
    /// A shader could not be put together. This is a mistake of this program.
    #[error("a shader could not be put together, which is a mistake in this program: {0}")]
    Shader(String),
}
