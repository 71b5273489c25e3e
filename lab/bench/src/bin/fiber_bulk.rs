//! Our side of a comparison with another renderer's hair: the points that both evaluate, and what they cost us.
//!
//! `fiber_bulk points N` prints the points with our values, as JSON, for the peer to evaluate and check;
//! `fiber_bulk time N MS` prints nanoseconds per call, as JSON, every figure measured for `MS` milliseconds on
//! one thread. `lab/bench/peers/hair_bsdf.py` runs both.

use std::f32::consts::PI;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use fiber::{Chiang, DIMS, Deon, Dir, Fiber, FiberSetup, Field, Hit, Model, Scatter};
use math::{Rgb, hash, warp};

/// First stream of random numbers.
const SEED: u32 = 400;

/// How many prepared points are evaluated in turn: few enough to stay in the cache, as the one that a renderer
/// works at does.
const PREPARED: usize = 256;

/// What one call needs, in the form in which a renderer has it: vectors in the fiber's frame.
struct Point {
    known: [f32; 3],
    h: f32,
    light: [f32; 3],
    numbers: [f32; DIMS],
}

/// Points as an orthographic camera sees them on a ball: offset uniform; the light from everywhere.
fn points(count: u32) -> Vec<Point> {
    (0..count)
        .map(|i| {
            let unit = |stream: u32| hash::unit(i, SEED + stream);
            // A hair's breadth inside the rim, where the offset would be 0 / 0.
            let across = warp::disk([unit(0), unit(1)]) * 0.999;
            let known = Dir::from_sin(across.y, 2.0 * PI * unit(2));
            Point {
                known: known.to_local(),
                h: (across.x / known.cos_theta).clamp(-1.0, 1.0),
                light: warp::uniform_sphere([unit(3), unit(4)]).to_array(),
                numbers: std::array::from_fn(|d| hash::unit(i, SEED + 5 + d as u32)),
            }
        })
        .collect()
}

/// The parameters of the comparison: brown hair with Chiang's defaults.
fn chiang() -> Chiang {
    Chiang::with_absorption(fiber::absorption::from_melanin(1.3, 0.2, Default::default()))
}

/// d'Eon's model with the widths that [`chiang`] has for R.
fn deon(field: Field) -> Deon {
    let chiang = chiang();
    Deon {
        eta: chiang.eta,
        beta_m: chiang.variances()[0].sqrt(),
        // The standard deviation of a logistic of scale 1 is π/√3.
        beta_n: chiang.azimuthal_scale() * PI / 3.0_f32.sqrt(),
        alpha: chiang.alpha,
        field,
        ..Deon::with_absorption(chiang.sigma_a)
    }
}

/// Nanoseconds per call of `pass`, which makes `calls` of them.
fn nanoseconds(millis: u32, calls: usize, mut pass: impl FnMut()) -> f64 {
    pass();
    let budget = Duration::from_millis(millis.into());
    let start = Instant::now();
    let mut made = 0;
    loop {
        pass();
        made += calls;
        let elapsed = start.elapsed();
        if elapsed >= budget {
            return elapsed.as_secs_f64() * 1e9 / made as f64;
        }
    }
}

/// Names and nanoseconds of everything that is measured of one model.
fn costs(fiber: &Fiber, points: &[Point], millis: u32) -> [(&'static str, f64); 7] {
    let hits: Vec<(Hit, Dir)> =
        points.iter().map(|p| (Hit::new(Dir::from_local(p.known), p.h), Dir::from_local(p.light))).collect();
    let few = &points[..points.len().min(PREPARED)];
    let prepared: Vec<(FiberSetup, Dir)> =
        hits.iter().take(few.len()).map(|(hit, light)| (fiber.prepare(hit), *light)).collect();
    // What a renderer pays that separates nothing and knows vectors alone, like the peer.
    let hit_of = |p: &Point| Hit::new(Dir::from_local(p.known), p.h);
    let bare_eval_pdf = nanoseconds(millis, points.len(), || {
        for point in points {
            let point = black_box(point);
            black_box(black_box(fiber).prepare(&hit_of(point)).eval_pdf(Dir::from_local(point.light)));
        }
    });
    let bare_sample = nanoseconds(millis, points.len(), || {
        for point in points {
            let point = black_box(point);
            let sample = black_box(fiber).prepare(&hit_of(point)).sample(point.numbers);
            black_box(sample.map(|sample| (sample.dir.to_local(), sample)));
        }
    });
    let prepare = nanoseconds(millis, points.len(), || {
        for (hit, _) in &hits {
            black_box(black_box(fiber).prepare(black_box(hit)));
        }
    });
    let prepare_eval_pdf = nanoseconds(millis, points.len(), || {
        for (hit, light) in &hits {
            black_box(black_box(fiber).prepare(black_box(hit)).eval_pdf(black_box(*light)));
        }
    });
    let prepare_sample = nanoseconds(millis, points.len(), || {
        for ((hit, _), point) in hits.iter().zip(points) {
            black_box(black_box(fiber).prepare(black_box(hit)).sample(black_box(point.numbers)));
        }
    });
    let eval_pdf = nanoseconds(millis, prepared.len(), || {
        for (setup, light) in &prepared {
            black_box(black_box(setup).eval_pdf(black_box(*light)));
        }
    });
    let sample = nanoseconds(millis, prepared.len(), || {
        for ((setup, _), point) in prepared.iter().zip(few) {
            black_box(black_box(setup).sample(black_box(point.numbers)));
        }
    });
    [
        ("vectors_eval_pdf", bare_eval_pdf),
        ("vectors_sample", bare_sample),
        ("prepare_eval_pdf", prepare_eval_pdf),
        ("prepare_sample", prepare_sample),
        ("prepare", prepare),
        ("eval_pdf", eval_pdf),
        ("sample", sample),
    ]
}

fn print_points(points: &[Point]) {
    let Chiang { beta_m, beta_n, alpha, eta, sigma_a, .. } = chiang();
    let alpha_deg = alpha.to_degrees();
    println!("{{\"beta_m\": {beta_m:?}, \"beta_n\": {beta_n:?}, \"alpha_deg\": {alpha_deg:?}, \"eta\": {eta:?},");
    println!("\"sigma_a\": {:?}, \"points\": [", sigma_a.0);
    for (i, Point { known, h, light, numbers }) in points.iter().enumerate() {
        let setup = chiang().prepare(&Hit::new(Dir::from_local(*known), *h));
        let (fcos, pdf) = setup.eval_pdf(Dir::from_local(*light));
        let weight = setup.sample(*numbers).map_or(Rgb::black(), |sample| sample.weight.sum());
        let comma = if i + 1 < points.len() { "," } else { "]}" };
        print!("{{\"known\": {known:?}, \"h\": {h:?}, \"light\": {light:?}, \"numbers\": {numbers:?}, ");
        println!("\"fcos\": {:?}, \"pdf\": {pdf:?}, \"weight\": {:?}}}{comma}", fcos.sum().0, weight.0);
    }
}

fn print_costs(points: &[Point], millis: u32) {
    let models: [(&str, Fiber); 3] =
        [("chiang", chiang().into()), ("deon_near", deon(Field::Near).into()), ("deon_far", deon(Field::Far).into())];
    let models = models.map(|(name, fiber)| {
        let costs = costs(&fiber, points, millis).map(|(what, ns)| format!("\"{what}\": {ns:.2}"));
        format!("\"{name}\": {{{}}}", costs.join(", "))
    });
    println!("{{{}}}", models.join(", "));
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let command = arguments.next().unwrap_or_default();
    let numbers: Option<Vec<u32>> = arguments.map(|text| text.parse::<u32>().ok().filter(|&n| n > 0)).collect();
    match (command.as_str(), numbers.as_deref()) {
        ("points", Some(&[count])) => print_points(&points(count)),
        ("time", Some(&[count, millis])) => print_costs(&points(count), millis),
        _ => {
            eprintln!("usage: fiber_bulk points N | fiber_bulk time N MS, numbers of at least 1");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
