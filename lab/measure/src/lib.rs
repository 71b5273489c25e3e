//! What the interactive renderer's techniques cost, and how far their pictures are from the truth.
//!
//! An [`Experiment`] repeats a measurement of Hunz 2016 (chapter 6) with our own renderer and brings back a [`Page`]:
//! tables of raw numbers, plots, pictures, and [`Finding`]s. A finding holds what the thesis found, or what we aim at,
//! what was measured here, and whether that is the same order or ratio; it is computed from the numbers and never
//! written by hand.
//! [`page`] writes pages as Markdown with CSV beside them.
//!
//! [`truth`] holds combinations of techniques against the path tracer.
//!
//! Times of a software adapter say nothing of GPUs; every page from one says so.
//!
//! ```
//! let experiment = measure::find("shadows")?;
//! assert_eq!(experiment.figure, "fig. 36");
//! // A slip of the finger gets a hint.
//! assert_eq!(measure::find("shadwos").unwrap_err().suggestion, Some("shadows"));
//! # Ok::<(), measure::UnknownExperiment>(())
//! ```

pub mod page;
pub mod truth;

mod finding;
mod memory;
mod models;
mod pictures;
mod quality;
mod session;
mod shading;
mod shadows;
mod sheet;
mod subject;
mod table;
mod transparency;

use std::path::PathBuf;

pub use finding::{Finding, Verdict};
pub use page::{Page, Picture, Run};
pub use session::{Plan, PlanError, Progress, Session, THESIS_VIEWPORT, shell_word};
pub use subject::{Subject, UnknownSubject};
pub use table::{Cell, Table, number};

/// One measurement of the thesis.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// What it is called on the command line; also the name of its page, without the ending.
    pub name: &'static str,
    /// Where the thesis has it.
    pub figure: &'static str,
    /// A heading.
    pub title: &'static str,
    /// Whether it takes times.
    pub timed: bool,
    /// Does it.
    pub run: fn(&Session<'_>) -> Result<Page, Error>,
}

/// All experiments, in the order of the thesis; what it does not have comes last.
pub static EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: "shading",
        figure: "fig. 33",
        title: "Shading for ever more strands",
        timed: true,
        run: shading::run,
    },
    Experiment { name: "models", figure: "figs. 29 to 32, 46", title: "Shading models", timed: true, run: models::run },
    Experiment {
        name: "shadows",
        figure: "fig. 36",
        title: "Shadows: technique, size and filter",
        timed: true,
        run: shadows::run,
    },
    Experiment {
        name: "transparency",
        figure: "fig. 41",
        title: "Transparency with and without shadows",
        timed: true,
        run: transparency::run,
    },
    Experiment { name: "memory", figure: "fig. 42", title: "Memory of transparency", timed: false, run: memory::run },
    Experiment {
        name: "pictures",
        figure: "figs. 34, 37, 38, 40, 47",
        title: "Pictures by every technique",
        timed: false,
        run: pictures::run,
    },
    Experiment {
        name: "quality",
        figure: "sec. 6.3.1",
        title: "Transparency against the full sort",
        timed: false,
        run: quality::run,
    },
];

/// There is no experiment of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no experiment {name:?}{}", .suggestion.map(|s| format!("; did you mean {s}?")).unwrap_or_default())]
pub struct UnknownExperiment {
    /// The name that was asked for.
    pub name: String,
    /// The name that was probably meant, where one is near.
    pub suggestion: Option<&'static str>,
}

/// The experiment of that name.
///
/// # Errors
/// When there is none; the error knows the nearest name.
pub fn find(name: &str) -> Result<&'static Experiment, UnknownExperiment> {
    EXPERIMENTS.iter().find(|e| e.name == name).ok_or_else(|| UnknownExperiment {
        name: name.to_owned(),
        suggestion: nearest(name, EXPERIMENTS.iter().map(|e| e.name)),
    })
}

/// The known word that was probably meant.
pub(crate) fn nearest<S: AsRef<str> + Ord>(name: &str, known: impl Iterator<Item = S>) -> Option<S> {
    let wanted = name.to_lowercase();
    // A third of the letters may be wrong; beyond that a hint would only puzzle.
    let allowed = 1 + name.chars().count() / 3;
    let nearest = known.map(|word| (strsim::damerau_levenshtein(&wanted, word.as_ref()), word)).min()?;
    (nearest.0 <= allowed).then_some(nearest.1)
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// It was asked to end.
    #[error("stopped")]
    Cancelled,
    /// The interactive renderer.
    #[error(transparent)]
    Raster(#[from] raster::RasterError),
    /// A scene file that was named.
    #[error(transparent)]
    Load(Box<job::LoadError>),
    /// A scene of our own around a groom.
    #[error("the scene of the measurement is wrong: {0}")]
    Scene(Box<scene::SceneError>),
    /// A groom file that was named.
    #[error("cannot measure with the groom {}: {reason}", .path.display())]
    Groom {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The path tracer.
    #[error(transparent)]
    Run(#[from] job::RunError),
    /// Two pictures.
    #[error("the pictures cannot be compared: {0}")]
    Compare(#[from] film::CompareError),
    /// A figure.
    #[error("a picture cannot be drawn: {0}")]
    Picture(String),
    /// A file.
    #[error(transparent)]
    Write(#[from] film::WriteError),
}

impl From<raster::GpuError> for Error {
    fn from(error: raster::GpuError) -> Self {
        Self::Raster(error.into())
    }
}

impl From<job::LoadError> for Error {
    fn from(error: job::LoadError) -> Self {
        Self::Load(Box::new(error))
    }
}

impl From<scene::SceneError> for Error {
    fn from(error: scene::SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

impl From<plot::chart::PngError> for Error {
    fn from(error: plot::chart::PngError) -> Self {
        Self::Picture(error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_fit_for_files() {
        let mut names: Vec<&str> = EXPERIMENTS.iter().map(|e| e.name).collect();
        assert!(names.iter().all(|name| name.chars().all(|c| c.is_ascii_lowercase() || c == '-')), "{names:?}");
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        // The words of the command line are no names, nor is the index.
        assert!(!names.iter().any(|name| ["all", "list", "readme"].contains(name)));
    }

    #[test]
    fn a_name_far_from_all_gets_no_hint() {
        assert_eq!(find("zebra").unwrap_err().suggestion, None);
        assert!(find("memroy").unwrap_err().to_string().contains("did you mean memory?"));
    }
}
