//! Tables: that they are what a linear filter makes of the models, within the errors that are stated.

mod interpreter;

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write;
use std::time::Instant;

use fiber::lobe::caustic::Caustic;
use fiber::shader::{self, Parameters};
use fiber::table::marschner::{Axes, MarschnerTables, Resolution};
use fiber::table::{self, Table2, TableError, Tables, Untabulated, from_half, to_half};
use fiber::{Attenuation, Chiang, Deon, Dir, Fiber, Field, Hit, Lobes, Marschner, Model};
use interpreter::{Machine, Value};
use math::{Rgb, hash};
use naga::valid::{Capabilities, ValidationFlags, Validator};

fn unit(stream: u32, index: u32) -> f32 {
    hash::unit(index, stream)
}

/// What the fibers of these tests have absorbed: blond to brown.
fn blond() -> Rgb<f64> {
    Rgb::new(0.2, 0.3, 0.5)
}

fn on_axes(model: &Marschner<f64>, axes: Axes, n: u32) -> MarschnerTables {
    table::marschner::bake_on(model, axes, Resolution::square(n)).expect("a round fiber with smoothed caustics")
}

// --- Texels

#[test]
fn sampling_is_a_sum_of_tents() {
    // The definition of a linear filter: every texel weighs 1 less its distance, where that is positive.
    let size = [5_u32, 3];
    let value = |column: u32, row: u32| -> [f32; 4] {
        std::array::from_fn(|channel| unit(1, channel as u32 + 4 * (column + size[0] * row)))
    };
    let texture = Table2::new(size, value);
    assert_eq!((texture.size(), texture.texels().len()), (size, 15));
    for i in 0..2000 {
        // Beyond the edges too.
        let [u, v] = [2, 3].map(|stream| 1.4 * unit(stream, i) - 0.2);
        let place = |x: f32, n: u32| (x * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
        let (x, y) = (place(u, size[0]), place(v, size[1]));
        let mut want = [0.0_f32; 4];
        for row in 0..size[1] {
            for column in 0..size[0] {
                let weight = (1.0 - (x - column as f32).abs()).max(0.0) * (1.0 - (y - row as f32).abs()).max(0.0);
                for (sum, texel) in want.iter_mut().zip(value(column, row)) {
                    *sum += weight * texel;
                }
            }
        }
        let got = texture.sample(u, v);
        let close = got.iter().zip(want).all(|(got, want)| (got - want).abs() < 2e-6);
        assert!(close, "at {u}, {v}: {got:?}, not {want:?}");
    }
    // The centres are the texels themselves.
    for i in 0..5 {
        let centre = table::coordinate(i as f32 / 4.0, 5);
        assert!((texture.sample(centre, 0.5)[0] - value(i, 1)[0]).abs() < 2e-6);
    }
}

#[test]
fn halves_are_what_the_format_says() {
    for bits in 0..0x7c00_u16 {
        let (exponent, digits) = (i32::from(bits >> 10), f64::from(bits & 0x3ff));
        let want = if exponent == 0 { digits * 2_f64.powi(-24) } else { (1024.0 + digits) * 2_f64.powi(exponent - 25) };
        assert_eq!(f64::from(from_half(bits)), want, "{bits:#x}");
        assert_eq!(from_half(bits | 0x8000), -from_half(bits));
        assert_eq!(to_half(from_half(bits)), bits);
        assert_eq!(to_half(-from_half(bits)), bits | 0x8000);
    }
    assert_eq!(from_half(0x7c00), f32::INFINITY);
    assert!(from_half(0x7e00).is_nan());
}

#[test]
fn halves_are_the_nearest() {
    for bits in 0..0x7bff_u16 {
        // Single precision has more than twice the digits: the middle between two halves is exact.
        let middle = 0.5 * (from_half(bits) + from_half(bits + 1));
        assert_eq!(to_half(middle.next_down()), bits, "{bits:#x}");
        assert_eq!(to_half(middle.next_up()), bits + 1, "{bits:#x}");
        assert_eq!(to_half(middle), bits + (bits & 1), "a tie goes to the even one, {bits:#x}");
    }
    for large in [65504.0, 65519.0, 65520.0, 1e6, f32::INFINITY] {
        assert_eq!((to_half(large), to_half(-large)), (0x7bff, 0xfbff));
    }
    assert!(from_half(to_half(f32::NAN)).is_nan());
}

#[test]
fn texels_are_the_models_azimuthal_terms() {
    const N: u32 = 12;
    let mut checked = 0;
    // The second is so narrow around the fiber that the model integrates in windows.
    for (width, sigma_a) in [(7.5_f64, blond()), (2.0, blond()), (20.0, Rgb::black())] {
        let model = Deon { field: Field::Far, beta_n: width.to_radians(), ..Deon::with_absorption(sigma_a) };
        let tables = table::deon::bake(&model, N).expect("a size that tables have");
        // The row of 0 has no finite inclinations.
        for row in 1..N {
            let half = (f64::from(row) / f64::from(N - 1)).acos();
            let point = model.prepare(&Hit::new(Dir::new(-half, 0.0), 0.0));
            for column in 0..N {
                let phi = std::f64::consts::PI * f64::from(column) / f64::from(N - 1);
                let (_, [r, tt, trt, residual]) = point.factors(Dir::new(half, phi));
                let at = (row * N + column) as usize;
                let [first, second, third] = tables.textures().map(Table2::texels);
                let (first, second, third) = (first[at], second[at], third[row as usize]);
                let got = [first, [second[0], second[1], second[2], third[0]], [third[1], third[2], 0.0, 0.0]].concat();
                let want = [r[0], tt[0], tt[1], tt[2], trt[0], trt[1], trt[2], residual[0], residual[1], residual[2]];
                for (got, want) in got.iter().zip(want) {
                    // Texels are single precision.
                    let miss = (f64::from(*got) - want).abs();
                    assert!(miss <= 1e-6 * want + 1e-8, "{width} at {row}, {column}: {got}, not {want}");
                    checked += 1;
                }
            }
        }
    }
    assert_eq!(checked, 3 * (N - 1) * N * 10);
}

// --- Errors

/// Asserts `(texels a side, largest error over peak, mean error)`, and that errors go with the square of the step.
#[track_caller]
fn assert_bounds<T: Tables>(what: &str, bounds: [(u32, f64, f64); 3], bake: impl Fn(u32) -> T) {
    let mut before: Option<TableError> = None;
    for (n, peak, mean) in bounds {
        let found = table::error(&bake(n), 31);
        assert!(found.max_rel_to_peak <= peak && found.mean_rel <= mean, "{what}, {n} texels: {found:?}");
        if let Some(before) = before {
            let gain = before.mean_rel / found.mean_rel;
            // 4 for steps of half the size; a little noise by where the texels come to lie.
            assert!(gain > 3.0, "{what}, {n} texels: only {gain} times better, {found:?}");
        }
        before = Some(found);
    }
}

fn filled() -> Marschner<f64> {
    Marschner { diffuse: Rgb::new(0.2, 0.1, 0.05), ..Marschner::with_absorption(blond()) }
}

/// Narrow lobes, strong and narrow glints.
fn sharp() -> Marschner<f64> {
    let caustic = Caustic { strength: 5.0, width: 10_f64.to_radians(), fade: 0.2, limit: 0.5 };
    let model = Marschner::with_absorption(blond());
    Marschner { beta_m: 5_f64.to_radians(), alpha: -10_f64.to_radians(), caustic: Some(caustic), ..model }
}

#[test]
fn marschner_is_as_near_as_stated() {
    let bounds = [(64, 0.05, 0.022), (128, 0.013, 0.0055), (256, 0.0035, 0.0014)];
    for (what, model) in [
        ("blond", Marschner::with_absorption(blond())),
        ("white", Marschner::with_absorption(Rgb::black())),
        ("filled", filled()),
    ] {
        assert_bounds(what, bounds, |n| on_axes(&model, Axes::Warped, n));
    }
    let bounds = [(64, 0.1, 0.048), (128, 0.026, 0.012), (256, 0.007, 0.003)];
    assert_bounds("sharp", bounds, |n| on_axes(&sharp(), Axes::Warped, n));
}

#[test]
fn printed_axes_are_worse() {
    let model = Marschner::with_absorption(blond());
    for n in [64, 128, 256] {
        let [printed, warped] = [Axes::Printed, Axes::Warped].map(|axes| table::error(&on_axes(&model, axes, n), 31));
        // 20 and 3 times, mostly at grazing inclinations.
        assert!(printed.max_rel_to_peak > 5.0 * warped.max_rel_to_peak, "{n}: {printed:?}, {warped:?}");
        assert!(printed.mean_rel > 1.5 * warped.mean_rel, "{n}: {printed:?}, {warped:?}");
    }
    // They are right all the same: more texels make them better.
    let [coarse, fine] = [64, 512].map(|n| table::error(&on_axes(&model, Axes::Printed, n), 31));
    assert!(fine.mean_rel < 0.2 * coarse.mean_rel, "{coarse:?}, {fine:?}");
}

#[test]
fn texels_along_the_fiber_are_the_ones_that_count() {
    let model = Marschner::with_absorption(blond());
    let sizes = [(128, 64), (64, 128)].map(|(longitudinal, azimuthal)| Resolution { longitudinal, azimuthal });
    let [along, around] = sizes.map(|size| {
        let tables = table::marschner::bake(&model, size).expect("a round fiber with smoothed caustics");
        table::error(&tables, 31).mean_rel
    });
    assert!(along < 0.6 * around, "{along}, {around}");
}

#[test]
fn deon_is_as_near_as_stated() {
    let bounds = [(64, 0.005, 6e-4), (128, 0.001, 1.6e-4), (256, 3e-4, 5e-5)];
    let hair = Deon::with_absorption(blond());
    for (what, model) in [
        ("blond", hair),
        ("white", Deon::with_absorption(Rgb::black())),
        ("narrow", Deon { beta_m: 5_f64.to_radians(), beta_n: 5_f64.to_radians(), ..hair }),
        ("known", Deon { attenuation: Attenuation::Known, ..hair }),
        ("without residual", Deon { residual: false, ..hair }),
    ] {
        assert_bounds(what, bounds, |n| table::deon::bake(&model, n).expect("a size that tables have"));
    }
}

#[test]
fn chiang_is_as_near_as_stated() {
    let bounds = [(64, 0.003, 6e-4), (128, 0.001, 1.6e-4), (256, 3e-4, 5e-5)];
    let hair = Chiang::with_absorption(blond());
    for (what, model) in [
        ("blond", hair),
        ("white", Chiang::with_absorption(Rgb::black())),
        ("dark", Chiang::with_absorption(Rgb::new(0.5, 1.0, 2.0))),
        ("narrow", Chiang { beta_n: 0.2, ..hair }),
    ] {
        assert_bounds(what, bounds, |n| table::chiang::bake(&model, n).expect("a size that tables have"));
    }
}

#[test]
fn half_precision_costs_a_thousandth() {
    // A number of 11 binary digits is off by up to 2⁻¹¹; a value is a product of two where M is a texture.
    fn assert_cost(what: &str, tables: &impl Tables, cost: f64) {
        let [single, half] = [table::error(tables, 31), table::error(&tables.halved(), 31)].map(|e| e.max_rel_to_peak);
        assert!(half != single && half <= single + cost, "{what}: {half} after {single}");
    }
    let hair = Marschner::with_absorption(blond());
    assert_cost("Marschner", &on_axes(&hair, Axes::Warped, 128), 1.1e-3);
    let hair = Deon::with_absorption(blond());
    assert_cost("d'Eon", &table::deon::bake(&hair, 128).expect("a size that tables have"), 5.5e-4);
    let hair = Chiang::with_absorption(blond());
    assert_cost("Chiang", &table::chiang::bake(&hair, 128).expect("a size that tables have"), 5.5e-4);
}

/// The measure has teeth: light that is missing is found, and so is what is no number.
#[test]
fn errors_are_found() {
    struct Wrong(table::chiang::ChiangTables, f32);
    impl Tables for Wrong {
        fn exact(&self) -> Fiber<f64> {
            self.0.exact()
        }

        fn eval(&self, known: Dir, s: Dir) -> Lobes {
            self.0.eval(known, s).scaled(self.1)
        }

        fn textures(&self) -> [&Table2; 3] {
            self.0.textures()
        }

        fn halved(&self) -> Self {
            Self(self.0.halved(), self.1)
        }
    }
    let tables = table::chiang::bake(&Chiang::with_absorption(blond()), 128).expect("a size that tables have");
    // The tables themselves are off by a thousandth at most, see above.
    let dim = table::error(&Wrong(tables.clone(), 0.97), 5);
    assert!((dim.mean_rel - 0.03).abs() < 0.002 && (dim.max_rel_to_peak - 0.03).abs() < 0.002, "{dim:?}");
    let broken = table::error(&Wrong(tables, f32::NAN), 5);
    assert!(broken.max_abs.is_nan() && broken.max_rel_to_peak.is_nan() && broken.mean_rel.is_nan(), "{broken:?}");
}

#[test]
fn tables_stay_finite_at_the_edges() {
    fn check(tables: &impl Tables) -> u32 {
        let angles = [-FRAC_PI_2, -FRAC_PI_2 + 1e-6, 0.0, 0.4, FRAC_PI_2 - 1e-6, FRAC_PI_2];
        let mut checked = 0;
        for theta_k in angles {
            for theta_s in angles {
                for phi in [0.0, 1e-7, 1.0, PI, -PI, TAU, 1e4] {
                    let fcos = tables.eval(Dir::new(theta_k, 0.0), Dir::new(theta_s, phi));
                    let sound = fcos.0.iter().flat_map(|lobe| lobe.0).all(|x| x.is_finite() && x >= 0.0);
                    assert!(sound, "{fcos:?} from {theta_k} to {theta_s}, {phi}");
                    checked += 1;
                }
            }
        }
        checked
    }
    let mut checked = 0;
    for n in [2, 9] {
        for axes in [Axes::Warped, Axes::Printed] {
            checked += check(&on_axes(&filled(), axes, n));
        }
        checked += check(&table::deon::bake(&Deon::with_absorption(blond()), n).expect("a size that tables have"));
        checked += check(&table::chiang::bake(&Chiang::with_absorption(blond()), n).expect("a size that tables have"));
    }
    assert_eq!(checked, 2 * 4 * 6 * 6 * 7);
}

#[test]
fn what_has_no_tables_is_refused() {
    let hair = Marschner::with_absorption(blond());
    let size = Resolution::square(8);
    let elliptical = Marschner { eccentricity: 0.9, ..hair };
    assert_eq!(table::marschner::bake(&elliptical, size), Err(Untabulated::Elliptical { found: 0.9 }));
    assert_eq!(table::marschner::bake(&Marschner { caustic: None, ..hair }, size), Err(Untabulated::RawCaustic));
    for n in [0, 1, table::LARGEST + 1] {
        let refused = Err(Untabulated::Size { found: n });
        assert_eq!(table::marschner::bake(&hair, Resolution { azimuthal: n, ..size }), refused);
        let refused = Err(Untabulated::Size { found: n });
        assert_eq!(table::marschner::bake(&hair, Resolution { longitudinal: n, ..size }), refused);
        let refused = Err(Untabulated::Size { found: n });
        assert_eq!(table::deon::bake(&Deon::with_absorption(blond()), n), refused);
        let refused = Err(Untabulated::Size { found: n });
        assert_eq!(table::chiang::bake(&Chiang::with_absorption(blond()), n), refused);
    }
    let message = Untabulated::Size { found: 1 }.to_string();
    assert_eq!(message, "a table of 1 texels a side was asked for; it must have 2 to 4096");
}

// --- Shader

fn vector(x: &[f32]) -> Value {
    Value::many(x.iter().map(|x| Value::F32(*x)).collect())
}

fn dir_value(d: Dir) -> Value {
    vector(&[d.sin_theta, d.cos_theta, d.phi])
}

/// The shader with all that it needs, validated for what every WebGPU device has.
fn module() -> naga::Module {
    let text = shader::source(&["table"]).expect("the part exists");
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    if let Err(error) = validator.validate(&module) {
        panic!("{}", error.emit_to_string(&text));
    }
    module
}

#[track_caller]
fn assert_coords(got: &Value, want: [f32; 2], what: &str) {
    for (got, want) in got.parts().iter().zip(want) {
        // The shader's arcsine is good to 1e-7.
        assert!((got.f32() - want).abs() < 2e-6, "{what}: {got:?}, not {want}");
    }
}

/// Compares lobes; true where there is something to compare.
#[track_caller]
fn assert_lobes(got: &Value, want: Lobes, what: &str) -> bool {
    let brightest = want.0.iter().map(|lobe| lobe.max_channel()).fold(0.0, f32::max);
    assert_eq!(got.parts().len(), 4);
    for (got, want) in got.parts().iter().zip(want.0) {
        for (got, want) in got.parts().iter().zip(want.0) {
            // Single precision on both sides, with other polynomials for the Bessel function.
            let miss = (got.f32() - want).abs();
            assert!(miss <= 2e-4 * brightest + 1e-6, "{what}: {got:?}, not {want}, of {brightest}");
        }
    }
    brightest > 1e-3
}

/// Two directions; often near each other's specular cone, where light is.
fn directions(index: u32) -> (Dir, Dir) {
    let theta_k = 1.4 * (2.0 * unit(41, index) - 1.0);
    let off = 0.5 * (2.0 * unit(42, index) - 1.0);
    let known = Dir::new(theta_k, TAU * unit(43, index));
    (known, Dir::new((off - theta_k).clamp(-1.5, 1.5), TAU * unit(44, index) - PI))
}

const PAIRS: u32 = 24;

#[test]
fn the_shader_makes_the_same_of_marschners_textures() {
    let module = module();
    let machine = Machine::new(&module);
    let mut telling = 0;
    for (i, model) in [Marschner::with_absorption(blond()), sharp(), filled()].into_iter().enumerate() {
        for axes in [Axes::Warped, Axes::Printed] {
            // Different sizes, so that they cannot be mistaken for each other.
            let size = Resolution { longitudinal: 33, azimuthal: 20 };
            let tables = table::marschner::bake_on(&model, axes, size).expect("a round fiber with smoothed caustics");
            let code = Value::U32(axes as u32);
            let diffuse = vector(&model.diffuse.cast::<f32>().0);
            for pair in 0..PAIRS {
                let what = format!("model {i}, {axes:?}, pair {pair}");
                let (known, s) = directions(1000 * i as u32 + pair);
                let (k, d) = (dir_value(known), dir_value(s));

                let [u, v] = tables.coords(known, s);
                let arguments = [code.clone(), Value::F32(33.0), k.clone(), d.clone()];
                assert_coords(&machine.call("marschner_table_coords", &arguments), [u, v], &what);
                let m = tables.longitudinal.sample(u, v);

                let [u, v] = tables.section_coords(known, s, m);
                let arguments = [code.clone(), Value::F32(20.0), k.clone(), d.clone(), vector(&m)];
                assert_coords(&machine.call("marschner_section_coords", &arguments), [u, v], &what);
                let (r_tt, trt) = (tables.r_tt.sample(u, v), tables.trt.sample(u, v));

                let arguments = [code.clone(), diffuse.clone(), k, d, vector(&m), vector(&r_tt), vector(&trt)];
                let got = machine.call("marschner_from_tables", &arguments);
                telling += u32::from(assert_lobes(&got, tables.eval(known, s), &what));
            }
        }
    }
    assert!(telling > 3 * PAIRS, "only {telling} of {} values say anything", 6 * PAIRS);
}

#[test]
fn the_shader_makes_the_same_of_far_field_textures() {
    const N: u32 = 20;
    let module = module();
    let machine = Machine::new(&module);
    let mut telling = 0;
    let hair = Deon::with_absorption(blond());
    let known_angle = Deon { attenuation: Attenuation::Known, residual: false, beta_m: 0.2, ..hair };
    for (i, model) in [hair, known_angle].into_iter().enumerate() {
        let tables = table::deon::bake(&model, N).expect("a size that tables have");
        let parameters = Parameters::from(Fiber::Deon(model).cast::<f32>());
        let m = machine.argument_from_bytes("deon_from_tables", 0, parameters.bytes());
        for pair in 0..PAIRS {
            let what = format!("d'Eon {i}, pair {pair}");
            let (known, s) = directions(4000 + 1000 * i as u32 + pair);
            let (k, d) = (dir_value(known), dir_value(s));
            let [u, v] = tables.coords(known, s);
            let arguments = [m.clone(), Value::F32(N as f32), k.clone(), d.clone()];
            assert_coords(&machine.call("deon_table_coords", &arguments), [u, v], &what);
            let texels = [tables.r_tt.sample(u, v), tables.trt.sample(u, v), tables.residual.sample(0.5, v)];
            let [a, b, c] = texels.map(|texel| vector(&texel));
            let got = machine.call("deon_from_tables", &[m.clone(), k, d, a, b, c]);
            telling += u32::from(assert_lobes(&got, tables.eval(known, s), &what));
        }
    }
    let hair = Chiang::with_absorption(blond());
    for (i, model) in [hair, Chiang { beta_m: 0.6, beta_n: 0.5, alpha: 0.1, ..hair }].into_iter().enumerate() {
        let tables = table::chiang::bake(&model, N).expect("a size that tables have");
        let parameters = Parameters::from(Fiber::Chiang(model).cast::<f32>());
        let m = machine.argument_from_bytes("chiang_from_tables", 0, parameters.bytes());
        for pair in 0..PAIRS {
            let what = format!("Chiang {i}, pair {pair}");
            let (known, s) = directions(6000 + 1000 * i as u32 + pair);
            let (k, d) = (dir_value(known), dir_value(s));
            let [u, v] = tables.coords(known, s);
            let arguments = [Value::F32(N as f32), k.clone(), d.clone()];
            assert_coords(&machine.call("chiang_table_coords", &arguments), [u, v], &what);
            let texels = [tables.r_tt.sample(u, v), tables.trt.sample(u, v), tables.residual.sample(0.5, v)];
            let [a, b, c] = texels.map(|texel| vector(&texel));
            let got = machine.call("chiang_from_tables", &[m.clone(), k, d, a, b, c]);
            telling += u32::from(assert_lobes(&got, tables.eval(known, s), &what));
        }
    }
    assert!(telling > 2 * PAIRS, "only {telling} of {} values say anything", 4 * PAIRS);
}

// --- The page

/// Rows of the table in `docs/models/tables.md` for one kind of tables.
fn rows<T: Tables>(out: &mut String, name: &str, bake: impl Fn(u32) -> T) {
    for n in [32, 64, 128, 256, 512] {
        let start = Instant::now();
        let tables = bake(n);
        let baked = start.elapsed().as_secs_f64() * 1e3;
        let single = table::error(&tables, 31);
        let half = table::error(&tables.halved(), 31);
        let texels: usize = tables.textures().iter().map(|texture| texture.texels().len()).sum();
        writeln!(
            out,
            "| {name} | {n} | {:.3} % | {:.3} % | {:.2e} | {:.3} % | {} | {baked:.1} |",
            100.0 * single.max_rel_to_peak,
            100.0 * single.mean_rel,
            single.max_abs,
            100.0 * half.max_rel_to_peak,
            8 * texels / 1024,
        )
        .expect("a string takes everything");
    }
}

#[test]
#[ignore = "prints the table of docs/models/tables.md, with times that are of the machine"]
fn print_the_table_of_the_page() {
    let mut out = "| tables | texels a side | largest error over peak | mean error | largest error, 1/sr \
                   | over peak, rgba16float | KiB, rgba16float | baked in, ms |\n|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    let hair = Marschner::with_absorption(blond());
    rows(&mut out, "Marschner", |n| on_axes(&hair, Axes::Warped, n));
    rows(&mut out, "Marschner, printed axes", |n| on_axes(&hair, Axes::Printed, n));
    let hair = Deon::with_absorption(blond());
    rows(&mut out, "d'Eon", |n| table::deon::bake(&hair, n).expect("a size that tables have"));
    let hair = Chiang::with_absorption(blond());
    rows(&mut out, "Chiang", |n| table::chiang::bake(&hair, n).expect("a size that tables have"));
    println!("{out}");
}
