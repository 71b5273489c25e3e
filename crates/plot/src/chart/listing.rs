//! Names and values in two columns.

use super::scene::{Canvas, Frame, Stroke, TextStyle, text_width, wrapped};
use super::{Colour, Figure};

/// Names with values, one below the other; long values take several lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Listing {
    /// Name and value; an entry without a value is a heading.
    pub entries: Vec<(String, String)>,
}

/// Distance of the lines.
const LINE: f64 = 18.0;

impl Listing {
    /// Width of the column of names.
    fn names(&self, width: f64) -> f64 {
        let names = self.entries.iter().filter(|(_, value)| !value.is_empty());
        let widest = names.map(|(name, _)| text_width(name, Figure::TEXT)).fold(0.0, f64::max);
        (widest + 18.0).min(0.55 * width)
    }

    /// What it takes when set in a width.
    pub(crate) fn height(&self, width: f64) -> f64 {
        let room = width - self.names(width);
        let lines = self.entries.iter().map(|(_, value)| wrapped(value, Figure::TEXT, room).len().max(1));
        LINE * lines.sum::<usize>() as f64 + 8.0
    }

    pub(crate) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        let names = self.names(frame.width);
        let (plain, grey) = (TextStyle::new(Figure::TEXT, Colour::INK), TextStyle::new(Figure::TEXT, Colour::GREY));
        let rule = Stroke::solid(Colour::GRID, 0.7);
        let mut y = frame.y + 4.0;
        for (name, value) in &self.entries {
            canvas.text([frame.x, y + 12.5], name, if value.is_empty() { &plain } else { &grey });
            let lines = wrapped(value, Figure::TEXT, frame.width - names);
            for (i, line) in lines.iter().enumerate() {
                canvas.text([frame.x + names, y + 12.5 + LINE * i as f64], line, &plain);
            }
            y += LINE * lines.len().max(1) as f64;
            canvas.line([frame.x, y], [frame.right(), y], &rule);
        }
    }
}
