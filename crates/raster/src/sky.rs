//! What the camera sees behind everything: constant radiance by clearing, images by a pass over all pixels.
//!
//! # Resources
//!
//! One `rgba16float` texture for all visible images together, if there are any. A single image keeps its texels and is
//! turned by the shader, so that the picture is the path tracer's up to half precision (and to 65504, its largest
//! number). Several images, or one that is too large, are sampled anew.

use bytemuck::{Pod, Zeroable, bytes_of, cast_slice};
use fiber::table::to_half;
use math::{Rgb, Vec3};
use rayon::prelude::*;
use wgpu::util::DeviceExt as _;

use crate::frame::{Frame, cleared};
use crate::gpu::Gpu;
use crate::lights::{self, SkyLayer};
use crate::meter::Allocation;
use crate::stage::{COLOR, Context, ScreenPass, entry, target, texture, texture_2d, texture_bytes, uniform};

const OWNER: &str = "scene";

/// The shader.
pub(crate) const TEXT: &str = include_str!("../shaders/sky.wgsl");

/// Longest side of an image that is made anew, texels.
const MOST_SIDE: u32 = 2048;

/// Largest half-precision number.
const MOST: f64 = 65504.0;

/// Twin of `SkyPaint` in `shaders/sky.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct SkyPaint {
    base: [f32; 3],
    turn: f32,
}

/// An image of everything that is not constant.
#[derive(Clone, Debug, PartialEq)]
struct Picture {
    size: [u32; 2],
    /// Row by row from the zenith.
    texels: Vec<Rgb>,
    /// Radians about +y, counter-clockwise seen from above.
    rotation: f32,
}

/// The constant part of a sky, and the rest as one image with sides of at most `most` texels.
fn prepare(sky: &lights::Sky, most: u32) -> (Rgb, Option<Picture>) {
    let mut base = Rgb::black();
    let mut images = Vec::new();
    for layer in &sky.layers {
        match layer {
            SkyLayer::Constant(radiance) => base += *radiance,
            SkyLayer::Image { image, factor, rotation } => images.push((image, *factor, *rotation)),
        }
    }
    let picture = match images.as_slice() {
        [] => None,
        &[(image, factor, rotation)] if image.width <= most && image.height <= most => Some(Picture {
            size: [image.width, image.height],
            texels: image.pixels.iter().map(|&texel| texel * factor).collect(),
            rotation,
        }),
        _ => {
            let most = most.min(MOST_SIDE);
            let finest = images.iter().fold([1, 1], |[w, h], (image, ..)| [image.width.max(w), image.height.max(h)]);
            let size = finest.map(|side| side.min(most));
            // Enough samples a texel that none of a finer image is passed by; more than 8 by 8 would take long.
            let samples: [u32; 2] = std::array::from_fn(|axis| finest[axis].div_ceil(size[axis]).min(8));
            let constant = base;
            let texels = (0..size[0] * size[1]).into_par_iter().map(|i| {
                let (x, y) = (i % size[0], i / size[0]);
                let mut sum = Rgb::black();
                for (i, j) in (0..samples[0] * samples[1]).map(|k| (k % samples[0], k / samples[0])) {
                    let u = (x as f32 + (i as f32 + 0.5) / samples[0] as f32) / size[0] as f32;
                    let v = (y as f32 + (j as f32 + 0.5) / samples[1] as f32) / size[1] as f32;
                    sum += sky.radiance(direction(u, v)) - constant;
                }
                // What is left of a black texel may be rounding below 0.
                (sum / (samples[0] * samples[1]) as f32).map(|x| x.max(0.0))
            });
            Some(Picture { size, texels: texels.collect(), rotation: 0.0 })
        }
    };
    (base, picture)
}

/// The direction of a place in a lat-long image that is not turned: `u` to the right, `v` down, both in `[0, 1]`.
fn direction(u: f32, v: f32) -> Vec3 {
    let (sin, cos) = (std::f32::consts::PI * v).sin_cos();
    let (across, along) = (std::f32::consts::TAU * u).sin_cos();
    Vec3::new(sin * across, cos, -sin * along)
}

/// An image on the device.
#[derive(Debug)]
struct Painted {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    texture: wgpu::Texture,
}

/// The background.
#[derive(Debug)]
pub(crate) struct Sky {
    base: Rgb,
    painted: Option<Painted>,
}

impl Sky {
    /// Uploads what the camera sees of a scene's environments.
    pub(crate) fn new(gpu: &Gpu, sky: &lights::Sky) -> Self {
        let (base, picture) = prepare(sky, gpu.largest_side());
        Self { base, painted: picture.map(|picture| paint(gpu, base, &picture)) }
    }

    /// Begins the picture: the sky, with alpha 0.
    pub(crate) fn record(&self, context: &Context<'_>, frame: &mut Frame) {
        let [r, g, b] = self.base.0.map(|x| f64::from(x).min(MOST));
        let clear = wgpu::Color { r, g, b, a: 0.0 };
        let mut pass = frame.render(OWNER, "sky", &[cleared(&context.targets.color_view, clear)], None);
        let Some(painted) = &self.painted else { return };
        let pipeline = context.stage.screen(
            context.gpu,
            &ScreenPass {
                label: "sky",
                part: TEXT,
                fragment: "sky_fragment",
                shades: false,
                technique: Some(&painted.layout),
                targets: &[target(COLOR, None)],
                depth: None,
            },
        );
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        pass.set_bind_group(3, &painted.group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// What is kept on the device.
    pub(crate) fn memory(&self) -> Vec<Allocation> {
        let image = self.painted.iter().map(|painted| texture_bytes(&painted.texture));
        image.map(|bytes| Allocation { owner: OWNER, name: "sky".to_owned(), bytes }).collect()
    }
}

fn paint(gpu: &Gpu, base: Rgb, picture: &Picture) -> Painted {
    let texels: Vec<[u16; 4]> =
        picture.texels.iter().map(|texel| [texel[0], texel[1], texel[2], 1.0].map(to_half)).collect();
    let usage = wgpu::TextureUsages::TEXTURE_BINDING;
    let description = texture_2d("sky", picture.size, 1, wgpu::TextureFormat::Rgba16Float, usage);
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let sky = gpu.device.create_texture_with_data(&gpu.queue, &description, order, cast_slice(&texels));
    let numbers = SkyPaint { base: base.0, turn: picture.rotation / std::f32::consts::TAU };
    let numbers = gpu.buffer("sky", bytes_of(&numbers), wgpu::BufferUsages::UNIFORM);
    let seen_by = wgpu::ShaderStages::FRAGMENT;
    let image = texture(wgpu::TextureSampleType::Float { filterable: true }, wgpu::TextureViewDimension::D2);
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("sky"),
        entries: &[entry(0, seen_by, uniform()), entry(1, seen_by, image)],
    });
    let view = sky.create_view(&wgpu::TextureViewDescriptor::default());
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("sky"),
        layout: &layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: numbers.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
        ],
    });
    Painted { layout, group, texture: sky }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use math::{hash, warp};
    use scene::EnvironmentImage;

    use super::*;

    /// Smooth waves.
    fn waves(width: u32, height: u32, waves: f32) -> Arc<EnvironmentImage> {
        let pixels = (0..width * height).map(|i| {
            let u = ((i % width) as f32 + 0.5) / width as f32;
            let v = ((i / width) as f32 + 0.5) / height as f32;
            // Nothing happens at the poles, where all columns meet.
            let x = 2.0 + (std::f32::consts::TAU * waves * u).sin() * (std::f32::consts::PI * v).sin();
            Rgb::new(x, 0.5 * x, 3.0)
        });
        Arc::new(EnvironmentImage { width, height, pixels: pixels.collect() })
    }

    /// `sky_radiance` of the shader.
    fn seen(base: Rgb, picture: &Picture, d: Vec3) -> Rgb {
        let [w, h] = picture.size.map(|side| side as i32);
        let azimuth = d.x.atan2(-d.z);
        let turned = azimuth / std::f32::consts::TAU + picture.rotation / std::f32::consts::TAU;
        let u = turned - turned.floor();
        let v = d.x.hypot(d.z).atan2(d.y) / std::f32::consts::PI;
        let (x, y) = (u * w as f32 - 0.5, v * h as f32 - 0.5);
        let (s, t) = (x - x.floor(), y - y.floor());
        let texel = |x: i32, y: i32| picture.texels[(y.clamp(0, h - 1) * w + (x + w) % w) as usize];
        let (x, y) = (x.floor() as i32, y.floor() as i32);
        let row = |y: i32| texel(x, y) * (1.0 - s) + texel(x + 1, y) * s;
        base + row(y) * (1.0 - t) + row(y + 1) * t
    }

    fn probes() -> impl Iterator<Item = Vec3> {
        (0..2000).map(|i| warp::uniform_sphere([hash::unit(i, 1), hash::unit(i, 2)]))
    }

    #[test]
    fn a_single_image_is_what_the_lights_have() {
        let image = waves(48, 24, 3.0);
        let layer = SkyLayer::Image { image: Arc::clone(&image), factor: Rgb::new(0.5, 2.0, 1.0), rotation: -1.3 };
        let constant = Rgb::new(0.25, 0.0, 1.0);
        let sky = lights::Sky { layers: vec![layer, SkyLayer::Constant(constant)] };
        let (base, picture) = prepare(&sky, 64);
        let picture = picture.unwrap();
        assert_eq!((base, picture.size, picture.rotation), (constant, [48, 24], -1.3));
        for d in probes() {
            let (found, expected) = (seen(base, &picture, d), sky.radiance(d));
            // A slope of about one a texel times the error of an angle in single precision.
            let off = (found - expected).map(f32::abs).max_channel();
            assert!(off < 1e-4, "{d}: {found:?} and {expected:?}");
        }
    }

    #[test]
    fn several_images_become_their_sum_and_large_ones_smaller() {
        let layer = |image, rotation| SkyLayer::Image { image, factor: Rgb::white(), rotation };
        let two = vec![
            SkyLayer::Constant(Rgb::splat(0.5)),
            layer(waves(256, 128, 2.0), 0.4),
            layer(waves(200, 130, 1.0), -2.0),
        ];
        let one = vec![layer(waves(512, 256, 2.0), 0.4)];
        for (layers, size) in [(two, [256, 130]), (one, [256, 256])] {
            let sky = lights::Sky { layers };
            let (base, picture) = prepare(&sky, 256);
            let picture = picture.unwrap();
            assert_eq!((picture.size, picture.rotation), (size, 0.0));
            for d in probes() {
                let (found, expected) = (seen(base, &picture, d), sky.radiance(d));
                // Two interpolations and a mean over a texel of waves with at least 100 texels: each is off by less
                // than (2π / 100)² / 8 of the amplitude. Next to the poles a texel is many degrees wide.
                let off = (found - expected).map(f32::abs).max_channel();
                let limit = if d.y.abs() > 0.995 { 0.1 } else { 5e-3 };
                assert!(off < limit, "{d}: {found:?} and {expected:?}");
            }
        }
    }

    #[test]
    fn no_image_means_no_picture() {
        let sky = lights::Sky { layers: vec![SkyLayer::Constant(Rgb::white()), SkyLayer::Constant(Rgb::white())] };
        assert_eq!(prepare(&sky, 64), (Rgb::splat(2.0), None));
    }

    #[test]
    fn the_shader_is_valid_and_its_numbers_lie_where_they_are_put() {
        let text = [crate::stage::FRAME, crate::stage::SCREEN, TEXT].join("\n");
        let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        let flags = naga::valid::ValidationFlags::all();
        let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        let (_, twin) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("SkyPaint")).unwrap();
        let naga::TypeInner::Struct { members, span } = &twin.inner else { panic!("not a structure") };
        let theirs: Vec<(&str, u32)> = members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset)).collect();
        let ours = [
            ("base", std::mem::offset_of!(SkyPaint, base) as u32),
            ("turn", std::mem::offset_of!(SkyPaint, turn) as u32),
        ];
        assert_eq!((theirs.as_slice(), *span), (ours.as_slice(), size_of::<SkyPaint>() as u32));
    }
}
