//! Odd sizes, full buffers, poor adapters and lost devices: messages, not panics.

use std::fmt::Debug;
use std::sync::Arc;

use film::Image;
use groom::Groom;
use scene::{Camera, Scene};

use super::{curtain, gpu, gpu_of, scene};
use crate::{
    DepthShift, Gpu, GpuError, GpuOptions, KPlusForm, Kind, RasterError, Renderer, Report, Settings, ShadingTime,
    ShadowTechnique, Shape, Sort, Tier, Transparency,
};

const SIZE: [u32; 2] = [48, 40];

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

/// Settings that leave out what takes long to make.
fn plain(transparency: Transparency) -> Settings {
    let mut settings = Settings { transparency, ..Settings::default() };
    settings.shadow.technique = ShadowTechnique::None;
    settings.shading.multiple = None;
    settings.shading.table_size = 16;
    settings
}

/// A renderer whose first frame is drawn.
fn drawn(gpu: &Gpu, scene: &Arc<Scene>, settings: &Settings) -> (Renderer, Report) {
    let mut renderer =
        Renderer::new(gpu, scene.clone(), settings).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
    let report = renderer.draw(&scene.camera, SIZE).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
    (renderer, report)
}

fn image(renderer: &Renderer) -> Image {
    renderer.image().unwrap_or_else(|error| panic!("{error}"))
}

/// Whether there is light on hair, and nothing that is no number.
fn shows_hair(image: &Image) -> bool {
    let covered = image.alpha.as_deref().unwrap_or(&[]).iter().filter(|&&a| a > 0.3).count();
    let light: f32 = image.pixels.iter().map(|p| p.luminance()).sum();
    image.pixels.iter().all(|p| p.is_finite()) && covered > 200 && light > 1.0
}

/// The largest difference between two pictures, as a share of the largest number in the first. Not a number where
/// either has one that is not.
fn difference(a: &Image, b: &Image) -> f32 {
    assert_eq!([a.width, a.height], [b.width, b.height]);
    let numbers = |image: &Image| -> Vec<f32> {
        let alpha = image.alpha.iter().flatten().copied();
        image.pixels.iter().flat_map(|pixel| pixel.0).chain(alpha).collect()
    };
    let (a, b) = (numbers(a), numbers(b));
    let largest = a.iter().copied().fold(0.0, f32::max);
    a.iter().zip(&b).map(|(a, b)| (a - b).abs() / largest).max_by(f32::total_cmp).unwrap_or(0.0)
}

#[test]
fn every_technique_draws_on_the_limits_of_the_web() {
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
            let report = renderer.draw(&scene.camera, SIZE).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
            assert_eq!(report.fragments.dropped, 0, "{settings:?}");
            // Without timers there are no times, and the table says so.
            assert!(report.spans.iter().all(|span| span.ms.is_none()), "{settings:?}");
            assert!(report.total_bytes() > 0 && report.table().contains("fragments stored"));
            assert!(shows_hair(&image(&renderer)), "{settings:?}");
            drawn += 1;
        }
    }
    assert_eq!(drawn, 26);
}

/// What a browser promises, with what the user gets without a word. Sums there are halves, rounded after each of some
/// eighty fibers: by 2⁻¹² on average, to either side, which leaves the mean far within 5 %.
#[test]
fn the_default_settings_draw_on_a_device_of_the_web() {
    let scene = scene(curtain(400, 5, 6.0, 10.0, 0.05), SCENE);
    let [web, native] = [Tier::Web, Tier::Native].map(|tier| {
        let gpu = gpu_of(tier);
        let (renderer, report) = drawn(&gpu, &scene, &Settings::default());
        assert_eq!(report.fragments.dropped, 0);
        assert!(report.spans.iter().all(|span| span.ms.is_some() == gpu.has_timestamps()), "{:?}", report.spans);
        let image = image(&renderer);
        assert!(shows_hair(&image));
        image.pixels.iter().map(|p| p.luminance()).sum::<f32>()
    });
    assert!((web / native - 1.0).abs() < 0.05, "{web} and {native}");
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
    // Samples count; and of what was refused there is no picture.
    let most = gpu.largest_side();
    renderer.set(&Settings { supersample: 2, ..Settings::default() }).expect("it is within its range");
    let refused = renderer.draw(&scene.camera, [most, 8]).err();
    assert_eq!(refused, Some(RasterError::Size { size: [2 * most, 16], most }));
    assert_eq!(renderer.image().err(), Some(RasterError::NotDrawn));
    renderer.draw(&scene.camera, [8, 8]).expect("this size is one");
    assert_eq!([image(&renderer).width, image(&renderer).height], [8, 8]);
}

/// Settings of the next frame are not those of the last one.
#[test]
fn a_picture_stays_what_it_is_until_the_next_is_drawn() {
    let gpu = gpu();
    let scene = scene(curtain(400, 5, 6.0, 10.0, 0.05), SCENE);
    let mut settings = plain(Transparency::Opaque);
    let (mut renderer, _) = drawn(&gpu, &scene, &settings);
    let before = image(&renderer);
    settings.supersample = 2;
    renderer.set(&settings).expect("it is within its range");
    assert!(image(&renderer) == before);
    // With another model everything is made anew, but not the picture.
    settings.shading.model = Some(Kind::KajiyaKay);
    renderer.set(&settings).expect("every fiber has such a one");
    assert!(image(&renderer) == before);
    renderer.draw(&scene.camera, SIZE).expect("a small picture");
    let after = image(&renderer);
    assert_eq!([after.width, after.height], SIZE);
    assert!(after != before);
}

/// More models than a shader has room for, unless one is chosen for all.
#[test]
fn what_cannot_be_set_leaves_what_was() {
    let gpu = gpu();
    let (head, _) = SCENE.split_once("[[groom]]").expect("there is a groom");
    let models = ["chiang", "lambertian", "kajiya_kay", "hery"];
    let grooms = models.map(|model| format!("[[groom]]\nfile = \"hair\"\nlook = \"{model}\"\n"));
    let looks = models.map(|model| format!("[look.{model}]\nmodel = \"{model}\"\n"));
    let text = [head, &grooms.join("\n"), &looks.join("\n")].join("\n");
    let scene = scene(curtain(100, 5, 6.0, 10.0, 0.1), &text);
    let mut settings = plain(Transparency::Opaque);
    let fails = Renderer::new(&gpu, scene.clone(), &settings).err();
    assert!(matches!(fails, Some(RasterError::TooManyModels { .. })), "{fails:?}");

    settings.shading.model = Some(Kind::Chiang);
    let (mut renderer, _) = drawn(&gpu, &scene, &settings);
    let before = image(&renderer);
    let mut several = settings;
    several.shading.model = None;
    for _ in 0..2 {
        let fails = renderer.set(&several).err();
        assert!(matches!(fails, Some(RasterError::TooManyModels { .. })), "{fails:?}");
        assert!(*renderer.settings() == settings && image(&renderer) == before);
    }
    let beyond = Settings { supersample: 5, ..settings };
    assert!(matches!(renderer.set(&beyond), Err(RasterError::Setting(_))));
    assert!(*renderer.settings() == settings && image(&renderer) == before);
    renderer.draw(&scene.camera, SIZE).expect("nothing has changed");
    assert!(image(&renderer) == before);
    // And on to something that can be.
    settings.shading.model = Some(Kind::Lambertian);
    renderer.set(&settings).expect("one model for all");
    renderer.draw(&scene.camera, SIZE).expect("a small picture");
    assert!(image(&renderer) != before);
}

#[test]
fn an_aperture_that_is_ignored_is_spoken_of() {
    let gpu = gpu();
    let scene = scene(curtain(10, 3, 6.0, 10.0, 0.05), SCENE);
    let (mut renderer, report) = drawn(&gpu, &scene, &plain(Transparency::Opaque));
    let wide = Camera { aperture_radius: 0.5, ..scene.camera };
    let noted = renderer.draw(&wide, SIZE).expect("a small picture").notes;
    assert_eq!(noted.len(), report.notes.len() + 1);
    assert!(noted.iter().any(|note| note.contains("aperture")), "{noted:?}");
}

#[test]
fn a_million_strands_are_drawn() {
    let gpu = gpu();
    let scene = scene(curtain(1_000_000, 2, 6.0, 1.0, 0.002), SCENE);
    let mut renderer = Renderer::new(&gpu, scene.clone(), &plain(Transparency::Opaque)).expect("it fits");
    let report = renderer.draw(&scene.camera, [32, 32]).expect("a small picture");
    // 16 and 8 bytes a point, 4 a segment.
    assert_eq!(report.bytes("strands"), 2_000_000 * (16 + 8) + 1_000_000 * 4);
    // The roots' square, 6 by 1 units where a pixel is 0.44, is full of hair.
    let hidden = image(&renderer).alpha.unwrap_or_default().iter().filter(|&&a| a > 0.99).count();
    assert!((20..120).contains(&hidden), "{hidden} pixels");
}

/// Bindings of 16 KiB hold 1024 points: the strands come in a dozen parts. The picture comes back in parts as well.
#[test]
fn strands_that_do_not_fit_into_one_binding_are_the_same_strands() {
    let gpu = gpu();
    let scene = scene(curtain(2000, 6, 6.0, 10.0, 0.05), SCENE);
    let settings = Settings { transparency: Transparency::Opaque, ..Settings::default() };
    let (whole, report) = drawn(&gpu, &scene, &settings);
    assert!(report.memory.iter().any(|one| one.name == "points" && one.bytes > 10 * (16 << 10)));
    let (parts, _) = drawn(&gpu.confined(16 << 10), &scene, &settings);
    assert!(image(&parts) == image(&whole));
}

/// Bindings of 64 KiB hold 8192 fragments of a list, or 1008 pixels with eight slots each.
#[test]
fn a_picture_in_bands_is_the_same_picture() {
    let gpu = gpu();
    let scene = scene(curtain(1500, 6, 8.0, 10.0, 0.03), SCENE);
    for transparency in [
        Transparency::ABuffer { foremost: None },
        Transparency::ABuffer { foremost: Some(8) },
        Transparency::KPlus { k: 8, form: KPlusForm::LockFree },
        Transparency::Dbk { shift: DepthShift::default() },
    ] {
        let settings = plain(transparency);
        let (whole, one) = drawn(&gpu, &scene, &settings);
        let (parts, several) = drawn(&gpu.confined(64 << 10), &scene, &settings);
        let cut = |report: &Report| report.spans.iter().any(|span| span.pass.ends_with("band 2"));
        assert!(!cut(&one) && cut(&several), "{transparency:?}: {:?} and {:?}", one.spans, several.spans);
        assert_eq!(one.fragments, several.fragments, "{transparency:?}");
        assert_eq!(several.fragments.dropped, 0, "{transparency:?}");
        // Two fragments at one depth are blended in any order, and halves have steps of 5e-4.
        let off = difference(&image(&whole), &image(&parts));
        assert!(off < 1e-3, "{transparency:?}: {off}");
    }
}

/// Hair of which sixty fragments lie in each pixel: lists begin with room for eight, or for four.
#[test]
fn what_found_no_room_is_drawn_again() {
    let gpu = gpu();
    let scene = scene(curtain(4000, 3, 6.0, 10.0, 0.05), SCENE);
    for (transparency, first) in
        [(Transparency::ABuffer { foremost: None }, 8), (Transparency::Dbk { shift: DepthShift::Fixed(1e3) }, 4)]
    {
        let mut settings = plain(transparency);
        settings.shadow.technique = ShadowTechnique::DOM;
        settings.shadow.resolution = 64;
        let (mut renderer, report) = drawn(&gpu, &scene, &settings);
        assert!(report.attempts > 1, "{transparency:?}");
        assert!(report.fragments.stored > first * 48 * 40, "{transparency:?}: {:?}", report.fragments);
        assert_eq!(report.fragments.dropped, 0, "{transparency:?}");
        let before = image(&renderer);
        let again = renderer.draw(&scene.camera, SIZE).expect("a small picture");
        assert_eq!((again.attempts, again.fragments), (1, report.fragments), "{transparency:?}");
        assert!(difference(&before, &image(&renderer)) < 1e-3, "{transparency:?}");
        // Shadows are drawn, and counted, once.
        let shadows = |report: &Report| report.spans.iter().filter(|span| span.owner == "dom").count();
        assert_eq!((shadows(&report), shadows(&again)), (3, 3), "{transparency:?}");
        assert_eq!(report.spans.len(), again.spans.len(), "{transparency:?}");

        // Bindings of 2 KiB hold 256 fragments, and no row of the picture has so few.
        let mut renderer = Renderer::new(&gpu.confined(2 << 10), scene.clone(), &settings).expect("the strands fit");
        match renderer.draw(&scene.camera, SIZE) {
            Err(RasterError::Overflow { dropped, .. }) => assert!(dropped > 0),
            other => panic!("{transparency:?}: {other:?}"),
        }
        assert_eq!(renderer.image().err(), Some(RasterError::NotDrawn));
        settings.transparency = Transparency::Opaque;
        renderer.set(&settings).expect("there is always another way");
        renderer.draw(&scene.camera, SIZE).expect("it keeps nothing");
    }
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

/// Every way into the library, each of them the first to meet the loss.
#[test]
fn a_lost_device_is_said_so() {
    fn lost<T: Debug>(what: &str, answer: Result<T, RasterError>) {
        match answer {
            Err(RasterError::Gpu(GpuError::Lost(_))) => {}
            other => panic!("{what}: {other:?}"),
        }
    }
    let scene = scene(curtain(10, 3, 6.0, 10.0, 0.05), SCENE);
    let settings = plain(Transparency::Opaque);
    // Something to be made, in place and as a whole.
    let mut other = settings;
    other.shadow.technique = ShadowTechnique::DOM;
    other.geometry.shape = Shape::Line;
    other.transparency = Transparency::ABuffer { foremost: None };
    let mut whole = settings;
    whole.shading.model = Some(Kind::KajiyaKay);
    for first in 0..5 {
        let gpu = gpu();
        let (mut renderer, _) = drawn(&gpu, &scene, &settings);
        gpu.lose();
        match first {
            0 => lost("image", renderer.image()),
            1 => lost("draw", renderer.draw(&scene.camera, SIZE)),
            2 => lost("set", renderer.set(&other)),
            3 => lost("set to another model", renderer.set(&whole)),
            _ => lost("new", Renderer::new(&gpu, scene.clone(), &settings)),
        }
        // And it stays lost.
        lost("set afterwards", renderer.set(&other));
        lost("draw afterwards", renderer.draw(&scene.camera, SIZE));
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
