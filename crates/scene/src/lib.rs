//! What to render: camera, film, lights, meshes, grooms and looks, and the file that says so.
//!
//! A scene file is TOML in the user's words, degrees and units; [the module `file`](mod@file) has its typed form and
//! [`schema`] its JSON schema. [`Scene::load`] turns it into a [`Scene`]: radians, scene units, y up, every
//! number checked, so that a renderer cannot fail on it. Files are never opened here: [`Assets`] is asked for
//! them. A mistake is a [`SceneError`] with line, column and, where one is near, the name that was meant.
//!
//! ```
//! use scene::{NoAssets, Scene};
//!
//! let text = r#"
//! [[light]]
//! type = "environment"
//!
//! [[mesh]]
//! shape = { sphere = { radius = 2.0 } }
//! "#;
//! let scene = Scene::load(text, &["film.width=64".into()], &NoAssets)?;
//! assert_eq!(scene.film.width, 64);
//!
//! let error = Scene::load(&text.replace("radius", "radios"), &[], &NoAssets).unwrap_err();
//! assert_eq!(error.place.as_ref().map(|place| place.line), Some(6));
//! assert_eq!(error.suggestion.as_deref(), Some("radius"));
//! # Ok::<(), scene::SceneError>(())
//! ```

pub mod file;

mod assets;
mod error;
mod framing;
mod look;
mod procedural;
mod resolve;
mod scene;
mod set;
mod source;

pub use assets::{Assets, EnvironmentImage, NoAssets};
pub use error::{AssetError, Place, SceneError, SceneErrorKind};
pub use file::{SceneFile, schema};
pub use framing::{Viewpoint, auto_camera};
pub use look::{Look, StrandPoint};
pub use resolve::looks;
pub use scene::{
    Camera, CurveBasis, CurveShape, FilmSettings, Filter, Heuristic, Integrator, Light, LightSelection, RenderSettings,
    Scene, SceneGroom, SceneMesh, View,
};
pub use source::locate;

/// The text of the built-in scene: 50,000 wavy brown strands on the built-in head, three lights. It needs no
/// files.
pub fn builtin() -> &'static str {
    include_str!("../../../scenes/builtin.toml")
}

#[cfg(test)]
mod tests;
