//! `cuticle reproduce`: the papers' figures, rendered, measured and judged, as pages in a folder.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;

use ::reproduce::page::{self, Run};
use ::reproduce::{Context, Error, Experiment, Outcome, Progress};
use anyhow::{Context as _, bail};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use job::Cancel;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Experiments by name; `all` for all of them, `list` to see what there is
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    /// Folder for pages and pictures; made if it is not there
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Effort: 1 is what the published pages show; samples scale with it
    #[arg(long, value_name = "Q", default_value_t = 1.0, allow_negative_numbers = true)]
    quality: f64,
    /// Changes the noise and nothing else
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u32,
    /// Threads; one per processor if left out
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// The day to put on the pages, such as 2026-01-31; none if left out
    #[arg(long, value_name = "DAY")]
    date: Option<String>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Stopped from outside, as shells count it: 128 + SIGINT.
const INTERRUPTED: u8 = 130;

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if args.names.iter().any(|name| name == "list") {
        if args.names.len() > 1 {
            bail!("`list` stands alone: cuticle reproduce list");
        }
        super::emit(&list())?;
        return Ok(ExitCode::SUCCESS);
    }
    let chosen = chosen(&args.names)?;
    if !(1e-3..=100.0).contains(&args.quality) {
        bail!("--quality is {}; it must lie between 0.001 and 100, 1 is what the published pages show", args.quality);
    }
    let Some(folder) = &args.output else {
        bail!("pages and pictures need a folder: add -o FOLDER");
    };
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let index = folder.join("README.md");
    if std::fs::read(&index).is_ok_and(|old| !old.starts_with(b"# Reproductions\n")) {
        bail!("{} is not an index of reproductions and would be overwritten; choose another folder", index.display());
    }
    // Found out now, and not after minutes of rendering.
    page::write_index(folder)?;

    let cancel = Cancel::default();
    {
        let cancel = cancel.clone();
        ctrlc::set_handler(move || {
            if cancel.is_cancelled() {
                std::process::exit(i32::from(INTERRUPTED));
            }
            cancel.cancel();
            super::say("\nstopping; pages that are finished stay (once more to stop at once)");
        })
        .context("cannot listen for Ctrl-C")?;
    }

    let bar = bar(args.quiet);
    let run = Run { date: args.date.clone(), quality: args.quality, seed: args.seed };
    for (index, &experiment) in chosen.iter().enumerate() {
        let name = experiment.name;
        let heading = format!("{name} ({} of {})", index + 1, chosen.len());
        let shown = Mutex::new(String::new());
        let progress = |progress: Progress<'_>| {
            bar.set_position((progress.done * 1000.0) as u64);
            // Messages are drawn anew; only changes are worth it. A poisoned lock costs a message.
            if let Ok(mut shown) = shown.lock()
                && *shown != progress.step
            {
                progress.step.clone_into(&mut shown);
                bar.set_message(format!("{heading}: {}", progress.step));
            }
        };
        let context = Context {
            scale: args.quality,
            seed: args.seed,
            threads: args.threads.map_or(0, usize::from),
            cancel: cancel.clone(),
            folder: Some(folder.clone()),
            progress: &progress,
        };
        let outcome = match Outcome::of(experiment, &context) {
            Ok(outcome) => outcome,
            Err(Error::Cancelled) => {
                bar.finish_and_clear();
                super::say(&format!("stopped in {name}; nothing of it was written"));
                return Ok(ExitCode::from(INTERRUPTED));
            }
            Err(error) => {
                bar.finish_and_clear();
                return Err(anyhow::Error::new(error).context(format!("the experiment {name} failed")));
            }
        };
        page::write(folder, &outcome, &run)?;
        page::write_index(folder)?;
        if !args.quiet {
            let line = format!(
                "{name}: {} ({:.1} s): {}",
                outcome.report.verdict,
                outcome.elapsed.as_secs_f64(),
                outcome.report.figure
            );
            bar.suspend(|| super::say(&line));
        }
    }
    bar.finish_and_clear();
    if !args.quiet {
        super::say(&format!("wrote {} pages into {}", chosen.len(), folder.display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// The experiments that were asked for, each once, in the order of the list.
fn chosen(names: &[String]) -> anyhow::Result<Vec<&'static Experiment>> {
    for name in names.iter().filter(|name| *name != "all") {
        if let Err(error) = ::reproduce::find(name) {
            let hint = if error.suggestion.is_some() { "" } else { "; see cuticle reproduce list" };
            bail!("{error}{hint}");
        }
    }
    let all = names.iter().any(|name| name == "all");
    Ok(::reproduce::experiments().filter(|e| all || names.iter().any(|name| name == e.name)).collect())
}

/// One line for each experiment.
fn list() -> String {
    let width = ::reproduce::experiments().map(|e| e.name.len()).max().unwrap_or(0);
    ::reproduce::experiments()
        .map(|e| format!("{:width$}  {}, {}: {}\n", e.name, e.paper.short(), e.figure, e.title))
        .collect()
}

/// Hidden where nobody can see it move.
fn bar(quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
    // The template is a constant; were it wrong, the bar would merely be plain.
    if let Ok(style) = ProgressStyle::with_template("{bar:24} {msg}") {
        bar.set_style(style);
    }
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn experiments_are_chosen_once_each_in_their_order() {
        let got: Vec<&str> = chosen(&names("hery-fig2 hery-fig1 hery-fig2")).unwrap().iter().map(|e| e.name).collect();
        assert_eq!(got, ["hery-fig1", "hery-fig2"]);
        assert_eq!(chosen(&names("all")).unwrap().len(), ::reproduce::experiments().count());
        let error = chosen(&names("all hery-fgi1")).unwrap_err().to_string();
        assert!(error.contains("did you mean hery-fig1"), "{error}");
        let error = chosen(&names("zebra")).unwrap_err().to_string();
        assert!(error.contains("cuticle reproduce list"), "{error}");
    }

    #[test]
    fn the_list_has_a_line_for_each() {
        assert_eq!(list().lines().count(), ::reproduce::experiments().count());
    }
}
