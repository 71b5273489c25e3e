//! The steps of CI, for people who want to know before they push.

use std::fmt;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::root;

/// One call of Cargo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// A variable that is set for it.
    pub variable: Option<(&'static str, &'static str)>,
    /// What Cargo is told.
    pub args: &'static [&'static str],
}

impl fmt::Display for Step {
    /// As one would type it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((name, value)) = self.variable {
            write!(f, "{name}={value} ")?;
        }
        write!(f, "cargo {}", self.args.join(" "))
    }
}

/// All steps, in their order; the same as in `.ci/run`.
pub const STEPS: [Step; 6] = [
    Step { variable: None, args: &["xtask", "test"] },
    Step {
        variable: None,
        args: &["test", "--release", "--package", "cuticle-fiber", "--features", "slow", "--test", "grid"],
    },
    Step { variable: None, args: &["fmt", "--all", "--check"] },
    Step {
        variable: None,
        args: &["clippy", "--workspace", "--all-targets", "--features", "cuticle-fiber/slow", "--", "-D", "warnings"],
    },
    Step { variable: None, args: &["check", "--workspace", "--no-default-features"] },
    Step { variable: Some(("RUSTDOCFLAGS", "-Dwarnings")), args: &["doc", "--workspace", "--no-deps"] },
];

/// Runs all steps; the first that fails ends it.
///
/// # Errors
/// When a step fails, or Cargo cannot be run.
pub fn run() -> Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    for step in STEPS {
        println!("\n== {step}");
        let mut command = Command::new(&cargo);
        command.args(step.args).envs(step.variable).env("CI", "true").current_dir(root()).stdin(Stdio::null());
        let status = command.status().with_context(|| format!("running `{step}`"))?;
        ensure!(status.success(), "`{step}` failed");
    }
    println!("\nall steps passed");
    Ok(())
}
