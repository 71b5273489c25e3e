//! What a fiber scatters, as figures.
//!
//! A [`Subject`] is a fiber with a known direction; [`figure`] shows it from the sides asked for, [`sheet`]
//! puts everything on one page. The numbers come from [`measure`].
//!
//! ```
//! use fiber::{Fiber, Lambertian};
//! use math::Rgb;
//! use plot::lobes::{Kind, Options, Subject, Viewing, figure};
//!
//! let fiber = Fiber::Lambertian(Lambertian { albedo: Rgb::splat(0.5) });
//! let subject = Subject { name: "chalk".into(), fiber, viewing: Viewing::default() };
//! let svg = figure(&subject, &[Kind::Longitudinal], &Options::default()).svg();
//! assert!(svg.contains("chalk") && svg.contains("−90°"));
//! ```

pub mod measure;

pub use measure::{Offset, Slice, Viewing};

use fiber::{Fiber, LOBE_NAMES, Lobes};
use math::Rgb;

use crate::chart::{
    Axes, Axis, Colour, ColourMap, Dash, Figure, Guide, Heat, HeatScale, Listing, Panel, Plot, Polar, Series,
};
use measure::{Histogram, Sampled};

/// A fiber, where it is seen from, and what it is called.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// What stands above the figure.
    pub name: String,
    /// The fiber.
    pub fiber: Fiber<f64>,
    /// The known direction and the offset.
    pub viewing: Viewing,
}

/// One side of a subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Lobes around the fiber, polar.
    Azimuth,
    /// Lobes along the fiber.
    Longitudinal,
    /// All directions as a map.
    Sphere,
    /// What the sampler draws against its density.
    Histogram,
    /// What comes back against the known inclination.
    Albedo,
}

impl Kind {
    /// All kinds, in the order of [`sheet`].
    pub const ALL: [Self; 5] = [Self::Azimuth, Self::Longitudinal, Self::Sphere, Self::Histogram, Self::Albedo];
}

/// What is open in a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// What azimuthal plots show.
    pub slice: Slice,
    /// Directions drawn for the histogram.
    pub draws: u32,
    /// Of the numbers they are drawn with.
    pub seed: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { slice: Slice::default(), draws: 1_000_000, seed: 0 }
    }
}

/// Panels with a sentence for the caption.
type Part = (Vec<Panel>, String);

/// A figure of the kinds asked for: one panel on its own, or two columns.
pub fn figure(subject: &Subject, kinds: &[Kind], options: &Options) -> Figure {
    let parts: Vec<Part> = kinds.iter().map(|&kind| part(subject, kind, options)).collect();
    let caption = caption(kinds, parts.iter().map(|(_, note)| note.as_str()));
    let panels: Vec<Panel> = parts.into_iter().flat_map(|(panels, _)| panels).collect();
    let several = panels.len() > 1;
    Figure {
        title: subject.name.clone(),
        subtitle: subtitle(subject),
        caption,
        columns: if several { 2 } else { 1 },
        width: if several { 1120.0 } else { 720.0 },
        letters: several,
        panels,
    }
}

/// One page, of the shape of A4, with the parameters and all plots.
pub fn sheet(subject: &Subject, options: &Options) -> Figure {
    let [(azimuth, a), (longitudinal, b), (sphere, c), (histogram, d), (albedo, e)] =
        Kind::ALL.map(|kind| part(subject, kind, options));
    let listing = Listing { entries: parameters(&subject.fiber) };
    // A model with many parameters makes the page a little longer.
    let top = listing.height(SHEET_COLUMN).max(330.0);
    let listing = Panel::new("Parameters", listing);
    // The marginal over the inclination stays out: the longitudinal plot shows the same lobes.
    let rows: [(f64, Vec<Panel>); 4] = [
        (top, std::iter::once(listing).chain(azimuth).collect()),
        (250.0, longitudinal.into_iter().chain(sphere).collect()),
        (250.0, histogram.into_iter().take(2).collect()),
        (240.0, albedo),
    ];
    let mut panels = Vec::new();
    for (height, row) in rows {
        let missing = 2_usize.saturating_sub(row.len());
        panels.extend(row.into_iter().map(|panel| Panel { height: Some(height), ..panel }));
        panels.extend(std::iter::repeat_n(Panel::new("", Plot::Empty), missing));
    }
    Figure {
        title: subject.name.clone(),
        subtitle: subtitle(subject),
        caption: caption(&Kind::ALL, [&a, &b, &c, &d, &e].into_iter().map(String::as_str)),
        columns: 2,
        width: 1000.0,
        letters: false,
        panels,
    }
}

/// Width of a column of the sheet, pixels.
const SHEET_COLUMN: f64 = 454.0;

/// The sentences below a figure, what `f` is first.
fn caption<'a>(kinds: &[Kind], notes: impl Iterator<Item = &'a str>) -> String {
    let shows_f = kinds.iter().any(|kind| matches!(kind, Kind::Azimuth | Kind::Longitudinal | Kind::Sphere));
    let definition = "f is the scattering function times the cosine of the sampled inclination, S cos θ_{s}, shown \
                      as its luminance.";
    let sentences = shows_f.then_some(definition).into_iter().chain(notes).filter(|note| !note.is_empty());
    sentences.collect::<Vec<_>>().join(" ")
}

/// The panels of one kind: one of them, three for the histogram, two for the albedo.
pub fn panels(subject: &Subject, kind: Kind, options: &Options) -> Vec<Panel> {
    part(subject, kind, options).0
}

fn part(subject: &Subject, kind: Kind, options: &Options) -> Part {
    match kind {
        Kind::Azimuth => azimuth_part(subject, options.slice),
        Kind::Longitudinal => longitudinal_part(subject),
        Kind::Sphere => sphere_part(subject),
        Kind::Histogram => histogram_part(subject, options),
        Kind::Albedo => albedo_part(subject),
    }
}

fn subtitle(subject: &Subject) -> String {
    let Viewing { theta_k, offset } = subject.viewing;
    let offset = match offset {
        Offset::At(h) => format!("offset h = {}", signed(h, 2)),
        Offset::Mean => "mean over the offset h".to_owned(),
    };
    format!("model {}, known inclination θ_{{k}} = {}°, {offset}", subject.fiber.name(), degrees(theta_k))
}

fn degrees(radians: f64) -> String {
    signed(radians.to_degrees(), 1)
}

/// A number without superfluous decimals and with a minus that is none of the hyphens.
fn signed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text.as_str() };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

/// How lobes are drawn: R, TT, TRT, residual.
const LOOKS: [(Colour, Dash); 4] = [
    (Colour::BLUE, Dash::Solid),
    (Colour::VERMILION, Dash::Dashed),
    (Colour::GREEN, Dash::DashDot),
    (Colour::PURPLE, Dash::Dotted),
];

/// The luminance of each lobe that is there, and of their sum if there are several, which is drawn first.
fn lobe_series(curve: &[Sampled], to_x: impl Fn(f64) -> f64) -> Vec<Series> {
    let line = |name: &str, value: &dyn Fn(&Lobes<f64>) -> f64| {
        Series::line(name, curve.iter().map(|sampled| [to_x(sampled.x), value(&sampled.lobes)]).collect())
    };
    let mut series = Vec::new();
    for (lobe, (colour, dash)) in LOOKS.into_iter().enumerate() {
        if curve.iter().any(|sampled| sampled.lobes[lobe].luminance() > 0.0) {
            let value = move |lobes: &Lobes<f64>| lobes[lobe].luminance();
            series.push(line(LOBE_NAMES[lobe], &value).styled(colour, dash));
        }
    }
    if series.len() != 1 {
        let sum = line("sum", &|lobes: &Lobes<f64>| lobes.sum().luminance()).styled(Colour::INK, Dash::Solid);
        series.insert(0, Series { width: 1.0, ..sum });
    }
    series
}

fn azimuth_part(subject: &Subject, slice: Slice) -> Part {
    let curve = measure::azimuth(&subject.fiber, &subject.viewing, slice, 240);
    let (title, label) = match slice {
        Slice::Integrated => ("Around the fiber", "∫ f cos θ_{s} dθ_{s} / rad^{−1}, radius as its root"),
        Slice::Cone => ("Around the fiber, on the specular cone", "f / sr^{−1}, radius as its root"),
    };
    let polar = Polar {
        label: label.to_owned(),
        ends: ["towards k".to_owned(), "away from k".to_owned()],
        series: lobe_series(&curve, |phi| phi),
        ..Polar::default()
    };
    (vec![Panel::new(title, polar)], "k is the known direction, at azimuth 0.".to_owned())
}

fn longitudinal_part(subject: &Subject) -> Part {
    let curve = measure::longitudinal(&subject.fiber, &subject.viewing, 360);
    let axes = Axes {
        x: Axis::degrees("sampled inclination θ_{s}", -90.0, 90.0),
        y: Axis::new("cos θ_{s} ∫ f dφ / rad^{−1}"),
        series: lobe_series(&curve, f64::to_degrees),
        guides: vec![Guide {
            at: -subject.viewing.theta_k.to_degrees(),
            upright: true,
            label: "specular cone".to_owned(),
        }],
    };
    (vec![Panel::new("Along the fiber", axes)], "The area under a curve along the fiber is its albedo.".to_owned())
}

/// Decades that the map of the sphere shows.
const DECADES: f64 = 4.0;

fn sphere_part(subject: &Subject) -> Part {
    let (columns, rows) = (360, 180);
    let heat = Heat {
        x: Axis::degrees("azimuth φ = φ_{s} − φ_{k}", -180.0, 180.0),
        y: Axis::degrees("sampled inclination θ_{s}", -90.0, 90.0),
        columns,
        values: measure::sphere(&subject.fiber, &subject.viewing, columns, rows),
        scale: HeatScale::Log(DECADES),
        label: "f / sr^{−1}".to_owned(),
        guides: [Vec::new(), vec![-subject.viewing.theta_k.to_degrees()]],
        ..Heat::default()
    };
    (vec![Panel::new("All directions", heat)], "The dashed line on the map is the specular cone.".to_owned())
}

fn histogram_part(subject: &Subject, options: &Options) -> Part {
    let histogram = Histogram::new(&subject.fiber, &subject.viewing, options.draws, options.seed);
    let draws = f64::from(options.draws.max(1));
    let [_, columns] = Histogram::COARSE;
    let ratio = |[count, expected]: [f64; 2]| if expected >= Histogram::SHOWN { count / expected } else { f64::NAN };
    let map = Heat {
        x: Axis::degrees("azimuth φ", -180.0, 180.0),
        y: Axis::new("sin θ_{s}").over(-1.0, 1.0),
        columns,
        values: histogram.coarse().into_iter().map(ratio).collect(),
        scale: HeatScale::Between(0.8, 1.2),
        map: ColourMap::Diverging,
        label: "drawn / expected".to_owned(),
        ..Heat::default()
    };
    let azimuths = marginal(
        Axis::degrees("azimuth φ", -180.0, 180.0),
        "density / deg^{−1}",
        &histogram.over_azimuths(),
        [-180.0, 180.0],
        draws,
    );
    let over_sines = histogram.over_sines();
    let (first, last) = busy(&over_sines);
    let sines = marginal(Axis::new("sin θ_{s}").over(first, last), "density", &over_sines, [-1.0, 1.0], draws);

    let test = histogram.chi_square();
    let lost = match histogram.lost {
        0 => String::new(),
        lost => format!("; {lost} draws gave no direction"),
    };
    let note = format!(
        "{} directions were drawn (seed {}): χ^{{2}} = {:.0} over {} bins, p = {}{lost}. \
         Grey bins expect fewer than {:.0}.",
        options.draws,
        options.seed,
        test.value,
        test.bins,
        if test.p < 1e-4 { "0.0001 or less".to_owned() } else { signed(test.p, 4) },
        Histogram::SHOWN,
    );
    let panels = vec![
        Panel::new("Sampler over its density", map),
        Panel::new("Sampler around the fiber", azimuths),
        Panel::new("Sampler along the fiber", sines),
    ];
    (panels, note)
}

/// What was drawn as bars, what was expected as a line, both per unit of the axis.
fn marginal(x: Axis, label: &str, bins: &[[f64; 2]], [first, last]: [f64; 2], draws: f64) -> Axes {
    let width = (last - first) / bins.len() as f64;
    let points = |which: usize| -> Vec<[f64; 2]> {
        let place = |i: usize| first + (i as f64 + 0.5) * width;
        bins.iter().enumerate().map(|(i, bin)| [place(i), bin[which] / (draws * width)]).collect()
    };
    let drawn = Series::bars("drawn", width, points(0)).styled(Colour::SKY, Dash::Solid);
    let density = Series::line("density", points(1)).styled(Colour::INK, Dash::Solid);
    Axes { x, y: Axis::new(label), series: vec![drawn, Series { width: 1.2, ..density }], guides: Vec::new() }
}

/// The sines between which there is something to see, with two bins of room.
fn busy(bins: &[[f64; 2]]) -> (f64, f64) {
    let most = bins.iter().map(|[_, expected]| *expected).fold(0.0, f64::max);
    let is_busy = |bin: &[f64; 2]| bin[0].max(bin[1]) > 2e-3 * most;
    let first = bins.iter().position(is_busy).unwrap_or(0);
    let last = bins.iter().rposition(is_busy).unwrap_or(bins.len().saturating_sub(1));
    let edge = |i: usize| 2.0 * i as f64 / bins.len().max(1) as f64 - 1.0;
    (edge(first.saturating_sub(2)), edge((last + 3).min(bins.len())))
}

fn albedo_part(subject: &Subject) -> Part {
    let thetas: Vec<f64> = (0..=17).map(|i| f64::from(5 * i).to_radians()).collect();
    let curve = measure::albedo(&subject.fiber, subject.viewing.offset, &thetas);
    let channel = |name: &str, channel: usize| {
        let value = |sampled: &Sampled| [sampled.x.to_degrees(), sampled.lobes.sum()[channel]];
        Series::line(name, curve.iter().map(value).collect())
    };
    let is_grey = curve.iter().all(|sampled| {
        let sum = sampled.lobes.sum();
        (sum - Rgb::splat(sum[0])).map(f64::abs).max_channel() < 1e-9
    });
    let channels = if is_grey {
        vec![channel("all channels", 0).styled(Colour::INK, Dash::Solid)]
    } else {
        vec![
            channel("red", 0).styled(Colour::VERMILION, Dash::Solid),
            channel("green", 1).styled(Colour::GREEN, Dash::Dashed),
            channel("blue", 2).styled(Colour::BLUE, Dash::DashDot),
        ]
    };
    let guide = Guide { at: 1.0, upright: false, label: "all that arrives".to_owned() };
    let most = curve.iter().map(|sampled| sampled.lobes.sum().max_channel()).fold(0.0, f64::max);
    let top = if most <= 1.02 { 1.1 } else { 1.1 * most };
    let axes = |series: Vec<Series>| Axes {
        x: Axis::degrees("known inclination θ_{k}", 0.0, 90.0),
        y: Axis::new("albedo").over(0.0, top),
        series,
        guides: vec![guide.clone()],
    };
    let panels = vec![
        Panel::new("Albedo per channel", axes(channels)),
        Panel::new("Albedo per lobe", axes(lobe_series(&curve, f64::to_degrees))),
    ];
    (panels, String::new())
}

/// The parameters of a fiber by their names in the library, angles in degrees too.
pub fn parameters(fiber: &Fiber<f64>) -> Vec<(String, String)> {
    let mut entries = vec![("model".to_owned(), fiber.name().to_owned())];
    // What a model derives for debugging lists its public fields, and does so for models still to come.
    let text = format!("{fiber:.4?}");
    let Some((start, end)) = text.find('{').zip(text.rfind('}')).filter(|(start, end)| start < end) else {
        return entries;
    };
    list(&text[start + 1..end], "", fiber.name(), &mut entries);
    entries
}

/// Adds the fields of a struct as it is printed; those of structs within it by `prefix`.
fn list(text: &str, prefix: &str, model: &str, entries: &mut Vec<(String, String)>) {
    for field in fields(text) {
        let Some((name, value)) = field.split_once(": ") else { continue };
        let name = format!("{prefix}{name}");
        let value = value.strip_prefix("Some(").and_then(|value| value.strip_suffix(')')).unwrap_or(value);
        if let Some(several) = value.strip_prefix('[').and_then(|value| value.strip_suffix(']'))
            && several.contains('{')
        {
            for (i, one) in fields(several).into_iter().enumerate() {
                nested(one, &format!("{name}[{i}]."), model, entries);
            }
            continue;
        }
        if value.contains('{') {
            nested(value, &format!("{name}."), model, entries);
            continue;
        }
        let value = tidy(&value.replace("Rgb([", "[").replace("])", "]"));
        // The precision of the numbers cuts this word, too.
        let value = if value == "fals" { "false".to_owned() } else { value };
        let value = match value.parse::<f64>() {
            Ok(angle) if is_angle(model, &name) => {
                format!("{} rad = {}°", value.replace('-', "−"), signed(angle.to_degrees(), 2))
            }
            _ => value.replace('-', "−"),
        };
        entries.push((name, value));
    }
}

fn nested(value: &str, prefix: &str, model: &str, entries: &mut Vec<(String, String)>) {
    if let Some((start, end)) = value.find('{').zip(value.rfind('}')).filter(|(start, end)| start < end) {
        list(&value[start + 1..end], prefix, model, entries);
    }
}

/// Whether a parameter is an angle in this model; Chiang's widths are roughnesses.
fn is_angle(model: &str, name: &str) -> bool {
    match name.rsplit('.').next().unwrap_or(name) {
        "alpha" | "beta" | "shift" | "width" | "angle" | "tt_azimuthal_width" => true,
        "beta_m" | "beta_n" => model != "chiang",
        _ => false,
    }
}

/// The fields of a struct as it is printed, parted at the commas that lie in no bracket.
fn fields(text: &str) -> Vec<&str> {
    let (mut parts, mut depth, mut start) = (Vec::new(), 0_i32, 0);
    for (at, letter) in text.char_indices() {
        match letter {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(text[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(text[start..].trim());
    parts.retain(|part| !part.is_empty());
    parts
}

/// Decimals without the zeros at their ends.
fn tidy(text: &str) -> String {
    let mut out = String::new();
    let mut number = String::new();
    for letter in text.chars().chain(std::iter::once('\0')) {
        if letter.is_ascii_digit() || (letter == '.' && !number.is_empty()) {
            number.push(letter);
            continue;
        }
        let digits = std::mem::take(&mut number);
        out.push_str(if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { &digits });
        if letter != '\0' {
            out.push(letter);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use fiber::{Chiang, Deon};

    use super::*;

    #[test]
    fn parameters_are_read_from_what_the_model_prints() {
        let deon = Deon { alpha: -3_f64.to_radians(), ..Deon::with_absorption(Rgb::new(0.1, 0.25, 0.8)) };
        let entries = parameters(&Fiber::Deon(deon));
        let value = |name: &str| entries.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str());
        assert_eq!(value("model"), Some("deon"));
        assert_eq!(value("eta"), Some("1.55"));
        assert_eq!(value("sigma_a"), Some("[0.1, 0.25, 0.8]"));
        assert_eq!(value("alpha"), Some("−0.0524 rad = −3°"));
        assert_eq!(value("residual"), Some("true"));

        let chiang = parameters(&Fiber::Chiang(Chiang::with_absorption(Rgb::splat(0.0))));
        assert!(chiang.contains(&("beta_m".to_owned(), "0.3".to_owned())), "{chiang:?}");
    }

    #[test]
    fn nested_fields_stay_together() {
        let parts = fields("a: 1, b: [2, 3], c: Some(X { d: 4, e: 5 })");
        assert_eq!(parts, ["a: 1", "b: [2, 3]", "c: Some(X { d: 4, e: 5 })"]);
        assert!(fields(" ").is_empty());
        assert_eq!(tidy("[0.2500, 3.0000, 10] x0."), "[0.25, 3, 10] x0");
    }

    #[test]
    fn the_busy_part_is_found_with_room() {
        let mut bins = [[0.0; 2]; 20];
        bins[10] = [5.0, 5.0];
        let (first, last) = busy(&bins);
        assert!((first - -0.2).abs() < 1e-12 && (last - 0.3).abs() < 1e-12, "{first} {last}");
        assert_eq!(busy(&[[0.0; 2]; 4]), (-1.0, 1.0));
    }

    #[test]
    fn numbers_have_no_superfluous_decimals() {
        for (x, text) in [(30.0, "30"), (-0.04, "0"), (-12.5, "−12.5")] {
            assert_eq!(signed(x, 1), text);
        }
    }
}
