//! What is drawn between axes.

use super::scene::{Anchor, Canvas, Frame, Stroke, TextStyle, text_width};
use super::{Colour, Figure};

/// How a line is broken, so that colour is never the only difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dash {
    /// Not at all.
    #[default]
    Solid,
    /// Long dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// A dash, a dot.
    DashDot,
}

impl Dash {
    /// The order in which series take their dashes.
    pub const SERIES: [Self; 4] = [Self::Solid, Self::Dashed, Self::DashDot, Self::Dotted];

    /// Lengths of dashes and gaps, pixels.
    fn lengths(self) -> Vec<f64> {
        match self {
            Self::Solid => Vec::new(),
            Self::Dashed => vec![6.0, 3.0],
            Self::Dotted => vec![1.6, 2.4],
            Self::DashDot => vec![7.0, 2.4, 1.6, 2.4],
        }
    }
}

/// The sign at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// A triangle.
    Triangle,
    /// A diamond.
    Diamond,
}

impl Marker {
    /// The order in which series take their markers.
    pub const SERIES: [Self; 4] = [Self::Disc, Self::Square, Self::Triangle, Self::Diamond];

    pub(crate) fn draw(self, canvas: &mut Canvas, [x, y]: [f64; 2], colour: Colour) {
        let r = 3.0;
        let corners: &[[f64; 2]] = match self {
            Self::Disc => return canvas.circle([x, y], r, Some(colour), None),
            Self::Square => &[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
            Self::Triangle => &[[0.0, -1.2], [1.1, 0.8], [-1.1, 0.8]],
            Self::Diamond => &[[0.0, -1.3], [1.3, 0.0], [0.0, 1.3], [-1.3, 0.0]],
        };
        let corners: Vec<[f64; 2]> = corners.iter().map(|[dx, dy]| [x + r * dx, y + r * dy]).collect();
        canvas.polygon(&corners, colour, 1.0);
    }
}

/// What joins or carries the points of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Shape {
    /// A line through them.
    #[default]
    Line,
    /// Nothing: markers alone.
    Points,
    /// An upright bar at each, of this width in units of the x axis, standing on zero (or on the bottom of a
    /// logarithmic axis).
    Bars(f64),
}

/// One set of points. In polar axes a point is `[angle in radians, radius]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; without one it is not listed.
    pub name: String,
    /// The points; a value that is not a number breaks the line.
    pub points: Vec<[f64; 2]>,
    /// Half lengths of vertical error bars, one a point; none without.
    pub errors: Vec<f64>,
    /// How the points are drawn.
    pub shape: Shape,
    /// The sign at each point, if any.
    pub marker: Option<Marker>,
    /// Its colour; by its place among the series if left out.
    pub colour: Option<Colour>,
    /// Its dash; by its place among the series if left out.
    pub dash: Option<Dash>,
    /// Width of its line, pixels.
    pub width: f64,
}

impl Series {
    /// A line.
    pub fn line(name: &str, points: Vec<[f64; 2]>) -> Self {
        Self {
            name: name.to_owned(),
            points,
            errors: Vec::new(),
            shape: Shape::Line,
            marker: None,
            colour: None,
            dash: None,
            width: 1.6,
        }
    }

    /// Markers alone.
    pub fn scatter(name: &str, points: Vec<[f64; 2]>) -> Self {
        Self { shape: Shape::Points, marker: Some(Marker::Disc), ..Self::line(name, points) }
    }

    /// Bars of a width in units of the x axis.
    pub fn bars(name: &str, width: f64, points: Vec<[f64; 2]>) -> Self {
        Self { shape: Shape::Bars(width), ..Self::line(name, points) }
    }

    /// The same in a colour and a dash of one's choice.
    pub fn styled(self, colour: Colour, dash: Dash) -> Self {
        Self { colour: Some(colour), dash: Some(dash), ..self }
    }

    /// The same with error bars.
    pub fn with_errors(self, errors: Vec<f64>) -> Self {
        Self { errors, ..self }
    }

    /// The same with a sign at each point.
    pub fn marked(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }

    pub(crate) fn colour_at(&self, place: usize) -> Colour {
        self.colour.unwrap_or(Colour::SERIES[place % Colour::SERIES.len()])
    }

    pub(crate) fn stroke_at(&self, place: usize) -> Stroke {
        let dash = self.dash.unwrap_or(Dash::SERIES[place % Dash::SERIES.len()]);
        Stroke { colour: self.colour_at(place), width: self.width, dashes: dash.lengths() }
    }
}

/// Sheet positions in unbroken runs.
pub(crate) fn runs(points: impl Iterator<Item = Option<[f64; 2]>>) -> Vec<Vec<[f64; 2]>> {
    let mut runs = vec![Vec::new()];
    for point in points {
        let Some(point) = point else {
            runs.push(Vec::new());
            continue;
        };
        if let Some(run) = runs.last_mut() {
            run.push(point);
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// Room between the entries of a legend, and the length of their samples.
const LEGEND_GAP: f64 = 18.0;
const SAMPLE: f64 = 24.0;
pub(crate) const LEGEND_LINE: f64 = 17.0;

/// Positions of the legend's entries in rows of a width, relative to its top left corner.
fn legend_places(series: &[Series], width: f64) -> Vec<(usize, [f64; 2])> {
    let (mut x, mut y) = (0.0, 0.0);
    let mut places = Vec::new();
    for (place, series) in series.iter().enumerate().filter(|(_, series)| !series.name.is_empty()) {
        let length = SAMPLE + 6.0 + text_width(&series.name, Figure::SMALL);
        if x > 0.0 && x + length > width {
            (x, y) = (0.0, y + LEGEND_LINE);
        }
        places.push((place, [x, y]));
        x += length + LEGEND_GAP;
    }
    places
}

/// How high the legend of these series is in rows of a width.
pub(crate) fn legend_height(series: &[Series], width: f64) -> f64 {
    // One series needs no legend: the title says what it is.
    if series.iter().filter(|series| !series.name.is_empty()).count() < 2 {
        return 0.0;
    }
    legend_places(series, width).last().map_or(0.0, |(_, [_, y])| y + LEGEND_LINE + 3.0)
}

/// Draws the legend into the top of a frame.
pub(crate) fn draw_legend(canvas: &mut Canvas, series: &[Series], frame: &Frame) {
    if legend_height(series, frame.width) == 0.0 {
        return;
    }
    for (place, [x, y]) in legend_places(series, frame.width) {
        let entry = &series[place];
        let (left, middle) = (frame.x + x, frame.y + y + 0.5 * LEGEND_LINE);
        match entry.shape {
            Shape::Bars(_) => {
                let swatch = Frame { x: left + 4.0, y: middle - 5.0, width: SAMPLE - 8.0, height: 10.0 };
                canvas.rectangle(&swatch, entry.colour_at(place), BAR_OPACITY);
            }
            Shape::Line => canvas.line([left, middle], [left + SAMPLE, middle], &entry.stroke_at(place)),
            Shape::Points => {}
        }
        if let Some(marker) = entry.marker {
            marker.draw(canvas, [left + 0.5 * SAMPLE, middle], entry.colour_at(place));
        }
        let style = TextStyle::new(Figure::SMALL, Colour::INK).anchored(Anchor::Start).centred();
        canvas.text([left + SAMPLE + 6.0, middle], &entry.name, &style);
    }
}

/// Bars let the grid through.
pub(crate) const BAR_OPACITY: f64 = 0.55;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_where_there_is_no_value() {
        let points = [None, Some([0.0, 0.0]), Some([1.0, 0.0]), None, None, Some([2.0, 0.0]), None];
        let lengths: Vec<usize> = runs(points.into_iter()).iter().map(Vec::len).collect();
        assert_eq!(lengths, [2, 1]);
    }

    #[test]
    fn the_first_series_differ_in_colour_and_in_dash() {
        let series = Series::line("", Vec::new());
        for a in 0..4 {
            for b in 0..a {
                assert_ne!(series.colour_at(a), series.colour_at(b));
                assert_ne!(series.stroke_at(a).dashes, series.stroke_at(b).dashes);
            }
        }
    }

    #[test]
    fn a_legend_takes_the_rows_it_needs() {
        let series: Vec<Series> = (0..6).map(|i| Series::line(&format!("series number {i}"), Vec::new())).collect();
        assert_eq!(legend_height(&series[..1], 500.0), 0.0);
        let (wide, narrow) = (legend_height(&series, 2000.0), legend_height(&series, 150.0));
        assert!((narrow - wide - 5.0 * LEGEND_LINE).abs() < 1e-9, "{wide} and {narrow}");
    }
}
