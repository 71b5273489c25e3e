//! `cuticle measure`: the thesis's measurements of the interactive renderer, as pages in a folder.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;

use ::measure::page::{self, Run};
use ::measure::{Error, Experiment, Finding, Plan, Progress, Session, Subject};
use anyhow::{Context as _, bail};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use job::Cancel;
use raster::{GpuOptions, Tier};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Experiments by name; `all` for all of them (the default), `list` to see what there is
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Folder for pages, tables and pictures; made if it is not there
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Picture size
    #[arg(long, default_value = "656x861", allow_hyphen_values = true, value_parser = super::input::parse_size)]
    size: (u32, u32),
    /// Numbers of strands; only `shading` uses more than the largest
    #[arg(
        long,
        value_name = "N,..",
        value_delimiter = ',',
        default_value = "10000,20000,30000,40000,50000",
        allow_negative_numbers = true
    )]
    strands: Vec<u32>,
    /// straight, wavy, curly, or files (.hair, .toml) of different names; the first one where one is enough
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', default_value = "straight,wavy,curly")]
    grooms: Vec<String>,
    /// Frames that are timed, after those that are not [default: 5, with --quick 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    repeats: Option<u32>,
    /// Part of the adapter's name; the most capable one if left out
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// The day to put on the pages, such as 2026-01-31; none if left out
    #[arg(long, value_name = "DAY")]
    date: Option<String>,
    /// Leave out the dearest settings: for software adapters, with a small picture and few strands
    #[arg(long)]
    quick: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Stopped from outside, as shells count it: 128 + SIGINT.
pub(crate) const INTERRUPTED: u8 = 130;

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if args.names.iter().any(|name| name == "list") {
        if args.names.len() > 1 {
            bail!("`list` stands alone: cuticle measure list");
        }
        super::emit(&list())?;
        return Ok(ExitCode::SUCCESS);
    }
    let chosen = chosen(&args.names)?;
    let subjects = args.grooms.iter().map(|name| Subject::named(name)).collect::<Result<Vec<_>, _>>()?;
    let repeats = args.repeats.unwrap_or(if args.quick { 1 } else { 5 });
    let size = [args.size.0, args.size.1];
    let plan = Plan { size, strands: args.strands.clone(), subjects, repeats, quick: args.quick };
    plan.check()?;
    let Some(folder) = &args.output else {
        bail!("pages, tables and pictures need a folder: add -o FOLDER");
    };
    check_folder(folder, page::INDEX_TITLE)?;
    for experiment in &chosen {
        let [text, tables @ ..] = page::files(experiment);
        check_file(&folder.join(text), page::is_page)?;
        for table in tables {
            check_file(&folder.join(table), page::is_table)?;
        }
    }
    // Files are tried before the device is opened and minutes are spent.
    for subject in &plan.subjects {
        subject.check()?;
    }

    let cancel = cancel_on_interrupt("stopping; pages that are finished stay (once more to stop at once)")?;
    let bar = bar(args.quiet);
    let heading = Mutex::new(String::new());
    let progress = |progress: Progress<'_>| {
        bar.set_position((progress.done * 1000.0) as u64);
        // A poisoned lock costs a message.
        if let Ok(heading) = heading.lock() {
            bar.set_message(format!("{heading}: {}", progress.step));
        }
    };
    let options = GpuOptions { adapter: args.adapter.clone(), tier: Tier::Native };
    let session = Session::open(plan.clone(), &options, cancel, &progress)?;
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    page::write_index(folder)?;
    let run = Run { adapter: session.adapter().clone(), date: args.date.clone(), plan, asked: args.adapter.clone() };
    if !args.quiet {
        bar.suspend(|| super::say(&run.adapter.to_string()));
    }
    for (index, experiment) in chosen.iter().enumerate() {
        let name = experiment.name;
        if let Ok(mut heading) = heading.lock() {
            *heading = format!("{name} ({} of {})", index + 1, chosen.len());
        }
        let page = match (experiment.run)(&session) {
            Ok(page) => page,
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
        page::write(folder, experiment, &page, &run)?;
        page::write_index(folder)?;
        if !args.quiet {
            let (tally, aims) = (Finding::tally(&page.findings), Finding::aims(&page.findings));
            let line = format!("{name}: findings of the thesis reproduced {tally}, our aims met {aims}");
            bar.suspend(|| super::say(&line));
        }
    }
    bar.finish_and_clear();
    if !args.quiet {
        let pages = if chosen.len() == 1 { "page" } else { "pages" };
        super::say(&format!("wrote {} {pages} into {}", chosen.len(), folder.display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// The experiments that were asked for, each once, in the order of the list; all without a name.
fn chosen(names: &[String]) -> anyhow::Result<Vec<&'static Experiment>> {
    for name in names.iter().filter(|name| *name != "all") {
        if let Err(error) = ::measure::find(name) {
            let hint = if error.suggestion.is_some() { "" } else { "; see cuticle measure list" };
            bail!("{error}{hint}");
        }
    }
    let all = names.is_empty() || names.iter().any(|name| name == "all");
    Ok(::measure::EXPERIMENTS.iter().filter(|e| all || names.iter().any(|name| name == e.name)).collect())
}

/// One line for each experiment.
fn list() -> String {
    let width = ::measure::EXPERIMENTS.iter().map(|e| e.name.len()).max().unwrap_or(0);
    ::measure::EXPERIMENTS.iter().map(|e| format!("{:width$}  {}: {}\n", e.name, e.figure, e.title)).collect()
}

/// Refuses what cannot become a folder of pages, and folders whose README is somebody's own text or cannot be read.
pub(crate) fn check_folder(folder: &Path, title: &str) -> anyhow::Result<()> {
    if folder.exists() && !folder.is_dir() {
        bail!("{} is a file; choose a folder for the pages", folder.display());
    }
    check_file(&folder.join("README.md"), |old| old.starts_with(title.as_bytes()))
}

/// Refuses to put a file where there is something else than one `of_ours`.
pub(crate) fn check_file(path: &Path, of_ours: impl Fn(&[u8]) -> bool) -> anyhow::Result<()> {
    if path.is_dir() {
        bail!("{} is a folder, and a file would stand there; choose another folder for the pages", path.display());
    }
    match std::fs::read(path) {
        Ok(old) if of_ours(&old) => Ok(()),
        Ok(_) => bail!("{} is somebody's own file and would be overwritten; choose another folder", path.display()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        // Whose it is cannot be told, so it is not overwritten.
        Err(error) => {
            bail!("{} would be overwritten, and cannot be read: {error}; choose another folder", path.display())
        }
    }
}

/// A flag that Ctrl-C sets; the second time ends the program.
pub(crate) fn cancel_on_interrupt(message: &'static str) -> anyhow::Result<Cancel> {
    let cancel = Cancel::default();
    let flag = cancel.clone();
    ctrlc::set_handler(move || {
        if flag.is_cancelled() {
            std::process::exit(i32::from(INTERRUPTED));
        }
        flag.cancel();
        super::say(&format!("\n{message}"));
    })
    .context("cannot listen for Ctrl-C")?;
    Ok(cancel)
}

/// Hidden where nobody can see it move.
pub(crate) fn bar(quiet: bool) -> ProgressBar {
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
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn experiments_are_chosen_once_each_in_their_order() {
        let got: Vec<&str> = chosen(&names("memory shadows memory")).unwrap().iter().map(|e| e.name).collect();
        assert_eq!(got, ["shadows", "memory"]);
        for all in ["", "all", "shadows all"] {
            assert_eq!(chosen(&names(all)).unwrap().len(), ::measure::EXPERIMENTS.len());
        }
        let error = chosen(&names("zebra")).unwrap_err().to_string();
        assert!(error.contains("cuticle measure list"), "{error}");
    }
}
