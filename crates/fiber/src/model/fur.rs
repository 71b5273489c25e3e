//! Fur: a hair whose medulla scatters, after Yan et al. 2015 and 2017.
//!
//! - Source: the double cylinder with five lobes of Yan, Jensen, Ramamoorthi 2017 (unified index, so that light is
//!   not refracted at the medulla; layers of cuticle). The scattered lobes are ours: the papers tabulate the
//!   medulla and fold it with the fiber, here the whole fiber is tabulated (`tools/fur_table.py`) in a form that
//!   conserves energy whatever the table says.
//! - Field: near; the offset `h` comes from the hit.
//! - Energy: exactly 1 for every direction, offset and medulla where nothing is absorbed. With absorption the
//!   albedo is off by less than 0.01 in the mean at an index of 1.55, which the table is made for, and by 0.02 in
//!   the mean (0.06 at most) at 1.4 and 1.7.
//! - Without a medulla it is d'Eon's near field with the attenuation at the known angle, lobe by lobe.
//! - Not reciprocal: all optics are taken at `θ_k`.
//!
//! | symbol | meaning |
//! |---|---|
//! | `κ` | radius of the medulla, in fiber radii |
//! | `σ_s`, `σ_m` | scattering and absorption of the medulla, per fiber radius |
//! | `g` | anisotropy of its phase function |
//! | `ℓ_c`, `ℓ_m` | lengths of one straight crossing in cortex and medulla |
//! | `T` | what one crossing leaves unscattered: `exp(-σ_a ℓ_c - (σ_s + σ_m) ℓ_m)` |
//! | `F` | reflectance of the surface with all its layers |
//! | `TT^s` | scattered on the first crossing, leaves when it first reaches the surface |
//! | `TRT^s` | the same after one or more unscattered crossings |
//! | `S` | scattered and then reflected inside, once or more |

use math::{Real, Rgb};

use super::{DIMS, Lobes, Model, R, RESIDUAL, Sample, Scatter, TRT, TT, finish};
use crate::lobe::attenuation::Optics;
use crate::lobe::azimuthal::{standard_normal, wrapped_gaussian};
use crate::lobe::longitudinal::{Cone, Lobe, Tilt, deon_widths};
use crate::wrap_angle;
use crate::{Dir, Hit};

mod table;
#[cfg(test)]
mod trace;

use table::Leaving;

/// The core of a hair: a column of cells and air that scatters light and refracts none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medulla<F = f32> {
    /// Radius in fiber radii, 0 (none) to 0.95; human hair has up to about a third, fur much more.
    pub radius: F,
    /// Scattering coefficient per fiber radius, `>= 0`. Beyond 16 over `radius` similar media are taken
    /// for one another.
    pub scattering: F,
    /// Absorption per fiber radius, per channel, `>= 0`.
    pub absorption: Rgb<F>,
    /// Mean cosine of the scattering angle in Henyey and Greenstein's phase function, -0.6 to 0.9; beyond, the
    /// nearer end is taken. Positive goes forward.
    pub anisotropy: F,
}

impl<F: Real> Medulla<F> {
    /// No medulla at all.
    pub fn none() -> Self {
        Self { radius: F::zero(), scattering: F::zero(), absorption: Rgb::black(), anisotropy: F::zero() }
    }

    /// A medulla of this radius that scatters and does not absorb: half of straight light is scattered on a way
    /// of 0.35 fiber radii, mostly forward. The numbers are a choice.
    pub fn with_radius(radius: F) -> Self {
        Self { radius, scattering: F::of(2.0), absorption: Rgb::black(), anisotropy: F::of(0.4) }
    }
}

/// Fur: d'Eon's near-field hair around a scattering [`Medulla`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fur<F = f32> {
    /// Index of refraction relative to the outside, of cortex and medulla alike; 1.55 for keratin in air.
    pub eta: F,
    /// Absorption of the cortex per fiber radius.
    pub sigma_a: Rgb<F>,
    /// Longitudinal standard deviation of lobe R, radians; TT has half of it, all others twice. 1 to 40 degrees.
    pub beta_m: F,
    /// Azimuthal standard deviation of lobe R, radians; the other lobes scale as above.
    pub beta_n: F,
    /// Tilt of the cuticle scales, radians; negative leans them to the root as real hair has it.
    pub alpha: F,
    /// Layers of cuticle that reflect, `>= 1`, not necessarily whole: a stack of `l` identical interfaces
    /// reflects `l F / (1 + (l - 1) F)`.
    pub layers: F,
    /// The scattering core.
    pub medulla: Medulla<F>,
}

impl<F: Real> Fur<F> {
    /// What the shader needs of the table: the radius it answers for, and every cell for this medulla.
    pub(crate) fn scattering_cells(&self) -> (f32, [[f32; 20]; 20]) {
        let radius = self.medulla.radius.clamp_to(F::zero(), F::of(0.95)).f64();
        let tabulated = table::tabulated_radius(radius);
        let tau = self.medulla.scattering.max(F::zero()).f64() * radius;
        let mut padded = [[0.0; 20]; 20];
        for (padded, cell) in padded.iter_mut().zip(table::cells(tabulated, tau, self.medulla.anisotropy.f64())) {
            for (padded, number) in padded.iter_mut().zip(cell) {
                *padded = number as f32;
            }
        }
        (tabulated as f32, padded)
    }

    /// The same fiber in another precision.
    pub(crate) fn cast<G: Real>(&self) -> Fur<G> {
        let of = |x: F| G::of(x.f64());
        Fur {
            eta: of(self.eta),
            sigma_a: self.sigma_a.cast(),
            beta_m: of(self.beta_m),
            beta_n: of(self.beta_n),
            alpha: of(self.alpha),
            layers: of(self.layers),
            medulla: Medulla {
                radius: of(self.medulla.radius),
                scattering: of(self.medulla.scattering),
                absorption: self.medulla.absorption.cast(),
                anisotropy: of(self.medulla.anisotropy),
            },
        }
    }

    /// Fur with this absorption of the cortex and everything else at its default: widths 7.5 degrees, tilt -3
    /// degrees, one layer, a white medulla of 0.6 fiber radii.
    pub fn with_absorption(sigma_a: Rgb<F>) -> Self {
        Self {
            eta: F::of(1.55),
            sigma_a,
            beta_m: F::of(7.5_f64.to_radians()),
            beta_n: F::of(7.5_f64.to_radians()),
            alpha: F::of(-3.0_f64.to_radians()),
            layers: F::one(),
            medulla: Medulla::with_radius(F::of(0.6)),
        }
    }

    /// Grey-brown fur with a wide, dim medulla. A plausible choice, not a measurement.
    pub fn wolf() -> Self {
        Self {
            beta_m: F::of(10.0_f64.to_radians()),
            beta_n: F::of(10.0_f64.to_radians()),
            layers: F::of(1.5),
            medulla: Medulla {
                radius: F::of(0.75),
                scattering: F::of(3.0),
                absorption: Rgb::splat(F::of(0.1)),
                anisotropy: F::of(0.4),
            },
            ..Self::with_absorption(Rgb::new(F::of(0.25), F::of(0.35), F::of(0.55)))
        }
    }
}

/// How many terms the sum has: R, TT, TRT, the unscattered rest, and the scattered three below.
const PARTS: usize = 7;
/// The term `TT^s`.
const TT_S: usize = 4;
/// The term `TRT^s` and its like.
const TRT_S: usize = 5;
/// The term `S`.
const S: usize = 6;

/// One term: energy times two normalised densities.
#[derive(Clone, Copy, Debug)]
struct Part<F: Real> {
    energy: Rgb<F>,
    /// Probability that it is drawn from: its share of the luminance.
    share: F,
    lobe: Lobe<F>,
    /// Azimuth of its centre relative to the known direction.
    exit: F,
    /// Standard deviation around it; the unscattered rest has none, it is even.
    width: F,
}

/// [`Fur`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct FurSetup<F: Real = f32> {
    phi_k: F,
    parts: [Part<F>; PARTS],
}

impl<F: Real> Model<F> for Fur<F> {
    type Setup = FurSetup<F>;

    fn prepare(&self, hit: &Hit<F>) -> FurSetup<F> {
        let k = hit.known;
        let path = Optics::new(k.cos_theta.sqr(), self.eta).path_at(hit.h);
        let layers = self.layers.max(F::one());
        // Rounding must not make the rim brighter than a mirror: what enters would be negative.
        let f = (layers * path.fresnel / (F::one() + (layers - F::one()) * path.fresnel)).min(F::one());

        let radius = self.medulla.radius.clamp_to(F::zero(), F::of(0.95));
        let offset = path.gamma_t.sin();
        // The way in the medulla: a chord of the inner circle, lengthened by the inclination inside.
        let cos_t = (F::one() - (k.sin_theta / self.eta).sqr()).max(F::of(1e-12)).sqrt();
        let inside = (F::of(2.0) * (radius.sqr() - offset.sqr()).safe_sqrt() / cos_t).min(path.length);
        let outside = path.length - inside;
        let scattering = self.medulla.scattering.max(F::zero());
        let once = self.sigma_a.zip(self.medulla.absorption, |a, m| (-a * outside - (m + scattering) * inside).exp());

        let mut energies = [Rgb::black(); PARTS];
        energies[R] = Rgb::splat(f);
        energies[TT] = once * (F::one() - f).sqr();
        energies[TRT] = energies[TT] * once * f;
        energies[RESIDUAL] = energies[TRT] * once.map(|t| echoes(f, t));

        let cones = Tilt::new(self.alpha).cones(k.sin_theta, k.cos_theta);
        let (along, around) = (deon_widths(self.beta_m), deon_widths(self.beta_n));
        let plain = |p: usize| Part {
            energy: energies[p],
            share: F::zero(),
            lobe: Lobe::new(along[p].sqr(), cones[p]),
            exit: if p == RESIDUAL { F::zero() } else { path.exit_azimuth(p) },
            width: around[p],
        };
        let [r, tt, trt, rest] = [R, TT, TRT, RESIDUAL].map(plain);
        // Without a medulla these keep no energy, and nobody looks at the rest of them.
        let mut parts = [r, tt, trt, rest, rest, rest, rest];
        for part in &mut parts[TT_S..] {
            part.energy = Rgb::black();
        }

        let scattered_share = -(-scattering * inside).exp_m1();
        if scattered_share > F::zero() {
            let tabulated = table::tabulated_radius(radius.f64());
            let scattered = table::lookup(
                tabulated,
                (scattering * radius).f64(),
                self.medulla.anisotropy.f64(),
                hit.h.abs().max(offset.abs() / radius).f64(),
                k.sin_theta.f64(),
            );
            // Lengths in a medulla thinner than the table has shrink with its radius.
            let shrink = radius.f64() / tabulated;
            let dimming = |leaving: &Leaving| {
                self.sigma_a.zip(self.medulla.absorption, |a, m| F::of(leaving.dimming(a.f64(), m.f64() * shrink)))
            };
            // What reaches the medulla on the first crossing and is scattered there.
            let source = self.sigma_a.map(|a| (F::of(-0.5) * a * outside).exp()) * ((F::one() - f) * scattered_share);
            let first = source * dimming(&scattered.first) * F::of(scattered.first_share);
            let later = source * dimming(&scattered.later) * F::of(1.0 - scattered.first_share);
            // Light that is scattered on a later crossing has turned by then, and is the same otherwise.
            let again = once.map(|t| echoes(f, t));

            let spread = |leaving: &Leaving, p: usize, crossings: usize, energy: Rgb<F>| {
                let sin = (F::of(-leaving.centre) * k.sin_theta).clamp_to(-F::one(), F::one());
                let cos = ((F::one() - sin) * (F::one() + sin)).safe_sqrt();
                let (turn, width) = leaving.azimuth();
                let side = if hit.h < F::zero() { -F::one() } else { F::one() };
                Part {
                    energy,
                    share: F::zero(),
                    // Rough scales blur scattered light as they blur the lobe beside it.
                    lobe: Lobe::new(F::of(leaving.width).sqr() + along[p].sqr(), Cone { sin, cos, raw_cos: cos }),
                    exit: path.exit_azimuth(crossings) + side * F::of(turn),
                    width: (F::of(width).sqr() + around[p].sqr()).sqrt(),
                }
            };
            parts[TT_S] = spread(&scattered.first, TT, 1, first);
            parts[TRT_S] = spread(&scattered.first, TRT, 2, first * again);
            parts[S] = spread(&scattered.later, TRT, 1, later + later * again);
        }

        let lum = parts.map(|part| part.energy.luminance());
        let total: F = lum.iter().copied().sum();
        if total > F::zero() {
            for (part, lum) in parts.iter_mut().zip(lum) {
                part.share = lum / total;
            }
        }
        FurSetup { phi_k: k.phi, parts }
    }
}

/// `F T + (F T)² + ...`: how much all crossings after one carry, relative to that one.
#[inline]
fn echoes<F: Real>(f: F, t: F) -> F {
    let rest = F::one() - f * t;
    if rest > F::zero() { f * t / rest } else { F::zero() }
}

impl<F: Real> FurSetup<F> {
    /// Share of the light that leaves by each lobe, over all directions; without absorption their sum is 1.
    /// All scattered light is in the residual lobe.
    pub fn energies(&self) -> Lobes<F> {
        let mut energies = Lobes::zero();
        for (p, part) in self.parts.iter().enumerate() {
            energies[p.min(RESIDUAL)] += part.energy;
        }
        energies
    }

    /// `L N` of one term, without its energy.
    #[inline]
    fn shape(&self, p: usize, s: Dir<F>) -> F {
        let part = &self.parts[p];
        let n = if p == RESIDUAL {
            F::TAU().recip()
        } else {
            wrapped_gaussian(part.width, wrap_angle(s.phi - self.phi_k - part.exit))
        };
        part.lobe.density(s.sin_theta, s.cos_theta) * n
    }
}

impl<F: Real> Scatter<F> for FurSetup<F> {
    fn eval(&self, s: Dir<F>) -> Lobes<F> {
        self.eval_pdf(s).0
    }

    fn pdf(&self, s: Dir<F>) -> F {
        self.eval_pdf(s).1
    }

    fn eval_pdf(&self, s: Dir<F>) -> (Lobes<F>, F) {
        let mut fcos = Lobes::zero();
        let mut pdf = F::zero();
        for (p, part) in self.parts.iter().enumerate() {
            if !part.energy.is_black() {
                let shape = self.shape(p, s);
                fcos[p.min(RESIDUAL)] += part.energy * shape;
                pdf += part.share * shape;
            }
        }
        (fcos, pdf)
    }

    fn sample(&self, u: [F; DIMS]) -> Option<Sample<F>> {
        let mut left = u[1];
        let mut drawn = R;
        for (p, part) in self.parts.iter().enumerate() {
            if part.share > F::zero() {
                // Should rounding leave a sliver above the last share, it belongs to the last term that has any.
                drawn = p;
                if left < part.share {
                    break;
                }
                left -= part.share;
            }
        }
        let part = &self.parts[drawn];
        let sin_s = part.lobe.sample(u[2], u[3]);
        let turn = if drawn == RESIDUAL {
            F::TAU() * u[4]
        } else {
            wrap_angle(part.exit + part.width * standard_normal(u[4]))
        };
        let dir = Dir::from_sin(sin_s, self.phi_k + turn);
        let (fcos, pdf) = self.eval_pdf(dir);
        finish(dir, fcos, pdf, drawn.min(RESIDUAL))
    }
}
