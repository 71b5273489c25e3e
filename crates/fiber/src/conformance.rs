//! The tests that every model passes, whoever wrote it and in whatever form.
//!
//! A model enrols with a [`Case`]: itself in both precisions, the directions to try, and what it claims
//! (where its lobes lie, whether it is reciprocal, how much it may reflect). The macro
//! [`conformance!`](crate::conformance!) turns a case into `#[test]` functions; `tests/conformance.rs`
//! of this crate shows it in use. What a model breaks on purpose it names in `except`. A form that only
//! exists in single precision, as a shader does, enrols through [`Widened`].
//!
//! | check | what it alone finds |
//! |---|---|
//! | [`pdf_integrates_to_one`] | a density without its cosine, a lost branch |
//! | [`histogram_follows_pdf`] | a sampler that draws from something else than it says |
//! | [`weight_is_eval_over_pdf`] | a weight that is not value over density |
//! | [`sampled_energy_matches_integrated`] | value and sampler that estimate different integrals |
//! | [`never_reflects_more_than_it_receives`] | a lost normalisation |
//! | [`finite_at_the_edges`] | divisions that fail at the rim, at the poles, at the ends of `[0, 1)` |
//! | [`single_precision_follows_double`] | cancellation |
//! | [`reciprocity`] | exchanged or mislabelled directions |
//!
//! Everything is deterministic: random numbers are hashes of what they are for. A case that passes once
//! passes always, so a false alarm can only appear together with a change.
//!
//! The functions panic with what they saw; they are assertions, to be called from tests.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use math::{Real, Rgb, hash, normal};

use crate::quadrature::rule;
use crate::wrap_angle;
use crate::{DIMS, Dir, Hit, Lobes, Model, Sample, Scatter};

/// Where a lobe of the model lies: what the quadratures need in order not to miss it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Centre in `θ_s`, relative to the specular cone `-θ_k`, radians.
    pub shift: f64,
    /// Standard deviation in `θ_s`, radians.
    pub width: f64,
}

/// What the model says about the weight of its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    /// `fcos / pdf`, sample by sample.
    #[default]
    Exact,
    /// `fcos / pdf` in the mean over what the sample does not tell.
    Expected,
    /// Cut off: in the mean at most `fcos / pdf`.
    Cut,
}

/// What happens when the two directions are exchanged.
///
/// A near-field offset changes sign with them: the path seen from its other end is mirrored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Symmetry {
    /// The scattering function itself, `fcos / cos θ_s`, stays.
    Scattering,
    /// `fcos` stays.
    Fcos,
    /// Neither: one of the pairs tried differs by more than 5 %, either way. Guards against directions
    /// that were mislabelled, which tend to make a model symmetric.
    #[default]
    Neither,
}

/// One model with one set of parameters, and what it claims.
///
/// ```
/// use fiber::Lambertian;
/// use fiber::conformance::{Case, Symmetry};
/// use math::Rgb;
///
/// let case = Case {
///     thetas: vec![0.0, 1.2],
///     symmetry: Symmetry::Scattering,
///     ..Case::new(
///         "a grey matte fiber",
///         Lambertian::<f64> { albedo: Rgb::splat(0.5) },
///         Lambertian::<f32> { albedo: Rgb::splat(0.5) },
///     )
/// };
/// fiber::conformance::pdf_integrates_to_one(&case);
/// ```
pub struct Case<D, S> {
    /// What the model is called when it fails.
    pub name: &'static str,
    /// The model in double precision: all checks.
    pub double: D,
    /// The model in single precision: edges and agreement.
    pub single: S,
    /// Known inclinations to try, radians.
    pub thetas: Vec<f64>,
    /// Offsets across the fiber to try, each with every inclination.
    pub offsets: Vec<f64>,
    /// Where the quadratures have to look closely.
    pub lobes: Vec<Lobe>,
    /// Inclinations at which value or density jump, for a known inclination; radians.
    pub kinks: fn(f64) -> Vec<f64>,
    /// What the weights are.
    pub weight: Weight,
    /// What exchanging the directions does.
    pub symmetry: Symmetry,
    /// The largest share of the light, in any channel, that may come back; 1 for a conserving model.
    pub energy_bound: f64,
    /// Relative rounding error that the weights may show: larger for single precision in disguise.
    pub rounding: f64,
    /// Directions drawn for the histogram; the smaller, the less it sees.
    pub histogram_draws: u32,
    /// Directions drawn for the energy.
    pub energy_draws: u32,
    /// Directions drawn where each is looked at by itself.
    pub draws: u32,
    /// Nodes of the trapezoid over the azimuth.
    pub azimuths: u32,
    /// How many histograms the whole suite compares: together they raise a false alarm with
    /// probability 1e-3.
    pub family: u32,
}

impl<D: Model<f64>, S: Model<f32>> Case<D, S> {
    /// A case with the defaults: straight on, offset 0.3, one broad lobe, exact weights, no symmetry,
    /// nothing gained, a million draws for the histogram.
    pub fn new(name: &'static str, double: D, single: S) -> Self {
        Self {
            name,
            double,
            single,
            thetas: vec![0.0],
            offsets: vec![0.3],
            lobes: Vec::new(),
            kinks: |_| Vec::new(),
            weight: Weight::default(),
            symmetry: Symmetry::default(),
            energy_bound: 1.0,
            rounding: 1e-9,
            histogram_draws: 1_000_000,
            energy_draws: 100_000,
            draws: 20_000,
            azimuths: 720,
            family: 128,
        }
    }
}

/// Turns a case into tests: a module with one `#[test]` for each check of the
/// [conformance module](mod@crate::conformance).
///
/// `conformance!(name, case)` runs all of them, `conformance!(name, case, except: [..])` leaves out what
/// the model breaks on purpose, `conformance!(name, case, only: [..])` runs the listed ones. `name` is a
/// new module, `case` an expression that makes a [`Case`](crate::conformance::Case).
#[macro_export]
macro_rules! conformance {
    // One test, unless its name is in the list.
    (@unless [] $test:ident) => {
        #[test]
        fn $test() {
            $crate::conformance::$test(&conformance_case());
        }
    };
    (@unless [pdf_integrates_to_one $($rest:ident)*] pdf_integrates_to_one) => {};
    (@unless [histogram_follows_pdf $($rest:ident)*] histogram_follows_pdf) => {};
    (@unless [weight_is_eval_over_pdf $($rest:ident)*] weight_is_eval_over_pdf) => {};
    (@unless [sampled_energy_matches_integrated $($rest:ident)*] sampled_energy_matches_integrated) => {};
    (@unless [never_reflects_more_than_it_receives $($rest:ident)*] never_reflects_more_than_it_receives) => {};
    (@unless [finite_at_the_edges $($rest:ident)*] finite_at_the_edges) => {};
    (@unless [single_precision_follows_double $($rest:ident)*] single_precision_follows_double) => {};
    (@unless [reciprocity $($rest:ident)*] reciprocity) => {};
    (@unless [$other:ident $($rest:ident)*] $test:ident) => {
        $crate::conformance!(@unless [$($rest)*] $test);
    };
    ($name:ident, $case:expr $(,)?) => {
        $crate::conformance!($name, $case, except: []);
    };
    ($name:ident, $case:expr, except: [$($skip:ident),* $(,)?] $(,)?) => {
        mod $name {
            #[allow(unused_imports, reason = "the case may be written with full paths")]
            use super::*;

            fn conformance_case()
            -> $crate::conformance::Case<impl $crate::Model<f64>, impl $crate::Model<f32>> {
                $case
            }

            $(
                // A misspelt name would leave out nothing; this makes it an error.
                #[allow(unused_imports, reason = "only its existence matters")]
                use $crate::conformance::$skip;
            )*

            $crate::conformance!(@unless [$($skip)*] pdf_integrates_to_one);
            $crate::conformance!(@unless [$($skip)*] histogram_follows_pdf);
            $crate::conformance!(@unless [$($skip)*] weight_is_eval_over_pdf);
            $crate::conformance!(@unless [$($skip)*] sampled_energy_matches_integrated);
            $crate::conformance!(@unless [$($skip)*] never_reflects_more_than_it_receives);
            $crate::conformance!(@unless [$($skip)*] finite_at_the_edges);
            $crate::conformance!(@unless [$($skip)*] single_precision_follows_double);
            $crate::conformance!(@unless [$($skip)*] reciprocity);
        }
    };
    ($name:ident, $case:expr, only: [$($test:ident),+ $(,)?] $(,)?) => {
        mod $name {
            #[allow(unused_imports, reason = "the case may be written with full paths")]
            use super::*;

            fn conformance_case()
            -> $crate::conformance::Case<impl $crate::Model<f64>, impl $crate::Model<f32>> {
                $case
            }

            $($crate::conformance!(@unless [] $test);)+
        }
    };
}

/// A model that exists in single precision only, seen as one in double precision.
#[derive(Clone, Copy, Debug)]
pub struct Widened<M>(pub M);

/// [`Widened`] at one shading point.
#[derive(Clone, Copy, Debug)]
pub struct WidenedSetup<P>(P);

impl<M: Model<f32>> Model<f64> for Widened<M> {
    type Setup = WidenedSetup<M::Setup>;

    fn prepare(&self, hit: &Hit<f64>) -> Self::Setup {
        let single = Hit::new(hit.known.cast(), hit.h as f32).with_width(hit.width_px as f32);
        WidenedSetup(self.0.prepare(&single))
    }
}

impl<P: Scatter<f32>> Scatter<f64> for WidenedSetup<P> {
    fn eval(&self, s: Dir<f64>) -> Lobes<f64> {
        widen(self.0.eval(s.cast()))
    }

    fn pdf(&self, s: Dir<f64>) -> f64 {
        f64::from(self.0.pdf(s.cast()))
    }

    fn eval_pdf(&self, s: Dir<f64>) -> (Lobes<f64>, f64) {
        let (fcos, pdf) = self.0.eval_pdf(s.cast());
        (widen(fcos), f64::from(pdf))
    }

    fn sample(&self, u: [f64; DIMS]) -> Option<Sample<f64>> {
        // Rounding must not reach 1, which no sampler has to bear.
        let u = u.map(|x| (x as f32).min(f32::ONE_MINUS_EPSILON));
        let sample = self.0.sample(u)?;
        Some(Sample {
            dir: sample.dir.cast(),
            weight: widen(sample.weight),
            pdf: sample.pdf.map(f64::from),
            lobe: sample.lobe,
        })
    }
}

fn widen(lobes: Lobes<f32>) -> Lobes<f64> {
    Lobes(lobes.0.map(|lobe| lobe.cast::<f64>()))
}

/// The density of the sampler covers the sphere once: `∫ pdf dω = 1` to 1e-3.
pub fn pdf_integrates_to_one<D: Model<f64>, S>(case: &Case<D, S>) {
    for point in points(case) {
        let (_, mass) = over_the_sphere(case, &point);
        assert!((mass - 1.0).abs() < 1e-3, "{}: the density integrates to {mass}, not to 1", point.place);
    }
}

/// What is drawn is distributed as the density says: χ² over 24 bins in `sin θ_s` by 36 in azimuth, with
/// a false-alarm rate of 1e-3 for the whole suite (Šidák over [`Case::family`] histograms).
pub fn histogram_follows_pdf<D: Model<f64>, S>(case: &Case<D, S>) {
    let alarm = -((-1e-3_f64).ln_1p() / f64::from(case.family)).exp_m1();
    for (i, point) in points(case).iter().enumerate() {
        let expected = expected_masses(case, point);
        let mut seen = [0_u32; BINS];
        let mut lost = 0_u32;
        let seed = seed(case.name, 0x4157, i);
        for index in 0..case.histogram_draws {
            match point.setup.sample(numbers(seed, index)) {
                Some(sample) => seen[bin(sample.dir, point.known)] += 1,
                None => lost += 1,
            }
        }

        let draws = f64::from(case.histogram_draws);
        let mut chi2 = 0.0;
        let mut bins = 0_u32;
        let mut worst = (0.0, 0.0, 0.0, 0);
        // Bins too empty for a χ² share one, together with the draws that ended the path.
        let mut pool = draws * (1.0 - expected.iter().sum::<f64>()).max(0.0);
        let mut pool_seen = f64::from(lost);
        for (b, (&mass, &count)) in expected.iter().zip(&seen).enumerate() {
            let (want, got) = (draws * mass, f64::from(count));
            if want < MIN_EXPECTED {
                pool += want;
                pool_seen += got;
                continue;
            }
            let part = (got - want).powi(2) / want;
            chi2 += part;
            bins += 1;
            if part > worst.0 {
                worst = (part, got, want, b);
            }
        }
        // A pool that is itself too empty counts less than it might, never more.
        let pool_part = (pool_seen - pool).powi(2) / pool.max(MIN_EXPECTED);
        chi2 += pool_part;
        assert!(bins > 1, "{}: everything falls into one bin", point.place);

        let p = chi2_survival(chi2, bins);
        let (_, got, want, b) = worst;
        assert!(
            p > alarm,
            "{}: the histogram of {draws} draws does not follow the density: χ² = {chi2:.1} with {bins} degrees of \
             freedom, p = {p:.1e} (alarm below {alarm:.1e}); worst near sin θ = {:.2}, φ = {:.0}°: {got} drawn, \
             {want:.1} expected; {pool_seen} in the sparse bins or not drawn at all, {pool:.1} expected",
            point.place,
            (f64::from((b / PHI_BINS) as u32) + 0.5) * 2.0 / SIN_BINS as f64 - 1.0,
            (f64::from((b % PHI_BINS) as u32) + 0.5) * 360.0 / PHI_BINS as f64 - 180.0,
        );
    }
}

/// A sample carries value over density: exactly, or in the mean over its hidden choices, as
/// [`Case::weight`] says. The density it states is the one that [`Scatter::pdf`] gives.
pub fn weight_is_eval_over_pdf<D: Model<f64>, S>(case: &Case<D, S>) {
    for (i, point) in points(case).iter().enumerate() {
        let seed = seed(case.name, 0x5745, i);
        // Deviations in the mean, in four sectors: either side of the cone, front and back.
        let mut deviation = [Rgb::<f64>::black(); 4];
        let mut squares = [Rgb::<f64>::black(); 4];
        let mut drawn = 0_u32;
        for index in 0..case.draws {
            let Some(sample) = point.setup.sample(numbers(seed, index)) else { continue };
            drawn += 1;
            let (fcos, pdf) = point.setup.eval_pdf(sample.dir);
            assert!(pdf > 0.0, "{}: {:?} was drawn although its density is {pdf}", point.place, sample.dir);
            if let Some(stated) = sample.pdf {
                assert!(
                    (stated - pdf).abs() <= case.rounding * pdf,
                    "{}: a sample states the density {stated}, at {:?} it is {pdf}",
                    point.place,
                    sample.dir,
                );
            }
            let (got, want) = (sample.weight.sum(), fcos.sum() / pdf);
            let off = got - want;
            if case.weight == Weight::Exact {
                let allowed = case.rounding * want.max_channel().max(got.max_channel());
                assert!(
                    off.0.iter().all(|d| d.abs() <= allowed),
                    "{}: a sample weighs {:?}, value over density at {:?} is {:?}",
                    point.place,
                    got.0,
                    sample.dir,
                    want.0,
                );
            }
            let sector = usize::from(sample.dir.sin_theta > -point.known.sin_theta)
                + 2 * usize::from(wrap_angle(sample.dir.phi - point.known.phi).abs() > FRAC_PI_2);
            deviation[sector] += off;
            squares[sector] += off * off;
        }
        assert!(drawn > case.draws / 2, "{}: only {drawn} of {} draws went anywhere", point.place, case.draws);
        for (sum, squares) in deviation.iter().zip(&squares) {
            for channel in 0..3 {
                // The deviations of single draws are independent with mean 0; 4 standard errors.
                let allowed = 4.0 * squares[channel].sqrt() + case.rounding * f64::from(drawn);
                let excess = if case.weight == Weight::Cut { sum[channel] } else { sum[channel].abs() };
                assert!(
                    excess <= allowed,
                    "{}: the weights of {drawn} draws miss value over density by {} in sum, {allowed} would be noise",
                    point.place,
                    sum[channel],
                );
            }
        }
    }
}

/// The mean weight of many samples is the energy `∫ fcos dω`, to 4 standard errors.
pub fn sampled_energy_matches_integrated<D: Model<f64>, S>(case: &Case<D, S>) {
    for (i, point) in points(case).iter().enumerate() {
        let (integrated, _) = over_the_sphere(case, point);
        let seed = seed(case.name, 0x454e, i);
        let mut sum = Rgb::<f64>::black();
        let mut squares = Rgb::<f64>::black();
        for index in 0..case.energy_draws {
            if let Some(sample) = point.setup.sample(numbers(seed, index)) {
                let weight = sample.weight.sum();
                sum += weight;
                squares += weight * weight;
            }
        }
        let draws = f64::from(case.energy_draws);
        for channel in 0..3 {
            let mean = sum[channel] / draws;
            let error = ((squares[channel] / draws - mean * mean).max(0.0) / draws).sqrt();
            // The quadrature itself is good to a few 1e-4, the floors of cosines at the poles included.
            let allowed = 4.0 * error + 5e-4 * integrated[channel].max(case.rounding);
            let excess = mean - integrated[channel];
            let excess = if case.weight == Weight::Cut { excess } else { excess.abs() };
            assert!(
                excess <= allowed,
                "{}: {draws} samples bring back {mean} ± {error} of the light in channel {channel}, the integral says {}",
                point.place,
                integrated[channel],
            );
        }
    }
}

/// No channel of `∫ fcos dω` exceeds [`Case::energy_bound`] (by more than 1e-3, for the quadrature).
pub fn never_reflects_more_than_it_receives<D: Model<f64>, S>(case: &Case<D, S>) {
    for point in points(case) {
        let (energy, _) = over_the_sphere(case, &point);
        assert!(
            energy.max_channel() <= case.energy_bound + 1e-3,
            "{}: {:?} of the light comes back, at most {} may",
            point.place,
            energy.0,
            case.energy_bound,
        );
    }
}

/// At the rim, along the fiber, many turns away and at the ends of the random numbers, in both
/// precisions: values and densities are finite and not negative, samples are none or usable.
pub fn finite_at_the_edges<D: Model<f64>, S: Model<f32>>(case: &Case<D, S>) {
    stays_finite::<f64, D>(case.name, &case.double);
    stays_finite::<f32, S>(case.name, &case.single);
}

/// The single-precision form differs from the double-precision one by at most 2e-3 of the peak in the
/// mean over directions, half of them drawn and half of them uniform, and so do the weights.
pub fn single_precision_follows_double<D: Model<f64>, S: Model<f32>>(case: &Case<D, S>) {
    const SHARE: f64 = 2e-3;
    for (i, point) in points(case).iter().enumerate() {
        let single = case.single.prepare(&Hit::new(point.known.cast(), point.h as f32));
        let seed = seed(case.name, 0x5350, i);
        let mut value = Agreement::default();
        let mut density = Agreement::default();
        let mut weight = Agreement::default();
        let mut disagreed = 0_u32;
        for index in 0..case.draws {
            let u = numbers(seed, index).map(coarse);
            let (a, b) = (point.setup.sample(u.map(f64::from)), single.sample(u));
            match (&a, &b) {
                (Some(a), Some(b)) => {
                    let (a, b) = (a.weight.sum(), b.weight.sum().cast::<f64>());
                    weight.add((b - a).map(f64::abs).max_channel(), a.max_channel());
                }
                (None, None) => {}
                _ => disagreed += 1,
            }
            let s = match a {
                Some(sample) if index % 2 == 0 => sample.dir,
                _ => Dir::from_sin(2.0 * f64::from(u[0]) - 1.0, TAU * f64::from(u[1])),
            };
            let (fcos, pdf) = point.setup.eval_pdf(s);
            let (fcos_32, pdf_32) = single.eval_pdf(s.cast());
            let (fcos, fcos_32) = (fcos.sum(), fcos_32.sum().cast::<f64>());
            value.add((fcos_32 - fcos).map(f64::abs).max_channel(), fcos.max_channel());
            density.add((f64::from(pdf_32) - pdf).abs(), pdf);
        }
        for (what, agreement) in [("value", value), ("density", density), ("weight", weight)] {
            assert!(
                agreement.share() <= SHARE,
                "{}: in single precision the {what} is off by {:.1e} of its peak {:.3e} in the mean",
                point.place,
                agreement.share(),
                agreement.peak,
            );
        }
        assert!(
            f64::from(disagreed) <= SHARE * f64::from(case.draws),
            "{}: {disagreed} of {} draws end in one precision only",
            point.place,
            case.draws,
        );
    }
}

/// Exchanging the directions does what [`Case::symmetry`] says, to 1e-10.
pub fn reciprocity<D: Model<f64>, S>(case: &Case<D, S>) {
    const PAIRS: u32 = 50;
    let mut compared = 0_u32;
    // The largest relative differences of fcos and of fcos / cos θ_s.
    let mut largest = [0.0_f64; 2];
    assert!(!case.offsets.is_empty(), "{}: no offset to try", case.name);
    for index in 0..PAIRS {
        let u = numbers(seed(case.name, 0x5245, 0), index);
        let k = Dir::new(2.6 * u[0] - 1.3, KNOWN_PHI);
        let h = case.offsets[index as usize % case.offsets.len()];
        let forth = case.double.prepare(&Hit::new(k, h));
        // A drawn partner lies where the model has something to say.
        let Some(sample) = forth.sample(numbers(seed(case.name, 0x5245, 1), index)) else { continue };
        let s = sample.dir;
        if s.cos_theta < 0.02 {
            continue;
        }
        let there = forth.eval(s).sum();
        let back = case.double.prepare(&Hit::new(s, -h)).eval(k).sum();
        compared += 1;
        for (i, (there, back)) in [(there, back), (there / s.cos_theta, back / k.cos_theta)].into_iter().enumerate() {
            let scale = there.max_channel().max(back.max_channel());
            if scale > 0.0 {
                let difference = (there - back).map(f64::abs).max_channel() / scale;
                largest[i] = largest[i].max(difference);
            }
        }
    }
    assert!(compared > PAIRS / 2, "{}: only {compared} pairs of directions could be compared", case.name);
    let [fcos, scattering] = largest;
    match case.symmetry {
        Symmetry::Fcos => assert!(
            fcos <= 1e-10,
            "{}: exchanging the directions changes the value times the cosine by {fcos:.1e}",
            case.name
        ),
        Symmetry::Scattering => assert!(
            scattering <= 1e-10,
            "{}: exchanging the directions changes the scattering function by {scattering:.1e}",
            case.name
        ),
        Symmetry::Neither => assert!(
            fcos > 0.05 && scattering > 0.05,
            "{}: should not be symmetric, but exchanging the directions changes it by {fcos:.1e} only \
             ({scattering:.1e} without the cosine)",
            case.name
        ),
    }
}

/// Azimuth of every known direction: not 0, so that an azimuth taken as absolute is found out.
const KNOWN_PHI: f64 = 0.7;

const SIN_BINS: usize = 24;
const PHI_BINS: usize = 36;
const BINS: usize = SIN_BINS * PHI_BINS;

/// Bins with fewer expected counts are too far from a normal distribution for a χ².
const MIN_EXPECTED: f64 = 10.0;

/// A shading point of a case.
struct Point<P> {
    theta_k: f64,
    h: f64,
    known: Dir<f64>,
    setup: P,
    /// The case and the point in words.
    place: String,
}

fn points<D: Model<f64>, S>(case: &Case<D, S>) -> Vec<Point<D::Setup>> {
    let mut points = Vec::new();
    for &theta_k in &case.thetas {
        for &h in &case.offsets {
            let known = Dir::new(theta_k, KNOWN_PHI);
            points.push(Point {
                theta_k,
                h,
                known,
                setup: case.double.prepare(&Hit::new(known, h)),
                place: format!("{} at θ_k = {:.1}°, h = {h}", case.name, theta_k.to_degrees()),
            });
        }
    }
    assert!(!points.is_empty(), "{}: no shading point to try", case.name);
    points
}

/// A seed for one check of one case at one point.
fn seed(name: &str, check: u32, point: usize) -> u32 {
    let name = name.bytes().fold(0, |acc, byte| hash::mix2(acc, u32::from(byte)));
    hash::mix3(name, check, point as u32)
}

/// Uniform numbers inside `(0, 1)`, a function of seed and index.
fn numbers(seed: u32, index: u32) -> [f64; DIMS] {
    let base = hash::mix2(seed, index);
    std::array::from_fn(|dim| {
        // One more round than a renderer needs: a million draws would see a correlation of 1e-3.
        let word = hash::mix(hash::mix2(base, dim as u32).wrapping_add(seed));
        (f64::from(word) + 0.5) / 4_294_967_296.0
    })
}

/// The same number with 24 bits: both precisions can hold it.
fn coarse(x: f64) -> f32 {
    ((x * 16_777_216.0).floor() / 16_777_216.0) as f32
}

/// An inclination of a quadrature; the weight includes `cos θ dθ`.
struct Node {
    sin: f64,
    cos: f64,
    weight: f64,
}

/// Where the inclinations are cut into pieces: around every cone at 1, 2, 4 and 8 widths, and at kinks.
fn breaks<D, S>(case: &Case<D, S>, theta_k: f64) -> Vec<f64> {
    let fold = |theta: f64| if theta.abs() > FRAC_PI_2 { theta.signum() * PI - theta } else { theta };
    let narrowest = case.lobes.iter().map(|lobe| lobe.width).fold(FRAC_PI_4, f64::min);
    let mut at = vec![-FRAC_PI_4, 0.0, FRAC_PI_4];
    for lobe in &case.lobes {
        for step in [-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0] {
            at.push(fold(lobe.shift - theta_k + step * lobe.width));
        }
    }
    // Pieces much smaller than the narrowest lobe would cost and tell nothing.
    at.retain(|theta| theta.abs() < FRAC_PI_2 - 0.4 * narrowest);
    at.sort_by(f64::total_cmp);
    at.dedup_by(|next, last| *next - *last < 0.4 * narrowest);
    at.extend((case.kinks)(theta_k).into_iter().filter(|theta| theta.abs() < FRAC_PI_2));
    at.sort_by(f64::total_cmp);
    at
}

/// Gauss-Legendre nodes between two inclinations, piece by piece.
///
/// In `θ` and not in `sin θ`: the same integral, but a lobe at the pole is smooth in it.
fn inclinations(breaks: &[f64], from: f64, to: f64) -> Vec<Node> {
    let mut edges = vec![from];
    edges.extend(breaks.iter().copied().filter(|&theta| theta > from && theta < to));
    edges.push(to);
    let mut nodes = Vec::with_capacity(8 * edges.len());
    for edge in edges.windows(2) {
        let (centre, half) = (0.5 * (edge[0] + edge[1]), 0.5 * (edge[1] - edge[0]));
        for &(x, w) in rule(8) {
            let (sin, cos) = (centre + half * x).sin_cos();
            nodes.push(Node { sin, cos: cos.max(0.0), weight: w * half * cos.max(0.0) });
        }
    }
    nodes
}

/// `∫ fcos dω` and `∫ pdf dω`.
fn over_the_sphere<D: Model<f64>, S>(case: &Case<D, S>, point: &Point<D::Setup>) -> (Rgb<f64>, f64) {
    let turn = TAU / f64::from(case.azimuths);
    let mut energy = Rgb::black();
    let mut mass = 0.0;
    for node in inclinations(&breaks(case, point.theta_k), -FRAC_PI_2, FRAC_PI_2) {
        let mut ring = Rgb::<f64>::black();
        let mut ring_mass = 0.0;
        for j in 0..case.azimuths {
            let phi = point.known.phi + (f64::from(j) + 0.5) * turn;
            let (fcos, pdf) = point.setup.eval_pdf(Dir { sin_theta: node.sin, cos_theta: node.cos, phi });
            ring += fcos.sum();
            ring_mass += pdf;
        }
        energy += ring * (node.weight * turn);
        mass += ring_mass * node.weight * turn;
    }
    (energy, mass)
}

/// The mass of every bin by the model's own density: at least 8 by 8 nodes each.
fn expected_masses<D: Model<f64>, S>(case: &Case<D, S>, point: &Point<D::Setup>) -> Vec<f64> {
    let breaks = breaks(case, point.theta_k);
    let edge = |i: usize| (2.0 * i as f64 / SIN_BINS as f64 - 1.0).clamp(-1.0, 1.0).asin();
    let half = PI / PHI_BINS as f64;
    let mut masses = vec![0.0; BINS];
    for (i, row) in masses.chunks_exact_mut(PHI_BINS).enumerate() {
        for node in inclinations(&breaks, edge(i), edge(i + 1)) {
            for (j, mass) in row.iter_mut().enumerate() {
                let centre = (2 * j + 1) as f64 * half - PI;
                let across: f64 = rule(8)
                    .iter()
                    .map(|&(x, w)| {
                        let phi = point.known.phi + centre + half * x;
                        w * point.setup.pdf(Dir { sin_theta: node.sin, cos_theta: node.cos, phi })
                    })
                    .sum();
                *mass += node.weight * half * across;
            }
        }
    }
    masses
}

/// The bin that a direction falls into; azimuths are relative to the known direction.
fn bin(s: Dir<f64>, known: Dir<f64>) -> usize {
    let row = ((s.sin_theta + 1.0) * 0.5 * SIN_BINS as f64) as usize;
    let column = ((wrap_angle(s.phi - known.phi) + PI) / TAU * PHI_BINS as f64) as usize;
    row.min(SIN_BINS - 1) * PHI_BINS + column.min(PHI_BINS - 1)
}

/// Probability that a χ² with `freedom` degrees of freedom exceeds `chi2`.
///
/// Source: Wilson & Hilferty 1931. Far in the tail the probability is off by some ten percent, which
/// moves an alarm level of 1e-5 by a hundredth of a standard deviation.
fn chi2_survival(chi2: f64, freedom: u32) -> f64 {
    let spread = 2.0 / (9.0 * f64::from(freedom));
    normal::cdf(-((chi2 / f64::from(freedom)).cbrt() - (1.0 - spread)) / spread.sqrt())
}

/// Mean difference against the largest value.
#[derive(Clone, Copy, Default)]
struct Agreement {
    sum: f64,
    count: u32,
    peak: f64,
}

impl Agreement {
    fn add(&mut self, difference: f64, value: f64) {
        self.sum += difference;
        self.count += 1;
        self.peak = self.peak.max(value);
    }

    fn share(&self) -> f64 {
        if self.sum.is_nan() {
            return f64::INFINITY;
        }
        if self.sum > 0.0 { self.sum / f64::from(self.count) / self.peak } else { 0.0 }
    }
}

fn stays_finite<F: Real, M: Model<F>>(name: &str, model: &M) {
    let digits = if F::DOUBLE { 53 } else { 24 };
    let right = FRAC_PI_2;
    let thetas = [0.0, 0.4, -1.2, right, -right, right - 1e-6, 1e-6 - right];
    let along = [F::one(), -F::one()].map(|u| Dir::from_local([u, F::zero(), F::zero()]));
    let directions = |phis: &[f64]| {
        let mut directions = along.to_vec();
        for &theta in &thetas {
            directions.extend(phis.iter().map(|&phi| Dir::new(F::of(theta), F::of(phi))));
        }
        directions
    };
    let knowns = directions(&[0.0, 1e4]);
    let targets = directions(&[0.0, 1.3, PI, -PI, TAU, -TAU, 1e4]);
    let ends = [F::zero(), F::of(0.5), F::ONE_MINUS_EPSILON];
    let usable = |x: F| x.is_finite() && x >= F::zero();

    for h in [0.0, 0.6, 1.0, -1.0, 1.0 - 1e-7, 1e-7 - 1.0] {
        for &known in &knowns {
            let setup = model.prepare(&Hit::new(known, F::of(h)));
            for &s in &targets {
                let (both, both_pdf) = setup.eval_pdf(s);
                for (fcos, pdf) in [(both, both_pdf), (setup.eval(s), setup.pdf(s))] {
                    assert!(
                        fcos.0.iter().all(|lobe| lobe.0.iter().all(|&x| usable(x))) && usable(pdf),
                        "{name} ({digits} bits) from {known:?}, h = {h} to {s:?}: value {fcos:?}, density {pdf}",
                    );
                }
            }
            for code in 0..3_usize.pow(DIMS as u32) {
                let u: [F; DIMS] = std::array::from_fn(|dim| ends[code / 3_usize.pow(dim as u32) % 3]);
                let Some(sample) = setup.sample(u) else { continue };
                let d = sample.dir;
                // Sine and cosine come from different formulas; a few roundings apart is one direction.
                let slack = if F::DOUBLE { 1e-12 } else { 1e-5 };
                let unit = (d.sin_theta.sqr() + d.cos_theta.sqr() - F::one()).abs().f64() < slack;
                assert!(
                    unit && d.cos_theta >= F::zero() && d.phi.is_finite(),
                    "{name} ({digits} bits) from {known:?}, h = {h}, draws {u:?}: {d:?} is no direction",
                );
                assert!(
                    sample.weight.0.iter().all(|lobe| lobe.0.iter().all(|&x| usable(x)))
                        && sample.pdf.is_none_or(|pdf| usable(pdf) && pdf > F::zero()),
                    "{name} ({digits} bits) from {known:?}, h = {h}, draws {u:?}: {sample:?}",
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chi_square_tail_is_right() {
        // Quantiles of the tables at 0.1 %; the approximation is good to a fifth at one degree, a tenth at ten.
        for (freedom, chi2, slack) in [(1, 10.828, 0.2), (10, 29.588, 0.1), (100, 149.449, 0.02)] {
            let p = chi2_survival(chi2, freedom);
            assert!((p / 1e-3 - 1.0).abs() < slack, "{freedom}: {p}");
        }
        assert!((chi2_survival(99.334, 100) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn every_direction_has_its_bin() {
        let known = Dir::new(0.3, KNOWN_PHI);
        assert_eq!(bin(Dir::from_sin(-1.0, KNOWN_PHI), known), PHI_BINS / 2);
        assert_eq!(bin(Dir::from_sin(1.0, KNOWN_PHI - 3.1), known), BINS - PHI_BINS);
        for i in 0..1000 {
            let u = numbers(3, i);
            assert!(bin(Dir::from_sin(2.0 * u[0] - 1.0, 40.0 * u[1] - 20.0), known) < BINS);
        }
    }

    #[test]
    fn random_numbers_are_uniform_in_pairs() {
        // 16 × 16 bins of 1024 expected, all pairs of dimensions: 10 χ² with 255 degrees of freedom;
        // 370 is exceeded with probability 3e-6.
        for a in 0..DIMS {
            for b in a + 1..DIMS {
                let mut bins = [0_u32; 256];
                for i in 0..256 * 1024 {
                    let u = numbers(11, i);
                    bins[(u[a] * 16.0) as usize * 16 + (u[b] * 16.0) as usize] += 1;
                }
                let chi2: f64 = bins.iter().map(|&n| (f64::from(n) - 1024.0).powi(2) / 1024.0).sum();
                assert!(chi2 < 370.0, "dimensions {a} and {b}: {chi2}");
            }
        }
    }
}
