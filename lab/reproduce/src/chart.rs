//! Charts of measured numbers, drawn by the crate `plot`.
//!
//! Experiments say what there is to see; how it looks is decided here, so that all pages look alike.

use plot::chart::{Axes, Axis, Colour, Dash, Figure, Marker, Panel, Scale, Series};

use crate::raster::Raster;
use crate::{Error, Picture};

/// Width of a chart with one panel, pixels.
const WIDTH: u32 = 720;

/// How the points of a curve are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// By a line.
    Line,
    /// By a grey dashed line: what is expected.
    Dashed,
    /// By a line, with a sign at each point.
    Marked,
    /// Not at all: a sign at each point.
    Points,
}

/// Some points and their name.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What it is called in the legend.
    pub name: String,
    /// `[x, y]`.
    pub points: Vec<[f64; 2]>,
    /// How they are joined.
    pub style: Style,
}

impl Curve {
    /// Points joined by a line.
    pub fn line(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Line }
    }

    /// What is expected, or only for comparison.
    pub fn dashed(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Dashed }
    }

    /// A few measurements joined by a line.
    pub fn marked(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Marked }
    }

    /// Measurements.
    pub fn points(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Points }
    }
}

/// Curves over Cartesian axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// What stands above it.
    pub title: String,
    /// What goes to the right, with its unit.
    pub x: String,
    /// What goes up, with its unit.
    pub y: String,
    /// Whether x is spread by its logarithm.
    pub x_log: bool,
    /// Whether y is.
    pub y_log: bool,
    /// First and last x; from the points if left out.
    pub x_range: Option<(f64, f64)>,
    /// First and last y; from the points if left out.
    pub y_range: Option<(f64, f64)>,
    /// What is drawn.
    pub curves: Vec<Curve>,
}

impl Chart {
    /// The chart as a picture of a page.
    ///
    /// # Errors
    /// When it cannot be drawn.
    pub fn picture(&self, stem: &'static str, caption: impl Into<String>) -> Result<Picture, Error> {
        drawn(
            &Figure { title: self.title.clone(), panels: vec![Panel::new("", self.axes())], ..Figure::default() },
            WIDTH,
        )?
        .picture(stem, caption)
    }

    fn axes(&self) -> Axes {
        let axis = |label: &str, log: bool, range: Option<(f64, f64)>| Axis {
            scale: if log { Scale::Log } else { Scale::Linear },
            range,
            ..Axis::new(label)
        };
        let mut place = 0;
        let series = self.curves.iter().map(|curve| {
            let series = Series::line(&curve.name, curve.points.clone());
            if curve.style == Style::Dashed {
                return series.styled(Colour::GREY, Dash::Dashed);
            }
            // Places are counted without the grey lines, so that these take no colour away.
            let marker = Marker::SERIES[place % Marker::SERIES.len()];
            let (colour, dash) =
                (Colour::SERIES[place % Colour::SERIES.len()], Dash::SERIES[place % Dash::SERIES.len()]);
            place += 1;
            match curve.style {
                Style::Line | Style::Dashed => series.styled(colour, dash),
                Style::Marked => series.styled(colour, dash).marked(marker),
                Style::Points => Series::scatter(&curve.name, curve.points.clone()).styled(colour, dash).marked(marker),
            }
        });
        Axes {
            x: axis(&self.x, self.x_log, self.x_range),
            y: axis(&self.y, self.y_log, self.y_range),
            series: series.collect(),
            ..Axes::default()
        }
    }
}

/// Charts side by side as one picture of a page.
///
/// # Errors
/// When they cannot be drawn.
pub fn side_by_side(charts: &[Chart], stem: &'static str, caption: impl Into<String>) -> Result<Picture, Error> {
    let panels = charts.iter().map(|chart| Panel::new(&chart.title, chart.axes())).collect();
    let columns = charts.len().max(1);
    // Half the width of a chart alone is enough for each, and a little for the ticks.
    let width = WIDTH as f64 * (0.25 + 0.6 * columns as f64);
    drawn(&Figure { columns, width, letters: charts.len() > 1, panels, ..Figure::default() }, width as u32)?
        .picture(stem, caption)
}

/// A figure of the crate `plot` in pixels.
///
/// # Errors
/// When it cannot be drawn.
pub fn drawn(figure: &Figure, columns: u32) -> Result<Raster, Error> {
    let picture = figure.picture(columns).map_err(|error| Error::Picture(error.to_string()))?;
    let pixels = picture.rgb().chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Ok(Raster { width: picture.width() as usize, height: picture.height() as usize, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_lines_take_no_colour_from_the_others() {
        let line = vec![[1.0, 1.0], [2.0, 4.0]];
        let chart = Chart {
            curves: vec![
                Curve::dashed("law", line.clone()),
                Curve::marked("a", line.clone()),
                Curve::points("b", line),
            ],
            x_log: true,
            ..Chart::default()
        };
        let axes = chart.axes();
        assert_eq!(axes.series[0].colour, Some(Colour::GREY));
        assert_eq!(axes.series[1].colour, Some(Colour::SERIES[0]));
        assert_eq!(axes.series[2].colour, Some(Colour::SERIES[1]));
        assert_eq!(axes.x.scale, Scale::Log);
        let picture = chart.picture("law", "A law").unwrap();
        assert_eq!(picture.png[1..4], *b"PNG");
        assert!(picture.png.len() <= crate::raster::LARGEST);
    }
}
