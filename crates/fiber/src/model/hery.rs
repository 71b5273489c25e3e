//! Hery & Ramamoorthi 2012: reflection lobes in the manner of Marschner et al. with importance sampling, one
//! or two.
//!
//! - Source: Hery & Ramamoorthi 2012, Algorithms 1 and 2, with their arctangent and logarithm arguments
//!   corrected; exact density of the folded sampler and the truncated form: this project.
//! - Field: far.
//! - Energy: the sum of the tints, in the [`Truncated`](HeryMode::Truncated) mode, but for what the floor of
//!   `cos θ_s` takes within 0.0001 radians of the poles (1e-4 of it at 85 degrees); the printed value of the
//!   paper integrates to less at grazing angles (0.84, 0.69, 0.60 of the tint for widths 5, 10, 19 degrees at
//!   80 degrees).
//!
//! | symbol | meaning |
//! |---|---|
//! | `θ_h` | half angle `(θ_k + θ_s)/2` |
//! | `M` | Gaussian in `θ_h - α` of standard deviation `β` |
//! | `N` | `cos(φ/2)` |

use math::{Real, Rgb};

use super::{DIMS, Lobes, MIN_PDF, Model, R, Sample, Scatter, TRT};
use crate::dir::cos2_half_difference;
use crate::lobe::azimuthal::standard_normal;
use crate::lobe::longitudinal::Truncated;
use crate::{Dir, Hit};

/// Which sampler, and what its density and the lobe's value are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HeryMode {
    /// A Gaussian truncated to the sphere: value, sampler and density agree exactly, and all of the tint
    /// comes back. The default.
    #[default]
    Truncated,
    /// The paper's: samples beyond the pole fold back, value and density are those of Algorithm 2. The
    /// sampler of one lobe returns its tint as the weight; light sampling returns less at grazing angles,
    /// so the two do not estimate the same integral there.
    Faithful,
    /// The paper's sampler and value, with the density that the sampler really has: unbiased for the
    /// printed value, also under multiple importance sampling.
    FaithfulExactPdf,
}

/// A lobe of [`Hery`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeryLobe<F = f32> {
    /// Colour `K_s`, `0..=1`. Black is no lobe, and costs nothing.
    pub tint: Rgb<F>,
    /// Longitudinal width `β`: standard deviation of `θ_h`, radians; the paper uses 1 to 19 degrees.
    pub beta: F,
    /// Shift `α` of the half angle, radians; negative moves the highlight to the root.
    pub alpha: F,
}

impl<F: Real> HeryLobe<F> {
    /// No lobe.
    pub fn none() -> Self {
        Self { tint: Rgb::black(), beta: F::of(5.0_f64.to_radians()), alpha: F::zero() }
    }
}

/// The highlights of Hery and Ramamoorthi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hery<F = f32> {
    /// The lobes: the first goes to lobe R, the second to lobe TRT, which it stands in for. Their tints
    /// conserve energy where they add up to at most 1.
    pub lobes: [HeryLobe<F>; 2],
    /// Sampler and density.
    pub mode: HeryMode,
    /// Multiplies the value by `(cos θ_s / cos θ_d)²`, as Marschner's model has it.
    pub cos_theta_d: bool,
}

impl<F: Real> Hery<F> {
    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> Hery<G> {
        let of = |x: F| G::of(x.f64());
        Hery {
            lobes: self.lobes.map(|lobe| HeryLobe {
                tint: lobe.tint.cast(),
                beta: of(lobe.beta),
                alpha: of(lobe.alpha),
            }),
            mode: self.mode,
            cos_theta_d: self.cos_theta_d,
        }
    }

    /// One lobe, in the default mode; for the parameters see [`HeryLobe`].
    pub fn single(tint: Rgb<F>, beta: F, alpha: F) -> Self {
        Self {
            lobes: [HeryLobe { tint, beta, alpha }, HeryLobe::none()],
            mode: HeryMode::Truncated,
            cos_theta_d: false,
        }
    }
}

/// [`Hery`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct HerySetup<F: Real = f32> {
    hit: Hit<F>,
    mode: HeryMode,
    cos_theta_d: bool,
    lobes: [LobeSetup<F>; 2],
}

/// A lobe at one shading point.
#[derive(Clone, Copy, Debug)]
struct LobeSetup<F: Real> {
    tint: Rgb<F>,
    beta: F,
    alpha: F,
    theta_k: F,
    truncated: Truncated<F>,
    /// The paper's `θ_max`.
    theta_max: F,
    /// Probability of drawing from it; 0 where there is no such lobe.
    share: F,
}

/// Floor of the cosine that the value and the density share, so that both stay finite at the poles.
const COS_FLOOR: f64 = 1e-4;

impl<F: Real> Model<F> for Hery<F> {
    type Setup = HerySetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> HerySetup<F> {
        let theta_k = hit.known.theta();
        let [first, second] = self.lobes.map(|lobe| lobe.tint.luminance());
        let total = first + second;
        let shares = if total > F::zero() { [first / total, second / total] } else { [F::one(), F::zero()] };
        let lobe = |i: usize| {
            let HeryLobe { tint, beta, alpha } = self.lobes[i];
            let beta = beta.max(F::of(3.5e-4));
            LobeSetup {
                tint,
                beta,
                alpha,
                theta_k,
                truncated: Truncated::new(F::of(2.0) * alpha - theta_k, beta),
                theta_max: F::half_pi() - (F::of(0.5) * theta_k - alpha).abs(),
                share: shares[i],
            }
        };
        // The truncated Gaussian costs two error functions: a second lobe that is not there does without.
        let first = lobe(0);
        let second = if shares[1] > F::zero() { lobe(1) } else { LobeSetup { share: F::zero(), ..first } };
        HerySetup { hit: *hit, mode: self.mode, cos_theta_d: self.cos_theta_d, lobes: [first, second] }
    }
}

impl<F: Real> LobeSetup<F> {
    /// `g(β, x)`: unit-area Gaussian.
    #[inline]
    fn gaussian(&self, x: F) -> F {
        F::of(0.398_942_280_401_432_7) / self.beta * (F::of(-0.5) * (x / self.beta).sqr()).exp()
    }

    /// Density in `θ_s` as Algorithm 2 prints it.
    #[inline]
    fn printed(&self, theta_s: F) -> F {
        F::of(0.5) * self.gaussian(F::of(0.5) * (theta_s + self.theta_k) - self.alpha)
    }

    /// Density in `θ_s` that Algorithm 1 has, without the atoms of its clamp.
    #[inline]
    fn folded(&self, theta_s: F) -> F {
        let centre = F::of(2.0) * self.alpha - self.theta_k;
        let branch = |theta: F| {
            let x = F::of(0.5) * (theta - centre);
            if x.abs() <= self.theta_max { self.gaussian(x) } else { F::zero() }
        };
        let fold = theta_s.signum() * F::PI() - theta_s;
        F::of(0.5) * (branch(theta_s) + branch(fold))
    }

    /// What the value is made of, in `θ_s`.
    #[inline]
    fn value(&self, mode: HeryMode, theta_s: F) -> F {
        match mode {
            HeryMode::Truncated => self.truncated.density(theta_s),
            HeryMode::Faithful => self.printed(theta_s),
            // Where the sampler cannot go the value is cut too, so that the two stay one integral.
            HeryMode::FaithfulExactPdf if self.folded(theta_s) <= F::zero() => F::zero(),
            HeryMode::FaithfulExactPdf => self.printed(theta_s),
        }
    }

    /// What the sampler is said to have, in `θ_s`.
    #[inline]
    fn density(&self, mode: HeryMode, theta_s: F) -> F {
        match mode {
            HeryMode::Truncated => self.truncated.density(theta_s),
            HeryMode::Faithful => self.printed(theta_s),
            HeryMode::FaithfulExactPdf => self.folded(theta_s),
        }
    }

    /// Draws `θ_s`.
    #[inline]
    fn sample(&self, mode: HeryMode, xi: F) -> Option<F> {
        if mode == HeryMode::Truncated {
            return Some(self.truncated.sample(xi));
        }
        let sigma = self.beta * standard_normal(xi);
        // What the clamp catches is an atom: no density describes it. It is lost (in the exact
        // mode) or kept as the paper has it.
        let clamped = sigma.clamp_to(-self.theta_max, self.theta_max);
        if mode == HeryMode::FaithfulExactPdf && clamped != sigma {
            return None;
        }
        let theta = F::of(2.0) * (clamped + self.alpha) - self.theta_k;
        Some(if theta.abs() > F::half_pi() { theta.signum() * (F::PI() - theta.abs()) } else { theta })
    }
}

impl<F: Real> HerySetup<F> {
    /// `cos(φ/2) / (4 cos θ_s)`: the azimuthal density over the spherical Jacobian.
    #[inline]
    fn azimuthal(&self, s: Dir<F>) -> F {
        let half = (F::of(0.5) * self.hit.azimuth(s)).cos().max(F::zero());
        half / (F::of(4.0) * s.cos_theta.max(F::of(COS_FLOOR)))
    }

    /// The `cos θ_d` variant's factor.
    #[inline]
    fn ratio(&self, s: Dir<F>) -> F {
        if !self.cos_theta_d {
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
        let (azimuthal, ratio) = (self.azimuthal(s), self.ratio(s));
        let mut lobes = Lobes::zero();
        for (lobe, index) in self.lobes.iter().zip([R, TRT]) {
            if lobe.share > F::zero() {
                lobes[index] = lobe.tint * (lobe.value(self.mode, theta) * azimuthal * ratio);
            }
        }
        lobes
    }

    fn pdf(&self, s: Dir<F>) -> F {
        let theta = s.theta();
        let mut m = F::zero();
        for lobe in &self.lobes {
            if lobe.share > F::zero() {
                m += lobe.share * lobe.density(self.mode, theta);
            }
        }
        m * self.azimuthal(s)
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let [first, second] = &self.lobes;
        let alone = second.share.is_zero();
        let drawn = usize::from(!alone && u[2] >= first.share);
        // N = cos(φ/2) has the distribution function (1 + sin(φ/2))/2.
        let phi = F::of(2.0) * (F::of(2.0) * u[1] - F::one()).safe_asin();
        let dir = Dir::new(self.lobes[drawn].sample(self.mode, u[0])?, self.hit.known.phi + phi);
        let pdf = self.pdf(dir);
        if !(pdf > F::of(MIN_PDF)) || !pdf.is_finite() {
            return None;
        }
        let weight = if alone && self.mode != HeryMode::FaithfulExactPdf {
            // Value and density of a single lobe have the same factors: only these are left.
            Lobes::only(R, first.tint * self.ratio(dir))
        } else {
            self.eval(dir).scaled(pdf.recip())
        };
        weight.sum().is_finite().then_some(Sample { dir, weight, pdf: Some(pdf), lobe: [R, TRT][drawn] })
    }
}
