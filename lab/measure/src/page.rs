//! Measurements as Markdown: a page for each experiment with its numbers as CSV beside it, and an index.
//!
//! A page begins with a comment that holds its own row of the index. So the index can be written anew from the
//! pages that lie in the folder, whether one experiment was done this time or all of them; and a file that begins
//! otherwise is known to be somebody else's.

use std::path::Path;

use film::WriteError;
use raster::AdapterDescription;

use crate::session::{Plan, Remarks};
use crate::table::{ADAPTER_HEADS, escaped};
use crate::{EXPERIMENTS, Experiment, Finding, Table, Verdict};

/// How an index begins; what begins otherwise is somebody else's file.
pub const INDEX_TITLE: &str = "# Measurements\n";

/// What pages from a software adapter say.
pub const SOFTWARE: &str = "Software adapter: only ratios count, and even they are those of a CPU. Memory, fragments \
                            and pictures are as on any adapter.";

/// A picture of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// The end of its file name, after the experiment's: lower case, digits, hyphens.
    pub stem: &'static str,
    /// What is to be seen.
    pub caption: String,
    /// The file: PNG.
    pub png: Vec<u8>,
}

/// What an experiment brings back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// What was done, a paragraph each.
    pub text: Vec<String>,
    /// What the thesis found, or we aim at, and whether it was found here.
    pub findings: Vec<Finding>,
    /// Raw numbers.
    pub tables: Vec<Table>,
    /// Plots and pictures, in the order in which they are shown.
    pub pictures: Vec<Picture>,
    /// What is odd about the numbers.
    pub remarks: Vec<String>,
}

impl Page {
    pub(crate) fn remarked(self, remarks: Remarks) -> Self {
        Self { remarks: remarks.into_lines(), ..self }
    }
}

/// What pages say about how they came to be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// The adapter.
    pub adapter: AdapterDescription,
    /// The day, as it shall stand on the pages; `None`: no day. Nothing here reads a clock for it.
    pub date: Option<String>,
    /// What was measured with.
    pub plan: Plan,
    /// The part of the adapter's name that was asked for.
    pub asked: Option<String>,
}

impl Run {
    /// Adapter, size, frames where times were taken, day.
    fn told(&self, timed: bool) -> String {
        let [width, height] = self.plan.size;
        let mut out = format!("Adapter: {}. {width} x {height} pixels", self.adapter);
        if timed {
            out += &match self.plan.repeats {
                1 => ", one frame after those that do not count".to_owned(),
                n => format!(", medians of {n} frames after those that do not count"),
            };
        }
        if let Some(date) = &self.date {
            out += &format!("; {}", date.replace('\n', " "));
        }
        out += ".\n\n";
        if self.adapter.software {
            out += &format!("**{SOFTWARE}**\n\n");
        }
        out
    }
}

/// Whether a file is a page of ours, so that another may take its place.
pub fn is_page(text: &[u8]) -> bool {
    text.starts_with(ROW.as_bytes())
}

/// Whether a file is a table of ours, by its heads.
pub fn is_table(text: &[u8]) -> bool {
    text.split(|byte| *byte == b'\n').next().is_some_and(|heads| heads.ends_with(ADAPTER_HEADS.as_bytes()))
}

/// The names of the files of an experiment that [`is_page`] and [`is_table`] tell from others': first the page.
pub fn files(experiment: &Experiment) -> [String; 3] {
    let name = experiment.name;
    [format!("{name}.md"), csv_name(name, 0), csv_name(name, 1)]
}

/// Writes the page of an experiment into `folder`, which must be there: `NAME.md`, `NAME.csv` (further tables
/// `NAME-2.csv`) and `NAME-STEM.png`. The page comes last, so that it never points at what is missing.
///
/// # Errors
/// When a file cannot be written; each is complete or not there.
pub fn write(folder: &Path, experiment: &Experiment, page: &Page, run: &Run) -> Result<(), WriteError> {
    let name = experiment.name;
    for picture in &page.pictures {
        film::write_bytes(folder.join(format!("{name}-{}.png", picture.stem)), &picture.png)?;
    }
    for (index, table) in page.tables.iter().enumerate() {
        film::write_bytes(folder.join(csv_name(name, index)), table.csv(&run.adapter).as_bytes())?;
    }
    film::write_bytes(folder.join(format!("{name}.md")), text(experiment, page, run).as_bytes())
}

/// Writes `README.md`, the index over all experiments; those whose pages are not in `folder` are named without
/// findings.
///
/// # Errors
/// When the file cannot be written.
pub fn write_index(folder: &Path) -> Result<(), WriteError> {
    let mut out = format!(
        "{INDEX_TITLE}\nThe measurements of Hunz 2016, *Interactive Physically-Based Hair Rendering*, chapter 6, repeated \
         with the interactive renderer. What the thesis found stands on each page beside what was found here, and so do \
         our own aims; whether they agree follows from the numbers.\n\n    cuticle measure all -o FOLDER\n\n\
         | experiment | thesis | what | reproduced | our aims met | adapter |\n|---|---|---|---|---|---|\n"
    );
    for experiment in EXPERIMENTS {
        let page = std::fs::read_to_string(folder.join(format!("{}.md", experiment.name))).unwrap_or_default();
        match page.lines().next().and_then(|line| line.strip_prefix(ROW)?.strip_suffix(ROW_END)) {
            Some(row) => out += row,
            None => {
                out += &format!(
                    "| {} | {} | {} | not measured | | |",
                    experiment.name, experiment.figure, experiment.title
                )
            }
        }
        out.push('\n');
    }
    film::write_bytes(folder.join("README.md"), out.as_bytes())
}

const ROW: &str = "<!-- row: ";
const ROW_END: &str = " -->";

fn csv_name(experiment: &str, index: usize) -> String {
    match index {
        0 => format!("{experiment}.csv"),
        _ => format!("{experiment}-{}.csv", index + 1),
    }
}

/// The page itself.
pub fn text(experiment: &Experiment, page: &Page, run: &Run) -> String {
    let Experiment { name, figure, title, timed, .. } = experiment;
    let kind = if run.adapter.software { " (software)" } else { "" };
    let mut out = format!(
        "{ROW}| [{name}]({name}.md) | {figure} | {title} | {} | {} | {}{kind} |{ROW_END}\n",
        Finding::tally(&page.findings),
        Finding::aims(&page.findings),
        escaped(&run.adapter.name)
    );
    out += &format!("# {title}\n\nHunz 2016, {figure}.\n\n{}", run.told(*timed));
    for paragraph in &page.text {
        out += &format!("{paragraph}\n\n");
    }
    if !page.findings.is_empty() {
        out += "## Findings\n\n| claim | wanted | here | |\n|---|---|---|---|\n";
        for finding in &page.findings {
            let verdict = match finding.verdict {
                Verdict::No => format!("**{}**", finding.told()),
                _ => finding.told().to_owned(),
            };
            let ours = if finding.ours { " (our aim)" } else { "" };
            out += &format!(
                "| {}{ours} | {} | {} | {verdict} |\n",
                escaped(&finding.claim),
                escaped(&finding.wanted),
                escaped(&finding.found)
            );
        }
        out.push('\n');
    }
    for picture in &page.pictures {
        // A caption may hold brackets, the text that stands for a picture may not.
        let alt = picture.caption.replace(['[', ']', '\n'], " ");
        out += &format!("![{alt}]({name}-{}.png)\n\n{}\n\n", picture.stem, picture.caption);
    }
    if !page.tables.is_empty() {
        out += "## Numbers\n\n";
    }
    for (index, table) in page.tables.iter().enumerate() {
        let file = csv_name(name, index);
        out += &format!("{}\nAll digits: [{file}]({file}).\n\n", table.markdown());
    }
    if !page.remarks.is_empty() {
        out += "## Remarks\n\n";
        for remark in &page.remarks {
            out += &format!("- {}\n", remark.replace('\n', " "));
        }
        out.push('\n');
    }
    out + &format!("## How to do it again\n\n    {}\n", run.plan.command(name, run.asked.as_deref()).replace('\n', " "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(software: bool) -> Run {
        let adapter = AdapterDescription {
            name: "Some | GPU".into(),
            backend: "Vulkan".into(),
            driver: "driver 1".into(),
            software,
        };
        let plan = Plan { repeats: 3, ..Plan::default() };
        Run { adapter, date: Some("2026-01-31".into()), plan, asked: Some("gpu".into()) }
    }

    fn page(ratio: f64) -> Page {
        let mut table = Table::new("Times.", ["technique", "ms"]);
        table.row(["dom".into(), 6.3_f64.into()]);
        Page {
            text: vec!["What was done.".into()],
            findings: vec![
                Finding::ratio("memory of the two", 0.39, ratio, 0.1),
                Finding::below("memory again", 0.45, ratio).ours(),
            ],
            tables: vec![table.clone(), table],
            pictures: vec![Picture { stem: "plot", caption: "Time [ms]".into(), png: vec![1, 2, 3] }],
            remarks: vec!["odd".into()],
        }
    }

    #[test]
    fn a_page_says_all_there_is() {
        let experiment = crate::find("memory").unwrap();
        let text = text(experiment, &page(0.4), &run(true));
        for part in [
            "# Memory of transparency",
            "| memory of the two | 0.390 ± 10 % | 0.400 | reproduced |",
            "| memory again (our aim) | below 0.450 | 0.400 | met |",
            "![Time  ms ](memory-plot.png)",
            "| dom | 6.30 |",
            "[memory.csv](memory.csv)",
            "[memory-2.csv](memory-2.csv)",
            "- odd",
            "861 pixels; 2026-01-31.",
            SOFTWARE,
            "    cuticle measure memory -o FOLDER --size 656x861",
            " --repeats 3 --adapter gpu\n",
            "| 1 of 1 | 1 of 1 | Some \\| GPU (software) |",
        ] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
        let text = super::text(experiment, &page(0.9), &run(false));
        assert!(text.contains("**not reproduced**") && text.contains("**not met**"), "{text}");
        assert!(!text.contains(SOFTWARE) && !text.contains("medians"), "nothing is timed here: {text}");
        let timed = super::text(crate::find("shadows").unwrap(), &page(0.9), &run(false));
        assert!(timed.contains("861 pixels, medians of 3 frames"), "{timed}");
    }

    #[test]
    fn files_of_others_are_known_from_ours() {
        let folder = tempfile::tempdir().unwrap();
        let experiment = crate::find("memory").unwrap();
        write(folder.path(), experiment, &page(0.4), &run(false)).unwrap();
        let [text, tables @ ..] = files(experiment).map(|name| std::fs::read(folder.path().join(name)).unwrap());
        assert!(is_page(&text) && !is_table(&text));
        assert!(tables.iter().all(|table| is_table(table) && !is_page(table)));
        for other in ["", "# Memory\n", "a,b\n1,2\n", "a,b\n,adapter,software\n"] {
            assert!(!is_page(other.as_bytes()) && !is_table(other.as_bytes()), "{other:?}");
        }
    }

    #[test]
    fn the_index_remembers_what_was_not_done_again() {
        let folder = tempfile::tempdir().unwrap();
        let index = || std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        write_index(folder.path()).unwrap();
        assert!(index().starts_with(INDEX_TITLE));
        assert_eq!(index().matches("not measured").count(), EXPERIMENTS.len());
        write(folder.path(), crate::find("memory").unwrap(), &page(0.4), &run(false)).unwrap();
        write_index(folder.path()).unwrap();
        assert_eq!(index().matches("not measured").count(), EXPERIMENTS.len() - 1);
        assert!(
            index().contains("| [memory](memory.md) | fig. 42 | Memory of transparency | 1 of 1 | 1 of 1 |"),
            "{}",
            index()
        );
        assert_eq!(std::fs::read(folder.path().join("memory-plot.png")).unwrap(), [1, 2, 3]);
        assert_eq!(
            std::fs::read(folder.path().join("memory-2.csv")).unwrap(),
            b"technique,ms,adapter,software\ndom,6.3,Some | GPU,false\n"
        );
        // Nothing temporary stays: index, page, picture, two tables.
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 5);
    }
}
