//! A figure: panels in a grid, a title above, a caption below.

use super::scene::{Anchor, Canvas, Frame, TextStyle, wrapped};
use super::{Axes, Colour, Heat, Listing, Picture, PngError, Polar, raster};

/// What a panel shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Plot {
    /// Cartesian axes.
    Axes(Axes),
    /// Polar axes.
    Polar(Polar),
    /// A heat map.
    Heat(Heat),
    /// A picture, at its own shape.
    Picture(Picture),
    /// Names and values.
    Listing(Listing),
    /// Nothing: an empty place in the grid.
    Empty,
}

macro_rules! into_plot {
    ($($kind:ident),*) => {
        $(impl From<$kind> for Plot {
            fn from(plot: $kind) -> Self {
                Self::$kind(plot)
            }
        })*
    };
}
into_plot!(Axes, Polar, Heat, Picture, Listing);

/// One place of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What stands above it.
    pub title: String,
    /// What it shows.
    pub plot: Plot,
    /// How many columns it takes, at least 1.
    pub span: usize,
    /// Height without the title, pixels; by what it shows and its width if left out.
    pub height: Option<f64>,
}

impl Panel {
    /// A panel of one column.
    pub fn new(title: &str, plot: impl Into<Plot>) -> Self {
        Self { title: title.to_owned(), plot: plot.into(), span: 1, height: None }
    }

    /// The same over several columns.
    pub fn spanning(self, span: usize) -> Self {
        Self { span, ..self }
    }

    fn wanted_height(&self, width: f64) -> f64 {
        if let Some(height) = self.height.filter(|height| height.is_finite() && *height >= 1.0) {
            return height;
        }
        match &self.plot {
            Plot::Axes(_) => (0.68 * width).min(420.0),
            Plot::Polar(_) => (0.86 * width).min(520.0),
            Plot::Heat(_) => (0.62 * width).min(460.0),
            Plot::Picture(picture) => width * f64::from(picture.height()) / f64::from(picture.width()),
            Plot::Listing(listing) => listing.height(width),
            Plot::Empty => 0.0,
        }
    }

    fn draw(&self, canvas: &mut Canvas, frame: &Frame, wanted: f64) {
        match &self.plot {
            Plot::Axes(axes) => axes.draw(canvas, frame),
            Plot::Polar(polar) => polar.draw(canvas, frame),
            Plot::Heat(heat) => heat.draw(canvas, frame),
            // A picture keeps its shape in a row that is higher.
            Plot::Picture(picture) => {
                let shape = f64::from(picture.width()) / f64::from(picture.height());
                let height = wanted.min(frame.height);
                canvas.picture(&Frame { width: (height * shape).min(frame.width), height, ..*frame }, picture, false);
            }
            Plot::Listing(listing) => listing.draw(canvas, frame),
            Plot::Empty => {}
        }
    }
}

/// Panels in a grid, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What stands above all.
    pub title: String,
    /// A line below it.
    pub subtitle: String,
    /// What stands below all, broken into lines.
    pub caption: String,
    /// Columns of the grid, at least 1.
    pub columns: usize,
    /// Width of the whole, pixels.
    pub width: f64,
    /// Whether the titles of panels begin with (a), (b), …
    pub letters: bool,
    /// The panels.
    pub panels: Vec<Panel>,
}

impl Default for Figure {
    fn default() -> Self {
        Self {
            title: String::new(),
            subtitle: String::new(),
            caption: String::new(),
            columns: 1,
            width: 720.0,
            letters: false,
            panels: Vec::new(),
        }
    }
}

/// Where a panel came to lie.
struct Place<'a> {
    panel: &'a Panel,
    title: String,
    x: f64,
    width: f64,
    wanted: f64,
}

impl Figure {
    /// Size of titles, pixels.
    pub const TITLE: f64 = 17.0;
    /// Size of the titles of panels.
    pub const HEADING: f64 = 13.0;
    /// Size of names of axes.
    pub const TEXT: f64 = 12.0;
    /// Size of ticks and legends.
    pub const SMALL: f64 = 11.0;
    /// Size of words among data.
    pub const TINY: f64 = 10.0;

    const MARGIN: f64 = 28.0;
    const GUTTER: [f64; 2] = [36.0, 26.0];
    const HEADING_ROOM: f64 = 24.0;

    /// The figure as an SVG file: the same text on every machine.
    pub fn svg(&self) -> String {
        self.drawn().0
    }

    /// The figure as a PNG file, `columns` pixels wide.
    ///
    /// # Errors
    ///
    /// A side of the picture is 0 or above 16384 pixels.
    pub fn png(&self, columns: u32) -> Result<Vec<u8>, PngError> {
        self.picture(columns).map(|picture| picture.png())
    }

    /// The figure as a picture, `columns` pixels wide.
    ///
    /// # Errors
    ///
    /// A side of the picture is 0 or above 16384 pixels.
    pub fn picture(&self, columns: u32) -> Result<Picture, PngError> {
        let (svg, size) = self.drawn();
        raster::draw(&svg, size, columns)
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [f64; 2] {
        self.drawn().1
    }

    fn drawn(&self) -> (String, [f64; 2]) {
        let width = if self.width.is_finite() { self.width.clamp(120.0, 10_000.0) } else { 720.0 };
        let inner = width - 2.0 * Self::MARGIN;
        let mut canvas = Canvas::default();
        let mut y = Self::MARGIN;
        for (text, size, colour) in
            [(&self.title, Self::TITLE, Colour::INK), (&self.subtitle, Self::TEXT, Colour::GREY)]
        {
            for line in wrapped(text, size, inner) {
                canvas.text([Self::MARGIN, y + 0.8 * size], &line, &TextStyle::new(size, colour));
                y += 1.35 * size;
            }
        }
        if y > Self::MARGIN {
            y += 10.0;
        }
        let rows = self.rows(inner);
        for (i, row) in rows.iter().enumerate() {
            if i > 0 {
                y += Self::GUTTER[1];
            }
            if row.iter().any(|place| !place.title.is_empty()) {
                for place in row {
                    let style = TextStyle::new(Self::HEADING, Colour::INK).anchored(Anchor::Start);
                    canvas.text([place.x, y + 12.0], &place.title, &style);
                }
                y += Self::HEADING_ROOM;
            }
            let height = row.iter().map(|place| place.wanted).fold(0.0, f64::max);
            for place in row {
                let frame = Frame { x: place.x, y, width: place.width, height };
                place.panel.draw(&mut canvas, &frame, place.wanted);
            }
            y += height;
        }
        let caption = wrapped(&self.caption, Self::TEXT, inner);
        if !caption.is_empty() {
            y += 14.0;
        }
        for line in caption {
            canvas.text([Self::MARGIN, y + 0.8 * Self::TEXT], &line, &TextStyle::new(Self::TEXT, Colour::GREY));
            y += 1.4 * Self::TEXT;
        }
        let height = (y + Self::MARGIN).ceil();
        (canvas.finish(width, height, &self.title), [width, height])
    }

    /// The panels of each row: a panel that no longer fits begins the next one.
    fn rows(&self, inner: f64) -> Vec<Vec<Place<'_>>> {
        let columns = self.columns.max(1);
        let gutter = Self::GUTTER[0];
        let cell = ((inner - gutter * (columns - 1) as f64) / columns as f64).max(20.0);
        let mut rows: Vec<Vec<Place<'_>>> = Vec::new();
        let mut next = columns;
        let mut lettered = 0_u8;
        for panel in &self.panels {
            let span = panel.span.clamp(1, columns);
            if next + span > columns {
                rows.push(Vec::new());
                next = 0;
            }
            let width = span as f64 * cell + (span - 1) as f64 * gutter;
            let title = if self.letters && panel.plot != Plot::Empty && lettered < 26 {
                lettered += 1;
                format!("({}) {}", char::from(b'a' + lettered - 1), panel.title).trim_end().to_owned()
            } else {
                panel.title.clone()
            };
            let x = Self::MARGIN + next as f64 * (cell + gutter);
            let place = Place { panel, title, x, width, wanted: panel.wanted_height(width) };
            next += span;
            if let Some(row) = rows.last_mut() {
                row.push(place);
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_fill_rows_and_never_overlap() {
        let panel = |span| Panel { height: Some(50.0), ..Panel::new("p", Plot::Empty).spanning(span) };
        let figure =
            Figure { columns: 3, panels: vec![panel(1), panel(1), panel(2), panel(9), panel(1)], ..Figure::default() };
        let rows = figure.rows(660.0);
        let counts: Vec<usize> = rows.iter().map(Vec::len).collect();
        assert_eq!(counts, [2, 1, 1, 1]);
        for row in &rows {
            for pair in row.windows(2) {
                assert!(pair[0].x + pair[0].width < pair[1].x);
            }
            let end = row.last().map(|place| place.x + place.width).unwrap();
            assert!(end <= Figure::MARGIN + 660.0 + 1e-9);
        }
    }

    #[test]
    fn letters_count_what_is_there() {
        let panels = vec![
            Panel::new("first", Listing::default()),
            Panel::new("", Plot::Empty),
            Panel::new("", Listing::default()),
        ];
        let figure = Figure { letters: true, panels, ..Figure::default() };
        let titles: Vec<String> = figure.rows(600.0).into_iter().flatten().map(|place| place.title).collect();
        assert_eq!(titles, ["(a) first", "", "(b)"]);
    }
}
