//! How much of the picture hair covers, and where, against the same strands projected here in double precision.

use groom::Groom;
use math::{Affine3A, DVec3, Vec3, hash, warp};
use scene::Camera;

use super::{curtain, gpu, scene};
use crate::frame::{Frame, cleared};
use crate::gpu::Gpu;
use crate::settings::Shape;
use crate::stage::{Context, HairPass, target, texture_2d};
use crate::strands::Part;
use crate::{Renderer, Settings, ShadowTechnique, Transparency};

/// Pixels a side of all pictures.
const SIDE: u32 = 128;

/// A long lens: at the edges of the picture a band that faces the eye looks as wide as one that faces the picture, to
/// 0.2 %.
const DISTANCE: f32 = 160.0;
const FOV_DEG: f32 = 5.0;

/// Size of a pixel at the origin, scene units.
fn pixel() -> f32 {
    2.0 * DISTANCE * (0.5 * FOV_DEG).to_radians().tan() / SIDE as f32
}

/// A scene of `hair` whose strands run between their points as `basis` says, and of whatever else.
fn text(basis: &str, more: &str) -> String {
    format!(
        r#"
[camera]
position = [0.0, 0.0, {DISTANCE:?}]
target = [0.0, 0.0, 0.0]
fov_deg = {FOV_DEG:?}

[render]
curve_basis = "{basis}"

[[light]]
type = "distant"
direction = [0.0, 0.0, -1.0]
irradiance = 1.0

[[groom]]
file = "hair"
look = "main"

[look.main]
model = "kajiya_kay"

{more}
"#
    )
}

/// Nothing but geometry.
fn plain() -> Settings {
    let mut settings = Settings { transparency: Transparency::Opaque, ..Settings::default() };
    settings.shadow.technique = ShadowTechnique::None;
    settings.shading.multiple = None;
    settings
}

/// A renderer of this hair, and the camera of its scene.
fn renderer(gpu: &Gpu, groom: Groom, text: &str) -> (Renderer, Camera) {
    let scene = scene(groom, text);
    let camera = scene.camera;
    (Renderer::new(gpu, scene, &plain()).unwrap_or_else(|error| panic!("{error}")), camera)
}

/// Per pixel: how many fragments there are, the sum of their alphas, the sum of their depths; and of the one that lies
/// farthest from where its pixel and its depth say that it is, by how many pixels.
fn fragments(gpu: &Gpu, renderer: &mut Renderer, camera: &Camera) -> Vec<[f32; 4]> {
    const PART: &str = "
@fragment
fn count_coverage(v: HairVertex) -> @location(0) vec4f {
    if view_hidden(v.clip) {
        discard;
    }
    let f = hair_fragment(v);
    let off = distance(view_position(v.clip.xy, f.depth), f.position) / view_pixel(f.depth);
    return vec4f(1.0, f.alpha, f.depth, off);
}
";
    let format = wgpu::TextureFormat::Rgba32Float;
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let texture = gpu.device.create_texture(&texture_2d("coverage", [SIDE; 2], 1, format, usage));
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let both = |operation| wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation,
    };
    let blend = wgpu::BlendState { color: both(wgpu::BlendOperation::Add), alpha: both(wgpu::BlendOperation::Max) };
    let mut draw = |context: &Context<'_>, frame: &mut Frame| {
        let pipeline = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "test: coverage",
                part: PART,
                fragment: "count_coverage",
                shades: false,
                technique: None,
                targets: &[target(format, Some(blend))],
                depth: None,
                shape: context.hair.shape,
            },
        );
        let mut pass = frame.render("test", "coverage", &[cleared(&view, wgpu::Color::TRANSPARENT)], None);
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        context.hair.draw(&mut pass, Part::All);
    };
    renderer.compose(camera, [SIDE; 2], &mut draw).unwrap_or_else(|error| panic!("{error}"));
    let bytes = gpu.fetch_texture(&texture, 0, wgpu::TextureAspect::All).unwrap_or_else(|error| panic!("{error}"));
    bytemuck::pod_collect_to_vec(&bytes)
}

/// Distance of two places of the picture.
fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Sum of a channel over all pixels.
fn sum(pixels: &[[f32; 4]], channel: usize) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel[channel])).sum()
}

/// Centre of the pixel with this number.
fn center(index: usize) -> [f64; 2] {
    [(index % SIDE as usize) as f64 + 0.5, (index / SIDE as usize) as f64 + 0.5]
}

/// A pinhole camera that shares nothing with `View`.
struct Pinhole {
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Pixels per unit at depth 1.
    scale: f64,
}

impl Pinhole {
    fn new(camera: &Camera) -> Self {
        let eye = camera.position.as_dvec3();
        let forward = (camera.target.as_dvec3() - eye).normalize();
        let right = forward.cross(camera.up.as_dvec3()).normalize();
        let scale = 0.5 * f64::from(SIDE) / (0.5 * f64::from(camera.fov_y)).tan();
        Self { eye, right, up: right.cross(forward), forward, scale }
    }

    /// Where in the picture a point is, and how many pixels a unit has there.
    fn see(&self, p: DVec3) -> ([f64; 2], f64) {
        let away = p - self.eye;
        let scale = self.scale / away.dot(self.forward);
        let middle = 0.5 * f64::from(SIDE);
        ([middle + scale * away.dot(self.right), middle - scale * away.dot(self.up)], scale)
    }

    /// Distance of a point from the line of sight through a place of the picture.
    fn passes(&self, [x, y]: [f64; 2], p: DVec3) -> f64 {
        let middle = 0.5 * f64::from(SIDE);
        let ray = self.forward * self.scale + self.right * (x - middle) - self.up * (y - middle);
        (p - self.eye).cross(ray.normalize()).length()
    }
}

/// The Catmull-Rom curve between points `i` and `i + 1`, which goes on straight beyond its ends.
fn between(points: &[DVec3], i: usize, t: f64) -> DVec3 {
    let (b, c) = (points[i], points[i + 1]);
    let a = if i == 0 { 2.0 * b - c } else { points[i - 1] };
    let d = if i + 2 == points.len() { 2.0 * c - b } else { points[i + 2] };
    let cubic = 3.0 * (b - c) + d - a;
    let square = 2.0 * a - 5.0 * b + 4.0 * c - d;
    b + 0.5 * t * ((c - a) + t * (square + t * cubic))
}

/// What each strand covers of the picture, pixels²: length times diameter, summed over 32 pieces of every span.
fn areas(groom: &Groom, camera: &Camera) -> Vec<f64> {
    const PIECES: u32 = 32;
    let pinhole = Pinhole::new(camera);
    let radii = groom.radius.as_deref().expect("the hair has radii");
    let area = |strand: usize| {
        let points: Vec<DVec3> = groom.strand(strand).iter().map(|p| p.as_dvec3()).collect();
        let radii: Vec<f64> = groom.point_range(strand).map(|i| f64::from(radii[i])).collect();
        let mut sum = 0.0;
        for i in 0..points.len() - 1 {
            let place = |piece: f64| pinhole.see(between(&points, i, piece / f64::from(PIECES)));
            for piece in (0..PIECES).map(f64::from) {
                let (from, to) = (place(piece).0, place(piece + 1.0).0);
                let t = (piece + 0.5) / f64::from(PIECES);
                let diameter = 2.0 * (radii[i] + (radii[i + 1] - radii[i]) * t) * place(piece + 0.5).1;
                sum += apart(from, to) * diameter;
            }
        }
        sum
    };
    (0..groom.strand_count()).map(area).collect()
}

/// Straight strands of one length in all directions, a third as thick at the tip as at the root; all in the picture.
fn needles(strands: u32, points: u32, radius: f32) -> Groom {
    let mut all = Vec::new();
    for strand in 0..strands {
        let at = |dim| hash::signed(strand, dim);
        let middle = 3.3 * Vec3::new(at(1), at(2), at(3));
        let along = 6.0 * warp::uniform_sphere([hash::unit(strand, 4), hash::unit(strand, 5)]);
        all.extend((0..points).map(|i| middle + along * (i as f32 / (points - 1) as f32 - 0.5)));
    }
    let mut groom = Groom::new(all, vec![points; strands as usize]).expect("counts fit");
    groom.set_radius_profile(|u| radius * (1.0 - 2.0 / 3.0 * u)).expect("positive");
    groom
}

/// Two turns each of a flat spiral, by a twelfth of a turn from point to point, turned away from the eye by up to 40
/// degrees.
fn curls(strands: u32, radius: f32) -> Groom {
    let points = 25;
    let mut all = Vec::new();
    for strand in 0..strands {
        let at = |dim| hash::signed(strand, dim);
        let middle = 3.0 * Vec3::new(at(1), at(2), at(3));
        let (sin, cos) = (std::f32::consts::PI * at(4)).sin_cos();
        let (lift, level) = (40.0_f32.to_radians() * at(5)).sin_cos();
        let (u, v) = (Vec3::new(cos, sin, 0.0), Vec3::new(-sin * level, cos * level, lift));
        for i in 0..points {
            let share = i as f32 / (points - 1) as f32;
            let (sin, cos) = (4.0 * std::f32::consts::PI * share).sin_cos();
            all.push(middle + (u * cos + v * sin) * (1.0 + 0.2 * at(6) + 0.4 * share));
        }
    }
    let mut groom = Groom::new(all, vec![points; strands as usize]).expect("counts fit");
    groom.set_radius_profile(|u| radius * (1.0 - 2.0 / 3.0 * u)).expect("positive");
    groom
}

/// That `found` is `area` but for a share of `within`.
#[track_caller]
fn assert_near(what: &str, found: f64, area: f64, within: f64) {
    let off = found / area - 1.0;
    println!("{what}: {found:.1} of {area:.1} pixels, {:+.2} %", 100.0 * off);
    assert!(area > 500.0 && off.abs() < within, "{what}: {found} and not {area} pixels are covered");
}

/// Bands that are drawn a pixel wide because their strands are thinner, as opaque as their share of the pixel. How a
/// band's edge falls on pixels adds about half a pixel a strand, at random: 0.1 % here.
#[test]
fn thin_straight_strands_cover_their_area() {
    let gpu = gpu();
    let groom = needles(400, 4, 0.01);
    let (mut renderer, camera) = renderer(&gpu, groom.clone(), &text("catmull_rom", ""));
    let area: f64 = areas(&groom, &camera).iter().sum();
    assert_near("ribbons", sum(&fragments(&gpu, &mut renderer, &camera), 1), area, 0.02);

    let mut settings = plain();
    settings.geometry.opacity = 0.4;
    renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
    let found = sum(&fragments(&gpu, &mut renderer, &camera), 1);
    assert_near("ribbons of opacity 0.4", found, 0.4 * area, 0.02);

    // In all directions: devices differ by a fifth in how many pixels a slanted line has.
    settings.geometry.opacity = 1.0;
    settings.geometry.shape = Shape::Line;
    renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
    assert_near("lines", sum(&fragments(&gpu, &mut renderer, &camera), 1), area, 0.03);
}

/// Curls that bend by 30 degrees from point to point. Chords of such arcs are 1.1 % shorter; and as their bands meet at
/// the mean of two directions they would lose as much as another 3 %, if alpha did not make up for it.
#[test]
fn thin_bent_strands_cover_their_area() {
    let gpu = gpu();
    let groom = curls(200, 0.01);
    let (mut renderer, camera) = renderer(&gpu, groom.clone(), &text("catmull_rom", ""));
    let area: f64 = areas(&groom, &camera).iter().sum();
    for (subdivisions, within) in [(1, 0.02), (4, 0.01)] {
        let mut settings = plain();
        settings.geometry.subdivisions = subdivisions;
        renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
        let found = sum(&fragments(&gpu, &mut renderer, &camera), 1);
        assert_near(&format!("{subdivisions} pieces a span"), found, area, within);
    }
}

/// A tenth of the strands, ten times as wide, cover in the picture what all cover there as far as a random tenth looks
/// like all: these strands have the same area in space and another one on the screen, each by its direction.
#[test]
fn a_tenth_of_the_strands_covers_as_much_as_all() {
    const SHARE: f64 = 0.1;
    let gpu = gpu();
    let groom = needles(4000, 2, 0.0025);
    let (mut renderer, camera) = renderer(&gpu, groom.clone(), &text("catmull_rom", ""));
    let areas = areas(&groom, &camera);
    let count = areas.len() as f64;
    let area: f64 = areas.iter().sum();
    let variance = areas.iter().map(|one| (one * count / area - 1.0).powi(2)).sum::<f64>() / (count - 1.0);
    // Of the mean of a tenth, drawn without putting back.
    let deviation = (variance * (1.0 - SHARE) / (SHARE * count)).sqrt();
    assert!((0.005..0.02).contains(&deviation), "{deviation}: the test says nothing");
    let mut settings = plain();
    settings.geometry.strands = SHARE as f32;
    renderer.set(&settings).unwrap_or_else(|error| panic!("{error}"));
    // A random order would pass four deviations with probability 6e-5; this one is seeded. The rest is for pixels.
    let found = sum(&fragments(&gpu, &mut renderer, &camera), 1);
    assert_near("a tenth", found, area, 4.0 * deviation + 0.01);
}

#[test]
fn wide_strands_have_as_many_pixels_as_their_area() {
    let gpu = gpu();
    // From 3.7 pixels at the root to 1.2 at the tip.
    let groom = needles(60, 2, 0.2);
    let (mut renderer, camera) = renderer(&gpu, groom.clone(), &text("catmull_rom", ""));
    let area: f64 = areas(&groom, &camera).iter().sum();
    let pixels = fragments(&gpu, &mut renderer, &camera);
    assert_near("wide ribbons", sum(&pixels, 0), area, 0.02);
    // And all of them are opaque.
    assert!((sum(&pixels, 0) - sum(&pixels, 1)).abs() < 1e-4 * area);
}

/// Distance from a piece of a straight line.
fn distance([x, y]: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let (across, down) = (to[0] - from[0], to[1] - from[1]);
    let along = ((x - from[0]) * across + (y - from[1]) * down) / (across * across + down * down);
    let t = along.clamp(0.0, 1.0);
    apart([x, y], [from[0] + t * across, from[1] + t * down])
}

/// Bands of neighbouring pieces share an edge: no pixel belongs to both, and none between them to neither. The strands
/// turn by up to 70 degrees, so that a band is at least 0.8 times as wide at a bend as elsewhere, and nowhere wider.
#[test]
fn a_bent_strand_covers_no_pixel_twice_and_has_no_gaps() {
    const STRANDS: u32 = 6;
    const POINTS: u32 = 9;
    let gpu = gpu();
    let (mut all, mut radii) = (Vec::new(), Vec::new());
    let half_width = |strand: u32| if strand.is_multiple_of(2) { 0.05_f32 } else { 2.0 };
    for strand in 0..STRANDS {
        for i in 0..POINTS {
            let (x, y) = (10.0 * (i as f32 - 4.0), 13.0 * (strand as f32 - 2.5));
            all.push(Vec3::new(x, y + 3.5 * hash::signed(POINTS * strand + i, 7), 0.0) * pixel());
            radii.push(half_width(strand) * pixel());
        }
    }
    let mut groom = Groom::new(all, vec![POINTS; STRANDS as usize]).expect("counts fit");
    groom.set_radius(radii).expect("one each");
    let (mut renderer, mut camera) = renderer(&gpu, groom.clone(), &text("linear", ""));
    for roll in [0.0_f32, 0.5, 1.3] {
        camera.up = Vec3::new(roll.sin(), roll.cos(), 0.0);
        let pixels = fragments(&gpu, &mut renderer, &camera);
        let pinhole = Pinhole::new(&camera);
        let lines: Vec<Vec<[f64; 2]>> =
            groom.strands().map(|points| points.iter().map(|p| pinhole.see(p.as_dvec3()).0).collect()).collect();
        let (mut inside, mut outside) = (0, 0);
        for (i, pixel) in pixels.iter().enumerate() {
            let at = center(i);
            let (mut is_inside, mut is_outside) = (false, true);
            for (strand, line) in lines.iter().enumerate() {
                // A tenth of a pixel for what devices round corners to.
                let half = f64::from(half_width(strand as u32)).max(0.5);
                let away = line.windows(2).map(|ends| distance(at, ends[0], ends[1])).fold(f64::INFINITY, f64::min);
                let from_end = [line[0], line[line.len() - 1]].map(|end| apart(at, end));
                is_inside |= away < 0.8 * half - 0.1 && from_end.iter().all(|&away| away > half + 1.0);
                is_outside &= away > half + 0.1;
            }
            assert!(pixel[0] <= 1.0, "{at:?} is covered {} times, roll {roll}", pixel[0]);
            assert!(!is_inside || pixel[0] == 1.0, "{at:?} is not covered, roll {roll}");
            assert!(!is_outside || pixel[0] == 0.0, "{at:?} is covered, roll {roll}");
            inside += usize::from(is_inside);
            outside += usize::from(is_outside);
        }
        assert!(inside > 600 && outside > 10_000, "{inside} {outside}: the test says nothing");
    }
}

/// What deferred shading does: it keeps a fragment's depth, and finds its position again by its pixel.
#[test]
fn pixel_and_depth_are_the_position_again() {
    let gpu = gpu();
    let (mut renderer, camera) = renderer(&gpu, curls(200, 0.01), &text("catmull_rom", ""));
    // From near, so that pixels look into all directions.
    let near = Camera { position: Vec3::new(4.0, 3.0, 14.0), fov_y: 0.9, ..camera };
    let pixels = fragments(&gpu, &mut renderer, &near);
    let farthest = pixels.iter().map(|pixel| pixel[3]).fold(0.0, f32::max);
    println!("{farthest} pixels off");
    // GPUs round corners to 1/256 of a pixel before they interpolate between them; the software adapter interpolates
    // between the corners as they are.
    let limit = if gpu.description().software { 1e-3 } else { 5e-3 };
    assert!(farthest < limit, "{farthest} pixels off");
    assert!(sum(&pixels, 0) > 5000.0, "{}: the test says nothing", sum(&pixels, 0));
}

#[test]
fn hair_behind_a_mesh_is_not_there() {
    const CENTER: DVec3 = DVec3::new(0.7, -0.4, 4.0);
    const RADIUS: f64 = 2.5;
    let gpu = gpu();
    // Its nearest strands are 1.5 behind the origin, the ball is in front of it.
    let mut groom = curtain(1500, 4, 10.0, 10.0, 0.05);
    groom.transform(Affine3A::from_translation(Vec3::new(0.0, 5.0, -8.0)));
    let [x, y, z] = CENTER.to_array();
    let ball = format!("[[mesh]]\nshape = {{ sphere = {{ center = [{x:?}, {y:?}, {z:?}], radius = {RADIUS:?} }} }}\n");
    let (mut renderer, front) = renderer(&gpu, groom, &text("catmull_rom", &ball));
    let back = Camera { position: -front.position, ..front };
    for (camera, is_hidden) in [(front, true), (back, false)] {
        let pixels = fragments(&gpu, &mut renderer, &camera);
        let pinhole = Pinhole::new(&camera);
        // A pixel at the edge may be either's; the ball's triangles lie less than a hundredth of one inside of it.
        let margin = 1.0 / pinhole.see(CENTER).1;
        let (mut on, mut on_hair, mut beside, mut beside_hair) = (0, 0, 0, 0);
        for (i, pixel) in pixels.iter().enumerate() {
            let at = center(i);
            let away = pinhole.passes(at, CENTER);
            if away < RADIUS - margin {
                assert!(!is_hidden || pixel[0] == 0.0, "{} fragments shine through the ball at {at:?}", pixel[0]);
                on += 1;
                on_hair += u32::from(pixel[0] > 0.0);
            } else if away > RADIUS + margin && at.iter().all(|&x| (x - 64.0).abs() < 40.0) {
                beside += 1;
                beside_hair += u32::from(pixel[0] > 0.0);
            }
        }
        println!("hair in {on_hair} of {on} pixels of the ball, and in {beside_hair} of {beside} beside it");
        assert!(on > 1000 && beside > 1000 && 10 * beside_hair > 9 * beside);
        assert!(is_hidden || 10 * on_hair > 9 * on, "the ball is behind the hair, and hides it");
    }
}
