//! What an experiment is, what it may ask for, and what it brings back.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use job::Cancel;

/// A paper whose claims are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paper {
    /// Hery & Ramamoorthi 2012.
    Hery2012,
    /// d'Eon, Marschner & Hanika 2013.
    DEon2013,
    /// Hunz 2016.
    Hunz2016,
}

impl Paper {
    /// Authors and year, for a table.
    pub fn short(self) -> &'static str {
        match self {
            Self::Hery2012 => "Hery & Ramamoorthi 2012",
            Self::DEon2013 => "d'Eon, Marschner & Hanika 2013",
            Self::Hunz2016 => "Hunz 2016",
        }
    }

    /// Authors, title and place.
    pub fn citation(self) -> &'static str {
        match self {
            Self::Hery2012 => {
                "C. Hery and R. Ramamoorthi, Importance Sampling of Reflection from Hair Fibers, Journal of Computer \
                 Graphics Techniques 1 (1), 2012"
            }
            Self::DEon2013 => {
                "E. d'Eon, S. Marschner and J. Hanika, Importance Sampling for Physically-Based Hair Fiber Models, \
                 SIGGRAPH Asia Technical Briefs, 2013"
            }
            Self::Hunz2016 => "J. Hunz, Interactive Physically-Based Hair Rendering, master's thesis, Koblenz, 2016",
        }
    }
}

/// One claim or figure, and how it is tried.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// What it is called on the command line; also the name of its page, without the ending.
    pub name: &'static str,
    /// Whose claim it is.
    pub paper: Paper,
    /// Which part of the paper: `Fig. 2`, `Sec. 3.4`.
    pub figure: &'static str,
    /// A heading.
    pub title: &'static str,
    /// Does it.
    pub run: fn(&Context<'_>) -> Result<Report, Error>,
}

/// How far an experiment is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress<'a> {
    /// What is being done.
    pub step: &'a str,
    /// How much of this step is done, 0 to 1.
    pub done: f64,
}

/// What an experiment may ask for.
#[derive(Clone)]
pub struct Context<'a> {
    /// Effort: 1 is what the published pages show. Samples scale with it, sides of pictures with its root.
    pub scale: f64,
    /// Changes the noise and nothing else.
    pub seed: u32,
    /// Threads; 0 is one per processor.
    pub threads: usize,
    /// Ends the experiment early, with [`Error::Cancelled`].
    pub cancel: Cancel,
    /// Where the pages go, for experiments that leave more behind than a page; `None`: nowhere.
    pub folder: Option<PathBuf>,
    /// Is told how far it is.
    pub progress: &'a (dyn Fn(Progress<'_>) + Sync),
}

impl fmt::Debug for Context<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Context")
            .field("scale", &self.scale)
            .field("seed", &self.seed)
            .field("threads", &self.threads)
            .field("folder", &self.folder)
            .finish_non_exhaustive()
    }
}

impl Context<'_> {
    /// A number of samples, frames or repetitions that is `full` at full quality.
    pub fn count(&self, full: u32) -> u32 {
        ((f64::from(full) * self.scale).round() as u32).max(2)
    }

    /// A side of a picture that is `full` pixels at full quality; never less than 16, never more than 4 times.
    pub fn pixels(&self, full: u32) -> u32 {
        ((f64::from(full) * self.scale.sqrt().min(4.0)).round() as u32).max(16)
    }

    /// Tells how far the present step is, and finds out whether to go on.
    ///
    /// # Errors
    /// When it was cancelled.
    pub fn step(&self, step: &str, done: f64) -> Result<(), Error> {
        (self.progress)(Progress { step, done });
        if self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Why an experiment brought nothing back.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// It was asked to end.
    #[error("stopped")]
    Cancelled,
    /// A scene of its own cannot be made: a defect of the experiment.
    #[error("the scene of the experiment is wrong: {0}")]
    Scene(Box<scene::SceneError>),
    /// Strands of its own cannot be made: a defect of the experiment.
    #[error("the strands of the experiment are wrong: {0}")]
    Groom(groom::GroomError),
    /// The renderer could not run.
    #[error(transparent)]
    Run(#[from] job::RunError),
    /// A picture could not be made.
    #[error("a picture cannot be made: {0}")]
    Picture(String),
    /// Nothing could be measured, and what was missing.
    #[error("there is nothing to measure: {0}")]
    Measure(&'static str),
}

impl From<scene::SceneError> for Error {
    fn from(error: scene::SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

impl From<groom::GroomError> for Error {
    fn from(error: groom::GroomError) -> Self {
        Self::Groom(error)
    }
}

/// What a number should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// It is only told.
    Nothing,
    /// This value, within a share of it.
    About {
        /// The value.
        value: f64,
        /// The share of it that a measurement may be off, `0.03` for 3 %.
        within: f64,
    },
    /// Between these two, both included.
    Between(f64, f64),
}

impl Expected {
    /// Whether `x` is as expected; `None` where nothing is. What is not a number never is.
    pub fn meets(self, x: f64) -> Option<bool> {
        match self {
            Self::Nothing => None,
            Self::About { value, within } => Some((x - value).abs() <= within * value.abs()),
            Self::Between(least, most) => Some((least..=most).contains(&x)),
        }
    }
}

/// One measured number.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// What was measured.
    pub label: String,
    /// The number.
    pub value: f64,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// What it should be, by the paper or by theory.
    pub expected: Expected,
    /// Whether the verdict depends on it.
    pub decides: bool,
}

impl Measured {
    /// A number that is only told.
    pub fn new(label: impl Into<String>, value: f64, unit: &'static str) -> Self {
        Self { label: label.into(), value, unit, expected: Expected::Nothing, decides: false }
    }

    /// It should be `value`, within the share `within` of it.
    #[must_use]
    pub fn about(self, value: f64, within: f64) -> Self {
        Self { expected: Expected::About { value, within }, ..self }
    }

    /// It should lie between the two.
    #[must_use]
    pub fn between(self, least: f64, most: f64) -> Self {
        Self { expected: Expected::Between(least, most), ..self }
    }

    /// The verdict depends on it.
    #[must_use]
    pub fn decides(self) -> Self {
        Self { decides: true, ..self }
    }

    /// Whether it is as expected; `None` where nothing is expected.
    pub fn meets(&self) -> Option<bool> {
        self.expected.meets(self.value)
    }
}

/// Whether a claim held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// In all that decides.
    Holds,
    /// In some of what decides.
    HoldsPartly,
    /// In nothing that decides.
    DoesNotHold,
}

impl Verdict {
    /// What follows from the numbers that decide: all as expected, some, or none. A number that should decide
    /// and expects nothing counts as not met.
    pub fn of(measured: &[Measured]) -> Self {
        let deciding = || measured.iter().filter(|m| m.decides);
        let met = deciding().filter(|m| m.meets() == Some(true)).count();
        match met {
            0 => Self::DoesNotHold,
            n if n == deciding().count() => Self::Holds,
            _ => Self::HoldsPartly,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Holds => "holds",
            Self::HoldsPartly => "holds partly",
            Self::DoesNotHold => "does not hold",
        })
    }
}

/// A picture of a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The end of its file name, after the experiment's: lower case, digits, hyphens.
    pub stem: &'static str,
    /// What is to be seen.
    pub caption: String,
    /// The file: PNG.
    pub png: Vec<u8>,
}

/// A table of a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it tells.
    pub caption: String,
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// Rows, each with as many cells as there are columns.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table.
    pub fn new<'c>(caption: impl Into<String>, columns: impl IntoIterator<Item = &'c str>) -> Self {
        let columns = columns.into_iter().map(str::to_owned).collect();
        Self { caption: caption.into(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }
}

/// What an experiment brings back.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// What the paper says, in our words; one or two sentences.
    pub claim: String,
    /// What we found, short enough for a table.
    pub figure: String,
    /// The numbers.
    pub measured: Vec<Measured>,
    /// Whether the claim held.
    pub verdict: Verdict,
    /// Paragraphs: what was done, what it shows, what was not tried.
    pub text: Vec<String>,
    /// Further numbers.
    pub tables: Vec<Table>,
    /// Pictures, in the order in which they are shown.
    pub pictures: Vec<Picture>,
}

impl Report {
    /// A report whose verdict follows from the numbers.
    pub fn new(claim: impl Into<String>, figure: impl Into<String>, measured: Vec<Measured>) -> Self {
        Self {
            claim: claim.into(),
            figure: figure.into(),
            verdict: Verdict::of(&measured),
            measured,
            text: Vec::new(),
            tables: Vec::new(),
            pictures: Vec::new(),
        }
    }
}

/// An experiment that was done.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Which.
    pub experiment: &'static Experiment,
    /// What it brought back.
    pub report: Report,
    /// How long it took.
    pub elapsed: Duration,
}

impl Outcome {
    /// Does an experiment and takes its time.
    ///
    /// # Errors
    /// Those of the experiment.
    pub fn of(experiment: &'static Experiment, context: &Context<'_>) -> Result<Self, Error> {
        let begin = std::time::Instant::now();
        let report = (experiment.run)(context)?;
        Ok(Self { experiment, report, elapsed: begin.elapsed() })
    }
}

/// A number for people: three to four digits that matter.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".into()
    } else if !x.is_finite() {
        "not a number".into()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{x:.2e}")
    } else {
        // Three digits that matter, and no zeros behind the point that say nothing.
        let decimals = (2 - size.log10().floor() as i32).clamp(0, 5) as usize;
        let text = format!("{x:.decimals$}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            false => text,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_follows_from_what_decides() {
        let good = || Measured::new("a", 1.0, "").between(0.0, 2.0).decides();
        let bad = || Measured::new("b", f64::NAN, "").between(0.0, 2.0).decides();
        let told = Measured::new("c", 9.0, "").between(0.0, 2.0);
        assert_eq!(Verdict::of(&[good(), told.clone()]), Verdict::Holds);
        assert_eq!(Verdict::of(&[good(), bad()]), Verdict::HoldsPartly);
        assert_eq!(Verdict::of(&[bad(), told.clone()]), Verdict::DoesNotHold);
        // Nothing decides: nothing was shown.
        assert_eq!(Verdict::of(&[told]), Verdict::DoesNotHold);
        assert_eq!(Verdict::of(&[good(), Measured::new("d", 1.0, "").decides()]), Verdict::HoldsPartly);
    }

    #[test]
    fn expectations_are_relative_or_ranges() {
        let about = Expected::About { value: -2.0, within: 0.1 };
        assert_eq!((about.meets(-2.19), about.meets(-2.21)), (Some(true), Some(false)));
        assert_eq!(Expected::Between(1.0, 2.0).meets(2.0), Some(true));
        assert_eq!(Expected::Nothing.meets(1.0), None);
    }

    #[test]
    fn numbers_keep_the_digits_that_matter() {
        assert_eq!(number(0.0), "0");
        assert_eq!(number(0.123_45), "0.123");
        assert_eq!(number(12.345), "12.3");
        assert_eq!((number(10.0), number(0.002), number(100.0)), ("10".into(), "0.002".into(), "100".into()));
        assert_eq!(number(-1234.5), "-1234");
        assert_eq!(number(1.2e-7), "1.20e-7");
    }
}
