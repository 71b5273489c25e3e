//! Chiang et al. 2016: the near-field model of pbrt-v4, Mitsuba 3 and Cycles' principled hair.
//!
//! - Source: Chiang, Bitterli, Tappan, Burley 2016, section 4, on the lobes of d'Eon et al. 2011.
//! - Field: near; the offset `h` comes from the hit.
//! - Energy: exactly 1 for every direction, offset, roughness and tilt where nothing is absorbed.
//! - Not reciprocal: all optics are taken at `θ_k`.
//!
//! | symbol | meaning |
//! |---|---|
//! | `v_p` | longitudinal variance of lobe `p`, from `beta_m` |
//! | `s` | scale of the trimmed logistic, from `beta_n` |
//! | `A_p` | attenuation of lobe `p` at `(θ_k, h)` |
//! | `q_p` | probability of lobe `p`, its share of the luminance |

use math::{Real, Rgb};

use super::{DIMS, Lobes, Model, RESIDUAL, Sample, Scatter, finish};
use crate::lobe::attenuation::{Optics, Path};
use crate::lobe::azimuthal::{sample_trimmed_logistic, trimmed_logistic};
use crate::lobe::longitudinal::{self, Cone, MIN_VARIANCE};
use crate::wrap_angle;
use crate::{Dir, Hit};

/// The model of Chiang et al.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chiang<F = f32> {
    /// Longitudinal roughness in `(0, 1]`, perceptually even; 0.3 is hair.
    pub beta_m: F,
    /// Azimuthal roughness in `(0, 1]`, perceptually even; 0.3 is hair.
    pub beta_n: F,
    /// Tilt of the cuticle scales, radians, d'Eon's sign (pbrt's too; Cycles has the opposite one).
    pub alpha: F,
    /// Index of refraction relative to the outside; 1.55 for keratin in air.
    pub eta: F,
    /// Absorption per fiber radius.
    pub sigma_a: Rgb<F>,
}

impl<F: Real> Chiang<F> {
    /// Hair with this absorption and everything else at its default: both roughnesses 0.3, scales
    /// leaning 2 degrees to the root.
    pub fn with_absorption(sigma_a: Rgb<F>) -> Self {
        Self { beta_m: F::of(0.3), beta_n: F::of(0.3), alpha: F::of(-2.0_f64.to_radians()), eta: F::of(1.55), sigma_a }
    }

    /// Longitudinal variances of R, TT, TRT and the residual lobe, rad².
    pub fn variances(&self) -> [F; 4] {
        let b = self.beta_m;
        let w = F::of(0.726) * b + F::of(0.812) * b * b + F::of(3.7) * b.powi(20);
        let v = (w * w).max(F::of(MIN_VARIANCE));
        let quarter = (F::of(0.25) * v).max(F::of(MIN_VARIANCE));
        [v, quarter, F::of(4.0) * v, F::of(4.0) * v]
    }

    /// Scale of the azimuthal logistic, radians.
    pub fn azimuthal_scale(&self) -> F {
        let b = self.beta_n;
        let s = F::of(0.265) * b + F::of(1.194) * b * b + F::of(5.372) * b.powi(22);
        (F::of(0.626_657_068_657_750_1) * s).max(F::of(1e-4))
    }
}

/// [`Chiang`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct ChiangSetup<F: Real = f32> {
    hit: Hit<F>,
    v: [F; 4],
    s: F,
    cones: [Cone<F>; 4],
    /// Exit azimuths of R, TT, TRT, absolute.
    exits: [F; 3],
    a: [Rgb<F>; 4],
    q: [F; 4],
}

impl<F: Real> Model<F> for Chiang<F> {
    type Setup = ChiangSetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> ChiangSetup<F> {
        let k = hit.known;
        let path: Path<F> = Optics::new(k.cos_theta.sqr(), self.eta).path_at(hit.h);
        let a = path.attenuation(self.sigma_a);
        let lum = a.map(Rgb::luminance);
        let total: F = lum.iter().copied().sum();
        let shift = |times: f64| Cone::specular(k.sin_theta, k.cos_theta, F::of(times) * self.alpha);
        ChiangSetup {
            hit: *hit,
            v: self.variances(),
            s: self.azimuthal_scale(),
            cones: [shift(2.0), shift(-1.0), shift(-4.0), shift(0.0)],
            exits: [0, 1, 2].map(|p| k.phi + path.exit_azimuth(p)),
            a,
            q: lum.map(|l| l / total),
        }
    }
}

impl<F: Real> ChiangSetup<F> {
    /// `L_p N_p` of every lobe, without attenuation.
    #[inline]
    fn shapes(&self, s: Dir<F>) -> [F; 4] {
        let l = |p: usize| longitudinal::density(self.v[p], self.cones[p], s.sin_theta, s.cos_theta);
        let n = |p: usize| trimmed_logistic(self.s, wrap_angle(s.phi - self.exits[p]));
        [l(0) * n(0), l(1) * n(1), l(2) * n(2), l(3) / F::TAU()]
    }
}

impl<F: Real> Scatter<F> for ChiangSetup<F> {
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        self.eval_pdf(s).0
    }

    fn pdf(&self, s: Dir<F>) -> F {
        let shapes = self.shapes(s);
        (0..4).map(|p| self.q[p] * shapes[p]).sum()
    }

    fn eval_pdf(&self, s: Dir<F>) -> (Lobes<F>, F) {
        let shapes = self.shapes(s);
        let mut fcos = Lobes::zero();
        let mut pdf = F::zero();
        for p in 0..4 {
            fcos[p] = self.a[p] * shapes[p];
            pdf += self.q[p] * shapes[p];
        }
        (fcos, pdf)
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let (p, xi) = pick(&self.q, u[0]);
        let sin_s = longitudinal::sample(self.v[p], self.cones[p], u[1], u[2]);
        let phi = if p == RESIDUAL {
            self.hit.known.phi + F::TAU() * xi
        } else {
            self.exits[p] + sample_trimmed_logistic(self.s, xi)
        };
        let dir = Dir::from_sin(sin_s, phi);
        let (fcos, pdf) = self.eval_pdf(dir);
        finish(dir, fcos, pdf, p)
    }
}

/// Picks an index with the given probabilities; returns `xi` rescaled to be uniform again.
#[inline]
pub(crate) fn pick<F: Real>(q: &[F; 4], xi: F) -> (usize, F) {
    let mut below = F::zero();
    for (p, &share) in q.iter().enumerate() {
        if xi < below + share {
            let again = (xi - below) / share;
            return (p, again.clamp_to(F::zero(), F::ONE_MINUS_EPSILON));
        }
        below += share;
    }
    // Rounding left a sliver above the last share: it belongs to the last lobe that has any.
    let last = (0..4).rev().find(|&p| q[p] > F::zero()).unwrap_or(0);
    (last, F::ONE_MINUS_EPSILON)
}
