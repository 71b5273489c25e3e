//! DBK-buffer: lists of the fragments in a layer behind the nearest one, opaque hair behind the layer.
//!
//! *Theory:* section 5.3 of the thesis: hair is dense, so what is far behind the nearest fragment of a pixel is hidden.
//! Only fragments within a certain depth of it are stored, sorted and blended; what is behind them is drawn once more
//! as if it were opaque, and shows through. The thesis leaves the thickness of the layer to the user, one number for
//! the whole picture, which is too thick for the dense parts and too thin for the others. Changed here:
//!
//! - **Automatic shift.** A pass over the hair adds up the optical depth `-ln(1 - α)` of each pixel in 12 bins by depth
//!   behind its nearest fragment. The layer of the pixel ends where the sum reaches that of the wanted opacity (`-ln
//!   0.03` for 97 %). Bins grow geometrically from half the mean distance between fibers, so that they are fine where
//!   most layers end; within a bin the end is interpolated. Pixels with less hair than that store all they have. For
//!   uniform hair the nodes stored are on average 6 % more than the fewest that reach an opacity of 97 %, 7 % for 99 %.
//! - **Opacity behind the layer.** Hair behind it is not taken to be opaque: fragments that are not stored add up their
//!   optical depth, and the colour of the nearest of them counts with the opacity of all of them. The opacity of every
//!   pixel is thereby that of the full lists, for any shift; single hairs in front of nothing stay transparent.
//! - **Memory.** The number of nodes is that of the frame before and a tenth. Fragments that find no room are counted,
//!   and the frame is drawn again with more. Where the nodes do not fit into one binding, the picture is filled and
//!   resolved in bands that use the same nodes in turn (see `bands`).
//!
//! *Resources*, written by → read by:
//!
//! | what | bytes | |
//! |---|---|---|
//! | heads, links, payloads | 4 a pixel of a band, 8 + 8 a node | fill → resolve |
//! | counters | 1024 | fill → the next frame's size |
//! | depth test | 4 a pixel | nearest; behind |
//! | nearest depths | 4 a pixel | nearest → bins, ends; then behind → resolve |
//! | nearest payloads | 8 a pixel | behind → resolve |
//! | depth bins (automatic shift) | 24 a pixel | bins → ends |
//! | layer ends | 4 a pixel | ends → fill, behind |
//! | rest | 4 a pixel; 2 where 32-bit floats cannot be blended | fill → resolve |
//!
//! Links and payloads are two buffers, so that a binding of 128 MiB holds 16.7 million nodes. Bins are halves: where
//! fragments are fainter than a 4096th of what their bin has, it stops growing, and the layer becomes thicker than it
//! need be, never thinner. What is left behind the layer makes up the opacity of the pixel, and is added up in 32 bits
//! where the device can.
//!
//! *Rejected:* bins for tiles of pixels, in a buffer with atomic sums. They take half the memory of bins for pixels,
//! but hair of a tile's pixels begins at different depths, so that one layer for all is too thin for some of them and
//! too thick for others; and additive blending needs no atomics. A layer that ends at the edge of a bin: stores 30 %
//! more nodes than the fewest, not 7 %.

use bytemuck::{Pod, Zeroable, bytes_of};

use crate::frame::{Frame, cleared, depth, kept};
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::settings::DepthShift;
use crate::stage::{COLOR, Context, HairPass, OVER, ScreenPass, depth_test, entry, storage, target, uniform};
use crate::strands::Part;
use crate::transparency::Technique;
use crate::transparency::bands::{self, MOST_BANDS, Plan, allocation, band_buffer, storage_buffer, words};
use crate::transparency::chain;
use crate::transparency::opaque::{LINEAR, Layer, Nearest, PLAIN, loaded};
use crate::transparency::weighted::{ADD, sum_format};

const OWNER: &str = "dbk";
const DEPTHS: &str = include_str!("../../shaders/transparency/dbk.wgsl");
const ENDS: &str = include_str!("../../shaders/transparency/dbk_ends.wgsl");
const FILL: &str = include_str!("../../shaders/transparency/dbk_fill.wgsl");
const RESOLVE: &str = include_str!("../../shaders/transparency/dbk_resolve.wgsl");

/// Targets with four bins each.
const BIN_TARGETS: usize = 3;
/// Format of the bins.
const BINS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// Where the first bin ends, in mean distances between opaque fibers.
const FIRST_EDGE: f32 = 0.5;
/// How much farther each bin reaches than the one before. With 12 bins the last but one reaches a hundred mean
/// distances.
const EDGE_RATIO: f32 = 1.7;

/// Nodes per pixel until a frame was counted.
const FIRST_NODES: f64 = 4.0;
/// Bytes of a node in each of its two buffers.
const NODE_BYTES: u64 = 8;
/// Bytes of a pixel's head.
const HEAD_BYTES: u64 = 4;

/// Twin of `DbkNumbers` in the shaders.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Numbers {
    wanted: f32,
    shift: f32,
    _pad: [f32; 2],
    edges: [[f32; 4]; BIN_TARGETS],
}

/// Where bins end, behind the nearest fragment. `spacing` is the mean distance between fibers, `opacity` that of
/// one that fills its pixel, `far` the depth behind which nothing is.
fn edges(spacing: f32, opacity: f32, far: f32) -> [[f32; 4]; BIN_TARGETS] {
    // A groom without volume has no spacing worth the name; its layers need not be fine.
    let spacing = spacing.min(0.1 * far).max(1e-6 * far);
    let first = FIRST_EDGE * spacing / opacity.clamp(0.05, 1.0);
    let last = 4 * BIN_TARGETS - 1;
    std::array::from_fn(|four| {
        std::array::from_fn(|one| {
            let bin = 4 * four + one;
            // The last bin holds all that is left.
            if bin == last { f32::MAX } else { first * EDGE_RATIO.powi(bin as i32) }
        })
    })
}

/// Texts of the passes, with what those that sort share.
#[derive(Debug)]
struct Texts {
    depths: String,
    ends: String,
    fill: String,
    resolve: String,
}

impl Texts {
    fn new() -> Self {
        let text = |part| chain::text(chain::LONGEST, &[part]);
        Self { depths: text(DEPTHS), ends: ENDS.to_owned(), fill: text(FILL), resolve: text(RESOLVE) }
    }
}

/// What is kept for one size of picture.
#[derive(Debug)]
struct Room {
    plan: Plan,
    nearest: Nearest,
    bins: Option<[Layer; BIN_TARGETS]>,
    ends: Layer,
    rest: Layer,
    heads: wgpu::Buffer,
    links: wgpu::Buffer,
    payloads: wgpu::Buffer,
    counters: wgpu::Buffer,
}

impl Room {
    fn new(gpu: &Gpu, plan: Plan, automatic: bool) -> Self {
        let size = plan.size;
        let bins = automatic.then(|| std::array::from_fn(|_| Layer::new(gpu, "dbk bins", size, BINS)));
        let [heads, links, payloads] = Self::lists(gpu, &plan);
        Self {
            plan,
            nearest: Nearest::new(gpu, size, 1),
            bins,
            ends: Layer::new(gpu, "dbk ends", size, LINEAR),
            rest: Layer::new(gpu, "dbk rest", size, sum_format(gpu)),
            heads,
            links,
            payloads,
            counters: storage_buffer(gpu, "dbk counters", 4 * u64::from(MOST_BANDS)),
        }
    }

    /// Heads, links and payloads.
    fn lists(gpu: &Gpu, plan: &Plan) -> [wgpu::Buffer; 3] {
        let nodes = NODE_BYTES * u64::from(plan.capacity);
        [("dbk heads", HEAD_BYTES * plan.pixels()), ("dbk links", nodes), ("dbk payloads", nodes)]
            .map(|(label, size)| storage_buffer(gpu, label, size))
    }
}

/// Layouts of group 3.
#[derive(Debug)]
struct Layouts {
    /// The numbers and the nearest depths.
    depths: wgpu::BindGroupLayout,
    /// The same and the bins.
    bins: wgpu::BindGroupLayout,
    fill: wgpu::BindGroupLayout,
    resolve: wgpu::BindGroupLayout,
}

impl Layouts {
    fn new(gpu: &Gpu) -> Self {
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let numbers = entry(0, fragment, uniform());
        let plain = |binding| loaded(binding, PLAIN, wgpu::TextureViewDimension::D2);
        let buffer = |binding, read_only| entry(binding, fragment, storage(read_only));
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        Self {
            depths: layout("dbk depths", &[numbers, plain(1)]),
            bins: layout("dbk bins", &[numbers, plain(1), plain(2), plain(3), plain(4)]),
            fill: layout(
                "dbk fill",
                &[numbers, plain(1), buffer(2, false), buffer(3, false), buffer(4, false), buffer(5, false)],
            ),
            resolve: layout(
                "dbk resolve",
                &[
                    numbers,
                    buffer(1, true),
                    buffer(2, true),
                    buffer(3, true),
                    loaded(4, wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
                    plain(5),
                    plain(6),
                ],
            ),
        }
    }
}

/// Group 3 with resources at bindings 0, 1, 2 ...
fn group(gpu: &Gpu, layout: &wgpu::BindGroupLayout, resources: &[wgpu::BindingResource<'_>]) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("dbk"), layout, entries: &entries })
}

fn shown(layer: &Layer) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::TextureView(&layer.view)
}

/// See the head of this file.
#[derive(Debug)]
pub(crate) struct Dbk {
    shift: DepthShift,
    layouts: Layouts,
    texts: Texts,
    room: Option<Room>,
    /// Nodes that each band of the last frame wanted.
    wanted: Option<Vec<u32>>,
}

impl Dbk {
    pub(crate) fn new(gpu: &Gpu, shift: DepthShift) -> Self {
        Self { shift, layouts: Layouts::new(gpu), texts: Texts::new(), room: None, wanted: None }
    }

    fn numbers(&self, context: &Context<'_>) -> Numbers {
        let (wanted, shift) = match self.shift {
            DepthShift::Automatic { opacity } => (-(1.0 - opacity).ln(), 0.0),
            DepthShift::Fixed(shift) => (0.0, shift),
        };
        let edges = edges(context.spacing, context.settings.geometry.opacity, context.view.far);
        Numbers { wanted, shift, _pad: [0.0; 2], edges }
    }

    /// A pass that draws all hair.
    fn hair(
        context: &Context<'_>,
        mut pass: wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        shades: bool,
        technique: Option<&wgpu::BindGroup>,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        if shades {
            pass.set_bind_group(2, context.shading_group, &[]);
        }
        if let Some(technique) = technique {
            pass.set_bind_group(3, technique, &[]);
        }
        context.hair.draw(&mut pass, Part::All);
    }

    /// Finds out where the hair begins and where layers end.
    fn measure(&self, context: &Context<'_>, frame: &mut Frame, room: &Room) {
        let (gpu, shape) = (context.gpu, context.settings.geometry.shape);
        let numbers = gpu.buffer("dbk numbers", bytes_of(&self.numbers(context)), wgpu::BufferUsages::UNIFORM);
        let nearest = context.stage.hair(
            gpu,
            &HairPass {
                label: "dbk nearest",
                part: &self.texts.depths,
                fragment: "dbk_nearest",
                shades: false,
                technique: None,
                targets: &[target(LINEAR, None)],
                depth: Some(depth_test(true)),
                shape,
            },
        );
        let colors = [cleared(&room.nearest.depths.view, wgpu::Color::TRANSPARENT)];
        let pass = frame.render(OWNER, "nearest", &colors, Some(depth(&room.nearest.test.view, true)));
        Self::hair(context, pass, &nearest, false, None);

        let depths = group(gpu, &self.layouts.depths, &[numbers.as_entire_binding(), shown(&room.nearest.depths)]);
        let (label, fragment, layout, technique) = match &room.bins {
            None => ("dbk ends fixed", "dbk_ends_fixed", &self.layouts.depths, depths),
            Some(bins) => {
                let pipeline = context.stage.hair(
                    gpu,
                    &HairPass {
                        label: "dbk bins",
                        part: &self.texts.depths,
                        fragment: "dbk_bins",
                        shades: false,
                        technique: Some(&self.layouts.depths),
                        targets: &[target(BINS, Some(ADD)), target(BINS, Some(ADD)), target(BINS, Some(ADD))],
                        depth: None,
                        shape,
                    },
                );
                let colors = bins.each_ref().map(|layer| cleared(&layer.view, wgpu::Color::TRANSPARENT));
                let pass = frame.render(OWNER, "bins", &colors, None);
                Self::hair(context, pass, &pipeline, false, Some(&depths));
                let [a, b, c] = bins.each_ref().map(shown);
                let resources = [numbers.as_entire_binding(), shown(&room.nearest.depths), a, b, c];
                let technique = group(gpu, &self.layouts.bins, &resources);
                ("dbk ends automatic", "dbk_ends_automatic", &self.layouts.bins, technique)
            }
        };
        let ends = context.stage.screen(
            gpu,
            &ScreenPass {
                label,
                part: &self.texts.ends,
                fragment,
                shades: false,
                technique: Some(layout),
                targets: &[target(LINEAR, None)],
                depth: None,
            },
        );
        let colors = [cleared(&room.ends.view, wgpu::Color::TRANSPARENT)];
        let mut pass = frame.render(OWNER, "ends", &colors, None);
        pass.set_pipeline(&ends);
        pass.set_bind_group(0, context.view_group, &[]);
        pass.set_bind_group(3, &technique, &[]);
        pass.draw(0..3, 0..1);
    }

    /// The nearest fragments behind the layers.
    fn behind(&self, context: &Context<'_>, frame: &mut Frame, room: &Room, technique: &wgpu::BindGroup) {
        let pipeline = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "dbk behind",
                part: &self.texts.fill,
                fragment: "dbk_behind",
                shades: true,
                technique: Some(&self.layouts.fill),
                targets: &Nearest::targets(),
                depth: Some(depth_test(true)),
                shape: context.settings.geometry.shape,
            },
        );
        let pass = room.nearest.begin(frame, OWNER, "behind".to_owned(), 0);
        Self::hair(context, pass, &pipeline, true, Some(technique));
    }
}

impl Technique for Dbk {
    fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        let limits = bands::Room::new(gpu, HEAD_BYTES, NODE_BYTES);
        let wanted = self.wanted.take();
        match &mut self.room {
            Some(room) if room.plan.size == size => {
                if let Some(plan) = wanted.and_then(|wanted| room.plan.refit(&wanted, limits)) {
                    // The old lists go before there are new ones.
                    for old in [&room.heads, &room.links, &room.payloads] {
                        old.destroy();
                    }
                    [room.heads, room.links, room.payloads] = Room::lists(gpu, &plan);
                    room.plan = plan;
                }
            }
            room => {
                *room = None;
                let automatic = matches!(self.shift, DepthShift::Automatic { .. });
                *room = Some(Room::new(gpu, Plan::first(size, FIRST_NODES, limits), automatic));
            }
        }
    }

    fn record(&mut self, context: &Context<'_>, frame: &mut Frame) {
        let Some(room) = &self.room else { return };
        let gpu = context.gpu;
        let fill = context.stage.hair(
            gpu,
            &HairPass {
                label: "dbk fill",
                part: &self.texts.fill,
                fragment: "dbk_fill",
                shades: true,
                technique: Some(&self.layouts.fill),
                targets: &[target(room.rest.texture.format(), Some(ADD))],
                depth: None,
                shape: context.settings.geometry.shape,
            },
        );
        let resolve = context.stage.screen(
            gpu,
            &ScreenPass {
                label: "dbk resolve",
                part: &self.texts.resolve,
                fragment: "dbk_resolve",
                shades: true,
                technique: Some(&self.layouts.resolve),
                targets: &[target(COLOR, Some(OVER))],
                depth: None,
            },
        );
        frame.encoder.clear_buffer(&room.counters, 0, None);
        self.measure(context, frame, room);
        for (index, &band) in room.plan.bands.iter().enumerate() {
            let numbers = band_buffer(gpu, &room.plan, index);
            let [heads, links, payloads, counters] =
                [&room.heads, &room.links, &room.payloads, &room.counters].map(|buffer| buffer.as_entire_binding());
            let store = group(
                gpu,
                &self.layouts.fill,
                &[
                    numbers.as_entire_binding(),
                    shown(&room.ends),
                    heads.clone(),
                    links.clone(),
                    payloads.clone(),
                    counters,
                ],
            );
            let load = group(
                gpu,
                &self.layouts.resolve,
                &[
                    numbers.as_entire_binding(),
                    heads,
                    links,
                    payloads,
                    shown(&room.nearest.payloads),
                    shown(&room.nearest.depths),
                    shown(&room.rest),
                ],
            );
            // Once for all bands; the group is one of those that have what it needs.
            if index == 0 {
                self.behind(context, frame, room, &store);
            }
            frame.encoder.clear_buffer(&room.heads, 0, None);
            let rest =
                if index == 0 { cleared(&room.rest.view, wgpu::Color::TRANSPARENT) } else { kept(&room.rest.view) };
            let mut pass = frame.render(OWNER, room.plan.name("fill", index), &[rest], None);
            room.plan.confine(&mut pass, band);
            Self::hair(context, pass, &fill, true, Some(&store));

            let colors = [kept(&context.targets.color_view)];
            let mut pass = frame.render(OWNER, room.plan.name("resolve", index), &colors, None);
            room.plan.confine(&mut pass, band);
            pass.set_pipeline(&resolve);
            pass.set_bind_group(0, context.view_group, &[]);
            pass.set_bind_group(2, context.shading_group, &[]);
            pass.set_bind_group(3, &load, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    fn fragments(&mut self, gpu: &Gpu) -> Result<Fragments, GpuError> {
        let Some(room) = &self.room else { return Ok(Fragments::default()) };
        let mut wanted = words(&gpu.fetch(&room.counters)?);
        wanted.truncate(room.plan.bands.len());
        let mut fragments = Fragments::default();
        for &nodes in &wanted {
            let stored = nodes.min(room.plan.capacity);
            fragments.stored += u64::from(stored);
            fragments.dropped += u64::from(nodes - stored);
        }
        self.wanted = Some(wanted);
        Ok(fragments)
    }

    fn memory(&self) -> Vec<Allocation> {
        let Some(room) = &self.room else { return Vec::new() };
        let mut memory = vec![
            allocation(OWNER, "heads", room.heads.size()),
            allocation(OWNER, "links", room.links.size()),
            allocation(OWNER, "payloads", room.payloads.size()),
            allocation(OWNER, "counters", room.counters.size()),
        ];
        memory.extend(room.nearest.memory(OWNER));
        memory.extend(room.bins.iter().flatten().map(|layer| layer.memory(OWNER, "depth bins")));
        memory.push(room.ends.memory(OWNER, "layer ends"));
        memory.push(room.rest.memory(OWNER, "rest"));
        memory
    }
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use math::hash;

    use super::*;
    use crate::transparency::opaque::stubs;

    #[test]
    fn its_shaders_are_valid() {
        let texts = Texts::new();
        stubs::check_hair(&texts.depths, false, &["dbk_nearest", "dbk_bins"]);
        stubs::check_screen(&texts.ends, false, &["dbk_ends_fixed", "dbk_ends_automatic"]);
        stubs::check_hair(&texts.fill, true, &["dbk_fill", "dbk_behind"]);
        stubs::check_screen(&texts.resolve, true, &["dbk_resolve"]);
    }

    #[test]
    fn numbers_are_where_the_shaders_expect_them() {
        for text in [DEPTHS, ENDS] {
            // The structure alone: the rest of the text needs what stands in front of it.
            let begin = text.find("struct DbkNumbers").expect("it is declared");
            let end = begin + text[begin..].find('}').expect("it ends") + 1;
            let module = naga::front::wgsl::parse_str(&text[begin..end]).expect("it is valid by itself");
            let (_, numbers) =
                module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("DbkNumbers")).expect("it");
            let naga::TypeInner::Struct { members, span } = &numbers.inner else { panic!("{numbers:?}") };
            let offsets: Vec<(&str, usize)> =
                members.iter().map(|m| (m.name.as_deref().unwrap_or_default(), m.offset as usize)).collect();
            assert_eq!(
                offsets,
                [
                    ("wanted", offset_of!(Numbers, wanted)),
                    ("shift", offset_of!(Numbers, shift)),
                    ("edges", offset_of!(Numbers, edges)),
                ]
            );
            assert_eq!(*span as usize, size_of::<Numbers>());
        }
    }

    #[test]
    fn bins_follow_each_other_and_hold_everything() {
        for (spacing, opacity, far) in [(0.3, 1.0, 50.0), (0.3, 0.0, 50.0), (f32::MAX, 0.5, 1e-6), (0.0, 1.0, 1e6)] {
            let edges = edges(spacing, opacity, far);
            let edges = edges.as_flattened();
            assert!(edges[0] > 0.0, "{edges:?}");
            assert!(edges.is_sorted_by(|a, b| a < b), "{edges:?}");
            assert!(edges[edges.len() - 1] >= far, "nothing is behind the last one: {edges:?}");
        }
        // A hundred mean distances of opaque fibers before bins are no longer told apart.
        let edges = edges(0.3, 1.0, 500.0);
        assert!((edges[2][2] / 30.0 - 1.0).abs() < 0.02, "{edges:?}");
    }

    /// Thickness of the layer of a pixel with these fragments (depth behind the nearest, optical depth); `None`: all.
    /// Twin of `dbk_bins` and `dbk_ends_automatic`.
    fn search(fragments: &[(f32, f32)], wanted: f32, edges: &[f32], most: f32) -> Option<f32> {
        let mut amounts = vec![0.0; edges.len()];
        for &(d, amount) in fragments {
            amounts[edges.partition_point(|&edge| edge < d)] += amount;
        }
        let (mut sum, mut begin) = (0.0, 0.0_f32);
        for (&edge, &amount) in edges.iter().zip(&amounts) {
            let end = edge.min(most).max(begin);
            if amount > 0.0 && sum + amount >= wanted {
                return Some(begin + (end - begin) * ((wanted - sum) / amount).sqrt());
            }
            (sum, begin) = (sum + amount, end);
        }
        None
    }

    /// Layers of hair of even density, from sparse to dense: as opaque as they were to be, without many fragments that
    /// they need not hold.
    #[test]
    fn an_automatic_layer_is_as_opaque_as_it_was_to_be() {
        let far = 120.0;
        let edges = edges(1.0, 1.0, far);
        for left in [0.01_f32, 0.03] {
            let wanted = -left.ln();
            let (mut through, mut nodes, mut fewest) = (0.0_f64, 0.0_f64, 0.0_f64);
            for pixel in 0..2000 {
                // Opacity of a fragment; optical depth per mean distance between fibers, which differs from place to
                // place.
                let alpha = 0.1 + 0.5 * hash::unit(pixel, 1);
                let amount = -(1.0 - alpha).ln();
                let density = 0.3 + 2.7 * hash::unit(pixel, 2);
                let count = (60.0 * density / amount) as u32;
                let mut depths: Vec<f32> = (0..count).map(|i| 60.0 * hash::unit(i, 3 + pixel)).collect();
                depths.sort_by(f32::total_cmp);
                let nearest = depths[0];
                let fragments: Vec<(f32, f32)> = depths.iter().map(|d| (d - nearest, amount)).collect();
                let layer = search(&fragments, wanted, edges.as_flattened(), far - nearest);
                let layer = layer.expect("every pixel has hair enough");
                let stored = fragments.iter().filter(|(d, _)| *d <= layer).count();
                through += f64::from((-(stored as f32) * amount).exp());
                nodes += stored as f64;
                fewest += f64::from((wanted / amount).ceil());
            }
            // With six other seeds, of 0.01: 0.0069 to 0.0072, and 1.061 to 1.074; of 0.03: 0.0226 to 0.0230, and 1.055
            // to 1.062. Layers that end at edges of bins need 1.30.
            let through = through / 2000.0;
            assert!(through < f64::from(left), "mean transmittance {through}, not {left}");
            assert!((1.0..1.15).contains(&(nodes / fewest)), "{nodes} nodes where {fewest} would do");
        }
    }

    #[test]
    fn a_pixel_with_less_hair_than_that_keeps_all() {
        let edges = edges(1.0, 1.0, 100.0);
        let few = [(0.0, 1.0), (3.0, 1.0), (70.0, 1.0)];
        assert_eq!(search(&few, 3.1, edges.as_flattened(), 90.0), None);
        // Just enough: up to the end of the bin that holds the last of them.
        let layer = search(&few, 3.0, edges.as_flattened(), 90.0).expect("there is enough");
        assert!((70.0..90.01).contains(&layer), "{layer}");
        // Nothing is asked for: the nearest alone, whose depth is 0.
        assert_eq!(search(&few, 0.0, edges.as_flattened(), 90.0), Some(0.0));
    }
}
