//! The cubic in place of Snell's law, and the Gaussians in place of the caustics.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use fiber::lobe::attenuation::Optics;
use fiber::lobe::caustic::{Fold, Smoothing};
use fiber::lobe::roots::{ExitCurve, inverse_index};
use fiber::quadrature::rule;
use fiber::{Caustic, Marschner, Roots, TRT, TT};
use math::Rgb;

use super::ratio;
use crate::chart::{Chart, Curve, side_by_side};
use crate::{Context, Error, Measured, Report, Table, number, stats};

const ETA: f64 = 1.55;
/// Width of the glints, degrees; the middle of what the thesis allows.
const WIDTH_DEG: f64 = 15.0;
/// Difference angles at which energy is tried, degrees.
const ANGLES_DEG: [f64; 3] = [0.0, 20.0, 40.0];
/// Widths of glints, and the strength that keeps energy there, exact roots at 0°.
const NEUTRAL: [(f64, f64); 5] = [(2.0, 0.56), (5.0, 0.58), (10.0, 0.79), (15.0, 0.94), (25.0, 1.03)];
/// Azimuths over the full turn.
const COUNT: u32 = 1440;

fn cos2(theta_d_deg: f64) -> f64 {
    theta_d_deg.to_radians().cos().powi(2)
}

fn exit_curve(roots: Roots, lobe: usize, theta_d_deg: f64) -> ExitCurve {
    ExitCurve::new(roots, lobe, inverse_index(cos2(theta_d_deg), ETA))
}

/// Azimuths between the nodes of a grid, so that neither 0 nor the end of a turn is one.
fn azimuths() -> impl Iterator<Item = f64> {
    (0..COUNT).map(|i| TAU * (f64::from(i) + 0.5) / f64::from(COUNT) - PI)
}

/// The azimuthal factor of a white fiber over [`azimuths`].
fn around(roots: Roots, caustic: Option<Caustic<f64>>, lobe: usize, theta_d_deg: f64) -> Vec<f64> {
    let fiber = Marschner { eta: ETA, roots, caustic, ..Marschner::with_absorption(Rgb::black()) };
    azimuths().map(|phi| fiber.azimuthal(cos2(theta_d_deg), phi, 0.0)[lobe].luminance()).collect()
}

/// Relative differences where both curves have light.
fn differences(test: &[f64], want: &[f64]) -> Vec<f64> {
    let both = test.iter().zip(want).filter(|(a, b)| **a > 0.0 && **b > 0.0);
    both.map(|(a, b)| (a / b - 1.0).abs()).collect()
}

/// Share of the light that lies elsewhere.
fn moved(test: &[f64], want: &[f64]) -> f64 {
    ratio(test.iter().zip(want).map(|(a, b)| (a - b).abs()).sum(), want.iter().sum())
}

/// Light of TRT of a white fiber: all of it, what the smoothing takes out, and what glints of strength 1 put in.
#[derive(Clone, Copy, Debug)]
struct Light {
    all: f64,
    taken: f64,
    glints: f64,
}

impl Light {
    /// By offsets instead of azimuths: there caustics are nothing special.
    fn of(roots: Roots, width_deg: f64, theta_d_deg: f64) -> Self {
        let curve = exit_curve(roots, TRT, theta_d_deg);
        let caustic = Caustic { strength: 1.0, width: width_deg.to_radians(), ..Caustic::default() };
        let smoothing = Smoothing::new(&caustic, &curve);
        let optics = Optics::new(cos2(theta_d_deg), ETA);
        let attenuation = |h: f64| optics.path_at(h).attenuation(Rgb::black())[TRT].luminance();
        let (mut all, mut taken) = (0.0, 0.0);
        for &(x, weight) in rule(256) {
            let gamma = FRAC_PI_2 * x;
            let light = 0.5 * weight * FRAC_PI_2 * gamma.cos() * attenuation(gamma.sin());
            all += light;
            taken += light * (1.0 - smoothing.kept(curve.azimuth(gamma)));
        }
        Self { all, taken, glints: 2.0 * smoothing.gain * attenuation(smoothing.h) }
    }

    /// The strength that puts in what was taken out.
    fn neutral(self) -> f64 {
        ratio(self.taken, self.glints)
    }

    /// Light after smoothing over light before, for a strength of 1.
    fn kept(self) -> f64 {
        (self.all - self.taken + self.glints) / self.all
    }
}

/// Azimuth of the caustic, degrees.
fn angle_deg(roots: Roots) -> f64 {
    Fold::of(&exit_curve(roots, TRT, 0.0)).map_or(f64::NAN, |fold| fold.azimuth.abs().to_degrees())
}

/// Share of azimuths without a root.
fn rootless(lobe: usize) -> f64 {
    let curve = exit_curve(Roots::Exact, lobe, 0.0);
    let none = azimuths().filter(|&phi| curve.solve(phi).as_slice().is_empty()).count();
    none as f64 / f64::from(COUNT)
}

pub(super) fn run(context: &Context<'_>) -> Result<Report, Error> {
    context.step("azimuthal factors", 0.0)?;
    let smooth = Some(Caustic { width: WIDTH_DEG.to_radians(), ..Caustic::default() });
    let both = |caustic: Option<Caustic<f64>>, lobe: usize, deg: f64| {
        [Roots::Cubic, Roots::Exact].map(|roots| around(roots, caustic, lobe, deg))
    };
    let (tt, raw, smoothed) = (both(None, TT, 0.0), both(None, TRT, 0.0), both(smooth, TRT, 0.0));
    let tt_off = stats::mean(&differences(&tt[0], &tt[1]));
    let raw_off = stats::quantile(&differences(&raw[0], &raw[1]), 0.5);
    let smoothed_off = moved(&smoothed[0], &smoothed[1]);
    let [tilted_tt, tilted_trt] = [TT, TRT].map(|lobe| {
        let [cubic, exact] = both(None, lobe, 40.0);
        stats::quantile(&differences(&cubic, &exact), 0.5)
    });

    let kept = ANGLES_DEG.map(|deg| Light::of(Roots::Exact, WIDTH_DEG, deg).kept());
    let worst = kept.iter().map(|x| (x - 1.0).abs()).fold(0.0, f64::max);
    let angles = [Roots::Exact, Roots::Cubic].map(angle_deg);

    let mut measured = vec![
        Measured::new("TT at θ_d = 0, cubic against exact: mean relative difference", 100.0 * tt_off, "%")
            .between(0.0, 5.0)
            .decides(),
        Measured::new(
            "smoothed TRT at θ_d = 0, cubic against exact: light that lies elsewhere",
            100.0 * smoothed_off,
            "%",
        )
        .between(0.0, 10.0)
        .decides(),
        Measured::new(
            "light of TRT after smoothing, k_G = 1, w_c = 15°: largest change, θ_d = 0, 20, 40°",
            100.0 * worst,
            "%",
        )
        .between(0.0, 10.0)
        .decides(),
        Measured::new("TRT before smoothing, θ_d = 0: median relative difference", 100.0 * raw_off, "%")
            .about(12.0, 0.1),
        Measured::new("TT at θ_d = 40°: median relative difference", 100.0 * tilted_tt, "%").between(0.0, 2.0),
        Measured::new("TRT at θ_d = 40°: median relative difference", 100.0 * tilted_trt, "%").between(0.0, 4.0),
        Measured::new("caustic by Snell's law, θ_d = 0", angles[0], "degrees").about(18.62, 1e-3),
        Measured::new("caustic by the cubic, θ_d = 0", angles[1], "degrees").about(20.49, 1e-3),
        Measured::new("azimuths without a root: TT (the thesis counts one everywhere)", 100.0 * rootless(TT), "%")
            .between(0.0, 0.0),
        Measured::new("azimuths without a root: TRT (the thesis counts one or three)", 100.0 * rootless(TRT), "%")
            .between(0.0, 0.0),
    ];
    for (width, want) in NEUTRAL {
        let label = format!("strength of glints that keeps the light, w_c = {width}°, θ_d = 0");
        measured.push(Measured::new(label, Light::of(Roots::Exact, width, 0.0).neutral(), "").about(want, 0.02));
    }
    let figure = format!(
        "the cubic moves TT by {} % and smoothed TRT by {} %, and the caustic from {}° to {}°; smoothing changes the light \
         of TRT by up to {} %",
        number(100.0 * tt_off),
        number(100.0 * smoothed_off),
        number(angles[0]),
        number(angles[1]),
        number(100.0 * worst)
    );
    let mut report = Report::new(
        "A cubic can stand for Snell's law when the paths to an azimuth are looked for. The caustics of TRT can be taken \
         out and replaced by Gaussians of the same energy.",
        figure,
        measured,
    );
    report.text = vec![
        format!(
            "A white fiber of index {ETA}. TT is compared where both curves have light, in the mean over {COUNT} azimuths. \
             Before smoothing TRT is infinite at its caustics, and a mean means nothing there, so the median is given. \
             After smoothing, with glints of {WIDTH_DEG} degrees and strength 1, it is the share of light that lies at \
             other azimuths."
        ),
        "Light is added up over offsets instead of azimuths, where a caustic is nothing special: each offset brings the \
         attenuation of its path, and the smoothing keeps a known share of it. So what smoothing takes out and what the \
         glints put in are known to many digits, and the strength that balances them is a quotient."
            .into(),
        format!(
            "Energy is kept in the algorithm only where the strength happens to be right: that depends on the width of \
             glints, on the limit Δh, which is in force from 7 degrees on, and on the inclination. At k_G = 1 and {WIDTH_DEG} \
             degrees the light of TRT after smoothing is {}, {} and {} of that before at θ_d = 0, 20 and 40 degrees. The \
             strength is an artist's control from 0.5 to 5, so the upper end makes light.",
            number(kept[0]),
            number(kept[1]),
            number(kept[2])
        ),
        "Angle, azimuth and curvature of the caustic have to come from the curve that gives the roots. The thesis takes \
         the offset from Snell's law and the azimuth from the cubic; mixed, glints lie beside the gap that was cut. It \
         also counts one root for TT and one or three for TRT. There is none where no path leads."
            .into(),
    ];
    let mut table = Table::new(
        "Strength of glints that keeps the light of TRT.",
        ["w_c", "exact, θ_d = 0", "cubic, θ_d = 0", "exact, 20°", "exact, 40°"],
    );
    for (width, _) in NEUTRAL {
        table.row([
            format!("{width}°"),
            number(Light::of(Roots::Exact, width, 0.0).neutral()),
            number(Light::of(Roots::Cubic, width, 0.0).neutral()),
            number(Light::of(Roots::Exact, width, 20.0).neutral()),
            number(Light::of(Roots::Exact, width, 40.0).neutral()),
        ]);
    }
    report.tables.push(table);
    let curves = |found: &[Vec<f64>; 2], within: f64| -> Vec<Curve> {
        let points = |values: &[f64]| -> Vec<[f64; 2]> {
            let all = azimuths().map(f64::to_degrees).zip(values).map(|(phi, &value)| [phi, value]);
            all.filter(|[phi, _]| phi.abs() <= within).collect()
        };
        vec![Curve::line("Snell", points(&found[1])), Curve::line("cubic", points(&found[0]))]
    };
    let chart = |title: &str, found: &[Vec<f64>; 2], within: f64, top: Option<f64>| Chart {
        title: title.into(),
        x: "azimuth, degrees".into(),
        y: "N".into(),
        y_range: top.map(|top| (0.0, top)),
        curves: curves(found, within),
        ..Chart::default()
    };
    report.pictures.push(side_by_side(
        &[
            chart("TT", &tt, 180.0, None),
            // Without a limit the caustic would be all that is seen.
            chart("TRT", &raw, 30.0, Some(0.6)),
            chart("TRT, smoothed", &smoothed, 90.0, None),
        ],
        "azimuth",
        "Azimuthal factors at θ_d = 0. TT is at ±180 degrees, straight on; TRT is backwards, near 0.",
    )?);
    let neutral = |roots: Roots, deg: f64| -> Vec<[f64; 2]> {
        (1..=25).map(f64::from).map(|width| [width, Light::of(roots, width, deg).neutral()]).collect()
    };
    report.pictures.push(
        Chart {
            title: "Strength of glints that keeps energy".into(),
            x: "width of the glints, degrees".into(),
            y: "strength".into(),
            y_range: Some((0.0, 1.6)),
            curves: vec![
                Curve::line("Snell, θ_d = 0", neutral(Roots::Exact, 0.0)),
                Curve::line("cubic, θ_d = 0", neutral(Roots::Cubic, 0.0)),
                Curve::line("Snell, θ_d = 20°", neutral(Roots::Exact, 20.0)),
                Curve::dashed("1", vec![[1.0, 1.0], [25.0, 1.0]]),
            ],
            ..Chart::default()
        }
        .picture("strength", "What is put in equals what is taken out.")?,
    );
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_by_offsets_is_light_by_azimuths() {
        let light = Light::of(Roots::Exact, WIDTH_DEG, 0.0);
        let smooth = Some(Caustic { width: WIDTH_DEG.to_radians(), ..Caustic::default() });
        let sum = around(Roots::Exact, smooth, TRT, 0.0).iter().sum::<f64>() * TAU / f64::from(COUNT);
        // Roots of the caustic's gap are like the 3/2-th power of the distance: the sum over azimuths is that exact.
        assert!((sum / (light.kept() * light.all) - 1.0).abs() < 2e-3, "{sum} and {light:?}");
        assert!(light.taken > 0.0 && light.taken < light.all, "{light:?}");
    }
}
