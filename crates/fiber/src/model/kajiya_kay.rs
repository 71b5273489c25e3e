//! Kajiya & Kay 1989: a diffuse cylinder with a Phong-like cone of reflection.
//!
//! - Source: Kajiya & Kay 1989 as given by Hunz 2016, eqs. 28-31; normalisation and sampler: this project.
//! - Field: far.
//! - Energy: [`Normalised`](KajiyaKayMode::Normalised): the diffuse part returns exactly `diffuse`, the
//!   specular part `specular` seen straight on and less at an angle. [`Thesis`](KajiyaKayMode::Thesis):
//!   nothing is conserved; it is the legacy look.
//! - Reciprocal when normalised.
//!
//! | symbol | meaning |
//! |---|---|
//! | `m` | exponent |
//! | `c_m` | `Γ(m/2+1) / (√π Γ((m+1)/2))`, norm of `cos^m` on a half turn |
//! | `C_m` | `2 π^{3/2} Γ((m+3)/2) / Γ((m+4)/2)`, norm of the normalised lobe |

use math::{Real, Rgb};

use super::{DIMS, Lobes, Model, R, RESIDUAL, Sample, Scatter, finish};
use crate::{Dir, Hit};

/// Which of the two forms of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KajiyaKayMode {
    /// Energy-conserving and reciprocal for `diffuse + specular <= 1`.
    #[default]
    Normalised,
    /// As in the thesis and in games: `fcos = K_d cos θ_i + K_s max(0, cos(θ_i + θ_o))^m`.
    Thesis,
}

/// The model of Kajiya and Kay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KajiyaKay<F = f32> {
    /// Diffuse colour `K_d`, `0..=1`; goes to the residual lobe.
    pub diffuse: Rgb<F>,
    /// Specular colour `K_s`, `0..=1` when normalised; goes to lobe R.
    pub specular: Rgb<F>,
    /// Exponent `m >= 0`; 10 soft, 25 default, 50 hard.
    pub exponent: F,
    /// Thesis or normalised.
    pub mode: KajiyaKayMode,
}

/// [`KajiyaKay`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct KajiyaKaySetup<F: Real = f32> {
    model: KajiyaKay<F>,
    hit: Hit<F>,
    theta_k: F,
    /// `c_m` of the specular exponent.
    c_m: F,
    /// Factor of `cos^m` in the specular `fcos` (times `cos θ_s` when normalised).
    specular_scale: F,
    /// Probability of drawing from the diffuse part.
    diffuse_share: F,
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
        let m = self.exponent.f64();
        let c_m = gamma_ratio(m, 2.0, 1.0) / std::f64::consts::PI.sqrt();
        let (specular_scale, diffuse_energy, specular_energy) = match self.mode {
            KajiyaKayMode::Normalised => (gamma_ratio(m, 4.0, 3.0) / (2.0 * std::f64::consts::PI.powf(1.5)), 1.0, 1.0),
            KajiyaKayMode::Thesis => (1.0, std::f64::consts::PI.powi(2), std::f64::consts::TAU / c_m),
        };
        let d = self.diffuse.luminance() * F::of(diffuse_energy);
        let s = self.specular.luminance() * F::of(specular_energy);
        let total = d + s;
        KajiyaKaySetup {
            model: *self,
            hit: *hit,
            theta_k: hit.known.theta(),
            c_m: F::of(c_m),
            specular_scale: F::of(specular_scale),
            diffuse_share: if total > F::zero() { d / total } else { F::one() },
        }
    }
}

impl<F: Real> KajiyaKaySetup<F> {
    /// Unfolded and folded inclination: what is drawn beyond a right angle comes back on the other side.
    #[inline]
    fn fold(theta: F) -> F {
        theta.signum() * F::PI() - theta
    }

    /// `max(0, cos(θ + θ_k))^m`.
    #[inline]
    fn cone(&self, theta: F) -> F {
        let delta = theta + self.theta_k;
        if delta.abs() < F::half_pi() { delta.cos().max(F::zero()).powf(self.model.exponent) } else { F::zero() }
    }

    #[inline]
    fn specular_pdf(&self, s: Dir<F>, theta: F) -> F {
        let both = self.cone(theta) + self.cone(Self::fold(theta));
        self.c_m / (F::TAU() * s.cos_theta.max(F::of(1e-6))) * both
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
        let cone = self.cone(s.theta());
        let (d, c) = match self.model.mode {
            KajiyaKayMode::Normalised => (s.cos_theta / F::PI().sqr(), self.specular_scale * cone * s.cos_theta),
            KajiyaKayMode::Thesis => (s.cos_theta, self.specular_scale * cone),
        };
        let mut lobes = Lobes::only(RESIDUAL, self.model.diffuse * d);
        lobes[R] = self.model.specular * c;
        lobes
    }

    fn pdf(&self, s: Dir<F>) -> F {
        let diffuse = s.cos_theta / F::PI().sqr();
        let q = self.diffuse_share;
        let specular = if q < F::one() { self.specular_pdf(s, s.theta()) } else { F::zero() };
        q * diffuse + (F::one() - q) * specular
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let diffuse = u[0] < self.diffuse_share;
        let phi = self.hit.known.phi + F::TAU() * u[3];
        let (theta, lobe) = if diffuse {
            // The density (2/π) cos² θ is the cone's with exponent 2, centred on the normal plane.
            (Self::sample_cone(F::of(2.0), u[1], u[2]), RESIDUAL)
        } else {
            (Self::sample_cone(self.model.exponent, u[1], u[2]) - self.theta_k, R)
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
