//! Pictures held against what is known about them: closed forms, energy, and each other.

mod common;

use std::f64::consts::PI;

use common::{Mean, Memory, ball, load, quad, render, samples, strands, tracer};
use fiber::{Dir, Fiber, Hit, Model, Scatter, quadrature};
use film::{Film, NO_STRAND, Pixel, Sample};
use groom::Attribute;
use math::{DVec3, Quat, Rgb, Vec3};
use scene::{EnvironmentImage, Light};
use trace::{SimdLevel, Tracer};

// --- energy ----------------------------------------------------------------------------------------

/// A dense ball of hair that fills the picture, in light of 1 from all around that the camera does not see.
const FURNACE: &str = r#"
[camera]
position = [0.0, 0.0, 6.0]
target = [0.0, 0.0, 0.0]
fov_deg = 18.0

[film]
width = 16
height = 16

[render]
max_depth = 500

[[light]]
type = "environment"
visible = false

[[groom]]
file = "ball"

[look.main]
"#;

fn dense_ball() -> Memory {
    let mut assets = Memory::default();
    // About ten mean free paths across.
    assets.grooms.insert("ball", ball(4000, 0.015, 1));
    assets
}

#[test]
fn hair_that_absorbs_nothing_vanishes_in_a_furnace() {
    let assets = dense_ball();
    for look in [
        "model = \"chiang\"\nabsorption = 0.0",
        "model = \"chiang\"\nabsorption = 0.0\nlongitudinal_roughness = 0.1\nazimuthal_roughness = 0.8\ntilt_deg = -6.0",
        "model = \"lambertian\"\nalbedo = 1.0",
        "model = \"deon\"\nabsorption = 0.0\nattenuation = \"known\"",
        "model = \"deon\"\nabsorption = 0.0\nattenuation = \"known\"\nweights = \"marginal\"",
    ] {
        let tracer = tracer(&assets, &format!("{FURNACE}{look}\n"), &[]);
        let film = render(&tracer, &[16]);
        assert_eq!(film.rejected(), 0);
        let (mut light, mut alpha, mut region) = (0.0, 0.0, 0);
        for pixel in film.pixels().iter().filter(|pixel| pixel.alpha() > 0.5) {
            light += f64::from(pixel.beauty().luminance());
            alpha += f64::from(pixel.alpha());
            region += 1;
        }
        let rays = tracer.rays() as f64 / tracer.samples() as f64;
        println!("{look:?}: {:.5} over {region} pixels, {rays:.1} rays a sample", light / alpha);
        assert!(region > 200 && rays > 8.0, "the ball is not dense: {region} pixels, {rays} rays a sample");
        // Light is lost to paths of more than 500 events and to rounding alone.
        assert!((light / alpha - 1.0).abs() < 0.003, "{look}: {}", light / alpha);
    }
}

/// One straight fiber through the middle of a picture of 17 units, seen from 1000 units away.
const ISOLATED: &str = r#"
[camera]
position = [0.0, 0.0, 1000.0]
target = [0.0, 0.0, 0.0]
fov_deg = 1.0

[film]
width = 16
height = 16
filter = "box"

[render]
integrator = "direct"
curve_basis = "linear"

[[light]]
type = "environment"
visible = false

[[groom]]
file = "fiber"

[look.main]
"#;

/// What a fiber seen at the inclination `theta` makes of light of 1 from all around: `½∫∫ fcos dω dh` by
/// quadrature, so that no sampler and no geometry is involved.
fn predicted(model: &Fiber, theta: f32, has_offset: bool) -> Rgb<f64> {
    // The light scattered at h and -h is the same by symmetry; h = sin γ smooths the edge.
    let offsets: Vec<(f32, f64)> = if has_offset {
        quadrature::rule(24)
            .iter()
            .map(|&(x, w)| (0.25 * PI * (1.0 + x), w))
            .map(|(gamma, w)| (gamma.sin() as f32, 0.25 * PI * w * gamma.cos()))
            .collect()
    } else {
        vec![(0.0, 1.0)]
    };
    // One degree along, 3.75 degrees around: the narrowest lobes below have 5 degrees both ways.
    let (along, around) = (180, 96);
    let mut sum = Rgb::<f64>::black();
    for (h, weight) in offsets {
        let point = model.prepare(&Hit::new(Dir::new(theta, 0.0), h));
        for i in 0..along {
            let theta_s = PI * ((f64::from(i) + 0.5) / f64::from(along) - 0.5);
            let solid_angle = theta_s.cos() * PI / f64::from(along) * 2.0 * PI / f64::from(around);
            for j in 0..around {
                let phi = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(around);
                let fcos = point.eval(Dir::new(theta_s as f32, phi as f32)).sum();
                sum += fcos.cast::<f64>() * (solid_angle * weight);
            }
        }
    }
    sum
}

/// Holds the picture of an isolated fiber, and its path-traced one, against the model's own albedo.
fn check_isolated(look: &str, has_offset: bool, shape: &str, degrees: &[f32]) {
    for &degrees in degrees {
        let theta = degrees.to_radians();
        let along = Vec3::new(0.0, theta.cos(), theta.sin()) * 100.0;
        let mut assets = Memory::default();
        // It leaves a margin at both sides of the picture, so all offsets are seen, evenly.
        assets.grooms.insert("fiber", strands(&[vec![-along, along]], 8.0));
        let text = format!("{ISOLATED}{look}\n");
        let shape = format!("render.curve_shape={shape}");
        let model = load(&assets, &text, &[]).looks[0].base();
        let want = Mean::exact(predicted(&model, theta, has_offset));
        let mut pictures = Vec::new();
        for integrator in ["render.integrator=direct", "render.integrator=path"] {
            let tracer = tracer(&assets, &text, &[&shape, integrator]);
            let seen: Vec<Sample> = samples(&tracer, 64).into_iter().filter(|s| s.alpha == 1.0).collect();
            assert!(seen.len() > 14_000, "{}", seen.len());
            // The view spans half a degree of inclination to either side, over which the albedo bends.
            let mean = Mean::of(seen.iter().map(|s| s.beauty));
            mean.expect(&format!("{look:?} {shape} at {degrees}, {integrator}"), &want, 1e-3);
            pictures.push(seen);
        }
        // There is nothing else that light could meet.
        assert!(pictures[0] == pictures[1], "{look} {shape}: a lone fiber meets itself at {degrees} degrees");
    }
}

#[test]
fn a_lone_fiber_shows_its_models_own_albedo() {
    let near = "absorption = [0.05, 0.2, 0.8]\nlongitudinal_roughness_deg = 10.0";
    check_isolated(&format!("model = \"deon\"\n{near}"), true, "round", &[0.0, 30.0, 60.0, 75.0]);
    check_isolated(&format!("model = \"deon\"\nweights = \"marginal\"\n{near}"), true, "round", &[-50.0]);
    check_isolated(&format!("model = \"deon\"\nfield = \"far\"\n{near}"), false, "round", &[30.0]);
    check_isolated("model = \"chiang\"\nabsorption = [0.05, 0.2, 0.8]", true, "round", &[0.0, -40.0, 70.0]);
    check_isolated("model = \"lambertian\"\nalbedo = [0.9, 0.5, 0.1]", false, "round", &[0.0, 60.0]);
}

#[test]
fn a_lone_ribbon_shows_its_models_own_albedo_too() {
    let near = "absorption = [0.05, 0.2, 0.8]\nlongitudinal_roughness_deg = 10.0";
    check_isolated(&format!("model = \"deon\"\n{near}"), true, "ribbon", &[0.0, 45.0, 70.0]);
    check_isolated("model = \"lambertian\"\nalbedo = [0.9, 0.5, 0.1]", false, "ribbon", &[0.0, 60.0]);
}

// --- one picture, many ways ------------------------------------------------------------------------

/// Two kinds of hair over a floor, a rectangle, a sphere and a sky with a bright spot; no light is seen by the
/// camera.
const MIXED: &str = r#"
[camera]
position = [0.0, 1.2, 6.0]
target = [0.0, 0.0, 0.0]
fov_deg = 28.0

[film]
width = 20
height = 20

[render]
max_depth = 6

[[light]]
type = "environment"
file = "sky"
visible = false

[[light]]
type = "rectangle"
center = [2.5, 3.0, 2.0]
aim = [0.0, 0.0, 0.0]
width = 2.0
height = 1.5
radiance = [8.0, 6.0, 4.0]

[[light]]
type = "sphere"
center = [-2.6, 1.8, 0.5]
radius = 0.7
radiance = [3.0, 6.0, 9.0]

[[mesh]]
file = "floor"
albedo = [0.6, 0.5, 0.4]

[[groom]]
file = "ball"
look = "deon"
transform = { translate = [-0.9, 0.2, 0.0], scale = 0.8 }

[[groom]]
file = "ball"
look = "chiang"
transform = { translate = [0.9, 0.2, 0.0], scale = 0.8 }

[look.deon]
model = "deon"
preset = "blonde"
longitudinal_roughness_deg = 10.0

[look.chiang]
model = "chiang"
eumelanin = 0.5
"#;

fn mixed() -> Memory {
    let mut assets = Memory::default();
    assets.grooms.insert("ball", ball(250, 0.02, 2));
    assets.meshes.insert("floor", quad(Vec3::NEG_Y, Vec3::X * 4.0, Vec3::Z * 4.0));
    let (width, height) = (32_u32, 16_u32);
    let pixels = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            // A third of a steradian, high on the right.
            let spot = if (6..10).contains(&x) && (3..5).contains(&y) { 20.0 } else { 0.3 };
            Rgb::new(spot, 0.9 * spot, 0.7 * spot + 0.1)
        })
        .collect();
    assets.environments.insert("sky", EnvironmentImage { width, height, pixels });
    assets
}

#[test]
fn all_integrators_make_the_same_picture() {
    let assets = mixed();
    let picture = |set: &[&str]| Mean::of_picture(&assets, MIXED, set, 256);
    let reference = picture(&["render.heuristic=power"]);
    for set in [
        ["render.integrator=path", "render.heuristic=balance"],
        ["render.integrator=bcsdf_only", "render.heuristic=power"],
        ["render.integrator=light_only", "render.heuristic=power"],
        ["render.light_selection=power", "render.heuristic=power"],
        ["render.light_selection=uniform", "render.heuristic=balance"],
        ["render.light_selection=power", "render.integrator=light_only"],
    ] {
        let mean = picture(&set);
        // So loose a comparison would prove nothing.
        let loose = mean.error.zip(mean.mean, |error: f64, mean: f64| error / mean).max_channel();
        assert!(loose < 0.02, "{set:?}: the error is {loose} of the mean");
        // Six comparisons: false alarm 1e-3 in all.
        mean.expect(&format!("{set:?}"), &reference, 0.0);
    }
}

#[test]
fn joint_and_marginal_weights_of_the_far_field_agree() {
    let mut assets = Memory::default();
    assets.grooms.insert("ball", ball(60, 0.05, 3));
    let text = r#"
[camera]
position = [0.0, 0.0, 6.0]
target = [0.0, 0.0, 0.0]
fov_deg = 20.0

[film]
width = 12
height = 12

[render]
max_depth = 2

[[light]]
type = "environment"
radiance = 0.2
visible = false

[[light]]
type = "rectangle"
center = [2.0, 2.0, 2.0]
aim = [0.0, 0.0, 0.0]
width = 3.0
height = 3.0
radiance = [4.0, 4.0, 4.0]

[[groom]]
file = "ball"

[look.main]
model = "deon"
field = "far"
eumelanin = 0.3
longitudinal_roughness_deg = 10.0
"#;
    let joint = Mean::of_picture(&assets, text, &["look.main.weights=joint"], 64);
    let marginal = Mean::of_picture(&assets, text, &["look.main.weights=marginal"], 64);
    joint.expect("joint against marginal", &marginal, 0.0);
    let light_only = Mean::of_picture(&assets, text, &["render.integrator=light_only", "look.main.weights=joint"], 64);
    light_only.expect("lights only against marginal", &marginal, 0.0);
}

#[test]
fn a_picture_does_not_depend_on_threads_passes_or_instruction_sets() {
    let assets = mixed();
    let set = ["film.width=17", "film.height=19"];
    let one = tracer(&assets, MIXED, &set);
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let want = pool(1).install(|| render(&one, &[12]));
    assert_eq!(want.sample_counts(), 12..=12);
    assert!(want.image().pixels.iter().any(|p| p.luminance() > 0.1));
    // The tracer itself is built on three threads here, too.
    let three = pool(3).install(|| render(&tracer(&assets, MIXED, &set), &[12]));
    assert!(three == want, "three threads differ from one");
    let cut = render(&one, &[1, 2, 7, 12]);
    assert!(cut == want, "four passes differ from one");
    for shape in ["render.curve_shape=round", "render.curve_shape=ribbon"] {
        let scene = load(&assets, MIXED, &[set[0], set[1], shape]);
        let mut first = None;
        for level in SimdLevel::available() {
            let picture = render(&Tracer::new(scene.clone(), level), &[4]);
            let first = first.get_or_insert_with(|| picture.clone());
            assert!(picture == *first, "{shape}: {level} differs from the first level");
        }
    }
}

// --- fields and cross-sections ---------------------------------------------------------------------

/// Three straight parallel fibers, well apart, in light of 1 from all around; from 1000 units away a pixel spans
/// 1.09 units.
const BUNDLE: &str = r#"
[camera]
position = [0.0, 0.0, 1000.0]
target = [0.0, 0.0, 0.0]
fov_deg = 1.0

[film]
width = 16
height = 16
filter = "box"

[render]
max_depth = 8
curve_basis = "linear"

[[light]]
type = "environment"
visible = false

[[groom]]
file = "bundle"

[look.main]
"#;

/// The models that have both fields.
const TWO_FIELDS: [&str; 2] = [
    "model = \"deon\"\nabsorption = [0.05, 0.2, 0.8]\nlongitudinal_roughness_deg = 10.0\n",
    "model = \"chiang\"\nabsorption = [0.05, 0.2, 0.8]\n",
];

/// Fibers of this diameter for [`BUNDLE`], longer than the picture is high and all within its width.
fn bundle(diameter: f32) -> Memory {
    let along = Vec3::new(0.0, 100.0, 30.0);
    let all: Vec<Vec<Vec3>> =
        [-5.0, 0.0, 5.0].into_iter().map(|x| vec![Vec3::X * x - along, Vec3::X * x + along]).collect();
    let mut assets = Memory::default();
    assets.grooms.insert("bundle", strands(&all, 0.5 * diameter));
    assets
}

#[test]
fn near_far_and_blended_fields_bring_the_same_light() {
    // 1.1 pixels wide, so that `auto` is nearly half of each.
    let assets = bundle(1.2);
    for look in TWO_FIELDS {
        let text = format!("{BUNDLE}{look}");
        let picture = |field: &str| Mean::of_picture(&assets, &text, &[&format!("look.main.field={field}")], 256);
        let near = picture("near");
        let loose = near.error.zip(near.mean, |error: f64, mean: f64| error / mean).max_channel();
        assert!(loose < 0.01, "{look:?}: the error is {loose} of the mean");
        for field in ["far", "auto"] {
            // In the near field light that leaves to one side begins at that side, so that it meets the neighbour
            // there a little more often: 1.2e-4 of 0.14 with 8192 samples, and nothing with one fiber alone. Four
            // comparisons: false alarm 1e-3 in all.
            picture(field).expect(&format!("{look:?}, {field} against near"), &near, 2e-4);
        }
    }
}

#[test]
fn auto_is_the_far_field_from_afar_and_the_near_field_close_by() {
    let assets = bundle(0.5);
    for look in TWO_FIELDS {
        let text = format!("{BUNDLE}{look}");
        let picture = |field: &str, set: &[&str]| {
            let field = format!("look.main.field={field}");
            let set: Vec<&str> = set.iter().copied().chain([field.as_str(), "render.seed=3"]).collect();
            let film = render(&tracer(&assets, &text, &set), &[8]);
            assert!(film.rejected() == 0 && brightness(&film) > 0.0, "{set:?}");
            film
        };
        // 0.46 pixels wide. Behind the first event `auto` is near whatever the camera sees, so there is one event.
        let set = ["render.max_depth=1"];
        let [near, far, auto] = ["near", "far", "auto"].map(|field| picture(field, &set));
        assert!(auto == far, "{look:?}: thinner than a pixel and not the far field");
        assert!(near != far, "{look:?}: the fields cannot be told apart");
        // 4.6 pixels wide, all events.
        let set = ["camera.position=[0, 0, 100]"];
        let [near, far, auto] = ["near", "far", "auto"].map(|field| picture(field, &set));
        assert!(auto == near, "{look:?}: wider than pixels and not the near field");
        assert!(near != far, "{look:?}: the fields cannot be told apart close by");
        // 1.1 pixels wide: neither.
        let set = ["camera.position=[0, 0, 420]", "render.max_depth=1"];
        let [near, far, auto] = ["near", "far", "auto"].map(|field| picture(field, &set));
        assert!(auto != near && auto != far, "{look:?}: nothing is blended");
    }
}

/// A look that is the same everywhere is set up once for its groom, one that varies at every point.
#[test]
fn a_parameter_that_varies_by_nothing_changes_nothing() {
    let assets = bundle(1.2);
    for look in TWO_FIELDS {
        for field in ["near", "far", "auto"] {
            let text = format!("{BUNDLE}{look}field = \"{field}\"\n");
            let constant = render(&tracer(&assets, &text, &[]), &[4]);
            let set = ["look.main.ior.ramp=[[0.0, 1.55], [1.0, 1.55]]"];
            assert!(load(&assets, &text, &set).looks[0].constant().is_none(), "it does not vary");
            let varying = render(&tracer(&assets, &text, &set), &[4]);
            assert!(brightness(&constant) > 0.0 && varying == constant, "{look:?}, {field}");
        }
    }
}

#[test]
fn an_elliptical_fiber_shows_its_shape_in_trt_alone() {
    let mut assets = Memory::default();
    assets.grooms.insert("ball", ball(250, 0.02, 5));
    // Two lights without extent, one of them behind for TT: one event then takes no random numbers but the place
    // in the pixel and the light, which are the same for both shapes.
    let text = "[camera]\nposition = [0.0, 0.0, 6.0]\ntarget = [0.0, 0.0, 0.0]\nfov_deg = 25.0\n\
                [film]\nwidth = 16\nheight = 16\n[render]\nmax_depth = 1\n\
                [[light]]\ntype = \"distant\"\ndirection = [-1.0, -1.0, -1.0]\nirradiance = 3.0\n\
                [[light]]\ntype = \"distant\"\ndirection = [0.3, -0.2, 1.0]\nirradiance = 3.0\n\
                [[groom]]\nfile = \"ball\"\n[look.main]\nmodel = \"marschner\"\npreset = \"blonde\"\n";
    let shot = |axis: &str| samples(&tracer(&assets, text, &[&format!("look.main.eccentricity={axis}")]), 16);
    let (round, flat) = (shot("1.0"), shot("0.85"));
    for (lobe, name) in fiber::LOBE_NAMES.into_iter().enumerate().take(3) {
        let (mut light, mut change) = (0.0, 0.0);
        for (round, flat) in round.iter().zip(&flat) {
            assert!(flat.lobes[lobe].is_finite() && flat.strand == round.strand);
            light += f64::from(round.lobes[lobe].luminance());
            change += f64::from((flat.lobes[lobe] - round.lobes[lobe]).map(f32::abs).luminance());
        }
        assert!(light > 0.0, "{name} is dark");
        if lobe == fiber::TRT {
            // 0.2 on a ball of fur; a frame that is turned and no more would leave roundings.
            assert!(change > 0.05 * light, "{name}: {change} of {light}");
        } else {
            // Azimuths from frames that are turned: a few roundings of f32, where lobes may be steep.
            assert!(change < 1e-4 * light, "{name}: {change} of {light}");
        }
    }
}

#[test]
fn elliptical_fibers_make_the_same_picture_every_time() {
    let assets = mixed();
    let text = MIXED
        .replace("model = \"chiang\"", "model = \"marschner\"\neccentricity = 0.85")
        .replace("model = \"deon\"", "model = \"marschner\"\neccentricity = { value = 0.9, random = 0.05 }");
    let set = ["film.width=17", "film.height=19"];
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let once = pool(1).install(|| render(&tracer(&assets, &text, &set), &[6]));
    assert_eq!(once.rejected(), 0);
    assert!(once.is_finite() && brightness(&once) > 0.0);
    let again = pool(3).install(|| render(&tracer(&assets, &text, &set), &[2, 6]));
    assert!(again == once, "three threads and two passes differ from one");
}

// --- layers ----------------------------------------------------------------------------------------

/// Whether two sums of the same numbers in another order agree: a few hundred roundings.
fn same(a: Rgb, b: Rgb) -> bool {
    a.zip(b, |a, b| (a - b).abs() - 2e-5 * a.abs().max(b.abs()) - 1e-7).max_channel() <= 0.0
}

#[test]
fn layers_add_up_to_the_beauty() {
    let assets = mixed();
    let (mut hair, mut floor, mut sky) = (0, 0, 0);
    for sample in samples(&tracer(&assets, MIXED, &["render.max_depth=20"]), 32) {
        let layers = sample.direct + sample.indirect;
        assert!(same(layers, sample.beauty), "{layers:?} and {:?}", sample.beauty);
        let lobes: Rgb = sample.lobes.into_iter().sum();
        if sample.strand != NO_STRAND {
            hair += 1;
            assert!(same(lobes, sample.beauty), "{lobes:?} and {:?}", sample.beauty);
            assert!((sample.tangent.length() - 1.0).abs() < 1e-5 && sample.depth.is_finite());
        } else {
            assert!(lobes.is_black());
            if sample.alpha == 1.0 {
                floor += 1;
                // What absorbs light reflects it in the same colour, whatever the path.
                assert_eq!(sample.albedo, Rgb::new(0.6, 0.5, 0.4));
            } else {
                sky += 1;
                assert!(sample.beauty.is_black() && sample.depth == f32::INFINITY);
            }
        }
    }
    println!("{hair} samples of hair, {floor} of the floor, {sky} of the sky");
    assert!(hair > 1000 && floor > 1000 && sky > 500);
}

#[test]
fn one_event_is_the_direct_light() {
    let assets = mixed();
    let run = |set: &[&str]| samples(&tracer(&assets, MIXED, set), 16);
    let direct = run(&["render.integrator=direct"]);
    assert!(direct == run(&["render.max_depth=1"]), "a path of one event is direct light");
    let deep = run(&[]);
    for (direct, deep) in direct.iter().zip(&deep) {
        assert!(direct.indirect.is_black());
        assert_eq!(direct.beauty, deep.direct, "the random numbers are the same, so is the layer");
    }
    assert!(deep.iter().filter(|s| !s.indirect.is_black()).count() > 1000);
}

// --- closed forms ----------------------------------------------------------------------------------

const ALBEDO: [f64; 3] = [0.8, 0.5, 0.2];

/// A parallelogram under one light; its middle fills the picture.
fn lit_quad(light: &str) -> String {
    format!(
        "[camera]\nposition = [1.0, 3.0, 1.0]\ntarget = [0.0, 0.0, 0.0]\nfov_deg = 1.0\n\
         [film]\nwidth = 8\nheight = 8\n\
         [[mesh]]\nfile = \"quad\"\nalbedo = {ALBEDO:?}\n\
         [[light]]\n{light}\n"
    )
}

fn ground() -> Memory {
    let mut assets = Memory::default();
    assets.meshes.insert("quad", quad(Vec3::ZERO, Vec3::X * 2.0, Vec3::Z * 2.0));
    assets
}

/// The radiance of the quad under that irradiance.
fn radiance(irradiance: Rgb<f64>) -> Rgb<f64> {
    irradiance * Rgb(ALBEDO) * (1.0 / PI)
}

/// Holds the quad under a light that has a size against an irradiance, for all ways to find the light.
fn check_quad(assets: &Memory, what: &str, text: &str, irradiance: Rgb<f64>) {
    let want = radiance(irradiance);
    for set in [
        ["render.integrator=path", "render.heuristic=power"],
        ["render.integrator=path", "render.heuristic=balance"],
        ["render.integrator=bcsdf_only", "render.seed=1"],
        ["render.integrator=light_only", "render.seed=2"],
    ] {
        let all = samples(&tracer(assets, text, &set), 512);
        // The picture spans 0.06 of the quad; light over it changes by less than a thousandth on average.
        let slack = 1e-3 * want.max_channel();
        Mean::of(all.iter().map(|s| s.beauty)).expect(&format!("{what}, {set:?}"), &Mean::exact(want), slack);
    }
}

#[test]
fn pointlike_lights_follow_their_closed_forms() {
    let assets = ground();
    // Intensity 5, 4, 3 from (0.5, 2, -0.3): E = I cos θ / d².
    let d2 = 0.25 + 4.0 + 0.09_f64;
    let text = lit_quad("type = \"point\"\nposition = [0.5, 2.0, -0.3]\nintensity = [5.0, 4.0, 3.0]");
    let want = radiance(Rgb::<f64>([5.0, 4.0, 3.0]) * (2.0 / d2.powf(1.5)));
    for integrator in ["render.integrator=path", "render.integrator=light_only"] {
        let all = samples(&tracer(&assets, &text, &[integrator]), 64);
        let mean = Mean::of(all.iter().map(|s| s.beauty));
        mean.expect("a point", &Mean::exact(want), 1e-3 * want.max_channel());
    }
    // A single direction brings the same everywhere.
    let text = lit_quad("type = \"distant\"\ndirection = [-0.5, -2.0, 0.3]\nirradiance = [2.0, 3.0, 4.0]");
    let want = radiance(Rgb::<f64>([2.0, 3.0, 4.0]) * (2.0 / d2.sqrt())).cast::<f32>();
    for sample in samples(&tracer(&assets, &text, &[]), 4) {
        // f32: a dozen operations.
        assert!(same(sample.beauty, want), "{:?} and {want:?}", sample.beauty);
    }
    // From below the quad is in its own shadow.
    let text = lit_quad("type = \"distant\"\ndirection = [-0.5, 2.0, 0.3]\nirradiance = 2.0");
    assert!(samples(&tracer(&assets, &text, &[]), 4).iter().all(|s| s.beauty.is_black() && s.alpha == 1.0));
}

/// Share of its intensity that a spot sends `angle` from its axis, fading from `inner` to `outer`, degrees.
fn spot_share(angle: f64, inner: f64, outer: f64) -> f64 {
    let cos = |degrees: f64| degrees.to_radians().cos();
    let t = ((cos(angle) - cos(outer)) / (cos(inner) - cos(outer))).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[test]
fn a_spot_follows_its_closed_form_inside_in_its_fade_and_outside() {
    let assets = ground();
    let place = DVec3::new(0.5, 2.0, -0.3);
    // On the axis, in a wide fade, and outside.
    let cases = [([0.0, 0.0, 0.0], 40.0, 0.5), ([0.7, 0.0, 0.2], 90.0, 0.9), ([3.0, 0.0, 0.0], 90.0, 0.9)];
    for (aim, cone, blend) in cases {
        let angle = (-place).angle_between(DVec3::from_array(aim) - place).to_degrees();
        let share = spot_share(angle, 0.5 * cone * (1.0 - blend), 0.5 * cone);
        let text = lit_quad(&format!(
            "type = \"spot\"\nposition = [0.5, 2.0, -0.3]\naim = {aim:?}\nintensity = [5.0, 4.0, 3.0]\n\
             cone_deg = {cone:?}\nblend = {blend:?}"
        ));
        let want = radiance(Rgb::<f64>([5.0, 4.0, 3.0]) * (share * place.y / place.length().powi(3)));
        for selection in ["contribution", "power", "uniform"] {
            let selected = format!("render.light_selection={selection}");
            let all = samples(&tracer(&assets, &text, &[&selected]), 64);
            let mean = Mean::of(all.iter().map(|s| s.beauty));
            mean.expect(&format!("a spot at {aim:?}, {selection}"), &Mean::exact(want), 1e-3 * want.max_channel());
        }
        // It has no size: scattered rays never find it.
        let chance = samples(&tracer(&assets, &text, &["render.integrator=bcsdf_only"]), 4);
        assert!(chance.iter().all(|s| s.beauty.is_black() && s.alpha == 1.0));
    }
}

#[test]
fn a_spot_draws_a_disk_with_a_soft_edge_and_darkness_around_it() {
    // From 10 above, 4 x 4 of the ground fill the picture; the spot hangs 2 above its middle.
    let (side, height, intensity) = (32_u32, 2.0_f64, 5.0);
    let text = format!(
        "[camera]\nposition = [0.0, 10.0, 0.0]\ntarget = [0.0, 0.0, 0.0]\nup = [0.0, 0.0, -1.0]\nfov_deg = {:?}\n\
         [film]\nwidth = {side}\nheight = {side}\nfilter = \"box\"\n\
         [[mesh]]\nfile = \"quad\"\nalbedo = {ALBEDO:?}\n\
         [[light]]\ntype = \"spot\"\nposition = [0.0, {height:?}, 0.0]\ndirection = [0.0, -1.0, 0.0]\n\
         intensity = {intensity:?}\ncone_deg = 60.0\nblend = 0.4\n",
        2.0 * 0.2_f64.atan().to_degrees()
    );
    let film = render(&tracer(&ground(), &text, &[]), &[16]);
    assert!(film.rejected() == 0 && film.is_finite());
    let at = |r: f64| {
        let share = spot_share((r / height).atan().to_degrees(), 18.0, 30.0);
        radiance(Rgb::splat(intensity * share * height / (height * height + r * r).powf(1.5)))
    };
    let edge = height * 30_f64.to_radians().tan();
    let (mut bright, mut dark) = (0, 0);
    for (i, pixel) in film.pixels().iter().enumerate() {
        // What one pixel sees, nearest to and farthest from the middle: light falls from there to there.
        let span = [i as u32 % side, i as u32 / side].map(|k| {
            let [a, b] = [k, k + 1].map(|k| (4.0 * f64::from(k) / f64::from(side) - 2.0).abs());
            [a.min(b), a.max(b)]
        });
        let [near, far] = [0, 1].map(|end| span[0][end].hypot(span[1][end]));
        let got = pixel.beauty().cast::<f64>();
        let (least, most) = (at(far), at(near));
        // Single precision of places and of the camera's angle.
        let slack = 1e-5;
        let off = (least - got).max_channel().max((got - most).max_channel());
        assert!(off < slack, "pixel {i}: {got:?} is not in {least:?} to {most:?}");
        bright += u32::from(least.max_channel() > 0.0);
        if near > edge + 1e-4 {
            dark += 1;
            assert!(pixel.beauty().is_black(), "pixel {i}, {near} from the middle, shows {got:?}");
        }
    }
    // Of 1024 pixels of 1/8 each: a disk of radius 1.155 less its rim, and what is outside of it.
    assert!(bright > 200 && dark > 650, "{bright} {dark}");
}

#[test]
fn lights_with_a_size_follow_their_closed_forms() {
    let assets = ground();
    let white = |x: f64| Rgb::splat(x);
    let d2 = 0.25 + 4.0 + 0.09_f64;
    let cos = 2.0 / d2.sqrt();

    // All of the disk is above the horizon: its irradiance is that of a facing surface times the cosine.
    let disk = "type = \"distant\"\ndirection = [-0.5, -2.0, 0.3]\nirradiance = 3.0\nangle_deg = 40.0";
    check_quad(&assets, "a disk in the sky", &lit_quad(disk), white(3.0 * cos));

    // A sphere above the horizon: E = π L (r/d)² cos θ.
    let sphere = "type = \"sphere\"\ncenter = [0.5, 2.0, -0.3]\nradius = 0.8\nradiance = 3.0";
    check_quad(&assets, "a sphere", &lit_quad(sphere), white(PI * 3.0 * 0.64 / d2 * cos));

    // Inside a sphere of light all that is above the horizon shines.
    let inside = "type = \"sphere\"\ncenter = [0.5, 2.0, -0.3]\nradius = 9.0\nradiance = 3.0";
    check_quad(&assets, "within a sphere", &lit_quad(inside), white(PI * 3.0));

    // A rectangle by a midpoint rule over its area.
    for (sides, lit) in [("two_sided = false", true), ("two_sided = true", true), ("normal = [0.5, 2.0, -0.3]", false)]
    {
        let facing = if lit { "aim = [0.1, 0.0, 0.2]\n" } else { "" };
        let text = lit_quad(&format!(
            "type = \"rectangle\"\ncenter = [0.5, 2.0, -0.3]\nwidth = 2.0\nheight = 1.2\nradiance = 3.0\n{facing}{sides}"
        ));
        let scene = load(&assets, &text, &[]);
        let Light::Rectangle { center, edge_u, edge_v, normal, .. } = scene.lights[0] else { unreachable!() };
        let n = 200;
        let mut irradiance = 0.0;
        for i in 0..n * n {
            let (a, b) = (i % n, i / n);
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
            let p = center.as_dvec3() + edge_u.as_dvec3() * at(a) + edge_v.as_dvec3() * at(b);
            // From the origin, whose normal is +y.
            let (d2, area) = (p.length_squared(), 2.0 * 1.2 / f64::from(n * n));
            irradiance += 3.0 * (p.y * -p.dot(normal.as_dvec3())).max(0.0) / (d2 * d2) * area;
        }
        assert_eq!(irradiance > 0.0, lit);
        check_quad(&assets, &format!("a rectangle, {sides}"), &text, white(irradiance));
    }

    // A constant sky: only the half above the horizon counts.
    check_quad(&assets, "a constant sky", &lit_quad("type = \"environment\"\nradiance = 2.0"), white(2.0 * PI));
}

#[test]
fn a_small_sphere_far_away_is_not_forgotten() {
    // 12,500 radii away; no scattered ray finds it, so it must be sampled.
    let assets = ground();
    let text = lit_quad("type = \"sphere\"\ncenter = [3000.0, 12000.0, -1800.0]\nradius = 1.0\nradiance = 1e8");
    let d2 = 3000.0_f64.powi(2) + 12_000.0_f64.powi(2) + 1800.0_f64.powi(2);
    let want = radiance(Rgb::splat(PI * 1e8 / d2 * 12_000.0 / d2.sqrt()));
    for selection in ["contribution", "power", "uniform"] {
        let selected = format!("render.light_selection={selection}");
        let set = [selected.as_str(), "render.integrator=light_only"];
        let all = samples(&tracer(&assets, &text, &set), 16);
        let mean = Mean::of(all.iter().map(|s| s.beauty));
        mean.expect(selection, &Mean::exact(want), 1e-3 * want.max_channel());
    }
}

#[test]
fn an_environment_that_rises_evenly_gives_its_closed_form() {
    // L = 1 + a·ω makes E(n) = π + 2π/3 a·n on a surface with the normal n, whatever n.
    let a = Vec3::new(0.35, 0.2, 0.45);
    let normal = Vec3::new(0.4, 0.7, 0.5).normalize();
    let side = normal.cross(Vec3::Y).normalize() * 2.0;
    let mut assets = Memory::default();
    assets.meshes.insert("quad", quad(Vec3::ZERO, side, normal.cross(side)));
    let (width, height) = (128_u32, 64_u32);
    let pixels = (0..width * height)
        .map(|i| {
            let azimuth = 2.0 * PI as f32 * ((i % width) as f32 + 0.5) / width as f32;
            let (sin, cos) = (PI as f32 * ((i / width) as f32 + 0.5) / height as f32).sin_cos();
            // The left edge is -z, a quarter is +x.
            Rgb::splat(1.0 + a.dot(Vec3::new(sin * azimuth.sin(), cos, -sin * azimuth.cos())))
        })
        .collect();
    assets.environments.insert("even", EnvironmentImage { width, height, pixels });
    for degrees in [0.0_f32, 70.0] {
        let turned = Quat::from_rotation_y(degrees.to_radians()) * a;
        let irradiance = PI + 2.0 * PI / 3.0 * f64::from(turned.dot(normal));
        let text = lit_quad(&format!("type = \"environment\"\nfile = \"even\"\nrotation_deg = {degrees:.1}"))
            .replace("[1.0, 3.0, 1.0]", &format!("{:?}", (normal * 3.0).to_array()));
        check_quad(&assets, &format!("turned by {degrees}"), &text, Rgb::splat(irradiance));
    }
}

// --- settings --------------------------------------------------------------------------------------

#[test]
fn russian_roulette_changes_the_noise_alone() {
    let assets = dense_ball();
    let look = "model = \"deon\"\npreset = \"blonde\"\nlongitudinal_roughness_deg = 10.0\n";
    let light = "[[light]]\ntype = \"rectangle\"\ncenter = [3.0, 3.0, 3.0]\naim = [0.0, 0.0, 0.0]\nwidth = 2.0\n\
                 height = 2.0\nradiance = 5.0\n";
    let text = format!("{light}{FURNACE}{look}");
    let picture = |start| {
        let set = ["render.max_depth=60", "film.width=12", "film.height=12", start];
        Mean::of_picture(&assets, &text, &set, 64)
    };
    let without = picture("render.roulette_start=1000");
    picture("render.roulette_start=0").expect("roulette from the start", &without, 0.0);
    picture("render.roulette_start=4").expect("roulette from the fourth event", &without, 0.0);
}

#[test]
fn longer_paths_only_add_light_and_the_clamp_only_takes_it() {
    let assets = mixed();
    let run = |set: &[&str]| samples(&tracer(&assets, MIXED, set), 16);
    let runs = [run(&["render.max_depth=1"]), run(&["render.max_depth=2"]), run(&[])];
    let total = |run: &[Sample]| run.iter().map(|s| f64::from(s.beauty.luminance())).sum::<f64>();
    let within = |less: &[Sample], more: &[Sample]| {
        let pairs = less.iter().zip(more);
        pairs.flat_map(|(less, more)| less.beauty.0.into_iter().zip(more.beauty.0)).all(|(less, more)| less <= more)
    };
    for pair in runs.windows(2) {
        // The same random numbers: the longer path begins as the shorter one.
        assert!(within(&pair[0], &pair[1]));
        assert!(total(&pair[1]) > 1.02 * total(&pair[0]));
    }
    let clamped = run(&["render.clamp=0.2"]);
    assert!(within(&clamped, &runs[2]));
    assert!(total(&clamped) < 0.99 * total(&runs[2]));
    for (clamped, free) in clamped.iter().zip(&runs[2]) {
        assert_eq!(clamped.direct, free.direct, "direct light is not clamped");
    }
}

// --- odd scenes ------------------------------------------------------------------------------------

/// Renders a few samples; whatever is odd about the scene, no sample may be anything but a number.
fn survives(assets: &Memory, what: &str, text: &str) -> Film {
    let text = format!("[film]\nwidth = 8\nheight = 8\n{text}");
    let film = render(&tracer(assets, &text, &[]), &[8]);
    assert_eq!(film.rejected(), 0, "{what}");
    assert!(film.is_finite(), "{what}");
    for pixel in film.pixels() {
        assert!(pixel.beauty().0.iter().all(|&x| x >= 0.0), "{what}");
    }
    film
}

fn brightness(film: &Film) -> f32 {
    film.pixels().iter().map(|p| p.beauty().luminance()).sum()
}

fn coverage(film: &Film) -> f32 {
    film.pixels().iter().map(Pixel::alpha).sum()
}

const SKY: &str = "[[light]]\ntype = \"environment\"\nvisible = false\n";
const HAIR: &str = "[[groom]]\nfile = \"ball\"\n";
const BLONDE: &str = "[look.main]\npreset = \"blonde\"\n";

#[test]
fn odd_places_and_things_do_no_harm() {
    let mut assets = mixed();
    assets.grooms.insert("two", strands(&[vec![Vec3::ZERO, Vec3::Y]], 0.2));
    assets.grooms.insert("none", strands(&[vec![Vec3::ONE; 2], vec![Vec3::ZERO; 5]], 0.1));
    assets.environments.insert("texel", EnvironmentImage { width: 1, height: 1, pixels: vec![Rgb::splat(0.7)] });
    assets.environments.insert("black", EnvironmentImage { width: 4, height: 2, pixels: vec![Rgb::black(); 8] });

    let camera = "[camera]\nposition = [0.0, 0.0, 0.0]\ntarget = [0.0, 0.1, -1.0]\nfov_deg = 90.0\n";
    let inside = survives(&assets, "camera in the hair", &format!("{camera}{SKY}{HAIR}{BLONDE}"));
    assert!(coverage(&inside) > 5.0 && brightness(&inside) > 0.0);
    // The camera stands within the fiber itself.
    let text = format!("{camera}{SKY}[[groom]]\nfile = \"two\"\ntransform = {{ translate = [0.0, -0.5, 0.0] }}\n");
    survives(&assets, "camera in a fiber", &text);

    // A shell that the camera does not see keeps all light out, as one that it sees.
    let shell = "[[mesh]]\nshape = { sphere = { radius = 1.9 } }\nvisible = false\n";
    let open = survives(&assets, "no shell", &format!("{SKY}{HAIR}{BLONDE}"));
    let closed = survives(&assets, "a hidden shell", &format!("{SKY}{HAIR}{shell}{BLONDE}"));
    assert!(brightness(&open) > 0.0 && coverage(&closed) > 5.0);
    assert_eq!(brightness(&closed), 0.0, "no light comes through a shell");
    // Hidden from the camera alone: nothing is seen of it without hair.
    let alone = survives(&assets, "a hidden shell alone", &format!("{SKY}{shell}"));
    assert_eq!((brightness(&alone), coverage(&alone)), (0.0, 0.0));

    let lamps = "[[light]]\ntype = \"point\"\nposition = [0.0, 0.0, 0.0]\nintensity = 1.0\n\
                 [[light]]\ntype = \"spot\"\nposition = [0.0, 0.0, 0.0]\naim = [0.0, 1.0, 0.0]\nblend = 0.0\n\
                 [[light]]\ntype = \"sphere\"\ncenter = [0.1, 0.0, 0.2]\nradius = 0.3\nvisible = true\n\
                 [[light]]\ntype = \"rectangle\"\ncenter = [0.0, 0.2, 0.0]\nnormal = [0.0, 1.0, 0.0]\nwidth = 0.5\n\
                 height = 0.5\ntwo_sided = true\nvisible = true\n";
    assert!(brightness(&survives(&assets, "lamps in the hair", &format!("{lamps}{HAIR}{BLONDE}"))) > 0.0);

    let dark = "[[light]]\ntype = \"environment\"\nradiance = 0.0\n";
    let black = "[[light]]\ntype = \"environment\"\nfile = \"black\"\n";
    for sky in [dark, black] {
        for integrator in ["path", "direct", "bcsdf_only", "light_only"] {
            for selection in ["contribution", "power", "uniform"] {
                let text = format!(
                    "[render]\nintegrator = \"{integrator}\"\nlight_selection = \"{selection}\"\n{sky}{HAIR}{BLONDE}"
                );
                assert_eq!(brightness(&survives(&assets, "no light at all", &text)), 0.0);
            }
        }
    }
    let texel = "[[light]]\ntype = \"environment\"\nfile = \"texel\"\n";
    assert!(brightness(&survives(&assets, "a sky of one texel", &format!("{texel}{HAIR}{BLONDE}"))) > 0.0);

    for shape in ["round", "ribbon"] {
        for basis in ["linear", "catmull_rom"] {
            let render = format!("[render]\ncurve_shape = \"{shape}\"\ncurve_basis = \"{basis}\"\n");
            let two = survives(&assets, "two points", &format!("{render}{SKY}[[groom]]\nfile = \"two\"\n"));
            assert!(coverage(&two) > 5.0);
            survives(&assets, "no length", &format!("{render}{SKY}[[groom]]\nfile = \"none\"\n"));
            let tip = "width = { tip_scale = 0.0 }\n";
            survives(&assets, "pointed tips", &format!("{render}{SKY}{HAIR}{tip}{BLONDE}"));
        }
    }
    let mesh = "[[mesh]]\nshape = { sphere = { radius = 1.0 } }\n";
    assert!(brightness(&survives(&assets, "a mesh alone", &format!("{SKY}{mesh}"))) > 0.0);

    for (width, filter) in [(0.1, "box"), (16.0, "gaussian"), (3.0, "blackman_harris")] {
        let lens = "[camera]\nposition = [0.0, 0.0, 5.0]\naperture_radius = 0.5\nfocus_distance = 4.0\n";
        let text = format!("{SKY}{HAIR}{BLONDE}{lens}");
        let lensed = tracer(
            &assets,
            &text,
            &[
                "film.width=8",
                "film.height=8",
                &format!("film.filter={filter}"),
                &format!("film.filter_width_px={width}"),
                "render.roulette_start=0",
                "render.max_depth=1",
            ],
        );
        let film = render(&lensed, &[8]);
        assert!(film.rejected() == 0 && coverage(&film) > 5.0, "{filter}");
    }
}

#[test]
fn looks_that_vary_in_every_parameter_do_no_harm() {
    let mut assets = Memory::default();
    let mut groom = ball(200, 0.02, 4);
    let shades = (0..200).map(|i| f32::from(i as u8) / 100.0).collect();
    groom.attributes.insert("shade", Attribute::strand_floats(shades)).unwrap();
    let colours = (0..1200).map(|i| [0.1, 0.5, f32::from(i as u16) / 1200.0]).collect();
    groom.attributes.insert("colour", Attribute::point_vectors(colours)).unwrap();
    assets.grooms.insert("ball", groom);
    // Wide enough to leave every legal range now and then; the look has to clamp.
    let angle = "{ ramp = [[0.0, 0.02], [0.5, 5.0], [1.0, 90.0]], random = 5.0, noise = { amount = 9.0 } }";
    let tilt = "{ value = -3.0, random = 20.0, noise = { amount = 10.0, frequency = 30.0 } }";
    let ior = "{ value = 1.5, random = 1.0 }";
    let unit = "{ value = 0.5, random = 0.7, noise = { amount = 0.7 } }";
    let colour = "{ attribute = \"colour\", scale = 1.3, random = 0.2 }";
    let pigment = format!("eumelanin = {{ attribute = \"shade\", random = 1.0 }}\npheomelanin = {unit}\n");
    let mut looks = vec![
        format!(
            "model = \"chiang\"\n{pigment}longitudinal_roughness = {unit}\nazimuthal_roughness = {unit}\ntilt_deg = {tilt}\nior = {ior}"
        ),
        format!("model = \"chiang\"\ncolor = {colour}\nazimuthal_roughness = {unit}"),
        format!("model = \"chiang\"\nmelanin = {unit}\nredness = {unit}"),
        format!("model = \"lambertian\"\nalbedo = {colour}"),
        format!(
            "model = \"kajiya_kay\"\ndiffuse = {colour}\nspecular = {unit}\nexponent = {{ value = 20.0, random = 300.0 }}"
        ),
        format!("model = \"kajiya_kay\"\nmode = \"thesis\"\ndiffuse = {colour}\nspecular = {unit}"),
    ];
    let wide_angle = angle.replace("0.02", "0.1");
    for more in ["", "roots = \"cubic\"", "mode = \"as_printed\"\nglints = false"] {
        looks.push(format!(
            "model = \"marschner\"\n{more}\n{pigment}longitudinal_roughness_deg = {angle}\ntilt_deg = {tilt}\n\
             ior = {ior}\neccentricity = {{ value = 0.9, random = 0.1 }}\ndiffuse = {colour}\n\
             glint_strength = {{ value = 1.0, random = 5.0 }}\nglint_width_deg = {wide_angle}\n\
             glint_fade = {unit}\nglint_limit = {unit}"
        ));
    }
    let lobes: String = ["r", "tt", "trt"]
        .map(|lobe| {
            format!(
                "{lobe}_color = {colour}\n{lobe}_intensity = {{ value = 0.3, random = 1.0 }}\n\
                 {lobe}_shift_deg = {tilt}\n{lobe}_width_deg = {angle}\n"
            )
        })
        .concat();
    for mode in ["normalised", "legacy"] {
        looks.push(format!(
            "model = \"sadeghi\"\nmode = \"{mode}\"\n{lobes}tt_azimuthal_width_deg = {angle}\n\
             glint_intensity = {{ value = 1.0, random = 100.0 }}\nglint_width_deg = {wide_angle}\n\
             glint_angle_deg = {{ value = 37.0, random = 180.0 }}"
        ));
    }
    looks.push(format!(
        "model = \"fur\"\n{pigment}longitudinal_roughness_deg = {angle}\nazimuthal_roughness_deg = {angle}\n\
         tilt_deg = {tilt}\nior = {ior}\ncuticle_layers = {{ value = 2.0, random = 9.0 }}\n\
         medulla = {{ value = 0.5, random = 0.9 }}\nmedulla_scattering = {{ value = 3.0, random = 1000.0 }}\n\
         medulla_absorption = {colour}\nmedulla_anisotropy = {{ value = 0.2, random = 1.5 }}"
    ));
    looks.push(format!(
        "model = \"kajiya_kay\"\nspecular2 = {unit}\nexponent2 = {{ value = 20.0, random = 300.0 }}\n\
         shift_deg = {tilt}\nshift2_deg = {tilt}"
    ));
    looks.push(format!(
        "model = \"hery\"\ntint2 = {colour}\nroughness2_deg = {angle}\ntilt2_deg = {tilt}\ncos_theta_d = true"
    ));
    looks.push(format!(
        "model = \"chiang\"\nfield = \"auto\"\n{pigment}longitudinal_roughness = {unit}\n\
         azimuthal_roughness = {unit}\ntilt_deg = {tilt}\nior = {ior}"
    ));
    for mode in ["truncated", "faithful", "faithful_exact_pdf"] {
        looks.push(format!(
            "model = \"hery\"\nmode = \"{mode}\"\ntint = {colour}\nroughness_deg = {angle}\ntilt_deg = {tilt}"
        ));
    }
    for weights in ["joint", "marginal", "clamped"] {
        for more in ["", "field = \"far\"", "field = \"auto\"", "attenuation = \"known\"\nresidual = false"] {
            looks.push(format!(
                "model = \"deon\"\nweights = \"{weights}\"\n{more}\n{pigment}longitudinal_roughness_deg = {angle}\n\
                 azimuthal_roughness_deg = {angle}\ntilt_deg = {tilt}\nior = {ior}"
            ));
        }
    }
    let lamp = "[[light]]\ntype = \"sphere\"\ncenter = [2.0, 2.0, 2.0]\nradius = 0.5\nradiance = 9.0\n";
    for look in looks {
        let text = format!("[render]\nmax_depth = 4\n{SKY}{lamp}{HAIR}[look.main]\n{look}\n");
        assert!(brightness(&survives(&assets, &look, &text)) > 0.0, "{look}");
    }
}
