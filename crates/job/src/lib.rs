//! Run a scene on a renderer, report what happens, keep what came out.
//!
//! This is the waist of the project: whatever takes time goes through here, so that the command line, a
//! studio or a farm see the same life cycle. Algorithms live below it.
//!
//! ```no_run
//! use job::{Options, Source};
//!
//! let scene = job::load(&Source::Builtin, &[])?;
//! let outcome = job::render(scene.into(), &Options::default(), &Default::default(), &mut |event| {
//!     println!("{} of {} samples", event.done, event.total);
//! })?;
//! println!("noise {:.3}", outcome.film.noise());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assets;
mod groom_scene;
mod info;
mod output;
mod run;

use std::io::Read;
use std::path::{Path, PathBuf};

use scene::{Scene, SceneError};

pub use assets::DiskAssets;
pub use film::{Film, Metadata, View};
pub use groom::UpAxis;
pub use groom_scene::GroomView;
pub use info::{InfoError, info};
pub use output::{Outputs, SaveError};
pub use run::{Cancel, Event, Options, Outcome, RunError, render};
pub use scene::{Scene as LoadedScene, View as SceneView, schema};
pub use trace::SimdLevel;

/// Where a scene comes from.
#[derive(Clone, Debug)]
pub enum Source {
    /// The scene that Cuticle brings along; it needs no file from anywhere.
    Builtin,
    /// A scene file.
    File(PathBuf),
    /// A groom alone: camera, light and look are made for it.
    Groom(PathBuf, GroomView),
}

/// Why a scene could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The scene file could not be read.
    #[error("cannot read the scene file {}: {cause}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The scene is wrong somewhere.
    #[error("{}{cause}", .file.as_ref().map(|f| format!("{}: ", f.display())).unwrap_or_default())]
    Scene {
        /// The scene file, where there is one.
        file: Option<PathBuf>,
        /// What is wrong and where.
        cause: Box<SceneError>,
    },
    /// The groom could not be read.
    #[error(transparent)]
    Groom(#[from] formats::ReadError),
    /// A path cannot stand in a scene.
    #[error("{}: a scene is text, so names of files in it must be UTF-8", .path.display())]
    NotText {
        /// The path.
        path: PathBuf,
    },
    /// The groom holds nothing that can be framed.
    #[error("{}: {reason}", .path.display())]
    Empty {
        /// The groom file.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
}

/// Scene files larger than this are not scene files.
const LARGEST_SCENE: u64 = 64 << 20;

/// Loads a scene with `overrides` such as `look.main.eumelanin=0.3`.
///
/// # Errors
/// The first thing that is wrong with files or values, with its place.
pub fn load(source: &Source, overrides: &[String]) -> Result<Scene, LoadError> {
    let (text, base, file) = match source {
        Source::Builtin => (scene::builtin().to_owned(), PathBuf::from("."), None),
        Source::File(path) => {
            (read_text(path)?, path.parent().map(Path::to_owned).unwrap_or_default(), Some(path.clone()))
        }
        Source::Groom(path, view) => (groom_scene::text(path, view)?, PathBuf::from("."), None),
    };
    let assets = DiskAssets::new(base);
    let mut scene = Scene::load(&text, overrides, &assets).map_err(|mut cause| {
        let mut file = file;
        if let Source::Groom(path, _) = source {
            // Lines of a text that nobody has seen help nobody; places within overrides do.
            cause.place = cause.place.filter(|place| place.from_override);
            // Unless the message already says which file is meant.
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            file = (cause.place.is_none() && !cause.message.contains(&*name)).then(|| path.clone());
        }
        LoadError::Scene { file, cause: Box::new(cause) }
    })?;
    scene.warnings.extend(assets.warnings());
    Ok(scene)
}

/// The looks of a scene file, by name, without any variation; grooms and pictures are not read.
///
/// # Errors
/// The first thing that is wrong with the file's text or its looks.
pub fn looks(path: &Path) -> Result<Vec<(String, fiber::Fiber)>, LoadError> {
    let wrong = |cause| LoadError::Scene { file: Some(path.to_owned()), cause: Box::new(cause) };
    let looks = scene::looks(&read_text(path)?, &[]).map_err(wrong)?;
    Ok(looks.iter().map(|look| (look.name().to_owned(), look.base())).collect())
}

fn read_text(path: &Path) -> Result<String, LoadError> {
    let error = |cause| LoadError::Read { path: path.to_owned(), cause };
    let refuse = |reason: String| error(std::io::Error::other(reason));
    let file = std::fs::File::open(path).map_err(error)?;
    let about = file.metadata().map_err(error)?;
    if about.is_dir() {
        return Err(refuse("it is a folder".into()));
    }
    // Devices and pipes have no length to check, and may never end.
    if !about.is_file() {
        return Err(refuse("it is no ordinary file".into()));
    }
    if about.len() > LARGEST_SCENE {
        return Err(refuse(format!("{} bytes is more than any scene file; is it the right file?", about.len())));
    }
    let mut bytes = Vec::new();
    file.take(LARGEST_SCENE).read_to_end(&mut bytes).map_err(error)?;
    String::from_utf8(bytes).map_err(|cause| {
        let valid = cause.utf8_error().valid_up_to();
        let bytes = cause.as_bytes();
        if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
            return refuse("it is UTF-16; scene files are UTF-8".into());
        }
        let line = 1 + bytes[..valid].iter().filter(|&&b| b == b'\n').count();
        refuse(format!("line {line} is not UTF-8 text (byte {:#04x})", bytes[valid]))
    })
}
