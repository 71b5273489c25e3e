//! Lines, areas, words and pictures on a sheet, written down as SVG.

use std::fmt::Write as _;

use super::{Colour, Picture};

/// The compiled-in font first; whoever opens the SVG without it gets the viewer's own.
const FONTS: &str = "Ubuntu, 'Ubuntu Light', 'Helvetica Neue', Arial, sans-serif";

/// A rectangle on the sheet, y downwards, pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frame {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Frame {
    /// Right edge.
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    /// Bottom edge.
    pub fn bottom(&self) -> f64 {
        self.y + self.height
    }

    /// The middle.
    pub fn centre(&self) -> [f64; 2] {
        [self.x + 0.5 * self.width, self.y + 0.5 * self.height]
    }

    /// What is left after margins, never less than one pixel.
    pub fn inset(&self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self {
            x: self.x + left,
            y: self.y + top,
            width: (self.width - left - right).max(1.0),
            height: (self.height - top - bottom).max(1.0),
        }
    }
}

/// How a line is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub colour: Colour,
    /// Its width, pixels.
    pub width: f64,
    /// Lengths of dashes and gaps, pixels; none for a solid line.
    pub dashes: Vec<f64>,
}

impl Stroke {
    /// A solid line.
    pub fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashes: Vec::new() }
    }
}

/// Which point of a text lies at its position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// The start.
    #[default]
    Start,
    /// The middle.
    Middle,
    /// The end.
    End,
}

/// How text is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextStyle {
    /// Size, pixels.
    pub size: f64,
    /// Its colour.
    pub colour: Colour,
    /// What lies at the position, along the text.
    pub anchor: Anchor,
    /// Whether the position is at half the height of the letters instead of at the baseline.
    pub centred: bool,
    /// Turned clockwise about the position, degrees.
    pub turned: f64,
    /// Whether a white rim keeps it readable on lines.
    pub rim: bool,
}

impl TextStyle {
    /// Upright text that starts at its position.
    pub fn new(size: f64, colour: Colour) -> Self {
        Self { size, colour, anchor: Anchor::Start, centred: false, turned: 0.0, rim: false }
    }

    /// The same with another anchor.
    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same, centred on the height of the letters.
    pub fn centred(self) -> Self {
        Self { centred: true, ..self }
    }
}

/// A sheet that remembers what is drawn as the body of an SVG.
#[derive(Clone, Debug, Default)]
pub struct Canvas {
    body: String,
    clips: usize,
}

impl Canvas {
    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: &Stroke) {
        let [x1, y1] = from.map(number);
        let [x2, y2] = to.map(number);
        let stroke = stroke_attributes(stroke);
        self.push(format_args!(r#"<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" {stroke}/>"#));
    }

    /// A line through points; fewer than two draw nothing.
    pub fn polyline(&mut self, points: &[[f64; 2]], stroke: &Stroke) {
        if points.len() < 2 {
            return;
        }
        let (points, stroke) = (point_list(points), stroke_attributes(stroke));
        self.push(format_args!(r#"<polyline points="{points}" fill="none" {stroke}/>"#));
    }

    /// A filled area; fewer than three points draw nothing.
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: Colour, opacity: f64) {
        if points.len() < 3 {
            return;
        }
        let (points, opacity) = (point_list(points), number(opacity));
        self.push(format_args!(r#"<polygon points="{points}" fill="{fill}" fill-opacity="{opacity}"/>"#));
    }

    /// A filled rectangle.
    pub fn rectangle(&mut self, frame: &Frame, fill: Colour, opacity: f64) {
        let at = frame_attributes(frame);
        let opacity = number(opacity);
        self.push(format_args!(r#"<rect {at} fill="{fill}" fill-opacity="{opacity}"/>"#));
    }

    /// The outline of a rectangle.
    pub fn outline(&mut self, frame: &Frame, stroke: &Stroke) {
        let (at, stroke) = (frame_attributes(frame), stroke_attributes(stroke));
        self.push(format_args!(r#"<rect {at} fill="none" {stroke}/>"#));
    }

    /// A circle, filled or as a line.
    pub fn circle(&mut self, centre: [f64; 2], radius: f64, fill: Option<Colour>, stroke: Option<&Stroke>) {
        let ([cx, cy], r) = (centre.map(number), number(radius));
        let fill = fill.map_or_else(|| "none".to_owned(), |fill| fill.to_string());
        let stroke = stroke.map(stroke_attributes).unwrap_or_default();
        self.push(format_args!(r#"<circle cx="{cx}" cy="{cy}" r="{r}" fill="{fill}" {stroke}/>"#));
    }

    /// A line of text; `^{..}` and `_{..}` are set above and below.
    pub fn text(&mut self, [x, y]: [f64; 2], text: &str, style: &TextStyle) {
        if text.is_empty() {
            return;
        }
        // Half the height of a capital: what the eye takes for the middle of a line.
        let baseline = if style.centred { y + 0.35 * style.size } else { y };
        let mut spans = String::new();
        let mut shift_now = 0.0;
        for (level, part) in levels(text) {
            let shift = match level {
                Level::Base => 0.0,
                Level::Above => -0.36 * style.size,
                Level::Below => 0.22 * style.size,
            };
            let step = shift - shift_now;
            shift_now = shift;
            let part = escaped(part);
            let size = if level == Level::Base { style.size } else { SMALL * style.size };
            // Writing to a string cannot fail.
            let _ = if level == Level::Base && step == 0.0 {
                write!(spans, "{part}")
            } else {
                write!(spans, r#"<tspan dy="{}" font-size="{}">{part}</tspan>"#, number(step), number(size))
            };
        }
        let anchor = match style.anchor {
            Anchor::Start => "",
            Anchor::Middle => r#" text-anchor="middle""#,
            Anchor::End => r#" text-anchor="end""#,
        };
        let turned = if style.turned == 0.0 {
            String::new()
        } else {
            format!(r#" transform="rotate({} {} {})""#, number(style.turned), number(x), number(y))
        };
        let (x, y, size, colour) = (number(x), number(baseline), number(style.size), style.colour);
        if style.rim {
            // Drawn under the letters by itself: not every viewer knows `paint-order`.
            self.push(format_args!(
                r##"<text x="{x}" y="{y}" font-size="{size}" fill="#ffffff" stroke="#ffffff" stroke-width="3" stroke-linejoin="round"{anchor}{turned}>{spans}</text>"##
            ));
        }
        self.push(format_args!(
            r#"<text x="{x}" y="{y}" font-size="{size}" fill="{colour}"{anchor}{turned}>{spans}</text>"#
        ));
    }

    /// A picture stretched to a frame.
    ///
    /// `crisp` keeps the edges of its pixels; otherwise the viewer may smooth it.
    pub fn picture(&mut self, frame: &Frame, picture: &Picture, crisp: bool) {
        let at = frame_attributes(frame);
        let data = super::image::base64(&picture.png());
        let rendering = if crisp { r#" image-rendering="optimizeSpeed""# } else { "" };
        // The old name of the link: every viewer knows it.
        self.push(format_args!(
            r#"<image {at} preserveAspectRatio="none"{rendering} xlink:href="data:image/png;base64,{data}"/>"#
        ));
    }

    /// What `draw` draws shows inside `frame` only.
    pub fn clipped(&mut self, frame: &Frame, draw: impl FnOnce(&mut Self)) {
        let (id, at) = (self.clips, frame_attributes(frame));
        self.clips += 1;
        self.push(format_args!(r#"<clipPath id="clip{id}"><rect {at}/></clipPath>"#));
        self.push(format_args!(r#"<g clip-path="url(#clip{id})">"#));
        draw(self);
        self.push(format_args!("</g>"));
    }

    /// The whole file, on white; `title` is what screen readers say.
    pub fn finish(self, width: f64, height: f64, title: &str) -> String {
        let (w, h, title) = (number(width), number(height), escaped(title));
        let body = self.body;
        format!(
            r##"<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="{w}" height="{h}" viewBox="0 0 {w} {h}" font-family="{FONTS}" font-weight="300" text-rendering="geometricPrecision">
<title>{title}</title>
<rect width="{w}" height="{h}" fill="#ffffff"/>
{body}</svg>
"##
        )
    }

    fn push(&mut self, element: std::fmt::Arguments<'_>) {
        let _ = self.body.write_fmt(element);
        self.body.push('\n');
    }
}

/// About how wide a text is, pixels, its raised and lowered parts included.
///
/// From classes of letters, good to some 10 %: enough to reserve room.
pub fn text_width(text: &str, size: f64) -> f64 {
    let mut width = 0.0;
    for (level, part) in levels(text) {
        let scale = if level == Level::Base { 1.0 } else { SMALL };
        width += scale * part.chars().map(advance).sum::<f64>();
    }
    width * size
}

/// Breaks a text at blanks into lines of at most about `width` pixels; longer words stand alone.
pub(crate) fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
        if line.is_empty() || text_width(&longer, size) <= width {
            line = longer;
        } else {
            lines.push(std::mem::replace(&mut line, word.to_owned()));
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// Size of raised and lowered text.
const SMALL: f64 = 0.72;

/// Advance of a letter, shares of the size.
fn advance(letter: char) -> f64 {
    match letter {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | ' ' | '·' => 0.26,
        'f' | 'r' | 't' | '(' | ')' | '[' | ']' | '-' | '/' | '"' | '°' | 'I' => 0.36,
        'm' | 'w' | 'M' | 'W' | '@' | '%' | '∫' => 0.84,
        'A'..='Z' => 0.66,
        _ => 0.55,
    }
}

/// Where a part of a text stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Base,
    Above,
    Below,
}

/// A text in parts: plain, `^{above}`, `_{below}`. An opening without an end is plain text.
fn levels(text: &str) -> Vec<(Level, &str)> {
    let mut parts = Vec::new();
    let mut rest = text;
    while let Some((start, level)) = opening(rest) {
        let Some(length) = rest[start + 2..].find('}') else { break };
        if start > 0 {
            parts.push((Level::Base, &rest[..start]));
        }
        parts.push((level, &rest[start + 2..start + 2 + length]));
        rest = &rest[start + 3 + length..];
    }
    if !rest.is_empty() {
        parts.push((Level::Base, rest));
    }
    parts
}

fn opening(text: &str) -> Option<(usize, Level)> {
    let above = text.find("^{").map(|at| (at, Level::Above));
    let below = text.find("_{").map(|at| (at, Level::Below));
    [above, below].into_iter().flatten().min_by_key(|&(at, _)| at)
}

/// A text that XML takes: no markup, no control characters.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// A number with at most two decimals: a hundredth of a pixel is nothing, and short files are.
fn number(x: f64) -> String {
    if !x.is_finite() {
        return "0".to_owned();
    }
    let text = format!("{x:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn point_list(points: &[[f64; 2]]) -> String {
    let points: Vec<String> = points.iter().map(|&[x, y]| format!("{},{}", number(x), number(y))).collect();
    points.join(" ")
}

fn frame_attributes(frame: &Frame) -> String {
    let [x, y, width, height] = [frame.x, frame.y, frame.width, frame.height].map(number);
    format!(r#"x="{x}" y="{y}" width="{width}" height="{height}""#)
}

fn stroke_attributes(stroke: &Stroke) -> String {
    let mut text =
        format!(r#"stroke="{}" stroke-width="{}" stroke-linejoin="round""#, stroke.colour, number(stroke.width));
    if !stroke.dashes.is_empty() {
        let dashes: Vec<String> = stroke.dashes.iter().map(|&length| number(length)).collect();
        let _ = write!(text, r#" stroke-dasharray="{}""#, dashes.join(" "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_odd() {
        for (x, text) in [(1.0, "1"), (0.126, "0.13"), (-0.001, "0"), (100.0, "100"), (f64::NAN, "0"), (-2.5, "-2.5")] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn text_is_parted_into_levels() {
        use Level::{Above, Base, Below};
        assert_eq!(levels("sr^{-1}"), [(Base, "sr"), (Above, "-1")]);
        assert_eq!(levels("θ_{s} and θ_{k}"), [(Base, "θ"), (Below, "s"), (Base, " and θ"), (Below, "k")]);
        assert_eq!(levels("kajiya_kay"), [(Base, "kajiya_kay")]);
        assert_eq!(levels("x^{open"), [(Base, "x^{open")]);
        assert!(levels("").is_empty());
    }

    #[test]
    fn text_cannot_break_out() {
        let mut canvas = Canvas::default();
        canvas.text([1.0, 2.0], "</text><script>&\"\u{0}", &TextStyle::new(10.0, Colour::INK));
        let svg = canvas.finish(10.0, 10.0, "a < b");
        assert!(svg.contains("&lt;/text&gt;&lt;script&gt;&amp;&quot; </text>"), "{svg}");
        assert!(svg.contains("<title>a &lt; b</title>"));
    }

    #[test]
    fn lines_break_at_blanks_only_where_they_must() {
        let lines = wrapped("the quick brown fox", 10.0, 60.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| text_width(line, 10.0) <= 60.0), "{lines:?}");
        assert_eq!(lines.join(" "), "the quick brown fox");
        assert_eq!(wrapped("unbreakable", 10.0, 1.0), ["unbreakable"]);
        assert!(wrapped("  ", 10.0, 1.0).is_empty());
    }
}
