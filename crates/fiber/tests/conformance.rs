//! Every model of the crate against the shared suite, and the suite against models broken on purpose.
//!
//! Which parameters are tried: known inclinations out of {0, ±30, ±60, 75, ±80, ±85} degrees, widths of
//! 5, 10 and 20 degrees, tilts of -5 to 5 degrees, no, grey and coloured absorption; each model sees a
//! selection that covers its branches. The far field of d'Eon's model costs a quadrature for each value
//! and gets fewer points, and where it draws with marginal weights fewer draws.

use std::f64::consts::{FRAC_PI_2, PI};

use fiber::conformance::{Case, Lobe, Symmetry, Weight, Widened};
use fiber::{
    Attenuation, Chiang, DIMS, Deon, Dir, Fiber, Field, Hery, HeryLobe, HeryMode, Highlight, Hit, KajiyaKay,
    KajiyaKayMode, Lambertian, Model, Scatter, Weights, conformance,
};
use math::{Real, Rgb};

/// Absorption that tells the channels apart: red passes, blue hardly.
const COLOURED: [f64; 3] = [0.2, 0.5, 1.0];
const NONE: [f64; 3] = [0.0; 3];

fn rgb<F: Real>(x: [f64; 3]) -> Rgb<F> {
    Rgb(x.map(F::of))
}

fn degrees<const N: usize>(x: [f64; N]) -> Vec<f64> {
    x.map(f64::to_radians).to_vec()
}

// --- Kajiya and Kay

fn kajiya_kay<F: Real>(exponent: f64, mode: KajiyaKayMode) -> KajiyaKay<F> {
    KajiyaKay::single(rgb([0.4, 0.3, 0.2]), rgb([0.5, 0.55, 0.6]), F::of(exponent), mode)
}

fn kajiya_kay_case(exponent: f64, mode: KajiyaKayMode) -> Case<KajiyaKay<f64>, KajiyaKay<f32>> {
    Case {
        lobes: vec![Lobe { shift: 0.0, width: exponent.sqrt().recip() }],
        // The cone ends a right angle away from its axis, on either side of the fold.
        kinks: |theta_k| [FRAC_PI_2 - theta_k, FRAC_PI_2 + theta_k].into_iter().flat_map(|x| [x, -x]).collect(),
        ..Case::new("Kajiya-Kay", kajiya_kay(exponent, mode), kajiya_kay(exponent, mode))
    }
}

conformance!(
    kajiya_kay_normalised,
    Case {
        thetas: degrees([0.0, 30.0, -60.0, 80.0]),
        symmetry: Symmetry::Scattering,
        ..kajiya_kay_case(25.0, KajiyaKayMode::Normalised)
    }
);

// The legacy look conserves nothing, and its two parts have different symmetries.
conformance!(
    kajiya_kay_thesis,
    Case { thetas: degrees([0.0, -80.0]), ..kajiya_kay_case(10.0, KajiyaKayMode::Thesis) },
    except: [never_reflects_more_than_it_receives, reciprocity],
);

/// Exponents and shifts (degrees) of two highlights as Scheuermann has them, wider apart than on hair.
const SCHEUERMANN: [(f64, f64); 2] = [(50.0, -5.0), (12.0, 8.0)];

fn two_highlights<F: Real>(mode: KajiyaKayMode) -> KajiyaKay<F> {
    let highlight = |i: usize, color: [f64; 3]| {
        let (exponent, shift) = SCHEUERMANN[i];
        Highlight { color: rgb(color), exponent: F::of(exponent), shift: F::of(shift.to_radians()) }
    };
    let highlights = [highlight(0, [0.3; 3]), highlight(1, [0.4, 0.25, 0.1])];
    KajiyaKay { diffuse: rgb([0.3, 0.2, 0.1]), highlights, mode }
}

fn two_highlights_case(mode: KajiyaKayMode) -> Case<KajiyaKay<f64>, KajiyaKay<f32>> {
    Case {
        lobes: SCHEUERMANN
            .map(|(exponent, shift)| Lobe { shift: 2.0 * shift.to_radians(), width: exponent.sqrt().recip() })
            .to_vec(),
        // Both ends of both cones, also as folded over either pole.
        kinks: |theta_k| {
            let centres = SCHEUERMANN.map(|(_, shift)| 2.0 * shift.to_radians() - theta_k);
            let ends = centres.into_iter().flat_map(|c| [c - FRAC_PI_2, c + FRAC_PI_2]);
            ends.flat_map(|t| [t, PI - t, -PI - t]).collect()
        },
        ..Case::new("Kajiya-Kay with two highlights", two_highlights(mode), two_highlights(mode))
    }
}

// A shifted cone is as symmetric in the two directions as an unshifted one.
conformance!(
    kajiya_kay_with_two_highlights,
    Case {
        thetas: degrees([0.0, -60.0, 85.0]),
        symmetry: Symmetry::Scattering,
        ..two_highlights_case(KajiyaKayMode::Normalised)
    }
);

conformance!(
    kajiya_kay_thesis_with_two_highlights,
    Case { thetas: degrees([30.0, -85.0]), ..two_highlights_case(KajiyaKayMode::Thesis) },
    except: [never_reflects_more_than_it_receives, reciprocity],
);

// --- Lambertian

fn lambertian<F: Real>() -> Lambertian<F> {
    Lambertian { albedo: rgb([0.9, 0.5, 0.1]) }
}

conformance!(
    lambertian_fiber,
    Case {
        thetas: degrees([0.0, -85.0]),
        symmetry: Symmetry::Scattering,
        energy_bound: 0.9,
        ..Case::new("Lambertian", lambertian::<f64>(), lambertian::<f32>())
    }
);

// --- Hery and Ramamoorthi

fn hery<F: Real>(beta_deg: f64, alpha_deg: f64, mode: HeryMode) -> Hery<F> {
    let (beta, alpha) = (F::of(beta_deg.to_radians()), F::of(alpha_deg.to_radians()));
    Hery { mode, ..Hery::single(rgb([1.0, 0.8, 0.3]), beta, alpha) }
}

fn hery_case(beta_deg: f64, alpha_deg: f64, mode: HeryMode) -> Case<Hery<f64>, Hery<f32>> {
    Case {
        // The half angle has the width β, the scattered direction twice that.
        lobes: vec![Lobe { shift: 2.0 * alpha_deg.to_radians(), width: 2.0 * beta_deg.to_radians() }],
        ..Case::new("Hery-Ramamoorthi", hery(beta_deg, alpha_deg, mode), hery(beta_deg, alpha_deg, mode))
    }
}

conformance!(
    hery_truncated,
    Case { thetas: degrees([0.0, 60.0, -80.0, 85.0]), ..hery_case(5.0, -2.0, HeryMode::Truncated) }
);

conformance!(hery_truncated_wide, Case { thetas: degrees([-30.0, 80.0]), ..hery_case(20.0, 5.0, HeryMode::Truncated) });

conformance!(
    hery_with_its_exact_density,
    Case {
        thetas: degrees([0.0, 60.0, -80.0, 85.0]),
        // Where a branch of the fold begins: with c the centre, at ±2c and ±(π - 2|c|).
        kinks: |theta_k| {
            let c = 2.0 * (-2.0_f64).to_radians() - theta_k;
            [2.0 * c, PI - 2.0 * c.abs()].into_iter().flat_map(|x| [x, -x]).collect()
        },
        ..hery_case(5.0, -2.0, HeryMode::FaithfulExactPdf)
    }
);

// Folded samples carry the density of where they ended, not of how they came there: at grazing angles
// the paper's sampler and its density are two different things.
conformance!(
    hery_faithful,
    Case { thetas: degrees([0.0, 60.0, 80.0]), ..hery_case(5.0, 3.0, HeryMode::Faithful) },
    except: [pdf_integrates_to_one, histogram_follows_pdf, sampled_energy_matches_integrated],
);

// Away from the poles nothing folds, so the faithful sampler passes everything there.
conformance!(
    hery_with_marschners_cosines,
    Case {
        thetas: degrees([0.0, 30.0, -30.0]),
        symmetry: Symmetry::Scattering,
        energy_bound: 1.02,
        double: Hery { cos_theta_d: true, ..hery(5.0, -2.0, HeryMode::Faithful) },
        single: Hery { cos_theta_d: true, ..hery(5.0, -2.0, HeryMode::Faithful) },
        ..hery_case(5.0, -2.0, HeryMode::Faithful)
    }
);

/// Widths and shifts of the two lobes in the paper's figure 5, degrees.
const FIGURE_5: [(f64, f64); 2] = [(5.0, -2.0), (10.0, 5.0)];

/// A weak white lobe and a strong blue one, which together return up to 1.17 of the light.
fn two_lobes<F: Real>(mode: HeryMode) -> Hery<F> {
    let lobe = |i: usize, tint: [f64; 3]| {
        let (beta, alpha) = FIGURE_5[i];
        HeryLobe { tint: rgb(tint), beta: F::of(beta.to_radians()), alpha: F::of(alpha.to_radians()) }
    };
    Hery { lobes: [lobe(0, [0.17; 3]), lobe(1, [0.1, 0.2, 1.0])], mode, cos_theta_d: false }
}

fn two_lobes_case(mode: HeryMode) -> Case<Hery<f64>, Hery<f32>> {
    Case {
        lobes: FIGURE_5
            .map(|(beta, alpha)| Lobe { shift: 2.0 * alpha.to_radians(), width: 2.0 * beta.to_radians() })
            .to_vec(),
        energy_bound: 1.17,
        ..Case::new("Hery-Ramamoorthi with two lobes", two_lobes(mode), two_lobes(mode))
    }
}

conformance!(hery_with_two_lobes, Case { thetas: degrees([0.0, 60.0, -85.0]), ..two_lobes_case(HeryMode::Truncated) });

conformance!(
    hery_with_two_lobes_and_its_exact_density,
    Case {
        thetas: degrees([0.0, -80.0]),
        kinks: |theta_k| {
            let centres = FIGURE_5.map(|(_, alpha)| 2.0 * alpha.to_radians() - theta_k);
            let ends = centres.into_iter().flat_map(|c| [2.0 * c, PI - 2.0 * c.abs()]);
            ends.flat_map(|x| [x, -x]).collect()
        },
        ..two_lobes_case(HeryMode::FaithfulExactPdf)
    }
);

// As with one lobe: what folds is not described by the printed density.
conformance!(
    hery_faithful_with_two_lobes,
    Case { thetas: degrees([0.0, 80.0]), ..two_lobes_case(HeryMode::Faithful) },
    except: [pdf_integrates_to_one, histogram_follows_pdf, sampled_energy_matches_integrated],
);

// --- Chiang et al.

fn chiang<F: Real>(beta_m: f64, beta_n: f64, alpha_deg: f64, sigma_a: [f64; 3]) -> Chiang<F> {
    Chiang {
        beta_m: F::of(beta_m),
        beta_n: F::of(beta_n),
        alpha: F::of(alpha_deg.to_radians()),
        eta: F::of(1.55),
        sigma_a: rgb(sigma_a),
        field: Field::Near,
    }
}

fn chiang_case(beta_m: f64, beta_n: f64, alpha_deg: f64, sigma_a: [f64; 3]) -> Case<Chiang<f64>, Chiang<f32>> {
    let double: Chiang<f64> = chiang(beta_m, beta_n, alpha_deg, sigma_a);
    let lobes = [2.0, -1.0, -4.0, 0.0]
        .iter()
        .zip(double.variances())
        .map(|(times, v)| Lobe { shift: times * alpha_deg.to_radians(), width: v.sqrt() })
        .collect();
    Case { lobes, ..Case::new("Chiang", double, chiang(beta_m, beta_n, alpha_deg, sigma_a)) }
}

conformance!(
    chiang_white,
    Case {
        thetas: degrees([0.0, 60.0]),
        offsets: vec![-0.95, -0.3, 0.0, 0.8],
        histogram_draws: 500_000,
        ..chiang_case(0.3, 0.3, -2.0, NONE)
    }
);

conformance!(
    chiang_brown,
    Case {
        thetas: degrees([-30.0, 80.0, -85.0]),
        offsets: vec![-0.95, 0.8],
        ..chiang_case(0.2, 0.4, 5.0, [0.545, 0.906, 1.781])
    }
);

conformance!(
    chiang_narrow,
    Case { thetas: degrees([30.0]), offsets: vec![-0.3], ..chiang_case(0.1, 0.1, 0.0, COLOURED) }
);

// What a form has to do that exists in single precision only.
conformance!(
    a_single_precision_form,
    Case {
        thetas: degrees([30.0]),
        lobes: chiang_case(0.3, 0.3, -2.0, COLOURED).lobes,
        rounding: 2e-3,
        histogram_draws: 300_000,
        ..Case::new(
            "Chiang in single precision",
            Widened(chiang::<f32>(0.3, 0.3, -2.0, COLOURED)),
            chiang::<f32>(0.3, 0.3, -2.0, COLOURED),
        )
    },
    only: [
        pdf_integrates_to_one,
        histogram_follows_pdf,
        weight_is_eval_over_pdf,
        sampled_energy_matches_integrated,
        never_reflects_more_than_it_receives,
    ],
);

// The closed set dispatches to the right model.
conformance!(
    a_model_of_the_closed_set,
    Case {
        histogram_draws: 300_000,
        lobes: chiang_case(0.3, 0.3, -2.0, COLOURED).lobes,
        ..Case::new(
            "Fiber::Chiang",
            Fiber::from(chiang::<f64>(0.3, 0.3, -2.0, COLOURED)),
            Fiber::from(chiang::<f32>(0.3, 0.3, -2.0, COLOURED)),
        )
    },
    only: [histogram_follows_pdf, weight_is_eval_over_pdf, single_precision_follows_double],
);

// --- d'Eon et al.

fn deon<F: Real>(beta_deg: f64, alpha_deg: f64, sigma_a: [f64; 3], field: Field, weights: Weights) -> Deon<F> {
    Deon {
        eta: F::of(1.55),
        sigma_a: rgb(sigma_a),
        beta_m: F::of(beta_deg.to_radians()),
        beta_n: F::of(beta_deg.to_radians()),
        alpha: F::of(alpha_deg.to_radians()),
        residual: true,
        attenuation: Attenuation::Difference,
        weights,
        field,
    }
}

fn deon_case(
    beta_deg: f64,
    alpha_deg: f64,
    sigma_a: [f64; 3],
    field: Field,
    weights: Weights,
) -> Case<Deon<f64>, Deon<f32>> {
    let lobes = [(2.0, 1.0), (-1.0, 0.5), (-4.0, 2.0), (0.0, 2.0)]
        .map(|(times, width)| Lobe { shift: times * alpha_deg.to_radians(), width: width * beta_deg.to_radians() });
    Case {
        lobes: lobes.to_vec(),
        weight: match weights {
            Weights::Marginal => Weight::Exact,
            Weights::Joint => Weight::Expected,
            Weights::Clamped => Weight::Cut,
        },
        ..Case::new(
            match field {
                Field::Near => "d'Eon, near field",
                Field::Far => "d'Eon, far field",
                Field::Auto => "d'Eon, field by width",
            },
            deon(beta_deg, alpha_deg, sigma_a, field, weights),
            deon(beta_deg, alpha_deg, sigma_a, field, weights),
        )
    }
}

conformance!(
    deon_near,
    Case {
        thetas: degrees([0.0, 60.0, -80.0]),
        offsets: vec![-0.95, 0.3],
        ..deon_case(10.0, -3.0, COLOURED, Field::Near, Weights::Marginal)
    }
);

// Without absorption the model gains up to a few percent, because every lobe sees another attenuation
// angle: 1.0007 here, 1.10 at 80 degrees with a tilt of -3 degrees (computed apart from this crate).
conformance!(
    deon_near_white,
    Case {
        thetas: degrees([30.0, 75.0]),
        offsets: vec![0.8],
        energy_bound: 1.001,
        ..deon_case(5.0, 0.0, NONE, Field::Near, Weights::Marginal)
    },
    // Symmetric: it has a test of its own below.
    except: [reciprocity],
);

conformance!(
    deon_near_joint,
    Case { thetas: degrees([0.0, 60.0]), ..deon_case(20.0, -3.0, COLOURED, Field::Near, Weights::Joint) }
);

conformance!(
    deon_near_clamped,
    Case { thetas: degrees([75.0]), ..deon_case(20.0, 5.0, NONE, Field::Near, Weights::Clamped) },
    only: [weight_is_eval_over_pdf, sampled_energy_matches_integrated, finite_at_the_edges],
);

// The attenuation at the known angle conserves exactly, whatever the tilt.
conformance!(
    deon_near_known_angle,
    Case {
        thetas: degrees([60.0, -80.0]),
        double: Deon { attenuation: Attenuation::Known, ..deon(10.0, 5.0, NONE, Field::Near, Weights::Marginal) },
        single: Deon { attenuation: Attenuation::Known, ..deon(10.0, 5.0, NONE, Field::Near, Weights::Marginal) },
        ..deon_case(10.0, 5.0, NONE, Field::Near, Weights::Marginal)
    }
);

conformance!(
    deon_far,
    Case {
        thetas: degrees([-30.0]),
        histogram_draws: 100_000,
        energy_draws: 30_000,
        draws: 2_000,
        ..deon_case(20.0, -3.0, COLOURED, Field::Far, Weights::Marginal)
    }
);

// Joint weights need no quadrature, so the histogram can afford a million draws.
conformance!(
    deon_far_joint,
    Case {
        thetas: degrees([60.0]),
        draws: 5_000,
        ..deon_case(10.0, -3.0, COLOURED, Field::Far, Weights::Joint)
    },
    only: [
        histogram_follows_pdf,
        weight_is_eval_over_pdf,
        sampled_energy_matches_integrated,
        finite_at_the_edges,
    ],
);

conformance!(
    deon_far_clamped,
    Case {
        thetas: degrees([80.0]),
        draws: 5_000,
        ..deon_case(20.0, 0.0, NONE, Field::Far, Weights::Clamped)
    },
    only: [weight_is_eval_over_pdf, sampled_energy_matches_integrated],
);

// TT is 2.5 degrees wide in azimuth here: the quadrature in windows.
conformance!(
    deon_far_narrow,
    Case {
        thetas: degrees([30.0]),
        histogram_draws: 300_000,
        draws: 2_000,
        ..deon_case(5.0, 0.0, [0.2; 3], Field::Far, Weights::Joint)
    },
    only: [pdf_integrates_to_one, histogram_follows_pdf, single_precision_follows_double],
);

conformance!(
    deon_far_is_symmetric_without_tilt,
    Case { symmetry: Symmetry::Fcos, ..deon_case(20.0, 0.0, COLOURED, Field::Far, Weights::Joint) },
    only: [reciprocity],
);

conformance!(
    deon_near_is_symmetric_without_tilt,
    Case {
        symmetry: Symmetry::Fcos,
        offsets: vec![-0.8, 0.0, 0.3],
        ..deon_case(10.0, 0.0, COLOURED, Field::Near, Weights::Joint)
    },
    only: [reciprocity],
);

conformance!(
    deon_far_is_not_symmetric_with_tilt,
    deon_case(20.0, 2.9, COLOURED, Field::Far, Weights::Joint),
    only: [reciprocity],
);

// --- Parameters at their ends

#[test]
fn extreme_parameters_stay_finite() {
    for beta_deg in [0.02, 90.0] {
        for sigma_a in [[0.0; 3], [1e-8; 3], [1e4, 0.0, 1.0]] {
            for alpha_deg in [-20.0, 20.0] {
                // The far field costs a quadrature per value: one of the two tilts.
                let fields: &[Field] = if alpha_deg > 0.0 { &[Field::Near, Field::Far] } else { &[Field::Near] };
                for &field in fields {
                    conformance::finite_at_the_edges(&deon_case(beta_deg, alpha_deg, sigma_a, field, Weights::Joint));
                }
                conformance::finite_at_the_edges(&deon_case(
                    beta_deg,
                    alpha_deg,
                    sigma_a,
                    Field::Near,
                    Weights::Marginal,
                ));
                for (beta_m, beta_n) in [(0.01, 0.01), (0.01, 1.0), (1.0, 0.01), (1.0, 1.0)] {
                    conformance::finite_at_the_edges(&chiang_case(beta_m, beta_n, alpha_deg, sigma_a));
                }
            }
        }
        for alpha_deg in [-20.0, 0.0, 20.0] {
            for mode in [HeryMode::Truncated, HeryMode::Faithful, HeryMode::FaithfulExactPdf] {
                conformance::finite_at_the_edges(&hery_case(beta_deg, alpha_deg, mode));
            }
        }
    }
    for exponent in [0.0, 0.5, 1e4] {
        for mode in [KajiyaKayMode::Normalised, KajiyaKayMode::Thesis] {
            conformance::finite_at_the_edges(&kajiya_kay_case(exponent, mode));
        }
    }
    conformance::finite_at_the_edges(&Case::new(
        "black",
        Lambertian::<f64> { albedo: Rgb::black() },
        Lambertian::<f32> { albedo: Rgb::black() },
    ));
}

/// A case on which pbrt's implementation once failed.
#[test]
fn chiang_at_the_rim_as_in_pbrt() {
    let known = Dir::from_local([0.549_869_66, 0.033_590_17, 0.834_574_76]);
    let s = Dir::from_local([-0.373_833_57, -0.919_200_84, 0.123_766_96]);
    let setup = chiang::<f64>(0.1, 0.1, 2.0, NONE).prepare(&Hit::new(known, -1.0));
    let (fcos, pdf) = setup.eval_pdf(s);
    assert!(fcos.sum().is_finite() && fcos.sum()[0] >= 0.0, "{fcos:?}");
    assert!(pdf.is_finite() && pdf >= 0.0, "{pdf}");
    // At the rim everything is reflected straight on: the only lobe is R.
    let sample = setup.sample([0.9, 0.5, 0.2, 0.5, 0.5]);
    assert!(sample.is_some_and(|sample| sample.lobe == fiber::R), "{sample:?}");
}

// --- The suite against models broken on purpose

/// What a broken model does wrong.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// A cosine hemisphere drawn with `u` where `√u` belongs.
    RadiusWithoutRoot,
    /// A density per unit of angles instead of per steradian.
    PdfWithoutCosine,
    /// R drawn as often as TT should be, and the other way round; the lobe is picked by this dimension.
    LobesSwapped(usize),
    /// Weights 2 % too large.
    WeightOff,
    /// Values 2 % too large, with weights that agree with them.
    TooBright,
    /// The value without its cosine.
    ValueWithoutCosine,
    /// A known direction seen from the wrong end of the fiber.
    KnownMirrored,
}

#[derive(Clone, Copy)]
struct Broken<M> {
    sound: M,
    fault: Fault,
}

struct BrokenSetup<P> {
    sound: P,
    fault: Fault,
    /// Up to where R, and R or TT, are drawn.
    ends: [f64; 2],
}

impl<M: Model<f64>> Model<f64> for Broken<M> {
    type Setup = BrokenSetup<M::Setup>;

    fn prepare(&self, hit: &Hit<f64>) -> Self::Setup {
        let mut hit = *hit;
        if matches!(self.fault, Fault::KnownMirrored) {
            hit.known.sin_theta = -hit.known.sin_theta;
        }
        let sound = self.sound.prepare(&hit);
        let ends = match self.fault {
            Fault::LobesSwapped(dim) => [0, 1].map(|lobe| last_number_of(&sound, dim, lobe)),
            _ => [0.0; 2],
        };
        BrokenSetup { sound, fault: self.fault, ends }
    }
}

/// The largest number in dimension `dim` that still draws `lobe` or one before it, by bisection.
fn last_number_of(setup: &impl Scatter<f64>, dim: usize, lobe: usize) -> f64 {
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..50 {
        let mut u = [0.5; DIMS];
        u[dim] = 0.5 * (lo + hi);
        if setup.sample(u).is_some_and(|sample| sample.lobe <= lobe) {
            lo = u[dim];
        } else {
            hi = u[dim];
        }
    }
    lo
}

impl<P: Scatter<f64>> Scatter<f64> for BrokenSetup<P> {
    fn eval(&self, s: Dir<f64>) -> fiber::Lobes<f64> {
        let fcos = self.sound.eval(s);
        match self.fault {
            Fault::TooBright => fcos.scaled(1.02),
            Fault::ValueWithoutCosine => fcos.scaled(s.cos_theta.recip()),
            _ => fcos,
        }
    }

    fn pdf(&self, s: Dir<f64>) -> f64 {
        let pdf = self.sound.pdf(s);
        if matches!(self.fault, Fault::PdfWithoutCosine) { pdf / s.cos_theta } else { pdf }
    }

    fn sample(&self, mut u: [f64; DIMS]) -> Option<fiber::Sample<f64>> {
        match self.fault {
            Fault::RadiusWithoutRoot => u[1] *= u[1],
            Fault::LobesSwapped(dim) => {
                let ([r, both], x) = (self.ends, u[dim]);
                let tt = both - r;
                if x < tt {
                    u[dim] = x * r / tt;
                } else if x < both {
                    u[dim] = r + (x - tt) * tt / r;
                }
            }
            _ => {}
        }
        let mut sample = self.sound.sample(u)?;
        match self.fault {
            Fault::WeightOff | Fault::TooBright => sample.weight = sample.weight.scaled(1.02),
            Fault::PdfWithoutCosine => sample.pdf = Some(self.pdf(sample.dir)),
            _ => {}
        }
        Some(sample)
    }
}

fn broken<D: Model<f64>, S>(case: Case<D, S>, fault: Fault) -> Case<Broken<D>, S> {
    Case {
        name: case.name,
        double: Broken { sound: case.double, fault },
        single: case.single,
        thetas: case.thetas,
        offsets: case.offsets,
        lobes: case.lobes,
        kinks: case.kinks,
        weight: case.weight,
        symmetry: case.symmetry,
        energy_bound: case.energy_bound,
        rounding: case.rounding,
        histogram_draws: 100_000,
        energy_draws: 100_000,
        draws: 2_000,
        azimuths: case.azimuths,
        family: case.family,
    }
}

/// The check must complain, and about this.
fn must_complain(about: &str, check: impl FnOnce()) {
    let complaint = std::panic::catch_unwind(std::panic::AssertUnwindSafe(check))
        .expect_err("a broken model passed a check that should have caught it");
    let complaint = complaint.downcast_ref::<String>().expect("checks panic with a formatted message");
    assert!(complaint.contains(about), "a complaint, but not about \"{about}\": {complaint}");
}

fn white_lambertian(fault: Fault) -> Case<Broken<Lambertian<f64>>, Lambertian<f32>> {
    let case = Case {
        thetas: degrees([30.0]),
        symmetry: Symmetry::Scattering,
        ..Case::new("a broken Lambertian", Lambertian { albedo: Rgb::white() }, Lambertian { albedo: Rgb::white() })
    };
    broken(case, fault)
}

#[test]
fn mutant_sound_models_pass_in_the_wrapper() {
    // A fault that a Lambertian cannot have: without this the other mutants would prove nothing.
    let case = white_lambertian(Fault::KnownMirrored);
    conformance::pdf_integrates_to_one(&case);
    conformance::histogram_follows_pdf(&case);
    conformance::weight_is_eval_over_pdf(&case);
    conformance::sampled_energy_matches_integrated(&case);
    conformance::never_reflects_more_than_it_receives(&case);
    conformance::finite_at_the_edges(&case);
    conformance::reciprocity(&case);
}

#[test]
fn mutant_radius_without_root_is_seen_by_the_histogram_alone() {
    let case = white_lambertian(Fault::RadiusWithoutRoot);
    must_complain("histogram", || conformance::histogram_follows_pdf(&case));
    conformance::pdf_integrates_to_one(&case);
    conformance::weight_is_eval_over_pdf(&case);
    conformance::sampled_energy_matches_integrated(&case);
    conformance::never_reflects_more_than_it_receives(&case);
    conformance::finite_at_the_edges(&case);
}

#[test]
fn mutant_density_without_cosine_is_seen_three_times() {
    let case = white_lambertian(Fault::PdfWithoutCosine);
    must_complain("density integrates", || conformance::pdf_integrates_to_one(&case));
    must_complain("histogram", || conformance::histogram_follows_pdf(&case));
    must_complain("value over density", || conformance::weight_is_eval_over_pdf(&case));
}

#[test]
fn mutant_value_without_cosine_is_seen_by_energy_edges_and_reciprocity() {
    let case = white_lambertian(Fault::ValueWithoutCosine);
    must_complain("of the light comes back", || conformance::never_reflects_more_than_it_receives(&case));
    must_complain("the integral says", || conformance::sampled_energy_matches_integrated(&case));
    must_complain("value", || conformance::finite_at_the_edges(&case));
    must_complain("exchanging", || conformance::reciprocity(&case));
}

#[test]
fn mutant_too_bright_is_seen_by_the_energy_alone() {
    let case = white_lambertian(Fault::TooBright);
    must_complain("of the light comes back", || conformance::never_reflects_more_than_it_receives(&case));
    conformance::weight_is_eval_over_pdf(&case);
    conformance::sampled_energy_matches_integrated(&case);
    conformance::histogram_follows_pdf(&case);
}

#[test]
fn mutant_swapped_lobes_are_seen_by_the_histogram() {
    let chiang = broken(chiang_case(0.3, 0.3, -2.0, COLOURED), Fault::LobesSwapped(0));
    must_complain("histogram", || conformance::histogram_follows_pdf(&chiang));
    conformance::weight_is_eval_over_pdf(&chiang);
    conformance::pdf_integrates_to_one(&chiang);

    let near = deon_case(10.0, -3.0, COLOURED, Field::Near, Weights::Marginal);
    let deon = broken(near, Fault::LobesSwapped(1));
    must_complain("histogram", || conformance::histogram_follows_pdf(&deon));
    conformance::weight_is_eval_over_pdf(&deon);
}

#[test]
fn mutant_weight_off_by_two_percent_is_seen_by_weight_and_energy() {
    let chiang = broken(chiang_case(0.3, 0.3, -2.0, COLOURED), Fault::WeightOff);
    must_complain("value over density", || conformance::weight_is_eval_over_pdf(&chiang));
    must_complain("the integral says", || conformance::sampled_energy_matches_integrated(&chiang));
    conformance::histogram_follows_pdf(&chiang);

    // Joint weights are right in the mean only; 2 % must still show.
    let joint = deon_case(10.0, -3.0, NONE, Field::Near, Weights::Joint);
    let deon = Case { draws: 50_000, ..broken(joint, Fault::WeightOff) };
    must_complain("value over density", || conformance::weight_is_eval_over_pdf(&deon));
    must_complain("the integral says", || conformance::sampled_energy_matches_integrated(&deon));
}

#[test]
fn mutant_mirrored_known_direction_is_seen_by_reciprocity() {
    // Mirrored, the lobe lies at +θ_k + 2α: without a tilt that would be symmetric again.
    let sound = Case {
        symmetry: Symmetry::Scattering,
        double: Hery { cos_theta_d: true, ..hery(5.0, -2.0, HeryMode::Faithful) },
        ..hery_case(5.0, -2.0, HeryMode::Faithful)
    };
    let case = broken(sound, Fault::KnownMirrored);
    must_complain("exchanging", || conformance::reciprocity(&case));
}

#[test]
fn mutant_claims_of_symmetry_are_tested() {
    let lambertian =
        Case { symmetry: Symmetry::Neither, ..Case::new("Lambertian", lambertian::<f64>(), lambertian::<f32>()) };
    must_complain("should not be symmetric", || conformance::reciprocity(&lambertian));
    for symmetry in [Symmetry::Scattering, Symmetry::Fcos] {
        let chiang = Case { symmetry, ..chiang_case(0.3, 0.3, -2.0, COLOURED) };
        must_complain("exchanging", || conformance::reciprocity(&chiang));
    }
}

#[test]
fn mutant_single_precision_of_another_width_is_seen() {
    let case = Case { single: chiang::<f32>(0.32, 0.3, -2.0, COLOURED), ..chiang_case(0.3, 0.3, -2.0, COLOURED) };
    must_complain("in single precision", || conformance::single_precision_follows_double(&case));
}
