//! Colour as the albedo of a dense groom, and the absorption that makes it.
//!
//! Absorption multiplies the light of a path by `exp(-σ ℓ)`, where `ℓ` is the way that the path has gone inside
//! fibers. So a groom without absorption, followed once, tells its albedo for every absorption: the Laplace
//! transform of the distribution of `ℓ`. [`AlbedoCurve`] follows paths, keeps the transform as a table and inverts
//! it; [`AlbedoGrid`] does so for many roughnesses, so that they may vary over a groom.
//!
//! - Source: derived in `docs/models/color.md`. The published fit to the same question is
//!   [`absorption::from_color`](crate::absorption::from_color).
//! - Groom: a half-space of straight parallel fibers at random places, along the surface, thin against their
//!   distances; seen from straight above, in even light from all around.
//! - Energy: where the model loses nothing the white groom returns everything, because a half-space lets nothing
//!   through; there the curve is 1 at `σ = 0` exactly. Where it does (d'Eon's, as published), it is not.
//!
//! | symbol | meaning |
//! |---|---|
//! | `σ` | absorption per fiber radius |
//! | `ℓ` | way inside fibers, radii |
//! | `a(σ)` | albedo: `E[w exp(-σ ℓ)]`, with `w` the weight of the path without absorption |
//!
//! ```
//! use fiber::multiple::albedo::AlbedoCurve;
//! use fiber::{Chiang, Fiber};
//! use math::Rgb;
//!
//! let hair = Chiang::with_absorption(Rgb::black());
//! let curve = AlbedoCurve::new(&Fiber::Chiang(hair), 2048, 1).unwrap();
//! // What is asked for is what the groom will show.
//! let sigma_a = curve.sigma_a(Rgb::new(0.6, 0.3, 0.1));
//! assert!((curve.albedo(sigma_a[0]) - 0.6).abs() < 1e-9);
//! assert!(sigma_a[0] < sigma_a[1] && sigma_a[1] < sigma_a[2]);
//! ```

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use math::{Real, Rgb, hash, normal};

use crate::dir::cos2_half_difference;
use crate::lobe::attenuation::{Optics, fresnel};
use crate::lobe::azimuthal::{sample_trimmed_logistic, standard_normal};
use crate::lobe::longitudinal::{self, Cone, deon_widths};
use crate::{Attenuation, Chiang, Deon, Fiber, RESIDUAL};

/// Which way the parallel fibers of the groom point, root to tip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lay {
    /// Either way, evenly: what tilted scales do to light along the fiber cancels over many events, as it does
    /// where hair bends and crosses.
    #[default]
    BothWays,
    /// All the same way. Tilted scales then carry light towards the tips, event by event, to grazing
    /// inclinations, where models that do not conserve energy lose much of it.
    OneWay,
}

/// Independent groups of paths, from which the error is estimated.
const BATCHES: u32 = 32;

/// Paths are followed no further: what is left of them is known in closed form, see [`unfinished`]. About every
/// eighth path of smooth hair gets here. Four times as many events change no value by more than its error.
const MAX_EVENTS: u32 = 512;

/// Dimensions of an event: six of scattering, the free path, the sense of the fiber (before the first event: the
/// depth of that fiber).
const DIMS: u32 = 8;

/// Nodes of the table: absorptions from `1e-6` to `1e2`, sixteen a decade. Straight interpolation of the doubly
/// logarithmic curve is good to 1e-4 there.
const NODES: usize = 129;
const FIRST_LN_SIGMA: f64 = -13.815_510_557_964_274;
const STEP: f64 = std::f64::consts::LN_10 / 16.0;

/// Nearest to the white end that a colour is inverted, as a share of it.
const WHITEST: f64 = 1.0 - 1e-4;

/// Albedo of a dense groom over the absorption of its fibers, and its inverse.
#[derive(Clone, Debug, PartialEq)]
pub struct AlbedoCurve {
    /// Albedo without absorption.
    white: f64,
    /// `ln(-ln(a/white))` over `ln σ`, rising: nearly straight, with a slope of a half where absorption is small.
    shape: Vec<f64>,
    /// Standard errors of the albedo: without absorption, then at the nodes.
    errors: Vec<f64>,
}

impl AlbedoCurve {
    /// The curve of a model, whose own absorption is ignored, for a groom that lies [both ways](Lay::BothWays).
    ///
    /// `paths` are followed, in multiples of 32; with 16384 the [standard error](Self::error) is about 0.004 at most
    /// where the model conserves energy. `seed` picks the random numbers, and the result is a pure function of the
    /// arguments. Allocates. `None` for models other than [`Chiang`] and [`Deon`].
    pub fn new(model: &Fiber<f64>, paths: u32, seed: u32) -> Option<Self> {
        Self::with_lay(model, Lay::default(), paths, seed)
    }

    /// [`new`](Self::new) for a groom that lies as said.
    pub fn with_lay(model: &Fiber<f64>, lay: Lay, paths: u32, seed: u32) -> Option<Self> {
        let walk = Walk::new(model, lay)?;
        let per_batch = paths.div_ceil(BATCHES).max(1);
        let mut batches = vec![[0.0; NODES + 1]; BATCHES as usize];
        let mut cut_off = Vec::new();
        for batch in 0..BATCHES {
            for index in 0..per_batch {
                let end = walk.follow(&Numbers::new(seed, batch, index));
                if end.escaped {
                    end.add_to(&mut batches[batch as usize], |depth| (-depth).exp());
                } else {
                    cut_off.push((batch as usize, end));
                }
            }
        }
        // Weights keep falling as they have: what the model loses acts like absorption, from there on.
        let rate = if walk.conserves() { 0.0 } else { loss(&cut_off) };
        for (batch, end) in cut_off {
            let lost = rate * end.length;
            end.add_to(&mut batches[batch], |depth| lost.min(600.0).exp() * unfinished(depth + lost));
        }
        Some(Self::from_batches(&batches, f64::from(per_batch), walk.conserves()))
    }

    /// From sums of `w exp(-σ ℓ)` per batch, without absorption and at the nodes.
    fn from_batches(batches: &[[f64; NODES + 1]], per_batch: f64, conserves: bool) -> Self {
        let count = batches.len() as f64;
        let mean = |i: usize| batches.iter().map(|sums| sums[i]).sum::<f64>() / (count * per_batch);
        let sampled_white = mean(0).max(f64::MIN_POSITIVE);
        let shape = (1..=NODES)
            .map(|i| {
                let ratio = (mean(i) / sampled_white).clamp(1e-12, 1.0 - 1e-12);
                (-ratio.ln()).ln()
            })
            .collect();
        let errors = (0..=NODES)
            .map(|i| {
                // What is known to be 1 without absorption is measured as a ratio.
                let value = |sums: &[f64; NODES + 1]| {
                    sums[i] / if conserves { sums[0].max(f64::MIN_POSITIVE) } else { per_batch }
                };
                let center = batches.iter().map(value).sum::<f64>() / count;
                let spread: f64 = batches.iter().map(|sums| (value(sums) - center).powi(2)).sum();
                (spread / (count * (count - 1.0))).sqrt()
            })
            .collect();
        Self { white: if conserves { 1.0 } else { sampled_white }, shape, errors }
    }

    /// Albedo for an absorption `sigma >= 0` per radius; anything below counts as none.
    #[inline]
    pub fn albedo(&self, sigma: f64) -> f64 {
        if !(sigma > 0.0) {
            return self.white;
        }
        let at = (sigma.ln() - FIRST_LN_SIGMA) / STEP;
        let last = self.shape.len() - 1;
        let y = if at <= 0.0 {
            self.shape[0] + self.first_slope() * at
        } else if at >= last as f64 {
            self.shape[last]
        } else {
            let i = at as usize;
            self.shape[i] + (self.shape[i + 1] - self.shape[i]) * (at - i as f64)
        };
        self.white * (-y.exp()).exp()
    }

    /// Absorption per radius for which the groom shows this colour, linear, per channel.
    ///
    /// Colours are kept within [`range`](Self::range), at the white end within a share of `1 - 1e-4` of it; what is
    /// darker than the surface of the fibers takes the largest absorption of the table, 100.
    #[inline]
    pub fn sigma_a<F: Real>(&self, color: Rgb<F>) -> Rgb<F> {
        color.map(|c| F::of(self.ln_sigma(c.f64()).exp()))
    }

    /// `[darkest, brightest]` albedo that absorption can make: the reflection of the fibers' surface, and no
    /// absorption at all.
    pub fn range(&self) -> [f64; 2] {
        [self.white * (-self.shape[self.shape.len() - 1].exp()).exp(), self.white]
    }

    /// Standard error of [`albedo`](Self::albedo) there, estimated from 32 independent groups of paths.
    pub fn error(&self, sigma: f64) -> f64 {
        if !(sigma > 0.0) {
            return self.errors[0];
        }
        let at = ((sigma.ln() - FIRST_LN_SIGMA) / STEP).clamp(0.0, (NODES - 1) as f64);
        self.errors[1 + at as usize].max(self.errors[1 + at.ceil() as usize])
    }

    /// Steps of `shape` per node below the table. A walk that conserves energy gives a half of [`STEP`].
    #[inline]
    fn first_slope(&self) -> f64 {
        (self.shape[1] - self.shape[0]).max(1e-6)
    }

    /// `ln σ` for an albedo.
    #[inline]
    fn ln_sigma(&self, albedo: f64) -> f64 {
        let [darkest, white] = self.range();
        let ratio = albedo.clamp_to(darkest, white * WHITEST) / white;
        let y = (-ratio.ln()).ln();
        // As dark as it gets: the table is level there.
        let i = if y >= self.shape[self.shape.len() - 1] {
            self.shape.len()
        } else {
            self.shape.partition_point(|&node| node < y)
        };
        let at = if i == 0 {
            (y - self.shape[0]) / self.first_slope()
        } else if i == self.shape.len() {
            (i - 1) as f64
        } else {
            let (below, above) = (self.shape[i - 1], self.shape[i]);
            (i - 1) as f64 + (y - below) / (above - below)
        };
        FIRST_LN_SIGMA + STEP * at
    }
}

/// Curves for many roughnesses: absorption for a colour where roughness varies over the groom.
#[derive(Clone, Debug, PartialEq)]
pub struct AlbedoGrid {
    beta_m: Vec<f64>,
    beta_n: Vec<f64>,
    /// Rows of equal `beta_m`.
    curves: Vec<AlbedoCurve>,
}

impl AlbedoGrid {
    /// The curves of a model at all pairs of these roughnesses, which have the model's own unit and must rise; all
    /// else is the model's. Each is made from `paths` paths as by [`AlbedoCurve::new`], with the same random
    /// numbers, so that what lies between them is smooth. Allocates.
    ///
    /// `None` for a model without a curve, and for nodes that are missing, not finite or do not rise.
    pub fn new(model: &Fiber<f64>, beta_m: &[f64], beta_n: &[f64], paths: u32, seed: u32) -> Option<Self> {
        let fit = |nodes: &[f64]| {
            nodes.iter().all(|x| x.is_finite()) && !nodes.is_empty() && nodes.windows(2).all(|pair| pair[0] < pair[1])
        };
        if !fit(beta_m) || !fit(beta_n) {
            return None;
        }
        let mut curves = Vec::with_capacity(beta_m.len() * beta_n.len());
        for &m in beta_m {
            for &n in beta_n {
                let node = match *model {
                    Fiber::Chiang(chiang) => Fiber::Chiang(Chiang { beta_m: m, beta_n: n, ..chiang }),
                    Fiber::Deon(deon) => Fiber::Deon(Deon { beta_m: m, beta_n: n, ..deon }),
                    _ => return None,
                };
                curves.push(AlbedoCurve::new(&node, paths, seed)?);
            }
        }
        Some(Self { beta_m: beta_m.to_vec(), beta_n: beta_n.to_vec(), curves })
    }

    /// Absorption per radius for which a groom of these roughnesses shows this colour; see
    /// [`AlbedoCurve::sigma_a`]. Straight in the logarithm of the absorption between nodes, level outside them.
    /// Allocates nothing.
    #[inline]
    pub fn sigma_a<F: Real>(&self, color: Rgb<F>, beta_m: F, beta_n: F) -> Rgb<F> {
        let (m0, m1, tm) = cell(&self.beta_m, beta_m.f64());
        let (n0, n1, tn) = cell(&self.beta_n, beta_n.f64());
        let row = self.beta_n.len();
        let corners = [
            (m0 * row + n0, (1.0 - tm) * (1.0 - tn)),
            (m0 * row + n1, (1.0 - tm) * tn),
            (m1 * row + n0, tm * (1.0 - tn)),
            (m1 * row + n1, tm * tn),
        ];
        color.map(|c| {
            let mut ln_sigma = 0.0;
            // On a node, or with a single one, some corners count for nothing and need no inversion.
            for (curve, share) in corners.into_iter().filter(|&(_, share)| share > 0.0) {
                ln_sigma += share * self.curves[curve].ln_sigma(c.f64());
            }
            F::of(ln_sigma.exp())
        })
    }
}

/// The nodes around `x` and how far it is between them; level outside.
#[inline]
fn cell(nodes: &[f64], x: f64) -> (usize, usize, f64) {
    let above = nodes.partition_point(|&node| node <= x);
    if above == 0 {
        (0, 0, 0.0)
    } else if above == nodes.len() {
        (above - 1, above - 1, 0.0)
    } else {
        let (a, b) = (nodes[above - 1], nodes[above]);
        (above - 1, above, (x - a) / (b - a))
    }
}

/// How the azimuth is blurred.
#[derive(Clone, Copy, Debug)]
enum Blur {
    Logistic(f64),
    Gaussian([f64; 4]),
}

/// A model as a random walk without absorption through a groom.
#[derive(Clone, Copy, Debug)]
struct Walk {
    eta: f64,
    /// Sine and cosine of the shift of each lobe's cone.
    shifts: [(f64, f64); 4],
    /// Longitudinal variances.
    v: [f64; 4],
    blur: Blur,
    residual: bool,
    attenuation: Attenuation,
    lay: Lay,
}

/// What one event does to a path.
struct Event {
    sin_s: f64,
    cos_s: f64,
    /// Relative to the known direction.
    azimuth: f64,
    /// Way inside the fiber, radii.
    length: f64,
    weight: f64,
}

/// How a path ended.
struct End {
    length: f64,
    weight: f64,
    escaped: bool,
}

impl Walk {
    fn new(model: &Fiber<f64>, lay: Lay) -> Option<Self> {
        // R, TT, TRT, residual.
        let shifts = |alpha: f64| [2.0, -1.0, -4.0, 0.0].map(|times: f64| (times * alpha).sin_cos());
        match model {
            Fiber::Chiang(chiang) => Some(Self {
                eta: chiang.eta,
                shifts: shifts(chiang.alpha),
                v: chiang.variances(),
                blur: Blur::Logistic(chiang.azimuthal_scale()),
                residual: true,
                attenuation: Attenuation::Known,
                lay,
            }),
            Fiber::Deon(deon) => Some(Self {
                eta: deon.eta,
                shifts: shifts(deon.alpha),
                v: deon_widths(deon.beta_m).map(|b| b * b),
                blur: Blur::Gaussian(deon_widths(deon.beta_n)),
                residual: deon.residual,
                attenuation: deon.attenuation,
                lay,
            }),
            _ => None,
        }
    }

    /// Whether every event returns exactly what came in.
    fn conserves(&self) -> bool {
        self.residual && self.attenuation == Attenuation::Known
    }

    /// Attenuations of the lobes without absorption, for a Fresnel reflectance.
    #[inline]
    fn attenuations(&self, f: f64) -> [f64; 4] {
        let through = (1.0 - f) * (1.0 - f);
        [f, through, through * f, if self.residual { (1.0 - f) * f * f } else { 0.0 }]
    }

    /// Follows a path from the viewer until it leaves or has had all its events.
    fn follow(&self, numbers: &Numbers) -> End {
        // All fibers are parallel, so only what happens in the normal plane decides where the next one is met: free
        // paths are exponential there, whatever the inclination. Their mean is the unit of depth.
        let mut depth = -(-numbers.at(0, DIMS - 1)).ln_1p();
        let (mut sin_k, mut cos_k, mut phi_k) = (0.0, 1.0, FRAC_PI_2);
        let (mut length, mut weight) = (0.0, 1.0);
        for event in 0..MAX_EVENTS {
            // Turning a fiber end to end is the same as turning the inclination's sign. The first event is seen
            // straight on, where it makes no difference.
            let turned = self.lay == Lay::BothWays && event > 0 && numbers.at(event, DIMS - 1) < 0.5;
            let sense = if turned { -1.0 } else { 1.0 };
            let scattered = self.scatter(sense * sin_k, cos_k, [0, 1, 2, 3, 4, 5].map(|dim| numbers.at(event, dim)));
            length += scattered.length;
            weight *= scattered.weight;
            let phi_s = phi_k + scattered.azimuth;
            depth += (-numbers.at(event, DIMS - 2)).ln_1p() * phi_s.sin();
            if depth < 0.0 {
                return End { length, weight, escaped: true };
            }
            (sin_k, cos_k, phi_k) = (-sense * scattered.sin_s, scattered.cos_s, phi_s + PI);
        }
        End { length, weight, escaped: false }
    }

    /// One fiber, met at an even offset: the models' own samplers with the hidden choices kept, because the way
    /// inside depends on them.
    fn scatter(&self, sin_k: f64, cos_k: f64, u: [f64; 6]) -> Event {
        let h = 2.0 * u[0] - 1.0;
        let cos_gamma = (1.0 - h * h).safe_sqrt();
        let cone = |p: usize| Cone::turned(sin_k, cos_k, self.shifts[p].0, self.shifts[p].1);
        let chances = match self.attenuation {
            Attenuation::Known => self.attenuations(fresnel(cos_k * cos_gamma, self.eta)),
            Attenuation::Difference => {
                let specular = [0, 1, 2, 3].map(|p| {
                    let cos_d = cone(p).cos2_half_difference(sin_k, cos_k).safe_sqrt();
                    self.attenuations(fresnel(cos_d * cos_gamma, self.eta))[p]
                });
                // The specular path alone would know nothing but R at grazing inclinations and give unbounded
                // weights to the rest; a little of the straight view bounds them and is hardly felt elsewhere.
                let straight = self.attenuations(fresnel(cos_gamma, self.eta));
                let (a, b) = (15.0 / 16.0 / total(&specular), 1.0 / 16.0 / total(&straight));
                [0, 1, 2, 3].map(|p| a * specular[p] + b * straight[p])
            }
        };
        let scale = total(&chances).recip();
        let shares = chances.map(|chance| chance * scale);
        let p = choose(&shares, u[1]);

        let sin_s = longitudinal::sample(self.v[p], cone(p), u[2], u[3]);
        let cos_s = (1.0 - sin_s * sin_s).safe_sqrt();
        let cos2 = match self.attenuation {
            Attenuation::Known => cos_k * cos_k,
            Attenuation::Difference => cos2_half_difference(sin_k, cos_k, sin_s, cos_s),
        };
        let path = Optics::new(cos2, self.eta).path_at(h);
        let azimuth = if p == RESIDUAL {
            TAU * u[4]
        } else {
            path.exit_azimuth(p)
                + match self.blur {
                    Blur::Logistic(s) => sample_trimmed_logistic(s, u[4]),
                    Blur::Gaussian(beta) => beta[p] * standard_normal(u[4]),
                }
        };
        let mut crossings = p as f64;
        if p == RESIDUAL {
            // The lobe is a geometric series: each further reflection has the chance of the last.
            crossings += ((-u[5]).ln_1p() / path.fresnel.ln()).floor().clamp_to(0.0, 1e6);
        }
        let weight = self.attenuations(path.fresnel)[p] / shares[p];
        Event { sin_s, cos_s, azimuth, length: crossings * path.length, weight }
    }
}

#[inline]
fn total(shares: &[f64; 4]) -> f64 {
    shares.iter().sum()
}

/// An index with the given probabilities, none where there is no chance.
#[inline]
fn choose(shares: &[f64; 4], xi: f64) -> usize {
    let mut left = xi;
    let mut last = 0;
    for (p, &share) in shares.iter().enumerate() {
        if share > 0.0 {
            last = p;
            if left < share {
                return p;
            }
            left -= share;
        }
    }
    last
}

impl End {
    /// Adds to sums what is left of the path: everything without absorption, `remaining(σ ℓ)` at the nodes.
    fn add_to(&self, sums: &mut [f64; NODES + 1], remaining: impl Fn(f64) -> f64) {
        if !(self.weight > 0.0 && self.weight.is_finite()) {
            return;
        }
        sums[0] += self.weight * remaining(0.0);
        let ratio = STEP.exp();
        let mut depth = FIRST_LN_SIGMA.exp() * self.length;
        for sum in &mut sums[1..] {
            // Nothing is left, here and at all larger absorptions.
            if depth > 40.0 {
                break;
            }
            *sum += self.weight * remaining(depth);
            depth *= ratio;
        }
    }
}

/// Loss of weight per radius of way, as if it were absorption, from paths that were cut off; 0 where weights do not
/// fall.
fn loss(cut_off: &[(usize, End)]) -> f64 {
    let (mut weight, mut length) = (0.0, 0.0);
    for (_, end) in cut_off {
        weight += end.weight;
        length += end.length;
    }
    if weight > 0.0 && length > 0.0 {
        let count = cut_off.len() as f64;
        (-(weight / count).ln() * count / length).max(0.0)
    } else {
        0.0
    }
}

/// `E[exp(-σ ℓ)]` of a path that was cut off at the optical depth `x = σ ℓ₀`.
///
/// A walk whose steps are as likely up as down stays inside for longer than `n` events with a chance that falls like
/// `n^{-1/2}` (Sparre Andersen's theorem), and after many events `ℓ` is proportional to their number. So
/// `P(ℓ) = ½ ℓ₀^{1/2} ℓ^{-3/2}` beyond `ℓ₀`, whose transform is `e^{-x} - √(πx) erfc √x`: 1 at 0.
fn unfinished(x: f64) -> f64 {
    let erfc = 2.0 * normal::cdf(-(2.0 * x).sqrt());
    ((-x).exp() - (PI * x).sqrt() * erfc).max(0.0)
}

/// The random numbers of one path: the first event from a sequence that fills all its dimensions evenly, because it
/// decides what dark hair looks like; the others by hashing.
struct Numbers {
    first: [f64; DIMS as usize],
    stream: u32,
}

/// Powers of `1/g` with `g^9 = g + 1`: steps of an additive recurrence in eight dimensions.
///
/// Source: M. Roberts' generalisation of the golden ratio.
const RECURRENCE: [f64; DIMS as usize] = {
    const INVERSE: f64 = 0.921_599_319_633_983_1;
    let mut steps = [INVERSE; DIMS as usize];
    let mut i = 1;
    while i < steps.len() {
        steps[i] = steps[i - 1] * INVERSE;
        i += 1;
    }
    steps
};

impl Numbers {
    fn new(seed: u32, batch: u32, index: u32) -> Self {
        let mut first = [0.0; DIMS as usize];
        for ((dim, number), step) in (0..).zip(&mut first).zip(RECURRENCE) {
            // A shift of its own for every batch, so that batches are independent.
            let shift = f64::from(hash::unit(dim, hash::mix2(seed, batch)));
            *number = (shift + step * f64::from(index)).fract();
        }
        Self { first, stream: hash::mix3(seed ^ 0x5bd1_e995, batch, index) }
    }

    #[inline]
    fn at(&self, event: u32, dim: u32) -> f64 {
        if event == 0 { self.first[dim as usize] } else { f64::from(hash::unit(event * DIMS + dim, self.stream)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate;

    #[test]
    fn steps_solve_their_equation() {
        let g = 1.0 / RECURRENCE[0];
        assert!((g.powi(9) - g - 1.0).abs() < 1e-12, "{g}");
        assert!((FIRST_LN_SIGMA - 1e-6_f64.ln()).abs() < 1e-14);
        assert!((FIRST_LN_SIGMA + STEP * (NODES - 1) as f64 - 100.0_f64.ln()).abs() < 1e-12);
    }

    #[test]
    fn the_rest_of_a_path_is_the_transform_of_its_power_law() {
        // With ℓ = ℓ₀ / t², ½ ℓ₀^{1/2} ℓ^{-3/2} dℓ becomes dt on (0, 1].
        for x in [1e-6, 0.01, 0.3, 2.0, 8.0] {
            let want = integrate(0.0, 1.0, 256, |t: f64| (-x / (t * t).max(1e-300)).exp());
            assert!((unfinished(x) - want).abs() < 1e-6, "{x}: {} and {want}", unfinished(x));
        }
        assert_eq!(unfinished(0.0), 1.0);
    }

    #[test]
    fn the_series_of_the_residual_lobe_has_its_transform() {
        // Both sides of E[T^{3+j}] with P(j) = (1 - f) f^j, through the formula that draws j.
        let (f, t) = (0.3_f64, 0.6_f64);
        let n = 20_000;
        let drawn: f64 = (0..n)
            .map(|i| {
                let u = (f64::from(i) + 0.5) / f64::from(n);
                t.powf(3.0 + ((-u).ln_1p() / f.ln()).floor())
            })
            .sum::<f64>()
            / f64::from(n);
        let want = t.powi(3) * (1.0 - f) / (1.0 - f * t);
        // Midpoints against steps: one part of 20000 at each.
        assert!((drawn - want).abs() < 1e-4, "{drawn} and {want}");
    }

    #[test]
    fn what_is_not_absorbed_conserves_its_weight() {
        let walk = Walk::new(&Fiber::Chiang(Chiang::with_absorption(Rgb::black())), Lay::BothWays).unwrap();
        assert!(walk.conserves());
        for i in 0..2000 {
            let u = [0, 1, 2, 3, 4, 5].map(|dim| f64::from(hash::unit(i, dim)));
            let sin_k = 2.0 * f64::from(hash::unit(i, 9)) - 1.0;
            let event = walk.scatter(sin_k, (1.0 - sin_k * sin_k).sqrt(), u);
            assert!((event.weight - 1.0).abs() < 1e-12, "{}", event.weight);
            assert!(event.length >= 0.0 && event.length.is_finite());
        }
    }

    #[test]
    fn weights_of_deon_average_to_its_albedo() {
        // Without absorption and tilt, at 60 degrees and a width of 10: 0.9935 (the tabulated furnace). The spread of
        // a weight is below 0.2, so 4 standard errors of 40000 are 0.004: false alarm below 1e-4.
        let beta = 10.0_f64.to_radians();
        let deon = Deon { beta_m: beta, beta_n: beta, alpha: 0.0, ..Deon::with_absorption(Rgb::black()) };
        let walk = Walk::new(&Fiber::Deon(deon), Lay::BothWays).unwrap();
        assert!(!walk.conserves());
        let n = 40_000;
        let (sin_k, cos_k) = 60.0_f64.to_radians().sin_cos();
        let sum: f64 = (0..n)
            .map(|i| walk.scatter(sin_k, cos_k, [0, 1, 2, 3, 4, 5].map(|dim| f64::from(hash::unit(i, dim)))).weight)
            .sum();
        assert!((sum / f64::from(n) - 0.9935).abs() < 0.004, "{}", sum / f64::from(n));
    }
}
