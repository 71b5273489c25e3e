//! Shadows of hair: maps as the lamps see it, and the text that looks them up.
//!
//! *Theory.* Hunz 2016, chapter 4. Light that crosses `n` fibers keeps `τ = exp(-κ α n)` of itself. Techniques differ in
//! how they come by `n`:
//!
//! | technique | keeps per texel | `n` | source |
//! |---|---|---|---|
//! | shadow map | nearest depth | none or all | Williams 1978 |
//! | approximated deep shadow map | nearest depth | way behind it over the distance between fibers, and 1 | TressFX; eqs. 68, 69 |
//! | opacity shadow maps | sums up to 16 planes | interpolated between planes | Kim and Neumann 2001; Nguyen and Donnelly 2005 |
//! | deep opacity maps | nearest depth, sums up to 4 depths behind it | interpolated between those | Yuksel and Keyser 2008 |
//!
//! *What we changed.*
//! - Maps hold fibers, not opacities: a fragment adds the share of its texel that it covers, and `κ α` comes in when
//!   they are looked up. So opacity is changed without drawing.
//! - Dual scattering wants a number of fibers. It is told how many let as much light through as was found, `-ln τ`,
//!   with filter, opacity and strength in it. The mean of the numbers of several texels would be another one, darker at
//!   every gap, and would know neither opacity nor strength; with physical opacity and one texel both are the same.
//! - The approximated deep shadow map takes `1 - exp(-κ α)` for the opacity of a fiber in `(1 - α)ⁿ`, which is `τ` of
//!   the others, so that one setting means one thing. The distance between fibers is by default that of the groom; the
//!   literature divides by the width of a fiber, as if hair had no gaps.
//! - Fragments count in their own slice or layer and in all behind it, so that a lookup reads two sums and not all.
//! - The filter averages light that gets through; see `common.wgsl`.
//!
//! A fiber is in the sums that its own points look up. Interpolation takes a part of it, as if the layer's fibers were
//! spread over its thickness: nothing at its front, all at its back. On average a fiber shadows itself by half of its
//! share of the texel: little where texels are larger than fibers, half a fiber where they are smaller.
//!
//! Meshes have a map of their own, with the same view, whatever the technique. Where maps reach is said in
//! [`views`].
//!
//! *Resources.* Per lamp `side²` texels of 4 bytes for each of two depths, and of [`Gpu::sum_format`] one
//! (deep opacity maps) or four (opacity shadow maps) for the sums. Drawn by [`record`](Shadows::record), read by
//! fragment stages.
//!
//! *Rejected.* Cube maps for lamps in all directions: six times the passes, for a lamp that is in the middle of the
//! hair, which has it only from one side otherwise. Slices that hold their own fragments alone, as in the literature:
//! sums are smaller then, and a lookup reads up to 16 of them for each texel of the filter.

mod table;
mod views;

use bytemuck::{Pod, Zeroable, bytes_of};
use math::Vec3;

use crate::frame::{Frame, cleared, depth};
use crate::gpu::{Gpu, GpuError};
use crate::lights::{HARMONICS_SHADER, Lamps};
use crate::meter::Allocation;
use crate::settings::{Shadow, ShadowTechnique};
use crate::solid::Solids;
use crate::stage::{DEPTH, HairPass, Stage, depth_test, entry, target, texture, texture_2d, texture_bytes, uniform};
use crate::strands::{Part, Portion};
use crate::view::View;
use table::{LampTable, LampWords, MOST_LAMPS};
use views::MapView;

const LAMPS: &str = include_str!("../shaders/lamps.wgsl");
const COMMON: &str = include_str!("../shaders/shadow/common.wgsl");
const NONE: &str = include_str!("../shaders/shadow/none.wgsl");
const MAP: &str = include_str!("../shaders/shadow/map.wgsl");
const ADSM: &str = include_str!("../shaders/shadow/adsm.wgsl");
const OSM: &str = include_str!("../shaders/shadow/osm.wgsl");
const DOM: &str = include_str!("../shaders/shadow/dom.wgsl");
const NEAREST: &str = include_str!("../shaders/shadow/depth.wgsl");
const FILL: &str = include_str!("../shaders/shadow/fill.wgsl");

/// First binding of group 2 that is ours: lamps, nearest hair, nearest mesh, sums.
const FIRST_BINDING: u32 = 12;

/// Targets that hold the 16 slices of opacity shadow maps, four each.
const SLICE_TARGETS: u32 = 4;

/// Maps larger than this are worth a word, bytes.
const LARGE: u64 = 1 << 30;

/// Sums of what fragments bring.
const ADD: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::One,
    dst_factor: wgpu::BlendFactor::One,
    operation: wgpu::BlendOperation::Add,
};

/// Twin of `ShadowFill` in `shaders/shadow/fill.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Fill {
    ends: [f32; 4],
    hair: [f32; 2],
    first: u32,
    _end: u32,
}

/// The maps of one lamp.
#[derive(Debug)]
struct Map {
    /// Which lamp.
    lamp: usize,
    view: View,
    solid: wgpu::TextureView,
    /// Where the technique has the nearest hair.
    hair: Option<wgpu::TextureView>,
    fills: Vec<FillPass>,
}

/// One pass that adds fibers up.
#[derive(Debug)]
struct FillPass {
    targets: Vec<wgpu::TextureView>,
    group: wgpu::BindGroup,
}

/// Sums of fibers as a lamp sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct OpacityMap {
    /// Texels a side.
    pub side: u32,
    /// Sums per texel: 4 or 16, those of layers that are not in use among them.
    pub layers: usize,
    /// Expected number of fibers up to the far side of each layer; texel by texel, row by row.
    pub fibers: Vec<f32>,
}

/// The lamps of a scene and their shadow maps.
#[derive(Debug)]
pub(crate) struct Shadows {
    technique: ShadowTechnique,
    lamps: usize,
    maps: Vec<Map>,
    table: wgpu::Buffer,
    textures: [wgpu::Texture; 3],
    views: [wgpu::TextureView; 3],
    /// In group 0 the depth of what is solid, which these passes do not ask for.
    blank: wgpu::TextureView,
    fill_layout: wgpu::BindGroupLayout,
    /// Targets of one pass over the slices: 4 where the device can.
    at_once: u32,
    notes: Vec<String>,
}

impl Shadows {
    /// Makes room for the maps of `lamps`.
    ///
    /// `everything` is the box around hair and meshes, `hair` that around the hair. `spacing` is the expected distance
    /// between fibers along a ray, `radius` the largest of a fiber; all in scene units.
    pub(crate) fn new(
        gpu: &Gpu,
        lamps: &Lamps,
        settings: &Shadow,
        everything: (Vec3, Vec3),
        hair: (Vec3, Vec3),
        spacing: f32,
        radius: f32,
    ) -> Self {
        let technique = settings.technique;
        let side = settings.resolution.clamp(1, gpu.largest_side());
        let list = &lamps.lamps[..lamps.lamps.len().min(MOST_LAMPS)];
        let with_map = |lamp: &crate::lights::Lamp| lamp.shadow && technique != ShadowTechnique::None;
        let map_views: Vec<(usize, MapView)> = list
            .iter()
            .enumerate()
            .filter(|(_, lamp)| with_map(lamp))
            .map(|(i, lamp)| (i, MapView::new(lamp, side, everything, hair)))
            .collect();

        // The strands that are left out of the maps widen the others.
        let width = 2.0 * radius / settings.strands.max(1e-6);
        let mut words = LampTable::new(settings, side, spacing, width);
        words.count = list.len() as u32;
        if let Some(ambient) = &lamps.harmonics {
            words.ambient = ambient.words();
        }
        for (slot, lamp) in words.list.iter_mut().zip(list) {
            *slot = LampWords::new(lamp, None);
        }
        for (layer, (i, map)) in map_views.iter().enumerate() {
            words.list[*i] = LampWords::new(&list[*i], Some((layer as u32, &map.view, map.hair)));
        }
        let table = gpu.buffer("lamps", bytes_of(&words), wgpu::BufferUsages::UNIFORM);

        let format = gpu.sum_format();
        let at_once = targets_at_once(gpu, format);
        let textures = textures(gpu, technique, side, map_views.len() as u32, format);
        let views = [&textures[0], &textures[1], &textures[2]].map(|texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            })
        });
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT;
        let blank = layer_view(&gpu.device.create_texture(&texture_2d("no solid depth", [1, 1], 1, DEPTH, usage)), 0);
        let fill_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow fill"),
            entries: &[
                entry(0, wgpu::ShaderStages::FRAGMENT, uniform()),
                entry(
                    1,
                    wgpu::ShaderStages::FRAGMENT,
                    texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2),
                ),
            ],
        });

        let mut shadows = Self {
            technique,
            lamps: list.len(),
            maps: Vec::new(),
            table,
            textures,
            views,
            blank,
            fill_layout,
            at_once,
            notes: Vec::new(),
        };
        shadows.maps = map_views
            .iter()
            .enumerate()
            .map(|(layer, (lamp, map))| shadows.map(gpu, *lamp, layer as u32, map))
            .collect();
        shadows.note(lamps, list.len(), &map_views, everything, hair);
        shadows
    }

    /// The maps of one lamp: views of layers, and what passes bind.
    fn map(&self, gpu: &Gpu, lamp: usize, layer: u32, map: &MapView) -> Map {
        let [hair, solid, sums] = &self.textures;
        let hair = self.has_nearest_hair().then(|| layer_view(hair, layer));
        let thickness = map.hair[1] - map.hair[0];
        let fill = |first: u32, targets: Vec<wgpu::TextureView>| {
            let ends = match self.technique {
                ShadowTechnique::Dom { layers, ends } => table::fill_ends(layers, ends, thickness),
                _ => [f32::MAX; 4],
            };
            let buffer = gpu.buffer(
                "shadow fill",
                bytes_of(&Fill { ends, hair: map.hair, first, _end: 0 }),
                wgpu::BufferUsages::UNIFORM,
            );
            let nearest = hair.as_ref().unwrap_or(&self.blank);
            let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("shadow fill"),
                layout: &self.fill_layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(nearest) },
                ],
            });
            FillPass { targets, group }
        };
        let fills = match self.technique {
            ShadowTechnique::Dom { .. } => vec![fill(0, vec![layer_view(sums, layer)])],
            ShadowTechnique::Osm => (0..SLICE_TARGETS)
                .step_by(self.at_once as usize)
                .map(|from| {
                    let targets = from..from + self.at_once;
                    fill(4 * from, targets.map(|k| layer_view(sums, SLICE_TARGETS * layer + k)).collect())
                })
                .collect(),
            _ => Vec::new(),
        };
        Map { lamp, view: map.view, solid: layer_view(solid, layer), hair, fills }
    }

    /// Says what the maps do not show.
    fn note(
        &mut self,
        lamps: &Lamps,
        known: usize,
        maps: &[(usize, MapView)],
        everything: (Vec3, Vec3),
        hair: (Vec3, Vec3),
    ) {
        if lamps.lamps.len() > known {
            let lost = lamps.lamps.len() - known;
            self.notes.push(format!("{lost} lamps are not drawn: there can be {MOST_LAMPS}"));
        }
        for (i, _) in maps.iter().filter(|(_, map)| !map.whole) {
            self.notes.push(format!(
                "light {}: it is within the hair or next to it; what its shadow map, which is 150 degrees wide, does \
                 not see has no shadow",
                lamps.lamps[*i].source
            ));
        }
        if !maps.is_empty() && (everything.0.cmplt(hair.0).any() || everything.1.cmpgt(hair.1).any()) {
            self.notes.push(
                "shadow maps reach as far as the hair does; meshes beside it, as a lamp sees them, are lit".to_owned(),
            );
        }
        let bytes = self.textures.iter().map(texture_bytes).sum::<u64>();
        if bytes > LARGE {
            self.notes.push(format!(
                "the shadow maps of {} lamps take {:.1} GB; fewer lamps, smaller maps or deep opacity maps take less",
                maps.len(),
                bytes as f64 / 1e9
            ));
        }
    }

    fn has_nearest_hair(&self) -> bool {
        needs_nearest_hair(self.technique)
    }

    /// Draws all maps.
    pub(crate) fn record(&self, gpu: &Gpu, stage: &Stage, frame: &mut Frame, portion: &Portion, solids: &Solids) {
        if self.maps.is_empty() {
            return;
        }
        let owner = self.technique.name();
        let solid_pipeline = solids.depth_pipeline(gpu, stage, "shadow: meshes");
        let nearest_pipeline = self.has_nearest_hair().then(|| {
            stage.hair(
                gpu,
                &HairPass {
                    label: "shadow: nearest hair",
                    part: NEAREST,
                    fragment: "shadow_depth",
                    shades: false,
                    technique: None,
                    targets: &[],
                    depth: Some(depth_test(true)),
                    shape: portion.shape,
                },
            )
        });
        let fill_pipeline = self.fill_pipeline(gpu, stage, portion);

        for map in &self.maps {
            let group = stage.view(gpu, &map.view, &self.blank);
            {
                let name = format!("meshes, lamp {}", map.lamp);
                let mut pass = frame.render(owner, name, &[], Some(depth(&map.solid, true)));
                pass.set_pipeline(&solid_pipeline);
                pass.set_bind_group(0, &group, &[]);
                solids.draw_depth(&mut pass);
            }
            if let (Some(hair), Some(pipeline)) = (&map.hair, &nearest_pipeline) {
                let name = format!("nearest hair, lamp {}", map.lamp);
                let mut pass = frame.render(owner, name, &[], Some(depth(hair, true)));
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                portion.draw(&mut pass, Part::All);
            }
            let Some(pipeline) = &fill_pipeline else { continue };
            for fill in &map.fills {
                let targets: Vec<_> =
                    fill.targets.iter().map(|target| cleared(target, wgpu::Color::TRANSPARENT)).collect();
                let mut pass = frame.render(owner, format!("fibers, lamp {}", map.lamp), &targets, None);
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.set_bind_group(3, &fill.group, &[]);
                portion.draw(&mut pass, Part::All);
            }
        }
    }

    /// What adds fibers up, if the technique does.
    fn fill_pipeline(&self, gpu: &Gpu, stage: &Stage, portion: &Portion) -> Option<wgpu::RenderPipeline> {
        let (label, count, part) = match (self.technique, self.at_once) {
            (ShadowTechnique::Dom { .. }, _) => ("shadow: layers", 1, layers_part()),
            (ShadowTechnique::Osm, 4) => ("shadow: 16 slices", 4, slices_part(4)),
            (ShadowTechnique::Osm, 2) => ("shadow: 8 slices", 2, slices_part(2)),
            (ShadowTechnique::Osm, _) => ("shadow: 4 slices", 1, slices_part(1)),
            _ => return None,
        };
        let format = self.textures[2].format();
        let targets = vec![target(format, Some(wgpu::BlendState { color: ADD, alpha: ADD })); count];
        Some(stage.hair(
            gpu,
            &HairPass {
                label,
                part: &part,
                fragment: "shadow_fill_fragment",
                shades: false,
                technique: Some(&self.fill_layout),
                targets: &targets,
                depth: None,
                shape: portion.shape,
            },
        ))
    }

    /// Our part of the layout of group 2.
    pub(crate) fn layout_entries() -> Vec<wgpu::BindGroupLayoutEntry> {
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let array = |sample_type| texture(sample_type, wgpu::TextureViewDimension::D2Array);
        let depths = array(wgpu::TextureSampleType::Depth);
        // Sums of 32 bits cannot be filtered everywhere, and are not.
        let sums = array(wgpu::TextureSampleType::Float { filterable: false });
        [uniform(), depths, depths, sums]
            .into_iter()
            .zip(FIRST_BINDING..)
            .map(|(ty, binding)| entry(binding, fragment, ty))
            .collect()
    }

    /// Our part of group 2.
    pub(crate) fn bind_entries(&self) -> Vec<wgpu::BindGroupEntry<'_>> {
        let mut entries =
            vec![wgpu::BindGroupEntry { binding: FIRST_BINDING, resource: self.table.as_entire_binding() }];
        entries.extend(self.views.iter().zip(FIRST_BINDING + 1..).map(|(view, binding)| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view),
        }));
        entries
    }

    /// WGSL of lamps and of the technique: `lamp_count`, `lamp_arriving`, `lamp_ambient`, `shadow_solid`, `shadow_lit`
    /// and `shadow_fibers`.
    pub(crate) fn source(settings: &Shadow) -> String {
        let technique = match settings.technique {
            ShadowTechnique::None => return [HARMONICS_SHADER, LAMPS, NONE].join("\n"),
            ShadowTechnique::Map => MAP,
            ShadowTechnique::Adsm { .. } => ADSM,
            ShadowTechnique::Osm => OSM,
            ShadowTechnique::Dom { .. } => DOM,
        };
        let radius = format!("const SHADOW_RADIUS: i32 = {};\n", settings.filter.radius());
        [HARMONICS_SHADER, LAMPS, &radius, COMMON, technique].join("\n")
    }

    /// How many lamps shaders loop over.
    pub(crate) fn lamp_count(&self) -> usize {
        self.lamps
    }

    /// Sentences for the user.
    pub(crate) fn notes(&self) -> &[String] {
        &self.notes
    }

    /// What is kept on the device.
    pub(crate) fn memory(&self) -> Vec<Allocation> {
        let mut memory = vec![Allocation { owner: "scene", name: "lamps".to_owned(), bytes: self.table.size() }];
        if !self.maps.is_empty() {
            let names = ["nearest hair", "nearest mesh", "fibers"];
            memory.extend(self.textures.iter().zip(names).map(|(texture, name)| Allocation {
                owner: self.technique.name(),
                name: name.to_owned(),
                bytes: texture_bytes(texture),
            }));
        }
        memory
    }

    /// The sums of fibers that `lamp` sees, as they were drawn last; `None` when it has none, because the technique
    /// has none or the lamp no shadow.
    pub(crate) fn fetch_layer(&self, gpu: &Gpu, lamp: usize) -> Result<Option<OpacityMap>, GpuError> {
        let per_map = match self.technique {
            ShadowTechnique::Dom { .. } => 1,
            ShadowTechnique::Osm => SLICE_TARGETS,
            _ => return Ok(None),
        };
        let Some(map) = self.maps.iter().position(|map| map.lamp == lamp) else { return Ok(None) };
        let sums = &self.textures[2];
        let layers = 4 * per_map as usize;
        let mut fibers = vec![0.0; layers * sums.width() as usize * sums.height() as usize];
        for part in 0..per_map {
            let bytes = gpu.fetch_texture(sums, map as u32 * per_map + part, wgpu::TextureAspect::All)?;
            for (i, value) in numbers(sums.format(), &bytes).enumerate() {
                fibers[i / 4 * layers + 4 * part as usize + i % 4] = value;
            }
        }
        Ok(Some(OpacityMap { side: sums.width(), layers, fibers }))
    }
}

/// Whether a technique looks at the depth of the nearest hair.
fn needs_nearest_hair(technique: ShadowTechnique) -> bool {
    match technique {
        ShadowTechnique::None | ShadowTechnique::Osm => false,
        ShadowTechnique::Map | ShadowTechnique::Adsm { .. } | ShadowTechnique::Dom { .. } => true,
    }
}

/// Nearest hair, nearest mesh and sums of `maps` lamps; one texel where there is nothing to keep.
fn textures(
    gpu: &Gpu,
    technique: ShadowTechnique,
    side: u32,
    maps: u32,
    format: wgpu::TextureFormat,
) -> [wgpu::Texture; 3] {
    let make = |label, format, layers: u32| {
        let side = if layers == 0 { 1 } else { side };
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        gpu.device.create_texture(&texture_2d(label, [side, side], layers.max(1), format, usage))
    };
    let per_map = match technique {
        ShadowTechnique::Dom { .. } => 1,
        ShadowTechnique::Osm => SLICE_TARGETS,
        _ => 0,
    };
    [
        make("nearest hair", DEPTH, if needs_nearest_hair(technique) { maps } else { 0 }),
        make("nearest mesh", DEPTH, maps),
        make("fibers", format, per_map * maps),
    ]
}

/// One layer of an array.
fn layer_view(texture: &wgpu::Texture, layer: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..wgpu::TextureViewDescriptor::default()
    })
}

/// How many targets of a format one pass can have: 1, 2 or 4. The default limits have room for 32 bytes a pixel.
fn targets_at_once(gpu: &Gpu, format: wgpu::TextureFormat) -> u32 {
    let room = gpu.device.limits().max_color_attachment_bytes_per_sample;
    match room / format.block_copy_size(None).unwrap_or(16).max(1) {
        4.. => 4,
        2..4 => 2,
        _ => 1,
    }
}

/// The values of a texture of four channels.
fn numbers(format: wgpu::TextureFormat, bytes: &[u8]) -> Box<dyn Iterator<Item = f32> + '_> {
    if format == wgpu::TextureFormat::Rgba16Float {
        Box::new(bytes.chunks_exact(2).map(|b| fiber::table::from_half(u16::from_le_bytes([b[0], b[1]]))))
    } else {
        Box::new(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
    }
}

/// Draws hair into the layers of a deep opacity map.
fn layers_part() -> String {
    format!(
        "{FILL}
@fragment
fn shadow_fill_fragment(v: HairVertex) -> @location(0) vec4f {{
    return shadow_fill_layers(hair_fragment(v), vec2i(v.clip.xy));
}}
"
    )
}

/// Draws hair into four slices for each of `targets`.
fn slices_part(targets: u32) -> String {
    let list = |one: fn(u32) -> String, between: &str| (0..targets).map(one).collect::<Vec<_>>().join(between);
    let members = list(|k| format!("    @location({k}) slices{k}: vec4f,"), "\n");
    let values = list(|k| format!("shadow_fill_slices(f, {k}u)"), ", ");
    format!(
        "{FILL}
struct ShadowSlices {{
{members}
}}

@fragment
fn shadow_fill_fragment(v: HairVertex) -> ShadowSlices {{
    let f = hair_fragment(v);
    return ShadowSlices({values});
}}
"
    )
}

#[cfg(test)]
mod tests {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    use naga::{Module, TypeInner};

    use super::*;
    use crate::settings::{Filter, Settings};
    use crate::stage::{FRAGMENT, FRAME};

    /// What the text of strands has, as far as fragments see it.
    const HAIR: &str = "
struct HairVertex {
    @builtin(position) @invariant clip: vec4f,
    @location(0) position: vec3f,
}

fn hair_fragment(v: HairVertex) -> Fragment {
    var f: Fragment;
    f.position = v.position;
    f.depth = view_depth(v.position);
    f.alpha = 0.5;
    return f;
}
";

    /// What shading does with our text.
    const USE: &str = "
@fragment
fn shade_all(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var sum = lamp_ambient(at.xyz) + lamp_ambient_irradiance(at.xyz);
    var fibers = 0.0;
    for (var i = 0u; i < lamp_count(); i++) {
        let light = lamp_arriving(i, at.xyz);
        let lit = shadow_solid(i, at.xyz) * shadow_lit(i, at.xyz);
        sum += light.irradiance * lit * dot(light.direction, at.xyz);
        fibers += shadow_fibers(i, at.xyz);
    }
    return vec4f(sum, fibers);
}
";

    const TECHNIQUES: [ShadowTechnique; 5] = [
        ShadowTechnique::None,
        ShadowTechnique::Map,
        ShadowTechnique::Adsm { spacing: None },
        ShadowTechnique::Osm,
        ShadowTechnique::DOM,
    ];

    fn compile(text: &str) -> Result<Module, String> {
        let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
        // Nothing beyond what every WebGPU device has.
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
        Ok(module)
    }

    fn settings(technique: ShadowTechnique, filter: Filter) -> Shadow {
        Shadow { technique, filter, ..Settings::default().shadow }
    }

    #[test]
    fn every_technique_is_valid_with_every_filter_and_has_the_same_functions() {
        let mut wrong = Vec::new();
        for technique in TECHNIQUES {
            for filter in [Filter::None, Filter::Pcf3, Filter::Pcf5] {
                let text = [FRAME, FRAGMENT, &Shadows::source(&settings(technique, filter)), USE].join("\n");
                if let Err(error) = compile(&text) {
                    wrong.push(format!("{technique:?} {filter:?}: {error}"));
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn every_pass_is_valid() {
        for part in [NEAREST.to_owned(), layers_part(), slices_part(1), slices_part(2), slices_part(4)] {
            let text = [FRAME, FRAGMENT, HAIR, &part].join("\n");
            let module = compile(&text).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(module.entry_points.len(), 1);
        }
    }

    /// Size and members with their offsets of a structure, in bytes.
    fn layout(module: &Module, name: &str) -> (usize, Vec<(String, usize)>) {
        let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
        let (_, ty) = found.unwrap_or_else(|| panic!("the shaders have no structure {name}"));
        let TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no structure") };
        let members = members.iter().map(|member| (member.name.clone().unwrap_or_default(), member.offset as usize));
        (*span as usize, members.collect())
    }

    macro_rules! assert_twins {
        ($module:expr, $name:literal, $type:ident { $($member:ident),* $(,)? }) => {
            let here = vec![$((stringify!($member).to_owned(), std::mem::offset_of!($type, $member)),)*];
            assert_eq!(layout($module, $name), (size_of::<$type>(), here), "{}: left is the shader", $name);
        };
    }

    #[test]
    fn what_is_uploaded_fits_the_shaders() {
        let text = [FRAME, FRAGMENT, &Shadows::source(&settings(ShadowTechnique::DOM, Filter::None))].join("\n");
        let module = compile(&text).unwrap_or_else(|error| panic!("{error}"));
        assert_twins!(
            &module,
            "Lamp",
            LampWords {
                map_from_world,
                position,
                kind,
                direction,
                emission,
                color,
                layer,
                eye,
                near,
                forward,
                far,
                cone,
                hair,
                texel,
                perspective,
            }
        );
        assert_twins!(
            &module,
            "LampTable",
            LampTable { count, side, strength, optical, ends, spacing, width, ambient, list }
        );
        let text = [FRAME, FRAGMENT, HAIR, &layers_part()].join("\n");
        let module = compile(&text).unwrap_or_else(|error| panic!("{error}"));
        assert_twins!(&module, "ShadowFill", Fill { ends, hair, first });
        // The smallest limit of uniform bindings that a device may have.
        assert!(size_of::<LampTable>() <= 65536);
    }

    #[test]
    fn groups_stay_within_the_limits() {
        let entries = Shadows::layout_entries();
        assert_eq!(entries.iter().map(|entry| entry.binding).collect::<Vec<_>>(), [12, 13, 14, 15]);
        assert!(entries.iter().all(|entry| entry.visibility == wgpu::ShaderStages::FRAGMENT));
    }

    #[test]
    fn texels_are_read_in_both_formats() {
        let values = [0.0_f32, 1.0, 2.5, 1000.0];
        let wide: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let narrow: Vec<u8> = values.iter().flat_map(|x| fiber::table::to_half(*x).to_le_bytes()).collect();
        assert_eq!(numbers(wgpu::TextureFormat::Rgba32Float, &wide).collect::<Vec<_>>(), values);
        assert_eq!(numbers(wgpu::TextureFormat::Rgba16Float, &narrow).collect::<Vec<_>>(), values);
    }
}
