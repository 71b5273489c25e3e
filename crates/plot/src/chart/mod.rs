//! A small library of vector figures.
//!
//! A [`Figure`] is a grid of [`Panel`]s; a panel holds [`Axes`], [`Polar`] axes, a [`Heat`] map, a
//! [`Picture`] or a [`Listing`]. Lines differ in dash as well as in colour, colours are Okabe and Ito's,
//! heat maps use a perceptually uniform map; legends stand above the data and never on it.
//!
//! Text may hold `^{..}` and `_{..}` for superscripts and subscripts. Lengths are in pixels of the SVG.

pub mod image;

mod axes;
mod colour;
mod figure;
mod heat;
mod listing;
mod polar;
mod raster;
mod scale;
mod scene;
mod series;

pub use self::image::{Picture, PictureError};
pub use axes::{Axes, Guide};
pub use colour::{Colour, ColourMap};
pub use figure::{Figure, Panel, Plot};
pub use heat::{Heat, HeatScale};
pub use listing::Listing;
pub use polar::{Polar, Radial};
pub use raster::PngError;
pub use scale::{Axis, Scale, Ticks};
pub use scene::{Anchor, Canvas, Frame, Stroke, TextStyle, text_width};
pub use series::{Dash, Marker, Series, Shape};
