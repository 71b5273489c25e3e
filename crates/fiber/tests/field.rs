//! Near field, far field, and the blend between: the average of the one is the other, and every choice has an
//! exact sampler.

use fiber::conformance::{Case, Lobe, Weight};
use fiber::quadrature::gauss_legendre;
use fiber::{Chiang, Deon, Dir, Field, Hit, Lobes, Model, Scatter, Weights, conformance};
use math::{Real, Rgb, hash};

/// A model on a fiber that looks this many pixels wide.
#[derive(Clone, Copy)]
struct AtWidth<M> {
    model: M,
    width_px: f64,
}

impl<F: Real, M: Model<F>> Model<F> for AtWidth<M> {
    type Setup = M::Setup;

    fn prepare(&self, hit: &Hit<F>) -> M::Setup {
        self.model.prepare(&hit.with_width(F::of(self.width_px)))
    }
}

const COLOURED: [f64; 3] = [0.1, 0.3, 0.9];

fn rgb<F: Real>(x: [f64; 3]) -> Rgb<F> {
    Rgb(x.map(F::of))
}

fn chiang<F: Real>(beta_m: f64, beta_n: f64, field: Field) -> Chiang<F> {
    Chiang {
        beta_m: F::of(beta_m),
        beta_n: F::of(beta_n),
        alpha: F::of((-2.0_f64).to_radians()),
        eta: F::of(1.55),
        sigma_a: rgb(COLOURED),
        field,
    }
}

fn deon<F: Real>(beta_deg: f64, field: Field) -> Deon<F> {
    Deon {
        beta_m: F::of(beta_deg.to_radians()),
        beta_n: F::of(beta_deg.to_radians()),
        alpha: F::of((-3.0_f64).to_radians()),
        field,
        ..Deon::with_absorption(rgb(COLOURED))
    }
}

fn chiang_case(
    name: &'static str,
    beta_n: f64,
    field: Field,
    width_px: f64,
) -> Case<AtWidth<Chiang<f64>>, AtWidth<Chiang<f32>>> {
    let alpha = (-2.0_f64).to_radians();
    let v = chiang::<f64>(0.3, beta_n, field).variances();
    Case {
        thetas: vec![-0.6],
        lobes: [2.0, -1.0, -4.0, 0.0]
            .iter()
            .zip(v)
            .map(|(times, v)| Lobe { shift: times * alpha, width: v.sqrt() })
            .collect(),
        histogram_draws: 200_000,
        energy_draws: 30_000,
        draws: 2_000,
        ..Case::new(
            name,
            AtWidth { model: chiang(0.3, beta_n, field), width_px },
            AtWidth { model: chiang(0.3, beta_n, field), width_px },
        )
    }
}

fn deon_case(name: &'static str, weights: Weights, width_px: f64) -> Case<AtWidth<Deon<f64>>, AtWidth<Deon<f32>>> {
    let (alpha, beta) = ((-3.0_f64).to_radians(), 20.0_f64.to_radians());
    Case {
        thetas: vec![0.7],
        lobes: [(2.0, 1.0), (-1.0, 0.5), (-4.0, 2.0), (0.0, 2.0)]
            .map(|(times, width)| Lobe { shift: times * alpha, width: width * beta })
            .to_vec(),
        weight: if weights == Weights::Joint { Weight::Expected } else { Weight::Exact },
        histogram_draws: 200_000,
        energy_draws: 30_000,
        draws: 2_000,
        ..Case::new(
            name,
            AtWidth { model: Deon { weights, ..deon(20.0, Field::Auto) }, width_px },
            AtWidth { model: Deon { weights, ..deon(20.0, Field::Auto) }, width_px },
        )
    }
}

conformance!(chiang_far, chiang_case("Chiang, far field", 0.3, Field::Far, 9.0));
conformance!(chiang_blended, chiang_case("Chiang, a blend", 0.4, Field::Auto, 1.2));
conformance!(deon_blended, deon_case("d'Eon, a blend", Weights::Marginal, 1.0));
conformance!(deon_blended_joint, deon_case("d'Eon, a blend with joint weights", Weights::Joint, 1.3));

/// `½ ∫ f dh` by a dense rule in `γ`.
fn over_offsets(mut f: impl FnMut(f64) -> Lobes<f64>) -> Lobes<f64> {
    let mut sum = Lobes::<f64>::zero();
    for (x, w) in gauss_legendre(3000) {
        let (h, cos) = (x * std::f64::consts::FRAC_PI_2).sin_cos();
        let at = f(h).scaled(0.5 * w * std::f64::consts::FRAC_PI_2 * cos);
        for (sum, at) in sum.0.iter_mut().zip(at.0) {
            *sum += at;
        }
    }
    sum
}

/// The averaged near field, the far field in both precisions, at random directions.
fn check_average<D: Model<f64>, E: Model<f64>, S: Model<f32>>(name: &str, near: D, far: E, single: S, tolerance: f64) {
    for i in 0..12 {
        let known = Dir::new(1.3 * f64::from(hash::signed(i, 1)), 3.0 * f64::from(hash::signed(i, 2)));
        let s = Dir::new(1.4 * f64::from(hash::signed(i, 3)), 3.0 * f64::from(hash::signed(i, 4)));
        let want = over_offsets(|h| near.prepare(&Hit::new(known, h)).eval(s));
        let got = far.prepare(&Hit::new(known, 0.3)).eval(s);
        let in_single = single.prepare(&Hit::new(known.cast(), 0.3)).eval(s.cast());
        // What a lobe could be at most here: its peak would be many times the value at the wrong place.
        let scale = want.sum().max_channel().max(1e-3);
        for p in 0..4 {
            for c in 0..3 {
                let (w, g, f) = (want[p][c], got[p][c], f64::from(in_single[p][c]));
                assert!((g - w).abs() < tolerance * scale, "{name}, {i}, lobe {p}: far {g}, averaged near {w}");
                assert!((f - w).abs() < (tolerance + 2e-5) * scale, "{name}, {i}, lobe {p}: single {f}, near {w}");
            }
        }
    }
}

#[test]
fn the_average_of_the_near_field_is_the_far_field() {
    // From windows through half-rules of every size to kernels broader than the circle.
    for beta_deg in [1.0, 2.0, 3.5, 5.0, 7.5, 10.0, 20.0, 40.0, 80.0] {
        check_average(
            &format!("d'Eon at {beta_deg} degrees"),
            deon::<f64>(beta_deg, Field::Near),
            deon::<f64>(beta_deg, Field::Far),
            deon::<f32>(beta_deg, Field::Far),
            1e-5,
        );
    }
    for beta_n in [0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.0] {
        check_average(
            &format!("Chiang at {beta_n}"),
            chiang::<f64>(0.3, beta_n, Field::Near),
            chiang::<f64>(0.3, beta_n, Field::Far),
            chiang::<f32>(0.3, beta_n, Field::Far),
            // Where the logistic is cut it has a kink, which no Gauss rule likes.
            if beta_n < 0.6 { 1e-5 } else { 1e-4 },
        );
    }
}

#[test]
fn the_field_follows_the_width() {
    let hit = Hit::new(Dir::new(0.2, 0.0), 0.6);
    let s = Dir::new(-0.25, 2.5);
    let at = |field, width_px: f64| deon::<f64>(10.0, field).prepare(&hit.with_width(width_px)).eval(s).sum();
    let (near, far) = (at(Field::Near, 1.0), at(Field::Far, 1.0));
    assert!((near - far).map(f64::abs).max_channel() > 1e-3, "the point tells the fields apart");
    assert_eq!(at(Field::Auto, 0.5), far);
    assert_eq!(at(Field::Auto, 0.75), far);
    assert_eq!(at(Field::Auto, 1.5), near);
    assert_eq!(at(Field::Auto, f64::INFINITY), near);
    let half = at(Field::Auto, 1.125);
    for c in 0..3 {
        assert!((half[c] - 0.5 * (near[c] + far[c])).abs() < 1e-12, "{half:?} between {near:?} and {far:?}");
    }
}
