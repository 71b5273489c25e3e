//! Heat maps with a colour bar.

use super::axes::{Room, draw_frame, draw_grid, tick_count};
use super::scale::{Axis, Ruler, Scale};
use super::scene::{Anchor, Canvas, Frame, Stroke, TextStyle, text_width};
use super::{Colour, ColourMap, Figure, Picture};

/// How values become colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum HeatScale {
    /// Evenly from the smallest to the largest value.
    #[default]
    Linear,
    /// Evenly between two values; what lies outside takes the colour of the end.
    Between(f64, f64),
    /// By the logarithm, over this many decades below the largest; what is smaller takes the darkest colour.
    Log(f64),
}

/// Values on a grid of cells as colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heat {
    /// The horizontal axis; its range is what the columns cover.
    pub x: Axis,
    /// The vertical axis; its range is what the rows cover.
    pub y: Axis,
    /// Number of columns.
    pub columns: usize,
    /// Values, the bottom row first; a value that is not a number stays grey.
    pub values: Vec<f64>,
    /// How values become colours.
    pub scale: HeatScale,
    /// The colours.
    pub map: ColourMap,
    /// What the values are, with their unit.
    pub label: String,
    /// Upright and lying lines for reference: values of x, values of y.
    pub guides: [Vec<f64>; 2],
}

/// Pixels of the embedded picture along its longer side, at least: cells keep sharp edges in viewers that
/// smooth pictures.
const PICTURE_SIDE: usize = 720;
/// The largest number of cells along a side.
const MAX_CELLS: usize = 8192;
/// Width of the colour bar and its distance.
const BAR: f64 = 13.0;
const BAR_GAP: f64 = 14.0;

impl Heat {
    pub(crate) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        let bar_ruler = self.bar_ruler(tick_count(frame.height, 34.0));
        let widest = bar_ruler.major.iter().map(|(_, label)| text_width(label, Figure::SMALL)).fold(0.0, f64::max);
        let bar_room = BAR_GAP + BAR + 8.0 + widest + if self.label.is_empty() { 0.0 } else { 18.0 };

        let none = std::iter::empty;
        let y = Ruler::new(&self.y, none(), tick_count(frame.height, 34.0), false);
        let x = Ruler::new(&self.x, none(), tick_count(frame.width - bar_room, 54.0), false);
        let room = Room::new(&x, &y, &self.x.label, &self.y.label);
        let inner = frame.inset(room.left, 6.0, room.right.max(6.0) + bar_room, room.bottom);
        draw_grid(canvas, &inner, &x, &y);
        if let Some(picture) = self.picture(&bar_ruler) {
            canvas.picture(&inner, &picture, true);
        }
        let thin = Stroke { dashes: vec![3.0, 3.0], ..Stroke::solid(Colour::WHITE, 0.9) };
        let [upright, lying] = &self.guides;
        for t in upright.iter().filter_map(|&value| x.at(value)).filter(|t| (0.0..=1.0).contains(t)) {
            let x = inner.x + t * inner.width;
            canvas.line([x, inner.y], [x, inner.bottom()], &thin);
        }
        for t in lying.iter().filter_map(|&value| y.at(value)).filter(|t| (0.0..=1.0).contains(t)) {
            let y = inner.bottom() - t * inner.height;
            canvas.line([inner.x, y], [inner.right(), y], &thin);
        }
        let axis = Stroke::solid(Colour::GREY, 0.9);
        canvas.outline(&inner, &axis);
        draw_frame(canvas, &inner, &x, &y, &self.x.label, &self.y.label, room.left);

        let bar = Frame { x: frame.right() - bar_room + BAR_GAP, width: BAR, ..inner };
        if let Some(colours) = self.bar_picture() {
            canvas.picture(&bar, &colours, true);
        }
        canvas.outline(&bar, &axis);
        let small = TextStyle::new(Figure::SMALL, Colour::GREY).centred();
        for (value, label) in &bar_ruler.major {
            let Some(t) = bar_ruler.at(*value) else { continue };
            let at = bar.bottom() - t * bar.height;
            canvas.line([bar.right(), at], [bar.right() + 4.0, at], &axis);
            canvas.text([bar.right() + 7.0, at], label, &small);
        }
        let name = TextStyle { turned: -90.0, ..TextStyle::new(Figure::SMALL, Colour::INK).anchored(Anchor::Middle) };
        canvas.text([frame.right() - 3.0, inner.centre()[1]], &self.label, &name);
    }

    /// From values to places on the colour bar.
    fn bar_ruler(&self, ticks: usize) -> Ruler {
        let values = || self.values.iter().copied().filter(|value| value.is_finite());
        let largest = values().fold(f64::NEG_INFINITY, f64::max);
        let axis = match self.scale {
            HeatScale::Linear => Axis::default(),
            HeatScale::Between(lo, hi) => Axis::default().over(lo, hi),
            HeatScale::Log(decades) => {
                let top = if largest > 0.0 { largest } else { 1.0 };
                Axis { scale: Scale::Log, ..Axis::default().over(top * 10_f64.powf(-decades.max(0.1)), top) }
            }
        };
        Ruler::new(&axis, values(), ticks, false)
    }

    /// The cells as a picture, each a square of equal pixels; none if the values do not fill rows.
    fn picture(&self, ruler: &Ruler) -> Option<Picture> {
        let columns = self.columns;
        if columns == 0 || self.values.is_empty() || !self.values.len().is_multiple_of(columns) {
            return None;
        }
        let rows = self.values.len() / columns;
        if columns.max(rows) > MAX_CELLS {
            return None;
        }
        let side = PICTURE_SIDE.div_ceil(columns.max(rows)).max(1);
        let mut bytes = Vec::with_capacity(3 * side * side * self.values.len());
        // Pictures begin at the top.
        for row in self.values.chunks(columns).rev() {
            let mut line = Vec::with_capacity(3 * side * columns);
            for &value in row {
                let colour = self.map.at(place_of(ruler, value));
                for _ in 0..side {
                    line.extend(colour.0);
                }
            }
            for _ in 0..side {
                bytes.extend_from_slice(&line);
            }
        }
        let side = side as u32;
        Picture::new(columns as u32 * side, rows as u32 * side, bytes).ok()
    }

    fn bar_picture(&self) -> Option<Picture> {
        const STEPS: u32 = 256;
        let colours = (0..STEPS).rev().flat_map(|i| self.map.at(f64::from(i) / f64::from(STEPS - 1)).0).collect();
        Picture::new(1, STEPS, colours).ok()
    }
}

/// Where a value lies on the colour bar; zeros and less are at the bottom of a logarithmic one.
fn place_of(ruler: &Ruler, value: f64) -> f64 {
    if value.is_nan() {
        return f64::NAN;
    }
    ruler.at(value).unwrap_or(if value > 0.0 { 1.0 } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel(picture: &Picture, column: u32, row: u32) -> Colour {
        let i = 3 * (row * picture.width() + column) as usize;
        Colour([picture.rgb()[i], picture.rgb()[i + 1], picture.rgb()[i + 2]])
    }

    #[test]
    fn cells_take_the_colour_of_their_value_and_rows_begin_below() {
        let heat = Heat { columns: 2, values: vec![0.0, 1.0, f64::NAN, 0.5], ..Heat::default() };
        let picture = heat.picture(&heat.bar_ruler(5)).unwrap();
        let (right, bottom) = (picture.width() - 1, picture.height() - 1);
        assert_eq!(picture.width(), 720);
        let map = ColourMap::Viridis;
        assert_eq!(pixel(&picture, 0, bottom), map.at(0.0));
        assert_eq!(pixel(&picture, right, bottom), map.at(1.0));
        assert_eq!(pixel(&picture, 0, 0), Colour::GRID);
        assert_eq!(pixel(&picture, right, 0), map.at(0.5));
    }

    #[test]
    fn a_logarithmic_bar_spans_its_decades() {
        let heat = Heat { columns: 3, values: vec![0.0, 1e-9, 10.0], scale: HeatScale::Log(4.0), ..Heat::default() };
        let ruler = heat.bar_ruler(5);
        for (value, place) in [(10.0, 1.0), (0.1, 0.5), (1e-3, 0.0)] {
            assert!((place_of(&ruler, value) - place).abs() < 1e-12, "{value}");
        }
        assert_eq!(place_of(&ruler, 0.0), 0.0);
        assert_eq!(heat.map.at(place_of(&ruler, 1e-9)), heat.map.at(0.0));
    }

    #[test]
    fn values_that_fill_no_rows_draw_no_cells() {
        for (columns, count) in [(0, 4), (3, 4), (2, 0)] {
            let heat = Heat { columns, values: vec![1.0; count], ..Heat::default() };
            assert_eq!(heat.picture(&heat.bar_ruler(5)), None);
        }
    }
}
