//! What all passes share: bind group layouts, shader text, pipelines, and the state of the frame.
//!
//! | group | holds | made by |
//! |---|---|---|
//! | 0 | the view, and the depth of what is solid | here |
//! | 1 | strands (vertex stage only) | `strands` |
//! | 2 | fibers, tables, lamps, shadow maps (fragment stage only) | `shade` |
//! | 3 | whatever a technique keeps | the technique |

use std::cell::RefCell;
use std::collections::BTreeMap;

use bytemuck::bytes_of;

use crate::gpu::Gpu;
use crate::settings::{Settings, Shape};
use crate::strands::Portion;
use crate::view::View;

/// Format of the picture while it is made: linear radiance, premultiplied; alpha is what hides the background.
pub(crate) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Format of depth buffers.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// WGSL files of this crate, by name.
pub(crate) const FRAME: &str = include_str!("../shaders/frame.wgsl");
pub(crate) const FRAGMENT: &str = include_str!("../shaders/fragment.wgsl");
pub(crate) const SCREEN: &str = include_str!("../shaders/screen.wgsl");
pub(crate) const STRANDS: &str = include_str!("../shaders/strands.wgsl");

/// Blending of premultiplied colours over what is there.
pub(crate) const OVER: wgpu::BlendState = wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING;

/// A colour target.
pub(crate) fn target(format: wgpu::TextureFormat, blend: Option<wgpu::BlendState>) -> Option<wgpu::ColorTargetState> {
    Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })
}

/// A depth test against a [`DEPTH`] attachment: nearer fragments pass.
pub(crate) fn depth_test(write: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(write),
        depth_compare: Some(wgpu::CompareFunction::Less),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

/// A pass that draws strands.
pub(crate) struct HairPass<'a> {
    /// Unique among all pipelines; what it is cached under, with `settings`.
    pub(crate) label: &'static str,
    /// WGSL of the technique.
    pub(crate) part: &'a str,
    /// Its fragment entry point; its argument is `HairVertex`.
    pub(crate) fragment: &'static str,
    /// Whether it calls functions of the shading text: group 2.
    pub(crate) shades: bool,
    /// Group 3.
    pub(crate) technique: Option<&'a wgpu::BindGroupLayout>,
    pub(crate) targets: &'a [Option<wgpu::ColorTargetState>],
    pub(crate) depth: Option<wgpu::DepthStencilState>,
    pub(crate) shape: Shape,
}

/// A pass over all pixels.
pub(crate) struct ScreenPass<'a> {
    /// Unique among all pipelines.
    pub(crate) label: &'static str,
    /// WGSL of the technique.
    pub(crate) part: &'a str,
    /// Its fragment entry point; its argument is `@builtin(position) at: vec4f`.
    pub(crate) fragment: &'static str,
    /// Whether it calls functions of the shading text: group 2.
    pub(crate) shades: bool,
    /// Group 3.
    pub(crate) technique: Option<&'a wgpu::BindGroupLayout>,
    pub(crate) targets: &'a [Option<wgpu::ColorTargetState>],
    pub(crate) depth: Option<wgpu::DepthStencilState>,
}

/// A pass that draws triangles from vertex buffers.
pub(crate) struct MeshPass<'a> {
    /// Unique among all pipelines.
    pub(crate) label: &'static str,
    /// Its WGSL.
    pub(crate) part: &'a str,
    pub(crate) vertex: &'static str,
    /// `None`: depth alone.
    pub(crate) fragment: Option<&'static str>,
    /// Whether it calls functions of the shading text: group 2.
    pub(crate) shades: bool,
    pub(crate) buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub(crate) targets: &'a [Option<wgpu::ColorTargetState>],
    pub(crate) depth: Option<wgpu::DepthStencilState>,
}

/// Layouts, texts and pipelines.
#[derive(Debug)]
pub(crate) struct Stage {
    pub(crate) view_layout: wgpu::BindGroupLayout,
    pub(crate) strands_layout: wgpu::BindGroupLayout,
    /// Group 2 and the text that reads it; see `shade`.
    pub(crate) shading_layout: wgpu::BindGroupLayout,
    shading_text: String,
    pipelines: RefCell<BTreeMap<&'static str, wgpu::RenderPipeline>>,
}

/// An entry of a bind group layout.
pub(crate) fn entry(binding: u32, visibility: wgpu::ShaderStages, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// A storage buffer.
pub(crate) fn storage(read_only: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A uniform buffer.
pub(crate) fn uniform() -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A sampled texture.
pub(crate) fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

impl Stage {
    pub(crate) fn new(gpu: &Gpu, shading_layout: wgpu::BindGroupLayout, shading_text: String) -> Self {
        let both = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let view_layout = layout(
            "view",
            &[
                entry(0, both, uniform()),
                entry(
                    1,
                    wgpu::ShaderStages::FRAGMENT,
                    texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2),
                ),
            ],
        );
        let strands_layout = layout("strands", &crate::strands::layout_entries());
        Self { view_layout, strands_layout, shading_layout, shading_text, pipelines: RefCell::default() }
    }

    /// Group 0: a view, and the depth of what is solid in it.
    pub(crate) fn view(&self, gpu: &Gpu, view: &View, solid: &wgpu::TextureView) -> wgpu::BindGroup {
        let buffer = gpu.buffer("view", bytes_of(view), wgpu::BufferUsages::UNIFORM);
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &self.view_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(solid) },
            ],
        })
    }

    /// The whole text of a pass that draws strands.
    fn hair_text(&self, part: &str, shades: bool) -> String {
        let shading = if shades { self.shading_text.as_str() } else { "" };
        [FRAME, FRAGMENT, STRANDS, shading, part].join("\n")
    }

    /// The whole text of a pass over all pixels.
    fn screen_text(&self, part: &str, shades: bool) -> String {
        let shading = if shades { self.shading_text.as_str() } else { "" };
        [FRAME, FRAGMENT, SCREEN, shading, part].join("\n")
    }

    /// The pipeline of a pass that draws strands; made when it is asked for the first time.
    pub(crate) fn hair(&self, gpu: &Gpu, pass: &HairPass<'_>) -> wgpu::RenderPipeline {
        let make = || {
            let (vertex, topology) = match pass.shape {
                Shape::Ribbon => ("hair_ribbon", wgpu::PrimitiveTopology::TriangleList),
                Shape::Line => ("hair_line", wgpu::PrimitiveTopology::LineList),
            };
            let layouts = [
                Some(&self.view_layout),
                Some(&self.strands_layout),
                pass.shades.then_some(&self.shading_layout),
                pass.technique,
            ];
            let text = self.hair_text(pass.part, pass.shades);
            let fragment = Some(pass.fragment);
            pipeline(gpu, pass.label, text, &layouts, vertex, topology, &[], fragment, pass.targets, &pass.depth)
        };
        self.pipelines.borrow_mut().entry(pass.label).or_insert_with(make).clone()
    }

    /// The pipeline of a pass over all pixels (`draw(0..3, 0..1)`).
    pub(crate) fn screen(&self, gpu: &Gpu, pass: &ScreenPass<'_>) -> wgpu::RenderPipeline {
        let make = || {
            let layouts = [Some(&self.view_layout), None, pass.shades.then_some(&self.shading_layout), pass.technique];
            let text = self.screen_text(pass.part, pass.shades);
            let topology = wgpu::PrimitiveTopology::TriangleList;
            let (vertex, fragment) = ("screen_vertex", Some(pass.fragment));
            pipeline(gpu, pass.label, text, &layouts, vertex, topology, &[], fragment, pass.targets, &pass.depth)
        };
        self.pipelines.borrow_mut().entry(pass.label).or_insert_with(make).clone()
    }

    /// The pipeline of a pass that draws triangles. Group 3 is not there.
    pub(crate) fn mesh(&self, gpu: &Gpu, pass: &MeshPass<'_>) -> wgpu::RenderPipeline {
        let make = || {
            let layouts = [Some(&self.view_layout), None, pass.shades.then_some(&self.shading_layout)];
            let shading = if pass.shades { self.shading_text.as_str() } else { "" };
            let text = [FRAME, FRAGMENT, shading, pass.part].join("\n");
            let (topology, fragment) = (wgpu::PrimitiveTopology::TriangleList, pass.fragment);
            let buffers = pass.buffers;
            pipeline(
                gpu,
                pass.label,
                text,
                &layouts,
                pass.vertex,
                topology,
                buffers,
                fragment,
                pass.targets,
                &pass.depth,
            )
        };
        self.pipelines.borrow_mut().entry(pass.label).or_insert_with(make).clone()
    }
}

/// A pipeline.
#[expect(clippy::too_many_arguments, reason = "it is where three descriptions meet")]
fn pipeline(
    gpu: &Gpu,
    label: &str,
    text: String,
    layouts: &[Option<&wgpu::BindGroupLayout>],
    vertex: &str,
    topology: wgpu::PrimitiveTopology,
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    fragment: Option<&str>,
    targets: &[Option<wgpu::ColorTargetState>],
    depth: &Option<wgpu::DepthStencilState>,
) -> wgpu::RenderPipeline {
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    // Groups behind the last one in use are left out.
    let used = layouts.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &layouts[..used],
        immediate_size: 0,
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState { topology, ..wgpu::PrimitiveState::default() },
        depth_stencil: depth.clone(),
        multisample: wgpu::MultisampleState::default(),
        fragment: fragment.map(|entry_point| wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// What the picture is drawn into.
#[derive(Debug)]
pub(crate) struct Targets {
    /// Pixels.
    pub(crate) size: [u32; 2],
    /// The picture, [`COLOR`]: `RENDER_ATTACHMENT | COPY_SRC | TEXTURE_BINDING`.
    pub(crate) color: wgpu::Texture,
    pub(crate) color_view: wgpu::TextureView,
    /// Depth of what is solid, [`DEPTH`]. Bound in group 0: hair passes must not attach it for writing; those that
    /// want a hardware test have a depth buffer of their own, which starts as a copy or tests by `view_hidden`.
    pub(crate) solid: wgpu::Texture,
    pub(crate) solid_view: wgpu::TextureView,
}

impl Targets {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let make = |label, format| {
            gpu.device.create_texture(&texture_2d(
                label,
                size,
                1,
                format,
                wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::TEXTURE_BINDING,
            ))
        };
        let (color, solid) = (make("picture", COLOR), make("solid depth", DEPTH));
        let color_view = color.create_view(&wgpu::TextureViewDescriptor::default());
        let solid_view = solid.create_view(&wgpu::TextureViewDescriptor::default());
        Self { size, color, color_view, solid, solid_view }
    }
}

/// Describes a plain texture, or an array of `layers`.
pub(crate) fn texture_2d(
    label: &'static str,
    size: [u32; 2],
    layers: u32,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}

/// Bytes of a texture.
pub(crate) fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let texel = match texture.format() {
        DEPTH => 4,
        format => format.block_copy_size(None).unwrap_or(4),
    };
    u64::from(texture.width())
        * u64::from(texture.height())
        * u64::from(texture.depth_or_array_layers())
        * u64::from(texel)
}

/// What a technique draws with; all of it is ready when [`record`](crate::transparency::Technique::record) is called.
pub(crate) struct Context<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) stage: &'a Stage,
    /// The camera.
    pub(crate) view: &'a View,
    /// Group 0 of the camera, with the depth of what is solid.
    pub(crate) view_group: &'a wgpu::BindGroup,
    /// Group 2.
    pub(crate) shading_group: &'a wgpu::BindGroup,
    /// The hair.
    pub(crate) hair: &'a Portion,
    pub(crate) targets: &'a Targets,
    pub(crate) settings: &'a Settings,
    /// Mean distance between fibers along a ray in the hair, scene units.
    pub(crate) spacing: f32,
}
