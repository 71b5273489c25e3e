use std::collections::BTreeSet;

use fiber::absorption::{MelaninConstants, from_color, from_cycles_melanin, from_melanin};
use fiber::multiple::albedo::AlbedoCurve;
use fiber::{
    ArtistLobe, Caustic, Fiber, Field, Fur, Glint, Hery, HeryLobe, HeryMode, Highlight, KajiyaKay, KajiyaKayMode,
    Marschner, MarschnerNorm, Medulla, Roots, Sadeghi, SadeghiMode,
};
use groom::{Attribute, Groom, Mesh};
use math::{Rgb, Vec3};

use super::*;

/// A few assets in memory.
struct Shelf;

/// Two straight strands of three points, 2 units long, with attributes; z is not up.
fn two_strands() -> Groom {
    let points = (0..6).map(|i| Vec3::new((i / 3) as f32, (i % 3) as f32, 0.0)).collect();
    let mut groom = Groom::new(points, [3, 3]).unwrap();
    let shade = Attribute::point_floats(vec![0.0, 0.5, 1.0, 0.2, 0.2, 0.2]);
    groom.attributes.insert("shade", shade).unwrap();
    let dye = Attribute::strand_vectors(vec![[0.1, 0.2, 0.3], [0.9, 0.8, 0.7]]);
    groom.attributes.insert("dye", dye).unwrap();
    groom
}

impl Assets for Shelf {
    fn groom(&self, path: &str) -> Result<Groom, AssetError> {
        let mut groom = two_strands();
        match path {
            "two.hair" => groom.set_radius(vec![0.004; 6]).map_err(AssetError::new)?,
            "thick.hair" => groom.set_radius(vec![4.0; 6]).map_err(AssetError::new)?,
            "bare.hair" => {}
            _ => return Err(AssetError::new("no such file")),
        }
        Ok(groom)
    }

    fn mesh(&self, path: &str) -> Result<Mesh, AssetError> {
        match path {
            "ball.obj" => Ok(Mesh::sphere(Vec3::ZERO, 1.0, 1)),
            "empty.obj" => Ok(Mesh { positions: vec![], triangles: vec![], normals: None }),
            _ => Err(AssetError::new("no such file")),
        }
    }

    fn environment(&self, path: &str) -> Result<EnvironmentImage, AssetError> {
        let mut pixels = vec![Rgb::splat(0.5); 8];
        match path {
            "sky.hdr" => {}
            "nan.hdr" => pixels[5] = Rgb::new(1.0, f32::NAN, 1.0),
            "negative.hdr" => {
                pixels[2] = Rgb::new(-0.1, 0.0, 0.0);
                pixels[7] = Rgb::splat(f32::INFINITY);
            }
            _ => return Err(AssetError::new("no such file")),
        }
        Ok(EnvironmentImage { width: 4, height: 2, pixels })
    }
}

fn load(text: &str) -> Scene {
    Scene::load(text, &[], &Shelf).unwrap_or_else(|error| panic!("{error}"))
}

fn fail(text: &str) -> SceneError {
    match Scene::load(text, &[], &Shelf) {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(error) => error,
    }
}

/// A scene of one groom whose look begins at line 5.
fn with_look(lines: &str) -> String {
    format!("[[groom]]\nfile = \"two.hair\"\n\n[look.main]\n{lines}\n")
}

/// A scene of one spot at the origin and a ball, lines about the spot from line 4 on.
fn with_spot(lines: &str) -> String {
    format!("[[light]]\ntype = \"spot\"\nposition = [0.0, 0.0, 0.0]\n{lines}\n\n[[mesh]]\nfile = \"ball.obj\"\n")
}

fn place(error: &SceneError) -> (usize, usize) {
    error.place.as_ref().map_or((0, 0), |place| (place.line, place.column))
}

const FULL: &str = r#"
[scene]
name = "full"
unit_m = 0.01

[camera]
position = [0.0, 10.0, 100.0]
target = [0.0, 10.0, 0.0]
fov_deg = 60.0
aperture_radius = 0.5
focus_distance = 90.0

[film]
width = 320
height = 200
filter = "gaussian"
exposure_ev = -1.0
view = "filmic"

[render]
samples = 4
integrator = "direct"
heuristic = "balance"
seed = 9
clamp = 5.0
curve_shape = "ribbon"
curve_basis = "linear"
light_selection = "uniform"

[[light]]
type = "environment"
file = "sky.hdr"
radiance = 2.0
strength = 3.0
rotation_deg = 180.0
visible = false

[[light]]
type = "rectangle"
center = [0.0, 0.0, 10.0]
aim = [0.0, 0.0, 0.0]
width = 4.0
height = 2.0

[[light]]
type = "sphere"
center = [1.0, 2.0, 3.0]
radius = 4.0
radiance = [1.0, 2.0, 3.0]

[[light]]
type = "point"
position = [1.0, 2.0, 3.0]
intensity = 7.0

[[light]]
type = "distant"
direction = [0.0, -2.0, 0.0]
irradiance = 3.0
angle_deg = 2.0

[[mesh]]
file = "ball.obj"
unit_m = 0.1
transform = { translate = [1.0, 0.0, 0.0] }
albedo = 0.25

[[groom]]
name = "wig"
file = "two.hair"
look = "main"
unit_m = 1.0
up = "z"
transform = { translate = [0.0, 0.0, 1.0], rotate_deg = [0.0, 90.0, 0.0], scale = 2.0 }
width = { diameter_um = 100.0, tip_scale = 0.5 }

[[groom]]
file = "two.hair"
look = "other"

[look.main]
model = "deon"
eumelanin = 1.3
field = "far"
weights = "marginal"
attenuation = "known"
residual = false

[look.other]
model = "chiang"
color = [0.6, 0.4, 0.2]
"#;

#[test]
fn a_full_scene_resolves_to_radians_scene_units_and_y_up() {
    let scene = load(FULL);
    assert_eq!(scene.name, "full");
    assert!((scene.camera.fov_y - std::f32::consts::FRAC_PI_3).abs() < 1e-6);
    assert_eq!((scene.camera.aperture_radius, scene.camera.focus_distance), (0.5, 90.0));
    assert_eq!((scene.film.filter, scene.film.filter_width), (Filter::Gaussian, 1.5));
    assert_eq!(scene.render.clamp, Some(5.0));
    assert_eq!(scene.render.integrator, Integrator::Direct);
    assert_eq!(scene.render.curve_shape, CurveShape::Ribbon);
    assert_eq!(scene.render.light_selection, LightSelection::Uniform);

    let [environment, rectangle, sphere, point, distant] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    let Light::Environment { image: Some(_), radiance, rotation, visible: false } = environment else {
        panic!("{environment:?}")
    };
    assert_eq!(*radiance, Rgb::splat(6.0));
    assert!((rotation - std::f32::consts::PI).abs() < 1e-6);
    let Light::Rectangle { edge_u, edge_v, normal, radiance, two_sided: false, visible: false, .. } = rectangle else {
        panic!("{rectangle:?}")
    };
    assert_eq!((*normal, *radiance), (Vec3::NEG_Z, Rgb::white()));
    assert!((edge_u.length() - 4.0).abs() < 1e-6 && (edge_v.length() - 2.0).abs() < 1e-6);
    assert!((edge_u.cross(*edge_v) - *normal * 8.0).length() < 1e-5);
    assert!(matches!(sphere, Light::Sphere { radius: 4.0, .. }));
    assert!(matches!(point, Light::Point { intensity, .. } if *intensity == Rgb::splat(7.0)));
    let Light::Distant { direction, half_angle, .. } = distant else { panic!("{distant:?}") };
    assert_eq!(*direction, Vec3::NEG_Y);
    assert!((half_angle - 1_f32.to_radians()).abs() < 1e-7);

    // A ball of 1 unit of 0.1 m is 10 cm in radius.
    let (least, most) = scene.meshes[0].mesh.bounds().unwrap();
    assert!((most.x - 11.0).abs() < 1e-4 && (least.x + 9.0).abs() < 1e-4);

    // The tip of strand 1 is at (1, 2, 0) m with z up: (1, 0, -2) with y up. Times 200, turned by 90 degrees
    // about y, which takes x to -z and z to x: (-400, 0, -200); then moved by 1 along z.
    let wig = &scene.grooms[0];
    assert_eq!((wig.name.as_str(), scene.looks[wig.look].name()), ("wig", "main"));
    let tip = wig.groom.points()[5];
    assert!((tip - Vec3::new(-400.0, 0.0, -199.0)).length() < 1e-3, "{tip}");
    // 100 micrometres are a radius of 0.005 cm, half of it at the tip.
    let radius = wig.groom.radius.as_ref().unwrap();
    for (point, expected) in [(0, 0.005_f32), (4, 0.00375), (5, 0.0025)] {
        assert!((radius[point] - expected).abs() < 1e-7, "{point}");
    }
    assert_eq!(scene.grooms[1].groom.radius.as_ref().unwrap()[0], 0.004);
    assert_ne!(scene.grooms[0].seed, scene.grooms[1].seed);
    let Fiber::Deon(deon) = scene.looks[wig.look].constant().unwrap() else { panic!() };
    assert_eq!((deon.field, deon.weights), (fiber::Field::Far, fiber::Weights::Marginal));
    assert_eq!((deon.attenuation, deon.residual), (fiber::Attenuation::Known, false));
    assert_eq!(scene.warnings, Vec::<String>::new());
}

#[test]
fn what_is_left_out_gets_its_documented_default() {
    let scene = load("[[groom]]\nfile = \"two.hair\"\n");
    assert_eq!((scene.film.width, scene.film.height), (768, 960));
    assert_eq!((scene.render.samples, scene.render.max_depth), (64, 96));
    assert_eq!(scene.render.clamp, None);
    // No light: a white environment, and a warning.
    let Light::Environment { image: None, radiance, visible: true, .. } = &scene.lights[0] else {
        panic!("{:?}", scene.lights)
    };
    assert_eq!(*radiance, Rgb::white());
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].contains("[[light]]"));
    // No look: brown.
    let Some(Fiber::Deon(deon)) = scene.looks[0].constant() else { panic!() };
    assert_eq!(deon.sigma_a, from_melanin(1.3, 0.2, MelaninConstants::Pbrt));
    assert!((deon.beta_m - 7.5_f32.to_radians()).abs() < 1e-7 && deon.beta_n == deon.beta_m);
    assert!((deon.alpha + 3_f32.to_radians()).abs() < 1e-7 && deon.eta == 1.55);
    assert!(deon.residual && deon.field == fiber::Field::Near && deon.weights == fiber::Weights::Marginal);
    // The camera sees the strands, which span (0..1, 0..2, 0).
    // It looks at the middle of what is seen, which perspective moves a little.
    assert!(scene.camera.target.distance(Vec3::new(0.5, 1.0, 0.0)) < 0.05, "{}", scene.camera.target);
    assert!(scene.camera.position.distance(scene.camera.target) > 1.0);
}

/// Direction, intensity, and the angles from the axis where the fade begins and ends, degrees.
fn spot(scene: &Scene) -> (Vec3, Rgb, [f64; 2]) {
    let Light::Spot { position, direction, intensity, cos_inner, cos_outer } = scene.lights[0] else {
        panic!("{:?}", scene.lights)
    };
    assert_eq!(position, Vec3::ZERO);
    assert!((direction.length() - 1.0).abs() < 1e-6);
    assert!((0.0..1.0).contains(&cos_outer) && cos_inner <= 1.0 && cos_inner - cos_outer >= 9e-7);
    (direction, intensity, [cos_inner, cos_outer].map(|cos| f64::from(cos).acos().to_degrees()))
}

#[test]
fn a_spot_resolves_to_its_direction_and_the_cosines_of_its_fade() {
    // The whole opening angle is halved; blend is a share of the half. A cosine in f32 knows angles of 10 degrees
    // and more to 2e-5 degrees.
    let scene = load(&with_spot("aim = [0, -3, 0]\nintensity = [1, 2, 3]\nstrength = 2\ncone_deg = 60\nblend = 0.5"));
    let (direction, intensity, [inner, outer]) = spot(&scene);
    assert_eq!((direction, intensity), (Vec3::NEG_Y, Rgb::new(2.0, 4.0, 6.0)));
    assert!((inner - 15.0).abs() < 2e-5 && (outer - 30.0).abs() < 2e-5, "{inner} {outer}");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    // A direction may have any length. What is left out: 45 degrees, of whose half 15 % fade.
    let (direction, intensity, [inner, outer]) = spot(&load(&with_spot("direction = [0, 0, 7]")));
    assert_eq!((direction, intensity), (Vec3::Z, Rgb::white()));
    assert!((inner - 0.85 * 22.5).abs() < 2e-5 && (outer - 22.5).abs() < 2e-5, "{inner} {outer}");
    // The ends of the ranges: a half space that fades from the axis on, and a narrow cone with a sharp edge.
    let (_, _, [inner, outer]) = spot(&load(&with_spot("direction = [0, 0, 7]\ncone_deg = 180\nblend = 1")));
    assert!(inner == 0.0 && (outer - 90.0).abs() < 1e-5, "{inner} {outer}");
    let (_, _, [inner, outer]) = spot(&load(&with_spot("direction = [0, 0, 7]\ncone_deg = 1\nblend = 0")));
    assert!((outer - 0.5).abs() < 1e-3 && (0.48..0.5).contains(&inner), "{inner} {outer}");
    // It has no size: what finds lights by chance never finds it.
    let scene = load(&with_spot("aim = [0, -3, 0]\n[render]\nintegrator = \"bcsdf_only\""));
    assert!(scene.warnings.len() == 1 && scene.warnings[0].contains("light 0 has no size"), "{:?}", scene.warnings);
}

#[test]
fn a_spot_fades_evenly_from_one_to_nothing() {
    let fall = |cos: f32| Light::spot_falloff(0.9, 0.5, cos);
    assert_eq!([1.0, 0.95, 0.9, 0.5, 0.49, 0.0, -1.0].map(fall), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    // The cubic is the distribution function of 6t(1 - t): its integral, summed up, is the fade.
    let n = 4000;
    let mut sum = 0.0_f64;
    for i in 0..n {
        let t = (f64::from(i) + 0.5) / f64::from(n);
        let cos = 0.5 + 0.4 * (f64::from(i) + 1.0) / f64::from(n);
        sum += 6.0 * t * (1.0 - t) / f64::from(n);
        assert!((f64::from(fall(cos as f32)) - sum).abs() < 1e-6, "{cos}");
    }
}

#[test]
fn odd_widths_are_warned_about() {
    let text = "[[light]]\ntype = \"environment\"\n[[groom]]\nfile = \"FILE\"\n";
    let bare = load(&text.replace("FILE", "bare.hair"));
    assert!(bare.warnings.len() == 1 && bare.warnings[0].contains("80 micrometres"));
    // 80 micrometres are a radius of 0.004 cm.
    assert!((bare.grooms[0].groom.radius.as_ref().unwrap()[3] - 0.004).abs() < 1e-8);
    let thick = load(&text.replace("FILE", "thick.hair"));
    assert!(thick.warnings.len() == 1 && thick.warnings[0].contains("80000"), "{:?}", thick.warnings);
    assert!(load(&text.replace("FILE", "two.hair")).warnings.is_empty());
}

#[test]
fn mistakes_are_placed_and_mended() {
    use SceneErrorKind as K;
    // Text, kind, line and column, a part of the message, suggestion.
    let cases = [
        (with_look("melanine = 0.4"), K::UnknownName, (5, 1), "look.main.melanine", Some("melanin")),
        (with_look("ior = { vlaue = 1.5 }"), K::UnknownName, (5, 9), "look.main.ior.vlaue", Some("value")),
        ("[fillm]\nwidth = 3\n".into(), K::UnknownName, (1, 2), "fillm", Some("film")),
        ("[film]\nview = \"agz\"\n".into(), K::UnknownName, (2, 8), "`srgb`", Some("agx")),
        ("[film]\nwidth = \"wide\"\n".into(), K::WrongType, (2, 9), "film.width", None),
        (with_look("ior = \"glass\""), K::WrongType, (5, 7), "look.main.ior", None),
        (with_look("ior = [1.5, 1.5, 1.5]"), K::WrongType, (5, 7), "one number", None),
        (with_look("color = [1.0, 0.5]"), K::WrongType, (5, 9), "3 numbers", None),
        ("[[light]]\nradiance = 1.0\n".into(), K::Missing, (1, 1), "`type`", None),
        ("[[light]]\ntype = \"sphere\"\nradius = 1.0\n".into(), K::Missing, (1, 1), "`center`", None),
        ("\n[film]\nwidth = 0\n".into(), K::OutOfRange, (3, 9), "between 1 and 16384", None),
        (
            "[camera]\nfov_deg = nan\n[[mesh]]\nfile = \"ball.obj\"".into(),
            K::OutOfRange,
            (2, 11),
            "camera.fov_deg",
            None,
        ),
        (with_look("ior = 0.5"), K::OutOfRange, (5, 7), "`look.main.ior` is 0.5; it must be between 1.01 and 3", None),
        (with_look("ior = { value = 9 }"), K::OutOfRange, (5, 17), "look.main.ior.value", None),
        (with_look("ior = { ramp = [[0.0, 1.5], [1.0, 7.0]] }"), K::OutOfRange, (5, 29), "look.main.ior.ramp.1", None),
        (with_look("ior = { ramp = [[0.9, 1.5], [0.1, 1.5]] }"), K::OutOfRange, (5, 29), "rise", None),
        (with_look("ior = { ramp = [] }"), K::Missing, (5, 16), "empty", None),
        (with_look("tilt_deg = { random = -1.0 }"), K::OutOfRange, (5, 23), "tilt_deg.random", None),
        (with_look("ior = { value = 1.5, ramp = [[0, 1.5]] }"), K::Conflict, (5, 22), "value", None),
        (with_look("model = \"lambertian\"\nior = 1.5"), K::Conflict, (6, 1), "`albedo`", None),
        (with_look("roughness_deg = 5.0"), K::Conflict, (5, 1), "deon", Some("longitudinal_roughness_deg")),
        (with_look("eumelanin = 1.0\ncolor = 0.5"), K::Conflict, (6, 1), "eumelanin", None),
        (with_look("color = 0.5\nmelanin_constants = \"pbrt\""), K::Conflict, (6, 1), "melanin", None),
        (with_look("model = \"hery\"\nmode = \"thesis\""), K::Conflict, (6, 8), "truncated", None),
        (with_look("model = \"hery\"\npreset = \"brown\""), K::Conflict, (6, 1), "hery", None),
        ("[[light]]\ntype = \"sphere\"\nwidth = 3.0\n".into(), K::Conflict, (3, 1), "`sphere`", None),
        ("[[light]]\ntype = \"point\"\nradiance = 3.0\n".into(), K::Conflict, (3, 1), "`point`", Some("intensity")),
        ("[[light]]\ntype = \"distant\"\ndirection = [0, 0, 0]\n".into(), K::OutOfRange, (3, 13), "no length", None),
        ("[[light]]\ntype = \"spot\"\naim = [0, 0, 0]\n".into(), K::Missing, (1, 1), "`position`", None),
        ("[[light]]\ntype = \"spot\"\nposition = [0, 0, 0]\n".into(), K::Missing, (1, 1), "`aim`", None),
        (
            "[[light]]\ntype = \"spot\"\nposition = [1, 1, 1]\naim = [1, 1, 1]\n".into(),
            K::OutOfRange,
            (4, 7),
            "`light.0.aim` is the position of the light",
            None,
        ),
        (
            "[[light]]\ntype = \"spot\"\nposition = [1, 1, 1]\naim = [0, 1, 1]\ndirection = [1, 0, 0]\n".into(),
            K::Conflict,
            (5, 1),
            "`light.0.direction` stands beside `aim`",
            None,
        ),
        (with_spot("direction = [0, 0, 0]"), K::OutOfRange, (4, 13), "no length", None),
        (with_spot("aim = [0, 1, nan]"), K::OutOfRange, (4, 7), "light.0.aim", None),
        (
            with_spot("aim = [0, 1, 0]\ncone_deg = 0.5"),
            K::OutOfRange,
            (5, 12),
            "`light.0.cone_deg` is 0.5; it must be between 1 and 180",
            None,
        ),
        (with_spot("aim = [0, 1, 0]\ncone_deg = 181"), K::OutOfRange, (5, 12), "light.0.cone_deg", None),
        (
            with_spot("aim = [0, 1, 0]\nblend = 1.5"),
            K::OutOfRange,
            (5, 9),
            "`light.0.blend` is 1.5; it must be between 0 and 1",
            None,
        ),
        (with_spot("aim = [0, 1, 0]\nblend = -0.1"), K::OutOfRange, (5, 9), "light.0.blend", None),
        (with_spot("aim = [0, 1, 0]\nintensity = -1.0"), K::OutOfRange, (5, 13), "light.0.intensity", None),
        (with_spot("aim = [0, 1, 0]\nradiance = 3.0"), K::Conflict, (5, 1), "`spot`", Some("intensity")),
        (with_spot("cone = 40.0"), K::UnknownName, (4, 1), "light.0.cone", Some("cone_deg")),
        ("[[light]]\ntype = \"point\"\nblend = 0.5\n".into(), K::Conflict, (3, 1), "`point` has no `blend`", None),
        ("[[light]]\ntype = \"spott\"\n".into(), K::UnknownName, (2, 8), "`spot`", Some("spot")),
        (
            "[[light]]\ntype = \"rectangle\"\ncenter = [1, 1, 1]\naim = [1, 1, 1]\nwidth = 1\nheight = 1\n".into(),
            K::OutOfRange,
            (4, 7),
            "centre",
            None,
        ),
        (
            "[camera]\nposition = [1, 1, 1]\ntarget = [1, 1, 1]\n[[mesh]]\nfile = \"ball.obj\"\n".into(),
            K::Conflict,
            (3, 1),
            "nowhere",
            None,
        ),
        (
            "[camera]\nposition = [0, 9, 0]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\n[[mesh]]\nfile = \"ball.obj\"\n"
                .into(),
            K::Conflict,
            (4, 1),
            "camera.up",
            None,
        ),
        (
            "[[groom]]\nfile = \"two.hair\"\nlook = \"mian\"\n[look.main]\n".into(),
            K::UnknownName,
            (3, 8),
            "mian",
            Some("main"),
        ),
        ("[[groom]]\nfile = \"two.hair\"\n[look.a]\n[look.b]\n".into(), K::Missing, (1, 1), "groom.0.look", None),
        ("[[groom]]\nfile = \"gone.hair\"\n".into(), K::Asset, (2, 8), "no such file", None),
        ("[[groom]]\nname = \"x\"\n".into(), K::Missing, (1, 1), "procedural", None),
        (
            "[[groom]]\nfile = \"two.hair\"\nwidth = { scale = -2.0 }\n".into(),
            K::OutOfRange,
            (3, 19),
            "groom.0.width.scale",
            None,
        ),
        ("[[mesh]]\nfile = \"empty.obj\"\n".into(), K::Asset, (2, 8), "no triangles", None),
        ("[[mesh]]\nfile = \"ball.obj\"\nalbedo = 1.5\n".into(), K::OutOfRange, (3, 10), "mesh.0.albedo", None),
        (
            "[[mesh]]\nfile = \"ball.obj\"\ntransform = { scale = 1e9, translate = [1e9, 0, 0] }\n".into(),
            K::OutOfRange,
            (1, 1),
            "farther",
            None,
        ),
        ("[film]\nwidth = 3\n".into(), K::Missing, (0, 0), "nothing to see", None),
    ];
    for (text, kind, at, part, suggestion) in cases {
        let error = fail(&text);
        let said = format!("{error}\nin:\n{text}");
        assert_eq!(error.kind, kind, "{said}");
        assert_eq!(place(&error), at, "{said}");
        assert!(error.message.contains(part), "`{part}` is missing from: {said}");
        assert_eq!(error.suggestion.as_deref(), suggestion, "{said}");
    }
}

#[test]
fn text_that_is_not_toml_is_refused_at_its_line() {
    for text in ["a = 1\n[film]\nwidth = 64 64\n", "[scene]\n\n[film\n", "x = 1\ny = 2\nx = 3\n"] {
        let error = fail(text);
        assert_eq!(error.kind, SceneErrorKind::Syntax, "{error}");
        assert_eq!(place(&error).0, 3, "{error}");
    }
    // However broken, it is an error and no panic.
    for text in ["[", "\u{0}", "= = =", "[[[", "a.b.c", "\"", "[look.\"x", "x = \"\"\"", "ß = {"] {
        fail(text);
    }
}

#[test]
fn broken_environments_are_refused_with_count_and_place() {
    let text = "[[light]]\ntype = \"environment\"\nfile = \"FILE\"\n[[mesh]]\nfile = \"ball.obj\"\n";
    let error = fail(&text.replace("FILE", "nan.hdr"));
    assert_eq!((error.kind, place(&error)), (SceneErrorKind::Asset, (3, 8)));
    assert!(error.message.contains("1 texels") && error.message.contains("column 1, row 1"), "{error}");
    let error = fail(&text.replace("FILE", "negative.hdr"));
    assert!(error.message.contains("2 texels") && error.message.contains("column 2, row 0"), "{error}");
    let lying = EnvironmentImage { width: 4, height: 4, pixels: vec![Rgb::white(); 8] };
    assert!(lying.check().is_err());
}

fn overridden(text: &str, overrides: &[&str]) -> Result<Scene, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
    Scene::load(text, &overrides, &Shelf)
}

#[test]
fn overrides_replace_any_value() {
    let scene = overridden(
        FULL,
        &[
            "film.width=99",
            "light[2].radius = 8.0",
            "light.0.radiance=[1, 2, 3]",
            "groom.0.look=other",
            "groom.wig.width.diameter_um=50",
            "look.main.eumelanin=0.3",
            "look.main.ior.random=0.1",
            "camera.position=[0, 0, 50]",
            "render.heuristic=power",
            "scene.name=\"a = b\"",
        ],
    );
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.film.width, scene.name.as_str()), (99, "a = b"));
    assert!(matches!(scene.lights[2], Light::Sphere { radius: 8.0, .. }));
    assert!(matches!(&scene.lights[0], Light::Environment { radiance, .. } if *radiance == Rgb::new(3.0, 6.0, 9.0)));
    assert_eq!(scene.looks[scene.grooms[0].look].name(), "other");
    assert!((scene.grooms[0].groom.radius.as_ref().unwrap()[0] - 0.0025).abs() < 1e-8);
    assert_eq!(scene.camera.position, Vec3::new(0.0, 0.0, 50.0));
    assert_eq!(scene.render.heuristic, Heuristic::Power);
    let main = scene.looks.iter().find(|look| look.name() == "main").unwrap();
    // `ior` was not in the file; now it varies around its default.
    assert!(main.constant().is_none());
    let Fiber::Deon(deon) = main.base() else { panic!() };
    assert_eq!((deon.eta, deon.sigma_a), (1.55, from_melanin(0.3, 0.0, MelaninConstants::Pbrt)));
}

#[test]
fn a_plain_number_becomes_a_table_when_an_override_goes_inside() {
    let scene = overridden(&with_look("ior = 1.4"), &["look.main.ior.random=0.05"]).unwrap();
    let Fiber::Deon(deon) = scene.looks[0].base() else { panic!() };
    assert_eq!(deon.eta, 1.4);
    assert!(scene.looks[0].constant().is_none());
}

#[test]
fn mistakes_in_overrides_name_the_override() {
    use SceneErrorKind as K;
    // Override, kind, column, suggestion.
    let cases = [
        ("film.widht=3", K::UnknownName, 6, Some("width")),
        ("flim.width=3", K::UnknownName, 1, Some("film")),
        ("look.mian.ior=1.5", K::UnknownName, 6, Some("main")),
        ("look.main.ior=0.5", K::OutOfRange, 15, None),
        ("look.main.ior = 0.5", K::OutOfRange, 17, None),
        ("look.main.model=deom", K::UnknownName, 17, Some("deon")),
        ("film.width=wide", K::WrongType, 12, None),
        ("light[7].radius=1", K::Override, 7, None),
        ("groom.wgi.look=main", K::Override, 7, Some("wig")),
        ("film.width.x=1", K::Override, 12, None),
        ("nonsense", K::Override, 1, None),
        ("=3", K::Override, 1, None),
        ("film.width=", K::Override, 1, None),
    ];
    for (line, kind, column, suggestion) in cases {
        let error = overridden(FULL, &["render.seed=3", line]).unwrap_err();
        assert_eq!(error.kind, kind, "{line}: {error}");
        let place = error.place.clone().unwrap();
        assert!(place.from_override && place.excerpt == line, "{line}: {error}");
        assert_eq!(place.column, column, "{line}: {error}");
        assert_eq!(error.suggestion.as_deref(), suggestion, "{line}: {error}");
        assert!(error.to_string().starts_with(&format!("in `--set {line}`: ")), "{error}");
    }
    let error = overridden(FULL, &["film.width=[1, "]).unwrap_err();
    assert_eq!(error.kind, SceneErrorKind::Syntax, "{error}");
    assert!(error.place.unwrap().from_override);
    // A mistake in the file is still one of the file.
    let error = overridden("[film]\nwidth = 0\n", &["film.height=3"]).unwrap_err();
    assert_eq!((place(&error), error.place.as_ref().unwrap().from_override), ((2, 9), false));
    // An array of a file without any.
    let error = overridden("[film]\n", &["light.0.radiance=1"]).unwrap_err();
    assert!(error.message.contains("no `light`"), "{error}");
}

/// The albedo of a Lambertian look at a place on the strands of `two.hair`.
fn albedo(scene: &Scene, strand: u32, u: f32) -> Rgb {
    let groom = &scene.grooms[0];
    let along = 2.0 * u;
    let index = (along as usize).min(1);
    let point = StrandPoint {
        strand,
        u,
        point_index: (strand as usize % 2) * 3 + index,
        frac: along - index as f32,
        attributes: &groom.groom.attributes,
        seed: groom.seed,
    };
    match scene.looks[0].fiber(&point) {
        Fiber::Lambertian(fiber) => fiber.albedo,
        other => panic!("{other:?}"),
    }
}

fn lambertian(albedo: &str) -> Scene {
    load(&with_look(&format!("model = \"lambertian\"\nalbedo = {albedo}")))
}

#[track_caller]
fn near(found: Rgb, expected: [f32; 3]) {
    let off = (found - Rgb(expected)).map(f32::abs).max_channel();
    assert!(off < 1e-6, "{found:?} is not {expected:?}");
}

#[test]
fn ramps_run_straight_from_root_to_tip() {
    let scene = lambertian("{ ramp = [[0.0, 0.2], [0.5, 0.4], [1.0, [0.4, 0.6, 0.8]]] }");
    assert!(scene.looks[0].constant().is_none());
    near(albedo(&scene, 0, 0.0), [0.2; 3]);
    near(albedo(&scene, 1, 0.25), [0.3; 3]);
    near(albedo(&scene, 0, 0.5), [0.4; 3]);
    near(albedo(&scene, 0, 0.75), [0.4, 0.5, 0.6]);
    near(albedo(&scene, 0, 1.0), [0.4, 0.6, 0.8]);
    // Level before the first point and after the last; a step where two share a place.
    let step = lambertian("{ ramp = [[0.25, 0.1], [0.5, 0.1], [0.5, 0.9], [0.75, 0.9]] }");
    near(albedo(&step, 0, 0.0), [0.1; 3]);
    near(albedo(&step, 0, 0.499), [0.1; 3]);
    near(albedo(&step, 0, 0.501), [0.9; 3]);
    near(albedo(&step, 0, 1.0), [0.9; 3]);
}

#[test]
fn random_offsets_are_fixed_per_strand_and_fill_their_range() {
    let scene = lambertian("{ value = 0.5, random = 0.2 }");
    let values: Vec<f32> = (0..1000).map(|strand| albedo(&scene, strand, 0.3)[0]).collect();
    assert!(values.iter().all(|x| (0.3..=0.7).contains(x)));
    // Uniform on ±0.2: standard deviation 0.1155. Four standard errors of a mean of 1000, one seed.
    let mean = values.iter().sum::<f32>() / 1000.0;
    assert!((mean - 0.5).abs() < 4.0 * 0.1155 / 1000_f32.sqrt(), "{mean}");
    let spread = values.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / 1000.0;
    assert!((spread.sqrt() - 0.1155).abs() < 0.01, "{spread}");
    assert_eq!(albedo(&scene, 17, 0.0), albedo(&scene, 17, 1.0));
    // Another seed, other strands.
    let other = lambertian("{ value = 0.5, random = 0.2, seed = 5 }");
    assert_ne!(albedo(&other, 17, 0.0), albedo(&scene, 17, 0.0));
}

#[test]
fn noise_is_smooth_along_a_strand_and_differs_between_strands() {
    let scene = lambertian("{ value = 0.5, noise = { amount = 0.3, frequency = 5.0 } }");
    let along: Vec<f32> = (0..=1000).map(|i| albedo(&scene, 3, i as f32 / 1000.0)[0]).collect();
    assert!(along.iter().all(|x| (0.2..=0.8).contains(x)));
    // Gradient noise changes by less than 6 per feature: 0.3 · 6 · 5 / 1000 per step.
    assert!(along.windows(2).all(|w| (w[1] - w[0]).abs() < 0.009));
    let (least, most) = along.iter().fold((1.0_f32, 0.0_f32), |(a, b), &x| (a.min(x), b.max(x)));
    assert!(most - least > 0.02, "the noise is flat: {least} to {most}");
    let apart = (0..100).any(|i| {
        let u = i as f32 / 100.0;
        (albedo(&scene, 4, u)[0] - albedo(&scene, 3, u)[0]).abs() > 0.02
    });
    assert!(apart);
}

#[test]
fn attributes_drive_parameters_and_fall_back() {
    let points = lambertian("{ attribute = \"shade\", scale = 0.5 }");
    near(albedo(&points, 0, 0.25), [0.125; 3]);
    near(albedo(&points, 1, 0.9), [0.1; 3]);
    let strands = lambertian("{ attribute = \"dye\" }");
    near(albedo(&strands, 0, 0.5), [0.1, 0.2, 0.3]);
    near(albedo(&strands, 1, 0.5), [0.9, 0.8, 0.7]);
    assert_eq!(strands.looks[0].attributes(), ["dye".to_owned()]);
    // The groom lacks it: the ramp counts, and a warning says so.
    let absent = lambertian("{ attribute = \"tint\", ramp = [[0.0, 0.0], [1.0, 1.0]] }");
    near(albedo(&absent, 0, 0.25), [0.25; 3]);
    assert!(absent.warnings.iter().any(|w| w.contains("`tint`") && w.contains("`dye`")));
}

#[test]
fn whatever_varies_stays_in_its_legal_range() {
    let scene = lambertian("{ value = 0.9, random = 0.8, noise = { amount = 0.9 } }");
    let mut clamped = 0;
    for strand in 0..200 {
        for i in 0..=10 {
            let x = albedo(&scene, strand, i as f32 / 10.0)[0];
            assert!((0.0..=1.0).contains(&x));
            clamped += usize::from(x == 1.0);
        }
    }
    assert!(clamped > 0);
    let steep = lambertian("{ attribute = \"shade\", scale = 1e6 }");
    near(albedo(&steep, 0, 1.0), [1.0; 3]);
}

#[test]
fn parameters_vary_apart_unless_they_share_a_seed() {
    let pair = |seed: &str| {
        let look = format!(
            "eumelanin = {{ value = 1.0, random = 0.5{seed} }}\npheomelanin = {{ value = 1.0, random = 0.5{seed} }}"
        );
        let scene = load(&with_look(&look));
        let groom = scene.grooms[0].groom.clone();
        (0..50).all(|strand| {
            let at = StrandPoint { strand, u: 0.0, point_index: 0, frac: 0.0, attributes: &groom.attributes, seed: 0 };
            let Fiber::Deon(deon) = scene.looks[0].fiber(&at) else { panic!() };
            // With equal concentrations c the absorption is c times that of (1, 1).
            let one = from_melanin(1.0_f32, 1.0, MelaninConstants::Pbrt);
            let ratio = deon.sigma_a / one;
            (ratio[0] - ratio[2]).abs() < 1e-5
        })
    };
    assert!(pair(", seed = 4"));
    assert!(!pair(""));
}

#[test]
fn colour_forms_agree_with_the_fiber_crate() {
    let sigma_a = |look: &str| match load(&with_look(look)).looks[0].constant() {
        Some(Fiber::Deon(deon)) => deon.sigma_a,
        Some(Fiber::Chiang(chiang)) => chiang.sigma_a,
        other => panic!("{other:?}"),
    };
    let (pbrt, cycles) = (MelaninConstants::Pbrt, MelaninConstants::Cycles);
    assert_eq!(sigma_a("eumelanin = 0.7"), from_melanin(0.7, 0.0, pbrt));
    assert_eq!(sigma_a("pheomelanin = 0.7"), from_melanin(0.0, 0.7, pbrt));
    assert_eq!(sigma_a("eumelanin = 0.7\nmelanin_constants = \"cycles\""), from_melanin(0.7, 0.0, cycles));
    assert_eq!(sigma_a("melanin = 0.6\nredness = 0.25"), from_cycles_melanin(0.6, 0.25));
    assert_ne!(
        sigma_a("melanin = 0.6\nmelanin_constants = \"pbrt\""),
        sigma_a("melanin = 0.6\nmelanin_constants = \"cycles\"")
    );
    assert_eq!(sigma_a("absorption = [0.1, 0.2, 0.3]"), Rgb::new(0.1, 0.2, 0.3));
    assert_eq!(
        sigma_a("model = \"chiang\"\ncolor = [0.6, 0.4, 0.2]\nazimuthal_roughness = 0.7"),
        from_color(Rgb::new(0.6, 0.4, 0.2), 0.7)
    );
}

#[test]
fn every_preset_resolves_and_darker_names_absorb_more() {
    let absorbed = |preset: &str| {
        let scene = load(&with_look(&format!("preset = \"{preset}\"")));
        let Fiber::Deon(deon) = scene.looks[0].base() else { panic!() };
        deon.sigma_a.luminance()
    };
    let from_light_to_dark = ["white", "platinum", "blonde", "light_brown", "brown", "dark_brown", "black"];
    let values = from_light_to_dark.map(absorbed);
    assert!(values.windows(2).all(|w| w[0] < w[1]), "{values:?}");
    for preset in ["auburn", "red", "grey"] {
        assert!(absorbed(preset) > 0.0);
    }
    // What else is given replaces the preset's value.
    let scene = load(&with_look("preset = \"brown\"\npheomelanin = 0.9"));
    let Fiber::Deon(deon) = scene.looks[0].base() else { panic!() };
    assert_eq!(deon.sigma_a, from_melanin(1.3, 0.9, MelaninConstants::Pbrt));
}

#[test]
fn variation_without_a_value_is_around_the_preset() {
    let absorbed = |look: &str| match load(&with_look(look)).looks[0].base() {
        fiber::Fiber::Deon(deon) => deon.sigma_a.luminance(),
        other => panic!("{other:?} is not the default model"),
    };
    let blonde = absorbed("preset = \"blonde\"\npheomelanin = 0.0");
    let varied = absorbed("preset = \"blonde\"\npheomelanin = 0.0\neumelanin = { random = 0.1 }");
    assert!((varied - blonde).abs() < 1e-6, "{varied} and {blonde}");
}

#[test]
fn every_model_resolves_with_its_defaults() {
    for model in ["deon", "chiang", "lambertian", "kajiya_kay", "hery"] {
        let scene = load(&with_look(&format!("model = \"{model}\"")));
        let fiber = scene.looks[0].constant().unwrap();
        assert_eq!(fiber.name(), model);
    }
    let scene = load(&with_look("model = \"chiang\"\ntilt_deg = -2.0"));
    let Some(Fiber::Chiang(chiang)) = scene.looks[0].constant() else { panic!() };
    // d'Eon's sign goes through unchanged; negative leans to the root.
    assert!((chiang.alpha + 2_f32.to_radians()).abs() < 1e-7);
    let bright = load(&with_look("model = \"kajiya_kay\"\ndiffuse = 0.9\nspecular = 0.4"));
    assert!(bright.warnings.iter().any(|w| w.contains("more than it receives")));
}

// --- the models with more than one highlight, and the colour of dense hair ---------------------------------------

/// The fiber of a look that varies nowhere.
#[track_caller]
fn fiber_of(look: &str) -> Fiber {
    load(&with_look(look)).looks[0].constant().unwrap_or_else(|| panic!("it varies:\n{look}"))
}

/// Files speak degrees, fibers radians.
fn rad(degrees: f32) -> f32 {
    degrees.to_radians()
}

#[test]
fn a_marschner_look_becomes_its_fiber() {
    let brown = from_melanin(1.3, 0.2, MelaninConstants::Pbrt);
    let usual = Marschner {
        eta: 1.55,
        sigma_a: brown,
        beta_m: rad(7.5),
        alpha: rad(-5.0),
        eccentricity: 1.0,
        roots: Roots::Exact,
        norm: MarschnerNorm::Normalised,
        caustic: Some(Caustic { strength: 1.0, width: rad(15.0), fade: 0.3, limit: 0.5 }),
        diffuse: Rgb::black(),
    };
    assert_eq!(fiber_of("model = \"marschner\""), Fiber::Marschner(usual));
    let all = fiber_of(
        "model = \"marschner\"\nabsorption = [0.1, 0.2, 0.3]\nlongitudinal_roughness_deg = 6.0\ntilt_deg = -7.0\n\
         ior = 1.6\neccentricity = 0.9\ndiffuse = [0.05, 0.1, 0.15]\nroots = \"cubic\"\nglints = true\n\
         glint_strength = 2.5\nglint_width_deg = 20.0\nglint_fade = 0.25\nglint_limit = 0.75\nmode = \"as_printed\"",
    );
    let wanted = Marschner {
        eta: 1.6,
        sigma_a: Rgb::new(0.1, 0.2, 0.3),
        beta_m: rad(6.0),
        alpha: rad(-7.0),
        eccentricity: 0.9,
        roots: Roots::Cubic,
        norm: MarschnerNorm::AsPrinted,
        caustic: Some(Caustic { strength: 2.5, width: rad(20.0), fade: 0.25, limit: 0.75 }),
        diffuse: Rgb::new(0.05, 0.1, 0.15),
    };
    assert_eq!(all, Fiber::Marschner(wanted));
    assert_eq!(
        fiber_of("model = \"marschner\"\nglints = false"),
        Fiber::Marschner(Marschner { caustic: None, ..usual })
    );
    let blonde = from_melanin(0.3, 0.1, MelaninConstants::Pbrt);
    assert_eq!(
        fiber_of("model = \"marschner\"\npreset = \"blonde\""),
        Fiber::Marschner(Marschner { sigma_a: blonde, ..usual })
    );
}

#[test]
fn a_sadeghi_look_becomes_its_fiber() {
    let lobe = |color, intensity, shift, width| ArtistLobe { color, intensity, shift: rad(shift), width: rad(width) };
    let usual = Sadeghi {
        lobes: [
            lobe(Rgb::white(), 0.45, -5.0, 7.5),
            lobe(Rgb::new(0.5, 0.3, 0.15), 0.25, 2.5, 3.75),
            lobe(Rgb::new(0.4, 0.2, 0.08), 0.3, 7.5, 15.0),
        ],
        tt_azimuthal_width: rad(10.0),
        glint: Glint { intensity: 1.0, width: rad(5.0), angle: rad(37.5) },
        mode: SadeghiMode::Normalised,
    };
    // The angle of the glints varies where nothing is said of it.
    assert_eq!(load(&with_look("model = \"sadeghi\"")).looks[0].base(), Fiber::Sadeghi(usual));
    let all = fiber_of(
        "model = \"sadeghi\"\n\
         r_color = [0.9, 0.8, 0.7]\nr_intensity = 0.5\nr_shift_deg = -4.0\nr_width_deg = 6.0\n\
         tt_color = [0.6, 0.5, 0.4]\ntt_intensity = 2.0\ntt_shift_deg = 3.0\ntt_width_deg = 4.0\n\
         tt_azimuthal_width_deg = 12.0\n\
         trt_color = [0.3, 0.2, 0.1]\ntrt_intensity = 0.75\ntrt_shift_deg = 8.0\ntrt_width_deg = 14.0\n\
         glint_intensity = 1.5\nglint_width_deg = 7.0\nglint_angle_deg = 33.0\nmode = \"legacy\"",
    );
    let wanted = Sadeghi {
        lobes: [
            lobe(Rgb::new(0.9, 0.8, 0.7), 0.5, -4.0, 6.0),
            lobe(Rgb::new(0.6, 0.5, 0.4), 2.0, 3.0, 4.0),
            lobe(Rgb::new(0.3, 0.2, 0.1), 0.75, 8.0, 14.0),
        ],
        tt_azimuthal_width: rad(12.0),
        glint: Glint { intensity: 1.5, width: rad(7.0), angle: rad(33.0) },
        mode: SadeghiMode::Legacy,
    };
    assert_eq!(all, Fiber::Sadeghi(wanted));
}

#[test]
fn a_fur_look_becomes_its_fiber() {
    let usual = Fur {
        eta: 1.55,
        sigma_a: from_melanin(1.3, 0.2, MelaninConstants::Pbrt),
        beta_m: rad(7.5),
        beta_n: rad(7.5),
        alpha: rad(-3.0),
        layers: 1.0,
        medulla: Medulla { radius: 0.6, scattering: 2.0, absorption: Rgb::splat(0.0), anisotropy: 0.4 },
    };
    assert_eq!(fiber_of("model = \"fur\""), Fiber::Fur(usual));
    // Around the fiber it is as rough as along it, unless something is said.
    let rough = Fur { beta_m: rad(12.0), beta_n: rad(12.0), ..usual };
    assert_eq!(fiber_of("model = \"fur\"\nlongitudinal_roughness_deg = 12.0"), Fiber::Fur(rough));
    let all = fiber_of(
        "model = \"fur\"\nabsorption = [0.1, 0.2, 0.3]\nlongitudinal_roughness_deg = 6.0\n\
         azimuthal_roughness_deg = 9.0\ntilt_deg = -4.0\nior = 1.5\ncuticle_layers = 2.5\nmedulla = 0.7\n\
         medulla_scattering = 2.0\nmedulla_absorption = [0.01, 0.02, 0.03]\nmedulla_anisotropy = -0.25",
    );
    let wanted = Fur {
        eta: 1.5,
        sigma_a: Rgb::new(0.1, 0.2, 0.3),
        beta_m: rad(6.0),
        beta_n: rad(9.0),
        alpha: rad(-4.0),
        layers: 2.5,
        medulla: Medulla { radius: 0.7, scattering: 2.0, absorption: Rgb::new(0.01, 0.02, 0.03), anisotropy: -0.25 },
    };
    assert_eq!(all, Fiber::Fur(wanted));
}

#[test]
fn second_highlights_resolve_and_are_absent_unless_asked_for() {
    let highlight = |color, exponent, shift| Highlight { color, exponent, shift: rad(shift) };
    let usual = KajiyaKay {
        diffuse: Rgb::new(0.4, 0.25, 0.15),
        highlights: [highlight(Rgb::splat(0.2), 25.0, 0.0), highlight(Rgb::black(), 25.0, 0.0)],
        mode: KajiyaKayMode::Normalised,
    };
    assert_eq!(fiber_of("model = \"kajiya_kay\""), Fiber::KajiyaKay(usual));
    let all = fiber_of(
        "model = \"kajiya_kay\"\nmode = \"thesis\"\ndiffuse = [0.3, 0.2, 0.1]\nspecular = 0.4\nexponent = 80.0\n\
         shift_deg = -5.0\nspecular2 = [0.3, 0.15, 0.05]\nexponent2 = 20.0\nshift2_deg = 7.0",
    );
    let wanted = KajiyaKay {
        diffuse: Rgb::new(0.3, 0.2, 0.1),
        highlights: [highlight(Rgb::splat(0.4), 80.0, -5.0), highlight(Rgb::new(0.3, 0.15, 0.05), 20.0, 7.0)],
        mode: KajiyaKayMode::Thesis,
    };
    assert_eq!(all, Fiber::KajiyaKay(wanted));

    let lobe = |tint, beta, alpha| HeryLobe { tint, beta: rad(beta), alpha: rad(alpha) };
    let usual = Hery {
        lobes: [lobe(Rgb::white(), 5.0, -2.0), lobe(Rgb::black(), 10.0, 5.0)],
        mode: HeryMode::Truncated,
        cos_theta_d: false,
    };
    assert_eq!(fiber_of("model = \"hery\""), Fiber::Hery(usual));
    let all = fiber_of(
        "model = \"hery\"\nmode = \"faithful_exact_pdf\"\ntint = 0.17\nroughness_deg = 5.5\ntilt_deg = -2.5\n\
         tint2 = [0.1, 0.2, 0.8]\nroughness2_deg = 11.0\ntilt2_deg = 6.0\ncos_theta_d = true",
    );
    let wanted = Hery {
        lobes: [lobe(Rgb::splat(0.17), 5.5, -2.5), lobe(Rgb::new(0.1, 0.2, 0.8), 11.0, 6.0)],
        mode: HeryMode::FaithfulExactPdf,
        cos_theta_d: true,
    };
    assert_eq!(all, Fiber::Hery(wanted));
    let faithful = Hery { mode: HeryMode::Faithful, ..usual };
    assert_eq!(fiber_of("model = \"hery\"\nmode = \"faithful\""), Fiber::Hery(faithful));
}

#[test]
fn the_field_of_deon_and_chiang_is_near_unless_another_is_asked_for() {
    for model in ["deon", "chiang"] {
        let field = |look: &str| match fiber_of(&format!("model = \"{model}\"\n{look}")) {
            Fiber::Deon(deon) => deon.field,
            Fiber::Chiang(chiang) => chiang.field,
            other => panic!("{other:?}"),
        };
        let fields = ["", "field = \"near\"", "field = \"far\"", "field = \"auto\""].map(field);
        assert_eq!(fields, [Field::Near, Field::Near, Field::Far, Field::Auto], "{model}");
    }
    let error = fail(&with_look("model = \"chiang\"\nfield = \"autp\""));
    assert_eq!((error.kind, place(&error)), (SceneErrorKind::UnknownName, (6, 9)), "{error}");
    assert_eq!(error.suggestion.as_deref(), Some("auto"));
    assert!(error.message.contains("`near`, `far`, `auto`"), "{error}");
}

const MODELS: [&str; 8] = ["deon", "chiang", "lambertian", "kajiya_kay", "hery", "marschner", "sadeghi", "fur"];

/// Every key of a look but `model`, with a value that is right somewhere, and the models that take it.
const KEYS: &[(&str, &str)] = &[
    ("preset = \"brown\"", "deon chiang marschner fur"),
    ("eumelanin = 0.5", "deon chiang marschner fur"),
    ("pheomelanin = 0.5", "deon chiang marschner fur"),
    ("melanin = 0.5", "deon chiang marschner fur"),
    ("redness = 0.5", "deon chiang marschner fur"),
    ("color = 0.5\ncolor_method = \"fit\"", "deon chiang marschner fur"),
    ("absorption = 0.5", "deon chiang marschner fur"),
    ("melanin_constants = \"cycles\"", "deon chiang marschner fur"),
    ("longitudinal_roughness_deg = 8", "deon marschner fur"),
    ("azimuthal_roughness_deg = 8", "deon fur"),
    ("longitudinal_roughness = 0.5", "chiang"),
    ("azimuthal_roughness = 0.5", "chiang"),
    ("tilt_deg = -2", "deon chiang hery marschner fur"),
    ("ior = 1.5", "deon chiang marschner fur"),
    ("residual = false", "deon"),
    ("attenuation = \"known\"", "deon"),
    ("weights = \"joint\"", "deon"),
    ("field = \"auto\"", "deon chiang"),
    ("albedo = 0.5", "lambertian"),
    ("diffuse = 0.5", "kajiya_kay marschner"),
    ("specular = 0.5", "kajiya_kay"),
    ("exponent = 50", "kajiya_kay"),
    ("shift_deg = 5", "kajiya_kay"),
    ("specular2 = 0.5", "kajiya_kay"),
    ("exponent2 = 50", "kajiya_kay"),
    ("shift2_deg = 5", "kajiya_kay"),
    ("tint = 0.5", "hery"),
    ("roughness_deg = 8", "hery"),
    ("tint2 = 0.5", "hery"),
    ("roughness2_deg = 8", "hery"),
    ("tilt2_deg = 5", "hery"),
    ("cos_theta_d = true", "hery"),
    ("eccentricity = 0.9", "marschner"),
    ("roots = \"cubic\"", "marschner"),
    ("glints = false", "marschner"),
    ("glint_strength = 2", "marschner"),
    ("glint_width_deg = 10", "marschner sadeghi"),
    ("glint_fade = 0.2", "marschner"),
    ("glint_limit = 0.4", "marschner"),
    ("glint_intensity = 2", "sadeghi"),
    ("glint_angle_deg = 40", "sadeghi"),
    ("r_color = 0.5", "sadeghi"),
    ("r_intensity = 0.5", "sadeghi"),
    ("r_shift_deg = 5", "sadeghi"),
    ("r_width_deg = 8", "sadeghi"),
    ("tt_color = 0.5", "sadeghi"),
    ("tt_intensity = 0.5", "sadeghi"),
    ("tt_shift_deg = 5", "sadeghi"),
    ("tt_width_deg = 8", "sadeghi"),
    ("tt_azimuthal_width_deg = 8", "sadeghi"),
    ("trt_color = 0.5", "sadeghi"),
    ("trt_intensity = 0.5", "sadeghi"),
    ("trt_shift_deg = 5", "sadeghi"),
    ("trt_width_deg = 8", "sadeghi"),
    ("medulla = 0.5", "fur"),
    ("medulla_scattering = 2", "fur"),
    ("medulla_absorption = 0.5", "fur"),
    ("medulla_anisotropy = 0.5", "fur"),
    ("cuticle_layers = 2", "fur"),
    ("mode = \"normalised\"", "kajiya_kay marschner sadeghi"),
    ("mode = \"thesis\"", "kajiya_kay"),
    ("mode = \"truncated\"", "hery"),
    ("mode = \"faithful\"", "hery"),
    ("mode = \"faithful_exact_pdf\"", "hery"),
    ("mode = \"as_printed\"", "marschner"),
    ("mode = \"legacy\"", "sadeghi"),
];

#[test]
fn keys_and_modes_belong_to_their_models_and_to_no_others() {
    let key = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
    // The table is complete: the schema, which is made from the code, has no other key.
    let schema: serde_json::Value = serde_json::from_str(&schema()).unwrap();
    let known: BTreeSet<String> =
        schema["$defs"]["LookSection"]["properties"].as_object().unwrap().keys().cloned().collect();
    let mut listed: BTreeSet<String> = KEYS.iter().flat_map(|(lines, _)| lines.lines().map(key)).collect();
    listed.insert("model".to_owned());
    assert_eq!(listed, known);

    for &(lines, owners) in KEYS {
        for model in MODELS {
            let outcome = looks(&format!("[look.main]\nmodel = \"{model}\"\n{lines}\n"), &[]);
            if owners.split(' ').any(|owner| owner == model) {
                assert!(outcome.is_ok(), "{model} refuses {lines}: {}", outcome.err().unwrap());
                continue;
            }
            let Err(error) = outcome else { panic!("{model} takes {lines}") };
            assert_eq!((error.kind, place(&error).0), (SceneErrorKind::Conflict, 3), "{error}");
            assert!(error.message.starts_with(&format!("`look.main.{}`", key(lines))), "{error}");
        }
    }
    for (model, mode, right) in [
        ("kajiya_kay", "legacy", "`normalised`, `thesis`"),
        ("hery", "thesis", "`truncated`, `faithful`, `faithful_exact_pdf`"),
        ("marschner", "legacy", "`normalised`, `as_printed`"),
        ("sadeghi", "as_printed", "`normalised`, `legacy`"),
    ] {
        let error = fail(&with_look(&format!("model = \"{model}\"\nmode = \"{mode}\"")));
        assert_eq!(place(&error), (6, 8), "{error}");
        assert!(error.message.contains("`look.main.mode`") && error.message.contains(right), "{error}");
    }
}

#[test]
fn parameters_of_the_new_models_have_limits() {
    // Model, key, value and what would have been right.
    let cases = [
        ("marschner", "longitudinal_roughness_deg", "0.01", "0.02 and 90"),
        ("marschner", "tilt_deg", "-21", "-20 and 20"),
        ("marschner", "ior", "1", "1.01 and 3"),
        ("marschner", "eccentricity", "0.84", "0.85 and 1"),
        ("marschner", "eccentricity", "1.01", "0.85 and 1"),
        ("marschner", "diffuse", "1.5", "0 and 1"),
        ("marschner", "glint_strength", "5.5", "0 and 5"),
        ("marschner", "glint_width_deg", "0.05", "0.1 and 90"),
        ("marschner", "glint_fade", "0", "0.001 and 1"),
        ("marschner", "glint_limit", "1.1", "0 and 1"),
        ("sadeghi", "r_color", "-0.1", "0 and 1"),
        ("sadeghi", "r_intensity", "101", "0 and 100"),
        ("sadeghi", "r_shift_deg", "46", "-45 and 45"),
        ("sadeghi", "r_width_deg", "0", "0.02 and 90"),
        ("sadeghi", "tt_color", "1.1", "0 and 1"),
        ("sadeghi", "tt_intensity", "-1", "0 and 100"),
        ("sadeghi", "tt_shift_deg", "-46", "-45 and 45"),
        ("sadeghi", "tt_width_deg", "91", "0.02 and 90"),
        ("sadeghi", "tt_azimuthal_width_deg", "0.01", "0.02 and 90"),
        ("sadeghi", "trt_color", "2", "0 and 1"),
        ("sadeghi", "trt_intensity", "100.5", "0 and 100"),
        ("sadeghi", "trt_shift_deg", "90", "-45 and 45"),
        ("sadeghi", "trt_width_deg", "-5", "0.02 and 90"),
        ("sadeghi", "glint_intensity", "-0.5", "0 and 100"),
        ("sadeghi", "glint_width_deg", "91", "0.1 and 90"),
        ("sadeghi", "glint_angle_deg", "181", "0 and 180"),
        ("sadeghi", "glint_angle_deg", "-37", "0 and 180"),
        ("fur", "azimuthal_roughness_deg", "91", "0.02 and 90"),
        ("fur", "cuticle_layers", "0.5", "1 and 10"),
        ("fur", "cuticle_layers", "11", "1 and 10"),
        ("fur", "medulla", "0.96", "0 and 0.95"),
        ("fur", "medulla_scattering", "1001", "0 and 1000"),
        ("fur", "medulla_absorption", "-0.1", "0 and 10000"),
        ("fur", "medulla_anisotropy", "0.95", "-0.6 and 0.9"),
        ("fur", "medulla_anisotropy", "-0.7", "-0.6 and 0.9"),
        ("kajiya_kay", "specular2", "1.1", "0 and 1"),
        ("kajiya_kay", "exponent2", "-1", "0 and 10000"),
        ("kajiya_kay", "shift2_deg", "21", "-20 and 20"),
        ("hery", "tint2", "1.2", "0 and 1"),
        ("hery", "roughness2_deg", "0.01", "0.02 and 90"),
        ("hery", "tilt2_deg", "-21", "-20 and 20"),
    ];
    for (model, key, value, range) in cases {
        let error = fail(&with_look(&format!("model = \"{model}\"\n{key} = {value}")));
        assert_eq!((error.kind, place(&error)), (SceneErrorKind::OutOfRange, (6, key.len() + 4)), "{error}");
        assert_eq!(error.message, format!("`look.main.{key}` is {value}; it must be between {range}"));
    }
    // A channel of a colour, no number at all, and a colour where a number belongs.
    for (lines, kind, says) in [
        ("model = \"hery\"\ntint2 = [0.5, 1.2, 0.1]", SceneErrorKind::OutOfRange, "`look.main.tint2` is 1.2"),
        ("model = \"marschner\"\neccentricity = nan", SceneErrorKind::OutOfRange, "`look.main.eccentricity` is NaN"),
        (
            "model = \"fur\"\nmedulla = [0.1, 0.2, 0.3]",
            SceneErrorKind::WrongType,
            "`look.main.medulla` takes one number",
        ),
        ("model = \"marschner\"\nglints = 1", SceneErrorKind::WrongType, "`look.main.glints`"),
        ("model = \"marschner\"\nroots = \"quartic\"", SceneErrorKind::UnknownName, "`exact`, `cubic`"),
    ] {
        let error = fail(&with_look(lines));
        assert_eq!((error.kind, place(&error).0), (kind, 6), "{error}");
        assert!(error.message.contains(says), "{error}");
    }
}

/// Warnings about the look itself; scenes here have no light, which is another.
fn warnings_of(look: &str) -> Vec<String> {
    load(&with_look(look)).warnings.into_iter().filter(|warning| warning.contains("`look.main")).collect()
}

#[test]
fn colours_that_add_up_to_more_than_all_light_are_warned_about() {
    let white = "model = \"sadeghi\"\ntt_color = 1.0\ntrt_color = 1.0\n";
    // A look, and what it adds up to in the channel that has most.
    for (look, sum) in [
        ("model = \"kajiya_kay\"\ndiffuse = 0.5\nspecular = 0.25\nspecular2 = [0.0, 0.5, 0.0]".to_owned(), "1.25"),
        ("model = \"hery\"\ntint = 0.75\ntint2 = [0.0, 0.0, 0.75]".to_owned(), "1.5"),
        (format!("{white}r_intensity = 1.0\ntt_intensity = 0.25\ntrt_intensity = 0.25"), "1.5"),
    ] {
        let warnings = warnings_of(&look);
        assert_eq!(warnings.len(), 1, "{look}: {warnings:?}");
        assert!(warnings[0].contains(&format!("up to {sum};")), "{warnings:?}");
        assert!(warnings[0].contains("more than it receives"), "{warnings:?}");
    }
    for look in [
        // The defaults, and exactly all light.
        "model = \"kajiya_kay\"".to_owned(),
        "model = \"hery\"".to_owned(),
        "model = \"sadeghi\"".to_owned(),
        "model = \"kajiya_kay\"\ndiffuse = 0.5\nspecular = 0.25\nspecular2 = 0.25".to_owned(),
        "model = \"hery\"\ntint = 0.25\ntint2 = 0.75".to_owned(),
        white.to_owned(),
        // Forms that never conserved anything.
        "model = \"kajiya_kay\"\nmode = \"thesis\"\ndiffuse = 1.0\nspecular = 1.0".to_owned(),
        format!("{white}mode = \"legacy\"\nr_intensity = 2.0"),
    ] {
        assert_eq!(warnings_of(&look), Vec::<String>::new(), "{look}");
    }
}

/// The fiber of the look at a place of a strand of `two.hair`.
fn fiber_at(scene: &Scene, strand: u32, u: f32) -> Fiber {
    let groom = &scene.grooms[0];
    let attributes = &groom.groom.attributes;
    scene.looks[0].fiber(&StrandPoint { strand, u, point_index: 0, frac: 0.0, attributes, seed: groom.seed })
}

#[test]
fn every_strand_has_glints_of_its_own() {
    let scene = load(&with_look("model = \"sadeghi\""));
    let degrees = |scene: &Scene, strand, u| match fiber_at(scene, strand, u) {
        Fiber::Sadeghi(sadeghi) => sadeghi.glint.angle.to_degrees(),
        other => panic!("{other:?}"),
    };
    let angles: Vec<f32> = (0..1000).map(|strand| degrees(&scene, strand, 0.25)).collect();
    // To radians and back is a rounding.
    assert!(angles.iter().all(|angle| (29.999..=45.001).contains(angle)));
    let (least, most) = angles.iter().fold((90.0_f32, 0.0_f32), |(a, b), &x| (a.min(x), b.max(x)));
    // That 1000 even numbers leave a tenth at one end free has a probability of 1e-45.
    assert!(least < 31.5 && most > 43.5, "{least} to {most}");
    // Even on 30 to 45 degrees: standard deviation 4.33. Four standard errors: false alarm 6e-5, the seed is fixed.
    let mean = angles.iter().sum::<f32>() / 1000.0;
    assert!((mean - 37.5).abs() < 4.0 * 4.33 / 1000_f32.sqrt(), "{mean}");
    assert!(angles.windows(2).all(|pair| pair[0] != pair[1]), "neighbours share their glints");
    for strand in 0..10 {
        assert_eq!(degrees(&scene, strand, 0.0), degrees(&scene, strand, 1.0), "an angle belongs to a strand");
    }
    // One angle for all where one is given; nothing varies then.
    let combed = load(&with_look("model = \"sadeghi\"\nglint_angle_deg = 40.0"));
    assert!(combed.looks[0].constant().is_some());
    assert_eq!(degrees(&combed, 3, 0.5), degrees(&combed, 4, 0.5));
}

fn absorption_of(fiber: Fiber) -> Rgb {
    match fiber {
        Fiber::Deon(deon) => deon.sigma_a,
        Fiber::Chiang(chiang) => chiang.sigma_a,
        Fiber::Marschner(marschner) => marschner.sigma_a,
        Fiber::Fur(fur) => fur.sigma_a,
        other => panic!("{other:?} has no absorption"),
    }
}

#[test]
fn a_numeric_colour_is_what_dense_hair_of_the_model_shows() {
    let color = [0.6, 0.4, 0.2];
    for look in [
        format!("model = \"chiang\"\ncolor = {color:?}\ncolor_method = \"numeric\"\nazimuthal_roughness = 0.5"),
        // The default of d'Eon's, for which there is no fit.
        format!("model = \"deon\"\ncolor = {color:?}\nlongitudinal_roughness_deg = 10.0"),
    ] {
        let fiber = fiber_of(&look);
        // The curve that the look inverts, and one from other paths, four times as many.
        let own = AlbedoCurve::new(&fiber.cast(), 8192, 0).unwrap();
        let other = AlbedoCurve::new(&fiber.cast(), 32_768, 7).unwrap();
        for (sigma, color) in absorption_of(fiber).cast::<f64>().0.into_iter().zip(color) {
            // The absorption was rounded to f32.
            assert!((own.albedo(sigma) - color).abs() < 1e-5, "{look}: {} for {color}", own.albedo(sigma));
            // Errors come from 32 groups of paths, so that four of them are missed with a probability of 4e-4; six
            // comparisons, seeds are fixed.
            let allowed = 4.0 * own.error(sigma).hypot(other.error(sigma));
            assert!(allowed < 0.04, "{look}: an error of {allowed} shows nothing");
            let found = other.albedo(sigma);
            assert!((found - color).abs() < allowed, "{look}: {found} for {color}, allowed is {allowed}");
        }
    }
}

#[test]
fn the_method_of_a_colour_can_be_chosen() {
    let color = Rgb::new(0.6, 0.4, 0.2);
    let of = |look: &str| absorption_of(fiber_of(&format!("{look}\ncolor = [0.6, 0.4, 0.2]")));
    let fit = "color_method = \"fit\"";
    // Chiang's own roughness; the others are taken for one of 0.3.
    assert_eq!(of(&format!("model = \"chiang\"\nazimuthal_roughness = 0.7\n{fit}")), from_color(color, 0.7));
    assert_eq!(of("model = \"chiang\"\nazimuthal_roughness = 0.7"), from_color(color, 0.7));
    for model in ["deon", "marschner", "fur"] {
        assert_eq!(of(&format!("model = \"{model}\"\n{fit}")), from_color(color, 0.3), "{model}");
    }
    assert_eq!(of("model = \"marschner\""), from_color(color, 0.3));
    assert_eq!(of("model = \"fur\""), from_color(color, 0.3));
    assert_eq!(of("model = \"deon\""), of("model = \"deon\"\ncolor_method = \"numeric\""));
    assert_ne!(of("model = \"deon\""), of(&format!("model = \"deon\"\n{fit}")));
    assert_ne!(of("model = \"chiang\""), of("model = \"chiang\"\ncolor_method = \"numeric\""));
}

#[test]
fn a_numeric_colour_follows_roughness_that_varies() {
    let look = "model = \"chiang\"\ncolor = [0.6, 0.4, 0.2]\ncolor_method = \"numeric\"\n\
                azimuthal_roughness = { ramp = [[0.0, 0.2], [1.0, 0.8]] }";
    let scene = load(&with_look(look));
    let [root, tip] = [0.0, 1.0].map(|u| fiber_at(&scene, 0, u));
    for fiber in [root, tip] {
        let curve = AlbedoCurve::new(&fiber.cast(), 32_768, 7).unwrap();
        for (sigma, color) in absorption_of(fiber).cast::<f64>().0.into_iter().zip([0.6, 0.4, 0.2]) {
            // 512 paths at every node have a standard error of 0.023 at most: four of them.
            assert!((curve.albedo(sigma) - color).abs() < 0.1, "{} for {color}", curve.albedo(sigma));
        }
    }
    // The published fit says 1.9 times as much, with its own error: light finds its way through rough hair.
    let ratio = absorption_of(tip) / absorption_of(root);
    assert!(ratio.0.iter().all(|r| (1.3..2.6).contains(r)), "{ratio:?}");
}

#[test]
fn colours_that_hair_cannot_reach_are_warned_about() {
    let warnings = warnings_of("model = \"deon\"\ncolor = [1.0, 0.9, 0.5]");
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    for part in ["`look.main.color`: 1 is lighter than", "`attenuation = \"known\"`"] {
        assert!(warnings[0].contains(part), "{part} is missing in {warnings:?}");
    }
    for look in [
        "model = \"deon\"\ncolor = 0.5",
        "model = \"deon\"\ncolor = 1.0\nattenuation = \"known\"",
        "model = \"deon\"\ncolor = 1.0\ncolor_method = \"fit\"",
        "model = \"chiang\"\ncolor = 1.0\ncolor_method = \"numeric\"",
    ] {
        assert_eq!(warnings_of(look), Vec::<String>::new(), "{look}");
    }
}

#[test]
fn a_method_without_a_colour_or_for_another_model_is_refused() {
    let method = "color_method = \"numeric\"";
    for (lines, at, says) in [
        (format!("model = \"deon\"\n{method}"), (6, 1), "means nothing without `color`"),
        (format!("model = \"chiang\"\neumelanin = 1.0\n{method}"), (7, 1), "means nothing without `color`"),
        ("model = \"fur\"\ncolor_method = \"fit\"".to_owned(), (6, 1), "means nothing without `color`"),
        (format!("model = \"lambertian\"\n{method}"), (6, 1), "`lambertian` has no parameter `color_method`"),
        (format!("model = \"sadeghi\"\n{method}"), (6, 1), "`sadeghi` has no parameter `color_method`"),
        (format!("model = \"marschner\"\ncolor = 0.5\n{method}"), (7, 16), "only `deon` and `chiang`"),
        (format!("model = \"fur\"\ncolor = 0.5\n{method}"), (7, 16), "only `deon` and `chiang`"),
    ] {
        let error = fail(&with_look(&lines));
        assert_eq!((error.kind, place(&error)), (SceneErrorKind::Conflict, at), "{error}");
        assert!(error.message.contains("`look.main.color_method`") && error.message.contains(says), "{error}");
    }
    let error = fail(&with_look("model = \"deon\"\ncolor = 0.5\ncolor_method = \"numerc\""));
    assert_eq!((error.kind, error.suggestion.as_deref()), (SceneErrorKind::UnknownName, Some("numeric")), "{error}");
}

/// All names of properties anywhere in a JSON schema.
fn property_names(schema: &serde_json::Value, names: &mut BTreeSet<String>) {
    match schema {
        serde_json::Value::Object(map) => {
            if let Some(serde_json::Value::Object(properties)) = map.get("properties") {
                names.extend(properties.keys().cloned());
            }
            map.values().for_each(|value| property_names(value, names));
        }
        serde_json::Value::Array(values) => {
            values.iter().for_each(|value| property_names(value, names));
        }
        _ => {}
    }
}

/// All keys of a TOML value, except the names of looks.
fn keys(value: &toml::Value, is_look_table: bool, found: &mut BTreeSet<String>) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table {
                if !is_look_table {
                    found.insert(key.clone());
                }
                keys(value, !is_look_table && key == "look", found);
            }
        }
        toml::Value::Array(values) => values.iter().for_each(|value| keys(value, false, found)),
        _ => {}
    }
}

/// The scenes that come with the project.
const SCENES: [(&str, &str); 4] = [
    ("builtin", include_str!("../../../scenes/builtin.toml")),
    ("example", include_str!("../../../scenes/example.toml")),
    ("furnace", include_str!("../../../scenes/furnace.toml")),
    ("blonde", include_str!("../../../scenes/blonde.toml")),
];

#[test]
fn the_schema_knows_every_key_of_the_example() {
    let schema: serde_json::Value = serde_json::from_str(&schema()).unwrap();
    let mut known = BTreeSet::new();
    property_names(&schema, &mut known);
    let mut used = BTreeSet::new();
    let example: toml::Table = SCENES[1].1.parse().unwrap();
    keys(&toml::Value::Table(example), false, &mut used);
    assert!(used.len() > 60, "the example shows only {} keys", used.len());
    let unknown: Vec<&String> = used.difference(&known).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
    // The comments of the structs are the descriptions.
    assert!(super::schema().contains("Vertical field of view in degrees"));
}

#[test]
fn the_scenes_of_the_project_resolve_without_files() {
    for (name, text) in SCENES {
        let few = ["groom.0.procedural.strands=64".to_owned()];
        let scene = Scene::load(text, &few, &NoAssets).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(scene.grooms[0].groom.strand_count() > 0, "{name}");
        // The example's look reads an attribute that procedural hair does not have, to show the fallback.
        let allowed = usize::from(name == "example");
        assert!(scene.warnings.len() <= allowed, "{name}: {:?}", scene.warnings);
    }
    assert_eq!(builtin(), SCENES[0].1);
}

#[test]
fn a_file_can_be_written_and_read_again() {
    let text = SCENES[1].1;
    let file: SceneFile = toml::from_str(text).unwrap();
    let again: SceneFile = toml::from_str(&toml::to_string(&file).unwrap()).unwrap();
    assert_eq!(file, again);
    assert!(Scene::resolve(&SceneFile::default(), &NoAssets).is_err());
}
