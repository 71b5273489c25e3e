//! Figures as files: what is drawn lies where the values say, in SVG and in pixels.

use fiber::{Chiang, Fiber, Lambertian};
use math::Rgb;
use plot::chart::image::strip;
use plot::chart::{
    Axes, Axis, Colour, Dash, Figure, Heat, HeatScale, Listing, Panel, Picture, PngError, Polar, Radial, Series,
};
use plot::lobes::{self, Kind, Offset, Options, Slice, Subject, Viewing};

fn pixel(picture: &Picture, column: u32, row: u32) -> [u8; 3] {
    let i = 3 * (row * picture.width() + column) as usize;
    [picture.rgb()[i], picture.rgb()[i + 1], picture.rgb()[i + 2]]
}

/// Columns and rows of the pixels that a test accepts.
fn places(picture: &Picture, wanted: impl Fn([u8; 3]) -> bool) -> Vec<(u32, u32)> {
    let (width, height) = (picture.width(), picture.height());
    (0..height)
        .flat_map(|row| (0..width).map(move |column| (column, row)))
        .filter(|&(column, row)| wanted(pixel(picture, column, row)))
        .collect()
}

/// Mean row of the pixels of a colour.
fn mean_row(picture: &Picture, colour: Colour) -> f64 {
    let found = places(picture, |rgb| rgb == colour.0);
    assert!(found.len() > 100, "{} pixels of {colour}", found.len());
    found.iter().map(|&(_, row)| f64::from(row)).sum::<f64>() / found.len() as f64
}

fn every_plot() -> Figure {
    let curve = |k: f64| -> Vec<[f64; 2]> {
        (0..=90).map(|i| [f64::from(i) / 10.0, (f64::from(i) / 10.0 + k).sin().powi(2) + 0.01]).collect()
    };
    let series = || vec![Series::line("first", curve(0.0)), Series::line("second", curve(1.0))];
    let points = Series::scatter("measured", vec![[1.0, 0.3], [2.0, 0.5]]).with_errors(vec![0.1, 0.2]);
    let bars = Series::bars("counted", 0.8, vec![[1.0, 2.0], [2.0, 5.0]]);
    let heat = Heat { columns: 4, values: (0..12).map(f64::from).collect(), ..Heat::default() };
    let picture = Picture::new(2, 1, vec![255, 0, 0, 0, 0, 255]).unwrap();
    Figure {
        title: "Everything <at> once & \"quoted\"".into(),
        subtitle: "a line of θ, φ, σ, ∫ and χ^{2}".into(),
        caption: "A caption that is long enough to be broken into several lines. ".repeat(6),
        columns: 2,
        width: 900.0,
        letters: true,
        panels: vec![
            Panel::new("lines", Axes { series: series(), x: Axis::new("x / mm"), ..Axes::default() }),
            Panel::new("logarithmic", Axes { series: series(), y: Axis::log("y"), ..Axes::default() }),
            Panel::new("points and bars", Axes { series: vec![bars, points], ..Axes::default() }),
            Panel::new("polar", Polar { series: series(), radial: Radial::Log(2.0), ..Polar::default() }),
            Panel::new("heat", Heat { x: Axis::new("x").over(0.0, 4.0), y: Axis::new("y").over(0.0, 3.0), ..heat }),
            Panel::new("picture", picture),
            Panel::new("listing", Listing { entries: vec![("name".into(), "value ".repeat(40))] }).spanning(2),
        ],
    }
}

#[test]
fn every_kind_of_plot_is_drawn_and_twice_the_same() {
    let figure = every_plot();
    let svg = figure.svg();
    assert_eq!(svg, every_plot().svg());
    assert!(!svg.contains("NaN") && !svg.contains("inf\"") && svg.contains("(g) listing"));
    let file = figure.png(450).unwrap();
    assert_eq!(file, every_plot().png(450).unwrap());
    let picture = image::load_from_memory(&file).unwrap().into_rgb8();
    let [width, height] = figure.size();
    assert_eq!(picture.width(), 450);
    assert_eq!(f64::from(picture.height()), (height * 450.0 / width).ceil());
    assert_eq!(picture.get_pixel(0, 0).0, [255; 3]);
}

#[test]
fn values_that_are_none_leave_the_file_readable() {
    let odd = vec![[0.0, f64::NAN], [f64::INFINITY, 1.0], [1.0, f64::NEG_INFINITY], [2.0, 1e300], [3.0, -1e300]];
    for y in [Axis::new("y"), Axis::log("y"), Axis::new("y").over(f64::NAN, 2.0)] {
        let axes = Axes { y, series: vec![Series::line("odd", odd.clone())], ..Axes::default() };
        let polar = Polar { series: vec![Series::line("odd", odd.clone())], ..Polar::default() };
        let heat = Heat { columns: 1, values: odd.iter().map(|[_, value]| *value).collect(), ..Heat::default() };
        let panels = vec![Panel::new("", axes), Panel::new("", polar), Panel::new("", heat)];
        let figure = Figure { panels, ..Figure::default() };
        assert!(!figure.svg().contains("NaN"));
        figure.png(200).unwrap();
    }
}

#[test]
fn text_is_drawn_without_any_font_of_the_machine() {
    let drawn = |text: &str| {
        let figure = Figure { title: text.into(), width: 200.0, ..Figure::default() };
        figure.picture(400).unwrap()
    };
    let ink = |picture: &Picture| places(picture, |rgb| rgb[1] < 128).len();
    let signs = ["a", "θ", "φ", "σ", "χ", "∫", "−", "°", "×"];
    let pictures: Vec<Picture> = signs.iter().map(|sign| drawn(sign)).collect();
    for (i, sign) in signs.iter().enumerate() {
        assert!(ink(&pictures[i]) > 3, "{sign} leaves {} dark pixels", ink(&pictures[i]));
        for (other, picture) in signs.iter().zip(&pictures).take(i) {
            // A missing letter would look like any other missing letter.
            assert_ne!(pictures[i], *picture, "{sign} and {other}");
        }
    }
    // A sign from another font would take its whole line along, so labels use the signs of the first one only:
    // a letter before it stays as it is. Figures begin 28 pixels from the left; a capital H is 12 wide.
    let letter = |text: &str| {
        let mut ink = places(&drawn(text), |rgb| rgb[1] < 200);
        ink.retain(|(column, _)| *column < 2 * 40);
        ink
    };
    for sign in signs {
        assert_eq!(letter(&format!("H {sign}")), letter("H"), "{sign} is not in the font");
    }
}

#[test]
fn lines_lie_where_their_values_are() {
    let level = |y: f64, colour: Colour| Series::line("", vec![[0.0, y], [1.0, y]]).styled(colour, Dash::Solid);
    let colours = [Colour::BLUE, Colour::VERMILION, Colour::GREEN];
    for (axis, values, share) in [
        (Axis::new("").over(0.0, 1.0), [0.1, 0.3, 0.9], 0.25),
        (Axis::log("").over(1e-3, 1e3), [1e-2, 1e-1, 1e2], 0.25),
        (Axis::new("").over(4.0, 0.0), [1.0, 2.0, 3.0], 0.5),
    ] {
        let series = values.into_iter().zip(colours).map(|(y, colour)| Series { width: 4.0, ..level(y, colour) });
        let axes = Axes { y: axis, series: series.collect(), ..Axes::default() };
        let picture = Figure { panels: vec![Panel::new("", axes)], ..Figure::default() }.picture(1440).unwrap();
        let [first, second, third] = colours.map(|colour| mean_row(&picture, colour));
        // A pixel of rounding in 800.
        assert!(((second - first) / (third - first) - share).abs() < 2e-3, "{first} {second} {third}");
    }
}

#[test]
fn pictures_keep_their_colours() {
    let picture = Picture::new(2, 2, vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 90, 90, 90]).unwrap();
    let quarters = (0..40 * 40_usize).flat_map(|i| {
        let (quarter, rgb) = ((i / 40 / 20) * 2 + (i % 40) / 20, picture.rgb());
        [rgb[3 * quarter], rgb[3 * quarter + 1], rgb[3 * quarter + 2]]
    });
    let big = Picture::new(40, 40, quarters.collect()).unwrap();
    let drawn = strip("four colours", vec![("one".into(), big)], 1).picture(600).unwrap();
    for colour in picture.rgb().chunks(3) {
        let found = places(&drawn, |rgb| rgb.iter().zip(colour).all(|(a, b)| a.abs_diff(*b) <= 1));
        // A quarter of 488 x 488 pixels each, less where the quarters meet.
        assert!((48_000..61_000).contains(&found.len()), "{} pixels of {colour:?}", found.len());
    }
}

#[test]
fn the_largest_cell_of_a_heat_map_is_where_it_belongs() {
    let mut values = vec![1e-6; 50];
    values[3 * 10 + 8] = 1.0;
    let heat = Heat { columns: 10, values, scale: HeatScale::Log(3.0), ..Heat::default() };
    let figure = Figure { panels: vec![Panel::new("", heat)], ..Figure::default() };
    let picture = figure.picture(720).unwrap();
    let dark = places(&picture, |rgb| rgb == [0x44, 0x01, 0x54]);
    let yellow = places(&picture, |rgb| rgb == [0xfd, 0xe7, 0x25]);
    // The colour bar has both colours too, further to the right than any cell.
    let edge = dark.iter().filter(|(x, _)| *x < 640).map(|(x, _)| *x).max().unwrap();
    let cells: Vec<(u32, u32)> = yellow.into_iter().filter(|(x, _)| *x <= edge).collect();
    let left = dark.iter().map(|(x, _)| *x).min().unwrap();
    let rows = dark.iter().filter(|(x, _)| *x <= edge).map(|(_, y)| *y);
    let (top, bottom) = (rows.clone().min().unwrap(), rows.max().unwrap());
    let mean = |values: Vec<u32>| f64::from(values.iter().sum::<u32>()) / values.len() as f64;
    let x = (mean(cells.iter().map(|(x, _)| *x).collect()) - f64::from(left)) / f64::from(edge - left);
    let y = (f64::from(bottom) - mean(cells.iter().map(|(_, y)| *y).collect())) / f64::from(bottom - top);
    // The middle of column 8 of 10, and of row 3 of 5 from below.
    assert!((x - 0.85).abs() < 0.01 && (y - 0.7).abs() < 0.01, "{x} {y}");
}

#[test]
fn sizes_out_of_range_are_refused() {
    let figure = Figure { title: "x".into(), ..Figure::default() };
    assert!(matches!(figure.png(0), Err(PngError::Size { width: 0, .. })));
    let error = figure.png(20_000).unwrap_err().to_string();
    assert!(error.contains("20000") && error.contains("16384"), "{error}");
}

#[test]
fn a_fiber_is_shown_from_every_side() {
    let fiber = Fiber::Lambertian(Lambertian { albedo: Rgb::new(0.8, 0.5, 0.2) });
    let viewing = Viewing { theta_k: 0.5, offset: Offset::At(0.2) };
    let subject = Subject { name: "clay".into(), fiber, viewing };
    let options = Options { slice: Slice::Cone, draws: 20_000, seed: 1 };
    for (kind, count) in Kind::ALL.into_iter().zip([1, 1, 1, 3, 2]) {
        assert_eq!(lobes::panels(&subject, kind, &options).len(), count, "{kind:?}");
        let figure = lobes::figure(&subject, &[kind], &options);
        let svg = figure.svg();
        assert!(svg.contains("clay") && svg.contains("28.6°") && svg.contains("offset h = 0.2"), "{kind:?}");
        assert!(!svg.contains("NaN"), "{kind:?}");
        figure.png(300).unwrap();
    }
}

#[test]
fn a_sheet_is_a_page_with_the_parameters() {
    let fiber = Fiber::Chiang(Chiang::with_absorption(Rgb::new(0.1, 0.3, 0.8)));
    let subject = Subject { name: "brown".into(), fiber, viewing: Viewing::default() };
    let options = Options { draws: 50_000, ..Options::default() };
    let sheet = lobes::sheet(&subject, &options);
    let svg = sheet.svg();
    for text in ["sigma_a", "[0.1, 0.3, 0.8]", "Albedo per lobe", "Sampler over its density", "specular cone", "TRT"] {
        assert!(svg.contains(text), "{text}");
    }
    let [width, height] = sheet.size();
    assert!((height / width - std::f64::consts::SQRT_2).abs() < 0.06, "{width} x {height}");
    sheet.png(1000).unwrap();
}
