//! Kajiya-Kay: what the exponent does, and what becomes of energy.

use fiber::{Dir, Fiber, Hit, KajiyaKay, KajiyaKayMode, Model, R, RESIDUAL, Scatter};
use math::Rgb;
use plot::lobes::measure::{Offset, albedo};

use super::head::{self, Lighting};
use super::ratio;
use crate::chart::{Chart, Curve};
use crate::raster::Raster;
use crate::{Context, Error, Measured, Report, Table, number};

const EXPONENTS: [f64; 3] = [10.0, 25.0, 50.0];
/// Diffuse colour of the thesis; its specular intensity is 1.
const DIFFUSE: [f64; 3] = [0.72, 0.59, 0.47];

fn fiber(exponent: f64, specular: f64, mode: KajiyaKayMode) -> KajiyaKay<f64> {
    KajiyaKay::single(Rgb(DIFFUSE), Rgb::splat(specular), exponent, mode)
}

fn look(exponent: f64) -> String {
    format!(
        "model = \"kajiya_kay\"\nmode = \"thesis\"\ndiffuse = {DIFFUSE:?}\nspecular = 1.0\nexponent = {exponent:?}\n"
    )
}

/// The highlight along the fiber, seen at right angles: value at an inclination in degrees.
fn highlight(exponent: f64, deg: f64) -> f64 {
    let point = fiber(exponent, 1.0, KajiyaKayMode::Thesis).prepare(&Hit::new(Dir::new(0.0, 0.0), 0.0));
    point.eval(Dir::new(deg.to_radians(), 0.0))[R].luminance()
}

/// Full width of the highlight at half its height, degrees, by bisection.
fn width_deg(exponent: f64) -> f64 {
    let half = 0.5 * highlight(exponent, 0.0);
    let (mut inside, mut outside) = (0.0, 90.0);
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if highlight(exponent, middle) > half {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside + outside
}

/// What a white dome gets back, luminance of the diffuse part and of the highlight.
fn returned(fiber: &KajiyaKay<f64>, theta_deg: f64) -> [f64; 2] {
    let found = albedo(&Fiber::KajiyaKay(*fiber), Offset::Mean, &[theta_deg.to_radians()]);
    found.first().map_or([f64::NAN; 2], |at| [at.lobes[RESIDUAL].luminance(), at.lobes[R].luminance()])
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let mut films = Vec::new();
    for m in EXPONENTS {
        films.push(head::film(context, &format!("m = {m}"), Lighting::Front, &look(m))?);
    }
    let hair = head::hair(&films[0])?;
    let specular: Vec<film::Image> = films.iter().map(|film| head::lobe_image(film, R)).collect();
    let light: Vec<f64> = specular.iter().map(|image| head::mean(image, &hair).luminance()).collect();
    let diffuse = head::mean(&head::lobe_image(&films[0], RESIDUAL), &hair);
    let widths = EXPONENTS.map(width_deg);
    let tops = EXPONENTS.map(|m| highlight(m, 0.0));
    let closed = EXPONENTS.map(|m| 2.0 * 0.5_f64.powf(1.0 / m).acos().to_degrees());
    let off = (0..3).map(|i| (widths[i] / closed[i] - 1.0).abs()).fold(0.0, f64::max);
    let whole = returned(&fiber(25.0, 1.0, KajiyaKayMode::Thesis), 0.0);
    let normalised = returned(&fiber(25.0, 0.28, KajiyaKayMode::Normalised), 0.0);

    let measured = vec![
        Measured::new("width of the highlight, m = 10 over m = 25", widths[0] / widths[1], "")
            .between(1.1, f64::INFINITY)
            .decides(),
        Measured::new("width of the highlight, m = 25 over m = 50", widths[1] / widths[2], "")
            .between(1.1, f64::INFINITY)
            .decides(),
        Measured::new("pictures: mean light of the highlight, m = 10 over m = 25", ratio(light[0], light[1]), "")
            .between(1.1, 2.5)
            .decides(),
        Measured::new("pictures: mean light of the highlight, m = 25 over m = 50", ratio(light[1], light[2]), "")
            .between(1.1, 2.5)
            .decides(),
        Measured::new("what a white dome gets back at 0°, m = 25 (not conserving: above 1)", whole[0] + whole[1], "")
            .between(1.000_001, f64::INFINITY)
            .decides(),
        Measured::new("the same, of the highlight alone", whole[1], ""),
        Measured::new("normalised, specular 0.28: what a white dome gets back", normalised[0] + normalised[1], "")
            .between(0.0, 1.0),
        Measured::new("widths against 2 acos(2^(-1/m)), largest difference", 100.0 * off, "%").between(0.0, 1e-6),
    ];
    let figure = format!(
        "highlights are {}°, {}° and {}° wide for m = 10, 25, 50, all of height {}; a white dome gets {} times its \
         light back",
        number(widths[0]),
        number(widths[1]),
        number(widths[2]),
        number(tops[0]),
        number(whole[0] + whole[1])
    );
    let mut report = Report::new(
        "A smaller specular exponent broadens the highlight, with intensities left as they are; the model does not \
         conserve energy.",
        figure,
        measured,
    );
    report.text = vec![
        format!(
            "The numbers are those of the thesis: exponents 10, 25 and 50, specular intensity 1, diffuse colour \
             {DIFFUSE:?}, in the mode `thesis`. The curls are grown by our groomer, 12,000 strands of 2.2 times their \
             natural width; the thesis uses a scanned model of 50,000. One point light, light scatters once, shadows \
             are traced where the thesis has deep opacity maps and transparent strands."
        ),
        "Widths are read off the value by bisection, and light off the pictures: the film keeps diffuse part and \
         highlight apart. The height does not change with the exponent, so a broader highlight is more light, where a \
         fiber that conserves energy would make it dimmer."
            .into(),
        format!(
            "Seen straight on, a white dome of radiance 1 gets {} back from the diffuse part and {} from the highlight. \
             Our default, `normalised`, divides both by what they integrate to, and keeps the sum below 1 where the \
             colours add up to at most 1.",
            number(whole[0]),
            number(whole[1])
        ),
    ];
    let mut table = Table::new(
        "The highlight by exponent. Light: mean over the hair of the pictures, unexposed.",
        ["m", "width at half height", "height", "light of the highlight", "white dome: highlight", "at 60°"],
    );
    for (i, m) in EXPONENTS.into_iter().enumerate() {
        let thesis = fiber(m, 1.0, KajiyaKayMode::Thesis);
        table.row([
            format!("{m}"),
            format!("{}°", number(widths[i])),
            number(tops[i]),
            number(light[i]),
            number(returned(&thesis, 0.0)[1]),
            number(returned(&thesis, 60.0)[1]),
        ]);
    }
    report.tables.push(table);

    let exposure = head::exposure(&films[1].image());
    let alone = head::exposure(&specular[1]);
    let mut pictures: Vec<Raster> = films.iter().map(|film| head::shown(&film.image(), exposure)).collect();
    pictures.extend(specular.iter().map(|image| head::shown(image, alone)));
    report.pictures.push(Raster::sheet(&pictures, 3, 4).picture(
        "curls",
        format!(
            "From left to right m = 10, 25, 50. Above all light, below the highlight alone, brighter by {} stops. The \
             diffuse part is the same in all: {} of mean light.",
            number(f64::from(alone - exposure)),
            super::rgb(diffuse)
        ),
    )?);
    let curve = |m: f64| {
        let points = (-180..=180).map(|i| 0.5 * f64::from(i)).map(|deg| [deg, highlight(m, deg)]).collect();
        Curve::line(format!("m = {m}"), points)
    };
    report.pictures.push(
        Chart {
            title: "Highlight of Kajiya and Kay".into(),
            x: "inclination of the light, degrees".into(),
            y: "value".into(),
            x_range: Some((-90.0, 90.0)),
            y_range: Some((0.0, 1.1)),
            curves: EXPONENTS.into_iter().map(curve).collect(),
            ..Chart::default()
        }
        .picture("value", "The highlight seen at right angles to the fiber.")?,
    );
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dome_gets_back_what_the_closed_forms_say() {
        let [diffuse, highlight] = returned(&fiber(1.0, 1.0, KajiyaKayMode::Thesis), 0.0);
        // 2π ∫ cos² = π² for the diffuse part; for m = 1 the highlight is the same integral.
        let want = std::f64::consts::PI.powi(2);
        assert!((diffuse / (want * Rgb(DIFFUSE).luminance()) - 1.0).abs() < 1e-6, "{diffuse}");
        assert!((highlight / want - 1.0).abs() < 1e-6, "{highlight}");
    }
}
