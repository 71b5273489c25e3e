//! Odd sizes, full buffers, poor adapters and lost devices: messages, not panics.

use std::sync::Arc;

use groom::Groom;

use super::{curtain, gpu, gpu_of, scene};
use crate::{
    DepthShift, GpuError, GpuOptions, KPlusForm, RasterError, Renderer, Settings, ShadingTime, ShadowTechnique, Shape,
    Sort, Tier, Transparency,
};

/// A curtain of hair in front of a camera, under a point light.
const SCENE: &str = r#"
[camera]
position = [0.0, -5.0, 40.0]
target = [0.0, -5.0, 0.0]
fov_deg = 20.0

[film]
width = 48
height = 40

[[light]]
type = "point"
position = [30.0, 20.0, 30.0]
intensity = 3000.0

[[groom]]
file = "hair"
look = "main"

[look.main]
model = "chiang"
"#;

/// Every way to put fragments together.
pub(super) const ALL: [Transparency; 13] = [
    Transparency::Opaque,
    Transparency::Blend { sort: Sort::None },
    Transparency::Blend { sort: Sort::Strands },
    Transparency::Blend { sort: Sort::Pieces },
    Transparency::Weighted,
    Transparency::ABuffer { foremost: None },
    Transparency::ABuffer { foremost: Some(8) },
    Transparency::KPlus { k: 8, form: KPlusForm::LockFree },
    Transparency::KPlus { k: 8, form: KPlusForm::MaxArray },
    Transparency::KPlus { k: 8, form: KPlusForm::MaxHeap },
    Transparency::Dbk { shift: DepthShift::Automatic { opacity: 0.99 } },
    Transparency::Dbk { shift: DepthShift::Fixed(1.0) },
    Transparency::RandomSubsets { k: 8 },
];

#[test]
fn every_combination_draws_on_the_limits_of_the_web() {
    let gpu = gpu_of(Tier::Bare);
    let scene = scene(curtain(400, 5, 6.0, 10.0, 0.05), SCENE);
    let mut renderer = Renderer::new(&gpu, scene.clone(), &Settings::default()).expect("a small scene");
    let techniques = [
        ShadowTechnique::None,
        ShadowTechnique::Map,
        ShadowTechnique::Adsm { spacing: None },
        ShadowTechnique::Osm,
        ShadowTechnique::DOM,
    ];
    let mut drawn = 0;
    for (i, transparency) in ALL.into_iter().enumerate() {
        for when in [ShadingTime::Forward, ShadingTime::Deferred] {
            let mut settings = Settings { transparency, ..Settings::default() };
            settings.shading.when = when;
            settings.shadow.technique = techniques[drawn % techniques.len()];
            settings.shadow.resolution = 64;
            settings.geometry.shape = if i % 3 == 0 { Shape::Line } else { Shape::Ribbon };
            renderer.set(&settings).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
            let report = renderer.draw(&scene.camera, [48, 40]).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
            assert_eq!(report.fragments.dropped, 0, "{settings:?}");
            // Without timers there are no times, and the table says so.
            assert!(report.spans.iter().all(|span| span.ms.is_none()), "{settings:?}");
            assert!(report.total_bytes() > 0 && report.table().contains("fragments stored"));
            let image = renderer.image().expect("something was drawn");
            let covered = image.alpha.as_deref().unwrap_or(&[]).iter().filter(|&&a| a > 0.3).count();
            let light: f32 = image.pixels.iter().map(|p| p.luminance()).sum();
            assert!(image.pixels.iter().all(|p| p.is_finite()), "{settings:?}");
            assert!(covered > 200 && light > 1.0, "{settings:?}: {covered} pixels, light {light}");
            drawn += 1;
        }
    }
    assert_eq!(drawn, 26);
}

#[test]
fn sizes_without_pixels_and_beyond_the_device_are_refused() {
    let gpu = gpu();
    let scene = scene(curtain(10, 3, 6.0, 10.0, 0.05), SCENE);
    let mut renderer = Renderer::new(&gpu, scene.clone(), &Settings::default()).expect("a small scene");
    assert_eq!(renderer.image().err(), Some(RasterError::NotDrawn));
    for size in [[0, 40], [48, 0], [0, 0], [1 << 20, 8], [u32::MAX, u32::MAX]] {
        match renderer.draw(&scene.camera, size) {
            Err(RasterError::Size { .. }) => {}
            other => panic!("{size:?}: {other:?}"),
        }
    }
    renderer.draw(&scene.camera, [1, 1]).expect("one pixel is a picture");
}

#[test]
fn a_groom_without_strands_is_a_picture_without_hair() {
    let gpu = gpu();
    let text = format!("{SCENE}\n[[mesh]]\nshape = {{ sphere = {{ radius = 3.0 }} }}\n");
    // A file cannot say so, but whoever edits a scene in memory can.
    let mut emptied = (*scene(curtain(1, 3, 6.0, 10.0, 0.05), &text)).clone();
    let mut nothing = Groom::new(Vec::new(), Vec::new()).expect("nothing is consistent");
    nothing.set_radius(Vec::new()).expect("one each");
    emptied.grooms[0].groom = Arc::new(nothing);
    let scene = Arc::new(emptied);
    for transparency in ALL {
        let settings = Settings { transparency, ..Settings::default() };
        let mut renderer = Renderer::new(&gpu, scene.clone(), &settings).expect("an empty groom");
        let report = renderer.draw(&scene.camera, [48, 40]).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
        assert_eq!(report.fragments, crate::Fragments::default(), "{settings:?}");
    }
}

#[test]
fn a_lost_device_is_said_so() {
    let gpu = gpu();
    let scene = scene(curtain(10, 3, 6.0, 10.0, 0.05), SCENE);
    let mut renderer = Renderer::new(&gpu, scene.clone(), &Settings::default()).expect("a small scene");
    renderer.draw(&scene.camera, [48, 40]).expect("the device is there");
    gpu.lose();
    match renderer.draw(&scene.camera, [48, 40]) {
        Err(RasterError::Gpu(GpuError::Lost(_))) => {}
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_adapter_that_is_not_there_is_named_beside_those_that_are() {
    let options = GpuOptions { adapter: Some("Voodoo 2".to_owned()), ..GpuOptions::default() };
    let message = crate::Gpu::new(&options).expect_err("none of that name").to_string();
    let there = crate::Gpu::adapters();
    assert!(message.contains("Voodoo 2"), "{message}");
    assert!(there.iter().all(|adapter| message.contains(&adapter.name)), "{message}");
}
