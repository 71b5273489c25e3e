//! Densities over the inclination of the scattered direction.
//!
//! [`Lobe`] is the energy-conserving longitudinal term of d'Eon et al. 2011: the specular cone,
//! blurred on the sphere by a spherical Gaussian. It is written as `L = M cos θ_s`, which is finite
//! everywhere and integrates to one with weight `cos θ_s dθ_s`.

use math::{Real, normal};

use super::bessel::i0e;

/// Below this variance (a width of 0.02 degrees) nothing changes in a picture and digits run out.
pub const MIN_VARIANCE: f64 = 1e-7;

/// Widths of R, TT, TRT and the residual lobe of d'Eon et al., from that of R; radians.
#[inline]
pub(crate) fn deon_widths<F: Real>(beta: F) -> [F; 4] {
    let narrowest = F::of(MIN_VARIANCE.sqrt());
    [1.0, 0.5, 2.0, 2.0].map(|x| (F::of(x) * beta).max(narrowest))
}

/// Where a lobe is centred: sine and cosine of the cone's inclination, the cosine never negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone<F = f32> {
    /// Sine of the cone's inclination.
    pub sin: F,
    /// Cosine of the cone's inclination, folded to be non-negative.
    pub cos: F,
    /// The cosine before folding: negative where the tilt pushes the cone past the tangent.
    pub raw_cos: F,
}

impl<F: Real> Cone<F> {
    /// The specular cone of the known inclination, shifted by `shift` radians: `-θ_k + shift`.
    #[inline]
    pub fn specular(sin_k: F, cos_k: F, shift: F) -> Self {
        let (s, c) = if shift.is_zero() { (F::zero(), F::one()) } else { shift.sin_cos() };
        Self::turned(sin_k, cos_k, s, c)
    }

    /// [`specular`](Self::specular), from the sine and cosine of the shift.
    #[inline]
    pub fn turned(sin_k: F, cos_k: F, sin: F, cos: F) -> Self {
        let raw_cos = cos_k * cos + sin_k * sin;
        Self { sin: cos_k * sin - sin_k * cos, cos: raw_cos.abs(), raw_cos }
    }

    /// `cos²((θ_cone - θ_k)/2)` with the cone clamped into `±π/2`: the half difference angle of a path
    /// that leaves exactly along the cone.
    #[inline]
    pub fn cos2_half_difference(self, sin_k: F, cos_k: F) -> F {
        let (sin, cos) =
            if self.raw_cos < F::zero() { (self.sin.signum(), F::zero()) } else { (self.sin, self.raw_cos) };
        crate::dir::cos2_half_difference(sin_k, cos_k, sin, cos)
    }
}

/// The shifts of d'Eon et al. for a tilt of the scales: `2α`, `-α`, `-4α` for R, TT, TRT, none for the residual lobe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tilt<F>([[F; 2]; 4]);

impl<F: Real> Tilt<F> {
    #[inline]
    pub(crate) fn new(alpha: F) -> Self {
        // One sine and cosine: the other shifts are multiples.
        let (s1, c1) = if alpha.is_zero() { (F::zero(), F::one()) } else { alpha.sin_cos() };
        let (s2, c2) = (F::of(2.0) * s1 * c1, c1 * c1 - s1 * s1);
        let (s4, c4) = (F::of(2.0) * s2 * c2, c2 * c2 - s2 * s2);
        Self([[s2, c2], [-s1, c1], [-s4, c4], [F::zero(), F::one()]])
    }

    /// Where the lobes lie for a known inclination.
    #[inline]
    pub(crate) fn cones(&self, sin_k: F, cos_k: F) -> [Cone<F>; 4] {
        self.0.map(|[sin, cos]| Cone::turned(sin_k, cos_k, sin, cos))
    }
}

/// One longitudinal lobe: a cone with a variance, and what follows from it for every direction.
///
/// Source: d'Eon et al. 2011, eq. for M, multiplied by `cos θ_s` and rearranged so that no factor
/// overflows for any variance; sampling: d'Eon, Marschner, Hanika 2013, eqs. 6 and 7, in a form that keeps
/// its digits for small variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe<F = f32> {
    /// Where the lobe is centred.
    pub cone: Cone<F>,
    v: F,
    pub(crate) inv_v: F,
    /// `1 - e^{-2/v}`.
    mass: F,
    /// `1 / (v (1 - e^{-2/v}))`.
    pub(crate) norm: F,
}

impl<F: Real> Lobe<F> {
    /// A lobe of variance `v` in rad², at least [`MIN_VARIANCE`].
    #[inline]
    pub fn new(v: F, cone: Cone<F>) -> Self {
        let inv_v = v.recip();
        // Beyond this, e^{-2/v} is less than the last bit of 1.
        let mass = if inv_v > F::of(20.0) { F::one() } else { -(F::of(-2.0) * inv_v).exp_m1() };
        Self { cone, v, inv_v, mass, norm: inv_v / mass }
    }

    /// Density per unit of `cos θ_s dθ_s`.
    #[inline]
    pub fn density(&self, sin_s: F, cos_s: F) -> F {
        // 1 - cos(θ_c - θ_s) as a sum of squares: no cancellation near the cone.
        let q = F::of(0.5) * ((self.cone.cos - cos_s).sqr() + (self.cone.sin - sin_s).sqr());
        i0e(self.cone.cos * cos_s * self.inv_v) * (-q * self.inv_v).exp() * self.norm
    }

    /// Draws `sin θ_s` with [`density`](Self::density), exactly.
    #[inline]
    pub fn sample(&self, xi1: F, xi2: F) -> F {
        let xi1 = xi1.max(F::of(1.0 / 16_777_216.0));
        // 1 - u, kept apart: for small v, u rounds to 1 and the sine below would lose its digits.
        let one_minus_u = (-self.v * ((xi1 - F::one()) * self.mass).ln_1p()).clamp_to(F::zero(), F::of(2.0));
        let u = F::one() - one_minus_u;
        let sine = (one_minus_u * (F::of(2.0) - one_minus_u)).safe_sqrt();
        let s = u * self.cone.sin + sine * (F::TAU() * xi2).cos() * self.cone.cos;
        s.clamp_to(-F::one(), F::one())
    }
}

/// `L(v, θ_cone, θ_s)` for one direction: [`Lobe::density`].
#[inline]
pub fn density<F: Real>(v: F, cone: Cone<F>, sin_s: F, cos_s: F) -> F {
    Lobe::new(v, cone).density(sin_s, cos_s)
}

/// Draws once: [`Lobe::sample`].
#[inline]
pub fn sample<F: Real>(v: F, cone: Cone<F>, xi1: F, xi2: F) -> F {
    Lobe::new(v, cone).sample(xi1, xi2)
}

/// A Gaussian in the half angle `θ_h`, truncated so that `θ_s` stays within `±π/2`.
///
/// The exact, energy-conserving repair of Hery & Ramamoorthi's folded sampler: centre `μ` for `θ_s`
/// (clamped), standard deviation `2β`.
#[derive(Clone, Copy, Debug)]
pub struct Truncated<F = f32> {
    mu: F,
    beta: F,
    /// Share of the untruncated Gaussian that is kept; at least about a half.
    kept: F,
    /// Limits in standard deviations, and the normal distribution there from the side where it is small: below
    /// where the centre is at most 0, else above.
    limits: [f64; 2],
    ends: [f64; 2],
}

impl<F: Real> Truncated<F> {
    /// Centre `mu` in radians (clamped into `±π/2`), `beta` the standard deviation of `θ_h` in radians.
    pub fn new(mu: F, beta: F) -> Self {
        let mu = mu.clamp_to(-F::half_pi(), F::half_pi());
        let width = 2.0 * beta.f64();
        let [a, b] = [-1.0, 1.0].map(|side: f64| (side * std::f64::consts::FRAC_PI_2 - mu.f64()) / width);
        // From the side where the distribution function is small, so that tails keep their digits.
        let ends = if mu > F::zero() { [-b, -a] } else { [a, b] }.map(normal::cdf);
        Self { mu, beta, kept: F::of(ends[1] - ends[0]), limits: [a, b], ends }
    }

    /// Density in `θ_s`, per radian.
    #[inline]
    pub fn density(&self, theta_s: F) -> F {
        let x = (theta_s - self.mu) / (F::of(2.0) * self.beta);
        F::of(normal::pdf(x.f64())) / (F::of(2.0) * self.beta * self.kept)
    }

    /// Draws `θ_s`.
    #[inline]
    pub fn sample(&self, xi: F) -> F {
        let ([a, b], [low, high]) = (self.limits, self.ends);
        let x = if self.mu > F::zero() {
            -normal::quantile(low + (1.0 - xi.f64()) * (high - low))
        } else {
            normal::quantile(low + xi.f64() * (high - low))
        };
        (self.mu + F::of(2.0 * x.clamp(a, b)) * self.beta).clamp_to(-F::half_pi(), F::half_pi())
    }
}
