//! Plots and pictures of pages.

use film::{Image, View};
use math::Rgb;
use plot::chart::{Axes, Axis, Figure, Marker, Panel, Picture, Series, Ticks};

use crate::Error;

/// Sheets of pictures are not wider than this, where whole-numbered reduction can see to it.
const WIDEST: u32 = 1400;

/// No figure is higher than this, pixels.
const HIGHEST: u32 = 16_384;

/// Room of a row of pictures besides the pictures: its names, and what lies between rows. More than it takes.
const ROW: u32 = 64;

/// Pictures are shown no narrower than this, so that their names have room.
const NARROWEST: u32 = 120;

/// Room of a figure around and between its panels, pixels.
const MARGIN: u32 = 28;
const GUTTER: u32 = 36;

/// Points under a name.
pub(crate) type Curve = (String, Vec<[f64; 2]>);

/// Measured points joined by lines, a panel for each title, side by side.
pub(crate) fn lines(title: &str, x: &str, y: &str, panels: &[(String, Vec<Curve>)]) -> Result<Vec<u8>, Error> {
    let columns = panels.len().clamp(1, 3);
    let panels = panels.iter().map(|(title, curves)| {
        // A curve of nothing but what was not measured would be a name without a line.
        let known = curves.iter().enumerate().filter(|(_, (_, points))| points.iter().any(|p| p[1].is_finite()));
        let series = known.map(|(i, (name, points))| {
            Series::line(name, points.clone()).marked(Marker::SERIES[i % Marker::SERIES.len()])
        });
        let from_zero = |values: &mut dyn Iterator<Item = f64>| {
            let most = values.filter(|v| v.is_finite()).fold(0.0, f64::max);
            (most > 0.0).then_some((0.0, 1.05 * most))
        };
        let all = || curves.iter().flat_map(|(_, points)| points);
        let y = Axis { range: from_zero(&mut all().map(|p| p[1])), ..Axis::new(y) };
        Panel::new(title, Axes { x: Axis::new(x), y, series: series.collect(), ..Axes::default() })
    });
    let panels: Vec<Panel> = panels.collect();
    let width = (180.0 + 360.0 * columns as f64).max(720.0);
    drawn(&Figure { title: title.into(), columns, width, panels, ..Figure::default() })
}

/// Groups of bars: for each word below, one bar of each series.
pub(crate) fn bars(title: &str, y: &str, words: &[&str], series: &[(String, Vec<f64>)]) -> Result<Vec<u8>, Error> {
    let width = 0.8 / series.len().max(1) as f64;
    let all = series.iter().enumerate().map(|(i, (name, values))| {
        let offset = (i as f64 + 0.5) * width - 0.4;
        let points = values.iter().enumerate().map(|(at, value)| [at as f64 + offset, *value]).collect();
        Series::bars(name, 0.9 * width, points)
    });
    let ticks = Ticks::At(words.iter().enumerate().map(|(at, word)| (at as f64, (*word).to_owned())).collect());
    let x = Axis { range: Some((-0.6, words.len() as f64 - 0.4)), ticks, ..Axis::new("") };
    let axes = Axes { x, y: Axis::new(y), series: all.collect(), ..Axes::default() };
    let width = (90.0 * words.len() as f64).clamp(720.0, 1200.0);
    drawn(&Figure { title: title.into(), width, panels: vec![Panel::new("", axes)], ..Figure::default() })
}

fn drawn(figure: &Figure) -> Result<Vec<u8>, Error> {
    Ok(figure.png(figure.width as u32)?)
}

/// Pictures under their names, row by row, all developed alike; reduced by a whole number where they would be too
/// wide or too high together.
pub(crate) fn sheet(shots: &[(String, Image)], columns: usize, exposure_ev: f32, view: View) -> Result<Vec<u8>, Error> {
    let developed = shots.iter().map(|(name, image)| (name.clone(), image, exposure_ev, view)).collect::<Vec<_>>();
    developed_sheet(&developed, columns)
}

/// The same with an exposure and a view for each.
pub(crate) fn developed_sheet(shots: &[(String, &Image, f32, View)], columns: usize) -> Result<Vec<u8>, Error> {
    let columns = columns.clamp(1, shots.len().max(1));
    let widest = shots.iter().map(|shot| shot.1.width).max().unwrap_or(1);
    let highest = shots.iter().map(|shot| shot.1.height).max().unwrap_or(1);
    let rows = shots.len().div_ceil(columns).max(1);
    // Rows share the height that a figure may have.
    let room =
        (HIGHEST.saturating_sub(2 * MARGIN) / u32::try_from(rows).unwrap_or(u32::MAX)).saturating_sub(ROW).max(1);
    let factor = reduction(widest, columns as u32).max(highest.div_ceil(room));
    // A panel is as wide as its picture, so that pixels of one are pixels of the other. A narrow picture is enlarged;
    // one that would be too high then gets paper at its side.
    let (wide, high) = (widest.div_ceil(factor), highest.div_ceil(factor));
    let cell = wide.max(NARROWEST);
    let least = u32::try_from((u64::from(cell) * u64::from(high)).div_ceil(u64::from(room))).unwrap_or(u32::MAX);
    let mut panels = Vec::with_capacity(shots.len());
    for (name, image, exposure_ev, view) in shots {
        let image = reduced(image, factor);
        let paper = least.saturating_sub(image.width);
        let mut rgb = Vec::new();
        for row in image.pixels.chunks(image.width.max(1) as usize) {
            // Rounded to the nearest of 256 levels.
            let shown = row.iter().flat_map(|light| view.to_display(*light, *exposure_ev));
            rgb.extend(shown.map(|shown| (shown * 255.0 + 0.5) as u8));
            rgb.extend(std::iter::repeat_n(255_u8, 3 * paper as usize));
        }
        let picture =
            Picture::new(image.width + paper, image.height, rgb).map_err(|error| Error::Picture(error.to_string()))?;
        panels.push(Panel::new(name, picture));
    }
    let width = f64::from(2 * MARGIN + columns as u32 * (cell + GUTTER) - GUTTER);
    drawn(&Figure { columns, width, panels, ..Figure::default() })
}

/// By how much pictures are reduced so that `columns` of them fit beside each other.
fn reduction(width: u32, columns: u32) -> u32 {
    let room = (WIDEST.saturating_sub(2 * MARGIN + (columns - 1) * GUTTER) / columns).max(NARROWEST);
    width.div_ceil(room).max(1)
}

/// Every pixel is the mean light of `factor` by `factor`; those at the right and lower edge may cover fewer.
fn reduced(image: &Image, factor: u32) -> Image {
    if factor <= 1 {
        return image.clone();
    }
    let (width, height) = (image.width.div_ceil(factor), image.height.div_ceil(factor));
    let mut pixels = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let columns = x * factor..((x + 1) * factor).min(image.width);
            let rows = y * factor..((y + 1) * factor).min(image.height);
            let count = (columns.len() * rows.len()) as f32;
            let sum: Rgb = rows.flat_map(|row| columns.clone().map(move |column| image.at(column, row))).sum();
            pixels.push(sum / count);
        }
    }
    Image { width, height, pixels, alpha: None }
}

/// The exposure, in stops, at which nearly all of an image is below white.
pub(crate) fn exposure(image: &Image) -> f32 {
    let mut lit: Vec<f32> =
        image.pixels.iter().map(|c| c.max_channel()).filter(|x| *x > 0.0 && x.is_finite()).collect();
    if lit.is_empty() {
        return 0.0;
    }
    lit.sort_by(f32::total_cmp);
    let bright = lit[((lit.len() - 1) as f64 * 0.985) as usize];
    (0.9 / bright).log2().clamp(-20.0, 20.0)
}

/// Mean difference of the luminance of horizontal neighbours as they are shown, over those that are covered: what
/// aliasing adds to. 0 where nothing is covered.
pub(crate) fn roughness(image: &Image, exposure_ev: f32) -> f64 {
    let covered = |i: usize| image.alpha.as_ref().is_none_or(|alpha| alpha[i] > 0.0);
    let shown = |i: usize| {
        let [r, g, b] = View::Srgb.to_display(image.pixels[i], exposure_ev);
        f64::from(Rgb([r, g, b]).luminance())
    };
    let (mut sum, mut count) = (0.0, 0_u64);
    let width = image.width as usize;
    for i in (0..image.pixels.len()).filter(|i| i % width + 1 < width) {
        if covered(i) && covered(i + 1) {
            sum += (shown(i) - shown(i + 1)).abs();
            count += 1;
        }
    }
    sum / count.max(1) as f64
}

/// How a scene is developed.
pub(crate) fn view_of(scene: &scene::Scene) -> View {
    match scene.film.view {
        scene::View::Srgb => View::Srgb,
        scene::View::Filmic => View::Filmic,
        scene::View::Agx => View::Agx,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, light: impl Fn(u32, u32) -> f32) -> Image {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Image::new(width, height, pixels.map(|(x, y)| Rgb::splat(light(x, y))).collect(), None).unwrap()
    }

    #[test]
    fn reduction_keeps_the_mean_light() {
        let stripes = image(8, 6, |x, _| (x % 2) as f32);
        let small = reduced(&stripes, 2);
        assert_eq!((small.width, small.height), (4, 3));
        assert!(small.pixels.iter().all(|c| *c == Rgb::splat(0.5)));
        // Three columns of three do not fill eight: the last one is the mean of two.
        let small = reduced(&image(8, 3, |x, _| x as f32), 3);
        assert_eq!(small.pixels, [1.0, 4.0, 6.5].map(Rgb::splat));
        assert_eq!((reduction(656, 1), reduction(656, 3), reduction(16, 9)), (1, 2, 1));
    }

    #[test]
    fn pictures_are_seen_pixel_by_pixel() {
        let red = Image::new(130, 90, vec![Rgb::new(1.0, 0.0, 0.0); 130 * 90], None).unwrap();
        let png = sheet(&[("red".into(), red.clone()), ("again".into(), red)], 2, 0.0, View::Srgb).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.png");
        std::fs::write(&path, png).unwrap();
        let back = film::image::read(&path).unwrap();
        assert_eq!(back.width, 2 * MARGIN + 2 * 130 + GUTTER);
        // The outermost pixels may be mixed with paper where the size of a frame was rounded.
        let reds = back.pixels.iter().filter(|c| c[0] > 0.99 && c[1] < 0.01 && c[2] < 0.01).count();
        assert!((2 * 128 * 88..=2 * 130 * 90).contains(&reds), "{reds}");
    }

    #[test]
    fn sheets_of_many_rows_and_of_high_pictures_fit() {
        let grey = |width: u32, height: u32| {
            let pixels = vec![Rgb::splat(0.5); (width * height) as usize];
            ("grey".to_owned(), Image::new(width, height, pixels, None).unwrap())
        };
        // A hundred rows; one picture that is as high as pictures can be; one that is as thin as well.
        for shots in [vec![grey(40, 300); 100], vec![grey(8, 16_384)], vec![grey(1, 16_384); 2]] {
            let png = sheet(&shots, 1, 0.0, View::Srgb).unwrap();
            assert_eq!(png[1..4], *b"PNG");
        }
    }

    #[test]
    fn exposure_brings_bright_light_below_white() {
        let level = image(10, 10, |_, _| 3.6);
        assert!((exposure(&level) + 2.0).abs() < 1e-5);
        assert_eq!(exposure(&image(2, 2, |_, _| 0.0)), 0.0);
    }

    #[test]
    fn aliasing_is_rougher_than_its_mean() {
        let stripes = image(8, 6, |x, _| (x % 2) as f32);
        let level = image(8, 6, |_, _| 0.5);
        assert!((roughness(&stripes, 0.0) - 1.0).abs() < 1e-4);
        assert_eq!(roughness(&level, 0.0), 0.0);
        assert_eq!(roughness(&image(1, 4, |_, _| 1.0), 0.0), 0.0, "no neighbours");
    }

    #[test]
    fn plots_are_pictures() {
        let curve = ("straight".to_owned(), vec![[10.0, 1.0], [50.0, f64::NAN], [60.0, 3.0]]);
        let png =
            lines("t", "x", "y", &[("forward".into(), vec![curve.clone()]), ("deferred".into(), vec![curve])]).unwrap();
        assert_eq!(png[1..4], *b"PNG");
        let png = bars("t", "ms", &["dbk", "k-plus"], &[("none".into(), vec![1.0, f64::NAN])]).unwrap();
        assert_eq!(png[1..4], *b"PNG");
    }
}
