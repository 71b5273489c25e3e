//! Dual scattering from textures: that it is what quadrature makes of the models, and that its shader is its twin.

mod interpreter;

use std::f32::consts::PI;

use fiber::multiple::dual_scattering::{DualScattering, Front, Options, Side};
use fiber::multiple::spread::{ROWS, Spread};
use fiber::quadrature::{integrate, rule};
use fiber::shader;
use fiber::{
    ArtistLobe, Chiang, Deon, Dir, Fiber, Fur, Highlight, Hit, KajiyaKay, KajiyaKayMode, Lambertian, Lobes, Marschner,
    Model, RESIDUAL, Sadeghi, Scatter,
};
use interpreter::{Machine, Value};
use math::{Rgb, hash};
use naga::valid::{Capabilities, ValidationFlags, Validator};

const COLUMNS: u32 = 48;
const ENTRIES: u32 = 32;

fn unit(stream: u32, index: u32) -> f32 {
    hash::unit(index, stream)
}

fn blonde() -> Rgb {
    Rgb::new(0.06, 0.2, 0.6)
}

fn models() -> [Fiber; 6] {
    let highlight = |color, exponent, shift: f32| Highlight { color, exponent, shift: shift.to_radians() };
    let sadeghi = Sadeghi::with_colors(Rgb::white(), Rgb::new(0.9, 0.7, 0.4), Rgb::new(0.8, 0.6, 0.3));
    let [r, tt, trt] = sadeghi.lobes;
    [
        Fiber::Chiang(Chiang::with_absorption(blonde())),
        Fiber::Deon(Deon::with_absorption(blonde())),
        Fiber::Marschner(Marschner::with_absorption(blonde())),
        Fiber::KajiyaKay(KajiyaKay {
            diffuse: Rgb::new(0.6, 0.4, 0.2),
            highlights: [highlight(Rgb::splat(0.1), 40.0, -3.0), highlight(Rgb::new(0.15, 0.1, 0.05), 12.0, 6.0)],
            mode: KajiyaKayMode::Normalised,
        }),
        Fiber::Sadeghi(Sadeghi {
            lobes: [
                ArtistLobe { intensity: 0.1, ..r },
                ArtistLobe { intensity: 0.6, ..tt },
                ArtistLobe { intensity: 0.2, ..trt },
            ],
            ..sadeghi
        }),
        Fiber::Fur(Fur::with_absorption(blonde())),
    ]
}

/// Fine enough around the light and along the fiber for lobes of 3.75 degrees.
fn options() -> Options {
    Options { entries: ENTRIES as usize, samples: 2048, inclinations: 48, azimuths: 48, ..Options::default() }
}

/// Offsets with weights whose sum is 1; one where the model does not look at them.
fn offsets(fiber: &Fiber) -> Vec<(f32, f32)> {
    if !matches!(fiber, Fiber::Deon(_) | Fiber::Chiang(_) | Fiber::Fur(_)) {
        return vec![(0.0, 1.0)];
    }
    let nodes = rule(16).iter().map(|&(x, weight)| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * x).sin_cos();
        (sin as f32, (std::f64::consts::FRAC_PI_4 * weight * cos) as f32)
    });
    nodes.collect()
}

/// A known direction and a light, within 70 degrees of the normal plane.
fn directions(index: u32) -> (Dir, Dir) {
    let dir = |stream: u32| {
        let theta = 70.0_f32.to_radians() * (2.0 * unit(stream, index) - 1.0);
        Dir::new(theta, PI * (2.0 * unit(stream + 1, index) - 1.0))
    };
    (dir(10), dir(12))
}

/// Mean over the cross-section of `DualScattering::eval`, and of the fiber's own lobes.
fn followed(dual: &DualScattering, known: Dir, light: Dir, front: &Front) -> (Rgb, Lobes) {
    let (mut sum, mut direct) = (Rgb::<f32>::black(), Lobes::<f32>::zero());
    for (h, weight) in offsets(dual.model()) {
        let hit = Hit::new(known, h);
        sum += dual.eval(&hit, light, front) * weight;
        let lobes = dual.model().prepare(&hit).eval(light);
        for p in 0..4 {
            direct[p] += lobes[p] * weight;
        }
    }
    (sum, direct)
}

/// Sum of differences, sum of their magnitudes, sum of what is right.
#[derive(Default)]
struct Account {
    off: f64,
    missed: f64,
    whole: f64,
}

impl Account {
    fn add(&mut self, got: Rgb, want: Rgb) {
        for channel in 0..3 {
            let off = f64::from(got[channel]) - f64::from(want[channel]);
            self.off += off;
            self.missed += off.abs();
            self.whole += f64::from(want[channel]);
        }
    }

    fn mean_rel(&self) -> f64 {
        self.missed / self.whole
    }

    fn bias(&self) -> f64 {
        self.off.abs() / self.whole
    }
}

#[test]
fn light_scattered_on_its_way_is_that_of_the_quadrature() {
    for model in models() {
        // Nothing but light that was scattered on its way.
        let options = Options { density_forward: 1.0, density_backward: 0.0, ..options() };
        let dual = DualScattering::new(model, options);
        let spread = Spread::new(&dual, COLUMNS, ENTRIES);
        for n in [1.0, 3.0, 10.0] {
            let mut account = Account::default();
            for index in 0..24 {
                let (known, light) = directions(index);
                let front = dual.uniform(n, light.theta());
                let (want, _) = followed(&dual, known, light, &front);
                account.add(spread.eval(known, light, Lobes::zero(), &front), want);
            }
            // Two percent of it is the form of the lobes, one the draws; a diffuse cosine, next to the direct light,
            // is off by four.
            let (mean_rel, bias) = (account.mean_rel(), account.bias());
            println!("{} behind {n}: {:.2} %, bias {:.2} %", model.name(), 100.0 * mean_rel, 100.0 * bias);
            assert!(mean_rel < 0.05, "{} behind {n}: {mean_rel}", model.name());
            assert!(bias < 0.03, "{} behind {n}: {bias}", model.name());
        }
    }
}

#[test]
fn all_light_together_is_that_of_the_quadrature() {
    for model in models() {
        let dual = DualScattering::new(model, options());
        let spread = Spread::new(&dual, COLUMNS, ENTRIES);
        for (n, limit) in [(0.0, 1e-4), (0.5, 0.05), (2.0, 0.05), (10.0, 0.05)] {
            let mut account = Account::default();
            for index in 100..120 {
                let (known, light) = directions(index);
                let (want, direct) = followed(&dual, known, light, &dual.uniform(n, light.theta()));
                account.add(spread.eval(known, light, direct, &spread.uniform(n, light.theta())), want);
            }
            // With nothing in front only the local part is from a texture, and that one is a copy.
            let mean_rel = account.mean_rel();
            println!("{} behind {n}, all: {:.3} %", model.name(), 100.0 * mean_rel);
            assert!(mean_rel < limit, "{} behind {n}: {mean_rel}", model.name());
        }
    }
}

#[test]
fn curves_are_the_tables() {
    let dual = DualScattering::new(models()[0], options());
    let spread = Spread::new(&dual, COLUMNS, ENTRIES);
    assert_eq!((spread.size(), spread.curves().size()), ([COLUMNS, ENTRIES], [ENTRIES, ROWS]));
    let tables = dual.tables();
    for (first, table) in [(0, tables.forward), (3, tables.returned), (6, tables.passed)] {
        for (column, side) in table.iter().enumerate() {
            for (which, value) in [side.attenuation, side.shift, side.variance].into_iter().enumerate() {
                let texel = spread.curves().texels()[(first + which) * ENTRIES as usize + column];
                let off = value.0.iter().zip(texel).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                // The place of an entry is found again to the rounding.
                assert!(off < 1e-5, "row {first} + {which}, column {column}: {texel:?}, not {value:?}");
            }
        }
    }
    for (n, theta) in [(0.0, 0.2), (0.3, -0.8), (1.0, 0.0), (4.5, 1.1)] {
        let (got, want) = (spread.uniform(n, theta), dual.uniform(n, theta));
        assert!((got.direct - want.direct).abs() < 1e-6);
        for (got, want) in
            [(got.transmittance, want.transmittance), (got.shift, want.shift), (got.variance, want.variance)]
        {
            assert!((got - want).map(f32::abs).max_channel() < 1e-4, "{n} at {theta}: {got:?}, not {want:?}");
        }
    }
}

#[test]
fn a_diffuse_cylinder_glows_as_the_formula_says() {
    let color = Rgb::new(0.9, 0.5, 0.1);
    let dual = DualScattering::new(Fiber::Lambertian(Lambertian { albedo: color }), options());
    let spread = Spread::new(&dual, COLUMNS, ENTRIES);
    // Per azimuth a white one returns ((π - |x|) cos x + sin |x|) / 8.
    let lit = |x: f64| {
        let x = fiber::wrap_angle(x).abs();
        ((std::f64::consts::PI - x) * x.cos() + x.sin()) / 8.0
    };
    for theta in [-1.0_f32, 0.0, 0.7] {
        for degrees in [0.0_f32, 45.0, 90.0, 135.0, 180.0] {
            let [u, v] = spread.coords(Dir::new(theta, 0.3), Dir::new(0.0, 0.3 + degrees.to_radians()));
            let [first, second, third] = spread.textures().map(|texture| texture.sample(u, v));
            assert_eq!((first, second), ([0.0; 4], [0.0; 4]), "there is no other lobe");
            let phi = f64::from(degrees.to_radians());
            let half = std::f64::consts::FRAC_PI_2;
            let want = integrate(-half, half, 64, |psi| 0.5 * psi.cos() * lit(phi + psi));
            for channel in 0..3 {
                let (got, want) = (f64::from(third[channel + 1]), want * f64::from(color[channel]));
                // 1024 draws; a white cylinder has 0.325 in front and 0.017 behind.
                assert!((got - want).abs() < 0.004, "{theta} {degrees}: {got}, not {want}");
            }
        }
        let row = |row: f32| spread.curves().sample(0.5 + theta / PI, (row + 0.5) / ROWS as f32)[RESIDUAL];
        // The cosine lies across the fiber, wherever it is seen from; the mean of its sine squared is 1/4.
        assert!((row(9.0) - theta).abs() < 0.1, "{theta}: {}", row(9.0));
        let v = f64::from(row(10.0));
        let second = v * (v.recip().tanh().recip() - v);
        assert!((second - 0.25).abs() < 0.01, "{theta}: {second}");
        let albedo = spread.albedo(theta);
        assert!((albedo - color).map(f32::abs).max_channel() < 1e-4, "{albedo:?}");
    }
}

#[test]
fn the_glow_holds_the_light_of_the_fiber() {
    for model in models() {
        let dual = DualScattering::new(model, Options { samples: 256, ..options() });
        let spread = Spread::new(&dual, COLUMNS, ENTRIES);
        for row in 0..ENTRIES {
            let mut sum = Rgb::<f32>::black();
            for column in 0..COLUMNS {
                // Trapezoid over half a turn, of a function that is smooth and even at both ends.
                let end = column == 0 || column == COLUMNS - 1;
                let step = if end { PI } else { 2.0 * PI } / (COLUMNS - 1) as f32;
                let [a, b, c] = spread.textures().map(|texture| texture.texels()[(row * COLUMNS + column) as usize]);
                for texel in [a, b, c] {
                    sum += Rgb([texel[1], texel[2], texel[3]]) * step;
                }
                sum += Rgb([a[0], b[0], c[0]]) * step;
            }
            let theta = ((row as f32 + 0.5) / ENTRIES as f32 - 0.5) * PI;
            let albedo = spread.albedo(theta);
            // Draws are gathered in narrow steps, which leave kinks that the trapezoid sees a little of.
            let off = (sum - albedo).map(f32::abs).max_channel();
            assert!(off < 2e-3, "{} row {row}: {sum:?}, not {albedo:?}", model.name());
            assert!(albedo.max_channel() > 0.05, "{} row {row}: {albedo:?}", model.name());
        }
    }
    let white = DualScattering::new(Fiber::Chiang(Chiang::with_absorption(Rgb::black())), options());
    let spread = Spread::new(&white, 2, ENTRIES);
    for row in 0..ENTRIES {
        let theta = ((row as f32 + 0.5) / ENTRIES as f32 - 0.5) * PI;
        // Chiang's model keeps all light, sample by sample.
        assert!((spread.albedo(theta)[0] - 1.0).abs() < 1e-3, "row {row}: {:?}", spread.albedo(theta));
    }
}

#[test]
fn half_precision_is_enough() {
    let dual = DualScattering::new(models()[0], options());
    let spread = Spread::new(&dual, COLUMNS, ENTRIES);
    let halved = spread.halved();
    let mut account = Account::default();
    for index in 300..400 {
        let (known, light) = directions(index);
        let n = 8.0 * unit(20, index);
        let at = |spread: &Spread| spread.eval(known, light, Lobes::zero(), &spread.uniform(n, light.theta()));
        account.add(at(&halved), at(&spread));
    }
    // Eleven bits a texel, some of which come in powers of n.
    assert!(account.mean_rel() < 0.005, "{}", account.mean_rel());
    assert!(account.mean_rel() > 0.0, "nothing was rounded");
}

// --- The shader

fn vector(values: &[f32]) -> Value {
    Value::many(values.iter().copied().map(Value::F32).collect())
}

fn dir_value(d: Dir) -> Value {
    vector(&[d.sin_theta, d.cos_theta, d.phi])
}

/// Vectors of three as they lie in memory: sixteen bytes each.
fn bytes(vectors: &[Rgb]) -> Vec<u8> {
    let words = vectors.iter().flat_map(|rgb| [rgb[0], rgb[1], rgb[2], 0.0]);
    words.flat_map(f32::to_ne_bytes).collect()
}

fn front_bytes(front: &Front) -> Vec<u8> {
    bytes(&[Rgb::splat(front.direct), front.transmittance, front.shift, front.variance])
}

fn numbers(value: &Value) -> Vec<f32> {
    match value {
        Value::F32(x) => vec![*x],
        parts => parts.parts().iter().flat_map(numbers).collect(),
    }
}

#[track_caller]
fn assert_close(got: &Value, want: &[f32], relative: f32, absolute: f32, what: &str) {
    let got = numbers(got);
    assert_eq!(got.len(), want.len(), "{what}");
    for (got, want) in got.iter().zip(want) {
        // Written so that what is no number is wrong.
        assert!((got - want).abs() <= relative * want.abs() + absolute, "{what}: {got}, not {want}");
    }
}

#[test]
fn the_shader_computes_the_same() {
    let text = shader::source(&["spread"]).expect("the part exists");
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(&module).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
    let machine = Machine::new(&module);

    let models = models();
    let mut telling = 0;
    let count = 4096;
    for (i, model) in models.into_iter().enumerate() {
        let options = Options { density_backward: 0.6, samples: 256, ..options() };
        let dual = DualScattering::new(model, options);
        let spread = Spread::new(&dual, COLUMNS, ENTRIES);
        for index in (0..count).filter(|index| *index as usize % 6 == i) {
            let what = format!("{} {index}", model.name());
            let (known, light) = directions(1000 + index);
            let (k, l) = (dir_value(known), dir_value(light));

            let theta = light.theta();
            assert_close(
                &machine.call("spread_theta_coord", &[Value::F32(theta)]),
                &[0.5 + theta / PI],
                1e-6,
                0.0,
                &what,
            );
            let size = spread.size().map(|n| n as f32);
            let [u, v] = spread.coords(known, light);
            let at = machine.call("spread_glow_coords", &[k.clone(), l.clone(), vector(&size)]);
            assert_close(&at, &[u, v], 1e-6, 1e-6, &what);

            // Every third place has nothing in front, every third a share of a fiber.
            let n = [0.0, unit(30, index), 12.0 * unit(30, index)][index as usize / 6 % 3];
            let row =
                |row: usize, theta: f32| spread.curves().sample(0.5 + theta / PI, (row as f32 + 0.5) / ROWS as f32);
            let side = |first: usize, theta: f32| {
                let rgb = |i: usize| {
                    let [r, g, b, _] = row(first + i, theta);
                    Rgb([r, g, b])
                };
                Side { attenuation: rgb(0), shift: rgb(1), variance: rgb(2) }
            };
            let side_bytes = |side: &Side| bytes(&[side.attenuation, side.shift, side.variance]);
            let forward = side_bytes(&side(0, -theta));
            let forward = machine.argument_from_bytes("spread_uniform", 1, &forward);
            let front = spread.uniform(n, theta);
            let members =
                [&[front.direct][..], &front.transmittance.0[..], &front.shift.0[..], &front.variance.0[..]].concat();
            assert_close(&machine.call("spread_uniform", &[Value::F32(n), forward]), &members, 1e-5, 1e-6, &what);

            let first = if (light.phi - known.phi).cos() >= 0.0 { 3 } else { 6 };
            let around = side_bytes(&side(first, 0.5 * (known.theta() - theta)));
            let direct = Lobes([0, 1, 2, 3].map(|p| {
                let [r, g, b] = [0, 1, 2].map(|channel| 0.2 * unit(40 + 3 * p + channel, index));
                Rgb::new(r, g, b)
            }));
            let mut arguments = vec![k, l];
            arguments.push(machine.argument_from_bytes("spread_eval", 2, &bytes(&direct.0)));
            arguments.push(machine.argument_from_bytes("spread_eval", 3, &front_bytes(&front)));
            arguments.push(machine.argument_from_bytes("spread_eval", 4, &around));
            arguments.extend(spread.textures().map(|texture| vector(&texture.sample(u, v))));
            arguments.push(vector(&row(9, known.theta())));
            arguments.push(vector(&row(10, known.theta())));
            arguments.extend([options.density_forward, options.density_backward].map(Value::F32));
            let want = spread.eval(known, light, direct, &front);
            // The rounding of an angle, 1e-7, over the narrowest variance, 0.004, in every of a few factors.
            assert_close(&machine.call("spread_eval", &arguments), &want.0, 5e-4, 1e-6, &what);
            telling += u32::from(n > 0.0 && want.max_channel() > 1e-4);
        }
    }
    assert!(2 * telling > count, "only {telling} of {count} values say anything about scattered light");
}

/// The comparison has teeth: light of other fibers is seen in what the shader returns.
#[test]
fn a_wrong_shader_is_noticed() {
    let sound = shader::source(&["spread"]).expect("the part exists");
    let dual = DualScattering::new(models()[0], Options { samples: 256, ..options() });
    let spread = Spread::new(&dual, COLUMNS, ENTRIES);
    let (known, light) = (Dir::new(0.2, 0.0), Dir::new(0.15, 2.5));
    let front = spread.uniform(3.0, light.theta());
    let value = |text: &str| {
        let module = naga::front::wgsl::parse_str(text).expect("still WGSL");
        let machine = Machine::new(&module);
        let [u, v] = spread.coords(known, light);
        let row = |row: f32, theta: f32| spread.curves().sample(0.5 + theta / PI, (row + 0.5) / ROWS as f32);
        let theta_d = 0.5 * (known.theta() - light.theta());
        let around = [6.0, 7.0, 8.0].map(|r| vector(&row(r, theta_d)[..3])).to_vec();
        let mut arguments = vec![dir_value(known), dir_value(light)];
        arguments.push(machine.argument_from_bytes("spread_eval", 2, &bytes(&[Rgb::black(); 4])));
        arguments.push(machine.argument_from_bytes("spread_eval", 3, &front_bytes(&front)));
        arguments.push(Value::many(around));
        arguments.extend(spread.textures().map(|texture| vector(&texture.sample(u, v))));
        arguments.extend([9.0, 10.0].map(|r| vector(&row(r, known.theta()))));
        arguments.extend([0.7, 0.7].map(Value::F32));
        numbers(&machine.call("spread_eval", &arguments))
    };
    let want = spread.eval(known, light, Lobes::zero(), &front);
    let miss = |text: &str| {
        let got = value(text);
        got.iter().zip(want.0).map(|(got, want)| (got / want - 1.0).abs()).fold(0.0, f32::max)
    };
    assert!(miss(&sound) < 1e-4, "{}", miss(&sound));
    let errors = [
        ("-light.sin_theta, light.cos_theta, -front.shift.x", "-light.sin_theta, light.cos_theta, front.shift.x"),
        ("variances.y + front.variance", "vec3f(variances.y)"),
        ("SPREAD_FLUX: f32 = 0.785398163", "SPREAD_FLUX: f32 = 0.636619772"),
        ("front.transmittance * density_forward", "front.transmittance"),
    ];
    for (right, wrong) in errors {
        assert!(sound.contains(right), "{right} is gone");
        let off = miss(&sound.replace(right, wrong));
        assert!(off > 1e-3, "nothing was said about {wrong} for {right}: {off}");
    }
}
