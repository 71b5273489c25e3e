//! Cartesian axes.

use super::scale::Ruler;
use super::scene::{Anchor, Canvas, Frame, Stroke, TextStyle, text_width};
use super::series::{BAR_OPACITY, draw_legend, legend_height, runs};
use super::{Axis, Colour, Figure, Scale, Series, Shape};

/// A thin line across the axes, with a word at its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Guide {
    /// Where it crosses its axis.
    pub at: f64,
    /// Whether it stands upright, at a value of x; otherwise it lies at a value of y.
    pub upright: bool,
    /// The word; above an upright line, at the right end of a lying one.
    pub label: String,
}

/// Cartesian axes with series between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axes {
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, first below.
    pub series: Vec<Series>,
    /// Lines for reference, under the series.
    pub guides: Vec<Guide>,
}

impl Axes {
    pub(crate) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        let legend = legend_height(&self.series, frame.width);
        draw_legend(canvas, &self.series, frame);
        let named = self.guides.iter().any(|guide| guide.upright && !guide.label.is_empty());
        let frame = frame.inset(0.0, legend + if named { 16.0 } else { 4.0 }, 0.0, 0.0);

        let [xs, ys] = self.extents();
        let y = Ruler::new(&self.y, ys.into_iter(), tick_count(frame.height, 42.0), true);
        let x = Ruler::new(&self.x, xs.into_iter(), tick_count(frame.width, 64.0), false);
        let room = Room::new(&x, &y, &self.x.label, &self.y.label);
        let inner = frame.inset(room.left, 0.0, room.right, room.bottom);
        draw_grid(canvas, &inner, &x, &y);

        let place = |point: [f64; 2]| -> Option<[f64; 2]> {
            Some([inner.x + x.at(point[0])? * inner.width, inner.bottom() - y.at(point[1])? * inner.height])
        };
        let clip = inner.inset(-0.5, -1.0, -0.5, -1.0);
        canvas.clipped(&clip, |canvas| {
            for guide in &self.guides {
                let thin = Stroke { dashes: vec![3.0, 3.0], ..Stroke::solid(Colour::GREY, 0.8) };
                if guide.upright {
                    let Some(t) = x.at(guide.at) else { continue };
                    let x = inner.x + t * inner.width;
                    canvas.line([x, inner.y], [x, inner.bottom()], &thin);
                } else {
                    let Some(t) = y.at(guide.at) else { continue };
                    let y = inner.bottom() - t * inner.height;
                    canvas.line([inner.x, y], [inner.right(), y], &thin);
                }
            }
            let floor = if self.y.scale == Scale::Log { y.lo } else { 0.0 };
            for (index, series) in self.series.iter().enumerate() {
                draw_series(canvas, series, index, floor, &place);
            }
        });
        // Markers on the frame are drawn whole, those outside not at all.
        let on = |t: Option<f64>| t.is_some_and(|t| (-1e-9..=1.0 + 1e-9).contains(&t));
        for (index, series) in self.series.iter().enumerate() {
            let Some(marker) = series.marker else { continue };
            for &point in series.points.iter().filter(|p| on(x.at(p[0])) && on(y.at(p[1]))) {
                if let Some(at) = place(point) {
                    marker.draw(canvas, at, series.colour_at(index));
                }
            }
        }
        draw_guide_labels(canvas, &self.guides, &inner, &x, &y);
        draw_frame(canvas, &inner, &x, &y, &self.x.label, &self.y.label, room.left);
    }

    /// All values of x and of y, error bars and the feet of bars included.
    fn extents(&self) -> [Vec<f64>; 2] {
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        for series in &self.series {
            for (i, [x, y]) in series.points.iter().copied().enumerate() {
                let error = series.errors.get(i).copied().unwrap_or(0.0);
                ys.extend([y - error, y + error]);
                match series.shape {
                    Shape::Bars(width) => {
                        xs.extend([x - 0.5 * width, x + 0.5 * width]);
                        ys.push(0.0);
                    }
                    _ => xs.push(x),
                }
            }
        }
        [xs, ys]
    }
}

fn draw_series(
    canvas: &mut Canvas,
    series: &Series,
    index: usize,
    floor: f64,
    place: &impl Fn([f64; 2]) -> Option<[f64; 2]>,
) {
    let (colour, stroke) = (series.colour_at(index), series.stroke_at(index));
    match series.shape {
        Shape::Points => {}
        Shape::Line => {
            for run in runs(series.points.iter().map(|&point| place(point))) {
                canvas.polyline(&run, &stroke);
            }
        }
        Shape::Bars(width) => {
            for &[x, y] in &series.points {
                let (from, to) = (place([x - 0.5 * width, floor]), place([x + 0.5 * width, y]));
                let (Some([x0, y0]), Some([x1, y1])) = (from, to) else { continue };
                let (left, top) = (x0.min(x1), y0.min(y1));
                let bar = Frame { x: left, y: top, width: (x1 - x0).abs(), height: (y1 - y0).abs() };
                canvas.rectangle(&bar, colour, BAR_OPACITY);
            }
        }
    }
    let thin = Stroke::solid(colour, 1.0);
    for (&[x, y], &error) in series.points.iter().zip(&series.errors) {
        let (Some(middle), Some(top)) = (place([x, y]), place([x, y + error])) else { continue };
        // On a logarithmic axis the lower end may have no place: the bar then ends at the point.
        let bottom = place([x, y - error]).unwrap_or(middle);
        canvas.line(bottom, top, &thin);
        for [x, y] in [bottom, top] {
            canvas.line([x - 3.0, y], [x + 3.0, y], &thin);
        }
    }
}

fn draw_guide_labels(canvas: &mut Canvas, guides: &[Guide], inner: &Frame, x: &Ruler, y: &Ruler) {
    let style = TextStyle::new(Figure::TINY, Colour::GREY);
    for guide in guides {
        let ruler = if guide.upright { x } else { y };
        let Some(t) = ruler.at(guide.at).filter(|t| (0.0..=1.0).contains(t)) else { continue };
        if guide.upright {
            // Near an end the word keeps within the axes.
            let half = 0.5 * text_width(&guide.label, Figure::TINY);
            let middle = (inner.x + t * inner.width).clamp(inner.x + half, (inner.right() - half).max(inner.x + half));
            canvas.text([middle, inner.y - 5.0], &guide.label, &style.anchored(Anchor::Middle));
        } else {
            let at = [inner.right() - 3.0, inner.bottom() - t * inner.height - 3.0];
            canvas.text(at, &guide.label, &TextStyle { rim: true, ..style.anchored(Anchor::End) });
        }
    }
}

/// How many ticks a length has room for.
pub(crate) fn tick_count(length: f64, each: f64) -> usize {
    ((length / each) as usize).clamp(2, 9)
}

/// What ticks and labels need around the axes.
pub(crate) struct Room {
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

impl Room {
    pub(crate) fn new(x: &Ruler, y: &Ruler, x_label: &str, y_label: &str) -> Self {
        let widest = y.major.iter().map(|(_, label)| text_width(label, Figure::SMALL)).fold(0.0, f64::max);
        let label = |text: &str| if text.is_empty() { 0.0 } else { 18.0 };
        // Half of the last label hangs over the end.
        let overhang = x.major.last().map_or(0.0, |(_, label)| 0.5 * text_width(label, Figure::SMALL));
        Self {
            left: widest + 10.0 + label(y_label),
            right: overhang.clamp(4.0, 24.0),
            bottom: if x.major.is_empty() { 4.0 } else { 20.0 } + label(x_label),
        }
    }
}

/// The grid, under the data.
pub(crate) fn draw_grid(canvas: &mut Canvas, inner: &Frame, x: &Ruler, y: &Ruler) {
    let (minor, major) = (Stroke::solid(Colour::FAINT, 0.6), Stroke::solid(Colour::GRID, 0.7));
    let upright = |canvas: &mut Canvas, value: f64, stroke: &Stroke| {
        if let Some(t) = x.at(value).filter(|t| (-1e-6..=1.0 + 1e-6).contains(t)) {
            let x = inner.x + t * inner.width;
            canvas.line([x, inner.y], [x, inner.bottom()], stroke);
        }
    };
    let lying = |canvas: &mut Canvas, value: f64, stroke: &Stroke| {
        if let Some(t) = y.at(value).filter(|t| (-1e-6..=1.0 + 1e-6).contains(t)) {
            let y = inner.bottom() - t * inner.height;
            canvas.line([inner.x, y], [inner.right(), y], stroke);
        }
    };
    x.minor.iter().for_each(|&value| upright(canvas, value, &minor));
    y.minor.iter().for_each(|&value| lying(canvas, value, &minor));
    x.major.iter().for_each(|(value, _)| upright(canvas, *value, &major));
    y.major.iter().for_each(|(value, _)| lying(canvas, *value, &major));
}

/// Axis lines, ticks, their labels and the names of the axes, over the data. `left` is the room left of it.
pub(crate) fn draw_frame(
    canvas: &mut Canvas,
    inner: &Frame,
    x: &Ruler,
    y: &Ruler,
    x_label: &str,
    y_label: &str,
    left: f64,
) {
    let axis = Stroke::solid(Colour::GREY, 0.9);
    canvas.line([inner.x, inner.y], [inner.x, inner.bottom()], &axis);
    canvas.line([inner.x, inner.bottom()], [inner.right(), inner.bottom()], &axis);
    let small = TextStyle::new(Figure::SMALL, Colour::GREY);
    for (value, label) in &x.major {
        let Some(t) = x.at(*value) else { continue };
        let at = inner.x + t * inner.width;
        canvas.line([at, inner.bottom()], [at, inner.bottom() + 4.0], &axis);
        canvas.text([at, inner.bottom() + 16.0], label, &small.anchored(Anchor::Middle));
    }
    for (value, label) in &y.major {
        let Some(t) = y.at(*value) else { continue };
        let at = inner.bottom() - t * inner.height;
        canvas.line([inner.x - 4.0, at], [inner.x, at], &axis);
        canvas.text([inner.x - 7.0, at], label, &small.anchored(Anchor::End).centred());
    }
    let name = TextStyle::new(Figure::TEXT, Colour::INK).anchored(Anchor::Middle);
    let [centre_x, centre_y] = inner.centre();
    let below = if x.major.is_empty() { 16.0 } else { 34.0 };
    canvas.text([centre_x, inner.bottom() + below], x_label, &name);
    canvas.text([inner.x - left + 11.0, centre_y], y_label, &TextStyle { turned: -90.0, ..name });
}
