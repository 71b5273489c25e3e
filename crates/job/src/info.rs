use std::path::Path;

use groom::{Report, UpAxis};

/// Why a file could not be described.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InfoError {
    /// The groom could not be read.
    #[error(transparent)]
    Groom(#[from] formats::ReadError),
}

/// Describes a groom file: a table of statistics, then everything that looks wrong.
///
/// `metres_per_unit` lets widths be judged.
///
/// # Errors
/// When the file cannot be read.
pub fn info(path: &Path, metres_per_unit: Option<f32>) -> Result<String, InfoError> {
    let mut file = formats::read_groom(path)?;
    if metres_per_unit.is_some() {
        file.groom.metres_per_unit = metres_per_unit;
    }
    let report = Report::of(&file.groom);
    let mut text = format!("{}\n", path.display());
    if !file.info.is_empty() {
        text += &format!("  says of itself: {}\n", file.info);
    }
    text += &report.to_string();
    if !text.ends_with('\n') {
        text.push('\n');
    }
    let up = match groom::guess_up(&file.groom) {
        Some(UpAxis::X) => "x, as the strands fall",
        Some(UpAxis::Y) => "y, as the strands fall",
        Some(UpAxis::Z) => "z, as the strands fall",
        None => "cannot be told from the strands",
    };
    text += &format!("  up axis             {up}\n");
    for warning in file.warnings {
        text += &format!("  warning: {warning}\n");
    }
    Ok(text)
}
