//! What is drawn in measurements: three grooms of the kind that the thesis uses, or files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use groom::{Groom, Mesh, UpAxis};
use raster::Settings;
use scene::{AssetError, Assets, EnvironmentImage, Scene};

use crate::{Error, nearest};

/// A groom to measure with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Subject {
    /// Long and sleek, grown on the built-in head.
    Straight,
    /// Long and loosely wavy.
    Wavy,
    /// Voluminous curls.
    Curly,
    /// A groom, or a scene file, which ends in `.toml` and brings its own camera, lights and looks.
    File(PathBuf),
}

/// The text names nothing to measure with.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no groom {found:?}{}; write straight, wavy, curly, or the name of a groom (.hair) or scene (.toml) file",
    .suggestion.map(|s| format!(", did you mean {s}?")).unwrap_or_default()
)]
pub struct UnknownSubject {
    /// What was asked for.
    pub found: String,
    /// What was probably meant.
    pub suggestion: Option<&'static str>,
}

impl Subject {
    /// Those that need no file.
    pub const GROWN: [Self; 3] = [Self::Straight, Self::Wavy, Self::Curly];

    /// What is meant by a word: the name of one that is grown, or a file, which must be there.
    ///
    /// # Errors
    /// When it is neither.
    pub fn named(text: &str) -> Result<Self, UnknownSubject> {
        match text {
            "straight" => Ok(Self::Straight),
            "wavy" => Ok(Self::Wavy),
            "curly" => Ok(Self::Curly),
            _ if Path::new(text).is_file() => Ok(Self::File(PathBuf::from(text))),
            _ => Err(UnknownSubject {
                found: text.to_owned(),
                suggestion: nearest(text, ["straight", "wavy", "curly"].into_iter()),
            }),
        }
    }

    /// For tables: a file without its folder and ending.
    pub fn name(&self) -> String {
        match self {
            Self::Straight => "straight".into(),
            Self::Wavy => "wavy".into(),
            Self::Curly => "curly".into(),
            Self::File(path) => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }

    /// As it is written on the command line.
    pub fn argument(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            grown => grown.name(),
        }
    }

    /// Whether it is a scene file, which brings its own camera, lights and looks.
    pub(crate) fn is_scene(&self) -> bool {
        matches!(self, Self::File(path) if is_toml(path))
    }

    /// Whether it can be loaded; what is grown always can.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn check(&self) -> Result<(), Error> {
        match self {
            Self::File(_) => self.prepared(1, Pose::FRONT, [16, 16]).map(|_| ()),
            _ => Ok(()),
        }
    }

    /// The scene with `strands` strands, or as many as there are in a file with fewer.
    pub(crate) fn prepared(&self, strands: u32, pose: Pose, size: [u32; 2]) -> Result<Prepared, Error> {
        let preset = match self {
            Self::Straight => "straight",
            Self::Wavy => "wavy_long",
            Self::Curly => "curly",
            Self::File(path) => return file(path, strands, pose, size),
        };
        let text = format!(
            "{}[[mesh]]\nname = \"head\"\nbuiltin = \"head\"\nalbedo = [0.12, 0.10, 0.09]\n\n\
             [[groom]]\nname = \"hair\"\nlook = \"main\"\nprocedural = {{ preset = \"{preset}\", strands = {strands}, seed = 1 }}\n",
            pose.text(size, 0.01)
        );
        let scene = Scene::load(&text, &[], &scene::NoAssets)?;
        Ok(Prepared { scene: Arc::new(scene), strands, share: 1.0 })
    }
}

fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"))
}

/// From where grooms are seen and how they are lit, as a sentence for pages that put them into [`Pose::SIDE`].
pub(crate) fn seen(subjects: &[Subject]) -> String {
    let scenes: Vec<String> = subjects.iter().filter(|one| one.is_scene()).map(Subject::name).collect();
    let side = "seen from the side and lit by one light that is far away";
    if scenes.is_empty() {
        format!("Hair is {side}.")
    } else if scenes.len() == subjects.len() {
        "Camera, lights and looks are those of the scene file.".into()
    } else {
        format!("Hair is {side}; but camera, lights and looks of {} are those of its scene file.", scenes.join(", "))
    }
}

fn file(path: &Path, strands: u32, pose: Pose, size: [u32; 2]) -> Result<Prepared, Error> {
    let scene = if is_toml(path) {
        let [width, height] = size;
        let overrides = [format!("film.width={width}"), format!("film.height={height}")];
        job::load(&job::Source::File(path.to_owned()), &overrides)?
    } else {
        let refused = |reason: String| Error::Groom { path: path.to_owned(), reason };
        let name = path.to_str().ok_or_else(|| refused("its name is not UTF-8".into()))?;
        let groom = job::DiskAssets::new(PathBuf::new()).groom(name).map_err(|error| refused(error.to_string()))?;
        let up = match groom::guess_up(&groom) {
            Some(UpAxis::X) => "x",
            Some(UpAxis::Z) => "z",
            Some(UpAxis::Y) | None => "y",
        };
        let unit_m = groom.metres_per_unit.unwrap_or(0.01);
        let text = format!(
            "{}[[groom]]\nname = \"hair\"\nlook = \"main\"\nfile = \"groom\"\nup = \"{up}\"\n",
            pose.text(size, f64::from(unit_m))
        );
        Scene::load(&text, &[], &One(groom))?
    };
    let there: usize = scene.grooms.iter().map(|groom| groom.groom.strand_count()).sum();
    if there == 0 {
        return Err(Error::Groom { path: path.to_owned(), reason: "it has no strands".into() });
    }
    let strands = strands.clamp(1, u32::try_from(there).unwrap_or(u32::MAX));
    Ok(Prepared { scene: Arc::new(scene), strands, share: (f64::from(strands) / there as f64) as f32 })
}

/// One groom, under any name.
struct One(Groom);

impl Assets for One {
    fn groom(&self, _: &str) -> Result<Groom, AssetError> {
        Ok(self.0.clone())
    }

    fn mesh(&self, _: &str) -> Result<Mesh, AssetError> {
        Err(AssetError::new("there is only a groom"))
    }

    fn environment(&self, _: &str) -> Result<EnvironmentImage, AssetError> {
        Err(AssetError::new("there is only a groom"))
    }
}

/// From where hair is seen and lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// Degrees around the vertical; 0 is the face.
    azimuth_deg: f64,
    /// Whether a strong light stands behind it, and a weak one in front.
    from_behind: bool,
}

impl Pose {
    pub(crate) const FRONT: Self = Self { azimuth_deg: 30.0, from_behind: false };
    /// The view in which the thesis measures.
    pub(crate) const SIDE: Self = Self { azimuth_deg: 90.0, from_behind: false };
    pub(crate) const BACKLIT: Self = Self { azimuth_deg: 30.0, from_behind: true };

    /// Everything of a scene but hair and head: lights are far away, so that units do not matter, and turn with the
    /// camera, which frames the hair by itself.
    fn text(self, [width, height]: [u32; 2], unit_m: f64) -> String {
        let light = |azimuth_deg: f64, elevation_deg: f64, irradiance: f64| {
            let (azimuth, elevation) = ((self.azimuth_deg + azimuth_deg).to_radians(), elevation_deg.to_radians());
            let travels = [-elevation.cos() * azimuth.sin(), -elevation.sin(), -elevation.cos() * azimuth.cos()];
            format!("[[light]]\ntype = \"distant\"\ndirection = {travels:?}\nirradiance = {irradiance:?}\n\n")
        };
        let lights = if self.from_behind {
            light(-40.0, 38.0, 3.0) + &light(160.0, 25.0, 20.0)
        } else {
            light(-40.0, 38.0, 10.0)
        };
        format!(
            "[scene]\nname = \"measure\"\nunit_m = {unit_m:?}\n\n\
             [camera]\nfov_deg = 25.0\norbit = {{ azimuth_deg = {:?}, elevation_deg = 5.0 }}\n\n\
             [film]\nwidth = {width}\nheight = {height}\n\n{lights}\
             [look.main]\nmodel = \"marschner\"\neumelanin = 0.8\npheomelanin = 0.3\ntilt_deg = -5.0\n\
             longitudinal_roughness_deg = 7.5\ndiffuse = [0.12, 0.08, 0.05]\n\n",
            self.azimuth_deg
        )
    }
}

/// A scene to measure with.
#[derive(Clone, Debug)]
pub(crate) struct Prepared {
    pub(crate) scene: Arc<Scene>,
    /// Strands that are drawn.
    pub(crate) strands: u32,
    /// Share of the scene's that these are.
    share: f32,
}

impl Prepared {
    /// The settings for this many strands.
    pub(crate) fn settings(&self, mut settings: Settings) -> Settings {
        settings.geometry.strands = self.share;
        settings.shadow.strands = self.share;
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_mean_grooms_or_files() {
        assert_eq!(Subject::named("wavy"), Ok(Subject::Wavy));
        for subject in Subject::GROWN {
            assert_eq!(Subject::named(&subject.name()), Ok(subject));
        }
        let error = Subject::named("strait").unwrap_err();
        assert_eq!(error.suggestion, Some("straight"));
        assert!(error.to_string().contains("did you mean straight?"), "{error}");
        assert_eq!(Subject::named("absent/zebra.hair").unwrap_err().suggestion, None);
    }

    #[test]
    fn grown_scenes_have_what_was_asked_for() {
        for pose in [Pose::FRONT, Pose::SIDE, Pose::BACKLIT] {
            let prepared = Subject::Straight.prepared(40, pose, [32, 48]).unwrap();
            let scene = &prepared.scene;
            assert_eq!(scene.grooms[0].groom.strand_count(), 40);
            assert_eq!((scene.film.width, scene.film.height), (32, 48));
            assert_eq!(scene.lights.len(), if pose.from_behind { 2 } else { 1 });
            assert_eq!(prepared.settings(Settings::default()), Settings::default(), "all strands are drawn");
        }
    }

    #[test]
    fn of_a_file_a_share_is_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.toml");
        let text = "[[groom]]\nprocedural = { preset = \"short\", strands = 80 }\n[[light]]\ntype = \"environment\"\n";
        std::fs::write(&path, text).unwrap();
        let subject = Subject::named(path.to_str().unwrap()).unwrap();
        assert_eq!((subject.name().as_str(), subject.is_scene()), ("some", true));
        assert!(!Subject::File("some.hair".into()).is_scene() && !Subject::Wavy.is_scene());
        assert!(seen(&Subject::GROWN).contains("from the side") && !seen(&Subject::GROWN).contains("scene file"));
        assert_eq!(seen(std::slice::from_ref(&subject)), "Camera, lights and looks are those of the scene file.");
        assert!(seen(&[Subject::Wavy, subject.clone()]).contains("looks of some are those of its scene file"));
        let prepared = subject.prepared(20, Pose::SIDE, [8, 4]).unwrap();
        assert_eq!((prepared.strands, prepared.settings(Settings::default()).geometry.strands), (20, 0.25));
        assert_eq!((prepared.scene.film.width, prepared.scene.film.height), (8, 4));
        assert_eq!(subject.prepared(1000, Pose::SIDE, [8, 4]).unwrap().strands, 80, "no more than there are");
    }

    #[test]
    fn a_file_that_is_no_groom_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken.hair");
        std::fs::write(&path, "nothing").unwrap();
        let error = Subject::File(path).check().unwrap_err().to_string();
        assert!(error.contains("broken.hair"), "{error}");
    }
}
