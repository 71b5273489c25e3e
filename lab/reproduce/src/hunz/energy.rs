//! Energy of Marschner's model, as printed and with the factor of one half.

use fiber::{Caustic, Fiber, KajiyaKay, KajiyaKayMode, Marschner, MarschnerNorm, R, Sadeghi, SadeghiMode, quadrature};
use math::Rgb;
use plot::lobes::measure::{Offset, albedo};

use crate::chart::{Chart, Curve};
use crate::{Context, Error, Measured, Report, Table, number};

/// Widths of R, degrees; the thesis names 5 to 10.
const WIDTHS_DEG: [f64; 4] = [5.0, 7.5, 10.0, 20.0];
/// What may be missing or too much while energy counts as conserved.
const TOLERANCE: f64 = 0.05;

fn fiber(beta_deg: f64, norm: MarschnerNorm) -> Marschner<f64> {
    Marschner { beta_m: beta_deg.to_radians(), alpha: 0.0, norm, ..Marschner::with_absorption(Rgb::black()) }
}

/// What a white dome gets back from the longitudinal factor alone, as if all light left by R:
/// `∫ M_R cos² θ_s / cos² θ_d dθ_s`.
fn returned(fiber: &Marschner<f64>, theta_k: f64) -> f64 {
    const PANELS: u32 = 60;
    let half_pi = std::f64::consts::FRAC_PI_2;
    let (sin_k, cos_k) = theta_k.sin_cos();
    let width = std::f64::consts::PI / f64::from(PANELS);
    let panels = (0..PANELS).map(|i| {
        let from = -half_pi + width * f64::from(i);
        quadrature::integrate(from, from + width, 24, |theta| {
            let (sin, cos) = theta.sin_cos();
            let cos2 = 0.5 * (1.0 + cos_k * cos + sin_k * sin);
            fiber.longitudinal(sin_k, cos_k, sin, cos)[R] * cos * cos / cos2.max(1e-5)
        })
    });
    panels.sum()
}

/// The least and the most of [`returned`] over inclinations from 0 to 80 degrees.
fn range(fibers: &[Marschner<f64>]) -> (f64, f64) {
    let angles = (0..=80).step_by(5).map(|deg| f64::from(deg).to_radians());
    let all = angles.flat_map(|theta| fibers.iter().map(move |fiber| returned(fiber, theta)));
    all.fold((f64::INFINITY, 0.0), |(least, most), x| (x.min(least), x.max(most)))
}

/// Height of the longitudinal factor of R.
fn height(fiber: &Marschner<f64>) -> f64 {
    fiber.longitudinal(0.0, 1.0, 0.0, 1.0)[R]
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    let of = |norm: MarschnerNorm, widths: &[f64]| -> Vec<Marschner<f64>> {
        widths.iter().map(|&beta| fiber(beta, norm)).collect()
    };
    let usual = &WIDTHS_DEG[..3];
    let (printed, normalised) = (MarschnerNorm::AsPrinted, MarschnerNorm::Normalised);
    let (printed_least, printed_most) = range(&of(printed, usual));
    let (least, most) = range(&of(normalised, usual));
    let (wide_printed_least, wide_printed_most) = range(&of(printed, &WIDTHS_DEG));
    let (wide_least, wide_most) = range(&of(normalised, &WIDTHS_DEG));
    let lower = height(&fiber(5.0, printed)) / height(&fiber(10.0, printed));

    // Whole fibers.
    let mut table = Table::new(
        "What a white dome of radiance 1 gets back from whole fibers without absorption, luminance, by inclination of \
         the view.",
        ["fiber", "0°", "30°", "60°", "75°"],
    );
    let glints = |strength: f64| Marschner {
        caustic: Some(Caustic { strength, ..Caustic::default() }),
        ..Marschner::with_absorption(Rgb::black())
    };
    let diffuse = Rgb([0.72, 0.59, 0.47]);
    let kajiya = |specular: f64, mode: KajiyaKayMode| KajiyaKay::single(diffuse, Rgb::splat(specular), 25.0, mode);
    let legacy = Sadeghi { mode: SadeghiMode::Legacy, ..Sadeghi::default() };
    let rows: [(&str, Fiber<f64>); 8] = [
        ("Marschner as printed", Fiber::Marschner(Marschner { norm: printed, ..glints(1.0) })),
        ("Marschner, normalised", Fiber::Marschner(glints(1.0))),
        ("the same, glints of strength 0.5", Fiber::Marschner(glints(0.5))),
        ("the same, glints of strength 5", Fiber::Marschner(glints(5.0))),
        ("artist-friendly, as published (0.45, 0.25, 0.3)", Fiber::Sadeghi(legacy)),
        ("artist-friendly, normalised", Fiber::Sadeghi(Sadeghi::default())),
        ("Kajiya-Kay of figure 29, m = 25", Fiber::KajiyaKay(kajiya(1.0, KajiyaKayMode::Thesis))),
        ("Kajiya-Kay, normalised, specular 0.28", Fiber::KajiyaKay(kajiya(0.28, KajiyaKayMode::Normalised))),
    ];
    let angles = [0.0, 30.0, 60.0, 75.0].map(f64::to_radians);
    let mut straight = Vec::new();
    for (i, (name, fiber)) in rows.iter().enumerate() {
        context.step("whole fibers", i as f64 / rows.len() as f64)?;
        let found: Vec<f64> =
            albedo(fiber, Offset::Mean, &angles).iter().map(|at| at.lobes.sum().luminance()).collect();
        straight.push(found[0]);
        table.row([(*name).to_owned()].into_iter().chain(found.into_iter().map(number)));
    }

    let measured = vec![
        Measured::new("as printed, β from 5° to 10°, 0 to 80°: least return", printed_least, "")
            .between(1.0 - TOLERANCE, 1.0 + TOLERANCE)
            .decides(),
        Measured::new("as printed, β from 5° to 10°, 0 to 80°: largest return", printed_most, "")
            .between(1.0 - TOLERANCE, 1.0 + TOLERANCE)
            .decides(),
        Measured::new("height of the highlight, β = 5° over β = 10°", lower, "").about(2.0, 1e-6).decides(),
        Measured::new("with a factor of one half, β from 5° to 10°: least return", least, ""),
        Measured::new("with a factor of one half, β from 5° to 10°: largest return", most, ""),
        Measured::new("as printed, β up to 20°: least return", wide_printed_least, "").about(1.45, 0.01),
        Measured::new("as printed, β up to 20°: largest return", wide_printed_most, "").about(2.07, 0.01),
        Measured::new("with a factor of one half, β up to 20°: least return", wide_least, "").about(0.73, 0.01),
        Measured::new("with a factor of one half, β up to 20°: largest return", wide_most, "").about(1.03, 0.01),
        Measured::new("whole white fiber as printed, seen straight on", straight[0], ""),
        Measured::new("whole white fiber with a factor of one half, seen straight on", straight[1], ""),
    ];
    let figure = format!(
        "as printed a white dome gets {} to {} times its light back, with a factor of one half {} to {} times",
        number(printed_least),
        number(printed_most),
        number(least),
        number(most)
    );
    let mut report = Report::new(
        "Marschner's model is physically plausible because it conserves energy, which shows in highlights that get \
         dimmer as they get wider.",
        figure,
        measured,
    );
    report.text = vec![
        "The longitudinal factor is a Gaussian of unit area in the half angle θ_h = (θ_i + θ_o)/2. With the view held \
         still, θ_h changes half as fast as the direction of the light, so over all directions the Gaussian integrates \
         to 2. With a factor of one half it integrates to 1, but for what lies beyond the poles and for the cosines, \
         which vary within a lobe. Hery and Ramamoorthi 2012 have that factor."
            .into(),
        format!(
            "The numbers are those of R alone with an azimuthal factor of 1, untilted, where all light would leave by R: \
             so Fresnel's factor and absorption cannot hide anything. Within {} % counts as conserved. That a highlight \
             is half as high when it is twice as wide is right in either form, and says nothing of the amount.",
            number(100.0 * TOLERANCE)
        ),
        "The second table has whole fibers. What Marschner's three lobes lack, less than a hundredth at right angles, is \
         light that is reflected inside more than once; towards grazing angles it is more. Glints are not neutral \
         either: see `hunz-caustic`. Our default is the factor of one half; `as_printed` remains for comparison."
            .into(),
    ];
    let mut lone = Table::new(
        "Return of the longitudinal factor alone, as printed; half of it with the factor of one half.",
        ["β", "0°", "30°", "60°", "80°", "85°"],
    );
    for beta in WIDTHS_DEG {
        let cells =
            [0.0, 30.0, 60.0, 80.0, 85.0_f64].map(|deg| number(returned(&fiber(beta, printed), deg.to_radians())));
        lone.row([format!("{beta}°")].into_iter().chain(cells));
    }
    report.tables.push(lone);
    report.tables.push(table);
    let curve = |beta: f64, norm: MarschnerNorm| -> Vec<[f64; 2]> {
        let fiber = fiber(beta, norm);
        (0..=85).map(f64::from).map(|deg| [deg, returned(&fiber, deg.to_radians())]).collect()
    };
    let mut curves = Vec::new();
    for (word, norm) in [("as printed", printed), ("one half", normalised)] {
        for beta in [5.0, 10.0, 20.0] {
            curves.push(Curve::line(format!("{word}, β = {beta}°"), curve(beta, norm)));
        }
    }
    curves.push(Curve::dashed("conserved", vec![[0.0, 1.0], [85.0, 1.0]]));
    report.pictures.push(
        Chart {
            title: "Light returned from a white dome".into(),
            x: "inclination of the view, degrees".into(),
            y: "share of the light".into(),
            y_range: Some((0.0, 2.5)),
            curves,
            ..Chart::default()
        }
        .picture("angle", "What the longitudinal factor returns, as printed and with a factor of one half.")?,
    );
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returns_are_those_of_the_tables() {
        // Adaptive quadrature, apart from this code: 0 and 85 degrees, as printed.
        for (beta, straight, grazing) in [(5.0, 1.955_006_128, 2.103_324_88), (20.0, 1.453_627_99, 2.443_173_50)] {
            let fiber = fiber(beta, MarschnerNorm::AsPrinted);
            assert!((returned(&fiber, 0.0) / straight - 1.0).abs() < 1e-7, "{beta}: {}", returned(&fiber, 0.0));
            let at = returned(&fiber, 85.0_f64.to_radians());
            assert!((at / grazing - 1.0).abs() < 1e-4, "{beta}: {at}");
        }
    }
}
