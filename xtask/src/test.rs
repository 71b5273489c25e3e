//! All tests of the workspace, with a driver for those that draw.

use std::ffi::OsString;
use std::process::{Command, ExitCode, ExitStatus};

use anyhow::{Context, Result};

use crate::{driver, root};

/// What Cargo is told before the arguments of the user.
const ARGS: [&str; 2] = ["test", "--workspace"];

/// Provides a driver, then runs the tests; returns the exit code of Cargo.
///
/// # Errors
/// When there is no driver and none can be installed, or Cargo cannot be run. Tests that fail are no error
/// here: they have said so themselves.
pub fn run(args: &[OsString]) -> Result<ExitCode> {
    println!("{}", driver::provide()?);
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(ARGS).args(args).current_dir(root());
    let status = command.status().with_context(|| format!("running `cargo {}`", ARGS.join(" ")))?;
    Ok(ExitCode::from(code(status)))
}

/// The code of a program that ended by itself; 1 where a signal ended it, or the code fits no byte.
fn code(status: ExitStatus) -> u8 {
    status.code().map_or(1, |code| u8::try_from(code).unwrap_or(1))
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::process::ExitStatusExt;

    use super::*;

    #[test]
    fn a_failure_never_becomes_a_success() {
        // As `wait` reports it: the code in the second byte, a signal in the first.
        for (raw, expected) in [(0, 0), (1 << 8, 1), (101 << 8, 101), (255 << 8, 255), (9, 1), (11, 1)] {
            assert_eq!(code(ExitStatus::from_raw(raw)), expected, "{raw:#x}");
        }
    }
}
