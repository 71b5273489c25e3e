//! Fur against the plain hair it must become without a medulla, against photons traced through a cylinder with a
//! scattering core, and against the shared suite.

use std::f64::consts::{PI, TAU};

use fiber::conformance::{Case, Lobe};
use fiber::{
    Attenuation, Deon, Dir, Field, Fur, Hit, Medulla, Model, R, RESIDUAL, Scatter, TRT, TT, Weights, conformance,
};
use math::{Real, Rgb, hash};

#[path = "../src/model/fur/trace.rs"]
mod trace;

use trace::{Cylinder, Random, trace};

fn rgb<F: Real>(x: [f64; 3]) -> Rgb<F> {
    Rgb(x.map(F::of))
}

fn degrees<const N: usize>(x: [f64; N]) -> Vec<f64> {
    x.map(f64::to_radians).to_vec()
}

fn medulla<F: Real>(radius: f64, scattering: f64, absorption: [f64; 3], anisotropy: f64) -> Medulla<F> {
    Medulla {
        radius: F::of(radius),
        scattering: F::of(scattering),
        absorption: rgb(absorption),
        anisotropy: F::of(anisotropy),
    }
}

fn fur<F: Real>(beta_deg: f64, alpha_deg: f64, sigma_a: [f64; 3], medulla: Medulla<F>) -> Fur<F> {
    Fur {
        eta: F::of(1.55),
        sigma_a: rgb(sigma_a),
        beta_m: F::of(beta_deg.to_radians()),
        beta_n: F::of(beta_deg.to_radians()),
        alpha: F::of(alpha_deg.to_radians()),
        layers: F::one(),
        medulla,
    }
}

fn unit(index: u32, stream: u32) -> f64 {
    f64::from(hash::unit(index, stream))
}

// --- What it must become

/// d'Eon's near field with the attenuation at the known angle, lobe by lobe and draw by draw.
fn is_deon(fur: Fur<f64>) {
    let deon = Deon {
        eta: fur.eta,
        sigma_a: fur.sigma_a,
        beta_m: fur.beta_m,
        beta_n: fur.beta_n,
        alpha: fur.alpha,
        residual: true,
        attenuation: Attenuation::Known,
        weights: Weights::Marginal,
        field: Field::Near,
    };
    // Products of the same factors in another order.
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs() + 1e-300;
    for i in 0..500 {
        let u = |stream: u32| unit(i, 0xf0 + stream);
        let hit = Hit::new(Dir::from_sin(1.98 * u(0) - 0.99, TAU * u(1)), 1.98 * u(2) - 0.99);
        let (fur, deon) = (fur.prepare(&hit), deon.prepare(&hit));
        let draws = [u(3), u(4), u(5), u(6), u(7)];
        let (a, b) = (fur.sample(draws), deon.sample(draws));
        let (Some(a), Some(b)) = (a, b) else { panic!("{hit:?} draws {a:?} and {b:?}") };
        assert_eq!(a.lobe, b.lobe, "{hit:?}");
        assert!(same(a.dir.sin_theta, b.dir.sin_theta), "{hit:?}: {a:?} and {b:?}");
        assert!((fiber::wrap_angle(a.dir.phi - b.dir.phi)).abs() < 1e-12, "{hit:?}: {a:?} and {b:?}");
        for s in [b.dir, Dir::from_sin(2.0 * u(8) - 1.0, TAU * u(9))] {
            let ((value, pdf), (want, want_pdf)) = (fur.eval_pdf(s), deon.eval_pdf(s));
            assert!(same(pdf, want_pdf), "{hit:?} to {s:?}: density {pdf}, d'Eon {want_pdf}");
            for p in [R, TT, TRT, RESIDUAL] {
                for c in 0..3 {
                    assert!(same(value[p][c], want[p][c]), "{hit:?} to {s:?}, lobe {p}: {value:?}, d'Eon {want:?}");
                }
            }
        }
    }
}

#[test]
fn without_a_medulla_it_is_deon() {
    for sigma_a in [[0.0; 3], [0.2, 0.5, 1.0]] {
        for (beta_deg, alpha_deg) in [(7.5, -3.0), (20.0, 5.0)] {
            is_deon(fur(beta_deg, alpha_deg, sigma_a, Medulla::none()));
            // However strongly what is not there would scatter.
            is_deon(fur(beta_deg, alpha_deg, sigma_a, medulla(0.0, 10.0, [3.0; 3], 0.5)));
        }
    }
}

#[test]
fn a_medulla_of_the_same_stuff_as_the_cortex_is_not_there() {
    for radius in [0.3, 0.95] {
        let sigma_a = [0.2, 0.5, 1.0];
        is_deon(fur(10.0, -3.0, sigma_a, medulla(radius, 0.0, sigma_a, 0.5)));
    }
}

#[test]
fn one_side_of_the_fiber_mirrors_the_other() {
    let fur = fur::<f64>(8.0, -3.0, [0.1, 0.2, 0.4], medulla(0.8, 3.0, [0.0, 0.1, 0.2], 0.4));
    for i in 0..200 {
        let u = |stream: u32| unit(i, 0x1f0 + stream);
        let (sin_k, h, phi) = (1.9 * u(0) - 0.95, u(1), TAU * u(2));
        let sin_s = 2.0 * u(3) - 1.0;
        let value = |h: f64, phi: f64| {
            fur.prepare(&Hit::new(Dir::from_sin(sin_k, 0.0), h)).eval(Dir::from_sin(sin_s, phi)).sum()
        };
        let (a, b) = (value(h, phi), value(-h, -phi));
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() <= 1e-10 * a[c].max(1e-6), "h {h}, phi {phi}: {a:?} and {b:?}");
        }
    }
}

#[test]
fn without_absorption_all_light_leaves() {
    for i in 0..2000 {
        let u = |stream: u32| unit(i, 0x2f0 + stream);
        let medulla = medulla(u(0), 10.0_f64.powf(5.0 * u(1) - 2.0), [0.0; 3], 2.0 * u(2) - 1.0);
        let fur = Fur {
            eta: 1.2 + u(3),
            layers: 1.0 + 3.0 * u(4),
            ..fur(1.0 + 30.0 * u(5), 10.0 * u(6) - 5.0, [0.0; 3], medulla)
        };
        for h in [2.0 * u(7) - 1.0, 0.0, 1.0] {
            let total = fur.prepare(&Hit::new(Dir::from_sin(2.0 * u(8) - 1.0, 0.3), h)).energies().sum();
            assert!(total.0.iter().all(|x| (x - 1.0).abs() < 1e-9), "{fur:?} at {h}: {total:?}");
        }
    }
}

#[test]
fn a_stack_of_layers_reflects_what_its_light_paths_sum_to() {
    // Two interfaces: F + (1-F)² F (1 + F² + F⁴ + ...), and the stack of n + 1 from that of n likewise.
    let reflected = |layers: f64| {
        let fur = Fur { layers, ..fur::<f64>(8.0, 0.0, [0.0; 3], Medulla::none()) };
        fur.prepare(&Hit::new(Dir::from_sin(0.3, 0.0), 0.6)).energies()[R][0]
    };
    let f = reflected(1.0);
    let mut stack = f;
    for layers in 2..6 {
        let bounces: f64 = (0..60).map(|n| (f * stack).powi(n)).sum();
        stack += (1.0 - stack).powi(2) * f * bounces;
        let got = reflected(f64::from(layers));
        assert!((got - stack).abs() < 1e-12, "{layers} layers: {got}, the sum of paths is {stack}");
    }
}

// --- Photons

/// Radius, scattering and anisotropy of a medulla, and the sine of an inclination: between the nodes of the table.
const TRACED: [(f64, f64, f64, f64); 6] = [
    (0.6, 2.0, 0.4, 0.0),
    (0.85, 4.0, 0.0, 0.5),
    (0.35, 3.0, 0.7, 0.3),
    (0.9, 0.6, 0.8, 0.7),
    (0.75, 12.0, 0.4, 0.2),
    (0.5, 1.0, -0.3, 0.85),
];
const OFFSETS: [f64; 5] = [-0.85, -0.5, 0.0, 0.35, 0.7];
/// Absorption of cortex and medulla.
const ABSORBED: [(f64, f64); 4] = [(0.0, 0.0), (0.2, 0.0), (0.5, 0.2), (1.5, 1.0)];

/// The lobe that a photon belongs to.
fn lobe(exit: &trace::Exit) -> usize {
    if exit.scattered_after.is_some() { RESIDUAL } else { (exit.arrivals as usize).min(RESIDUAL) }
}

/// Errors of the albedo, for every medulla, offset and absorption; the unscattered lobes are held to the noise.
fn albedo_errors(eta: f64, photons: u32) -> Vec<f64> {
    let n = f64::from(photons);
    let mut errors = Vec::new();
    for (i, (radius, scattering, anisotropy, sin_k)) in TRACED.into_iter().enumerate() {
        let cylinder = Cylinder { eta, radius, scattering, anisotropy };
        for (j, h) in OFFSETS.into_iter().enumerate() {
            let mut random = Random::new((100.0 * eta) as u32 + 1000 * (10 * i + j) as u32);
            let exits: Vec<_> = (0..photons).filter_map(|_| trace(&cylinder, sin_k, h, &mut random)).collect();
            for (cortex, core) in ABSORBED {
                let (mut sums, mut squares) = ([0.0_f64; 4], [0.0_f64; 4]);
                for exit in &exits {
                    let weight = (-cortex * exit.cortex - core * exit.medulla).exp();
                    sums[lobe(exit)] += weight;
                    squares[lobe(exit)] += weight * weight;
                }
                let fur = Fur { eta, ..fur(5.0, 0.0, [cortex; 3], medulla(radius, scattering, [core; 3], anisotropy)) };
                let energies = fur.prepare(&Hit::new(Dir::from_sin(sin_k, 0.0), h)).energies();
                // R, TT, TRT are exact: 5 standard errors, and 5 photons where there are next to none. 180
                // comparisons per index, so a false alarm with probability 1e-4.
                for p in [R, TT, TRT] {
                    let (mean, want) = (sums[p] / n, energies[p][0]);
                    let error = ((squares[p] / n - mean * mean).max(0.0) / n).sqrt();
                    assert!(
                        (mean - want).abs() < 5.0 * error + 5.0 / n,
                        "medulla {i}, h {h}, absorption {cortex} and {core}, lobe {p}: {mean} ± {error} traced, {want}"
                    );
                }
                if cortex > 0.0 {
                    errors.push(energies.sum()[0] - sums.iter().sum::<f64>() / n);
                }
            }
        }
    }
    errors
}

/// Largest and mean size.
fn sizes(errors: &[f64]) -> (f64, f64) {
    let largest = errors.iter().fold(0.0_f64, |a, e| a.max(e.abs()));
    (largest, errors.iter().map(|e| e.abs()).sum::<f64>() / errors.len() as f64)
}

/// The albedo of the traced fiber within 0.025, in the mean within 0.01: measured 0.014 and 0.005, of which 0.004
/// and 0.002 may be noise.
#[test]
fn albedos_are_the_traced_ones() {
    let (largest, mean) = sizes(&albedo_errors(1.55, 12_000));
    assert!(largest < 0.025 && mean < 0.01, "albedos are off by {largest} at most, by {mean} in the mean");
}

/// The table is made for an index of 1.55. Away from it scattered light takes ways of other lengths: measured 0.061
/// and 0.023.
#[test]
fn albedos_at_other_indices_are_nearly_the_traced_ones() {
    for eta in [1.4, 1.7] {
        let (largest, mean) = sizes(&albedo_errors(eta, 3_000));
        assert!(
            largest < 0.08 && mean < 0.035,
            "index {eta}: albedos are off by {largest} at most, by {mean} in the mean"
        );
    }
}

const AROUND: usize = 36;
const ALONG: usize = 24;
/// Rows of the model's values in one bin along the fiber.
const ROWS: usize = 8;

/// Directions of the residual lobe, averaged over five offsets: L1 distance between the distributions of model and
/// photons, around (36 bins) and along the fiber (24 bins of the sine). Measured: around 0.29 at most, 0.10 in the
/// mean; along 0.19 and 0.10. The noise of the photons is some 0.03 of each.
/// Distributions without anything in common are 2 apart.
#[test]
fn scattered_light_goes_where_it_is_traced_to() {
    let absorption = 0.2_f64;
    let mut distances = [Vec::new(), Vec::new()];
    for (i, (radius, scattering, anisotropy, sin_k)) in TRACED.into_iter().enumerate() {
        let cylinder = Cylinder { eta: 1.55, radius, scattering, anisotropy };
        let fur = fur::<f64>(4.0, 0.0, [absorption; 3], medulla(radius, scattering, [0.0; 3], anisotropy));
        let (mut traced, mut modelled) =
            ([vec![0.0_f64; AROUND], vec![0.0; ALONG]], [vec![0.0_f64; AROUND], vec![0.0; ALONG]]);
        for (j, h) in OFFSETS.into_iter().enumerate() {
            let mut random = Random::new(500_000 + (10 * i + j) as u32);
            for _ in 0..12_000 {
                let Some(exit) = trace(&cylinder, sin_k, h, &mut random) else { continue };
                if lobe(&exit) == RESIDUAL {
                    let weight = (-absorption * exit.cortex).exp();
                    let around = (exit.phi + PI) / TAU * AROUND as f64;
                    let along = (exit.sin_theta + 1.0) / 2.0 * ALONG as f64;
                    traced[0][(around as usize).min(AROUND - 1)] += weight;
                    traced[1][(along as usize).min(ALONG - 1)] += weight;
                }
            }
            let setup = fur.prepare(&Hit::new(Dir::from_sin(sin_k, 0.0), h));
            for row in 0..ALONG * ROWS {
                let sin_s = 2.0 * (row as f64 + 0.5) / (ALONG * ROWS) as f64 - 1.0;
                for bin in 0..AROUND {
                    let phi = TAU * (bin as f64 + 0.5) / AROUND as f64 - PI;
                    let value = setup.eval(Dir::from_sin(sin_s, phi))[RESIDUAL][0];
                    modelled[0][bin] += value;
                    modelled[1][row / ROWS] += value;
                }
            }
        }
        for ((distances, traced), modelled) in distances.iter_mut().zip(&traced).zip(&modelled) {
            let (a, b): (f64, f64) = (traced.iter().sum(), modelled.iter().sum());
            distances.push(traced.iter().zip(modelled).map(|(x, y)| (x / a - y / b).abs()).sum::<f64>());
        }
    }
    for ((what, distances), (most, mean)) in
        [("around", &distances[0]), ("along", &distances[1])].into_iter().zip([(0.40, 0.14), (0.27, 0.14)])
    {
        let (largest, average) = sizes(distances);
        assert!(largest < most && average < mean, "{what} the fiber: {distances:?}");
    }
}

// --- The shared suite

fn fur_case(name: &'static str, double: Fur<f64>, single: Fur<f32>) -> Case<Fur<f64>, Fur<f32>> {
    let mut lobes: Vec<_> = [(2.0, 1.0), (-1.0, 0.5), (-4.0, 2.0), (0.0, 2.0)]
        .map(|(shift, width)| Lobe { shift: shift * double.alpha, width: width * double.beta_m })
        .to_vec();
    lobes.push(Lobe { shift: 0.0, width: 0.5 });
    Case { lobes, histogram_draws: 300_000, ..Case::new(name, double, single) }
}

conformance!(
    fur_white,
    Case {
        thetas: degrees([0.0, 60.0]),
        offsets: vec![-0.5, 0.3],
        ..fur_case(
            "white fur",
            fur(10.0, -3.0, [0.0; 3], medulla(0.6, 2.0, [0.0; 3], 0.4)),
            fur(10.0, -3.0, [0.0; 3], medulla(0.6, 2.0, [0.0; 3], 0.4)),
        )
    }
);

conformance!(
    fur_of_a_wolf,
    Case { thetas: degrees([-30.0, 80.0]), offsets: vec![0.8], ..fur_case("wolf", Fur::wolf(), Fur::wolf()) }
);

conformance!(
    fur_with_a_thick_medulla,
    Case {
        thetas: degrees([30.0]),
        offsets: vec![0.0],
        ..fur_case(
            "fur with a thick medulla",
            Fur { layers: 2.0, ..fur(5.0, 0.0, [0.1, 0.2, 0.4], medulla(0.9, 20.0, [0.0, 0.0, 0.1], 0.7)) },
            Fur { layers: 2.0, ..fur(5.0, 0.0, [0.1, 0.2, 0.4], medulla(0.9, 20.0, [0.0, 0.0, 0.1], 0.7)) },
        )
    }
);

conformance!(
    fur_with_a_thin_medulla,
    Case {
        thetas: degrees([-60.0]),
        offsets: vec![0.1],
        ..fur_case(
            "fur with a thin medulla",
            fur(20.0, 5.0, [0.2, 0.5, 1.0], medulla(0.2, 0.5, [1.0, 0.1, 0.0], -0.5)),
            fur(20.0, 5.0, [0.2, 0.5, 1.0], medulla(0.2, 0.5, [1.0, 0.1, 0.0], -0.5)),
        )
    }
);

#[test]
fn extreme_parameters_stay_finite() {
    for beta_deg in [0.02, 90.0] {
        for sigma_a in [[0.0; 3], [1e4, 0.0, 1.0]] {
            for (radius, scattering, anisotropy) in [
                (0.0, 1e3, 0.0),
                (0.95, 0.0, 0.0),
                (0.95, 1e3, -0.9),
                (0.95, 1e3, 0.9),
                (0.95, 1e-6, 0.9),
                (1e-3, 1e3, 0.9),
                (2.0, 1.0, -2.0),
            ] {
                let (layers, alpha_deg) = (5.0, 20.0);
                let double = fur(beta_deg, alpha_deg, sigma_a, medulla(radius, scattering, sigma_a, anisotropy));
                let single = fur(beta_deg, alpha_deg, sigma_a, medulla(radius, scattering, sigma_a, anisotropy));
                conformance::finite_at_the_edges(&Case::new(
                    "extreme fur",
                    Fur::<f64> { layers, ..double },
                    Fur::<f32> { layers: layers as f32, ..single },
                ));
            }
        }
    }
}
