//! Fragments that techniques keep, against passes that only count, and pictures against the fully sorted one.

use std::sync::Arc;

#[cfg(feature = "flip")]
use film::Comparison;
#[cfg(feature = "flip")]
use scene::NoAssets;
use scene::Scene;

use super::{curtain, gpu, scene};
use crate::frame::cleared;
use crate::gpu::Gpu;
use crate::settings::Shape;
use crate::stage::{Context, HairPass, target, texture_2d};
use crate::transparency::Technique;
use crate::transparency::a_buffer::ABuffer;
use crate::transparency::k_plus::KPlus;
#[cfg(feature = "flip")]
use crate::{DepthShift, Sort, Transparency};
use crate::{KPlusForm, Renderer, Settings, ShadingTime, ShadowTechnique};

const SIZE: [u32; 2] = [96, 80];

const SCENE: &str = r#"
[camera]
position = [0.0, -5.0, 40.0]
target = [0.0, -5.0, 0.0]
fov_deg = 20.0

[[light]]
type = "point"
position = [30.0, 20.0, 30.0]
intensity = 3000.0

[[mesh]]
shape = { sphere = { center = [2.0, -5.0, 0.0], radius = 1.5 } }

[[groom]]
file = "hair"
look = "main"

[look.main]
model = "chiang"
"#;

/// Hair with a ball in it.
fn renderer(gpu: &Gpu, settings: &Settings) -> (Arc<Scene>, Renderer) {
    let scene = scene(curtain(1500, 6, 8.0, 10.0, 0.03), SCENE);
    let renderer = Renderer::new(gpu, scene.clone(), settings).unwrap_or_else(|error| panic!("{error}"));
    (scene, renderer)
}

fn plain() -> Settings {
    let mut settings = Settings::default();
    settings.shadow.technique = ShadowTechnique::None;
    settings.shading.multiple = None;
    settings.shading.when = ShadingTime::Deferred;
    settings
}

/// Draws with a technique until nothing is dropped.
fn draw(renderer: &mut Renderer, scene: &Scene, gpu: &Gpu, technique: &mut dyn Technique) -> u64 {
    for _ in 0..6 {
        technique.resize(gpu, SIZE);
        renderer
            .compose(&scene.camera, SIZE, &mut |context, frame| technique.record(context, frame))
            .unwrap_or_else(|error| panic!("{error}"));
        let fragments = technique.fragments(gpu).unwrap_or_else(|error| panic!("{error}"));
        if fragments.dropped == 0 {
            return fragments.stored;
        }
    }
    panic!("there is never room enough");
}

/// Per pixel: number of fragments, sum of depths, sum of alphas, by additive blending of 32-bit floats.
fn sums(renderer: &mut Renderer, scene: &Scene, gpu: &Gpu) -> Vec<[f32; 4]> {
    const PART: &str = "
@fragment
fn count_fragments(v: HairVertex) -> @location(0) vec4f {
    if view_hidden(v.clip) {
        discard;
    }
    let f = hair_fragment(v);
    return vec4f(1.0, f.depth, f.alpha, 0.0);
}
";
    let format = wgpu::TextureFormat::Rgba32Float;
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let texture = gpu.device.create_texture(&texture_2d("sums", SIZE, 1, format, usage));
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let mut count = |context: &Context<'_>, frame: &mut crate::frame::Frame| {
        let pipeline = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "test: count",
                part: PART,
                fragment: "count_fragments",
                shades: false,
                technique: None,
                targets: &[target(format, Some(wgpu::BlendState { color: add, alpha: add }))],
                depth: None,
                shape: Shape::Ribbon,
            },
        );
        let mut pass = frame.render("test", "count", &[cleared(&view, wgpu::Color::TRANSPARENT)], None);
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        context.hair.draw(&mut pass, crate::strands::Part::All);
    };
    renderer.compose(&scene.camera, SIZE, &mut count).unwrap_or_else(|error| panic!("{error}"));
    let bytes = gpu.fetch_texture(&texture, 0, wgpu::TextureAspect::All).unwrap_or_else(|error| panic!("{error}"));
    bytemuck::pod_collect_to_vec(&bytes)
}

#[test]
fn lists_hold_every_fragment() {
    let gpu = gpu();
    let (scene, mut renderer) = renderer(&gpu, &plain());
    let mut technique = ABuffer::new(&gpu, None);
    let stored = draw(&mut renderer, &scene, &gpu, &mut technique);
    let lists = technique.lists(&gpu, SIZE).unwrap_or_else(|error| panic!("{error}"));
    let sums = sums(&mut renderer, &scene, &gpu);
    assert_eq!(lists.len(), sums.len());
    let mut longest = 0;
    for (i, (list, sum)) in lists.iter().zip(&sums).enumerate() {
        assert_eq!(list.len() as f32, sum[0], "pixel {i}");
        let depths: f64 = list.iter().map(|node| f64::from(f32::from_bits(node.0))).sum();
        // Sums of n numbers of one size in any order: n roundings of the sum.
        let n = list.len() as f64;
        assert!((depths - f64::from(sum[1])).abs() <= n * 6e-8 * depths.max(1.0), "pixel {i}: {depths} {sum:?}");
        longest = longest.max(list.len());
    }
    assert_eq!(stored, lists.iter().map(|list| list.len() as u64).sum::<u64>());
    assert!(longest > 20 && stored > 20_000, "{longest} {stored}: the test has too little hair");
}

#[test]
fn k_plus_keeps_the_nearest() {
    let gpu = gpu();
    let (scene, mut renderer) = renderer(&gpu, &plain());
    let mut all = ABuffer::new(&gpu, None);
    draw(&mut renderer, &scene, &gpu, &mut all);
    let lists = all.lists(&gpu, SIZE).unwrap_or_else(|error| panic!("{error}"));
    for (k, form) in [
        (8, KPlusForm::LockFree),
        (1, KPlusForm::LockFree),
        (16, KPlusForm::LockFree),
        (8, KPlusForm::MaxArray),
        (8, KPlusForm::MaxHeap),
        (5, KPlusForm::MaxHeap),
    ] {
        let mut technique = KPlus::new(&gpu, k, form);
        draw(&mut renderer, &scene, &gpu, &mut technique);
        let slots = technique.slots(&gpu, SIZE).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(slots.len(), lists.len());
        let mut full = 0;
        for (i, (slots, list)) in slots.iter().zip(&lists).enumerate() {
            let mut nearest = list.clone();
            nearest.sort_unstable();
            nearest.truncate(k as usize);
            let depths = |nodes: &[(u32, [u32; 2])]| nodes.iter().map(|node| node.0).collect::<Vec<_>>();
            assert_eq!(depths(slots), depths(&nearest), "pixel {i}, k = {k}, {form:?}");
            for (j, (got, want)) in slots.iter().zip(&nearest).enumerate() {
                // Where two fragments lie at exactly one depth, either may be the one that is kept.
                let tied = list.iter().filter(|node| node.0 == want.0).count() > 1;
                assert!(tied || got.1 == want.1, "pixel {i}, slot {j}, k = {k}, {form:?}: {got:?} {want:?}");
            }
            full += usize::from(list.len() > k as usize);
        }
        assert!(full > 1000, "{full} pixels have more than {k}");
    }
}

/// Hair of a real head, 50,000 strands, under one light.
#[cfg(feature = "flip")]
fn head(preset: &str) -> Arc<Scene> {
    let text = format!(
        r#"
[scene]
unit_m = 0.01

[camera]
orbit = {{ target = [0.0, -6.5, 0.0], distance = 112.0, azimuth_deg = 46.0, elevation_deg = 5.0 }}
fov_deg = 23.0

[[light]]
type = "distant"
direction = [-0.4, -0.6, -1.0]
irradiance = 3.0

[[mesh]]
builtin = "head"
albedo = 0.12

[[groom]]
procedural = {{ preset = "{preset}", strands = 50000, points = 12, seed = 1 }}
look = "main"

[look.main]
model = "marschner"
eumelanin = 0.5
"#
    );
    Arc::new(Scene::load(&text, &[], &NoAssets).unwrap_or_else(|error| panic!("{error}")))
}

/// Bytes of what a technique keeps per fragment, and of where its lists begin.
#[cfg(feature = "flip")]
fn node_bytes(report: &crate::Report) -> u64 {
    let nodes = report.memory.iter().filter(|one| ["heads", "links", "payloads"].contains(&one.name.as_str()));
    nodes.map(|one| one.bytes).sum()
}

/// The claim of the DBK-buffer, with the shift found automatically: nearly the picture of the full A-buffer, from less
/// than half the memory. And how far the other techniques are, on one of the grooms.
#[cfg(feature = "flip")]
#[test]
fn techniques_come_as_near_to_the_full_sort_as_is_said() {
    let gpu = gpu();
    let size = [160, 200];
    for preset in ["straight", "wavy_long", "curly"] {
        let scene = head(preset);
        let mut settings = Settings::default();
        settings.shading.multiple = None;
        settings.transparency = Transparency::ABuffer { foremost: None };
        let mut renderer = Renderer::new(&gpu, scene.clone(), &settings).unwrap_or_else(|error| panic!("{error}"));
        let mut picture = |transparency| {
            settings.transparency = transparency;
            renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
            if matches!(transparency, Transparency::ABuffer { foremost: None } | Transparency::Dbk { .. }) {
                // The second frame has buffers of the right size.
                renderer.draw(&scene.camera, size).unwrap_or_else(|error| panic!("{error}"));
            }
            let report = renderer.draw(&scene.camera, size).unwrap_or_else(|error| panic!("{error}"));
            (renderer.image().unwrap_or_else(|error| panic!("{error}")), report)
        };
        let (reference, full) = picture(Transparency::ABuffer { foremost: None });
        // Limits of FLIP: about half as much again as was found.
        let mut cases = vec![(Transparency::Dbk { shift: DepthShift::default() }, 0.02)];
        if preset == "wavy_long" {
            cases.extend([
                (Transparency::KPlus { k: 16, form: KPlusForm::LockFree }, 0.06),
                (Transparency::ABuffer { foremost: Some(16) }, 0.06),
                (Transparency::RandomSubsets { k: 8 }, 0.1),
                (Transparency::Blend { sort: Sort::Pieces }, 0.02),
                (Transparency::Blend { sort: Sort::Strands }, 0.03),
                (Transparency::Weighted, 0.06),
            ]);
        }
        for (transparency, most) in cases {
            let (image, report) = picture(transparency);
            let comparison = Comparison::at_exposure(&image, &reference, scene.film.exposure_ev)
                .unwrap_or_else(|error| panic!("{error}"));
            let flip = comparison.flip.expect("tests are built with FLIP");
            let share = node_bytes(&report) as f64 / node_bytes(&full) as f64;
            println!(
                "{preset} {}: FLIP {flip:.4}, {} fragments of {}, memory {share:.3}",
                transparency.name(),
                report.fragments.stored,
                full.fragments.stored,
            );
            assert!(flip < most, "{preset}, {transparency:?}: FLIP {flip}");
            if matches!(transparency, Transparency::Dbk { .. }) {
                assert!(share < 0.45, "{preset}: {share} of the A-buffer's memory");
            }
        }
    }
}
