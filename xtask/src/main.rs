//! `cargo xtask`: housekeeping.

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  arrows    compare the arrows of ARCHITECTURE.md with the manifests
  ci        run the steps of CI";

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let done = match args.as_slice() {
        ["arrows"] => xtask::arrows::check().map(|count| println!("{count} arrows, as in the manifests")),
        ["ci"] => xtask::ci::run(),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
