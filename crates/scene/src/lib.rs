//! What to render: camera, film, lights, meshes, grooms and looks, and the file that says so.
//!
//! A scene file is TOML in the user's words, degrees and units; [`file`] has its typed form and
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
mod look;
mod procedural;
mod resolve;
mod scene;
mod set;
mod source;

pub use assets::{Assets, EnvironmentImage, NoAssets};
pub use error::{AssetError, Place, SceneError, SceneErrorKind};
pub use file::{SceneFile, schema};
pub use look::{Look, StrandPoint};
pub use scene::{
    Camera, CurveBasis, CurveShape, FilmSettings, Filter, Heuristic, Integrator, Light,
    LightSelection, RenderSettings, Scene, SceneGroom, SceneMesh, View, Viewpoint, auto_camera,
};
pub use source::locate;

/// The text of the built-in scene: 50,000 wavy brown strands on the built-in head, three lights. It needs no
/// files.
pub fn builtin() -> &'static str {
    include_str!("../../../scenes/builtin.toml")
}

/// The text of a scene that shows the groom at `path` alone: framed automatically, brown, with a warm key
/// light from the front, a cool rim light from behind and a dim environment, whatever the groom's size.
pub fn for_groom(path: &str) -> String {
    // As a TOML string, so that quotes and backslashes in paths survive.
    let file = toml::Value::from(path);
    format!(
        "[film]\nview = \"filmic\"\n\n\
         [[light]]\nname = \"sky\"\ntype = \"environment\"\nradiance = [0.28, 0.3, 0.34]\n\n\
         [[light]]\nname = \"key\"\ntype = \"distant\"\ndirection = [0.55, -0.6, -0.6]\n\
         irradiance = [4.2, 3.9, 3.5]\nangle_deg = 12.0\n\n\
         [[light]]\nname = \"rim\"\ntype = \"distant\"\ndirection = [-0.6, -0.35, 0.7]\n\
         irradiance = [3.0, 3.3, 3.8]\nangle_deg = 10.0\n\n\
         [[groom]]\nfile = {file}\nlook = \"main\"\n\n\
         [look.main]\nmodel = \"deon\"\neumelanin = 1.3\npheomelanin = 0.2\n"
    )
}

#[cfg(test)]
mod tests;
