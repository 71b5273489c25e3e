use std::collections::BTreeSet;

use fiber::Fiber;
use fiber::absorption::{MelaninConstants, from_color, from_cycles_melanin, from_melanin};
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
