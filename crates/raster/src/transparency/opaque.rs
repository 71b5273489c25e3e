//! The nearest fragment, as if it were opaque.
//!
//! *Theory:* none; it is what hair looks like without transparency. The thesis compares all shading models and both
//! shading times this way (its figure 33), since nothing else is in the way of the measurement. Coverage is ignored: a
//! ribbon that is widened to a pixel hides the pixel, so fine hair looks too wide and too hard.
//!
//! *Resources:* a depth buffer (4 bytes a pixel), written by the hair pass. Deferred shading also has the nearest
//! fragment's payload and linear depth (12 bytes a pixel), which a pass over all pixels shades. Both are used by other
//! techniques: see [`Nearest`].
//!
//! *Rejected:* starting from a copy of the depth of what is solid, so that the hardware tests against both. It is a
//! copy of the whole buffer per frame, and one load per fragment does the same.

use crate::frame::{Frame, cleared, depth, kept};
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::settings::{Settings, ShadingTime};
use crate::stage::{
    COLOR, Context, DEPTH, HairPass, OVER, ScreenPass, depth_test, entry, target, texture, texture_2d, texture_bytes,
};
use crate::strands::Part;
use crate::transparency::Technique;

const OWNER: &str = "opaque";
const HAIR: &str = include_str!("../../shaders/transparency/opaque.wgsl");
const RESOLVE: &str = include_str!("../../shaders/transparency/opaque_resolve.wgsl");

/// Format of what is kept of a fragment until it is shaded; `fragment_payload` of `shade.wgsl` packs it.
pub(crate) const PAYLOAD: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Format of linear depth, scene units; 0 where there is no hair.
pub(crate) const LINEAR: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// A texture that passes draw into and others load from.
#[derive(Debug)]
pub(crate) struct Layer {
    pub(crate) texture: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
}

impl Layer {
    pub(crate) fn new(gpu: &Gpu, label: &'static str, size: [u32; 2], format: wgpu::TextureFormat) -> Self {
        Self::layers(gpu, label, size, 1, format)
    }

    /// Several of them; `view` shows all.
    fn layers(gpu: &Gpu, label: &'static str, size: [u32; 2], layers: u32, format: wgpu::TextureFormat) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let texture = gpu.device.create_texture(&texture_2d(label, size, layers, format, usage));
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view }
    }

    /// What it takes up.
    pub(crate) fn memory(&self, owner: &'static str, name: &str) -> Allocation {
        Allocation { owner, name: name.to_owned(), bytes: texture_bytes(&self.texture) }
    }
}

/// A texture that is loaded from texel by texel, as a binding.
pub(crate) fn loaded(
    binding: u32,
    sample_type: wgpu::TextureSampleType,
    dimension: wgpu::TextureViewDimension,
) -> wgpu::BindGroupLayoutEntry {
    entry(binding, wgpu::ShaderStages::FRAGMENT, texture(sample_type, dimension))
}

/// Sample type of textures that no sampler filters.
pub(crate) const PLAIN: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

/// Draws a triangle over all pixels onto the picture; `shading` is group 2, if the pipeline has it.
pub(crate) fn draw_screen(
    context: &Context<'_>,
    frame: &mut Frame,
    [owner, pass]: [&'static str; 2],
    pipeline: &wgpu::RenderPipeline,
    shading: Option<&wgpu::BindGroup>,
    technique: &wgpu::BindGroup,
) {
    let mut pass = frame.render(owner, pass, &[kept(&context.targets.color_view)], None);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, context.view_group, &[]);
    if let Some(shading) = shading {
        pass.set_bind_group(2, shading, &[]);
    }
    pass.set_bind_group(3, technique, &[]);
    pass.draw(0..3, 0..1);
}

/// The nearest fragment of each pixel, in one or more layers: payload and linear depth.
#[derive(Debug)]
pub(crate) struct Nearest {
    pub(crate) payloads: Layer,
    pub(crate) depths: Layer,
    /// Payload and depth of each layer alone, to draw into.
    single: Vec<[wgpu::TextureView; 2]>,
    /// Depth buffer of the layer that is being drawn.
    pub(crate) test: Layer,
}

impl Nearest {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2], layers: u32) -> Self {
        let payloads = Layer::layers(gpu, "nearest payloads", size, layers, PAYLOAD);
        let depths = Layer::layers(gpu, "nearest depths", size, layers, LINEAR);
        let single = (0..layers)
            .map(|layer| {
                [&payloads, &depths].map(|all| {
                    all.texture.create_view(&wgpu::TextureViewDescriptor {
                        dimension: Some(wgpu::TextureViewDimension::D2),
                        base_array_layer: layer,
                        array_layer_count: Some(1),
                        ..wgpu::TextureViewDescriptor::default()
                    })
                })
            })
            .collect();
        Self { payloads, depths, single, test: Layer::new(gpu, "nearest test", size, DEPTH) }
    }

    /// What a pass that fills a layer draws into; in this order.
    pub(crate) fn targets() -> [Option<wgpu::ColorTargetState>; 2] {
        [target(PAYLOAD, None), target(LINEAR, None)]
    }

    /// Begins a pass that fills a layer, which is emptied first.
    pub(crate) fn begin<'f>(
        &self,
        frame: &'f mut Frame,
        owner: &'static str,
        pass: String,
        layer: usize,
    ) -> wgpu::RenderPass<'f> {
        let colors = self.single[layer].each_ref().map(|view| cleared(view, wgpu::Color::TRANSPARENT));
        frame.render(owner, pass, &colors, Some(depth(&self.test.view, true)))
    }

    /// Fills a layer with the nearest fragments of a part of the hair.
    pub(crate) fn gather(
        &self,
        context: &Context<'_>,
        frame: &mut Frame,
        owner: &'static str,
        name: String,
        layer: usize,
        part: Part,
    ) {
        let pipeline = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "opaque gather",
                part: HAIR,
                fragment: "opaque_gather",
                shades: true,
                technique: None,
                targets: &Self::targets(),
                depth: Some(depth_test(true)),
                shape: context.settings.geometry.shape,
            },
        );
        let mut pass = self.begin(frame, owner, name, layer);
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        pass.set_bind_group(2, context.shading_group, &[]);
        context.hair.draw(&mut pass, part);
    }

    /// What it takes up.
    pub(crate) fn memory(&self, owner: &'static str) -> Vec<Allocation> {
        vec![
            self.payloads.memory(owner, "nearest payloads"),
            self.depths.memory(owner, "nearest depths"),
            self.test.memory(owner, "depth test"),
        ]
    }
}

/// What the technique keeps for one size of picture.
#[derive(Debug)]
enum Room {
    Forward(Layer),
    Deferred(Box<Nearest>),
}

/// See the head of this file.
#[derive(Debug)]
pub(crate) struct Opaque {
    when: ShadingTime,
    layout: wgpu::BindGroupLayout,
    size: [u32; 2],
    room: Option<Room>,
}

impl Opaque {
    pub(crate) fn new(gpu: &Gpu, settings: &Settings) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("opaque"),
            entries: &[
                loaded(0, wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
                loaded(1, PLAIN, wgpu::TextureViewDimension::D2),
            ],
        });
        Self { when: settings.shading.when, layout, size: [0, 0], room: None }
    }

    fn forward(context: &Context<'_>, frame: &mut Frame, test: &Layer) {
        let pipeline = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "opaque forward",
                part: HAIR,
                fragment: "opaque_forward",
                shades: true,
                technique: None,
                targets: &[target(COLOR, None)],
                depth: Some(depth_test(true)),
                shape: context.settings.geometry.shape,
            },
        );
        let colors = [kept(&context.targets.color_view)];
        let mut pass = frame.render(OWNER, "hair", &colors, Some(depth(&test.view, true)));
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        pass.set_bind_group(2, context.shading_group, &[]);
        context.hair.draw(&mut pass, Part::All);
    }

    fn deferred(&self, context: &Context<'_>, frame: &mut Frame, nearest: &Nearest) {
        nearest.gather(context, frame, OWNER, "hair".to_owned(), 0, Part::All);
        let pipeline = context.stage.screen(
            context.gpu,
            &ScreenPass {
                label: "opaque resolve",
                part: RESOLVE,
                fragment: "opaque_resolve",
                shades: true,
                technique: Some(&self.layout),
                targets: &[target(COLOR, Some(OVER))],
                depth: None,
            },
        );
        let group = context.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("opaque"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&nearest.payloads.view),
                },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&nearest.depths.view) },
            ],
        });
        draw_screen(context, frame, [OWNER, "shade"], &pipeline, Some(context.shading_group), &group);
    }
}

impl Technique for Opaque {
    fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        if self.room.is_none() || self.size != size {
            self.size = size;
            self.room = Some(match self.when {
                ShadingTime::Forward => Room::Forward(Layer::new(gpu, "nearest test", size, DEPTH)),
                ShadingTime::Deferred => Room::Deferred(Box::new(Nearest::new(gpu, size, 1))),
            });
        }
    }

    fn record(&mut self, context: &Context<'_>, frame: &mut Frame) {
        match &self.room {
            Some(Room::Forward(test)) => Self::forward(context, frame, test),
            Some(Room::Deferred(nearest)) => self.deferred(context, frame, nearest),
            None => {}
        }
    }

    fn fragments(&mut self, _gpu: &Gpu) -> Result<Fragments, GpuError> {
        Ok(Fragments::default())
    }

    fn memory(&self) -> Vec<Allocation> {
        match &self.room {
            Some(Room::Forward(test)) => vec![test.memory(OWNER, "depth test")],
            Some(Room::Deferred(nearest)) => nearest.memory(OWNER),
            None => Vec::new(),
        }
    }
}

/// What tests put in the place of strands and shading: texts of techniques are checked without either.
#[cfg(test)]
pub(crate) mod stubs {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    use crate::stage::{FRAGMENT, FRAME, SCREEN};

    const HAIR: &str = "
        struct HairVertex { @builtin(position) @invariant clip: vec4f, @location(0) alpha: f32 }
        fn hair_fragment(v: HairVertex) -> Fragment {
            var f: Fragment;
            f.depth = v.clip.w;
            f.alpha = v.alpha;
            return f;
        }";
    const SHADE: &str = "
        fn shade(f: Fragment) -> vec3f { return f.position; }
        fn fragment_payload(f: Fragment) -> vec2u { return vec2u(bitcast<u32>(f.alpha), f.entry); }
        fn payload_alpha(payload: vec2u) -> f32 { return bitcast<f32>(payload.x); }
        fn payload_color(payload: vec2u, pixel: vec2f, depth: f32) -> vec4f {
            return vec4f(view_position(pixel, depth), payload_alpha(payload));
        }";

    fn module(text: &str) -> naga::Module {
        let module =
            naga::front::wgsl::parse_str(text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
        // Nothing beyond what every WebGPU device has.
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        if let Err(error) = validator.validate(&module) {
            panic!("{}", error.emit_to_string(text));
        }
        module
    }

    /// Holds the text of a technique against what its passes rely on: it is valid, has these entry points and no
    /// others, keeps its bindings in group 3, and takes no more storage buffers than group 2 leaves.
    fn check(text: &str, part: &str, entry_points: &[&str]) {
        let module = module(text);
        let found: Vec<&str> = module
            .entry_points
            .iter()
            .filter(|entry| entry.stage == naga::ShaderStage::Fragment)
            .map(|entry| entry.name.as_str())
            .collect();
        assert_eq!(found, entry_points);
        let bound = |group| {
            module
                .global_variables
                .iter()
                .filter(move |(_, global)| global.binding.as_ref().is_some_and(|binding| binding.group == group))
        };
        assert_eq!(bound(3).count(), part.matches("@binding").count(), "all bindings of a technique are in group 3");
        let buffers = bound(3).filter(|(_, global)| matches!(global.space, naga::AddressSpace::Storage { .. })).count();
        assert!(buffers <= 4, "{buffers} storage buffers; shading takes up to 4 of 8");
    }

    /// Checks the text of a pass that draws strands.
    pub(crate) fn check_hair(part: &str, shades: bool, entry_points: &[&str]) {
        let shading = if shades { SHADE } else { "" };
        check(&[FRAME, FRAGMENT, HAIR, shading, part].join("\n"), part, entry_points);
    }

    /// Checks the text of a pass over all pixels.
    pub(crate) fn check_screen(part: &str, shades: bool, entry_points: &[&str]) {
        let shading = if shades { SHADE } else { "" };
        check(&[FRAME, FRAGMENT, SCREEN, shading, part].join("\n"), part, entry_points);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_shaders_are_valid() {
        stubs::check_hair(HAIR, true, &["opaque_forward", "opaque_gather"]);
        stubs::check_screen(RESOLVE, true, &["opaque_resolve"]);
    }
}
