//! `cargo xtask`: housekeeping.

use std::ffi::OsString;
use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  arrows        compare the arrows of ARCHITECTURE.md with the manifests
  ci            run the steps of CI
  driver        find a Vulkan driver for the tests that draw; install a software driver where there is none
  test [ARGS]   the same, then `cargo test --workspace ARGS`";

fn main() -> ExitCode {
    let args: Vec<OsString> = std::env::args_os().skip(1).collect();
    let words: Vec<&str> = args.iter().map(|arg| arg.to_str().unwrap_or_default()).collect();
    let success = |()| ExitCode::SUCCESS;
    let done = match words.as_slice() {
        ["arrows"] => xtask::arrows::check().map(|count| println!("{count} arrows, as in the manifests")).map(success),
        ["ci"] => xtask::ci::run().map(success),
        ["driver"] => xtask::driver::provide().map(|found| println!("{found}")).map(success),
        // Cargo gets its arguments as they were given, text or not.
        ["test", ..] => xtask::test::run(&args[1..]),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    done.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}
