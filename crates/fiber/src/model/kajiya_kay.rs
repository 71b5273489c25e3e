//! Kajiya & Kay 1989: a diffuse cylinder with Phong-like cones of reflection, one or two.
//!
//! - Source: Kajiya & Kay 1989 as given by Hunz 2016, eqs. 28-31; the two shifted highlights: Scheuermann
//!   2004; normalisation and sampler: this project.
//! - Field: far.
//! - Energy: [`Normalised`](KajiyaKayMode::Normalised): the diffuse part returns exactly `diffuse`, a
//!   highlight its `color` seen along its shifted normal plane (`θ_k = 2α`) and less at an angle.
//!   [`Thesis`](KajiyaKayMode::Thesis): nothing is conserved; it is the legacy look.
//! - Reciprocal when normalised, shifts included.
//!
//! | symbol | meaning |
//! |---|---|
//! | `m`, `α` | exponent and shift of a highlight |
//! | `c` | `2α - θ_k`, where the highlight lies in `θ_s` |
//! | `c_m` | `Γ(m/2+1) / (√π Γ((m+1)/2))`, norm of `cos^m` on a half turn |
//! | `C_m` | `2 π^{3/2} Γ((m+3)/2) / Γ((m+4)/2)`, norm of the normalised lobe |

use math::{Real, Rgb};

use super::{DIMS, Lobes, Model, R, RESIDUAL, Sample, Scatter, TRT, finish};
use crate::{Dir, Hit};

/// Which of the two forms of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KajiyaKayMode {
    /// Energy-conserving and reciprocal where `diffuse` and the colours of the highlights add up to at most 1.
    #[default]
    Normalised,
    /// As in the thesis and in games: `fcos = K_d cos θ_i + Σ K_s max(0, cos(θ_i + θ_o - 2α))^m`.
    Thesis,
}

/// A highlight of [`KajiyaKay`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Highlight<F = f32> {
    /// Specular colour `K_s`, `0..=1` when normalised. Black is no highlight, and costs nothing.
    pub color: Rgb<F>,
    /// Exponent `m >= 0`; 10 soft, 25 default, 50 hard.
    pub exponent: F,
    /// Shift `α` of the tangent, radians, within `±π/4`: the highlight lies at `-θ_k + 2α`, so negative moves
    /// it to the root.
    pub shift: F,
}

impl<F: Real> Highlight<F> {
    /// No highlight.
    pub fn none() -> Self {
        Self { color: Rgb::black(), exponent: F::of(25.0), shift: F::zero() }
    }
}

/// The model of Kajiya and Kay, with the two highlights of Scheuermann.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KajiyaKay<F = f32> {
    /// Diffuse colour `K_d`, `0..=1`; goes to the residual lobe.
    pub diffuse: Rgb<F>,
    /// The highlights: the first goes to lobe R, the second to lobe TRT, which it stands in for.
    pub highlights: [Highlight<F>; 2],
    /// Thesis or normalised.
    pub mode: KajiyaKayMode,
}

impl<F: Real> KajiyaKay<F> {
    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> KajiyaKay<G> {
        let of = |x: F| G::of(x.f64());
        KajiyaKay {
            diffuse: self.diffuse.cast(),
            highlights: self.highlights.map(|highlight| Highlight {
                color: highlight.color.cast(),
                exponent: of(highlight.exponent),
                shift: of(highlight.shift),
            }),
            mode: self.mode,
        }
    }

    /// The model of 1989: one highlight, where the mirror would have it.
    pub fn single(diffuse: Rgb<F>, specular: Rgb<F>, exponent: F, mode: KajiyaKayMode) -> Self {
        let first = Highlight { color: specular, exponent, shift: F::zero() };
        Self { diffuse, highlights: [first, Highlight::none()], mode }
    }
}

/// [`KajiyaKay`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct KajiyaKaySetup<F: Real = f32> {
    diffuse: Rgb<F>,
    mode: KajiyaKayMode,
    hit: Hit<F>,
    cones: [Cone<F>; 2],
    /// Probability of drawing from the diffuse part.
    diffuse_share: F,
}

/// A highlight at one shading point.
#[derive(Clone, Copy, Debug)]
struct Cone<F: Real> {
    color: Rgb<F>,
    exponent: F,
    /// Where it lies in `θ_s`; may be beyond a pole.
    centre: F,
    /// `c_m`.
    c_m: F,
    /// Factor of `cos^m` in `fcos` (times `cos θ_s` when normalised).
    scale: F,
    /// Probability of drawing from it.
    share: F,
}

/// `Γ((m+a)/2) / Γ((m+b)/2)` without overflow.
fn gamma_ratio(m: f64, a: f64, b: f64) -> f64 {
    (ln_gamma((m + a) / 2.0) - ln_gamma((m + b) / 2.0)).exp()
}

/// `ln Γ(x)` for `x > 0`: Stirling's series after shifting the argument beyond 15; error below 1e-15.
fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 15.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let x2 = 1.0 / (x * x);
    let tail = 1.0 / (12.0 * x) * (1.0 - x2 * (1.0 / 30.0 - x2 * (1.0 / 105.0 - x2 * (1.0 / 140.0 - x2 / 99.0))));
    shift + (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + tail
}

impl<F: Real> Model<F> for KajiyaKay<F> {
    type Setup = KajiyaKaySetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> KajiyaKaySetup<F> {
        let theta_k = hit.known.theta();
        // Shares in proportion to what the parts return, seen straight on.
        let diffuse = self.diffuse.luminance()
            * match self.mode {
                KajiyaKayMode::Normalised => F::one(),
                KajiyaKayMode::Thesis => F::of(std::f64::consts::PI.powi(2)),
            };
        let mut total = diffuse;
        let mut cones = self.highlights.map(|highlight| {
            if highlight.color.is_black() {
                return Cone::none();
            }
            let m = highlight.exponent.f64();
            let c_m = gamma_ratio(m, 2.0, 1.0) / std::f64::consts::PI.sqrt();
            let (scale, energy) = match self.mode {
                // 1/C_m, by the recurrence of the Γ function.
                KajiyaKayMode::Normalised => (c_m / std::f64::consts::TAU * (m + 2.0) / (m + 1.0), 1.0),
                KajiyaKayMode::Thesis => (1.0, std::f64::consts::TAU / c_m),
            };
            let share = highlight.color.luminance() * F::of(energy);
            total += share;
            // Up to a quarter turn, twice the shift still leaves one fold over a pole.
            let shift = highlight.shift.clamp_to(-F::FRAC_PI_4(), F::FRAC_PI_4());
            Cone {
                color: highlight.color,
                exponent: highlight.exponent,
                centre: F::of(2.0) * shift - theta_k,
                c_m: F::of(c_m),
                scale: F::of(scale),
                share,
            }
        });
        for cone in &mut cones {
            cone.share = if total > F::zero() { cone.share / total } else { F::zero() };
        }
        let diffuse_share = if total > F::zero() { diffuse / total } else { F::one() };
        KajiyaKaySetup { diffuse: self.diffuse, mode: self.mode, hit: *hit, cones, diffuse_share }
    }
}

impl<F: Real> Cone<F> {
    fn none() -> Self {
        let zero = F::zero();
        Self { color: Rgb::black(), exponent: F::one(), centre: zero, c_m: zero, scale: zero, share: zero }
    }

    /// `max(0, cos(θ - c))^m`.
    #[inline]
    fn value(&self, theta: F) -> F {
        let delta = theta - self.centre;
        if delta.abs() < F::half_pi() { delta.cos().max(F::zero()).powf(self.exponent) } else { F::zero() }
    }

    /// Density in `θ_s`: what was drawn there, and what was folded there over either pole.
    #[inline]
    fn density(&self, theta: F) -> F {
        self.c_m * (self.value(theta) + self.value(F::PI() - theta) + self.value(-F::PI() - theta))
    }
}

impl<F: Real> KajiyaKaySetup<F> {
    /// What is drawn beyond a right angle comes back on the other side.
    #[inline]
    fn fold(theta: F) -> F {
        theta.signum() * F::PI() - theta
    }

    /// Student-t by Bailey's polar method turned into an angle with density `c_m cos^m`.
    #[inline]
    fn sample_cone(exponent: F, a: F, b: F) -> F {
        let a = a.max(F::of(1e-30));
        let radius = (a.powf(F::of(-2.0) / (exponent + F::one())) - F::one()).safe_sqrt();
        (radius * (F::TAU() * b).cos()).atan()
    }
}

impl<F: Real> Scatter<F> for KajiyaKaySetup<F> {
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        let theta = s.theta();
        let (diffuse, cosine) = match self.mode {
            KajiyaKayMode::Normalised => (s.cos_theta / F::PI().sqr(), s.cos_theta),
            KajiyaKayMode::Thesis => (s.cos_theta, F::one()),
        };
        let mut lobes = Lobes::only(RESIDUAL, self.diffuse * diffuse);
        for (cone, lobe) in self.cones.iter().zip([R, TRT]) {
            if cone.share > F::zero() {
                lobes[lobe] = cone.color * (cone.scale * cone.value(theta) * cosine);
            }
        }
        lobes
    }

    fn pdf(&self, s: Dir<F>) -> F {
        let theta = s.theta();
        let mut specular = F::zero();
        for cone in &self.cones {
            if cone.share > F::zero() {
                specular += cone.share * cone.density(theta);
            }
        }
        self.diffuse_share * s.cos_theta / F::PI().sqr() + specular / (F::TAU() * s.cos_theta.max(F::of(1e-6)))
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let [first, second] = &self.cones;
        let phi = self.hit.known.phi + F::TAU() * u[3];
        let (theta, lobe) = if u[0] < self.diffuse_share {
            // The density (2/π) cos² θ is the cone's with exponent 2, centred on the normal plane.
            (Self::sample_cone(F::of(2.0), u[1], u[2]), RESIDUAL)
        } else {
            // A highlight that is not there must not be drawn because shares were rounded.
            let past_first = u[0] >= self.diffuse_share + first.share || first.share.is_zero();
            let (cone, lobe) = if past_first && second.share > F::zero() { (second, TRT) } else { (first, R) };
            (Self::sample_cone(cone.exponent, u[1], u[2]) + cone.centre, lobe)
        };
        let theta = if theta.abs() > F::half_pi() { Self::fold(theta) } else { theta };
        let dir = Dir::new(theta, phi);
        if dir.cos_theta < F::of(1e-6) {
            return None;
        }
        finish(dir, self.eval(dir), self.pdf(dir), lobe)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gamma_function_is_right() {
        let factorial: f64 = (1..=20).map(f64::from).product();
        assert!((ln_gamma(21.0) - factorial.ln()).abs() < 1e-12);
        assert!((ln_gamma(0.5) - std::f64::consts::PI.sqrt().ln()).abs() < 1e-13);
        assert!(ln_gamma(1.0).abs() < 1e-13 && ln_gamma(2.0).abs() < 1e-13);
    }
}
