//! The figures and claims of the papers behind Cuticle: rendered, measured and judged.
//!
//! An [`Experiment`] takes one figure or one sentence of a paper, does what it describes with our own code, and
//! brings back a [`Report`]: the claim in our words, the numbers that were measured beside those that were
//! expected, pictures, and a [`Verdict`] that follows from the numbers. [`page`] writes reports as Markdown.
//!
//! Every paper has its own module with a list of experiments; [`experiments`] is all of them.
//!
//! ```
//! let experiment = reproduce::find("hery-energy")?;
//! assert_eq!(experiment.paper, reproduce::Paper::Hery2012);
//! // A slip of the finger gets a hint.
//! let error = reproduce::find("hery-enrgy").unwrap_err();
//! assert_eq!(error.suggestion, Some("hery-energy"));
//! # Ok::<(), reproduce::UnknownExperiment>(())
//! ```

pub mod chart;
pub mod page;
pub mod raster;
pub mod render;
pub mod stats;

mod deon;
mod experiment;
mod hery;
mod hunz;
mod sky;
mod sphere;

pub use experiment::{
    Context, Error, Expected, Experiment, Measured, Outcome, Paper, Picture, Progress, Report, Table, Verdict, number,
};

/// All experiments, paper by paper, in the order of the papers' figures.
pub fn experiments() -> impl Iterator<Item = &'static Experiment> {
    [hery::EXPERIMENTS, deon::EXPERIMENTS, hunz::EXPERIMENTS].into_iter().flatten()
}

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
    if let Some(found) = experiments().find(|e| e.name == name) {
        return Ok(found);
    }
    let wanted = name.to_lowercase();
    let nearest = experiments().map(|e| (strsim::damerau_levenshtein(&wanted, e.name), e.name)).min();
    // A third of the letters may be wrong; beyond that a hint would only puzzle.
    let allowed = 1 + name.chars().count() / 3;
    let suggestion = nearest.filter(|(distance, _)| *distance <= allowed).map(|(_, name)| name);
    Err(UnknownExperiment { name: name.to_owned(), suggestion })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_fit_for_files() {
        let mut names: Vec<&str> = experiments().map(|e| e.name).collect();
        assert!(names.len() >= 6, "{names:?}");
        for name in &names {
            assert!(name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-'), "{name}");
        }
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
        // The words of the command line are no names, nor is the index.
        assert!(!names.iter().any(|name| ["all", "list", "readme"].contains(name)));
    }

    #[test]
    fn a_name_far_from_all_gets_no_hint() {
        assert_eq!(find("zebra").unwrap_err().suggestion, None);
        assert!(find("hery-fig7").unwrap_err().to_string().contains("did you mean hery-fig"));
    }
}
