//! Chiang et al. 2016: the near-field model of pbrt-v4, Mitsuba 3 and Cycles' principled hair.
//!
//! - Source: Chiang, Bitterli, Tappan, Burley 2016, section 4, on the lobes of d'Eon et al. 2011.
//! - Field: near (the offset `h` comes from the hit), as published; or far, its average over `h`.
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

use super::field::{blend, split};
use super::{DIMS, Lobes, Model, RESIDUAL, Sample, Scatter, finish, pick};
use crate::lobe::attenuation::{Optics, Path};
use crate::lobe::azimuthal::Kernel;
use crate::lobe::cross_section::{HalfRule, Section, Shares, lobe_shares, shares_of};
use crate::lobe::longitudinal::MIN_VARIANCE;
use crate::lobe::shapes::{Blur, Shapes};
use crate::{Dir, Field, Hit};

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
    /// Near or far field; the model is near-field as published.
    pub field: Field,
}

impl<F: Real> Chiang<F> {
    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> Chiang<G> {
        let of = |x: F| G::of(x.f64());
        Chiang {
            beta_m: of(self.beta_m),
            beta_n: of(self.beta_n),
            alpha: of(self.alpha),
            eta: of(self.eta),
            sigma_a: self.sigma_a.cast(),
            field: self.field,
        }
    }

    /// Hair with this absorption and everything else at its default: both roughnesses 0.3, scales
    /// leaning 2 degrees to the root.
    pub fn with_absorption(sigma_a: Rgb<F>) -> Self {
        Self {
            beta_m: F::of(0.3),
            beta_n: F::of(0.3),
            alpha: F::of(-2.0_f64.to_radians()),
            eta: F::of(1.55),
            sigma_a,
            field: Field::default(),
        }
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
    shapes: Shapes<F>,
    near: Near<F>,
    /// Share of the near field; the rest is the far field's.
    near_share: F,
    far: Option<Far<F>>,
}

/// What the light does at one offset.
#[derive(Clone, Copy, Debug)]
struct Near<F> {
    /// Exit azimuths of R, TT, TRT, absolute.
    exits: [F; 3],
    a: [Rgb<F>; 4],
    q: [F; 4],
}

impl<F: Real> Near<F> {
    fn new(optics: &Optics<F>, sigma_a: Rgb<F>, phi_k: F, h: F) -> Self {
        let path: Path<F> = optics.path_at(h);
        let a = path.attenuation(sigma_a);
        Self { exits: [0, 1, 2].map(|p| phi_k + path.exit_azimuth(p)), a, q: shares_of(a.map(Rgb::luminance)) }
    }
}

/// What the whole cross-section needs.
#[derive(Clone, Copy, Debug)]
struct Far<F> {
    section: Section<F>,
    shares: Shares<F>,
}

/// [`Chiang`] with everything that is the same at every shading point of a groom of equal fibers.
#[derive(Clone, Copy, Debug)]
pub struct ChiangGroom<F: Real = f32> {
    model: Chiang<F>,
    blur: Blur<F>,
}

impl<F: Real> Chiang<F> {
    /// Works out what no shading point changes.
    pub fn for_groom(&self) -> ChiangGroom<F> {
        let s = self.azimuthal_scale();
        ChiangGroom { model: *self, blur: Blur::new(self.variances(), self.alpha, Kernel::Logistic, [s; 3]) }
    }
}

impl<F: Real> Model<F> for Chiang<F> {
    type Setup = ChiangSetup<F>;

    #[inline]
    fn prepare(&self, hit: &Hit<F>) -> ChiangSetup<F> {
        self.for_groom().prepare(hit)
    }
}

impl<F: Real> Model<F> for ChiangGroom<F> {
    type Setup = ChiangSetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> ChiangSetup<F> {
        let (k, model) = (hit.known, &self.model);
        let optics = Optics::new(k.cos_theta.sqr(), model.eta);
        let shapes = self.blur.around(self.blur.cones(k.sin_theta, k.cos_theta));
        let s = shapes.scales[0];
        let near_share = model.field.near_share(hit.width_px);
        let far = (near_share < F::one()).then(|| Far {
            section: Section { optics, sigma_a: model.sigma_a, kernel: Kernel::Logistic, scales: [s; 3] },
            shares: Shares::new(HalfRule::fit(Kernel::Logistic, &[s]), &[optics; 4], model.sigma_a, true),
        });
        ChiangSetup { hit: *hit, shapes, near: Near::new(&optics, model.sigma_a, k.phi, hit.h), near_share, far }
    }
}

impl<F: Real> ChiangSetup<F> {
    /// `L_p N_p` of every lobe at the hit's offset, without attenuation.
    #[inline]
    fn shapes(&self, s: Dir<F>) -> [F; 4] {
        self.shapes.at(s.sin_theta, s.cos_theta, self.near.exits.map(|exit| s.phi - exit))
    }

    #[inline]
    fn near(&self, s: Dir<F>) -> (Lobes<F>, F) {
        let shapes = self.shapes(s);
        let mut fcos = Lobes::zero();
        let mut pdf = F::zero();
        for p in 0..4 {
            fcos[p] = self.near.a[p] * shapes[p];
            pdf += self.near.q[p] * shapes[p];
        }
        (fcos, pdf)
    }

    fn far(&self, far: &Far<F>, s: Dir<F>) -> (Lobes<F>, F) {
        let Section { optics, sigma_a, .. } = far.section;
        let (mut n, density) =
            far.section.integrate(&far.shares, self.hit.azimuth(s), |h| lobe_shares(&[optics; 4], sigma_a, true, h));
        let l = self.shapes.longitudinal(s.sin_theta, s.cos_theta);
        let mut pdf = F::zero();
        for p in 0..4 {
            n[p] *= l[p];
            pdf += density[p] * l[p];
        }
        (Lobes(n), pdf)
    }
}

impl<F: Real> Scatter<F> for ChiangSetup<F> {
    #[inline]
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        self.eval_pdf(s).0
    }

    #[inline]
    fn pdf(&self, s: Dir<F>) -> F {
        self.eval_pdf(s).1
    }

    #[inline]
    fn eval_pdf(&self, s: Dir<F>) -> (Lobes<F>, F) {
        match &self.far {
            None => self.near(s),
            Some(far) if self.near_share.is_zero() => self.far(far, s),
            Some(far) => blend(self.near_share, self.near(s), self.far(far, s)),
        }
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let drawn = match (&self.far, split(self.near_share, u[3])) {
            (Some(far), Some(xi)) => {
                let h = F::of(2.0) * xi - F::one();
                Near::new(&far.section.optics, far.section.sigma_a, self.hit.known.phi, h)
            }
            _ => self.near,
        };
        let (p, xi) = pick(&drawn.q, u[0]);
        let sin_s = self.shapes.lobes[p].sample(u[1], u[2]);
        let phi = if p == RESIDUAL {
            self.hit.known.phi + F::TAU() * xi
        } else {
            drawn.exits[p] + Kernel::Logistic.sample(self.shapes.scales[p], xi)
        };
        let dir = Dir::from_sin(sin_s, phi);
        let (fcos, pdf) = self.eval_pdf(dir);
        finish(dir, fcos, pdf, p)
    }
}
