//! `cuticle`: renders hair from the command line.
//!
//! A thin door: what takes time is a job, what is computed lies in the libraries.

mod compare;
mod compare_renderers;
mod fiber_eval;
mod input;
mod lobes;
mod measure;
mod model;
mod preview;
mod render;
mod reproduce;
mod techniques;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cuticle", version, about = "Physically based rendering of hair and fur")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Path trace a scene, a groom, or (with no argument) the built-in head of hair
    Render(render::Args),
    /// Draw one frame by the interactive renderer, with techniques to choose from, and say what each pass costs
    Preview(Box<preview::Args>),
    /// Describe a groom file and say what looks wrong with it
    Info {
        /// Groom files (.hair)
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Metres per unit of the file, to judge widths (0.01 for centimetres)
        #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
        unit_m: Option<f32>,
    },
    /// Print the JSON schema of scene files, for editors
    Schema,
    /// Ask the scattering models
    Fiber {
        #[command(subcommand)]
        command: FiberCommand,
    },
    /// Draw what a look or a model scatters
    Lobes {
        #[command(subcommand)]
        command: lobes::Command,
    },
    /// Try the papers' claims and figures, and write a page about each
    Reproduce(reproduce::Args),
    /// Measure what the interactive renderer's techniques cost, as the thesis does, and write pages
    Measure(measure::Args),
    /// Hold the interactive renderer against the path tracer, and write a page
    CompareRenderers(compare_renderers::Args),
    /// Measure how far one picture is from another
    Compare(compare::Args),
}

#[derive(Subcommand)]
enum FiberCommand {
    /// Evaluate a model for JSON Lines from standard input, in double precision
    #[command(long_about = EVAL_HELP)]
    Eval(fiber_eval::Args),
}

const EVAL_HELP: &str = "Evaluate a model for JSON Lines from standard input, in double precision

A line is {\"params\":{..},\"theta_k\":..,\"theta_s\":..,\"phi\":..,\"h\":..}, in radians, with phi = phi_s - phi_k. \
The answer is {\"fcos\":[r,g,b],\"pdf\":..,\"lobes\":[[r,g,b],..]}: the scattering function times cos theta_s, the \
density per steradian, and the value of R, TT, TRT and the residual lobe.";

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(code) => code,
        Err(error) => {
            say(&format!("error: {error}"));
            for cause in error.chain().skip(1) {
                // Library errors already carry their cause in their text.
                if !error.to_string().contains(&cause.to_string()) {
                    say(&format!("  because: {cause}"));
                }
            }
            ExitCode::FAILURE
        }
    }
}

fn run(cli: Cli) -> anyhow::Result<ExitCode> {
    match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Preview(args) => preview::run(&args),
        Command::Info { files, unit_m } => {
            check_unit(unit_m)?;
            for file in files {
                emit(&job::info(&file, unit_m)?)?;
            }
            Ok(ExitCode::SUCCESS)
        }
        Command::Schema => {
            emit(&job::schema())?;
            Ok(ExitCode::SUCCESS)
        }
        Command::Fiber { command: FiberCommand::Eval(args) } => fiber_eval::run(&args),
        Command::Lobes { command } => lobes::run(&command),
        Command::Reproduce(args) => reproduce::run(&args),
        Command::Measure(args) => measure::run(&args),
        Command::CompareRenderers(args) => compare_renderers::run(&args),
        Command::Compare(args) => compare::run(&args),
    }
}

/// Refuses a unit that cannot be one.
fn check_unit(unit_m: Option<f32>) -> anyhow::Result<()> {
    match unit_m.filter(|u| !(*u > 0.0 && u.is_finite())) {
        Some(unit) => anyhow::bail!("--unit-m is {unit}; it must be greater than 0, such as 0.01 for centimetres"),
        None => Ok(()),
    }
}

/// Prints to standard output; a reader that has gone away is no error (`cuticle schema | head`).
fn emit(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    let end = if text.ends_with('\n') { "" } else { "\n" };
    match write!(out, "{text}{end}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(anyhow::anyhow!("cannot write to standard output: {error}"))
        }
        _ => Ok(()),
    }
}

/// Tells the user something on standard error; that nobody can hear it is no reason to stop.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
