//! Dual scattering held against followed light: a slab of parallel fibers, lit from the front and from behind.
//!
//! Lengths are in mean free paths of light at right angles to the fibers. Fibers lie along x at random places of
//! density 1/D, so that a path meets one per unit; they are thin (0.6 % of the volume), far longer than light gets along
//! them, and 20 units reach to either side of the picture, where light from the edges is less than 1 %.

#[allow(dead_code, reason = "this test needs a part of what tests of the tracer share")]
mod common;

use accel::{Accel, Hit as Met, Ray, StrandHit};
use common::{Mean, Memory, strands, tracer};
use fiber::multiple::dual_scattering::{Closure, DualScattering, Front, Options};
use fiber::{Chiang, Dir, Hit};
use math::{Frame, Rgb, Vec3, hash};

/// Blonde, brown and nearly black at once: one per channel.
const ABSORPTION: [f64; 3] = [0.05, 0.2, 1.0];

/// Radius of the fibers.
const RADIUS: f32 = 0.004;

/// Half of the picture's height and width, and of the slab's extent.
const HALF_HEIGHT: f32 = 5.0;
const HALF_WIDTH: f32 = HALF_HEIGHT / 12.0;
const HALF_SLAB: f32 = 20.0;

/// Seen along the slab's normal from so far away that all rays are almost parallel.
const SCENE: &str = r#"
[camera]
position = [0.0, 0.0, 300.0]
target = [0.0, 0.0, 0.0]
fov_deg = 1.9097

[film]
width = 4
height = 48
filter = "box"

[render]
max_depth = 400
curve_basis = "linear"

[[groom]]
file = "slab"

[look.main]
model = "chiang"
absorption = [0.05, 0.2, 1.0]
longitudinal_roughness = 0.3
azimuthal_roughness = 0.3
tilt_deg = -2.0
ior = 1.55

[[light]]
type = "distant"
irradiance = 1.0
"#;

/// Straight fibers from -x to +x within `-thickness < z < 0`.
fn slab(thickness: f32) -> Memory {
    let area = 2.0 * HALF_SLAB * thickness;
    let count = (area / (2.0 * RADIUS)) as u32;
    let all: Vec<Vec<Vec3>> = (0..count)
        .map(|strand| {
            let y = HALF_SLAB * hash::signed(strand, 1);
            let z = -thickness * hash::unit(strand, 2);
            vec![Vec3::new(-100.0, y, z), Vec3::new(100.0, y, z)]
        })
        .collect();
    let mut assets = Memory::default();
    assets.grooms.insert("slab", strands(&all, RADIUS));
    assets
}

/// Fibers that light from `towards` crosses on its way to the hit.
fn crossed(accel: &Accel, hit: &StrandHit, towards: Vec3) -> u32 {
    let mut ray = Ray { leaving: Some(hit.leave(towards)), ..Ray::new(hit.position, towards) };
    let mut count = 0;
    // Only hits beyond `t_min` count, so every one is found once.
    while let Some(met) = accel.closest(&ray) {
        count += 1;
        ray.t_min = met.t();
    }
    count
}

/// The mean over the picture, told by dual scattering from what its rays meet.
fn told(accel: &Accel, hair: &DualScattering<f64, Chiang<f64>>, towards: Vec3) -> Mean {
    let values = (0..64_000).map(|i| {
        let origin = Vec3::new(HALF_WIDTH * hash::signed(i, 3), HALF_HEIGHT * hash::signed(i, 4), 10.0);
        let Some(Met::Strand(hit)) = accel.closest(&Ray::new(origin, Vec3::NEG_Z)) else {
            return Rgb::black();
        };
        let frame = Frame::around(hit.tangent);
        let local = |v: Vec3| Dir::<f32>::from_local(frame.to_local(v).to_array()).cast::<f64>();
        let light = local(towards);
        let mut front = Front::open();
        for _ in 0..crossed(accel, &hit, towards) {
            hair.accumulate(&mut front, light.theta());
        }
        hair.eval(&Hit::new(local(Vec3::Z), f64::from(hit.h)), light, &front).cast::<f32>()
    });
    Mean::of(values)
}

/// Path-traced, lit without scattering between fibers, and told by both forms of dual scattering.
struct Compared {
    followed: Rgb<f64>,
    single: Rgb<f64>,
    medium: Rgb<f64>,
    rows: Rgb<f64>,
}

fn compare(what: &str, thickness: f32, towards: Vec3) -> Compared {
    let assets = slab(thickness);
    let text = format!("{SCENE}direction = [{}, {}, {}]\n", -towards.x, -towards.y, -towards.z);
    let followed = Mean::of_picture(&assets, &text, &[], 256);
    let single = Mean::of_picture(&assets, &text, &["render.integrator=direct"], 64);
    let tracer = tracer(&assets, &text, &[]);
    let [medium, rows] = [Closure::Medium, Closure::Rows].map(|closure| {
        // Inside a slab there is hair in all directions: the densities are 1.
        let options =
            Options { closure, density_forward: 1.0, density_backward: 1.0, inclinations: 16, ..Options::default() };
        let hair = DualScattering::new(Chiang::<f64>::with_absorption(Rgb(ABSORPTION)), options);
        told(tracer.accel(), &hair, towards)
    });
    for (name, mean) in [("followed", followed), ("single", single), ("medium", medium), ("rows", rows)] {
        let relative = ratio(mean.mean, followed.mean);
        println!("{what}, {name}: {:.5?} +- {:.5?}, ratio {relative:.3?}", mean.mean.0, mean.error.0);
    }
    for mean in [followed, medium] {
        // About 1 % in truth. Seeds are fixed, so the comparison either always holds or never does.
        let noise = (mean.error / mean.mean).max_channel();
        assert!(noise < 0.015, "{what}: {mean:?} is too noisy to compare");
    }
    Compared { followed: followed.mean, single: single.mean, medium: medium.mean, rows: rows.mean }
}

fn ratio(told: Rgb<f64>, followed: Rgb<f64>) -> [f64; 3] {
    (told / followed).0
}

/// A direction by its inclination to the fibers' normal plane and its turn from the slab's normal, radians.
fn direction(inclination: f32, turn: f32) -> Vec3 {
    Vec3::new(inclination.sin(), inclination.cos() * turn.sin(), inclination.cos() * turn.cos())
}

#[test]
fn light_that_a_thick_slab_returns_is_within_fifteen_percent() {
    let seen = compare("front", 12.0, direction(0.1, 0.2));
    for (channel, told) in ratio(seen.medium, seen.followed).into_iter().enumerate() {
        assert!((told - 1.0).abs() < 0.15, "channel {channel}: {told}");
    }
    // Most light that blonde and brown hair returns was scattered by several fibers.
    let single = ratio(seen.single, seen.followed);
    assert!(single[0] < 0.4 && single[1] < 0.6, "{single:?}");
    // Rows tell less of it, but not much.
    for (channel, told) in ratio(seen.rows, seen.followed).into_iter().enumerate() {
        assert!((told - 1.0).abs() < 0.25, "channel {channel}: {told}");
    }
}

#[test]
fn light_that_passes_a_slab_is_within_fifteen_percent() {
    let seen = compare("back", 3.0, direction(0.1, std::f32::consts::PI - 0.4));
    for (channel, told) in ratio(seen.medium, seen.followed).into_iter().enumerate() {
        assert!((told - 1.0).abs() < 0.15, "channel {channel}: {told}");
    }
    let single = ratio(seen.single, seen.followed);
    assert!(single[0] < 0.6 && single[1] < 0.7, "{single:?}");
    // A known weakness of the published form: scattered light that fills the half circle evenly is dimmed too much
    // by every fiber it crosses. Were this to pass one day, the model page would be wrong.
    let rows = ratio(seen.rows, seen.followed);
    assert!(rows[0] < 0.8, "{rows:?}");
}
