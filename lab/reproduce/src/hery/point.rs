//! One point of a fiber without visibility: variances by quadrature and by samples.

use fiber::quadrature::rule;
use fiber::{Dir, Hery, Hit, Model, Scatter};
use math::hash;

use crate::sphere::{UNIFORM, numbers, uniform};

/// A direction of the sphere in the fiber's frame, the solid angle that it stands for, and the fiber's value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) dir: [f64; 3],
    /// Steradians.
    pub(super) weight: f64,
    /// `fcos`, luminance; also the density of the sampler, for a white fiber.
    pub(super) value: f64,
}

/// The sphere around the highlight of a fiber seen at inclination `theta_k`, azimuth 0, in enough nodes for any
/// function that is smoother than the highlight.
///
/// Beyond eight standard deviations the highlight has nothing left.
pub(super) fn nodes(fiber: &Hery<f64>, theta_k: f64) -> Vec<Node> {
    const PANELS: u32 = 8;
    let half_pi = std::f64::consts::FRAC_PI_2;
    let point = fiber.prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0));
    let (centre, reach) = (2.0 * fiber.lobes[0].alpha - theta_k, 16.0 * fiber.lobes[0].beta);
    let (from, to) = ((centre - reach).max(-half_pi), (centre + reach).min(half_pi));
    let mut edges: Vec<f64> = (0..=PANELS).map(|i| from + (to - from) * f64::from(i) / f64::from(PANELS)).collect();
    // The square of the value times the solid angle has 1/cos θ: towards a pole the integral grows with the
    // logarithm, down to the model's floor of the cosine.
    for step in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        edges.extend([step - half_pi, half_pi - step].into_iter().filter(|edge| *edge > from && *edge < to));
    }
    edges.sort_by(f64::total_cmp);
    let mut nodes = Vec::new();
    for pair in edges.windows(2) {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        for &(x, wx) in rule(16) {
            for &(y, wy) in rule(64) {
                let dir = Dir::new(middle + half * x, std::f64::consts::PI * y);
                let weight = half * wx * std::f64::consts::PI * wy * dir.cos_theta;
                nodes.push(Node { dir: dir.to_local(), weight, value: point.eval(dir).sum().luminance() });
            }
        }
    }
    nodes
}

/// What one sample of an estimator spreads, in the unit of what it estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Variances {
    /// What is estimated.
    pub(super) mean: f64,
    /// Of one sample of the fiber.
    pub(super) fiber: f64,
    /// Of one sample of the light, in proportion to its radiance.
    pub(super) light: f64,
    /// Of one sample of each, by the balance heuristic.
    pub(super) both: f64,
}

/// Variances for a white fiber under radiance `sky`, whose integral over the sphere is `total`.
pub(super) fn variances(nodes: &[Node], total: f64, mut sky: impl FnMut([f64; 3]) -> f64) -> Variances {
    let (mut mean, mut fiber, mut light, mut both, mut by_fiber) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for node in nodes {
        let radiance = sky(node.dir);
        // The fiber's density is its value, the light's its radiance over the total.
        let (p, q) = (node.value, radiance / total);
        let energy = node.weight * p * radiance;
        mean += energy;
        fiber += energy * radiance;
        light += energy * p * total;
        if p + q > 0.0 {
            both += energy * p * radiance / (p + q);
            by_fiber += energy * p / (p + q);
        }
    }
    let by_light = mean - by_fiber;
    Variances {
        mean,
        fiber: fiber - mean * mean,
        light: light - mean * mean,
        both: both - by_fiber * by_fiber - by_light * by_light,
    }
}

/// What single samples give in a white dome of radiance 1, for a fiber seen at `theta_k`: samples of the fiber,
/// samples of the dome, and one of each by the balance heuristic.
pub(super) struct Dome {
    pub(super) fiber: Vec<f64>,
    pub(super) light: Vec<f64>,
    pub(super) both: Vec<f64>,
}

/// Takes `count` samples in the dome.
pub(super) fn dome(fiber: &Hery<f64>, theta_k: f64, count: u32, stream: u32) -> Dome {
    let point = fiber.prepare(&Hit::new(Dir::new(theta_k, 0.0), 0.0));
    let mut out = Dome { fiber: Vec::new(), light: Vec::new(), both: Vec::new() };
    for i in 0..count {
        let (value, pdf) = point.eval_pdf(uniform(numbers(i, hash::mix2(stream, 1))));
        let value = value.sum().luminance();
        out.light.push(value / UNIFORM);
        let mut both = value / (pdf + UNIFORM);
        let mut by_fiber = 0.0;
        if let Some(sample) = point.sample(numbers(i, hash::mix2(stream, 2))) {
            by_fiber = sample.weight.sum().luminance();
            let pdf = sample.pdf.unwrap_or_else(|| point.pdf(sample.dir));
            both += by_fiber * pdf / (pdf + UNIFORM);
        }
        out.fiber.push(by_fiber);
        out.both.push(both);
    }
    out
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use fiber::HeryMode;

    use super::super::white;
    use super::*;
    use crate::stats;

    #[test]
    fn the_nodes_integrate_the_lobe() {
        for (beta_deg, theta_k) in [(5.0, 0.3), (10.0, -0.8), (19.0, 1.2)] {
            let nodes = nodes(&white(beta_deg, HeryMode::Truncated), theta_k);
            let sum: f64 = nodes.iter().map(|n| n.weight * n.value).sum();
            // The floor of the cosine at the poles takes up to 1e-4 at grazing angles.
            assert!((sum - 1.0).abs() < 5e-4, "{beta_deg} {theta_k}: {sum}");
        }
    }

    #[test]
    fn a_white_dome_has_the_variance_of_its_closed_form() {
        // ∫ fcos² dω · 4π - 1 for a narrow lobe: π²/16 · 1/(β √π cos θ) - 1, corrections of order β².
        let (beta, theta_k) = (2.0_f64.to_radians(), 0.3);
        let v = variances(&nodes(&white(2.0, HeryMode::Truncated), theta_k), 4.0 * PI, |_| 1.0);
        let want = PI * PI / 16.0 / (beta * PI.sqrt() * theta_k.cos()) - 1.0;
        assert!((v.light / want - 1.0).abs() < 5e-3, "{} and {want}", v.light);
        assert!((v.mean - 1.0).abs() < 1e-6 && v.fiber.abs() < 1e-6);
        // The heuristic is never much worse than the better of the two, and here that one is exact.
        assert!(v.both >= 0.0 && v.both < v.light);
    }

    #[test]
    fn samples_have_the_variances_of_the_quadrature() {
        let fiber = white(7.5, HeryMode::Truncated);
        let v = variances(&nodes(&fiber, 0.3), 4.0 * PI, |_| 1.0);
        let samples = dome(&fiber, 0.3, 40_000, 5);
        assert!(samples.fiber.iter().all(|x| (x - 1.0).abs() < 1e-9));
        // The variance of a variance: kurtosis of these estimators is below 20, so one deviation is below 2.2 %
        // of 40,000 samples' variance; 4 of them, a false alarm in 16,000. The stream is fixed.
        for (samples, want) in [(&samples.light, v.light), (&samples.both, v.both)] {
            let got = stats::deviation(samples).powi(2);
            assert!((got / want - 1.0).abs() < 0.09, "{got} and {want}");
            // Means: 4 standard errors.
            assert!((stats::mean(samples) - 1.0).abs() < 4.0 * (want / 40_000.0).sqrt());
        }
    }
}
