//! d'Eon et al. 2011 with the importance sampling of d'Eon, Marschner, Hanika 2013.
//!
//! - Source: d'Eon et al. 2011 (lobes), d'Eon, Marschner, Hanika 2013 (sampler, sections 3.2 to 3.5),
//!   with the errata of the project's model notes: `sin²` in Bravais' index, the density per steradian
//!   `L_p N̂_p`, quadrature in `γ` instead of `h`.
//! - Field: far (the cross-section integrated out) or near (the hit's own offset, whose average over `h`
//!   is the far field).
//! - Energy: close to 1 without absorption, not exactly (0.97 at 85 degrees for a width of 5 degrees),
//!   because the attenuation is taken at the half difference angle; exactly 1 with
//!   [`Attenuation::Known`].
//! - At grazing inclinations the selection, which looks at the specular path, knows R almost alone, while other
//!   lobes, tilted off the cone, scatter a little too: weights grow there (2 at 85 degrees, 4 at 88 with the
//!   defaults). Beyond 89.4 degrees, where the paper's sampler would never draw the other lobes, the selection
//!   looks at 89.4 degrees instead: weights stay bounded and nothing is missed. [`Attenuation::Known`] does not
//!   need that.
//! - Symmetric in the two directions (as `fcos`) when `alpha` is 0 and the attenuation is at the
//!   difference angle.
//!
//! | symbol | meaning |
//! |---|---|
//! | `p` | lobe: 0 R, 1 TT, 2 TRT, 3 all higher orders together |
//! | `L_p` | longitudinal density, variance `v_p = β_p²` |
//! | `A_p(h; θ)` | attenuation of the path through offset `h` |
//! | `Φ(p, h; θ)` | exit azimuth of that path |
//! | `D` | wrapped Gaussian of standard deviation `β_N,p` |
//! | `w_p(h)` | probability of lobe `p` at offset `h`: its share of the specular attenuation |

use math::{Real, Rgb};

use super::field::{blend, split};
use super::{DIMS, Lobes, MIN_PDF, Model, RESIDUAL, Sample, Scatter, finish, pick};
use crate::dir::cos2_half_difference;
use crate::lobe::attenuation::Optics;
use crate::lobe::azimuthal::Kernel;
use crate::lobe::cross_section::{Azimuthal, HalfRule, Section, Shares, lobe_shares};
use crate::lobe::longitudinal::deon_widths;
use crate::lobe::shapes::{Blur, Shapes};
use crate::{Dir, Field, Hit, wrap_angle};

/// Which inclination the attenuation and the exit azimuth are taken at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Attenuation {
    /// Half the difference of the two inclinations, as in the papers: symmetric, nearly conserving.
    #[default]
    Difference,
    /// The known inclination: exactly conserving, not symmetric.
    Known,
}

/// What weight a sample carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weights {
    /// `fcos / pdf` with the density over all hidden choices: lowest variance; in the far field it
    /// costs a quadrature per sample.
    #[default]
    Marginal,
    /// `A / w` of the path drawn, as in the paper: cheap, unbiased, a little noisier. In the far field
    /// the sample carries no density.
    Joint,
    /// [`Joint`](Self::Joint) cut off at 2, as in the paper: loses energy at grazing angles (none to
    /// speak of below 75 degrees and widths up to 10 degrees; 20 % at 85 and 30 degrees).
    Clamped,
}

/// The model of d'Eon et al.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deon<F = f32> {
    /// Index of refraction relative to the outside; 1.55 for keratin in air.
    pub eta: F,
    /// Absorption per fiber radius.
    pub sigma_a: Rgb<F>,
    /// Longitudinal standard deviation of lobe R, radians; TT has half of it, TRT and the residual
    /// lobe twice. 1 to 40 degrees.
    pub beta_m: F,
    /// Azimuthal standard deviation of lobe R, radians; the other lobes scale as above.
    pub beta_n: F,
    /// Tilt of the cuticle scales, radians; negative leans them to the root as real hair has it.
    pub alpha: F,
    /// Whether paths with two and more internal reflections are kept, as one broad lobe.
    pub residual: bool,
    /// Inclination of the attenuation.
    pub attenuation: Attenuation,
    /// Weights of the sampler.
    pub weights: Weights,
    /// Near or far field.
    pub field: Field,
}

impl<F: Real> Deon<F> {
    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> Deon<G> {
        let of = |x: F| G::of(x.f64());
        Deon {
            eta: of(self.eta),
            sigma_a: self.sigma_a.cast(),
            beta_m: of(self.beta_m),
            beta_n: of(self.beta_n),
            alpha: of(self.alpha),
            residual: self.residual,
            attenuation: self.attenuation,
            weights: self.weights,
            field: self.field,
        }
    }

    /// Hair with this absorption and everything else at its default: widths 7.5 degrees, tilt -3 degrees.
    pub fn with_absorption(sigma_a: Rgb<F>) -> Self {
        Self {
            eta: F::of(1.55),
            sigma_a,
            beta_m: F::of(7.5_f64.to_radians()),
            beta_n: F::of(7.5_f64.to_radians()),
            alpha: F::of(-3.0_f64.to_radians()),
            residual: true,
            attenuation: Attenuation::default(),
            weights: Weights::default(),
            field: Field::default(),
        }
    }
}

/// Floor of `cos² θ_d` by which lobes are chosen (89.4 degrees): along the fiber the specular path is all
/// reflection, and lobes that lie elsewhere would never be drawn.
const MIN_COS2_CHOICE: f64 = 1e-4;

/// [`Deon`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct DeonSetup<F: Real = f32> {
    model: Deon<F>,
    hit: Hit<F>,
    shapes: Shapes<F>,
    /// Optics of the ideally specular path of each lobe, by which lobes are chosen.
    specular: [Optics<F>; 4],
    /// Share of the near field; the rest is the far field's.
    near: F,
    /// Near field: `w_p` at the hit's offset.
    w: [F; 4],
    /// Far field: `w_p` over the cross-section.
    shares: Option<Shares<F>>,
}

/// [`Deon`] with everything that is the same at every shading point of a groom of equal fibers.
#[derive(Clone, Copy, Debug)]
pub struct DeonGroom<F: Real = f32> {
    model: Deon<F>,
    blur: Blur<F>,
}

impl<F: Real> Deon<F> {
    /// Works out what no shading point changes.
    pub fn for_groom(&self) -> DeonGroom<F> {
        let v = deon_widths(self.beta_m).map(Real::sqr);
        let [r, tt, trt, _] = deon_widths(self.beta_n);
        DeonGroom { model: *self, blur: Blur::new(v, self.alpha, Kernel::Gaussian, [r, tt, trt]) }
    }
}

impl<F: Real> Model<F> for Deon<F> {
    type Setup = DeonSetup<F>;

    #[inline]
    fn prepare(&self, hit: &Hit<F>) -> DeonSetup<F> {
        self.for_groom().prepare(hit)
    }
}

impl<F: Real> Model<F> for DeonGroom<F> {
    type Setup = DeonSetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> DeonSetup<F> {
        let (k, model) = (hit.known, &self.model);
        let cones = self.blur.cones(k.sin_theta, k.cos_theta);
        let specular = match model.attenuation {
            Attenuation::Known => [Optics::new(k.cos_theta.sqr(), model.eta); 4],
            Attenuation::Difference => {
                let floor = F::of(MIN_COS2_CHOICE);
                cones.map(|c| Optics::new(c.cos2_half_difference(k.sin_theta, k.cos_theta).max(floor), model.eta))
            }
        };
        let shapes = self.blur.around(cones);
        let near = model.field.near_share(hit.width_px);
        let shares = (near < F::one()).then(|| model.shares(&specular));
        let w = if near > F::zero() {
            lobe_shares(&specular, model.sigma_a, model.residual, hit.h)
        } else {
            [F::zero(); 4]
        };
        DeonSetup { model: *model, hit: *hit, shapes, specular, near, w, shares }
    }
}

impl<F: Real> Deon<F> {
    /// `w_p` over the cross-section. One rule serves all lobes that are wide enough for it.
    fn shares(&self, specular: &[Optics<F>; 4]) -> Shares<F> {
        let [r, tt, trt, _] = deon_widths(self.beta_n);
        Shares::new(HalfRule::fit(Kernel::Gaussian, &[r, tt, trt]), specular, self.sigma_a, self.residual)
    }
}

impl<F: Real> DeonSetup<F> {
    /// `w_p(h)`.
    fn shares_at(&self, h: F) -> [F; 4] {
        lobe_shares(&self.specular, self.model.sigma_a, self.model.residual, h)
    }

    /// Optics of the light that leaves towards `s`.
    #[inline]
    fn optics(&self, sin_s: F, cos_s: F) -> Optics<F> {
        match self.model.attenuation {
            // All the same there.
            Attenuation::Known => self.specular[0],
            Attenuation::Difference => {
                let k = self.hit.known;
                Optics::new(cos2_half_difference(k.sin_theta, k.cos_theta, sin_s, cos_s), self.model.eta)
            }
        }
    }

    fn near(&self, s: Dir<F>) -> (Lobes<F>, F) {
        let path = self.optics(s.sin_theta, s.cos_theta).path_at(self.hit.h);
        let a = path.attenuation(self.model.sigma_a);
        let phi = s.phi - self.hit.known.phi;
        let mut shapes = self.shapes.at(s.sin_theta, s.cos_theta, [0, 1, 2].map(|p| phi - path.exit_azimuth(p)));
        if !self.model.residual {
            shapes[RESIDUAL] = F::zero();
        }
        let mut fcos = Lobes::zero();
        let mut pdf = F::zero();
        for p in 0..4 {
            fcos[p] = a[p] * shapes[p];
            pdf += self.w[p] * shapes[p];
        }
        (fcos, pdf)
    }

    /// Value and density by quadrature over the cross-section.
    fn far(&self, shares: &Shares<F>, s: Dir<F>) -> (Lobes<F>, F) {
        let (l, (mut n, density)) = self.far_factors(shares, s);
        let mut pdf = F::zero();
        for p in 0..4 {
            n[p] *= l[p];
            pdf += density[p] * l[p];
        }
        (Lobes(n), pdf)
    }

    /// `L_p`, and the azimuthal terms.
    fn far_factors(&self, shares: &Shares<F>, s: Dir<F>) -> ([F; 4], Azimuthal<F>) {
        let mut l = self.shapes.longitudinal(s.sin_theta, s.cos_theta);
        if !self.model.residual {
            l[RESIDUAL] = F::zero();
        }
        let section = Section {
            optics: self.optics(s.sin_theta, s.cos_theta),
            sigma_a: self.model.sigma_a,
            kernel: Kernel::Gaussian,
            scales: self.shapes.scales,
        };
        let azimuthal = section.integrate(shares, self.hit.azimuth(s), |h| self.shares_at(h));
        (l, azimuthal)
    }
}

impl<F: Real> Scatter<F> for DeonSetup<F> {
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
        match &self.shares {
            None => self.near(s),
            Some(shares) if self.near.is_zero() => self.far(shares, s),
            Some(shares) => blend(self.near, self.near(s), self.far(shares, s)),
        }
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let (h, w) = match split(self.near, u[0]) {
            None => (self.hit.h, self.w),
            Some(xi) => {
                let h = F::of(2.0) * xi - F::one();
                (h, self.shares_at(h))
            }
        };
        let (p, _) = pick(&w, u[1]);
        let sin_s = self.shapes.lobes[p].sample(u[2], u[3]);
        let mut dir = Dir::from_sin(sin_s, self.hit.known.phi);
        let path = self.optics(dir.sin_theta, dir.cos_theta).path_at(h);
        dir.phi += if p == RESIDUAL {
            F::TAU() * u[4]
        } else {
            wrap_angle(path.exit_azimuth(p) + Kernel::Gaussian.sample(self.shapes.scales[p], u[4]))
        };
        if self.model.weights == Weights::Marginal {
            let (fcos, pdf) = self.eval_pdf(dir);
            return finish(dir, fcos, pdf, p);
        }
        let mut weight = path.attenuation(self.model.sigma_a)[p] / w[p];
        if self.model.weights == Weights::Clamped {
            weight = weight.map(|x| x.min(F::of(2.0)));
        }
        if !weight.is_finite() {
            return None;
        }
        let pdf = if self.shares.is_some() { None } else { Some(self.near(dir).1) };
        if pdf.is_some_and(|pdf| !(pdf > F::of(MIN_PDF)) || !pdf.is_finite()) {
            return None;
        }
        Some(Sample { dir, weight: Lobes::only(p, weight), pdf, lobe: p })
    }
}

impl<F: Real> DeonSetup<F> {
    /// Azimuthal densities `N_p(φ; θ_d)` of R, TT, TRT and the residual lobe (far field, `½∫ A D dh`) and
    /// longitudinal densities `L_p`, towards `s`: what the oracles tabulate.
    pub fn factors(&self, s: Dir<F>) -> ([F; 4], [Rgb<F>; 4]) {
        let shares = self.model.shares(&self.specular);
        let (l, (n, _)) = self.far_factors(&shares, s);
        (l, n)
    }
}
