//! Dual scattering: light among many fibers, told from averages over one.
//!
//! Light on its way to a fiber is scattered forward by those it crosses: the global part, accumulated in a
//! [`Front`]. Light that passed the fiber comes back from those behind it: the local part, a closed form. Both rest
//! on tables over the inclination ([`Tables`]), made once per model.
//!
//! - Source: Zinke, Yuksel, Weber, Keyser 2008. All constants are derived anew in
//!   `docs/models/dual_scattering.md`, which says where they differ from the published ones and why.
//! - Field: that of the model; the tables are averages over the cross-section.
//! - Energy: the averages of a model that absorbs nothing add up to 1. What the whole returns is an approximation,
//!   within 15 % of followed light on slabs of parallel fibers lit near their normal, with [`Closure::Medium`] and
//!   densities of 1 (thicker ones: the page); it knows no surface, and is too bright where light arrives aslant.
//!
//! | symbol | meaning |
//! |---|---|
//! | `f`, `b` | `ā_f`, `ā_b`: shares that one fiber scatters on and back |
//! | `α_f`, `α_b` | mean of `θ_s + θ_k` over that light: how far it strays from the specular cone, radians |
//! | `β_f²`, `β_b²` | variance of `θ_s + θ_k`, rad² |
//! | `A` | share that the fibers behind return |
//! | `Δ`, `σ²` | mean and variance of `θ_s + θ_k` over what is returned |
//! | `d_f`, `d_b` | densities: how full of hair the directions towards and away from the light are |
//!
//! ```
//! use fiber::multiple::dual_scattering::{DualScattering, Front, Options};
//! use fiber::{Chiang, Dir, Fiber, Hit};
//! use math::Rgb;
//!
//! let blonde = Fiber::Chiang(Chiang::<f64>::with_absorption(Rgb::new(0.06, 0.1, 0.2)));
//! let hair = DualScattering::new(blonde, Options { entries: 16, samples: 1024, ..Options::default() });
//!
//! // Lit from behind through four fibers, hair glows reddish: every crossing takes more blue than red.
//! let (hit, light) = (Hit::new(Dir::new(0.0, 0.0), 0.2), Dir::new(0.1, 3.0));
//! let mut front = Front::open();
//! for _ in 0..4 {
//!     hair.accumulate(&mut front, light.theta());
//! }
//! let glow = hair.eval(&hit, light, &front);
//! assert!(glow[0] > 2.0 * glow[2]);
//! ```

use std::f64::consts::{FRAC_PI_2, PI};

use math::{Real, Rgb};

use crate::lobe::longitudinal::{self, Cone, MIN_VARIANCE};
use crate::quadrature::rule;
use crate::{DIMS, Dir, Fiber, Hit, Model, Scatter, wrap_angle};

/// How one fiber's scattering becomes that of many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Closure {
    /// Fibers at random places. Scattered light fills the half circle around its direction like the light of a
    /// diffuse surface, with the cosine; any number of turns is summed.
    #[default]
    Medium,
    /// As published: fibers in rows, each of which light must cross. Scattered light fills the half circle evenly;
    /// paths that turn once and three times are summed. Nothing returns to a viewer on the far side of the light.
    Rows,
}

/// How a [`DualScattering`] is made and evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<F = f32> {
    /// From one fiber to many.
    pub closure: Closure,
    /// `d_f`, share of the directions towards the light that is full of hair, `0..=1`. 0.7, as published, suits a
    /// head of hair; 1 is right inside a slab.
    pub density_forward: F,
    /// `d_b`, the same for the directions from which light returns.
    pub density_backward: F,
    /// Entries of a table over the inclination; at least 2.
    pub entries: usize,
    /// Draws from the model per entry. 16384 give averages within 0.3 % and variances within 2 % (5 % at grazing
    /// inclinations).
    pub samples: usize,
    /// Nodes over the inclination of light scattered on its way, see [`quadrature::rule`](crate::quadrature::rule).
    pub inclinations: usize,
    /// Nodes over its azimuth.
    pub azimuths: usize,
}

impl<F: Real> Default for Options<F> {
    fn default() -> Self {
        Self {
            closure: Closure::default(),
            density_forward: F::of(0.7),
            density_backward: F::of(0.7),
            entries: 64,
            samples: 16_384,
            inclinations: 32,
            azimuths: 16,
        }
    }
}

/// One entry of a table: how much light goes one way, and along which inclinations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Side<F = f32> {
    /// Share of the light, per channel.
    pub attenuation: Rgb<F>,
    /// Mean of `θ_s + θ_k`, radians.
    pub shift: Rgb<F>,
    /// Variance of `θ_s + θ_k`, rad².
    pub variance: Rgb<F>,
}

/// Everything that depends on the inclination alone, as plain numbers; all tables have one length.
///
/// Entry `i` of `n` belongs to `θ = ((i + ½) / n - ½) π`, the inclination of the known direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tables<'a, F = f32> {
    /// One fiber, light that it scatters on.
    pub forward: &'a [Side<F>],
    /// One fiber, light that it scatters back.
    pub backward: &'a [Side<F>],
    /// The fibers behind, towards viewers on the light's side.
    pub returned: &'a [Side<F>],
    /// The fibers behind, towards viewers on the far side.
    pub passed: &'a [Side<F>],
}

/// What happens to light on its way to a fiber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Front<F = f32> {
    /// Share that arrives without having met a fiber: 1 or 0 where fibers are counted one by one.
    pub direct: F,
    /// Share that arrives scattered; without meaning (it is a product that has no factors yet) while `direct` is 1.
    pub transmittance: Rgb<F>,
    /// Sum of the shifts of the fibers crossed, radians.
    pub shift: Rgb<F>,
    /// Sum of their variances, rad².
    pub variance: Rgb<F>,
}

impl<F: Real> Front<F> {
    /// Nothing crossed yet.
    #[inline]
    pub fn open() -> Self {
        Self { direct: F::one(), transmittance: Rgb::white(), shift: Rgb::black(), variance: Rgb::black() }
    }
}

/// What fibers behind a fiber send out through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Returned<F = f32> {
    /// Share of the light that falls on it.
    pub share: F,
    /// Forward scatterings of that light, on average.
    pub forwards: F,
    /// Backward scatterings, on average.
    pub backwards: F,
}

/// Averages are kept this far below 1 together: where nothing is lost, light never ends.
const MOST: f64 = 1.0 - 1e-6;

/// Smallest rate at which light dies out in a medium: bounds the number of scatterings where nothing is lost.
const SLOWEST: f64 = 1e-3;

/// Rows of fibers, of which the first is the one looked at: paths that turn once beyond it, or three times.
///
/// `A₁ = b f²/(1-f²)`, `A₃ = b³ f²/(1-f²)³`. Arguments are the shares `f` and `b`, `f + b < 1`.
pub fn rows_returned<F: Real>(f: F, b: F) -> Returned<F> {
    let (one, two) = (F::one(), F::of(2.0));
    let a = f * f;
    let left = one - a;
    // Relative to the paths that turn once, so that a black fiber has its means too.
    let once = b * a / left;
    let thrice = (b / left).sqr();
    Returned {
        share: once * (one + thrice),
        forwards: two / left * (one + thrice * (one + two * a)) / (one + thrice),
        backwards: (one + F::of(3.0) * thrice) / (one + thrice),
    }
}

/// A deep medium of fibers at random places: its albedo `R = b / (1 - f + κ)`, `κ² = (1-f)² - b²`, with `κ`.
fn medium_albedo<F: Real>(f: F, b: F) -> (F, F) {
    let lost = F::one() - f;
    let kappa = (lost.sqr() - b.sqr()).max(F::of(SLOWEST * SLOWEST)).sqrt();
    (b / (lost + kappa), kappa)
}

/// A medium of fibers at random places, seen from the light's side through the fiber: `A = f R`.
pub fn medium_returned<F: Real>(f: F, b: F) -> Returned<F> {
    let (albedo, kappa) = medium_albedo(f, b);
    Returned { share: f * albedo, forwards: F::one() + f / kappa, backwards: (F::one() - f) / kappa }
}

/// The same, thrown back by the fiber towards viewers on the far side: `A = b R`.
pub fn medium_passed<F: Real>(f: F, b: F) -> Returned<F> {
    let (albedo, kappa) = medium_albedo(f, b);
    Returned { share: b * albedo, forwards: f / kappa, backwards: F::one() + (F::one() - f) / kappa }
}

impl Closure {
    /// Share of light scattered by the azimuth `phi`, relative to the known direction, that goes on rather than
    /// back, averaged over the half circle that scattered light fills.
    ///
    /// With `ψ` the turn from straight on: the part of the half circle that is still in front after the turn.
    fn forward_share(self, phi: f64) -> f64 {
        match self {
            // ∫ ½ cos x over both half circles at once: (1 + cos ψ) / 2.
            Self::Medium => 0.5 * (1.0 - phi.cos()),
            // Overlap of two half circles: 1 - ψ/π.
            Self::Rows => wrap_angle(phi).abs() / PI,
        }
    }

    /// Light through a surface at right angles to its direction, per light that arrives, once it is scattered:
    /// the mean of the cosine over the half circle.
    pub(super) fn flux(self) -> f64 {
        match self {
            Self::Medium => 0.25 * PI,
            Self::Rows => 2.0 / PI,
        }
    }

    /// Azimuth of scattered light relative to the light's, for `x` even over `[-1, 1]`.
    fn spread(self, x: f64) -> f64 {
        match self {
            Self::Medium => x.asin(),
            Self::Rows => FRAC_PI_2 * x,
        }
    }
}

/// Light that a surface returns evenly over its half circle has ½ of its flux in every direction: `∫ ½ cos φ dφ = 1`.
pub(super) const EVEN: f64 = 0.5;

/// Beyond this many standard deviations scattered light is nothing.
const REACH: f64 = 6.0;

/// A fiber model among many of its kind.
#[derive(Clone, Debug)]
pub struct DualScattering<F = f32, M = Fiber<F>> {
    model: M,
    options: Options<F>,
    forward: Vec<Side<F>>,
    backward: Vec<Side<F>>,
    returned: Vec<Side<F>>,
    passed: Vec<Side<F>>,
}

impl<F: Real, M: Model<F>> DualScattering<F, M> {
    /// Makes the tables, by the model's own sampler on evenly spread points.
    pub fn new(model: M, options: Options<F>) -> Self {
        let count = options.entries.max(2);
        let points: Vec<[f64; 1 + DIMS]> = points(options.samples.max(1)).collect();
        let empty = || Vec::with_capacity(count);
        let (mut forward, mut backward, mut returned, mut passed) = (empty(), empty(), empty(), empty());
        for i in 0..count {
            let [f, b] = averages(&model, options.closure, table_theta(i, count), &points);
            let (back, on) = match options.closure {
                Closure::Medium => (behind(&f, &b, medium_returned), behind(&f, &b, medium_passed)),
                Closure::Rows => (behind(&f, &b, rows_returned), Side::default()),
            };
            forward.push(f);
            backward.push(b);
            returned.push(back);
            passed.push(on);
        }
        Self { model, options, forward, backward, returned, passed }
    }

    /// The tables.
    pub fn tables(&self) -> Tables<'_, F> {
        Tables { forward: &self.forward, backward: &self.backward, returned: &self.returned, passed: &self.passed }
    }

    /// The model.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// How it was made.
    pub fn options(&self) -> &Options<F> {
        &self.options
    }

    /// One more fiber between the light and the place; `theta` is the inclination, at that fiber, of the direction
    /// towards the light, radians.
    #[inline]
    pub fn accumulate(&self, front: &mut Front<F>, theta: F) {
        let side = lookup(&self.forward, -theta);
        if front.direct < F::one() {
            // What had met no fiber yet joins what had, unshifted.
            let arriving = front.transmittance + Rgb::splat(front.direct);
            let before = front.transmittance.zip(arriving, |t, all| if all > F::zero() { t / all } else { F::one() });
            front.shift *= before;
            front.variance *= before;
            front.transmittance = arriving;
        }
        front.direct = F::zero();
        front.transmittance *= side.attenuation;
        front.shift += side.shift;
        front.variance += side.variance;
    }

    /// `n` fibers that all lie like this one, `n >= 0` and not necessarily whole; `theta` as for
    /// [`accumulate`](Self::accumulate). Between 0 and 1 a share of `n` meets one fiber.
    pub fn uniform(&self, n: F, theta: F) -> Front<F> {
        let side = lookup(&self.forward, -theta);
        let n = n.max(F::zero());
        let (met, crossed) = (n.min(F::one()), n.max(F::one()));
        if met.is_zero() {
            return Front::open();
        }
        Front {
            direct: F::one() - met,
            transmittance: side.attenuation.map(|a| met * a.powf(crossed)),
            shift: side.shift * crossed,
            variance: side.variance * crossed,
        }
    }

    /// `fcos` of the fiber and its surroundings: outgoing radiance per irradiance of a light from `light`.
    ///
    /// `front` is what lies between the place and that light.
    pub fn eval(&self, hit: &Hit<F>, light: Dir<F>, front: &Front<F>) -> Rgb<F> {
        let point = self.model.prepare(hit);
        let mut sum = Rgb::black();
        if front.direct > F::zero() {
            let around = self.local(hit.known, light, F::of(EVEN), &Front::open());
            sum += (point.eval(light).sum() + around) * front.direct;
        }
        if front.direct < F::one() {
            let even = F::of(EVEN * self.options.closure.flux());
            let around = self.local(hit.known, light, even, front);
            let on = self.global(&point, light, front);
            sum += (on + around) * front.transmittance * self.options.density_forward;
        }
        sum
    }

    /// The fiber in light that was scattered on its way: the mean of `fcos` over where it arrives from.
    fn global(&self, point: &M::Setup, light: Dir<F>, front: &Front<F>) -> Rgb<F> {
        let variance = front.variance.map(widened);
        let cones = front.shift.0.map(|shift| Cone::specular(-light.sin_theta, light.cos_theta, -shift));
        // One set of inclinations for all channels: from the lowest that any of them needs to the highest.
        let (mut low, mut high) = (FRAC_PI_2, -FRAC_PI_2);
        for (cone, v) in cones.iter().zip(variance.0) {
            let (centre, reach) = (cone.sin.atan2(cone.cos).f64(), REACH * v.f64().sqrt());
            low = low.min(centre - reach);
            high = high.max(centre + reach);
        }
        let (low, high) = (low.max(-FRAC_PI_2), high.min(FRAC_PI_2));
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        let around = rule(self.options.azimuths);
        let (mut sum, mut total) = (Rgb::black(), Rgb::<F>::black());
        for &(x, weight) in rule(self.options.inclinations) {
            let (sin, cos) = F::of(centre + half * x).sin_cos();
            let cos = cos.max(F::zero());
            let mut share = Rgb::black();
            for c in 0..3 {
                share[c] = longitudinal::density(variance[c], cones[c], sin, cos) * cos * F::of(weight);
            }
            let mut mean = Rgb::black();
            for &(x, weight) in around {
                let phi = light.phi + F::of(self.options.closure.spread(x));
                let from = Dir { sin_theta: sin, cos_theta: cos, phi };
                mean += point.eval(from).sum() * F::of(0.5 * weight);
            }
            sum += mean * share;
            total += share;
        }
        // The density integrates to 1; dividing by what the nodes make of it forgives nodes too far apart.
        sum.zip(total, |s, t| if t > F::zero() { s / t } else { F::zero() })
    }

    /// Light that the fibers behind send back, of a light whose share along one azimuth is `even`.
    fn local(&self, known: Dir<F>, light: Dir<F>, even: F, front: &Front<F>) -> Rgb<F> {
        let theta = F::of(0.5) * (known.theta() - light.theta());
        let table = if (light.phi - known.phi).cos() >= F::zero() { &self.returned } else { &self.passed };
        let side = lookup(table, theta);
        let mut out = Rgb::black();
        for c in 0..3 {
            let cone = Cone::specular(known.sin_theta, known.cos_theta, side.shift[c] + front.shift[c]);
            let v = widened(side.variance[c] + front.variance[c]);
            out[c] = side.attenuation[c] * longitudinal::density(v, cone, light.sin_theta, light.cos_theta);
        }
        out * (even * self.options.density_backward)
    }
}

/// Keeps a variance where the longitudinal density has its digits.
pub(super) fn widened<F: Real>(v: F) -> F {
    v.max(F::of(MIN_VARIANCE))
}

/// Inclination of entry `i` of `count`.
pub(super) fn table_theta(i: usize, count: usize) -> f64 {
    ((i as f64 + 0.5) / count as f64 - 0.5) * PI
}

/// A table at the inclination `theta` of the known direction, straight between entries.
pub(super) fn lookup<F: Real>(table: &[Side<F>], theta: F) -> Side<F> {
    let last = table.len() - 1;
    let at = ((theta.f64() / PI + 0.5) * table.len() as f64 - 0.5).clamp(0.0, last as f64);
    let low = (at as usize).min(last - 1);
    let t = F::of(at - low as f64);
    let (a, b) = (&table[low], &table[low + 1]);
    let mix = |a: Rgb<F>, b: Rgb<F>| a * (F::one() - t) + b * t;
    Side {
        attenuation: mix(a.attenuation, b.attenuation),
        shift: mix(a.shift, b.shift),
        variance: mix(a.variance, b.variance),
    }
}

/// Even points of the unit cube: a row of equal steps with the radical inverses to the first primes (Hammersley).
pub(super) fn points(count: usize) -> impl Iterator<Item = [f64; 1 + DIMS]> {
    const PRIMES: [usize; DIMS] = [2, 3, 5, 7, 11];
    let radical_inverse = |mut i: usize, base: usize| {
        let (mut x, mut digit) = (0.0, 1.0);
        while i > 0 {
            digit /= base as f64;
            x += digit * (i % base) as f64;
            i /= base;
        }
        x
    };
    (0..count).map(move |i| {
        let [a, b, c, d, e] = PRIMES.map(|base| radical_inverse(i, base));
        [(i as f64 + 0.5) / count as f64, a, b, c, d, e]
    })
}

/// What one fiber scatters on and back, at one inclination of the known direction.
fn averages<F: Real, M: Model<F>>(model: &M, closure: Closure, theta: f64, points: &[[f64; 1 + DIMS]]) -> [Side<F>; 2] {
    // Sums of weight, weight × d and weight × d², with d = θ_s + θ_k, per channel.
    let mut moments = [[[0.0_f64; 3]; 3]; 2];
    for &[h, a, b, c, d, e] in points {
        let hit = Hit::new(Dir::new(F::of(theta), F::zero()), F::of(2.0 * h - 1.0));
        // The largest number below 1 in single precision may be rounded up to 1 when it is converted.
        let u = [a, b, c, d, e].map(|u| F::of(u).min(F::ONE_MINUS_EPSILON));
        let Some(sample) = model.prepare(&hit).sample(u) else { continue };
        let weight = sample.weight.sum();
        let stray = sample.dir.theta().f64() + theta;
        let on = closure.forward_share(sample.dir.phi.f64());
        for (side, share) in moments.iter_mut().zip([on, 1.0 - on]) {
            for (channel, w) in side.iter_mut().zip(weight.0) {
                let w = w.f64() * share;
                for (power, sum) in channel.iter_mut().enumerate() {
                    *sum += w * stray.powi(power as i32);
                }
            }
        }
    }
    let n = points.len() as f64;
    // Models that make light would never let it end.
    let shares = [0, 1].map(|side| [0, 1, 2].map(|c| moments[side][c][0] / n));
    let excess = [0, 1, 2].map(|c| ((shares[0][c] + shares[1][c]) / MOST).max(1.0));
    [0, 1].map(|side| {
        let mut out = Side { variance: Rgb::splat(F::of(MIN_VARIANCE)), ..Side::default() };
        for (c, excess) in excess.iter().enumerate() {
            let [w, wd, wdd] = moments[side][c];
            if w > 0.0 {
                let mean = wd / w;
                out.attenuation[c] = F::of(shares[side][c] / excess);
                out.shift[c] = F::of(mean);
                out.variance[c] = F::of((wdd / w - mean * mean).max(MIN_VARIANCE));
            }
        }
        out
    })
}

/// What the fibers behind return: shifts and variances add up over the scatterings that light went through.
fn behind<F: Real>(f: &Side<F>, b: &Side<F>, series: fn(F, F) -> Returned<F>) -> Side<F> {
    let mut out = Side::default();
    for c in 0..3 {
        let r = series(f.attenuation[c], b.attenuation[c]);
        out.attenuation[c] = r.share;
        out.shift[c] = r.forwards * f.shift[c] + r.backwards * b.shift[c];
        out.variance[c] = r.forwards * f.variance[c] + r.backwards * b.variance[c];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::finish;
    use crate::quadrature::integrate;
    use crate::{Chiang, Lobes, RESIDUAL, Sample};

    /// Scatters evenly over the sphere: all averages are known.
    #[derive(Clone, Copy)]
    struct Even {
        albedo: f64,
    }

    impl Model<f64> for Even {
        type Setup = Self;

        fn prepare(&self, _: &Hit<f64>) -> Self {
            *self
        }
    }

    impl Scatter<f64> for Even {
        fn eval(&self, _: Dir<f64>) -> Lobes<f64> {
            Lobes::only(RESIDUAL, Rgb::splat(self.albedo / (4.0 * PI)))
        }

        fn pdf(&self, _: Dir<f64>) -> f64 {
            0.25 / PI
        }

        fn sample(&self, u: [f64; DIMS]) -> Option<Sample<f64>> {
            let dir = Dir::from_sin(2.0 * u[0] - 1.0, 2.0 * PI * u[1]);
            finish(dir, self.eval(dir), self.pdf(dir), RESIDUAL)
        }
    }

    fn hair(sigma_a: f64) -> Chiang<f64> {
        Chiang::with_absorption(Rgb::splat(sigma_a))
    }

    /// Light among rows of fibers, row by row and event by event: share and mean number of forward scatterings of
    /// what leaves the first row upwards, by how often it turned.
    fn walk_among_rows(f: f64, b: f64) -> [(f64, f64); 6] {
        const ROWS: usize = 120;
        const TURNS: usize = 6;
        let mut out = [(0.0, 0.0); TURNS];
        // Light that is about to meet a row, going up or down: (share, share × forward scatterings).
        let mut now = vec![[[(0.0, 0.0); TURNS]; 2]; ROWS + 1];
        now[1][0][0] = (1.0, 0.0);
        for _ in 0..400 {
            let mut next = vec![[[(0.0_f64, 0.0_f64); TURNS]; 2]; ROWS + 1];
            // Row 0 is above the first and stays empty.
            for (row, meeting) in now.iter().enumerate().skip(1) {
                for (up, by_turns) in meeting.iter().enumerate() {
                    for (turns, &(share, forwards)) in by_turns.iter().enumerate() {
                        let mut send = |up: usize, turns: usize, share: f64, forwards: f64| {
                            if turns == TURNS || (up == 0 && row == ROWS) {
                                return;
                            }
                            let to = match (up, row) {
                                (1, 1) => &mut out[turns],
                                (1, _) => &mut next[row - 1][1][turns],
                                _ => &mut next[row + 1][0][turns],
                            };
                            to.0 += share;
                            to.1 += forwards;
                        };
                        send(up, turns, f * share, f * (forwards + share));
                        send(1 - up, turns + 1, b * share, b * forwards);
                    }
                }
            }
            now = next;
        }
        out
    }

    #[test]
    fn rows_are_the_sum_over_their_paths() {
        for (f, b) in [(0.6, 0.2), (0.75, 0.2), (0.3, 0.5), (0.1, 0.05)] {
            let out = walk_among_rows(f, b);
            // What turned once without a forward scattering is the first fiber's own, which is no part of the sum.
            let (once, thrice) = ((out[1].0 - b, out[1].1), out[3]);
            let a: f64 = f * f;
            assert!((once.0 / (b * a / (1.0 - a)) - 1.0).abs() < 1e-9, "A1: {}", once.0);
            assert!((thrice.0 / (b.powi(3) * a / (1.0 - a).powi(3)) - 1.0).abs() < 1e-9, "A3: {}", thrice.0);
            let share = once.0 + thrice.0;
            let got = rows_returned(f, b);
            assert!((got.share / share - 1.0).abs() < 1e-9, "{got:?}: {share}");
            assert!((got.forwards / ((once.1 + thrice.1) / share) - 1.0).abs() < 1e-9, "{got:?}");
            assert!((got.backwards / ((once.0 + 3.0 * thrice.0) / share) - 1.0).abs() < 1e-9, "{got:?}");
        }
    }

    #[test]
    fn shifts_of_light_that_turns_more_often_add_up() {
        // The published linearisation of the mean number of turns is 1 - 2 b²/(1-f²)², less than the one turn that
        // every path has; the sum over the paths says 1 + 2 b²/(1-f²)² to first order.
        for (f, b) in [(0.6, 0.05), (0.8, 0.02)] {
            let ratio: f64 = (b / (1.0 - f * f)) * (b / (1.0 - f * f));
            let out = walk_among_rows(f, b);
            let turns = (out[1].0 - b + 3.0 * out[3].0) / (out[1].0 - b + out[3].0);
            assert!((turns - (1.0 + 2.0 * ratio)).abs() < 4.0 * ratio * ratio, "{turns}");
            // The linearisation of the forward scatterings agrees with the published one.
            let forwards = (out[1].1 + out[3].1) / (out[1].0 - b + out[3].0);
            let a = f * f;
            let published = (2.0 * (1.0 - a) * (1.0 - a) + 4.0 * a * b * b) / (1.0 - a).powi(3);
            assert!((forwards / published - 1.0).abs() < 6.0 * ratio * ratio, "{forwards} and {published}");
        }
    }

    #[test]
    fn a_medium_is_the_limit_of_thicker_and_thicker_slabs() {
        // Adding a thin layer to a slab of albedo R: dR/dτ = b - 2 (1-f) R + b R².
        let albedo = |f: f64, b: f64| {
            let slope = |r: f64| b - 2.0 * (1.0 - f) * r + b * r * r;
            let (mut r, step) = (0.0, 0.01);
            for _ in 0..20_000 {
                let k1 = slope(r);
                let k2 = slope(r + 0.5 * step * k1);
                let k3 = slope(r + 0.5 * step * k2);
                let k4 = slope(r + step * k3);
                r += step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            }
            r
        };
        for (f, b) in [(0.75, 0.15), (0.6, 0.3), (0.1, 0.05)] {
            let r = albedo(f, b);
            let (back, on) = (medium_returned(f, b), medium_passed(f, b));
            assert!((back.share / (f * r) - 1.0).abs() < 1e-10, "{back:?}: {r}");
            assert!((on.share / (b * r) - 1.0).abs() < 1e-10, "{on:?}: {r}");
            // Every factor f or b of a path is one event: their mean numbers are logarithmic derivatives.
            let e = 1e-4;
            let derivative = |up: f64, down: f64| (up.ln() - down.ln()) / (2.0 * e);
            let by_f = derivative(albedo(f * (1.0 + e), b), albedo(f * (1.0 - e), b));
            let by_b = derivative(albedo(f, b * (1.0 + e)), albedo(f, b * (1.0 - e)));
            // Differences of this width are good to e² times the third derivative.
            assert!((back.forwards - 1.0 - by_f).abs() < 1e-4 && (on.forwards - by_f).abs() < 1e-4, "{by_f}");
            assert!((back.backwards - by_b).abs() < 1e-4 && (on.backwards - 1.0 - by_b).abs() < 1e-4, "{by_b}");
        }
    }

    #[test]
    fn hair_that_absorbs_nothing_never_ends_but_stays_finite() {
        let all: [fn(f32, f32) -> Returned<f32>; 3] = [rows_returned, medium_returned, medium_passed];
        for series in all {
            for (f, b) in [(0.8, 0.2), (0.999_999, 0.0), (0.0, 0.999_999), (0.0, 0.0)] {
                let r = series(f, b);
                assert!(r.share >= 0.0 && r.share.is_finite(), "{f} {b}: {r:?}");
                assert!(r.forwards.is_finite() && r.backwards.is_finite(), "{f} {b}: {r:?}");
            }
        }
        assert!((medium_returned(0.8, 0.2 - 1e-9).share / 0.8 - 1.0_f64).abs() < 0.01);
    }

    #[test]
    fn white_fibers_scatter_on_or_back() {
        for closure in [Closure::Medium, Closure::Rows] {
            let white = DualScattering::new(hair(0.0), Options { closure, samples: 512, ..Options::default() });
            let tables = white.tables();
            for (f, b) in tables.forward.iter().zip(tables.backward) {
                let sum = f.attenuation + b.attenuation;
                assert!(sum.0.iter().all(|s| (s - MOST).abs() < 1e-12), "{sum:?}");
            }
        }
    }

    #[test]
    fn tables_are_the_integrals_over_the_model() {
        let model = Chiang::<f64>::with_absorption(Rgb::new(0.05, 0.2, 1.0));
        for closure in [Closure::Medium, Closure::Rows] {
            let points: Vec<_> = points(Options::<f64>::default().samples).collect();
            for theta in [0.0, -0.6, 0.9] {
                let got = averages::<f64, _>(&model, closure, theta, &points);
                let mut want = [[[0.0; 3]; 3]; 2];
                let (offsets, around) = (24, 64);
                for &(x, w) in rule(offsets) {
                    let point = model.prepare(&Hit::new(Dir::new(theta, 0.0), (FRAC_PI_2 * x).sin()));
                    let w = w * 0.25 * PI * (FRAC_PI_2 * x).cos();
                    for j in 0..around {
                        // Shifted from offset to offset, so that all together are fine enough for the lobes.
                        let phi = 2.0 * PI * (f64::from(j) + (31.7 * x).fract()) / f64::from(around);
                        let on = closure.forward_share(phi);
                        for power in 0..3 {
                            #[expect(clippy::needless_range_loop, reason = "a channel of two arrays and of a colour")]
                            for c in 0..3 {
                                let moment = integrate(-FRAC_PI_2, FRAC_PI_2, 48, |t| {
                                    let fcos = point.eval(Dir::new(t, phi)).sum()[c];
                                    fcos * t.cos() * (t + theta).powi(power)
                                });
                                let moment = moment * w * 2.0 * PI / f64::from(around);
                                want[0][c][power as usize] += on * moment;
                                want[1][c][power as usize] += (1.0 - on) * moment;
                            }
                        }
                    }
                }
                for (got, want) in got.iter().zip(want) {
                    for (c, [w, wd, wdd]) in want.into_iter().enumerate() {
                        let (mean, variance) = (wd / w, wdd / w - wd * wd / w / w);
                        // What 16384 points were measured to be good for, see `Options::samples`.
                        assert!((got.attenuation[c] / w - 1.0).abs() < 0.005, "{theta}: {got:?}, wanted {w}");
                        assert!((got.shift[c] - mean).abs() < 0.006, "{theta}: {got:?}, wanted {mean}");
                        assert!((got.variance[c] / variance - 1.0).abs() < 0.06, "{theta}: {got:?}, {variance}");
                    }
                }
            }
        }
    }

    #[test]
    fn even_scattering_has_even_halves_and_spreads_into_itself() {
        let albedo = 0.8;
        for closure in [Closure::Medium, Closure::Rows] {
            let options = Options::<f64> { closure, density_backward: 0.0, density_forward: 0.9, ..Options::default() };
            let hair = DualScattering::new(Even { albedo }, options);
            for side in hair.tables().forward.iter().chain(hair.tables().backward) {
                assert!((side.attenuation[1] - 0.5 * albedo).abs() < 1e-3, "{side:?}");
            }
            let hit = Hit::new(Dir::new(0.3, 1.0), 0.0);
            let light = Dir::new(-0.4, 2.0);
            let value = albedo / (4.0 * PI);
            assert_eq!(hair.eval(&hit, light, &Front::open()), Rgb::splat(value));
            let mut front = Front::open();
            for _ in 0..3 {
                hair.accumulate(&mut front, -0.4);
            }
            let want = front.transmittance * (0.9 * value);
            let off = (hair.eval(&hit, light, &front) - want).map(|x: f64| x.abs()).max_channel();
            assert!(off < 1e-12, "{off}");
        }
    }

    #[test]
    fn scattered_light_of_many_fibers_keeps_its_energy_on_the_sphere() {
        // The mean over all lights of a mean over where their light arrives from is the mean over all directions:
        // ∫ dω over light directions of the spread light is the model's albedo for every front.
        let options = Options::<f64> { samples: 1024, density_backward: 0.0, ..Options::default() };
        let hair = DualScattering::new(hair(0.3), options);
        let hit = Hit::new(Dir::new(0.2, 0.0), 0.3);
        let point = hair.model().prepare(&hit);
        let over_sphere = |f: &dyn Fn(Dir<f64>) -> f64| {
            let around = 96;
            let ring = |t: f64| -> f64 {
                let angle = 2.0 * PI / f64::from(around);
                (0..around).map(|j| f(Dir::new(t, angle * f64::from(j)))).sum::<f64>() * angle * t.cos()
            };
            integrate(-FRAC_PI_2, FRAC_PI_2, 48, ring)
        };
        let albedo = over_sphere(&|s| point.eval(s).sum()[1]);
        for variance in [0.05, 0.5] {
            let front = Front { variance: Rgb::splat(variance), direct: 0.0, ..Front::open() };
            let spread = over_sphere(&|light| hair.global(&point, light, &front)[1]);
            // The density is symmetric in its two inclinations, so exchanging them changes nothing; what is left is
            // the error of nodes, above all where lobes of width 0.15 are seen by 32 of them.
            assert!((spread / albedo - 1.0).abs() < 0.01, "{variance}: {spread} and {albedo}");
        }
    }

    #[test]
    fn crossing_fibers_one_by_one_is_crossing_them_at_once() {
        let hair = DualScattering::new(hair(0.4), Options { samples: 512, ..Options::default() });
        let mut front = Front::open();
        assert_eq!(hair.uniform(0.0, 0.3), front);
        for n in 1..6 {
            hair.accumulate(&mut front, 0.3);
            let at_once = hair.uniform(f64::from(n), 0.3);
            assert_eq!(at_once.direct, 0.0);
            for c in 0..3 {
                assert!((at_once.transmittance[c] / front.transmittance[c] - 1.0).abs() < 1e-12);
                assert!((at_once.shift[c] - front.shift[c]).abs() < 1e-12);
                assert!((at_once.variance[c] - front.variance[c]).abs() < 1e-12);
            }
        }
        // Half a fiber: half of the light passes, the other half crosses one.
        let half = hair.uniform(0.5, 0.3);
        assert!((half.direct - 0.5).abs() < 1e-12);
        assert!((half.transmittance[0] / hair.uniform(1.0, 0.3).transmittance[0] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn shifts_have_the_sign_of_the_tilt() {
        // Transmitted light strays by -α at every fiber, reflected light by 2α (and -4α in the broad TRT lobe).
        for alpha in [-0.05, 0.05] {
            let model = Chiang { alpha, ..hair(0.2) };
            let hair = DualScattering::new(model, Options { samples: 4096, ..Options::default() });
            let shift = lookup(hair.tables().forward, 0.0).shift[0];
            assert!(shift * alpha < 0.0 && shift.abs() > 0.5 * alpha.abs(), "{alpha}: {shift}");
            // Every fiber turns light the same way, the last one too, so viewers on that side see more of it.
            let mut front = Front::open();
            for _ in 0..4 {
                hair.accumulate(&mut front, 0.0);
            }
            let side = |theta: f64| {
                let hit = Hit::new(Dir::new(theta, PI), 0.0);
                hair.eval(&hit, Dir::new(0.0, 0.0), &front)[0]
            };
            let (towards, away) = (side(shift.signum() * 0.4), side(-shift.signum() * 0.4));
            assert!(towards > 1.2 * away, "{alpha}: {towards} and {away}");
        }
    }

    #[test]
    fn single_precision_follows_double() {
        let sigma_a = [0.1, 0.4, 1.0];
        let double = DualScattering::new(Chiang::<f64>::with_absorption(Rgb(sigma_a)), Options::default());
        let single =
            DualScattering::new(Chiang::<f32>::with_absorption(Rgb(sigma_a.map(|s| s as f32))), Options::default());
        for (theta, phi, crossed) in [(0.1, 0.4, 0), (-0.5, 2.5, 3), (0.9, -1.0, 12), (-1.3, 3.0, 1)] {
            let light = Dir::<f64>::new(theta, phi);
            let known = Dir::<f64>::new(-0.3, 0.0);
            let want = double.eval(&Hit::new(known, 0.4), light, &double.uniform(f64::from(crossed), theta));
            let front = single.uniform(crossed as f32, theta as f32);
            let got = single.eval(&Hit::new(known.cast(), 0.4), light.cast(), &front).cast::<f64>();
            for c in 0..3 {
                // Draws on the border between two lobes fall to either side: a few of 16384.
                assert!((got[c] / want[c] - 1.0).abs() < 0.02, "{theta} {phi} {crossed}: {got:?} and {want:?}");
            }
        }
    }
}
