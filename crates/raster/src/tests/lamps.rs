//! Lamps and what is in their way, against geometry; and settings that change on the way, against a fresh renderer.

use film::Image;
use groom::Groom;
use math::{Vec3, hash};
use scene::{Light, Scene};

use super::tables::ask;
use super::{curtain, gpu, scene};
use crate::gpu::Gpu;
use crate::lights::{LampOptions, Lamps};
use crate::settings::Shape;
use crate::{
    DepthShift, Filter, KPlusForm, Kind, Renderer, Settings, ShadingSource, ShadingTime, Shadow, ShadowTechnique,
    Transparency,
};

/// A sheet of hair behind a ball, and one lamp of each kind in front of both.
const BALL: &str = r#"
[camera]
position = [0.0, -5.0, 40.0]
target = [0.0, -5.0, 0.0]
fov_deg = 20.0

[[light]]
type = "distant"
direction = [0.2, -0.1, -1.0]
irradiance = 2.0

[[light]]
type = "point"
position = [5.0, 1.0, 30.0]
intensity = [900.0, 800.0, 700.0]

[[light]]
type = "spot"
position = [-7.0, -2.0, 28.0]
aim = [0.5, -5.0, 0.0]
cone_deg = 20.0
blend = 0.5
intensity = 700.0

[[mesh]]
shape = { sphere = { center = [0.5, -5.0, 6.0], radius = 2.0 } }

[[groom]]
file = "hair"
look = "main"

[look.main]
model = "lambertian"
"#;

const BALL_CENTER: Vec3 = Vec3::new(0.5, -5.0, 6.0);
const BALL_RADIUS: f32 = 2.0;
const HAIR_RADIUS: f32 = 0.03;
const LAMPS: usize = 3;

/// Places that are looked at, and how many are in a row of the answers.
const PLACES: usize = 1024;
const ROW: u32 = 64;

/// Texels a side of the maps.
const MAP_SIDE: u32 = 256;

/// Hair in a sheet a twelfth as thick as it is high, so loose that light gets through.
fn sheet() -> Groom {
    let (strands, points) = (300, 4);
    let mut all = Vec::new();
    for strand in 0..strands {
        let at = |dim| hash::signed(strand, dim);
        let (root, lean) = (Vec3::new(4.0 * at(1), 0.0, 0.4 * at(2)), Vec3::new(0.1 * at(3), -1.0, 0.0));
        all.extend((0..points).map(|i| root + lean * (10.0 * i as f32 / (points - 1) as f32)));
    }
    let mut groom = Groom::new(all, vec![points; strands as usize]).expect("counts fit");
    groom.set_radius(vec![HAIR_RADIUS; (strands * points) as usize]).expect("one each");
    groom
}

/// Places in the sheet, all of them in every map.
fn places() -> Vec<Vec3> {
    let place = |i: u32| {
        let at = |dim: u32| hash::signed(i, 40 + dim);
        Vec3::new(3.9 * at(1), -5.0 + 4.9 * at(2), 0.4 * at(3))
    };
    (0..PLACES as u32).map(place).collect()
}

/// The renderer of the sheet, and its scene.
fn renderer(gpu: &Gpu) -> (std::sync::Arc<Scene>, Renderer) {
    let scene = scene(sheet(), BALL);
    let renderer = Renderer::new(gpu, scene.clone(), &shadowed(Settings::default().shadow));
    (scene, renderer.unwrap_or_else(|error| panic!("{error}")))
}

/// Nothing but shadows.
fn shadowed(shadow: Shadow) -> Settings {
    let mut settings = Settings { transparency: Transparency::Opaque, shadow, ..Settings::default() };
    settings.shading.multiple = None;
    settings.shadow.resolution = MAP_SIDE;
    settings
}

/// Answers of all lamps about all places, lamp by lamp: `value` is WGSL that returns a `vec4f` for `lamp` and the place
/// `p`.
fn probe(gpu: &Gpu, renderer: &mut Renderer, label: &'static str, value: &str, places: &[Vec3]) -> Vec<Vec<[f32; 4]>> {
    let part = format!(
        "
@group(3) @binding(0) var<storage, read> probe_places: array<vec4f>;

@fragment
fn probe(@builtin(position) at: vec4f) -> @location(0) vec4f {{
    let i = u32(at.x) + {ROW}u * u32(at.y);
    let lamp = i / {PLACES}u;
    let p = probe_places[i % {PLACES}u].xyz;
    {value}
}}
"
    );
    let words: Vec<[f32; 4]> = places.iter().map(|p| p.extend(0.0).to_array()).collect();
    let size = [ROW, (LAMPS * PLACES) as u32 / ROW];
    let got = ask(gpu, renderer, label, &part, bytemuck::cast_slice(&words), size);
    got.chunks_exact(PLACES).map(<[[f32; 4]]>::to_vec).collect()
}

/// What a lamp's map says of all places: lit by meshes, lit by hair, fibers crossed.
fn shadows(gpu: &Gpu, renderer: &mut Renderer, places: &[Vec3]) -> Vec<Vec<[f32; 4]>> {
    const VALUE: &str = "return vec4f(shadow_solid(lamp, p), shadow_lit(lamp, p), shadow_fibers(lamp, p), 1.0);";
    probe(gpu, renderer, "test: shadows", VALUE, places)
}

/// How near the light of a lamp comes to the ball's centre on its way to `p`.
fn passes(light: &Light, p: Vec3) -> f32 {
    let towards = match *light {
        Light::Distant { direction, .. } => -direction,
        Light::Point { position, .. } | Light::Spot { position, .. } => (position - p).normalize(),
        _ => panic!("{light:?} is not in this scene"),
    };
    (BALL_CENTER - p).cross(towards).length()
}

/// The largest texel of a lamp's map where the hair is, from the sphere around the hair: at most 2 % wider than it is
/// around every kind of map.
fn largest_texel(light: &Light, (least, greatest): (Vec3, Vec3)) -> f32 {
    let (middle, radius) = (0.5 * (least + greatest), 0.5 * (greatest - least).length());
    let width = match *light {
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let distance = (position - middle).length();
            2.0 * (radius / distance).asin().tan() * (distance + radius)
        }
        _ => 2.0 * radius,
    };
    1.02 * width / MAP_SIDE as f32
}

/// That maps tell where the ball's shadow is, for all lamps; `filter` is how many texels it takes to either side.
fn assert_ball_shadow(what: &str, scene: &Scene, filter: u32, places: &[Vec3], found: &[Vec<[f32; 4]>]) {
    let hair = scene.grooms[0].groom.bounds().map(|(least, greatest)| (least - HAIR_RADIUS, greatest + HAIR_RADIUS));
    let hair = hair.expect("there is hair");
    for (light, found) in scene.lights.iter().zip(found) {
        // Two texels, and those that the filter looks at.
        let margin = (2 + filter) as f32 * largest_texel(light, hair);
        let (mut dark, mut lit) = (0, 0);
        for (&p, found) in places.iter().zip(found) {
            let away = passes(light, p);
            if away < BALL_RADIUS - margin {
                assert_eq!(found[0], 0.0, "{what}: {p} is in the ball's shadow, {light:?}");
                dark += 1;
            } else if away > BALL_RADIUS + margin {
                assert!(found[0] > 0.9999, "{what}: {p} is beside the ball's shadow: {}, {light:?}", found[0]);
                lit += 1;
            }
        }
        assert!(dark > 50 && lit > 500, "{what}: {dark} dark and {lit} lit places say nothing, {light:?}");
    }
}

const TECHNIQUES: [ShadowTechnique; 4] =
    [ShadowTechnique::Map, ShadowTechnique::Adsm { spacing: None }, ShadowTechnique::Osm, ShadowTechnique::DOM];

#[test]
fn a_ball_shadows_the_hair_behind_it() {
    let gpu = gpu();
    let (scene, mut renderer) = renderer(&gpu);
    let places = places();
    for technique in TECHNIQUES {
        for filter in [Filter::None, Filter::Pcf3, Filter::Pcf5] {
            let what = format!("{} {}", technique.name(), filter.name());
            let settings = shadowed(Shadow { technique, filter, ..Settings::default().shadow });
            renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
            let found = shadows(&gpu, &mut renderer, &places);
            assert_ball_shadow(&what, &scene, filter.radius(), &places, &found);
            for (lamp, found) in found.iter().enumerate() {
                let mean = found.iter().map(|one| f64::from(one[1])).sum::<f64>() / PLACES as f64;
                assert!((0.05..0.95).contains(&mean), "{what}, lamp {lamp}: of light comes through {mean}");
                for one in found {
                    assert!((0.0..=1.0).contains(&one[1]), "{what}, lamp {lamp}: {one:?}");
                    // What the fibers crossed let through is what gets through; nothing is left of 64 fibers.
                    let through = (-one[2]).exp();
                    assert!((through - one[1]).abs() < 1e-5, "{what}, lamp {lamp}: {through} of {one:?}");
                }
            }
        }
    }

    let settings = shadowed(Shadow { technique: ShadowTechnique::None, ..Settings::default().shadow });
    renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
    let found = shadows(&gpu, &mut renderer, &places);
    assert!(found.iter().flatten().all(|one| *one == [1.0, 1.0, 0.0, 1.0]), "there are shadows without a technique");
}

/// Strength is the share of the shadow that is left, alpha the opacity of a fiber, whatever made the shadow.
#[test]
fn weaker_shadows_are_shares_of_strong_ones() {
    let gpu = gpu();
    let (_, mut renderer) = renderer(&gpu);
    let places = places();
    for technique in TECHNIQUES {
        let mut found = |strength, alpha| {
            let shadow = Shadow { technique, strength, alpha, filter: Filter::None, ..Settings::default().shadow };
            renderer.set(&shadowed(shadow)).unwrap_or_else(|error| panic!("{error}"));
            shadows(&gpu, &mut renderer, &places).concat()
        };
        let full = found(1.0, Shadow::PHYSICAL_ALPHA);
        let half = found(0.5, Shadow::PHYSICAL_ALPHA);
        let paler = found(1.0, 0.5 * Shadow::PHYSICAL_ALPHA);
        for ((full, half), paler) in full.iter().zip(&half).zip(&paler) {
            let what = technique.name();
            let want = 1.0 - 0.5 * (1.0 - full[1]);
            assert!((half[1] - want).abs() < 1e-6, "{what}: {half:?} at half the strength, {full:?}");
            // Meshes stay opaque.
            assert_eq!((half[0], paler[0]), (full[0], full[0]), "{what}");
            // Of one texel: half the optical depth is the square root of what gets through. A depth map has no opacity.
            let want = if technique == ShadowTechnique::Map { full[1] } else { full[1].sqrt() };
            // Exponentials of devices may have so few digits.
            assert!((paler[1] - want).abs() < 1e-4, "{what}: {paler:?} at half the opacity, {full:?}");
            for one in [half, paler] {
                assert!(((-one[2]).exp() - one[1]).abs() < 1e-5, "{what}: {one:?}");
            }
        }
    }
}

/// Direction and irradiance of every kind of lamp, the falling edge of the spot included.
#[test]
fn what_arrives_is_the_same_on_the_device() {
    const VALUE: &str = "let light = lamp_arriving(lamp, p);\n    return vec4f(light.direction, light.irradiance.y);";
    let gpu = gpu();
    let (scene, mut renderer) = renderer(&gpu);
    let places = places();
    let found = probe(&gpu, &mut renderer, "test: arriving", VALUE, &places);
    let lamps = Lamps::new(&scene, &LampOptions::default()).lamps;
    assert_eq!(lamps.len(), LAMPS);
    let mut fading = 0;
    for (lamp, found) in lamps.iter().zip(&found) {
        let brightest = places.iter().map(|&p| lamp.reaching(p).1.0[1]).fold(0.0, f32::max);
        for (&p, found) in places.iter().zip(found) {
            let (towards, light) = lamp.reaching(p);
            let off = (Vec3::new(found[0], found[1], found[2]) - towards).length();
            assert!(off < 1e-5, "{p}: {found:?} and not {towards}, {lamp:?}");
            let off = (found[3] - light.0[1]).abs();
            assert!(off <= 1e-4 * brightest, "{p}: {found:?} and not {light:?}, {lamp:?}");
            fading += u32::from(lamp.cone.is_some() && light.0[1] < 0.8 * brightest && light.0[1] > 0.1 * brightest);
        }
    }
    assert!(fading > 50, "{fading} places in the spot's edge say nothing");
}

/// A curtain with a ball in it, under a lamp and a sky.
const CHANGING: &str = r#"
[camera]
position = [0.0, -5.0, 40.0]
target = [0.0, -5.0, 0.0]
fov_deg = 20.0

[[light]]
type = "point"
position = [20.0, 10.0, 30.0]
intensity = 3000.0

[[light]]
type = "environment"
radiance = [0.2, 0.3, 0.5]

[[mesh]]
shape = { sphere = { center = [2.0, -5.0, 2.0], radius = 1.5 } }

[[groom]]
file = "hair"
look = "main"

[look.main]
model = "chiang"
absorption = [0.1, 0.2, 0.4]
"#;

/// What the row of changes begins with: small maps and few lamps, for many frames are drawn.
fn start() -> Settings {
    let mut settings = Settings::default();
    settings.shadow.resolution = 64;
    settings.lights.environment_directions = 2;
    settings
}

/// A change and its name.
type Change = (&'static str, fn(&mut Settings));

/// Each upon the ones before.
const CHANGES: [Change; 10] = [
    ("lines", |s| s.geometry.shape = Shape::Line),
    ("shaded forward", |s| s.shading.when = ShadingTime::Forward),
    ("small tables", |s| s.shading.table_size = 16),
    ("another model", |s| s.shading.model = Some(Kind::Marschner)),
    ("opacity shadow maps", |s| s.shadow.technique = ShadowTechnique::Osm),
    ("ambient light", |s| {
        s.lights.harmonics = true;
        s.lights.environment_directions = 4;
    }),
    ("ribbons, fewer and finer, the foremost of them", |s| {
        s.geometry.shape = Shape::Ribbon;
        s.geometry.subdivisions = 3;
        s.geometry.strands = 0.5;
        s.transparency = Transparency::KPlus { k: 8, form: KPlusForm::LockFree };
    }),
    ("no tables, deferred", |s| {
        s.shading.source = ShadingSource::Direct;
        s.shading.when = ShadingTime::Deferred;
    }),
    ("paler shadows, nothing scattered twice", |s| {
        s.shading.multiple = None;
        s.shadow.strength = 0.6;
        s.shadow.alpha *= 0.5;
        s.shadow.strands = 0.7;
        s.shadow.resolution = 48;
        s.shadow.filter = Filter::Pcf5;
        s.shadow.technique = ShadowTechnique::Adsm { spacing: None };
        s.transparency = Transparency::Dbk { shift: DepthShift::Fixed(1.0) };
    }),
    ("all as it was", |s| *s = start()),
];

/// How many pixels of two pictures differ by more than a thousandth of them and of the mean.
fn differing(a: &Image, b: &Image) -> usize {
    let mean = b.pixels.iter().map(|p| p.luminance()).sum::<f32>() / b.pixels.len() as f32;
    let alphas = a.alpha.iter().flatten().zip(b.alpha.iter().flatten());
    let alphas = alphas.map(|(a, b)| (a - b).abs() > 1e-3);
    let colors = a.pixels.iter().zip(&b.pixels).map(|(a, b)| {
        // Written so that what is no number differs.
        !(0..3).all(|channel| (a[channel] - b[channel]).abs() <= 1e-3 * (b[channel] + mean))
    });
    colors.zip(alphas).filter(|(color, alpha)| *color || *alpha).count()
}

/// A renderer that is told of one change after the other draws what one draws that is made for it.
#[test]
fn changed_settings_are_those_of_a_new_renderer() {
    const SIZE: [u32; 2] = [48, 40];
    // Where two fragments lie at one depth, either may come first, in any frame.
    const TIES: usize = 2;
    let gpu = gpu();
    let scene = scene(curtain(300, 5, 6.0, 10.0, 0.08), CHANGING);
    let draw = |renderer: &mut Renderer| {
        renderer.draw(&scene.camera, SIZE).unwrap_or_else(|error| panic!("{error}"));
        renderer.image().unwrap_or_else(|error| panic!("{error}"))
    };
    let fresh = |settings: &Settings| {
        draw(&mut Renderer::new(&gpu, scene.clone(), settings).unwrap_or_else(|error| panic!("{error}")))
    };
    let mut settings = start();
    let mut changing = Renderer::new(&gpu, scene.clone(), &settings).unwrap_or_else(|error| panic!("{error}"));
    let first = draw(&mut changing);
    let mut last = first.clone();
    for (what, change) in CHANGES {
        change(&mut settings);
        changing.set(&settings).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(changing.settings(), &settings, "{what}");
        let image = draw(&mut changing);
        let off = differing(&image, &fresh(&settings));
        assert!(off <= TIES, "{what}: {off} pixels are not those of a new renderer");
        // The least thing counts here: shading forward or deferred should look alike.
        let changed = image.pixels.iter().zip(&last.pixels).filter(|(a, b)| a != b).count();
        println!("{what}: {changed} pixels changed, {off} differ from a new renderer's");
        assert!(changed > 20, "{what}: {changed} pixels changed; the test says nothing");
        last = image;
    }
    assert!(differing(&last, &first) <= TIES, "the last picture is not the first one again");
}
