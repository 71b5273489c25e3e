//! Densities over the azimuth of the scattered direction.

use math::{Real, normal};

use super::attenuation::Optics;
use crate::quadrature::rule;

/// A Gaussian of standard deviation `sigma` wrapped around the circle, at `x` in `[-π, π]`; per radian.
#[inline]
pub fn wrapped_gaussian<F: Real>(sigma: F, x: F) -> F {
    if sigma > F::of(10.0) {
        // Even around the circle, to the last bit.
        return F::TAU().recip();
    }
    let norm = F::of(0.398_942_280_401_432_7) / sigma;
    let g = |x: F| (F::of(-0.5) * (x / sigma).sqr()).exp();
    let mut sum = g(x);
    // Images that can still matter at 9 standard deviations.
    let reach = F::of(9.0) * sigma;
    let mut turn = F::TAU();
    while turn - x.abs() < reach {
        sum += g(x.abs() - turn) + g(x.abs() + turn);
        turn += F::TAU();
    }
    norm * sum
}

/// A draw from a standard normal by its quantile, which keeps stratification.
#[inline]
pub fn standard_normal<F: Real>(xi: F) -> F {
    if F::DOUBLE {
        F::of(normal::quantile(xi.f64().clamp(1e-16, 1.0 - 1e-16)))
    } else {
        F::of(f64::from(normal::quantile_f32((xi.f64() as f32).clamp(3e-8, 1.0 - 6e-8))))
    }
}

/// Share of the logistic distribution that lies within `[-π, π]`.
#[inline]
fn logistic_cut<F: Real>(s: F) -> F {
    let x = F::PI() / (F::of(2.0) * s);
    // 1 to the last bit beyond this.
    if x > F::of(20.0) { F::one() } else { x.tanh() }
}

/// The logistic distribution cut to `[-π, π]` of Chiang et al. 2016, at `x` in `[-π, π]`; per radian.
#[inline]
pub fn trimmed_logistic<F: Real>(s: F, x: F) -> F {
    let e = (-x.abs() / s).exp();
    e / (s * (F::one() + e).sqr() * logistic_cut(s))
}

/// Draws from [`trimmed_logistic`].
#[inline]
pub fn sample_trimmed_logistic<F: Real>(s: F, xi: F) -> F {
    // Draw the magnitude from the upper half and the sign from the half `xi` lies in: both tails keep
    // their digits, where the textbook inversion loses the lower one.
    let (sign, r) =
        if xi < F::of(0.5) { (-F::one(), F::one() - F::of(2.0) * xi) } else { (F::one(), F::of(2.0) * xi - F::one()) };
    // With T = tanh(π/2s), |x| = 2 s atanh(r T).
    let y = r * logistic_cut(s);
    let x = s * (F::of(2.0) * y / (F::one() - y).max(F::min_positive_value())).ln_1p();
    sign * x.clamp_to(F::zero(), F::PI())
}

/// What blurs the exit azimuth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kernel {
    /// [`wrapped_gaussian`]; its scale is the standard deviation.
    Gaussian,
    /// [`trimmed_logistic`].
    Logistic,
}

impl Kernel {
    /// Density at `x` in `[-π, π]`, per radian.
    #[inline]
    pub(crate) fn at<F: Real>(self, scale: F, x: F) -> F {
        match self {
            Self::Gaussian => wrapped_gaussian(scale, x),
            Self::Logistic => trimmed_logistic(scale, x),
        }
    }

    /// Density of one image, anywhere: what a kernel that is narrow comes down to.
    #[inline]
    fn unwrapped<F: Real>(self, scale: F, x: F) -> F {
        match self {
            Self::Gaussian => gaussian(scale, x),
            Self::Logistic => {
                let e = (-x.abs() / scale).exp();
                e / (scale * (F::one() + e).sqr())
            }
        }
    }

    /// Factor that makes the integral over the circle 1.
    #[inline]
    pub(crate) fn norm<F: Real>(self, scale: F) -> F {
        match self {
            Self::Gaussian => F::of(0.398_942_280_401_432_7) / scale,
            Self::Logistic => (scale * logistic_cut(scale)).recip(),
        }
    }

    /// A draw.
    #[inline]
    pub(crate) fn sample<F: Real>(self, scale: F, xi: F) -> F {
        match self {
            Self::Gaussian => scale * standard_normal(xi),
            Self::Logistic => sample_trimmed_logistic(scale, xi),
        }
    }

    /// How many nodes over the whole cross-section a scale in radians needs; `None` if it is so narrow that
    /// windows serve better.
    ///
    /// The error falls like `exp(-0.18 (nβ)²)` of the peak for the Gaussian (measured against 1200 nodes: 1e-8
    /// at `nβ = 10`) and like `exp(-2 n s)` for the logistic, whose poles lie at `iπs`. Broad logistics have a
    /// kink where they are cut.
    pub(crate) fn nodes(self, scale: f64, double: bool) -> Option<usize> {
        let (constant, least) = match (self, double) {
            (Self::Gaussian, true) => (10.0, 0.0),
            (Self::Gaussian, false) => (8.3, 0.0),
            (Self::Logistic, true) => (10.0, if scale > 0.4 { 256.0 } else { 0.0 }),
            (Self::Logistic, false) => (7.0, if scale > 0.4 { 96.0 } else { 0.0 }),
        };
        let needed = (constant / scale).max(least).ceil();
        (needed <= 256.0).then_some(needed as usize)
    }

    /// Half width of a window, in units of the scale, and its nodes.
    fn window(self) -> (f64, usize) {
        match self {
            Self::Gaussian => (6.5, 32),
            Self::Logistic => (18.0, 64),
        }
    }
}

/// Visits `γ_i` nodes with weights such that `Σ weight · a(sin γ)` is `½ ∫ a(h) D(φ - Φ(p, h)) dh`, by
/// quadrature restricted to where the narrow kernel `D` is not negligible.
///
/// The windows are the stretches of `γ_i` on which `Φ(p, γ_i)` lies near `phi`, found by inverting `Φ`
/// on its monotone pieces. Integration in `γ_i` removes the end-point singularity, and because `Φ` is
/// inverted for the window's ends only, nothing diverges at the caustic.
pub(crate) fn windows<F: Real>(
    optics: &Optics<F>,
    p: usize,
    kernel: Kernel,
    scale: F,
    phi: F,
    mut visit: impl FnMut(F, F),
) {
    let mut ends = [-F::half_pi(); 4];
    let count = if let Some(turn) = optics.turning_point(p) {
        ends = [-F::half_pi(), -turn, turn, F::half_pi()];
        3
    } else {
        ends[1] = F::half_pi();
        1
    };
    let (reach, nodes) = kernel.window();
    let reach = F::of(reach) * scale;
    let rule = rule(nodes);
    for piece in 0..count {
        let (a, b) = (ends[piece], ends[piece + 1]);
        let (at_a, at_b) = (optics.exit_azimuth(p, a), optics.exit_azimuth(p, b));
        let (low, high) = (at_a.min(at_b), at_a.max(at_b));
        // Every image φ + 2πk whose window touches the piece.
        let first = ((low - reach - phi) / F::TAU()).ceil();
        let last = ((high + reach - phi) / F::TAU()).floor();
        let mut k = first;
        while k <= last {
            let target = phi + k * F::TAU();
            let mut from = invert(optics, p, a, b, at_a, at_b, target - reach);
            let mut to = invert(optics, p, a, b, at_a, at_b, target + reach);
            if from > to {
                (from, to) = (to, from);
            }
            let (centre, half) = (F::of(0.5) * (from + to), F::of(0.5) * (to - from));
            if half > F::zero() {
                for &(x, w) in rule {
                    let gamma = centre + half * F::of(x);
                    let d = kernel.unwrapped(scale, optics.exit_azimuth(p, gamma) - target);
                    visit(gamma, F::of(0.5 * w) * half * gamma.cos() * d);
                }
            }
            k += F::one();
        }
    }
}

#[inline]
fn gaussian<F: Real>(sigma: F, x: F) -> F {
    F::of(0.398_942_280_401_432_7) / sigma * (F::of(-0.5) * (x / sigma).sqr()).exp()
}

/// The `γ` in the monotone piece `[a, b]` where `Φ` is `target`, or the nearer end.
fn invert<F: Real>(optics: &Optics<F>, p: usize, a: F, b: F, at_a: F, at_b: F, target: F) -> F {
    let rising = at_b > at_a;
    let (low, high) = if rising { (at_a, at_b) } else { (at_b, at_a) };
    if target <= low {
        return if rising { a } else { b };
    }
    if target >= high {
        return if rising { b } else { a };
    }
    // Regula falsi with bisection every other step: robust at the turning points, where the slope is 0.
    let (mut lo, mut hi, mut f_lo, mut f_hi) = (a, b, at_a - target, at_b - target);
    for step in 0..40 {
        let x = if step % 2 == 0 { lo - f_lo * (hi - lo) / (f_hi - f_lo) } else { F::of(0.5) * (lo + hi) };
        let f = optics.exit_azimuth(p, x) - target;
        if (f > F::zero()) == (f_lo > F::zero()) {
            (lo, f_lo) = (x, f);
        } else {
            (hi, f_hi) = (x, f);
        }
        // A window's end need not be exact: the kernel is nothing there.
        if hi - lo < F::of(1e-5) {
            break;
        }
    }
    F::of(0.5) * (lo + hi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate;
    use crate::wrap_angle;

    #[test]
    fn densities_on_the_circle_integrate_to_one() {
        use std::f64::consts::PI;
        for s in [0.01, 0.1, 0.5, 1.0, 3.0, 10.0] {
            let parts = |f: &dyn Fn(f64) -> f64| {
                let edges = [-PI, -10.0 * s, -s, 0.0, s, 10.0 * s, PI];
                edges
                    .windows(2)
                    .map(|e| {
                        let (a, b) = (e[0].clamp(-PI, PI), e[1].clamp(-PI, PI));
                        if b > a { integrate(a, b, 256, f) } else { 0.0 }
                    })
                    .sum::<f64>()
            };
            assert!((parts(&|x| wrapped_gaussian(s, x)) - 1.0).abs() < 1e-10, "{s}");
            assert!((parts(&|x| trimmed_logistic(s, x)) - 1.0).abs() < 1e-10, "{s}");
        }
    }

    #[test]
    fn the_logistic_sampler_inverts_its_distribution() {
        for s in [0.02, 0.117, 0.6, 2.0] {
            for i in 1..200 {
                let xi = f64::from(i) / 200.0;
                let x = sample_trimmed_logistic(s, xi);
                let below =
                    integrate(-std::f64::consts::PI, x.min(-5.0 * s).max(-std::f64::consts::PI), 256, |t| {
                        trimmed_logistic(s, t)
                    }) + integrate(x.min(-5.0 * s).max(-std::f64::consts::PI), x, 256, |t| trimmed_logistic(s, t));
                assert!((below - xi).abs() < 1e-7, "s {s}, xi {xi}: {below}");
            }
        }
    }

    #[test]
    fn windows_agree_with_the_whole_cross_section() {
        // At 3 degrees both ways are accurate; the dense rule is the oracle.
        let beta = 3.0_f64.to_radians();
        let dense = crate::quadrature::gauss_legendre(2000);
        for cos2 in [1.0, 0.8, 0.3] {
            let optics = Optics::new(cos2, 1.55);
            for p in 0..3 {
                for i in 0..40 {
                    let phi = -3.1 + f64::from(i) * 0.155;
                    let mut got = 0.0;
                    windows(&optics, p, Kernel::Gaussian, beta, phi, |gamma, w| got += w * (1.0 + gamma.sin()));
                    let want: f64 = dense
                        .iter()
                        .map(|&(x, w)| {
                            let gamma = x * std::f64::consts::FRAC_PI_2;
                            let d = wrapped_gaussian(beta, wrap_angle(phi - optics.exit_azimuth(p, gamma)));
                            0.5 * w * std::f64::consts::FRAC_PI_2 * gamma.cos() * d * (1.0 + gamma.sin())
                        })
                        .sum();
                    assert!((got - want).abs() < 1e-6 + 1e-5 * want, "p {p}, phi {phi}: {got} and {want}");
                }
            }
        }
    }
}
