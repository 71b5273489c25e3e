//! Marschner: the highlights R and TRT, narrow and wide.

use fiber::{Dir, Fiber, Hit, Marschner, Model, R, Scatter, TRT, TT};
use math::Rgb;
use plot::lobes::measure::{Offset, albedo};

use super::head::{self, Lighting};
use super::matching::{marschner, marschner_look};
use super::ratio;
use crate::chart::{Chart, Curve};
use crate::raster::Raster;
use crate::stats::{self, Bell, bell};
use crate::{Context, Error, Measured, Report, Table, number};

/// Widths of R in the two rows of the figure, degrees.
const WIDTHS_DEG: [f64; 2] = [5.0, 10.0];
const ALPHA_DEG: f64 = -5.0;
/// The thesis does not say which; this one is from its figure 32.
const SIGMA_A: [f64; 3] = [0.11, 0.36, 0.4];
/// Of the diffuse part, which the thesis does not give either.
const DIFFUSE: [f64; 3] = [0.25, 0.14, 0.07];

fn look(beta_deg: f64) -> String {
    format!("{}diffuse = {DIFFUSE:?}\n", marschner_look(SIGMA_A, beta_deg, ALPHA_DEG))
}

/// The highlight R along the fiber, seen at right angles, without the cosines that belong to all lobes.
fn along(fiber: &Marschner<f64>) -> Vec<(f64, f64)> {
    let point = fiber.prepare(&Hit::new(Dir::new(0.0, 0.0), 0.0));
    (-900..=900)
        .map(|i| 0.1 * f64::from(i))
        .filter(|deg| deg.abs() < 89.0)
        .map(|deg| {
            let theta = deg.to_radians();
            let cosines = theta.cos() / (0.5 * theta).cos().powi(2);
            (deg, point.eval(Dir::new(theta, 0.0))[R].luminance() / cosines)
        })
        .collect()
}

/// Light of a white dome by lobe R, TT, TRT.
fn returned(fiber: &Marschner<f64>) -> [Rgb<f64>; 3] {
    let found = albedo(&Fiber::Marschner(*fiber), Offset::Mean, &[0.0]);
    [R, TT, TRT].map(|lobe| found.first().map_or(Rgb::black(), |at| at.lobes[lobe]))
}

/// Bright places of a picture: the light that a hundredth of the hair exceeds.
fn bright(image: &film::Image, hair: &[usize]) -> f64 {
    let light: Vec<f64> = hair.iter().map(|&i| f64::from(image.pixels[i].luminance())).collect();
    stats::quantile(&light, 0.99)
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let fibers = WIDTHS_DEG.map(|beta| marschner(SIGMA_A, beta, ALPHA_DEG));
    let mut films = Vec::new();
    for beta in WIDTHS_DEG {
        films.push(head::film(context, &format!("β = {beta}°"), Lighting::Front, &look(beta))?);
    }
    let hair = head::hair(&films[0])?;
    let lobes = |lobe: usize| -> Vec<film::Image> { films.iter().map(|film| head::lobe_image(film, lobe)).collect() };
    let (first, second) = (lobes(R), lobes(TRT));
    let mean = |images: &[film::Image], i: usize| head::mean(&images[i], &hair);
    let dimmer = ratio(bright(&first[0], &hair), bright(&first[1], &hair));
    let kept = ratio(mean(&first, 1).luminance(), mean(&first, 0).luminance());

    let curves = fibers.map(|fiber| along(&fiber));
    let mut bells: Vec<Bell> = Vec::new();
    for curve in &curves {
        bells.push(bell(curve, 0.1).ok_or(Error::Measure("the highlight has no shape"))?);
    }
    let domes = fibers.map(|fiber| returned(&fiber));
    let tint = |i: usize| ratio(domes[i][2][2], domes[i][2][0]);

    let measured = vec![
        Measured::new("height of R, β = 5° over β = 10°", bells[0].height / bells[1].height, "")
            .about(2.0, 0.03)
            .decides(),
        Measured::new("light of R from a white dome, β = 10° over β = 5°", ratio(domes[1][0][0], domes[0][0][0]), "")
            .between(0.9, 1.1)
            .decides(),
        Measured::new("pictures: brightest hundredth of R, β = 5° over β = 10°", dimmer, "")
            .between(1.2, 2.2)
            .decides(),
        Measured::new("pictures: mean light of R, β = 10° over β = 5°", kept, "").between(0.75, 1.3).decides(),
        Measured::new("place of R in θ_s, β = 5°", bells[0].centre, "degrees").about(2.0 * ALPHA_DEG, 0.05),
        Measured::new("width of R in θ_s, β = 5°", bells[0].deviation, "degrees").about(2.0 * WIDTHS_DEG[0], 0.05),
        Measured::new("width of R in θ_s, β = 10°", bells[1].deviation, "degrees").about(2.0 * WIDTHS_DEG[1], 0.05),
        Measured::new("blue over red of TRT, β = 10° against β = 5°", ratio(tint(1), tint(0)), "").between(0.95, 1.05),
    ];
    let figure = format!(
        "from 5° to 10° the highlight is {} times lower at its top and keeps {} of its light",
        number(bells[0].height / bells[1].height),
        number(ratio(domes[1][0][0], domes[0][0][0]))
    );
    let mut report = Report::new(
        "β_R sets how wide a highlight is and α_R where it lies; a wider highlight is a dimmer one, because energy is \
         conserved.",
        figure,
        measured,
    );
    report.text = vec![
        format!(
            "β_R is 5 and 10 degrees and α_R {ALPHA_DEG} degrees, as in the figure; TT and TRT follow by the factors of \
             the thesis. Absorption is not given there; we took {SIGMA_A:?}, from its figure 32, and a diffuse part of \
             {DIFFUSE:?}, by the Lambertian cylinder where the thesis has that of Kajiya and Kay. Lobes are those of \
             the renderer's own pictures of lobes. The thesis speaks of an azimuthal shift β; it is the width along \
             the fiber."
        ),
        "The shape of R is that of the value seen at right angles, without the cosines that all lobes share. A white \
         dome is an integral over the sphere. In pictures the mean light of R stays only roughly, since shadows and the \
         turn of the curls select some of the directions."
            .into(),
        "Whether energy is conserved in amount, and not only from width to width, is another question: see \
         `hunz-energy`."
            .into(),
    ];
    let mut table = Table::new(
        "Light from a white dome seen straight on, red, green and blue; and mean light of the hair in the pictures.",
        ["β", "R", "TT", "TRT", "picture: R", "picture: TRT"],
    );
    for (i, beta) in WIDTHS_DEG.into_iter().enumerate() {
        table.row([
            format!("{beta}°"),
            super::rgb(domes[i][0]),
            super::rgb(domes[i][1]),
            super::rgb(domes[i][2]),
            super::rgb(mean(&first, i)),
            super::rgb(mean(&second, i)),
        ]);
    }
    report.tables.push(table);
    let exposures = [head::exposure(&first[0]), head::exposure(&second[0]), head::exposure(&films[0].image())];
    let mut pictures = Vec::new();
    for ((r, trt), film) in first.iter().zip(&second).zip(&films) {
        pictures.push(head::shown(r, exposures[0]));
        pictures.push(head::shown(trt, exposures[1]));
        pictures.push(head::shown(&film.image(), exposures[2]));
    }
    report.pictures.push(Raster::sheet(&pictures, 3, 4).picture(
        "curls",
        "From left to right: R, TRT, all lobes with the diffuse part. Above β_R = 5°, below 10°. Columns are exposed \
         alike.",
    )?);
    report.pictures.push(
        Chart {
            title: "Highlight R along the fiber".into(),
            x: "inclination of the light, degrees".into(),
            y: "value".into(),
            x_range: Some((-60.0, 60.0)),
            curves: WIDTHS_DEG
                .into_iter()
                .zip(&curves)
                .map(|(beta, curve)| Curve::line(format!("β = {beta}°"), curve.iter().map(|&(x, y)| [x, y]).collect()))
                .collect(),
            ..Chart::default()
        }
        .picture("along", "R seen at right angles to the fiber; to the left is the root.")?,
    );
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highlight_is_a_gaussian_at_twice_its_shift() {
        for beta in WIDTHS_DEG {
            let bell = bell(&along(&marschner(SIGMA_A, beta, ALPHA_DEG)), 0.1).unwrap();
            // The Fresnel factor grows with the inclination and moves both a little.
            assert!((bell.centre / (2.0 * ALPHA_DEG) - 1.0).abs() < 0.05, "{bell:?}");
            assert!((bell.deviation / (2.0 * beta) - 1.0).abs() < 0.05, "{bell:?}");
        }
    }
}
