//! Colours of hair, end to end: a groom that is asked for a colour shows it in a picture.

#[allow(dead_code, reason = "shared with other tests, which use the rest")]
mod common;

use common::{Mean, Memory, quad, samples, strands, tracer};
use fiber::multiple::albedo::AlbedoCurve;
use fiber::{Chiang, Deon, Fiber};
use math::{Rgb, Vec3, hash};

/// What is asked for. Lighter colours need deeper grooms: light that is absorbed little comes back from far below.
const COLOR: [f64; 3] = [0.6, 0.35, 0.2];

/// Half the extents of the slab and its depth, in mean free paths across the fibers.
const HALF_LENGTH: f32 = 300.0;
const HALF_WIDTH: f32 = 60.0;
const DEPTH: f32 = 45.0;

/// Radius of the fibers. They fill 4 % of the slab, for the curve is that of fibers that are thin against their
/// distances.
const RADIUS: f32 = 0.025;

/// The middle of the slab from straight above (the angle is below 3 degrees), in light of 1 from all around.
const SCENE: &str = r#"
[camera]
position = [0.0, 0.0, 400.0]
target = [0.0, 0.0, 0.0]
fov_deg = 4.3

[film]
width = 2
height = 64
filter = "box"

[render]
max_depth = 2000
curve_basis = "linear"

[[light]]
type = "environment"

[[groom]]
file = "slab"

[[mesh]]
file = "floor"

[look.main]
"#;

/// Straight strands along x, either way, at random places below z = 0, over a floor.
fn slab() -> Memory {
    // The mean free path across them is 1 / (2 r n).
    let count = (2.0 * HALF_WIDTH * DEPTH / (2.0 * RADIUS)) as u32;
    let all: Vec<Vec<Vec3>> = (0..count)
        .map(|strand| {
            let y = HALF_WIDTH * hash::signed(strand, 1);
            let z = -DEPTH * hash::unit(strand, 2);
            let x = if hash::unit(strand, 3) < 0.5 { -HALF_LENGTH } else { HALF_LENGTH };
            vec![Vec3::new(-x, y, z), Vec3::new(x, y, z)]
        })
        .collect();
    let mut assets = Memory::default();
    assets.grooms.insert("slab", strands(&all, RADIUS));
    let below = Vec3::new(0.0, 0.0, -DEPTH - 0.5);
    assets.meshes.insert("floor", quad(below, Vec3::X * HALF_LENGTH, Vec3::Y * HALF_WIDTH));
    assets
}

#[test]
fn a_deep_groom_shows_the_colour_asked_for() {
    let assets = slab();
    let color = Rgb(COLOR);
    for (name, model, look) in [
        ("chiang", Fiber::Chiang(Chiang::with_absorption(Rgb::black())), "model = \"chiang\""),
        ("deon", Fiber::Deon(Deon::with_absorption(Rgb::black())), "model = \"deon\""),
    ] {
        let curve = AlbedoCurve::new(&model, 65_536, 21).unwrap();
        let sigma_a = curve.sigma_a(color);
        let text = format!("{SCENE}{look}\nabsorption = {:?}\n", sigma_a.0);
        // The floor has the colour itself: what leaks through the slab finds about what lies below it in a deeper
        // one. With a white floor the lightest channel would be off by 1 %.
        let floor = format!("mesh.0.albedo={COLOR:?}");
        let tracer = tracer(&assets, &text, &[&floor]);
        let seen = Mean::of(samples(&tracer, 512).into_iter().map(|sample| sample.beauty));
        for (channel, want) in COLOR.into_iter().enumerate() {
            let got = seen.mean[channel];
            let error = seen.error[channel].hypot(curve.error(sigma_a[channel]));
            println!("{name}: asked for {want}, shows {got:.4} ± {error:.4} with σ {:.4}", sigma_a[channel]);
            // 3 % is the aim, for the noise of both and for what the slab is not: infinite, and of fibers without
            // width. The error must leave that a meaning: at 2.5 of them noise alone fails one comparison in 80.
            assert!(error < 0.012 * want, "{name}: {error} for {want}");
            assert!((got / want - 1.0).abs() < 0.03, "{name}: asked for {want}, shows {got}");
        }
    }
}
