//! Housekeeping: what the project promises about itself, as checks that a machine can run.
//!
//! - [`arrows`]: which crate uses which, in `ARCHITECTURE.md` and in the manifests.
//! - [`source`]: what sources say, comments and strings left out.
//! - [`ci`]: the steps of CI.
//! - [`driver`]: a Vulkan driver for the tests that draw.
//! - [`test`](mod@test): all tests, with that driver.

pub mod arrows;
pub mod ci;
pub mod driver;
pub mod source;
pub mod test;

use std::path::{Path, PathBuf};

/// The folder of the workspace.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}
