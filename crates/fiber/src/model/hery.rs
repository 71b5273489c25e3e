//! Hery & Ramamoorthi 2012: the R lobe of Marschner et al. with importance sampling.
//!
//! - Source: Hery & Ramamoorthi 2012, Algorithms 1 and 2, with their arctangent and logarithm arguments
//!   corrected; exact density of the folded sampler and the truncated form: this project.
//! - Field: far.
//! - Energy: `tint`, in the [`Truncated`](HeryMode::Truncated) mode, but for what the floor of `cos θ_s` takes
//!   within 0.0001 radians of the poles (1e-4 of it at 85 degrees); the printed value of the
//!   paper integrates to less at grazing angles (0.84, 0.69, 0.60 of `tint` for widths 5, 10, 19 degrees
//!   at 80 degrees).
//!
//! | symbol | meaning |
//! |---|---|
//! | `θ_h` | half angle `(θ_k + θ_s)/2` |
//! | `M` | Gaussian in `θ_h - α` of standard deviation `β` |
//! | `N` | `cos(φ/2)` |

use math::{Real, Rgb};

use super::{DIMS, Lobes, MIN_PDF, Model, R, Sample, Scatter};
use crate::dir::cos2_half_difference;
use crate::lobe::azimuthal::standard_normal;
use crate::lobe::longitudinal::Truncated;
use crate::{Dir, Hit};

/// Which sampler, and what its density and the lobe's value are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HeryMode {
    /// A Gaussian truncated to the sphere: value, sampler and density agree exactly, and all of `tint`
    /// comes back. The default.
    #[default]
    Truncated,
    /// The paper's: samples beyond the pole fold back, value and density are those of Algorithm 2. The
    /// sampler returns `tint` as its weight; light sampling returns less at grazing angles, so the two
    /// do not estimate the same integral there.
    Faithful,
    /// The paper's sampler and value, with the density that the sampler really has: unbiased for the
    /// printed value, also under multiple importance sampling.
    FaithfulExactPdf,
}

/// The R lobe of Hery and Ramamoorthi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hery<F = f32> {
    /// Colour `K_s`, `0..=1`.
    pub tint: Rgb<F>,
    /// Longitudinal width `β`: standard deviation of `θ_h`, radians; the paper uses 1 to 19 degrees.
    pub beta: F,
    /// Shift `α` of the half angle, radians; negative moves the highlight to the root.
    pub alpha: F,
    /// Sampler and density.
    pub mode: HeryMode,
    /// Multiplies the value by `(cos θ_s / cos θ_d)²`, as Marschner's model has it.
    pub cos_theta_d: bool,
}

/// [`Hery`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct HerySetup<F: Real = f32> {
    model: Hery<F>,
    hit: Hit<F>,
    theta_k: F,
    truncated: Truncated<F>,
    /// The paper's `θ_max`.
    theta_max: F,
}

/// Floor of the cosine that the value and the density share, so that both stay finite at the poles.
const COS_FLOOR: f64 = 1e-4;

impl<F: Real> Model<F> for Hery<F> {
    type Setup = HerySetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> HerySetup<F> {
        let beta = self.beta.max(F::of(3.5e-4));
        let model = Self { beta, ..*self };
        let theta_k = hit.known.theta();
        HerySetup {
            model,
            hit: *hit,
            theta_k,
            truncated: Truncated::new(F::of(2.0) * self.alpha - theta_k, beta),
            theta_max: F::half_pi() - (F::of(0.5) * theta_k - self.alpha).abs(),
        }
    }
}

impl<F: Real> HerySetup<F> {
    /// `g(β, x)`: unit-area Gaussian.
    #[inline]
    fn gaussian(&self, x: F) -> F {
        F::of(0.398_942_280_401_432_7) / self.model.beta * (F::of(-0.5) * (x / self.model.beta).sqr()).exp()
    }

    /// `cos(φ/2) / (4 cos θ_s)`: the azimuthal density over the spherical Jacobian.
    #[inline]
    fn azimuthal(&self, s: Dir<F>) -> F {
        let half = (F::of(0.5) * self.hit.azimuth(s)).cos().max(F::zero());
        half / (F::of(4.0) * s.cos_theta.max(F::of(COS_FLOOR)))
    }

    /// Density in `θ_s` as Algorithm 2 prints it.
    #[inline]
    fn printed(&self, theta_s: F) -> F {
        F::of(0.5) * self.gaussian(F::of(0.5) * (theta_s + self.theta_k) - self.model.alpha)
    }

    /// Density in `θ_s` that Algorithm 1 has, without the atoms of its clamp.
    #[inline]
    fn folded(&self, theta_s: F) -> F {
        let centre = F::of(2.0) * self.model.alpha - self.theta_k;
        let branch = |theta: F| {
            let x = F::of(0.5) * (theta - centre);
            if x.abs() <= self.theta_max { self.gaussian(x) } else { F::zero() }
        };
        let fold = theta_s.signum() * F::PI() - theta_s;
        F::of(0.5) * (branch(theta_s) + branch(fold))
    }

    /// The `cos θ_d` variant's factor.
    #[inline]
    fn ratio(&self, s: Dir<F>) -> F {
        if !self.model.cos_theta_d {
            return F::one();
        }
        let k = self.hit.known;
        let cos2_d = cos2_half_difference(k.sin_theta, k.cos_theta, s.sin_theta, s.cos_theta);
        s.cos_theta.sqr() / cos2_d.max(F::of(1e-10))
    }
}

impl<F: Real> Scatter<F> for HerySetup<F> {
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        let theta = s.theta();
        let m = match self.model.mode {
            HeryMode::Truncated => self.truncated.density(theta),
            HeryMode::Faithful => self.printed(theta),
            // Where the sampler cannot go the value is cut too, so that the two stay one integral.
            HeryMode::FaithfulExactPdf if self.folded(theta) <= F::zero() => F::zero(),
            HeryMode::FaithfulExactPdf => self.printed(theta),
        };
        Lobes::only(R, self.model.tint * (m * self.azimuthal(s) * self.ratio(s)))
    }

    fn pdf(&self, s: Dir<F>) -> F {
        let theta = s.theta();
        let m = match self.model.mode {
            HeryMode::Truncated => self.truncated.density(theta),
            HeryMode::Faithful => self.printed(theta),
            HeryMode::FaithfulExactPdf => self.folded(theta),
        };
        m * self.azimuthal(s)
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        // N = cos(φ/2) has the distribution function (1 + sin(φ/2))/2.
        let phi = F::of(2.0) * (F::of(2.0) * u[1] - F::one()).safe_asin();
        let theta = if self.model.mode == HeryMode::Truncated {
            self.truncated.sample(u[0])
        } else {
            let sigma = self.model.beta * standard_normal(u[0]);
            // What the clamp catches is an atom: no density describes it. It is lost (in the exact
            // mode) or kept as the paper has it.
            let clamped = sigma.clamp_to(-self.theta_max, self.theta_max);
            if self.model.mode == HeryMode::FaithfulExactPdf && clamped != sigma {
                return None;
            }
            let theta = F::of(2.0) * (clamped + self.model.alpha) - self.theta_k;
            if theta.abs() > F::half_pi() { theta.signum() * (F::PI() - theta.abs()) } else { theta }
        };
        let dir = Dir::new(theta, self.hit.known.phi + phi);
        let pdf = self.pdf(dir);
        if !(pdf > F::of(MIN_PDF)) || !pdf.is_finite() {
            return None;
        }
        let weight = if self.model.mode == HeryMode::FaithfulExactPdf {
            self.eval(dir).scaled(pdf.recip())
        } else {
            Lobes::only(R, self.model.tint * self.ratio(dir))
        };
        Some(Sample { dir, weight, pdf: Some(pdf), lobe: R })
    }
}
