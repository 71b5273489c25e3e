//! What a smooth dielectric cylinder does to a ray: refraction in the cross-section, Fresnel factors,
//! absorption along the way.

use math::{Real, Rgb};

/// Power reflectance of a dielectric for unpolarised light that arrives at `cos_i >= 0` from outside;
/// `eta > 0` is the inside's index relative to the outside's.
#[inline]
pub fn fresnel<F: Real>(cos_i: F, eta: F) -> F {
    let cos_i = cos_i.clamp_to(F::zero(), F::one());
    let sin2_t = (F::one() - cos_i * cos_i) / (eta * eta);
    if sin2_t >= F::one() {
        return F::one();
    }
    let cos_t = (F::one() - sin2_t).sqrt();
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    F::of(0.5) * (s * s + p * p)
}

/// The optics of a fiber for one inclination: what the offset `h` needs to become a path.
#[derive(Clone, Copy, Debug)]
pub struct Optics<F = f32> {
    eta: F,
    cos_theta: F,
    /// `1 / η'` with Bravais' index `η' = sqrt(η² - sin²θ) / cos θ`; 0 along the fiber.
    inv_bravais: F,
    /// Path length factor `2 / cos θ_t`, in radii per unit of `cos γ_t`.
    length: F,
}

/// Which way a ray takes at one offset: cosines inside and outside, and the Fresnel reflectance.
#[derive(Clone, Copy, Debug)]
pub struct Path<F = f32> {
    /// `γ_i`, angle of incidence in the normal plane, radians.
    pub gamma_i: F,
    /// `γ_t`, angle of refraction in the normal plane, radians.
    pub gamma_t: F,
    /// Fresnel reflectance, the same at every internal bounce.
    pub fresnel: F,
    /// Length of one crossing, in fiber radii.
    pub length: F,
}

impl<F: Real> Path<F> {
    /// Exit azimuth `Φ(p, h)` relative to the known direction, radians, not wrapped.
    #[inline]
    pub fn exit_azimuth(&self, p: usize) -> F {
        let p = F::of(p as f64);
        F::of(2.0) * (p * self.gamma_t - self.gamma_i) + p * F::PI()
    }

    /// `[A_R, A_TT, A_TRT, A_residual]`: the share of the light that leaves by each lobe at this offset.
    ///
    /// Their sum is exactly 1 where nothing is absorbed. The residual is the geometric series of all
    /// paths with three or more internal segments.
    #[inline]
    pub fn attenuation(&self, sigma_a: Rgb<F>) -> [Rgb<F>; 4] {
        let f = self.fresnel;
        let through = (F::one() - f).sqr();
        let grey = sigma_a[0] == sigma_a[1] && sigma_a[1] == sigma_a[2];
        let t = if grey {
            Rgb::splat((-sigma_a[0] * self.length).exp())
        } else {
            sigma_a.map(|s| (-s * self.length).exp())
        };
        let tt = t * through;
        let trt = tt * t * f;
        let residual = trt.zip(t, |a, t| {
            let rest = F::one() - f * t;
            if rest > F::zero() { a * f * t / rest } else { F::zero() }
        });
        [Rgb::splat(f), tt, trt, residual]
    }
}

impl<F: Real> Optics<F> {
    /// For the inclination whose squared cosine is `cos2` and relative index `eta`.
    #[inline]
    pub fn new(cos2: F, eta: F) -> Self {
        let sin2 = F::one() - cos2;
        let cos_theta = cos2.safe_sqrt();
        let root = (eta * eta - sin2).max(F::of(1e-12)).sqrt();
        Self { eta, cos_theta, inv_bravais: cos_theta / root, length: F::of(2.0) * eta / root }
    }

    /// Index, `cos θ`, `1 / η'` and path length factor, in single precision.
    #[inline]
    pub(crate) fn constants(&self) -> [f32; 4] {
        [self.eta, self.cos_theta, self.inv_bravais, self.length].map(|x| x.f64() as f32)
    }

    /// The path at offset `h = sin γ_i`; `cos_gamma_i` is `sqrt(1 - h²)`.
    #[inline]
    pub fn path(&self, h: F, gamma_i: F, cos_gamma_i: F) -> Path<F> {
        let sin_t = (h * self.inv_bravais).clamp_to(-F::one(), F::one());
        let cos_t = (F::one() - sin_t * sin_t).safe_sqrt();
        Path {
            gamma_i,
            gamma_t: sin_t.asin(),
            fresnel: fresnel(self.cos_theta * cos_gamma_i, self.eta),
            length: self.length * cos_t,
        }
    }

    /// The path at offset `h`.
    #[inline]
    pub fn path_at(&self, h: F) -> Path<F> {
        self.path(h, h.safe_asin(), (F::one() - h * h).safe_sqrt())
    }

    /// `Φ(p, γ_i)`, not wrapped.
    #[inline]
    pub fn exit_azimuth(&self, p: usize, gamma_i: F) -> F {
        let p_real = F::of(p as f64);
        let gamma_t = (gamma_i.sin() * self.inv_bravais).safe_asin();
        F::of(2.0) * (p_real * gamma_t - gamma_i) + p_real * F::PI()
    }

    /// Where `Φ(p, ·)` turns, if it does: the positive `γ_i` of the caustic.
    #[inline]
    pub fn turning_point(&self, p: usize) -> Option<F> {
        // dΦ/dγ_i = 0 ⟺ p² (1 - s²) = η'² - s², with s = sin γ_i and p >= 2.
        if p < 2 || self.inv_bravais.is_zero() {
            return None;
        }
        let (p2, n2) = (F::of((p * p) as f64), self.inv_bravais.powi(-2));
        let s2 = (p2 - n2) / (p2 - F::one());
        (s2 > F::zero() && s2 < F::one()).then(|| s2.sqrt().asin())
    }
}
