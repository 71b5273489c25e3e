//! `cuticle compare-renderers`: the interactive renderer against the path tracer, as a page in a folder.

use std::path::PathBuf;
use std::process::ExitCode;

use ::measure::truth::{self, Combination, Context, Run, Strips};
use ::measure::{Error, Progress, page, shell_word};
use anyhow::{Context as _, bail};
use job::Source;
use raster::{Gpu, GpuOptions, Tier};

use crate::measure::{INTERRUPTED, bar, cancel_on_interrupt, check_file, check_folder};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// A scene file; the built-in scene if left out
    scene: Option<PathBuf>,
    /// Folder for the page, its table and its pictures; made if it is not there
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Samples per pixel of the references; the scene's choice if left out
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    samples: Option<u32>,
    /// Picture size, such as 656x861; the scene's choice if left out
    #[arg(long, allow_hyphen_values = true, value_parser = super::input::parse_size)]
    size: Option<(u32, u32)>,
    /// `standard` (one thing differs at a time), `all`, or names such as look+dom+dbk
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', default_value = "standard")]
    combinations: Vec<String>,
    /// Part of the adapter's name; the most capable one if left out
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Threads of the path tracer; one per processor if left out
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Override a value of the scene, such as look.main.eumelanin=0.3; may be repeated
    #[arg(long = "set", value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// The day to put on the page, such as 2026-01-31; none if left out
    #[arg(long, value_name = "DAY")]
    date: Option<String>,
    /// Say nothing but errors and warnings
    #[arg(short, long)]
    quiet: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let combinations = Combination::named(&args.combinations)?;
    let Some(folder) = &args.output else {
        bail!("the page and its pictures need a folder: add -o FOLDER");
    };
    check_folder(folder, truth::PAGE_TITLE)?;
    check_file(&folder.join("results.csv"), page::is_table)?;
    let source = args.scene.clone().map_or(Source::Builtin, Source::File);
    let scene = job::load(&source, &overrides(args))?;
    for warning in &scene.warnings {
        super::say(&format!("warning: {warning}"));
    }
    let size = [scene.film.width, scene.film.height];
    let cancel = cancel_on_interrupt("stopping; the page will not be written (once more to stop at once)")?;
    let gpu = Gpu::new(&GpuOptions { adapter: args.adapter.clone(), tier: Tier::Native })?;
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    // Whether anything can be written is found out before it takes hours.
    let strips = Strips::new(folder)?;
    let name = match &args.scene {
        Some(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        None => "the built-in scene".to_owned(),
    };
    let run = Run {
        scene: name,
        size,
        adapter: gpu.description().clone(),
        date: args.date.clone(),
        command: command(args, scene.render.samples, size),
    };
    if !args.quiet {
        super::say(&run.adapter.to_string());
    }

    let bar = bar(args.quiet);
    let progress = |progress: Progress<'_>| {
        bar.set_position((progress.done * 1000.0) as u64);
        bar.set_message(progress.step.to_owned());
    };
    let threads = args.threads.map_or(0, usize::from);
    let context = Context { gpu: &gpu, threads, cancel: &cancel, progress: &progress };
    let outcome = truth::compare(&context, &scene, &combinations, &strips);
    bar.finish_and_clear();
    let outcome = match outcome {
        Err(Error::Cancelled) => {
            super::say("stopped; the page was not written");
            return Ok(ExitCode::from(INTERRUPTED));
        }
        other => other?,
    };
    truth::write(folder, &strips, &outcome, &run)?;
    if !args.quiet {
        super::say(&format!("wrote {} rows into {}", outcome.rows.len(), folder.display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// Flags are overrides like any other; what `--set` says comes last and wins.
fn overrides(args: &Args) -> Vec<String> {
    let mut all = Vec::new();
    if let Some(samples) = args.samples {
        all.push(format!("render.samples={samples}"));
    }
    if let Some((width, height)) = args.size {
        all.push(format!("film.width={width}"));
        all.push(format!("film.height={height}"));
    }
    all.extend(args.set.iter().cloned());
    all
}

/// What does it again.
fn command(args: &Args, samples: u32, [width, height]: [u32; 2]) -> String {
    let scene = args.scene.as_ref().map(|path| format!(" {}", shell_word(&path.display().to_string())));
    let adapter = args.adapter.as_ref().map(|name| format!(" --adapter {}", shell_word(name)));
    let set: String = args.set.iter().map(|set| format!(" --set {}", shell_word(set))).collect();
    format!(
        "cuticle compare-renderers{} -o FOLDER --samples {samples} --size {width}x{height} --combinations {}{}{set}",
        scene.unwrap_or_default(),
        shell_word(&args.combinations.join(",")),
        adapter.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn the_command_can_be_pasted() {
        let words = ["test", "my scene.toml", "-o", "p", "--adapter", "llvm (pipe)", "--set", "look.main.ior=1.5"];
        let more = ["--set", "film.view=\"agx\"", "--combinations", "look+dom+dbk,standard", "--threads", "2"];
        let line = Line::try_parse_from(words.into_iter().chain(more)).unwrap();
        let want = "cuticle compare-renderers 'my scene.toml' -o FOLDER --samples 8 --size 32x48 --combinations \
                    look+dom+dbk,standard --adapter 'llvm (pipe)' --set look.main.ior=1.5 --set 'film.view=\"agx\"'";
        assert_eq!(command(&line.args, 8, [32, 48]), want);
    }
}
