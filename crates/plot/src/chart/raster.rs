//! From SVG to pixels.

use std::sync::{Arc, OnceLock};

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};

use super::Picture;

/// Why a figure could not become a PNG.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PngError {
    /// The size is out of range.
    #[error("a figure of {width} x {height} pixels: sides lie between 1 and 16384")]
    Size {
        /// Columns asked for.
        width: u64,
        /// Rows that follow.
        height: u64,
    },

    /// The drawing library did not understand the figure.
    #[error("cannot draw the figure: {what}")]
    Svg {
        /// What it said.
        what: String,
    },
}

/// Draws an SVG of a known size with `columns` pixels across.
pub(crate) fn draw(svg: &str, size: [f64; 2], columns: u32) -> Result<Picture, PngError> {
    let scale = f64::from(columns) / size[0];
    let rows = (size[1] * scale).ceil();
    let refused = || PngError::Size { width: u64::from(columns), height: rows as u64 };
    if !(1..=16_384).contains(&columns) || !(1.0..=16_384.0).contains(&rows) {
        return Err(refused());
    }
    let options = Options { fontdb: fonts(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|error| PngError::Svg { what: error.to_string() })?;
    let mut pixels = Pixmap::new(columns, rows as u32).ok_or_else(refused)?;
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale as f32, scale as f32), &mut pixels.as_mut());
    // On white every pixel is opaque, so the colours are not multiplied by anything.
    let rgb = pixels.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    Picture::new(columns, rows as u32, rgb).map_err(|_| refused())
}

/// The fonts of figures: Ubuntu Light, and Hack for the signs it lacks. The machine's own are not looked at,
/// so that pictures are the same everywhere.
fn fonts() -> Arc<fontdb::Database> {
    static FONTS: OnceLock<Arc<fontdb::Database>> = OnceLock::new();
    let database = FONTS.get_or_init(|| {
        let mut database = fontdb::Database::new();
        database.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        database.load_font_data(epaint_default_fonts::HACK_REGULAR.to_vec());
        Arc::new(database)
    });
    Arc::clone(database)
}
