//! Shading: what the device looks up in textures is what the fiber library looks up, every text that is put together is
//! valid, and shading late is shading at once.

use fiber::multiple::dual_scattering::{DualScattering, Options};
use fiber::multiple::spread::Spread;
use fiber::table::chiang::{self, ChiangTables};
use fiber::table::deon::{self, DeonTables};
use fiber::table::marschner::{self, MarschnerTables, Resolution};
use fiber::table::{Table2, Tables as _};
use fiber::{Chiang, Deon, Dir, Fiber, Field, Lobes};
use film::Image;
use math::{Rgb, hash};
use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::twins::layout;
use super::{curtain, gpu, scene};
use crate::frame::{Frame, cleared};
use crate::gpu::Gpu;
use crate::palette::Palette;
use crate::stage::{Context, FRAGMENT, FRAME, STRANDS, ScreenPass, entry, storage, target, texture_2d};
use crate::{Filter, Renderer, Settings, ShadingSource, ShadingTime, ShadowTechnique, Transparency};

/// Runs the fragment function `probe` of `part`, behind the scene's shading text, for every pixel of a texture of
/// `size`. `contents` is what it finds in the storage buffer `@group(3) @binding(0)`.
pub(super) fn ask(
    gpu: &Gpu,
    renderer: &mut Renderer,
    label: &'static str,
    part: &str,
    contents: &[u8],
    size: [u32; 2],
) -> Vec<[f32; 4]> {
    let format = wgpu::TextureFormat::Rgba32Float;
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let texture = gpu.device.create_texture(&texture_2d(label, size, 1, format, usage));
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &[entry(0, wgpu::ShaderStages::FRAGMENT, storage(true))],
    });
    let buffer = gpu.buffer(label, contents, wgpu::BufferUsages::STORAGE);
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout: &layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    });
    let mut draw = |context: &Context<'_>, frame: &mut Frame| {
        let pipeline = context.stage.screen(
            context.gpu,
            &ScreenPass {
                label,
                part,
                fragment: "probe",
                shades: true,
                technique: Some(&layout),
                targets: &[target(format, None)],
                depth: None,
            },
        );
        let mut pass = frame.render("test", label, &[cleared(&view, wgpu::Color::TRANSPARENT)], None);
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        pass.set_bind_group(2, context.shading_group, &[]);
        pass.set_bind_group(3, &group, &[]);
        pass.draw(0..3, 0..1);
    };
    let camera = renderer.scene().camera;
    renderer.compose(&camera, [32, 32], &mut draw).unwrap_or_else(|error| panic!("{error}"));
    let bytes = gpu.fetch_texture(&texture, 0, wgpu::TextureAspect::All).unwrap_or_else(|error| panic!("{error}"));
    bytemuck::pod_collect_to_vec(&bytes)
}

/// Five fibers of the three models that have tables: as many as one shader can have, and two of them twice.
const FIBERS: &str = r#"
[camera]
position = [0.0, -5.0, 40.0]
target = [0.0, -5.0, 0.0]
fov_deg = 20.0

[[light]]
type = "distant"
direction = [0.0, 0.0, -1.0]
irradiance = 1.0

[[groom]]
file = "hair"
look = "a"

[[groom]]
file = "hair"
look = "b"

[[groom]]
file = "hair"
look = "c"

[[groom]]
file = "hair"
look = "d"

[[groom]]
file = "hair"
look = "e"

[look.a]
model = "deon"
absorption = [0.1, 0.2, 0.4]

[look.b]
model = "chiang"
absorption = [0.2, 0.35, 0.6]

[look.c]
model = "marschner"
absorption = [0.1, 0.2, 0.4]
diffuse = [0.1, 0.2, 0.05]

[look.d]
model = "deon"
absorption = [0.5, 0.3, 0.1]
longitudinal_roughness_deg = 12.0
azimuthal_roughness_deg = 10.0
attenuation = "known"
residual = false

[look.e]
model = "marschner"
absorption = [0.6, 0.3, 0.2]
longitudinal_roughness_deg = 10.0
glint_width_deg = 20.0
"#;

/// How many pairs of directions are looked up.
const PAIRS: u32 = 4096;

/// Pairs in a row of the answers.
const ROW: u32 = 64;

/// Two directions and which fiber is asked; and a number of fibers in the light's way.
#[derive(Clone, Copy, Debug)]
struct Pair {
    known: Dir,
    light: Dir,
    entry: usize,
    fibers: f32,
}

impl Pair {
    /// Directions often near each other's specular cone, where light is.
    fn new(index: u32, entries: usize) -> Self {
        let unit = |dim: u32| hash::unit(index, 900 + dim);
        let theta_k = 1.4 * (2.0 * unit(1) - 1.0);
        let theta = ((unit(2) - 0.5) - theta_k).clamp(-1.4, 1.4);
        let turn = |dim: u32| std::f32::consts::TAU * unit(dim);
        Self {
            known: Dir::new(theta_k, turn(3)),
            light: Dir::new(theta, turn(4) - std::f32::consts::PI),
            entry: (unit(5) * entries as f32) as usize,
            // Half of them between none and one.
            fibers: if unit(6) < 0.5 { unit(7) } else { 1.0 + 8.0 * unit(7) },
        }
    }

    /// As the shaders below read it.
    fn words(&self) -> [f32; 8] {
        let (k, s) = (self.known, self.light);
        let entry = self.entry as f32;
        [k.sin_theta, k.cos_theta, k.phi, self.fibers, s.sin_theta, s.cos_theta, s.phi, entry]
    }
}

/// Declares the pairs.
const ASKED: &str = "
struct ProbePair { known: vec4f, light: vec4f }

@group(3) @binding(0) var<storage, read> probe_pairs: array<ProbePair>;
";

/// The fibers of a scene and their renderer, which has no shadows.
fn renderer(gpu: &Gpu, settings: &Settings) -> (Palette, Renderer) {
    let scene = scene(curtain(4, 3, 6.0, 10.0, 0.05), FIBERS);
    let palette = Palette::new(&scene, settings.shading.model, settings.shading.palette as usize);
    (palette, Renderer::new(gpu, scene, settings).unwrap_or_else(|error| panic!("{error}")))
}

fn plain() -> Settings {
    let mut settings = Settings { transparency: Transparency::Opaque, ..Settings::default() };
    settings.shadow.technique = ShadowTechnique::None;
    settings.shading.multiple = None;
    settings
}

/// Tables of one fiber, in half precision.
enum Baked {
    Deon(DeonTables),
    Chiang(ChiangTables),
    Marschner(MarschnerTables),
}

/// What a lookup on a device may miss: it places itself between two texels with eight bits, so that it is off by up to
/// 1/512 of the step from one to the next either way, and it may take a half below 2⁻¹⁴ for nothing.
fn slack(table: &Table2, [u, v]: [f32; 2]) -> [f32; 4] {
    const LEAST_HALF: f32 = 1.0 / 16384.0;
    let here = table.sample(u, v);
    let [across, down] = table.size().map(|texels| 1.0 / (512.0 * texels as f32));
    let mut most = [0.0_f32; 4];
    for (right, below) in [(across, down), (-across, down), (across, -down), (-across, -down)] {
        let there = table.sample(u + right, v + below);
        most = std::array::from_fn(|channel| most[channel].max((there[channel] - here[channel]).abs()));
    }
    most.map(|most| most + LEAST_HALF)
}

/// Channel by channel.
fn plus(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|channel| a[channel] + b[channel])
}

impl Baked {
    fn new(fiber: &Fiber, side: u32) -> Self {
        match fiber.cast::<f64>() {
            Fiber::Deon(m) => Self::Deon(deon::bake(&m, side).expect("a size that tables have").halved()),
            Fiber::Chiang(m) => Self::Chiang(chiang::bake(&m, side).expect("a size that tables have").halved()),
            Fiber::Marschner(m) => {
                let tables = marschner::bake(&m, Resolution::square(side));
                Self::Marschner(tables.expect("a round fiber with smoothed caustics").halved())
            }
            other => panic!("{} has no tables", other.name()),
        }
    }

    /// `fcos` per lobe, and how much of it the filter of a device may miss.
    fn look_up(&self, known: Dir, s: Dir) -> (Lobes, Lobes) {
        // Texels enter as factors that are never negative: with more of each there is more of all.
        match self {
            Self::Deon(tables) => {
                let at = tables.coords(known, s);
                let [a, b] = [&tables.r_tt, &tables.trt].map(|table| slack(table, at));
                (tables.eval(known, s), tables.combine(known, s, a, b, slack(&tables.residual, [0.5, at[1]])))
            }
            Self::Chiang(tables) => {
                let at = tables.coords(known, s);
                let [a, b] = [&tables.r_tt, &tables.trt].map(|table| slack(table, at));
                (tables.eval(known, s), tables.combine(known, s, a, b, slack(&tables.residual, [0.5, at[1]])))
            }
            Self::Marschner(tables) => {
                let at = tables.coords(known, s);
                let along = tables.longitudinal.sample(at[0], at[1]);
                let more = plus(along, slack(&tables.longitudinal, at));
                let at = tables.section_coords(known, s, along);
                let [a, b] =
                    [&tables.r_tt, &tables.trt].map(|table| plus(table.sample(at[0], at[1]), slack(table, at)));
                let (here, most) = (tables.eval(known, s), tables.combine(known, s, more, a, b));
                (here, Lobes(std::array::from_fn(|p| most[p] - here[p])))
            }
        }
    }
}

/// The whole way of the renderer: from a fiber's entry by its layer of the textures to its lobes.
#[test]
fn tables_have_the_same_values_on_the_device() {
    const PART: &str = "
@fragment
fn probe(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let x = u32(at.x);
    let pair = probe_pairs[x / 4u + 64u * u32(at.y)];
    let known = Dir(pair.known.x, pair.known.y, pair.known.z);
    let light = Dir(pair.light.x, pair.light.y, pair.light.z);
    let lobes = shade_fiber(shade_entries[u32(pair.light.w)], known, 0.0, 1.0, light);
    switch x % 4u {
        case 0u: { return vec4f(lobes.r, 0.0); }
        case 1u: { return vec4f(lobes.tt, 0.0); }
        case 2u: { return vec4f(lobes.trt, 0.0); }
        default: { return vec4f(lobes.residual, 0.0); }
    }
}
";
    let gpu = gpu();
    let settings = plain();
    let (palette, mut renderer) = renderer(&gpu, &settings);
    let baked: Vec<Baked> = palette.fibers.iter().map(|fiber| Baked::new(fiber, settings.shading.table_size)).collect();
    assert_eq!(baked.len(), 5);
    let pairs: Vec<Pair> = (0..PAIRS).map(|i| Pair::new(i, baked.len())).collect();
    let words: Vec<[f32; 8]> = pairs.iter().map(Pair::words).collect();
    let part = [ASKED, PART].concat();
    let size = [4 * ROW, PAIRS / ROW];
    let got = ask(&gpu, &mut renderer, "test: tables", &part, bytemuck::cast_slice(&words), size);

    let (mut telling, mut worst) = (0, 0.0_f32);
    for (pair, got) in pairs.iter().zip(got.chunks_exact(4)) {
        let (want, slack) = baked[pair.entry].look_up(pair.known, pair.light);
        let brightest = want.0.iter().map(|lobe| lobe.max_channel()).fold(0.0, f32::max);
        for p in 0..4 {
            for channel in 0..3 {
                let (got, want) = (got[p][channel], want[p][channel]);
                // Beside the filter: exponentials and the like, as for the models themselves; 1e-5 where nothing is.
                let allowed = slack[p][channel] + 1e-3 * brightest + 1e-5;
                let off = (got - want).abs();
                // Written so that what is no number is wrong.
                assert!(off <= allowed, "lobe {p}: {got:e} and not {want:e} ± {allowed:e}: {pair:?}");
                worst = worst.max(off / allowed);
            }
        }
        telling += u32::from(brightest > 1e-3);
    }
    println!("at most {:.1} % of what is allowed", 100.0 * worst);
    assert!(2 * telling > PAIRS, "only {telling} of {PAIRS} values say anything");
}

/// The fiber as its tables of multiple scattering see it.
fn near(fiber: Fiber) -> Fiber {
    match fiber {
        Fiber::Deon(m) => Fiber::Deon(Deon { field: Field::Near, ..m }),
        Fiber::Chiang(m) => Fiber::Chiang(Chiang { field: Field::Near, ..m }),
        other => other,
    }
}

/// Light scattered by other fibers. The filter's 1/512 of a step also moves variances and inclinations of cones, and on
/// the flank of a narrow cone the density is steep: three deviations out, a shift by a thousandth of the table's step
/// of 0.1 rad changes a cone of 3 degrees by half a percent. So a single value may be off by a percent of the brightest
/// channel, but all of them together by a thousandth only.
#[test]
fn multiple_scattering_has_the_same_values_on_the_device() {
    const PART: &str = "
@fragment
fn probe(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pair = probe_pairs[u32(at.x) + 64u * u32(at.y)];
    let known = Dir(pair.known.x, pair.known.y, pair.known.z);
    let light = Dir(pair.light.x, pair.light.y, pair.light.z);
    let layer = shade_entries[u32(pair.light.w)].layer;
    let theta = dir_theta(light);
    let theta_k = dir_theta(known);
    let front = spread_uniform(pair.known.w, shade_side(0.0, -theta, layer));
    let same = cos(light.phi - known.phi) >= 0.0;
    let around = shade_side(select(6.0, 3.0, same), 0.5 * (theta_k - theta), layer);
    let place = spread_glow_coords(known, light, vec2f(textureDimensions(shade_glow_a)));
    var direct = lobes_zero();
    direct.r = vec3f(0.03, 0.02, 0.01);
    let value = spread_eval(
        known,
        light,
        direct,
        front,
        around,
        textureSampleLevel(shade_glow_a, shade_sampler, place, layer, 0.0),
        textureSampleLevel(shade_glow_b, shade_sampler, place, layer, 0.0),
        textureSampleLevel(shade_glow_c, shade_sampler, place, layer, 0.0),
        shade_curve(9.0, theta_k, layer),
        shade_curve(10.0, theta_k, layer),
        SHADE_DENSITY_FORWARD,
        SHADE_DENSITY_BACKWARD,
    );
    return vec4f(value, 1.0);
}
";
    let gpu = gpu();
    let mut settings = plain();
    settings.shading.source = ShadingSource::Direct;
    settings.shading.multiple = Some(crate::DualScattering::default());
    let (palette, mut renderer) = renderer(&gpu, &settings);
    // As `shade.rs` bakes them.
    let options = Options { entries: 32, samples: 2048, ..Options::default() };
    let bake = |fiber: &Fiber| Spread::new(&DualScattering::new(near(*fiber), options), 48, 32).halved();
    let baked: Vec<Spread> = palette.fibers.iter().map(bake).collect();
    // Where the light changes sides the fibers behind return something else, and rounding decides which.
    let is_clear = |pair: &Pair| (pair.light.phi - pair.known.phi).cos().abs() > 1e-4;
    let pairs: Vec<Pair> = (0..).map(|i| Pair::new(i, baked.len())).filter(is_clear).take(PAIRS as usize).collect();
    let words: Vec<[f32; 8]> = pairs.iter().map(Pair::words).collect();
    let part = [ASKED, PART].concat();
    let size = [ROW, PAIRS / ROW];
    let got = ask(&gpu, &mut renderer, "test: spread", &part, bytemuck::cast_slice(&words), size);

    let direct = Lobes::only(fiber::R, Rgb::new(0.03, 0.02, 0.01));
    let (mut missed, mut whole) = (0.0_f64, 0.0_f64);
    for (pair, got) in pairs.iter().zip(&got) {
        let spread = &baked[pair.entry];
        let front = spread.uniform(pair.fibers, pair.light.theta());
        let want = spread.eval(pair.known, pair.light, direct, &front);
        for channel in 0..3 {
            let (got, want, brightest) = (got[channel], want[channel], want.max_channel());
            let allowed = 0.01 * brightest + 1e-5;
            assert!((got - want).abs() <= allowed, "{got:e} and not {want:e} ± {allowed:e}: {pair:?}");
            missed += f64::from((got - want).abs());
            whole += f64::from(want);
        }
    }
    println!("all together {:.4} % off", 100.0 * missed / whole);
    assert!(missed < 1e-3 * whole && whole > 0.01 * f64::from(PAIRS), "{missed} of {whole}");
}

#[test]
fn every_text_that_is_put_together_is_valid() {
    const USE: &str = "
@fragment
fn use_all(v: HairVertex) -> @location(0) vec4f {
    let f = hair_fragment(v);
    let payload = fragment_payload(f);
    let color = payload_color(payload, v.clip.xy, f.depth);
    return vec4f(color.rgb + shade(f) + lamp_ambient(f.tangent), payload_alpha(payload));
}
";
    let models: [&[&str]; 9] = [
        &["deon"],
        &["chiang"],
        &["lambertian"],
        &["kajiya_kay"],
        &["hery"],
        &["marschner"],
        &["sadeghi"],
        &["fur"],
        &["deon", "chiang", "marschner"],
    ];
    let techniques = [
        ShadowTechnique::None,
        ShadowTechnique::Map,
        ShadowTechnique::Adsm { spacing: None },
        ShadowTechnique::Osm,
        ShadowTechnique::DOM,
    ];
    let mut wrong = Vec::new();
    // Nine and five have no common factor: every model meets every technique, and the other choices in turn.
    for round in 0..models.len() * techniques.len() {
        let models = models[round % models.len()];
        let mut settings = Settings::default();
        settings.shadow.technique = techniques[round % techniques.len()];
        settings.shadow.filter = [Filter::None, Filter::Pcf3, Filter::Pcf5][round / 2 % 3];
        settings.shading.source = if round & 1 == 0 { ShadingSource::Tables } else { ShadingSource::Direct };
        settings.shading.when = if round & 2 == 0 { ShadingTime::Deferred } else { ShadingTime::Forward };
        settings.shading.multiple = (round & 4 == 0).then(crate::DualScattering::default);
        settings.lights.harmonics = round & 8 == 0;
        let shading = crate::shade::text(models, &settings).unwrap_or_else(|error| panic!("{error}"));
        let text = [FRAME, FRAGMENT, STRANDS, &shading, USE].join("\n");
        let what = format!("{models:?}, {:?}, {:?}, {:?}", settings.shading, settings.shadow, settings.lights);
        match naga::front::wgsl::parse_str(&text) {
            Err(error) => wrong.push(format!("{what}: {}", error.emit_to_string(&text))),
            Ok(module) => {
                // Nothing beyond what every WebGPU device has.
                let mut validator = Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32);
                if let Err(error) = validator.validate(&module) {
                    wrong.push(format!("{what}: {}", error.emit_to_string(&text)));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} texts are wrong; {}", wrong.len(), wrong.join("\n"));
}

#[test]
fn entries_of_fibers_are_four_words() {
    let shading = crate::shade::text(&["chiang"], &Settings::default()).unwrap_or_else(|error| panic!("{error}"));
    let text = [FRAME, FRAGMENT, &shading].join("\n");
    // As `shade.rs` uploads them.
    let members = ["model", "index", "table", "layer"].into_iter().zip([0, 4, 8, 12]);
    let members: Vec<(String, usize)> = members.map(|(name, offset)| (name.to_owned(), offset)).collect();
    assert_eq!(layout(&text, "Entry"), (16, members));
}

/// Of two pictures: the mean difference over the mean; the largest difference over the mean or, where a pixel is
/// brighter, over that pixel; and the difference of the means over the mean.
fn differences(test: &Image, reference: &Image) -> [f64; 3] {
    let count = reference.pixels.len() as f64;
    let mean = reference.pixels.iter().map(|p| f64::from(p.luminance())).sum::<f64>() / count;
    let (mut missed, mut worst, mut signed) = (0.0, 0.0_f64, 0.0);
    for (a, b) in test.pixels.iter().zip(&reference.pixels) {
        let (a, b) = (f64::from(a.luminance()), f64::from(b.luminance()));
        missed += (a - b).abs();
        worst = worst.max((a - b).abs() / mean.max(b));
        signed += a - b;
    }
    [missed / (count * mean), worst, signed / (count * mean)]
}

/// What `differences` it makes to shade fragments when the picture is put together, and not when they are drawn.
fn late_and_at_once(gpu: &Gpu, look: &str, source: ShadingSource, multiple: bool) -> [f64; 3] {
    let text = format!(
        r#"
[camera]
position = [5.0, -2.0, 40.0]
target = [0.0, -5.0, 0.0]
fov_deg = 16.0

[[light]]
type = "point"
position = [30.0, 20.0, 30.0]
intensity = 3000.0

[[light]]
type = "point"
position = [-12.0, 5.0, -30.0]
intensity = 1000.0

[[mesh]]
shape = {{ sphere = {{ center = [1.0, -5.0, 0.0], radius = 2.0 }} }}

[[groom]]
file = "hair"
look = "main"

[look.main]
{look}
"#
    );
    // From two pixels wide at the root to a seventh of one at the tip.
    let mut groom = curtain(900, 5, 8.0, 10.0, 0.1);
    groom.set_radius_profile(|u| 0.15 - 0.14 * u).expect("positive");
    let scene = scene(groom, &text);
    let mut settings = Settings { transparency: Transparency::ABuffer { foremost: None }, ..Settings::default() };
    settings.shading.source = source;
    settings.shading.multiple = multiple.then(crate::DualScattering::default);
    settings.shadow.resolution = 256;
    let mut renderer = Renderer::new(gpu, scene.clone(), &settings).unwrap_or_else(|error| panic!("{error}"));
    let [late, at_once] = [ShadingTime::Deferred, ShadingTime::Forward].map(|when| {
        settings.shading.when = when;
        renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
        renderer.draw(&scene.camera, [96, 80]).unwrap_or_else(|error| panic!("{error}"));
        renderer.image().unwrap_or_else(|error| panic!("{error}"))
    });
    let covered = at_once.alpha.iter().flatten().filter(|&&a| a > 0.5).count();
    assert!(covered > 2000, "{covered} pixels: the test says nothing");
    let [mean, worst, bias] = differences(&late, &at_once);
    println!("{look:?}: mean {:.3} %, worst {:.2} %, bias {:+.3} %", 100.0 * mean, 100.0 * worst, 100.0 * bias);
    [mean, worst, bias]
}

/// Where the offset across the fiber does not count, eight bytes a fragment are as good as all that is known of it.
#[test]
fn shading_late_is_shading_at_once() {
    let gpu = gpu();
    for (look, multiple) in [
        ("model = \"chiang\"\nabsorption = [0.1, 0.2, 0.4]", true),
        ("model = \"marschner\"\nabsorption = [0.1, 0.2, 0.4]", false),
        ("model = \"sadeghi\"", false),
    ] {
        let [mean, worst, _] = late_and_at_once(&gpu, look, ShadingSource::Tables, multiple);
        assert!(mean < 0.005 && worst < 0.05, "{look}: mean {mean}, worst {worst}");
    }
}

/// In the near field the offset is an azimuth, next to lobes of a few degrees: eleven bits of it.
#[test]
fn shading_the_near_field_late_is_nearly_shading_at_once() {
    let gpu = gpu();
    let look = "model = \"chiang\"\nfield = \"near\"\nabsorption = [0.1, 0.2, 0.4]";
    let [mean, _, bias] = late_and_at_once(&gpu, look, ShadingSource::Direct, false);
    assert!(mean < 0.01 && bias.abs() < 0.002, "mean {mean}, bias {bias}");
}
