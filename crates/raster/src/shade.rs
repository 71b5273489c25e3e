//! Group 2: fibers, their tables, lamps and shadow maps, and the text that reads them.
//!
//! Scenes have few fibers (see `palette`), each with a place in the buffer of its model, a layer of the tables if its
//! model has them, and a layer of what dual scattering needs. The text is put together from the models that the scene
//! uses and no others: shaders stay small and within eight storage buffers.
//!
//! *Rejected:* one buffer of plain words for all models, unpacked by hand. It would allow any number of models at once,
//! and repeat every parameter structure a third time.

use std::fmt::Write as _;

use bytemuck::{Pod, Zeroable, cast_slice};
use fiber::Fiber;
use fiber::multiple::dual_scattering::{DualScattering, Options};
use fiber::multiple::spread::Spread;
use fiber::shader::{self, Parameters};
use fiber::table::{self, Table2, Tables as _};
use rayon::prelude::*;
use wgpu::util::DeviceExt as _;

use crate::RasterError;
use crate::gpu::Gpu;
use crate::meter::Allocation;
use crate::palette::Palette;
use crate::settings::{Settings, ShadingSource, ShadingTime};
use crate::shadow::Shadows;
use crate::stage::{entry, storage, texture, texture_2d, texture_bytes};

const SHADE: &str = include_str!("../shaders/shade.wgsl");
const OWNER: &str = "shading";

/// Most models that one scene may use: what is left of eight storage buffers.
const MOST_MODELS: usize = 3;

/// Azimuths and inclinations of the tables for light scattered by others.
const GLOW: [u32; 2] = [48, 32];

/// Twin of `Entry` in the generated text.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Entry {
    /// Which of the models in use.
    model: u32,
    /// Place in that model's buffer.
    index: u32,
    /// Layer of the tables; [`UNTABULATED`].
    table: u32,
    /// Layer of what dual scattering needs.
    layer: u32,
}

/// The fiber has no tables and is evaluated.
const UNTABULATED: u32 = u32::MAX;

/// Everything in group 2 but lamps and shadows.
#[derive(Debug)]
pub(crate) struct Shading {
    /// The models in use.
    names: Vec<&'static str>,
    text: String,
    layout: wgpu::BindGroupLayout,
    entries: wgpu::Buffer,
    models: Vec<wgpu::Buffer>,
    textures: [wgpu::Texture; 7],
    sampler: wgpu::Sampler,
}

/// What is baked for one fiber.
struct Baked {
    tables: Option<[Table2; 3]>,
    spread: Option<Spread>,
}

impl Shading {
    pub(crate) fn new(gpu: &Gpu, palette: &Palette, settings: &Settings) -> Result<Self, RasterError> {
        let mut names: Vec<&'static str> = Vec::new();
        for fiber in &palette.fibers {
            if !names.contains(&fiber.name()) {
                names.push(fiber.name());
            }
        }
        if names.len() > MOST_MODELS {
            return Err(RasterError::TooManyModels { found: names, most: MOST_MODELS });
        }
        // A layer each; eight bits of a payload are enough to number them.
        let most = wgpu::Limits::default().max_texture_array_layers as usize;
        if palette.fibers.len() > most {
            let found = palette.fibers.len() as u64;
            return Err(RasterError::TooLarge { what: "fibers in the palette", found, most: most as u64 });
        }

        let baked: Vec<Baked> = palette.fibers.par_iter().map(|fiber| bake(fiber, settings)).collect();
        let mut parameters: Vec<Vec<u8>> = vec![Vec::new(); names.len()];
        let mut counts = vec![0_u32; names.len()];
        let (mut tabulated, mut entries) = (0, Vec::new());
        for (layer, (fiber, baked)) in palette.fibers.iter().zip(&baked).enumerate() {
            let model = names.iter().position(|name| *name == fiber.name()).unwrap_or(0);
            parameters[model].extend_from_slice(Parameters::from(*fiber).bytes());
            let table = if baked.tables.is_some() { tabulated } else { UNTABULATED };
            tabulated += u32::from(baked.tables.is_some());
            entries.push(Entry { model: model as u32, index: counts[model], table, layer: layer as u32 });
            counts[model] += 1;
        }
        if entries.is_empty() {
            // Bindings cannot be empty; nothing reads this one.
            entries.push(Entry::zeroed());
        }

        let buffer = |label, contents: &[u8]| gpu.buffer(label, contents, wgpu::BufferUsages::STORAGE);
        let entries = buffer("fibers", cast_slice(&entries));
        let models = parameters.iter().map(|bytes| buffer("fiber parameters", bytes)).collect();
        let side = settings.shading.table_size;
        let tables: Vec<&[Table2; 3]> = baked.iter().filter_map(|one| one.tables.as_ref()).collect();
        let spreads: Vec<&Spread> = baked.iter().filter_map(|one| one.spread.as_ref()).collect();
        let table = |i: usize| {
            let layers: Vec<&Table2> = tables.iter().map(|tables| &tables[i]).collect();
            array(gpu, "tables", [side, side], &layers)
        };
        let glow = |i: usize| {
            let layers: Vec<&Table2> = spreads.iter().map(|spread| spread.textures()[i]).collect();
            array(gpu, "glow", GLOW, &layers)
        };
        let curves: Vec<&Table2> = spreads.iter().map(|spread| spread.curves()).collect();
        let curve_size = curves.first().map_or([1, 1], |curves| curves.size());
        let textures =
            [table(0), table(1), table(2), glow(0), glow(1), glow(2), array(gpu, "curves", curve_size, &curves)];
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("tables"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        Ok(Self {
            text: text(&names, settings)?,
            layout: layout(gpu, names.len()),
            names,
            entries,
            models,
            textures,
            sampler,
        })
    }

    /// Puts the text together anew, for settings that change nothing that is baked.
    pub(crate) fn retext(&mut self, settings: &Settings) -> Result<(), RasterError> {
        self.text = text(&self.names, settings)?;
        Ok(())
    }

    /// All of the text that passes with shading have in front of their own.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// Layout of group 2.
    pub(crate) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Group 2.
    pub(crate) fn group(&self, gpu: &Gpu, shadows: &Shadows) -> wgpu::BindGroup {
        let views: Vec<wgpu::TextureView> = self.textures.iter().map(array_view).collect();
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: self.entries.as_entire_binding() }];
        for (i, model) in self.models.iter().enumerate() {
            entries.push(wgpu::BindGroupEntry { binding: 1 + i as u32, resource: model.as_entire_binding() });
        }
        for (i, view) in views.iter().enumerate() {
            let resource = wgpu::BindingResource::TextureView(view);
            entries.push(wgpu::BindGroupEntry { binding: 4 + i as u32, resource });
        }
        let resource = wgpu::BindingResource::Sampler(&self.sampler);
        entries.push(wgpu::BindGroupEntry { binding: 11, resource });
        entries.extend(shadows.bind_entries());
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shading"),
            layout: &self.layout,
            entries: &entries,
        })
    }

    pub(crate) fn memory(&self) -> Vec<Allocation> {
        let buffers = self.entries.size() + self.models.iter().map(wgpu::Buffer::size).sum::<u64>();
        let one = |name: &str, bytes| Allocation { owner: OWNER, name: name.to_owned(), bytes };
        vec![
            one("fibers", buffers),
            one("tables", self.textures[..3].iter().map(texture_bytes).sum()),
            one("multiple scattering", self.textures[3..].iter().map(texture_bytes).sum()),
        ]
    }
}

/// A view of all layers, even of one.
fn array_view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..wgpu::TextureViewDescriptor::default()
    })
}

/// Tables of one fiber, as far as the settings want them.
fn bake(fiber: &Fiber, settings: &Settings) -> Baked {
    let side = settings.shading.table_size;
    let tables = match (settings.shading.source, fiber.cast::<f64>()) {
        (ShadingSource::Direct, _) => None,
        (ShadingSource::Tables, Fiber::Deon(m)) => {
            table::deon::bake(&m, side).ok().map(|t| widened(t.textures(), side))
        }
        (ShadingSource::Tables, Fiber::Chiang(m)) => {
            table::chiang::bake(&m, side).ok().map(|t| widened(t.textures(), side))
        }
        // What has no tables (an elliptical fiber, raw caustics) is evaluated.
        (ShadingSource::Tables, Fiber::Marschner(m)) => {
            let size = table::marschner::Resolution::square(side);
            table::marschner::bake(&m, size).ok().map(|t| widened(t.textures(), side))
        }
        (ShadingSource::Tables, _) => None,
    };
    let needed = settings.shading.multiple.is_some() || settings.lights.harmonics;
    let spread = needed.then(|| {
        let options = Options { entries: GLOW[1] as usize, samples: 2048, ..Options::default() };
        Spread::new(&DualScattering::new(near(*fiber), options), GLOW[0], GLOW[1])
    });
    Baked { tables, spread }
}

/// The fiber without its far field: averages over the cross-section are taken by draws, and cheaper so.
fn near(fiber: Fiber) -> Fiber {
    match fiber {
        Fiber::Deon(m) => Fiber::Deon(fiber::Deon { field: fiber::Field::Near, ..m }),
        Fiber::Chiang(m) => Fiber::Chiang(fiber::Chiang { field: fiber::Field::Near, ..m }),
        other => other,
    }
}

/// All three with the same number of columns: layers of one array cannot differ.
fn widened(textures: [&Table2; 3], side: u32) -> [Table2; 3] {
    textures.map(|texture| {
        let columns = texture.size()[0];
        if columns == side {
            return texture.clone();
        }
        Table2::new([side, texture.size()[1]], |column, row| {
            texture.texels()[(row * columns + column.min(columns - 1)) as usize]
        })
    })
}

/// Layers of half-precision numbers; one black texel where there are none.
fn array(gpu: &Gpu, label: &'static str, size: [u32; 2], layers: &[&Table2]) -> wgpu::Texture {
    let size = if layers.is_empty() { [1, 1] } else { size };
    let count = layers.len().max(1) as u32;
    let mut texels: Vec<[u16; 4]> = layers.iter().flat_map(|layer| layer.to_f16()).collect();
    texels.resize(size[0] as usize * size[1] as usize * count as usize, [0; 4]);
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    gpu.device.create_texture_with_data(
        &gpu.queue,
        &texture_2d(label, size, count, wgpu::TextureFormat::Rgba16Float, usage),
        wgpu::util::TextureDataOrder::LayerMajor,
        cast_slice(&texels),
    )
}

/// Layout of group 2 with so many models.
fn layout(gpu: &Gpu, models: usize) -> wgpu::BindGroupLayout {
    let fragment = wgpu::ShaderStages::FRAGMENT;
    let mut entries: Vec<wgpu::BindGroupLayoutEntry> =
        (0..=models as u32).map(|binding| entry(binding, fragment, storage(true))).collect();
    let filtered = texture(wgpu::TextureSampleType::Float { filterable: true }, wgpu::TextureViewDimension::D2Array);
    entries.extend((4..11).map(|binding| entry(binding, fragment, filtered)));
    entries.push(entry(11, fragment, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)));
    entries.extend(Shadows::layout_entries());
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("shading"), entries: &entries })
}

/// The structure that holds a model's parameters in WGSL.
fn structure(model: &str) -> &'static str {
    match model {
        "deon" => "Deon",
        "chiang" => "Chiang",
        "lambertian" => "Lambertian",
        "kajiya_kay" => "KajiyaKay",
        "hery" => "Hery",
        "marschner" => "Marschner",
        "sadeghi" => "Sadeghi",
        _ => "Fur",
    }
}

/// A number as WGSL has it.
fn number(x: f32) -> String {
    format!("{x:?}f")
}

/// The text of group 2: models in use, lamps, shadows, and the shading itself.
pub(crate) fn text(models: &[&'static str], settings: &Settings) -> Result<String, RasterError> {
    let mut parts = vec!["spread", "table"];
    parts.extend(models);
    let mut text = shader::source(&parts).map_err(|error| RasterError::Shader(error.to_string()))?;
    text.push_str(&Shadows::source(&settings.shadow));
    let densities = settings.shading.multiple.unwrap_or_default();
    let _ = write!(
        text,
        "\nconst SHADE_DEFERRED: bool = {};\nconst SHADE_MULTIPLE: bool = {};\nconst SHADE_HARMONICS: bool = {};\n\
         const SHADE_DENSITY_FORWARD: f32 = {};\nconst SHADE_DENSITY_BACKWARD: f32 = {};\n",
        settings.shading.when == ShadingTime::Deferred,
        settings.shading.multiple.is_some(),
        settings.lights.harmonics,
        number(densities.density_forward),
        number(densities.density_backward),
    );
    text.push_str(
        "\nstruct Entry {\n    model: u32,\n    index: u32,\n    table: u32,\n    layer: u32,\n}\n\n\
         @group(2) @binding(0) var<storage, read> shade_entries: array<Entry>;\n",
    );
    for (i, model) in models.iter().enumerate() {
        let _ = writeln!(
            text,
            "@group(2) @binding({}) var<storage, read> shade_{model}: array<{}>;",
            1 + i,
            structure(model)
        );
    }
    for (i, name) in ["table_a", "table_b", "table_c", "glow_a", "glow_b", "glow_c", "curves"].iter().enumerate() {
        let _ = writeln!(text, "@group(2) @binding({}) var shade_{name}: texture_2d_array<f32>;", 4 + i);
    }
    text.push_str("@group(2) @binding(11) var shade_sampler: sampler;\n\n");
    text.push_str(
        "fn shade_table(which: u32, at: vec2f, layer: u32) -> vec4f {\n    switch which {\n        \
         case 0u: { return textureSampleLevel(shade_table_a, shade_sampler, at, layer, 0.0); }\n        \
         case 1u: { return textureSampleLevel(shade_table_b, shade_sampler, at, layer, 0.0); }\n        \
         default: { return textureSampleLevel(shade_table_c, shade_sampler, at, layer, 0.0); }\n    }\n}\n\n",
    );
    text.push_str("fn shade_fiber(entry: Entry, known: Dir, h: f32, width_px: f32, s: Dir) -> Lobes {\n");
    text.push_str("    let size = f32(textureDimensions(shade_table_a).x);\n    switch entry.model {\n");
    for (i, model) in models.iter().enumerate() {
        let _ = writeln!(text, "        case {i}u: {{\n            let m = shade_{model}[entry.index];");
        if settings.shading.source == ShadingSource::Tables {
            text.push_str(by_tables(model));
        }
        let call = match *model {
            "deon" | "chiang" => format!("{model}_eval_wide(m, known, h, width_px, s)"),
            _ => format!("{model}_eval(m, known, h, s)"),
        };
        let _ = writeln!(text, "            return {call};\n        }}");
    }
    text.push_str("        default: { return lobes_zero(); }\n    }\n}\n\n");
    text.push_str(SHADE);
    Ok(text)
}

/// How a model is evaluated by tables; empty for those that have none.
fn by_tables(model: &str) -> &'static str {
    match model {
        "deon" => {
            "            if entry.table != 0xffffffffu {
                let at = deon_table_coords(m, size, known, s);
                let t = entry.table;
                return deon_from_tables(
                    m, known, s, shade_table(0u, at, t), shade_table(1u, at, t), shade_table(2u, at, t));
            }
"
        }
        "chiang" => {
            "            if entry.table != 0xffffffffu {
                let at = chiang_table_coords(size, known, s);
                let t = entry.table;
                return chiang_from_tables(
                    m, known, s, shade_table(0u, at, t), shade_table(1u, at, t), shade_table(2u, at, t));
            }
"
        }
        "marschner" => {
            "            if entry.table != 0xffffffffu {
                let t = entry.table;
                let along = shade_table(0u, marschner_table_coords(TABLE_WARPED, size, known, s), t);
                let at = marschner_section_coords(TABLE_WARPED, size, known, s, along);
                return marschner_from_tables(
                    TABLE_WARPED, m.diffuse, known, s, along, shade_table(1u, at, t), shade_table(2u, at, t));
            }
"
        }
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    use super::*;
    use crate::stage::{FRAGMENT, FRAME};

    /// What techniques call.
    const USE: &str = "
@fragment
fn shade_all(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var f: Fragment;
    f.position = at.xyz;
    let payload = fragment_payload(f);
    return payload_color(payload, at.xy, at.z) + vec4f(shade(f), payload_alpha(payload));
}
";

    #[test]
    fn the_text_is_valid_for_every_model_and_setting() {
        let models = ["deon", "chiang", "lambertian", "kajiya_kay", "hery", "marschner", "sadeghi", "fur"];
        let mut wrong = Vec::new();
        for (model, bits) in models.into_iter().flat_map(|model| (0..16_u32).map(move |bits| (model, bits))) {
            let mut settings = Settings::default();
            settings.shading.source = if bits & 1 == 0 { ShadingSource::Direct } else { ShadingSource::Tables };
            settings.shading.when = if bits & 2 == 0 { ShadingTime::Forward } else { ShadingTime::Deferred };
            settings.shading.multiple = (bits & 4 != 0).then(Default::default);
            settings.lights.harmonics = bits & 8 != 0;
            let mine = text(&[model], &settings).unwrap_or_else(|error| panic!("{model}: {error}"));
            let whole = [FRAME, FRAGMENT, &mine, USE].join("\n");
            // Nothing beyond what every WebGPU device has.
            let mut validator = Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32);
            let checked = naga::front::wgsl::parse_str(&whole)
                .map_err(|error| error.emit_to_string(&whole))
                .and_then(|module| validator.validate(&module).map_err(|error| error.emit_to_string(&whole)));
            if let Err(error) = checked {
                wrong.push(format!("{model} {bits:04b}: {error}"));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}
