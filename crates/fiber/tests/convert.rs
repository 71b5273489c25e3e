//! Fibers of one model as fibers of another: that what both know stays, and that the light stays.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use fiber::convert::Kind;
use fiber::quadrature::rule;
use fiber::{
    ArtistLobe, Chiang, Deon, Dir, Fiber, Field, Fur, Glint, Hery, HeryLobe, Highlight, Hit, KajiyaKay, KajiyaKayMode,
    Lambertian, Marschner, MarschnerNorm, Medulla, Model, Sadeghi, SadeghiMode, Scatter,
};
use math::Rgb;

fn brown() -> Rgb<f64> {
    Rgb::new(0.2, 0.5, 1.2)
}

/// One fiber of every model, as hair may have it.
fn hair() -> [Fiber<f64>; 8] {
    let highlight = |color, exponent, shift: f64| Highlight { color, exponent, shift: shift.to_radians() };
    let lobe = |tint, beta: f64, alpha: f64| HeryLobe { tint, beta: beta.to_radians(), alpha: alpha.to_radians() };
    let sadeghi = Sadeghi::with_colors(Rgb::white(), Rgb::new(0.9, 0.6, 0.3), Rgb::new(0.8, 0.5, 0.2));
    let [r, tt, trt] = sadeghi.lobes;
    [
        Fiber::Deon(Deon::with_absorption(brown())),
        Fiber::Chiang(Chiang::with_absorption(brown())),
        Fiber::Lambertian(Lambertian { albedo: Rgb::new(0.6, 0.3, 0.15) }),
        Fiber::KajiyaKay(KajiyaKay {
            diffuse: Rgb::new(0.4, 0.25, 0.12),
            highlights: [highlight(Rgb::splat(0.08), 40.0, -3.0), highlight(Rgb::new(0.05, 0.03, 0.01), 12.0, 6.0)],
            mode: KajiyaKayMode::Normalised,
        }),
        Fiber::Hery(Hery {
            lobes: [lobe(Rgb::splat(0.08), 7.5, -5.0), lobe(Rgb::new(0.06, 0.05, 0.04), 10.0, 7.5)],
            ..Hery::single(Rgb::black(), 0.1, 0.0)
        }),
        Fiber::Marschner(Marschner::with_absorption(brown())),
        Fiber::Sadeghi(Sadeghi {
            lobes: [
                ArtistLobe { intensity: 0.08, ..r },
                ArtistLobe { intensity: 0.45, ..tt },
                ArtistLobe { intensity: 0.1, ..trt },
            ],
            glint: Glint { width: 15.0_f64.to_radians(), ..Glint::default() },
            ..sadeghi
        }),
        Fiber::Fur(Fur::wolf()),
    ]
}

/// Whether the model looks at the offset.
fn is_near(fiber: &Fiber<f64>) -> bool {
    matches!(fiber, Fiber::Deon(_) | Fiber::Chiang(_) | Fiber::Fur(_))
}

/// Share of the light that is scattered, by quadrature of the values: Gauss along the fiber and over the cross-section,
/// trapezoid around. Good to 0.002 for lobes from 3.75 degrees.
fn albedo(fiber: &Fiber<f64>, theta: f64) -> Rgb<f64> {
    let known = Dir::new(theta, 0.0);
    let around = 64;
    let mut sum = Rgb::black();
    // Far-field models say the same for every offset.
    let straight = [(0.0, FRAC_PI_4.recip())];
    let offsets: &[(f64, f64)] = if is_near(fiber) { rule(16) } else { &straight };
    for &(x, across) in offsets {
        let gamma = FRAC_PI_2 * x;
        let across = FRAC_PI_4 * across * gamma.cos();
        let point = fiber.prepare(&Hit::new(known, gamma.sin()));
        for &(y, along) in rule(64) {
            let theta = FRAC_PI_2 * y;
            let weight = across * along * FRAC_PI_2 * theta.cos() * TAU / f64::from(around);
            for j in 0..around {
                // Turned from offset to offset, so that all together are finer.
                let phi = TAU * (f64::from(j) + (31.7 * x).fract()) / f64::from(around);
                sum += point.eval(Dir::new(theta, phi)).sum() * weight;
            }
        }
    }
    sum
}

fn furthest(a: Rgb<f64>, b: Rgb<f64>) -> f64 {
    (a - b).map(f64::abs).max_channel()
}

#[test]
fn models_have_their_names() {
    for (kind, fiber) in Kind::ALL.into_iter().zip(hair()) {
        assert_eq!(fiber.kind(), kind);
        assert_eq!(fiber.name(), kind.name());
        assert_eq!(Kind::named(kind.name()), Some(kind));
    }
    assert_eq!(Kind::named("chianti"), None);
}

#[test]
fn a_fiber_of_the_model_is_left_alone() {
    let odd = Fiber::Deon(Deon { residual: false, field: Field::Far, ..Deon::with_absorption(brown()) });
    assert_eq!(odd.converted(Kind::Deon), odd);
    for fiber in hair() {
        assert_eq!(fiber.converted(fiber.kind()), fiber);
        let single = fiber.cast::<f32>();
        assert_eq!(single.converted(single.kind()), single);
        for kind in Kind::ALL {
            assert_eq!(fiber.converted(kind).kind(), kind);
        }
    }
}

/// Parameters that Deon has.
fn numbers(fiber: Fiber<f64>) -> [f64; 7] {
    let Fiber::Deon(m) = fiber else { panic!("{fiber:?} is no fiber of d'Eon") };
    let [r, g, b] = m.sigma_a.0;
    [m.eta, r, g, b, m.beta_m, m.beta_n, m.alpha]
}

#[test]
fn parameters_survive_the_way_there_and_back() {
    let hair = Deon::<f64> {
        eta: 1.6,
        beta_m: 9.0_f64.to_radians(),
        beta_n: 12.0_f64.to_radians(),
        alpha: -2.5_f64.to_radians(),
        ..Deon::with_absorption(brown())
    };
    let hair = Fiber::Deon(hair);
    for kind in [Kind::Chiang, Kind::Marschner, Kind::Fur] {
        let back = hair.converted(kind).converted(Kind::Deon);
        for (got, want) in numbers(back).into_iter().zip(numbers(hair)) {
            // Bisection goes to the last digit, halves and doubles are exact.
            assert!((got - want).abs() < 1e-12, "{kind:?}: {got}, not {want}");
        }
        let back = hair.cast::<f32>().converted(kind).converted(Kind::Deon).cast();
        for (got, want) in numbers(back).into_iter().zip(numbers(hair)) {
            // Single precision; the polynomials of Chiang's roughness are at most three times as steep as a line.
            assert!((got - want).abs() < 1e-6, "{kind:?} in single precision: {got}, not {want}");
        }
    }
    // The other way round, over the whole range of roughness.
    for beta in [0.05, 0.3, 0.6, 0.9, 1.0] {
        let hair = Chiang { beta_m: beta, beta_n: 1.05 - beta, ..Chiang::<f64>::with_absorption(brown()) };
        let Fiber::Chiang(back) = Fiber::Chiang(hair).converted(Kind::Deon).converted(Kind::Chiang) else {
            panic!("no fiber of Chiang")
        };
        assert!((back.beta_m - hair.beta_m).abs() < 1e-12 && (back.beta_n - hair.beta_n).abs() < 1e-12, "{back:?}");
        assert!((back.alpha - hair.alpha).abs() < 1e-15 && back.sigma_a == hair.sigma_a && back.eta == hair.eta);
    }
    // Widths and shifts by way of the painted models too.
    let want = numbers(hair);
    for kind in [Kind::KajiyaKay, Kind::Hery, Kind::Sadeghi] {
        let got = numbers(hair.converted(kind).converted(Kind::Deon));
        assert!((got[4] - want[4]).abs() < 1e-12 && (got[6] - want[6]).abs() < 1e-12, "{kind:?}: {got:?}");
    }
}

#[test]
fn highlights_stay_where_they_are() {
    // The inclination of the brightest direction of the R lobe, seen from 20 degrees.
    let brightest = |fiber: Fiber<f64>| {
        let known = Dir::new(20.0_f64.to_radians(), 0.0);
        let point = fiber.prepare(&Hit::new(known, 0.0));
        let value = |tenths: i32| point.eval(Dir::new(f64::from(tenths).to_radians() / 10.0, 0.0))[fiber::R][0];
        (-600..=300).max_by(|&a, &b| value(a).total_cmp(&value(b))).map(|tenths| f64::from(tenths) / 10.0)
    };
    let hair = Fiber::Deon(Deon { alpha: -4.0_f64.to_radians(), ..Deon::<f64>::with_absorption(brown()) });
    for kind in Kind::ALL {
        if kind == Kind::Lambertian {
            continue;
        }
        let found = brightest(hair.converted(kind)).expect("there are directions");
        // -20 + 2 (-4) degrees; cosines and Fresnel's factor move the top of a lobe of 7.5 degrees by less than one.
        assert!((found + 28.0).abs() < 1.2, "{kind:?}: {found}");
    }
}

#[test]
fn fur_without_a_medulla_is_the_near_field_of_deon() {
    let hair = Fiber::Fur(Fur { medulla: Medulla::none(), ..Fur::<f64>::with_absorption(brown()) });
    let deon = hair.converted(Kind::Deon);
    for i in 0..200 {
        let x = |stride: f64| (stride * f64::from(i)).fract() - 0.5;
        let hit = Hit::new(Dir::new(2.4 * x(0.618), TAU * x(0.414)), 1.9 * x(0.732));
        let s = Dir::new(2.8 * x(0.236), TAU * x(0.303));
        let (got, want) = (deon.prepare(&hit).eval(s), hair.prepare(&hit).eval(s));
        for p in 0..4 {
            // The same formula in another order.
            assert!(furthest(got[p], want[p]) <= 1e-9 * (1.0 + want[p].max_channel()), "{p}: {got:?}, {want:?}");
        }
    }
}

#[test]
fn light_across_the_fiber_stays() {
    for fiber in hair() {
        let want = [0.0, 30.0_f64].map(|degrees| albedo(&fiber, degrees.to_radians()));
        for kind in Kind::ALL {
            let other = fiber.converted(kind);
            let marschner = fiber.kind() == Kind::Marschner || kind == Kind::Marschner;
            // Gaussians that are cut at the poles lose up to 5 % of the light.
            let limits = [if marschner { 0.05 } else { 0.02 }, 0.06];
            for ((degrees, want), limit) in [0.0, 30.0_f64].into_iter().zip(want).zip(limits) {
                let got = albedo(&other, degrees.to_radians());
                let off = furthest(got, want);
                assert!(off < limit, "{} as {} at {degrees}: {got:?}, not {want:?}", fiber.name(), kind.name());
            }
        }
    }
}

#[test]
fn nothing_makes_light_and_everything_is_finite() {
    // Fibers at the ends of their parameters, among them all that make light.
    // Glints as wide as the quadrature here can see: they become azimuthal widths.
    let glint = Glint { width: 15.0_f64.to_radians(), ..Glint::default() };
    let white = Sadeghi { mode: SadeghiMode::Legacy, glint, ..Sadeghi::default() };
    let bright = KajiyaKay::single(Rgb::white(), Rgb::white(), 25.0, KajiyaKayMode::Thesis);
    let doubled = Marschner { norm: MarschnerNorm::AsPrinted, ..Marschner::with_absorption(Rgb::black()) };
    let ends = [
        Fiber::Deon(Deon::with_absorption(Rgb::black())),
        Fiber::Deon(Deon::with_absorption(Rgb::splat(50.0))),
        Fiber::Chiang(Chiang { beta_m: 1.0, beta_n: 1.0, ..Chiang::with_absorption(Rgb::black()) }),
        Fiber::Lambertian(Lambertian { albedo: Rgb::white() }),
        Fiber::Lambertian(Lambertian { albedo: Rgb::black() }),
        Fiber::KajiyaKay(bright),
        Fiber::Hery(Hery::single(Rgb::white(), 0.1, -0.05)),
        Fiber::Marschner(doubled),
        Fiber::Sadeghi(white),
        Fiber::Fur(Fur::with_absorption(Rgb::black())),
    ];
    for fiber in ends.into_iter().chain(hair()) {
        for kind in Kind::ALL {
            let other = fiber.converted(kind);
            let what = format!("{fiber:?} as {}", kind.name());
            for degrees in [0.0, 50.0_f64] {
                let all = albedo(&other, degrees.to_radians());
                assert!(all.is_finite() && all.0.iter().all(|&x| x >= 0.0), "{what}: {all:?}");
                if other.kind() != fiber.kind() {
                    // Marschner's glints are made to keep the light at normal incidence, not at every angle.
                    // D'Eon's attenuation is that of half the difference of the inclinations, which is not quite that
                    // of either: a clear and wide fiber returns 1.3 % too much at 50 degrees, converted or not.
                    let most = match kind {
                        Kind::Marschner => 1.06,
                        Kind::Deon => 1.02,
                        _ => 1.01,
                    };
                    assert!(all.max_channel() < most, "{what} at {degrees}: {all:?}");
                }
            }
            let point = other.prepare(&Hit::new(Dir::new(1.4, 0.3), 0.99));
            let value = point.eval(Dir::new(-1.5, 3.0)).sum();
            assert!(value.is_finite() && value.0.iter().all(|&x| x >= 0.0), "{what}: {value:?}");
            if let Some(sample) = point.sample([0.3, 0.7, 0.2, 0.9, 0.5]) {
                assert!(sample.weight.sum().is_finite(), "{what}");
            }
        }
    }
}
