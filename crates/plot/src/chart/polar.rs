//! Polar axes: angles around, values outwards.

use std::f64::consts::TAU;

use super::scale::{linear_ticks, log_ticks, plain};
use super::scene::{Anchor, Canvas, Frame, Stroke, TextStyle};
use super::series::{draw_legend, legend_height, runs};
use super::{Colour, Figure, Series};

/// How values are spread along the radius.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Radial {
    /// By their square root: equal areas of a lobe are equal shares of the whole.
    #[default]
    Root,
    /// Evenly.
    Linear,
    /// By their logarithm, over this many decades below the largest; what is smaller lies at the centre.
    Log(f64),
}

/// Polar axes with series; points are `[angle in radians, value]`, angles anticlockwise from the right.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polar {
    /// How values are spread.
    pub radial: Radial,
    /// The value of the outer circle; from the data if left out.
    pub largest: Option<f64>,
    /// What the rings show, with its unit.
    pub label: String,
    /// Words at the right and at the left end of the horizontal, where 0° and 180° are.
    pub ends: [String; 2],
    /// What is drawn, first below.
    pub series: Vec<Series>,
}

impl Polar {
    pub(crate) fn draw(&self, canvas: &mut Canvas, frame: &Frame) {
        let legend = legend_height(&self.series, frame.width);
        draw_legend(canvas, &self.series, frame);
        let below = if self.label.is_empty() { 0.0 } else { 20.0 };
        let inner = frame.inset(0.0, legend + 4.0, 0.0, below);
        let [cx, cy] = inner.centre();
        // Room for the labels of the angles, and left and right for the words.
        let radius = (0.5 * inner.height - 20.0).min(0.5 * inner.width - 60.0).max(10.0);
        let largest = self.largest();
        let place = |[angle, value]: [f64; 2]| -> Option<[f64; 2]> {
            if !angle.is_finite() {
                return None;
            }
            let r = radius * self.share(value, largest)?;
            Some([cx + r * angle.cos(), cy - r * angle.sin()])
        };

        let grid = Stroke::solid(Colour::GRID, 0.7);
        let small = TextStyle::new(Figure::SMALL, Colour::GREY).centred();
        for step in 0..12 {
            let angle = TAU * f64::from(step) / 12.0;
            let (sin, cos) = angle.sin_cos();
            canvas.line([cx, cy], [cx + radius * cos, cy - radius * sin], &grid);
            let degrees = if step <= 6 { 30 * step } else { 30 * step - 360 };
            let anchor = match step {
                3 | 9 => Anchor::Middle,
                4..=8 => Anchor::End,
                _ => Anchor::Start,
            };
            let at = [cx + (radius + 7.0) * cos, cy - (radius + 11.0) * sin];
            canvas.text(at, &format!("{degrees}°").replace('-', "−"), &small.anchored(anchor));
        }
        let rings = self.rings(largest);
        for (value, _) in &rings {
            if let Some(share) = self.share(*value, largest) {
                canvas.circle([cx, cy], radius * share, None, Some(&grid));
            }
        }
        canvas.circle([cx, cy], radius, None, Some(&Stroke::solid(Colour::GREY, 0.9)));

        for (index, series) in self.series.iter().enumerate() {
            let stroke = series.stroke_at(index);
            for run in runs(series.points.iter().map(|&point| place(point))) {
                canvas.polyline(&run, &stroke);
            }
            if let Some(marker) = series.marker {
                for point in series.points.iter().filter_map(|&point| place(point)) {
                    marker.draw(canvas, point, series.colour_at(index));
                }
            }
        }

        // Between two spokes, where few lobes are, and on top with a rim.
        let (sin, cos) = 75_f64.to_radians().sin_cos();
        let tiny = TextStyle { rim: true, ..TextStyle::new(Figure::TINY, Colour::GREY) };
        for (value, label) in &rings {
            if let Some(share) = self.share(*value, largest).filter(|share| *share > 0.1) {
                let r = radius * share;
                canvas.text([cx + r * cos, cy - r * sin], label, &tiny.anchored(Anchor::Middle).centred());
            }
        }
        let [right, left] = &self.ends;
        let word = TextStyle::new(Figure::TINY, Colour::INK);
        canvas.text([cx + radius + 13.0, cy + 17.0], right, &word);
        canvas.text([cx - radius - 13.0, cy + 17.0], left, &word.anchored(Anchor::End));
        let name = TextStyle::new(Figure::SMALL, Colour::INK).anchored(Anchor::Middle);
        canvas.text([cx, frame.bottom() - 4.0], &self.label, &name);
    }

    /// The value of the outer circle.
    fn largest(&self) -> f64 {
        let values = self.series.iter().flat_map(|series| series.points.iter().map(|[_, value]| *value));
        let most = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
        let asked = self.largest.filter(|value| value.is_finite() && *value > 0.0);
        asked.unwrap_or(if most > 0.0 { 1.04 * most } else { 1.0 })
    }

    /// Where a value lies, as a share of the radius; none for what is no number.
    fn share(&self, value: f64, largest: f64) -> Option<f64> {
        if value.is_nan() {
            return None;
        }
        // Values beyond the outer circle stop on it.
        let x = (value / largest).clamp(0.0, 1.0);
        Some(match self.radial {
            Radial::Root => x.sqrt(),
            Radial::Linear => x,
            Radial::Log(decades) => (1.0 + x.log10() / decades.max(0.1)).max(0.0),
        })
    }

    /// Values of the rings inside the outer circle with their labels.
    fn rings(&self, largest: f64) -> Vec<(f64, String)> {
        match self.radial {
            Radial::Linear => {
                linear_ticks(0.0, largest, 5).0.into_iter().filter(|(x, _)| *x > 0.0 && *x < largest).collect()
            }
            Radial::Log(decades) => log_ticks(largest * 10_f64.powf(-decades.max(0.1)), largest, 5).0,
            Radial::Root => {
                // Round values from the outside in, not too close to each other.
                let top = largest.log10().floor() as i32;
                let mut rings: Vec<(f64, String)> = Vec::new();
                let mut last = 1.1;
                for decade in (top - 3..=top).rev() {
                    for digit in [5.0, 2.0, 1.0] {
                        let value = digit * 10_f64.powi(decade);
                        let share = (value / largest).sqrt();
                        if value <= largest && share >= 0.2 && last - share >= 0.17 {
                            rings.push((value, plain(value)));
                            last = share;
                        }
                    }
                }
                rings
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_gives_equal_areas_to_equal_shares() {
        let polar = Polar::default();
        let share = |x: f64| polar.share(x, 4.0).unwrap();
        assert!((share(4.0).powi(2) - 4.0 * share(1.0).powi(2)).abs() < 1e-12);
        assert_eq!((share(0.0), share(-1.0), share(9.0)), (0.0, 0.0, 1.0));
        assert_eq!(polar.share(f64::NAN, 4.0), None);
    }

    #[test]
    fn rings_lie_inside_and_there_are_some() {
        for radial in [Radial::Root, Radial::Linear, Radial::Log(3.0)] {
            let polar = Polar { radial, ..Polar::default() };
            for i in 0..60 {
                let largest = 10_f64.powf(f64::from(i) / 10.0 - 3.0);
                let rings = polar.rings(largest);
                assert!((2..=8).contains(&rings.len()), "{radial:?} {largest}: {rings:?}");
                for (value, label) in rings {
                    assert!(value > 0.0 && value <= largest * (1.0 + 1e-9) && !label.is_empty(), "{largest}: {value}");
                }
            }
        }
    }

    #[test]
    fn nothing_to_draw_is_no_reason_to_fail() {
        let empty = Polar { series: vec![Series::line("none", vec![[f64::NAN, 0.0], [0.0, 0.0]])], ..Polar::default() };
        assert_eq!(empty.largest(), 1.0);
        let mut canvas = Canvas::default();
        empty.draw(&mut canvas, &Frame { x: 0.0, y: 0.0, width: 5.0, height: 5.0 });
        assert!(canvas.finish(5.0, 5.0, "").contains("150°"));
    }
}
