//! The same light as the path tracer, where both can know it exactly.

use film::{Film, Image};
use groom::Groom;
use math::Vec3;
use trace::{SimdLevel, Tracer};

use super::{gpu, scene};
use crate::{Renderer, Settings, ShadingSource, ShadingTime, ShadowTechnique, Transparency};

/// Strands side by side, none in front of another, lit and seen from the front.
fn fence() -> Groom {
    let (strands, points) = (24_u32, 9_u32);
    let mut all = Vec::new();
    for strand in 0..strands {
        for i in 0..points {
            let (x, s) = (strand as f32 * 0.45 - 5.2, i as f32 / (points - 1) as f32);
            // Bowed, so that the inclinations of light and view vary.
            all.push(Vec3::new(x + 0.1 * (5.0 * s).sin(), 5.0 - 10.0 * s, 3.0 * (s - 0.5).powi(2)));
        }
    }
    let mut groom = Groom::new(all, vec![points; strands as usize]).expect("counts fit");
    groom.set_radius(vec![0.02; (strands * points) as usize]).expect("one each");
    groom
}

fn text(look: &str) -> String {
    format!(
        r#"
[camera]
position = [3.0, 2.0, 40.0]
target = [0.0, 0.0, 0.0]
fov_deg = 17.0

[film]
width = 96
height = 96
filter = "box"
filter_width_px = 1.0

[render]
samples = 96
integrator = "direct"

[[light]]
type = "point"
position = [-8.0, 12.0, 50.0]
intensity = 3000.0

[[groom]]
file = "hair"
look = "main"

[look.main]
{look}
"#
    )
}

/// How much finer the interactive picture is: a strand a third of a pixel wide is then several, and how its edge is
/// rounded to pixels does not matter.
const FINER: u32 = 4;

/// Sum of differences over the sum of values, over blocks of 8 by 8 pixels of the reference, and the same with signs.
fn block_error(test: &Image, reference: &Image) -> [f64; 2] {
    let (mut missed, mut whole, mut signed) = (0.0, 0.0, 0.0);
    for by in 0..reference.height / 8 {
        for bx in 0..reference.width / 8 {
            let mean = |image: &Image, side: u32| {
                let pixels = (0..side * side).map(|i| image.at(side * bx + i % side, side * by + i / side));
                pixels.map(|p| f64::from(p.luminance())).sum::<f64>() / f64::from(side * side)
            };
            let (a, b) = (mean(test, 8 * FINER), mean(reference, 8));
            missed += (a - b).abs();
            signed += a - b;
            whole += b;
        }
    }
    [missed / whole, signed / whole]
}

#[test]
fn direct_light_is_that_of_the_path_tracer() {
    let gpu = gpu();
    // The far field where there is a choice: the near one has the same mean over a strand's width, and needs a hundred
    // times the samples.
    for (look, source) in [
        ("model = \"marschner\"\nabsorption = [0.2, 0.35, 0.6]", ShadingSource::Tables),
        ("model = \"marschner\"\nabsorption = [0.2, 0.35, 0.6]", ShadingSource::Direct),
        ("model = \"deon\"\nfield = \"far\"\nabsorption = [0.2, 0.35, 0.6]", ShadingSource::Tables),
        ("model = \"deon\"\nfield = \"far\"\nabsorption = [0.2, 0.35, 0.6]", ShadingSource::Direct),
        ("model = \"chiang\"\nfield = \"far\"\nabsorption = [0.2, 0.35, 0.6]", ShadingSource::Tables),
        ("model = \"chiang\"\nfield = \"far\"\nabsorption = [0.2, 0.35, 0.6]", ShadingSource::Direct),
        ("model = \"kajiya_kay\"", ShadingSource::Direct),
        ("model = \"sadeghi\"", ShadingSource::Direct),
    ] {
        let scene = scene(fence(), &text(look));
        let tracer = Tracer::new(scene.clone(), SimdLevel::default());
        let mut film = Film::new(scene.film.width, scene.film.height).expect("a small film");
        tracer.render(&mut film, 0, scene.render.samples, &std::sync::atomic::AtomicBool::new(false));
        let reference = film.image();

        let mut settings = Settings { transparency: Transparency::ABuffer { foremost: None }, ..Settings::default() };
        settings.shadow.technique = ShadowTechnique::None;
        settings.shading.multiple = None;
        settings.shading.source = source;
        settings.geometry.subdivisions = 4;
        settings.supersample = 4;
        for when in [ShadingTime::Forward, ShadingTime::Deferred] {
            settings.shading.when = when;
            let mut renderer = Renderer::new(&gpu, scene.clone(), &settings).unwrap_or_else(|error| panic!("{error}"));
            renderer.draw(&scene.camera, [96 * FINER; 2]).unwrap_or_else(|error| panic!("{error}"));
            let image = renderer.image().unwrap_or_else(|error| panic!("{error}"));
            let [error, bias] = block_error(&image, &reference);
            println!("{look:?} {source:?} {when:?}: error {error:.4}, bias {bias:+.4}");
            assert!(error < 0.03, "{look} {source:?} {when:?}: {error}");
        }
    }
}
