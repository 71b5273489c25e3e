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
//! - At grazing inclinations (and offsets near the rim) the selection, which looks at the specular path, knows
//!   R alone, while other lobes scatter a little too: weights are unbounded there. That is the paper's sampler;
//!   [`Attenuation::Known`] does not have it.
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

use super::chiang::pick;
use super::{DIMS, Lobes, MIN_PDF, Model, RESIDUAL, Sample, Scatter, finish};
use crate::dir::cos2_half_difference;
use crate::lobe::attenuation::Optics;
use crate::lobe::azimuthal::{self, standard_normal, wrapped_gaussian};
use crate::lobe::longitudinal::{self, Cone, MIN_VARIANCE};
use crate::quadrature::{Rule, rule};
use crate::wrap_angle;
use crate::{Dir, Hit};

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

/// Whether the offset of the hit matters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Field {
    /// The hit's own offset: right at any distance, no quadrature, noise averages over the fiber.
    #[default]
    Near,
    /// The cross-section integrated out: right when the fiber is thinner than a pixel.
    Far,
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

    /// Widths of R, TT, TRT and the residual lobe from that of R.
    fn widths(beta: F) -> [F; 4] {
        [1.0, 0.5, 2.0, 2.0].map(|x| F::of(x) * beta)
    }
}

/// Largest number of nodes over half the cross-section that a set-up caches.
const HALF_NODES: usize = 64;

/// Lobe probabilities `w_p` at the nodes `γ >= 0`: what the far-field density needs and the sampled
/// direction does not change.
#[derive(Clone, Copy, Debug)]
struct Selection<F> {
    w: [[F; 4]; HALF_NODES],
    rule: &'static Rule,
}

/// [`Deon`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct DeonSetup<F: Real = f32> {
    model: Deon<F>,
    hit: Hit<F>,
    v: [F; 4],
    beta_n: [F; 4],
    cones: [Cone<F>; 4],
    /// Optics of the ideally specular path of each lobe, by which lobes are chosen.
    specular: [Optics<F>; 4],
    /// Optics at the known inclination, for [`Attenuation::Known`].
    known: Optics<F>,
    /// Near field: `w_p` at the hit's offset.
    w: [F; 4],
    /// Far field: `w_p` over the cross-section.
    selection: Option<Selection<F>>,
}

impl<F: Real> Model<F> for Deon<F> {
    type Setup = DeonSetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> DeonSetup<F> {
        let k = hit.known;
        let shift = |times: f64| Cone::specular(k.sin_theta, k.cos_theta, F::of(times) * self.alpha);
        let cones = [shift(2.0), shift(-1.0), shift(-4.0), shift(0.0)];
        let known = Optics::new(k.cos_theta.sqr(), self.eta);
        let specular = match self.attenuation {
            Attenuation::Known => [known; 4],
            Attenuation::Difference => {
                cones.map(|c| Optics::new(c.cos2_half_difference(k.sin_theta, k.cos_theta), self.eta))
            }
        };
        let narrowest = F::of(MIN_VARIANCE.sqrt());
        let mut setup = DeonSetup {
            model: *self,
            hit: *hit,
            v: Self::widths(self.beta_m).map(|b| b.max(narrowest).sqr()),
            beta_n: Self::widths(self.beta_n).map(|b| b.max(narrowest)),
            cones,
            specular,
            known,
            w: [F::zero(); 4],
            selection: None,
        };
        match self.field {
            Field::Near => setup.w = setup.lobe_shares(hit.h, hit.h.safe_asin(), (F::one() - hit.h.sqr()).safe_sqrt()),
            Field::Far => setup.selection = Some(setup.select()),
        }
        setup
    }
}

impl<F: Real> DeonSetup<F> {
    /// `w_p(h)`.
    fn lobe_shares(&self, h: F, gamma: F, cos_gamma: F) -> [F; 4] {
        let mut lum = [F::zero(); 4];
        for (p, lum) in lum.iter_mut().enumerate() {
            if p < RESIDUAL || self.model.residual {
                let path = self.specular[p].path(h, gamma, cos_gamma);
                *lum = path.attenuation(self.model.sigma_a)[p].luminance();
            }
        }
        let total: F = lum.iter().copied().sum();
        lum.map(|l| l / total)
    }

    fn select(&self) -> Selection<F> {
        // One rule serves all lobes that are wide enough for it, and the residual lobe.
        let nodes = self.beta_n[..3].iter().filter_map(|b| azimuthal::global_nodes(b.f64())).max().unwrap_or(0);
        let rule = rule(nodes.clamp(48, 2 * HALF_NODES));
        let mut w = [[F::zero(); 4]; HALF_NODES];
        for (j, &(x, _)) in rule[rule.len() / 2..].iter().enumerate() {
            let gamma = F::half_pi() * F::of(x);
            let (h, cos_gamma) = gamma.sin_cos();
            w[j] = self.lobe_shares(h, gamma, cos_gamma);
        }
        Selection { w, rule }
    }

    /// Optics of the light that leaves towards `s`.
    #[inline]
    fn optics(&self, sin_s: F, cos_s: F) -> Optics<F> {
        match self.model.attenuation {
            Attenuation::Known => self.known,
            Attenuation::Difference => {
                let k = self.hit.known;
                Optics::new(cos2_half_difference(k.sin_theta, k.cos_theta, sin_s, cos_s), self.model.eta)
            }
        }
    }

    #[inline]
    fn longitudinal(&self, s: Dir<F>) -> [F; 4] {
        let mut l = [F::zero(); 4];
        for (p, l) in l.iter_mut().enumerate() {
            if p < RESIDUAL || self.model.residual {
                *l = longitudinal::density(self.v[p], self.cones[p], s.sin_theta, s.cos_theta);
            }
        }
        l
    }

    fn near(&self, s: Dir<F>) -> (Lobes<F>, F) {
        let l = self.longitudinal(s);
        let path = self.optics(s.sin_theta, s.cos_theta).path_at(self.hit.h);
        let a = path.attenuation(self.model.sigma_a);
        let phi = s.phi - self.hit.known.phi;
        let mut fcos = Lobes::zero();
        let mut pdf = F::zero();
        for p in 0..4 {
            let n = if p == RESIDUAL {
                F::TAU().recip()
            } else {
                wrapped_gaussian(self.beta_n[p], wrap_angle(phi - path.exit_azimuth(p)))
            };
            fcos[p] = a[p] * (l[p] * n);
            pdf += self.w[p] * l[p] * n;
        }
        (fcos, pdf)
    }

    /// Value and density by quadrature over the cross-section.
    fn far(&self, selection: &Selection<F>, s: Dir<F>) -> (Lobes<F>, F) {
        let l = self.longitudinal(s);
        let optics = self.optics(s.sin_theta, s.cos_theta);
        let phi = self.hit.azimuth(s);
        let mut n = Lobes::zero();
        let mut density = [F::zero(); 4];

        let wide: [bool; 4] =
            [0, 1, 2, 3].map(|p| p == RESIDUAL || azimuthal::global_nodes(self.beta_n[p].f64()).is_some());
        let half = selection.rule.len() / 2;
        for (j, &(x, weight)) in selection.rule[half..].iter().enumerate() {
            let gamma = F::half_pi() * F::of(x);
            let (h, cos_gamma) = gamma.sin_cos();
            let path = optics.path(h, gamma, cos_gamma);
            let a = path.attenuation(self.model.sigma_a);
            // ½ ∫ dh over both signs of γ: the attenuation is even, the exit azimuth odd about pπ.
            let c = F::of(0.5 * weight) * F::half_pi() * cos_gamma;
            for p in 0..3 {
                if wide[p] {
                    let turn = F::of(p as f64) * F::PI();
                    let odd = path.exit_azimuth(p) - turn;
                    let d = c
                        * (azimuthal::wrapped_at(self.beta_n[p], phi, turn + odd)
                            + azimuthal::wrapped_at(self.beta_n[p], phi, turn - odd));
                    n[p] += a[p] * d;
                    density[p] += selection.w[j][p] * d;
                }
            }
            let d = F::of(2.0) * c / F::TAU();
            n[RESIDUAL] += a[RESIDUAL] * d;
            density[RESIDUAL] += selection.w[j][RESIDUAL] * d;
        }
        for p in (0..3).filter(|&p| !wide[p]) {
            azimuthal::windows(&optics, p, self.beta_n[p], phi, |gamma, d| {
                let (h, cos_gamma) = gamma.sin_cos();
                n[p] += optics.path(h, gamma, cos_gamma).attenuation(self.model.sigma_a)[p] * d;
                density[p] += self.lobe_shares(h, gamma, cos_gamma)[p] * d;
            });
        }

        let mut pdf = F::zero();
        for p in 0..4 {
            n[p] *= l[p];
            pdf += density[p] * l[p];
        }
        (n, pdf)
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
        match &self.selection {
            None => self.near(s),
            Some(selection) => self.far(selection, s),
        }
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let far = self.selection.is_some();
        let (h, w) = if far {
            let h = F::of(2.0) * u[0] - F::one();
            (h, self.lobe_shares(h, h.safe_asin(), (F::one() - h.sqr()).safe_sqrt()))
        } else {
            (self.hit.h, self.w)
        };
        let (p, _) = pick(&w, u[1]);
        let sin_s = longitudinal::sample(self.v[p], self.cones[p], u[2], u[3]);
        let mut dir = Dir::from_sin(sin_s, self.hit.known.phi);
        let path = self.optics(dir.sin_theta, dir.cos_theta).path_at(h);
        dir.phi += if p == RESIDUAL {
            F::TAU() * u[4]
        } else {
            wrap_angle(path.exit_azimuth(p) + self.beta_n[p] * standard_normal(u[4]))
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
        let pdf = if far { None } else { Some(self.near(dir).1) };
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
        let l = self.longitudinal(s);
        let selection = self.select();
        let (fcos, _) = self.far(&selection, s);
        let mut n = fcos.0;
        for p in 0..4 {
            n[p] = if l[p] > F::zero() { n[p] / l[p] } else { Rgb::black() };
        }
        (l, n)
    }
}
