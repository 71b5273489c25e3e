//! Every sampler against its own density, over the grid of parameters of the project's model notes: the slow suite,
//! which runs with the feature `slow` only. The fast one is `tests/conformance.rs`.
//!
//! A case draws a million directions and compares their histogram (24 bins in `sin θ_s` by 36 in azimuth) with the
//! integral of the density over every bin, by a χ² in which bins with fewer than 10 expected draws are pooled. The
//! density must also integrate to 1 within 1e-3, together with the draws that a model gives up on purpose. The 954
//! cases together raise a false alarm with probability 1e-3 (Šidák); the random numbers are hashes of what they
//! are for, so a case that passes once passes always.
//!
//! The grid: `θ_k` of 0, ±30, ±60, ±80, ±85 degrees; widths of 5, 10, 20 degrees (exponents of 3, 25, 100; or
//! roughnesses); tilts of 0, -3, 5 degrees; absorption of 0, 0.2, 1 per radius. 9 by 3 by 3 of these are tried in
//! full, but where that would take too long a further parameter is not another factor: it runs through its values
//! along the grid as in a Latin square, so that any two values of any two parameters still meet in some case.
//!
//! | model | cases | in full | along the grid |
//! |---|---|---|---|
//! | Kajiya and Kay, one highlight, normalised | 81 | `θ_k`, exponent, shift | |
//! | Kajiya and Kay, two highlights, thesis | 27 | `θ_k`, exponent | shift |
//! | Lambertian | 9 | `θ_k` | |
//! | Hery and Ramamoorthi, truncated; exact | 162 | mode, `θ_k`, width, shift | |
//! | Sadeghi et al., normalised | 81 | `θ_k`, width, shift | |
//! | Sadeghi et al., legacy | 27 | `θ_k`, width | shift |
//! | Chiang et al. | 243 | `θ_k`, roughnesses, tilt, absorption | offset of 4 |
//! | d'Eon et al., near field | 81 | `θ_k`, width, tilt | absorption |
//! | d'Eon et al., far field | 81 | `θ_k`, width, tilt | absorption |
//! | Marschner et al. | 81 | `θ_k`, width, shift | absorption; smoothed or raw, exact or cubic |
//! | fur | 81 | `θ_k`, width, tilt | absorption, medulla of 2, offset of 3 |
//!
//! Three models need more than the plain quadrature of 8 by 8 nodes for every bin and every piece of a lobe:
//!
//! - Marschner's density has the caustics of TRT, inverse square roots, also where the value is smoothed. The
//!   quadrature over the azimuth goes up to them from both sides in a variable that takes the root away.
//! - The far field of d'Eon's model costs a quadrature for every density. The sampler in double precision is held
//!   against the density in single precision, which is the faster; the two densities are compared on the way.
//! - The Lambertian fiber has closed forms for the bins, to which the quadrature is held too.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};
use std::io::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use fiber::lobe::caustic::Fold;
use fiber::lobe::roots::{ExitCurve, inverse_index};
use fiber::quadrature::rule;
use fiber::{
    ArtistLobe, Caustic, Chiang, DIMS, Deon, Dir, Fiber, Field, Fur, Hery, HeryMode, Highlight, Hit, KajiyaKay,
    KajiyaKayMode, Lambertian, Marschner, Medulla, Model, Roots, Sadeghi, SadeghiMode, Scatter, TRT, Weights,
    wrap_angle,
};
use math::{Rgb, hash, normal};

/// Directions drawn in each case.
const DRAWS: u32 = 1_000_000;

/// How many cases there are, which sets the level at which one raises an alarm.
const CASES: usize = 954;

const ROWS: usize = 24;
const COLUMNS: usize = 36;

/// Bins with fewer expected counts are too far from a normal distribution for a χ².
const MIN_EXPECTED: f64 = 10.0;

/// Azimuth of every known direction: not 0, so that an azimuth taken as absolute is found out.
const KNOWN_PHI: f64 = 0.7;

// --- The grid

const THETAS_DEG: [f64; 9] = [0.0, 30.0, -30.0, 60.0, -60.0, 80.0, -80.0, 85.0, -85.0];
const BETAS_DEG: [f64; 3] = [5.0, 10.0, 20.0];
const ALPHAS_DEG: [f64; 3] = [0.0, -3.0, 5.0];
const SIGMAS: [f64; 3] = [0.0, 0.2, 1.0];

/// In place of the widths, for Kajiya and Kay.
const EXPONENTS: [f64; 3] = [100.0, 25.0, 3.0];
/// In place of the widths, for Chiang et al.: longitudinal and azimuthal.
const ROUGHNESSES: [(f64, f64); 3] = [(0.1, 0.3), (0.3, 0.6), (0.6, 1.0)];

/// A point of the grid: indices of inclination, width and tilt.
#[derive(Clone, Copy)]
struct Place {
    theta: usize,
    beta: usize,
    alpha: usize,
}

impl Place {
    fn all() -> Vec<Self> {
        let mut places = Vec::new();
        for theta in 0..THETAS_DEG.len() {
            for beta in 0..BETAS_DEG.len() {
                for alpha in 0..ALPHAS_DEG.len() {
                    places.push(Self { theta, beta, alpha });
                }
            }
        }
        places
    }

    /// A third of the grid in which any two values of any two parameters meet once or more.
    fn third() -> Vec<Self> {
        Self::all().into_iter().filter(|place| place.along([1, 1, 1], 3) == 0).collect()
    }

    /// A further parameter of this many values, which runs along the grid.
    fn along(&self, steps: [usize; 3], values: usize) -> usize {
        (steps[0] * self.theta + steps[1] * self.beta + steps[2] * self.alpha) % values
    }

    fn theta_k(&self) -> f64 {
        THETAS_DEG[self.theta].to_radians()
    }

    fn beta(&self) -> f64 {
        BETAS_DEG[self.beta].to_radians()
    }

    fn alpha(&self) -> f64 {
        ALPHAS_DEG[self.alpha].to_radians()
    }

    /// Absorption that runs along the grid, a little more of it in blue.
    fn sigma_a(&self) -> Rgb<f64> {
        absorption(SIGMAS[self.along([1, 1, 1], 3)])
    }
}

fn absorption(sigma_a: f64) -> Rgb<f64> {
    Rgb([1.0, 1.1, 1.3]) * sigma_a
}

/// How the mass of a bin is found.
#[derive(Clone, Copy)]
enum Density {
    /// By quadrature of the model's own density.
    Double,
    /// By quadrature of its density in single precision.
    Single,
    /// In closed form: the Lambertian fiber's.
    Closed,
}

struct Case {
    name: String,
    fiber: Fiber<f64>,
    known: Dir<f64>,
    h: f64,
    /// Centre and standard deviation in `θ_s` of every lobe, radians.
    lobes: Vec<(f64, f64)>,
    /// Inclinations at which the density jumps or bends.
    kinks: Vec<f64>,
    /// Share of the draws that the sampler gives up on purpose.
    lost: f64,
    density: Density,
}

impl Case {
    /// At a point of the grid; `lobes` are shifts from the specular cone and widths, in `θ_s`.
    fn new(name: &str, fiber: impl Into<Fiber<f64>>, place: &Place, lobes: &[(f64, f64)]) -> Self {
        let theta_k = place.theta_k();
        Self {
            name: format!("{name}, θ_k = {}°", THETAS_DEG[place.theta]),
            fiber: fiber.into(),
            known: Dir::new(theta_k, KNOWN_PHI),
            h: 0.3,
            lobes: lobes.iter().map(|&(shift, width)| (shift - theta_k, width)).collect(),
            kinks: Vec::new(),
            lost: 0.0,
            density: Density::Double,
        }
    }

    fn hit(&self) -> Hit<f64> {
        Hit::new(self.known, self.h)
    }

    /// How far from the known direction the caustics are, for an inclination.
    fn caustic(&self, theta: f64) -> Option<f64> {
        let Fiber::Marschner(model) = &self.fiber else { return None };
        let cos2 = (0.5 * (theta - self.known.theta())).cos().powi(2);
        let curve = ExitCurve::new(model.roots, TRT, inverse_index(cos2, model.eta));
        Fold::of(&curve).map(|fold| fold.azimuth.abs())
    }

    /// Where the inclinations are cut into pieces: around every lobe at 1, 2, 4 and 8 widths, and at kinks.
    fn cuts(&self) -> Vec<f64> {
        let fold = |theta: f64| if theta.abs() > FRAC_PI_2 { theta.signum() * PI - theta } else { theta };
        let narrowest = self.lobes.iter().map(|&(_, width)| width).fold(FRAC_PI_4, f64::min);
        let mut cuts = vec![-FRAC_PI_4, 0.0, FRAC_PI_4];
        for &(centre, width) in &self.lobes {
            for step in [-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0] {
                cuts.push(fold(centre + step * width));
            }
        }
        // Pieces much smaller than the narrowest lobe would cost and tell nothing.
        cuts.retain(|theta| theta.abs() < FRAC_PI_2 - 0.4 * narrowest);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|next, last| *next - *last < 0.4 * narrowest);
        cuts.extend(self.kinks.iter().copied().filter(|theta| theta.abs() < FRAC_PI_2));
        cuts.sort_by(f64::total_cmp);
        cuts
    }
}

// --- The models

fn kajiya_kay_cases() -> Vec<Case> {
    // Both ends of a cone, also as folded over either pole.
    let kinks = |centre: f64| {
        let ends = [centre - FRAC_PI_2, centre + FRAC_PI_2];
        ends.into_iter().flat_map(|end| [end, PI - end, -PI - end])
    };
    let highlight = |color: [f64; 3], exponent: f64, shift: f64| Highlight { color: Rgb(color), exponent, shift };
    let lobe = |highlight: &Highlight<f64>| (2.0 * highlight.shift, highlight.exponent.sqrt().recip());

    let mut cases = Vec::new();
    for place in Place::all() {
        let exponent = EXPONENTS[place.beta];
        let first = highlight([0.5, 0.55, 0.6], exponent, place.alpha());
        let model = KajiyaKay {
            diffuse: Rgb([0.4, 0.3, 0.2]),
            highlights: [first, Highlight::none()],
            mode: KajiyaKayMode::Normalised,
        };
        let name = format!("Kajiya-Kay, m = {exponent}, α = {}°", ALPHAS_DEG[place.alpha]);
        cases.push(Case {
            kinks: kinks(2.0 * first.shift - place.theta_k()).collect(),
            ..Case::new(&name, model, &place, &[lobe(&first)])
        });
    }
    for place in Place::third() {
        let exponent = EXPONENTS[place.beta];
        let first = highlight([0.3; 3], exponent, place.alpha());
        let second = highlight([0.4, 0.25, 0.1], 12.0, 8.0_f64.to_radians());
        let model = KajiyaKay { diffuse: Rgb([0.05; 3]), highlights: [first, second], mode: KajiyaKayMode::Thesis };
        let name = format!("Kajiya-Kay, two highlights, m = {exponent}, α = {}°", ALPHAS_DEG[place.alpha]);
        cases.push(Case {
            kinks: [first, second].iter().flat_map(|lobe| kinks(2.0 * lobe.shift - place.theta_k())).collect(),
            ..Case::new(&name, model, &place, &[lobe(&first), lobe(&second)])
        });
    }
    cases
}

fn lambertian_cases() -> Vec<Case> {
    let places = (0..THETAS_DEG.len()).map(|theta| Place { theta, beta: 0, alpha: 0 });
    let model = Lambertian { albedo: Rgb([0.9, 0.5, 0.1]) };
    places.map(|place| Case { density: Density::Closed, ..Case::new("Lambertian", model, &place, &[]) }).collect()
}

fn hery_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for place in Place::all() {
        for mode in [HeryMode::Truncated, HeryMode::FaithfulExactPdf] {
            let (alpha, beta) = (place.alpha(), place.beta());
            let model = Hery { mode, ..Hery::single(Rgb([1.0, 0.8, 0.3]), beta, alpha) };
            let name =
                format!("Hery-Ramamoorthi, {mode:?}, β = {}°, α = {}°", BETAS_DEG[place.beta], ALPHAS_DEG[place.alpha]);
            // The half angle has the width β, the scattered direction twice that.
            let mut case = Case::new(&name, model, &place, &[(2.0 * alpha, 2.0 * beta)]);
            if mode == HeryMode::FaithfulExactPdf {
                let centre = 2.0 * alpha - place.theta_k();
                // The paper's clamp puts all that is further out into two atoms, which the exact mode drops.
                let most = FRAC_PI_2 - 0.5 * centre.abs();
                case.lost = 2.0 * normal::cdf(-most / beta);
                // Where a branch begins, unfolded and folded.
                case.kinks = vec![0.0, PI - 2.0 * centre.abs(), 2.0 * centre.abs() - PI];
            }
            cases.push(case);
        }
    }
    cases
}

fn sadeghi_cases() -> Vec<Case> {
    let modes = [(SadeghiMode::Normalised, Place::all()), (SadeghiMode::Legacy, Place::third())];
    let mut cases = Vec::new();
    for (mode, places) in modes {
        for place in places {
            // Colour, intensity, shift and width of R, TT and TRT as in Marschner's table.
            let shapes = [
                ([1.0, 0.95, 0.9], 0.45, 1.0, 1.0),
                ([0.9, 0.5, 0.2], 0.25, -0.5, 0.5),
                ([0.8, 0.4, 0.15], 0.3, -1.5, 2.0),
            ];
            let lobes = shapes.map(|(color, intensity, shift, width)| ArtistLobe {
                color: Rgb(color),
                intensity,
                shift: shift * place.alpha(),
                width: width * place.beta(),
            });
            let model = Sadeghi { lobes, mode, ..Sadeghi::default() };
            let name = format!("Sadeghi, {mode:?}, β = {}°, α = {}°", BETAS_DEG[place.beta], ALPHAS_DEG[place.alpha]);
            let lobes = lobes.map(|lobe| (2.0 * lobe.shift, 2.0 * lobe.width));
            cases.push(Case::new(&name, model, &place, &lobes));
        }
    }
    cases
}

fn chiang_cases() -> Vec<Case> {
    const OFFSETS: [f64; 4] = [-0.95, -0.3, 0.0, 0.8];
    let mut cases = Vec::new();
    for place in Place::all() {
        for (i, sigma_a) in SIGMAS.into_iter().enumerate() {
            let (beta_m, beta_n) = ROUGHNESSES[place.beta];
            let alpha = place.alpha();
            let model = Chiang { beta_m, beta_n, alpha, eta: 1.55, sigma_a: absorption(sigma_a), field: Field::Near };
            let [r, tt, trt, rest] = model.variances().map(f64::sqrt);
            let lobes = [(2.0 * alpha, r), (-alpha, tt), (-4.0 * alpha, trt), (0.0, rest)];
            let h = OFFSETS[(place.along([1, 1, 1], 4) + i) % 4];
            let name = format!(
                "Chiang, β_M = {beta_m}, β_N = {beta_n}, α = {}°, σ_a = {sigma_a}, h = {h}",
                ALPHAS_DEG[place.alpha]
            );
            cases.push(Case { h, ..Case::new(&name, model, &place, &lobes) });
        }
    }
    cases
}

/// Shifts and widths of R, TT, TRT and the rest, as d'Eon et al. have them.
fn deon_lobes(alpha: f64, beta: f64) -> [(f64, f64); 4] {
    [(2.0 * alpha, beta), (-alpha, 0.5 * beta), (-4.0 * alpha, 2.0 * beta), (0.0, 2.0 * beta)]
}

/// The parameters that run along the grid, in words.
fn look(place: &Place) -> String {
    let sigma_a = SIGMAS[place.along([1, 1, 1], 3)];
    format!("β = {}°, α = {}°, σ_a = {sigma_a}", BETAS_DEG[place.beta], ALPHAS_DEG[place.alpha])
}

fn deon_cases(field: Field) -> Vec<Case> {
    let far = field == Field::Far;
    let mut cases = Vec::new();
    for place in Place::all() {
        let (alpha, beta) = (place.alpha(), place.beta());
        let model = Deon {
            beta_m: beta,
            beta_n: beta,
            alpha,
            // In the far field joint weights draw the same directions without a quadrature for each.
            weights: if far { Weights::Joint } else { Weights::Marginal },
            field,
            ..Deon::with_absorption(place.sigma_a())
        };
        let name = format!("d'Eon, {field:?} field, {}", look(&place));
        cases.push(Case {
            density: if far { Density::Single } else { Density::Double },
            ..Case::new(&name, model, &place, &deon_lobes(alpha, beta))
        });
    }
    cases
}

fn marschner_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for place in Place::all() {
        let forms = [(true, Roots::Exact), (false, Roots::Exact), (true, Roots::Cubic), (false, Roots::Cubic)];
        let (smooth, roots) = forms[place.along([1, 2, 3], 4)];
        let model = Marschner {
            beta_m: place.beta(),
            alpha: place.alpha(),
            roots,
            caustic: smooth.then(Caustic::default),
            ..Marschner::with_absorption(place.sigma_a())
        };
        let lobes: Vec<(f64, f64)> =
            model.shifts().into_iter().zip(model.widths()).map(|(shift, width)| (2.0 * shift, 2.0 * width)).collect();
        let caustics = if smooth { "smoothed" } else { "raw" };
        let name = format!("Marschner, {caustics}, {roots:?} roots, {}", look(&place));
        cases.push(Case::new(&name, model, &place, &lobes));
    }
    cases
}

fn fur_cases() -> Vec<Case> {
    const OFFSETS: [f64; 3] = [-0.5, 0.3, 0.8];
    let medullas = [
        Medulla { radius: 0.6, scattering: 2.0, absorption: Rgb::black(), anisotropy: 0.4 },
        Medulla { radius: 0.9, scattering: 10.0, absorption: Rgb([0.0, 0.1, 0.2]), anisotropy: 0.0 },
    ];
    let mut cases = Vec::new();
    for place in Place::all() {
        let (alpha, beta) = (place.alpha(), place.beta());
        let medulla = medullas[place.along([1, 1, 1], 2)];
        let h = OFFSETS[place.along([1, 2, 0], 3)];
        let model = Fur { beta_m: beta, beta_n: beta, alpha, medulla, ..Fur::with_absorption(place.sigma_a()) };
        let name = format!("fur, medulla of {}, {}, h = {h}", medulla.radius, look(&place));
        // What is scattered is broad.
        let lobes = [&deon_lobes(alpha, beta)[..], &[(0.0, 0.5)]].concat();
        cases.push(Case { h, ..Case::new(&name, model, &place, &lobes) });
    }
    cases
}

// --- The mass of every bin

/// Gauss-Legendre nodes and weights between `from` and `to`; with `roots`, such that inverse square roots at both
/// ends are integrated too: the node is the sine of an angle, whose cosine takes the root away.
fn nodes(from: f64, to: f64, roots: bool) -> impl Iterator<Item = (f64, f64)> {
    let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
    rule(8).iter().map(move |&(x, w)| {
        if roots {
            let (sin, cos) = (FRAC_PI_2 * x).sin_cos();
            (centre + half * sin, w * half * FRAC_PI_2 * cos)
        } else {
            (centre + half * x, w * half)
        }
    })
}

/// Inclination at the lower edge of a row.
fn row_edge(row: usize) -> f64 {
    (2.0 * row as f64 / ROWS as f64 - 1.0).clamp(-1.0, 1.0).asin()
}

/// Azimuth at the left edge of a column, relative to the known direction.
fn column_edge(column: usize) -> f64 {
    TAU * column as f64 / COLUMNS as f64 - PI
}

/// The bins by quadrature.
fn integrate(case: &Case, pdf: impl Fn(Dir<f64>) -> f64) -> Vec<f64> {
    let cuts = case.cuts();
    let marschner = matches!(case.fiber, Fiber::Marschner(_));
    let mut masses = vec![0.0; ROWS * COLUMNS];
    for (i, row) in masses.chunks_exact_mut(COLUMNS).enumerate() {
        let (low, high) = (row_edge(i), row_edge(i + 1));
        let mut edges = vec![low];
        edges.extend(cuts.iter().copied().filter(|&cut| cut > low && cut < high));
        edges.push(high);
        for piece in edges.windows(2) {
            for (theta, along) in nodes(piece[0], piece[1], false) {
                let caustic = case.caustic(theta);
                for (j, mass) in row.iter_mut().enumerate() {
                    let (left, right) = (column_edge(j), column_edge(j + 1));
                    let mut ends = vec![left];
                    if let Some(phi) = caustic {
                        ends.extend([-phi, phi].into_iter().filter(|&phi| phi > left && phi < right));
                    }
                    ends.push(right);
                    for arc in ends.windows(2) {
                        for (phi, across) in nodes(arc[0], arc[1], marschner) {
                            let s = Dir::new(theta, KNOWN_PHI + phi);
                            *mass += pdf(s) * across * along * s.cos_theta;
                        }
                    }
                }
            }
        }
    }
    masses
}

/// The bins of a Lambertian fiber, whose density is `((π - |φ|) cos φ + sin |φ|) cos θ / 4π`.
fn lambertian_bins() -> Vec<f64> {
    // Antiderivatives of cos² θ, and of the rest in |φ|.
    let along = |theta: f64| 0.5 * (theta + theta.sin() * theta.cos());
    let around = |phi: f64| (PI - phi.abs()) * phi.abs().sin() - 2.0 * phi.cos();
    let mut masses = Vec::with_capacity(ROWS * COLUMNS);
    for i in 0..ROWS {
        for j in 0..COLUMNS {
            let (rise, turn) = (along(row_edge(i + 1)) - along(row_edge(i)), around(column_edge(j + 1)));
            masses.push(rise * (turn - around(column_edge(j))).abs() / (4.0 * PI));
        }
    }
    masses
}

/// The bins by what the case says.
fn expected(case: &Case) -> Result<Vec<f64>, String> {
    match case.density {
        Density::Closed => Ok(lambertian_bins()),
        Density::Double => {
            let setup = case.fiber.prepare(&case.hit());
            Ok(integrate(case, |s| setup.pdf(s)))
        }
        Density::Single => {
            let double = case.fiber.prepare(&case.hit());
            let single = case.fiber.cast::<f32>().prepare(&Hit::new(case.known.cast::<f32>(), case.h as f32));
            // Where directions are drawn the two densities are one: a million draws could not tell what is off by
            // 1e-3 (it adds 1 to a χ² of hundreds).
            let (mut off, mut sum) = (0.0, 0.0);
            for index in 0..64 {
                let Some(sample) = double.sample(uniform(seed(&case.name) ^ 1, index)) else { continue };
                let pdf = double.pdf(sample.dir);
                off += (f64::from(single.pdf(sample.dir.cast::<f32>())) - pdf).abs();
                sum += pdf;
            }
            if !(off < 1e-3 * sum) {
                return Err(format!("{}: in single precision the density is off by {:.1e}", case.name, off / sum));
            }
            Ok(integrate(case, |s| f64::from(single.pdf(s.cast::<f32>()))))
        }
    }
}

// --- The comparison

/// A seed for a case, whatever its place in the list.
fn seed(name: &str) -> u32 {
    name.bytes().fold(0x6772_6964, |acc, byte| hash::mix2(acc, u32::from(byte)))
}

/// Uniform numbers inside `(0, 1)`, a function of seed and index.
fn uniform(seed: u32, index: u32) -> [f64; DIMS] {
    let base = hash::mix2(seed, index);
    std::array::from_fn(|dim| {
        // One more round than a renderer needs: a million draws would see a correlation of 1e-3.
        let word = hash::mix(hash::mix2(base, dim as u32).wrapping_add(seed));
        (f64::from(word) + 0.5) / 4_294_967_296.0
    })
}

/// Probability that a χ² with `freedom` degrees of freedom exceeds `chi2`.
///
/// Source: Wilson & Hilferty 1931. Far in the tail the probability is off by some ten percent, which moves an alarm
/// level of 1e-6 by a hundredth of a standard deviation.
fn chi2_survival(chi2: f64, freedom: u32) -> f64 {
    let spread = 2.0 / (9.0 * f64::from(freedom));
    normal::cdf(-((chi2 / f64::from(freedom)).cbrt() - (1.0 - spread)) / spread.sqrt())
}

/// Draws and compares; the probability of a χ² this large, or what is wrong.
fn check(case: &Case) -> Result<f64, String> {
    let masses = expected(case)?;
    let total = masses.iter().sum::<f64>() + case.lost;
    if !((total - 1.0).abs() < 1e-3) {
        return Err(format!("{}: the density integrates to {total}, not to 1", case.name));
    }

    let setup = case.fiber.prepare(&case.hit());
    let seed = seed(&case.name);
    let mut seen = vec![0_u32; masses.len()];
    let mut lost = 0_u32;
    for index in 0..DRAWS {
        let Some(sample) = setup.sample(uniform(seed, index)) else {
            lost += 1;
            continue;
        };
        let row = ((sample.dir.sin_theta + 1.0) * 0.5 * ROWS as f64) as usize;
        let column = ((wrap_angle(sample.dir.phi - KNOWN_PHI) + PI) / TAU * COLUMNS as f64) as usize;
        seen[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1;
    }

    let draws = f64::from(DRAWS);
    // What is lost on purpose is one bin more.
    let wanted = masses.iter().chain([&case.lost]).map(|mass| draws * mass);
    let counted = seen.iter().chain([&lost]).map(|&count| f64::from(count));
    let (mut chi2, mut bins) = (0.0, 0_u32);
    let (mut pool, mut pool_seen) = (0.0, 0.0);
    let mut worst = (0.0, 0.0, 0.0, 0);
    for (bin, (want, got)) in wanted.zip(counted).enumerate() {
        if want < MIN_EXPECTED {
            pool += want;
            pool_seen += got;
            continue;
        }
        let part = (got - want).powi(2) / want;
        chi2 += part;
        bins += 1;
        if part > worst.0 {
            worst = (part, got, want, bin);
        }
    }
    // A pool that is itself too empty counts less than it might, never more.
    chi2 += (pool_seen - pool).powi(2) / pool.max(MIN_EXPECTED);
    if bins < 6 {
        return Err(format!("{}: everything falls into {bins} bins", case.name));
    }

    let alarm = -((-1e-3_f64).ln_1p() / CASES as f64).exp_m1();
    let p = chi2_survival(chi2, bins);
    if p > alarm {
        return Ok(p);
    }
    let (_, got, want, bin) = worst;
    let place = if bin == masses.len() {
        "among the lost".to_owned()
    } else {
        let theta = 0.5 * (row_edge(bin / COLUMNS) + row_edge(bin / COLUMNS + 1));
        let phi = 0.5 * (column_edge(bin % COLUMNS) + column_edge(bin % COLUMNS + 1));
        format!("near θ = {:.0}°, φ = {:.0}°", theta.to_degrees(), phi.to_degrees())
    };
    Err(format!(
        "{}: χ² = {chi2:.1} with {bins} degrees of freedom, p = {p:.1e} (alarm below {alarm:.1e}); worst {place}: \
         {got} drawn, {want:.1} expected; {pool_seen} in the sparse bins or lost, {pool:.1} expected",
        case.name
    ))
}

/// Checks all cases on all cores, tells how it went, and fails with everything that failed.
fn run(model: &str, cases: &[Case]) {
    let begin = Instant::now();
    // Not through the captured output: a minute of silence looks like a hang.
    let say = |what: String| drop(writeln!(std::io::stderr(), "{model}: {what}"));
    let next = AtomicUsize::new(0);
    let work = || {
        let mut outcomes = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(i) else { break };
            outcomes.push(check(case));
            if (i + 1).is_multiple_of(27) {
                say(format!("{} of {} cases", i + 1, cases.len()));
            }
        }
        outcomes
    };
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get());
    let outcomes: Vec<Result<f64, String>> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a case panicked")).collect()
    });
    assert_eq!(outcomes.len(), cases.len());

    let mut failures: Vec<&str> =
        outcomes.iter().filter_map(|outcome| outcome.as_ref().err().map(String::as_str)).collect();
    failures.sort_unstable();
    let passed: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.as_ref().ok().copied()).collect();
    let (least, mean) = (passed.iter().copied().fold(1.0, f64::min), passed.iter().sum::<f64>() / passed.len() as f64);
    say(format!(
        "{} of {} cases pass in {:.0} s; p is {least:.1e} at least, {mean:.2} in the mean",
        passed.len(),
        cases.len(),
        begin.elapsed().as_secs_f64(),
    ));
    assert!(failures.is_empty(), "{} of {} cases fail:\n{}", failures.len(), cases.len(), failures.join("\n"));
}

#[test]
fn kajiya_kay() {
    run("Kajiya-Kay", &kajiya_kay_cases());
}

#[test]
fn lambertian() {
    let cases = lambertian_cases();
    for case in &cases {
        // The closed form holds the model's own density and the quadrature that all others rely on.
        let setup = case.fiber.prepare(&case.hit());
        for (got, want) in integrate(case, |s| setup.pdf(s)).into_iter().zip(lambertian_bins()) {
            assert!((got - want).abs() < 1e-12, "{}: {got} in a bin that has {want}", case.name);
        }
    }
    run("Lambertian", &cases);
}

#[test]
fn hery() {
    run("Hery-Ramamoorthi", &hery_cases());
}

#[test]
fn sadeghi() {
    run("Sadeghi", &sadeghi_cases());
}

#[test]
fn chiang() {
    run("Chiang", &chiang_cases());
}

#[test]
fn deon_near() {
    run("d'Eon, near field", &deon_cases(Field::Near));
}

#[test]
fn deon_far() {
    run("d'Eon, far field", &deon_cases(Field::Far));
}

#[test]
fn marschner() {
    run("Marschner", &marschner_cases());
}

#[test]
fn fur() {
    run("fur", &fur_cases());
}

/// The alarm level is for as many cases as there are, and no case is there twice.
#[test]
fn the_grid_is_what_it_says() {
    let models = [
        kajiya_kay_cases(),
        lambertian_cases(),
        hery_cases(),
        sadeghi_cases(),
        chiang_cases(),
        deon_cases(Field::Near),
        deon_cases(Field::Far),
        marschner_cases(),
        fur_cases(),
    ];
    assert_eq!(models.iter().map(Vec::len).collect::<Vec<_>>(), [108, 9, 162, 108, 243, 81, 81, 81, 81]);
    let mut names: Vec<&str> = models.iter().flatten().map(|case| case.name.as_str()).collect();
    assert_eq!(names.len(), CASES);
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), CASES, "two cases are the same");
}

/// Any two values of any two parameters meet, also where one runs along the grid.
#[test]
fn any_two_values_meet() {
    // The parameters that run along the grid, with their numbers of values: absorption, Marschner's four forms,
    // the two medullas, the offsets of fur.
    let along = [([1, 1, 1], 3), ([1, 2, 3], 4), ([1, 1, 1], 2), ([1, 2, 0], 3)];
    let values: Vec<Vec<usize>> = Place::all()
        .iter()
        .map(|place| {
            let mut values = vec![place.theta, place.beta, place.alpha];
            values.extend(along.iter().map(|&(steps, count)| place.along(steps, count)));
            values
        })
        .collect();
    let counts = [9, 3, 3, 3, 4, 2, 3];
    for (a, &count_a) in counts.iter().enumerate() {
        for (b, &count_b) in counts.iter().enumerate().skip(a + 1) {
            let mut pairs: Vec<(usize, usize)> = values.iter().map(|row| (row[a], row[b])).collect();
            pairs.sort_unstable();
            pairs.dedup();
            assert_eq!(pairs.len(), count_a * count_b, "parameters {a} and {b}");
        }
    }
    for by_beta in [true, false] {
        let pick = |place: &Place| (place.theta, if by_beta { place.beta } else { place.alpha });
        let mut pairs: Vec<(usize, usize)> = Place::third().iter().map(pick).collect();
        pairs.sort_unstable();
        pairs.dedup();
        assert_eq!(pairs.len(), 27);
    }
}
