//! Reports as Markdown: a page for each experiment and an index, written whole or not at all.
//!
//! A page begins with a comment that holds its own row of the index. So the index can be written anew from the
//! pages that lie in the folder, whether one experiment was done this time or all of them.

use std::fmt::Write as _;
use std::path::Path;

use film::WriteError;

use crate::experiment::{Expected, Measured, Outcome, Table, number};
use crate::{Experiment, experiments};

/// What pages say about how they came to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The day, as it shall stand on the pages; `None`: no day. Nothing here reads a clock for it.
    pub date: Option<String>,
    /// The context's `scale`.
    pub quality: f64,
    /// The context's `seed`.
    pub seed: u32,
}

impl Run {
    /// The command that does an experiment again.
    pub fn command(&self, name: &str) -> String {
        format!("cuticle reproduce {name} --quality {} --seed {} -o FOLDER", self.quality, self.seed)
    }
}

/// Writes the page of an experiment with its pictures into `folder`, which must be there: `NAME.md` and
/// `NAME-STEM.png`. Pictures come first, so that a page never points at what is missing.
///
/// # Errors
/// When a file cannot be written.
pub fn write(folder: &Path, outcome: &Outcome, run: &Run) -> Result<(), WriteError> {
    let name = outcome.experiment.name;
    for picture in &outcome.report.pictures {
        film::write_bytes(folder.join(format!("{name}-{}.png", picture.stem)), &picture.png)?;
    }
    film::write_bytes(folder.join(format!("{name}.md")), text(outcome, run).as_bytes())
}

/// Writes `README.md`, the index over all experiments; those whose pages are not in `folder` are named without
/// a verdict.
///
/// # Errors
/// When the file cannot be written.
pub fn write_index(folder: &Path) -> Result<(), WriteError> {
    let mut out = String::from(
        "# Reproductions\n\nWhat the papers behind Cuticle claim, tried with our own code. Claims are in our words; \
         verdicts follow from the numbers on the pages, by the ranges that stand beside them.\n\n    cuticle reproduce \
         all -o FOLDER\n\n| experiment | paper | claim | we found | verdict |\n|---|---|---|---|---|\n",
    );
    for experiment in experiments() {
        let page = std::fs::read_to_string(folder.join(format!("{}.md", experiment.name))).unwrap_or_default();
        let row = page.lines().next().and_then(|line| line.strip_prefix(ROW)?.strip_suffix(ROW_END));
        match row {
            Some(row) => out.push_str(row),
            None => out += &format!("| {} | {} | | | not tried |", experiment.name, source(experiment)),
        }
        out.push('\n');
    }
    film::write_bytes(folder.join("README.md"), out.as_bytes())
}

const ROW: &str = "<!-- row: ";
const ROW_END: &str = " -->";

/// The page itself.
pub fn text(outcome: &Outcome, run: &Run) -> String {
    let Outcome { experiment, report, elapsed } = outcome;
    let name = experiment.name;
    let mut out = format!(
        "{ROW}| [{name}]({name}.md) | {} | {} | {} | **{}** |{ROW_END}\n",
        source(experiment),
        cell(&report.claim),
        cell(&report.figure),
        report.verdict
    );
    out += &format!("# {}\n\n{}, {}.\n\n", experiment.title, experiment.paper.citation(), experiment.figure);
    out += &format!("**Claim.** {}\n\n", report.claim);
    out += &format!("**We found.** {}\n\n", report.figure);
    out += &format!("**Verdict: {}.**\n\n", report.verdict);
    for picture in &report.pictures {
        // A caption may hold brackets, the text that stands for a picture may not.
        let alt = picture.caption.replace(['[', ']', '\n'], " ");
        out += &format!("![{alt}]({name}-{}.png)\n\n{}\n\n", picture.stem, picture.caption);
    }
    if !report.measured.is_empty() {
        out += "## Numbers\n\n| what | measured | expected | as expected | decides |\n|---|---|---|---|---|\n";
        for m in &report.measured {
            // Writing to a string cannot fail.
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} | {} |",
                cell(&m.label),
                with_unit(number(m.value), m.unit),
                expected(m),
                match m.meets() {
                    None => "",
                    Some(true) => "yes",
                    Some(false) => "**no**",
                },
                if m.decides { "yes" } else { "" }
            );
        }
        out += "\nThe verdict is that of the numbers that decide: all as expected, some, or none.\n\n";
    }
    if !report.text.is_empty() {
        out += "## What was done\n\n";
        for paragraph in &report.text {
            out += &format!("{paragraph}\n\n");
        }
    }
    for table in &report.tables {
        out += &markdown(table);
    }
    out += &format!("## How to do it again\n\n    {}\n\n", run.command(name));
    out += &format!("Took {:.1} s", elapsed.as_secs_f64());
    if let Some(date) = &run.date {
        out += &format!(", {}", date.replace('\n', " "));
    }
    out += ".\n";
    out
}

/// Paper and part of it.
fn source(experiment: &Experiment) -> String {
    format!("{}, {}", experiment.paper.short(), experiment.figure)
}

fn with_unit(number: String, unit: &str) -> String {
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

fn expected(m: &Measured) -> String {
    match m.expected {
        Expected::Nothing => String::new(),
        Expected::About { value, within } => {
            format!("{} ± {} %", with_unit(number(value), m.unit), number(100.0 * within))
        }
        Expected::Between(least, most) if least == f64::NEG_INFINITY => {
            format!("at most {}", with_unit(number(most), m.unit))
        }
        Expected::Between(least, most) if most == f64::INFINITY => {
            format!("at least {}", with_unit(number(least), m.unit))
        }
        Expected::Between(least, most) => format!("{} to {}", number(least), with_unit(number(most), m.unit)),
    }
}

fn markdown(table: &Table) -> String {
    let mut out = format!("{}\n\n", table.caption);
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|c| cell(c)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    out += &line(&table.columns);
    out += &format!("|{}\n", "---|".repeat(table.columns.len()));
    for row in &table.rows {
        out += &line(row);
    }
    out.push('\n');
    out
}

/// Text that fits into a cell of a table, and into a comment.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ").replace("-->", "->")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::{Measured, Picture, Report, Verdict};

    fn outcome(value: f64) -> Outcome {
        let measured = vec![Measured::new("ratio | of two", value, "%").between(0.0, 2.0).decides()];
        let mut report = Report::new("A claim\nin two lines", "found", measured);
        report.text.push("A paragraph.".into());
        let mut table = Table::new("A table", ["a", "b"]);
        table.row(["1|2".to_owned(), "3".to_owned()]);
        report.tables.push(table);
        report.pictures.push(Picture { stem: "strip", caption: "Two [hairs]".into(), png: vec![1, 2, 3] });
        let experiment = crate::find("hery-energy").unwrap();
        Outcome { experiment, report, elapsed: Duration::from_millis(1500) }
    }

    fn run() -> Run {
        Run { date: Some("2026-01-02".into()), quality: 0.5, seed: 7 }
    }

    #[test]
    fn a_page_says_all_there_is() {
        let text = text(&outcome(1.0), &run());
        for part in [
            "**Verdict: holds.**",
            "| ratio \\| of two | 1 % | 0 to 2 % | yes | yes |",
            "![Two  hairs ](hery-energy-strip.png)",
            "| 1\\|2 | 3 |",
            "cuticle reproduce hery-energy --quality 0.5 --seed 7 -o FOLDER",
            "Took 1.5 s, 2026-01-02.",
            "A claim in two lines",
        ] {
            assert!(text.contains(part), "{part} is missing in\n{text}");
        }
    }

    #[test]
    fn the_index_remembers_what_was_not_done_again() {
        let folder = tempfile::tempdir().unwrap();
        let index = || std::fs::read_to_string(folder.path().join("README.md")).unwrap();
        write_index(folder.path()).unwrap();
        assert!(!index().contains("**holds**"));
        write(folder.path(), &outcome(1.0), &run()).unwrap();
        write_index(folder.path()).unwrap();
        assert!(index().contains("| [hery-energy](hery-energy.md) |") && index().contains("**holds**"), "{}", index());
        assert_eq!(std::fs::read(folder.path().join("hery-energy-strip.png")).unwrap(), [1, 2, 3]);
        let other = outcome(5.0);
        assert_eq!(other.report.verdict, Verdict::DoesNotHold);
        write(folder.path(), &other, &run()).unwrap();
        write_index(folder.path()).unwrap();
        assert!(index().contains("**does not hold**") && !index().contains("**holds**"));
        // Nothing temporary stays: page, picture, index.
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = write(&folder.path().join("absent"), &outcome(1.0), &run()).unwrap_err();
        assert!(error.to_string().contains("absent"), "{error}");
    }
}
