//! `cuticle-validate`: judges the renderer by what independent renderers computed, and by what must be true.
//!
//! Exit status: 0 agreement, 1 disagreement, 2 something could not be done.

mod furnace;
mod grooms;
mod lab;
mod lab_scene;
mod mask;
mod reference;

use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cuticle-validate", version, about = "Compares Cuticle with other renderers and with theory")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render the lab scene and compare it with what other renderers made of it
    Lab(lab::Args),
    /// Render hair that absorbs nothing under light of 1 from everywhere: it should vanish
    Furnace(furnace::Args),
    /// Render every .hair file of a folder, framed automatically
    Grooms(grooms::Args),
}

fn main() -> ExitCode {
    let agrees = match Cli::parse().command {
        Command::Lab(args) => lab::run(&args),
        Command::Furnace(args) => furnace::run(&args),
        Command::Grooms(args) => grooms::run(&args),
    };
    match agrees {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// The command line, for reports.
fn command_line() -> String {
    // Where the program lies says nothing about the numbers.
    let words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    std::iter::once("cuticle-validate".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Prints a report and writes it where one is wanted.
fn publish(report: &str, path: Option<&Path>) -> anyhow::Result<()> {
    print!("{report}");
    match path {
        Some(path) => std::fs::write(path, report).with_context(|| format!("cannot write {}", path.display())),
        None => Ok(()),
    }
}
