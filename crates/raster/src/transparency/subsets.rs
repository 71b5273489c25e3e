//! Random subsets of the strands, each drawn as if it were opaque, blended in the order of their depths.
//!
//! *Theory:* section 5.4 of the thesis: `k` random subsets, each with a depth test of its own, give `k` fragments per
//! pixel whose depths are samples of where the pixel's hair is; sorted and blended they look transparent. No list is
//! kept and no atomic is needed. Changed here: the thesis blends with one opacity for all, so that what is behind hair
//! depends on `k` and on luck. Here one more pass adds up the optical depth `τ = -Σ ln(1 - α)` of *all* fragments of
//! the pixel, and shares it out among the layers present by their own: with `t_i = -ln(1 - α_i)` layer `i` gets the
//! opacity `1 - exp(-τ t_i / Σ t)`. Together they let through `exp(-τ)`, as the fragments do, and a faint fragment in
//! front of an opaque one stays faint. Only colours are approximated. (An opaque fragment counts as `τ = ln 10⁴`.)
//!
//! *Resources:* per pixel and subset a payload and a linear depth (12 bytes); per pixel a depth buffer (4 bytes) and
//! the optical depth (4 bytes), each written by hair passes. A pass over all pixels sorts and blends. The strands are
//! in random order, so a subset is a range of them and all subsets together cost one drawing of the hair. Where the
//! device cannot blend 32-bit floats the optical depth is a half (2 bytes), which stops growing when what is added is
//! less than a 4096th of it.
//!
//! *Rejected:* shading subsets to colours and blending these by the hardware from back to front. The order of subsets
//! differs from pixel to pixel. Also: as many texture bindings as subsets; a layered texture is one.

use crate::frame::{Frame, cleared};
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::stage::{COLOR, Context, HairPass, OVER, ScreenPass, target};
use crate::strands::Part;
use crate::transparency::Technique;
use crate::transparency::chain::by_count;
use crate::transparency::opaque::{Layer, Nearest, PLAIN, draw_screen, loaded};
use crate::transparency::weighted::{ADD, sum_format};
use std::fmt::Write as _;

const OWNER: &str = "subsets";
const HAIR: &str = include_str!("../../shaders/transparency/subsets.wgsl");
const RESOLVE: &str = include_str!("../../shaders/transparency/subsets_resolve.wgsl");

/// Most subsets.
const MOST: u32 = 16;

/// Names of the resolving pipelines by number of layers: their texts differ.
const LABELS: [&str; MOST as usize + 1] = by_count!("subsets resolve");

/// Pairs of places to compare and exchange that sort `n` things whatever their order: Batcher's merge exchange
/// (Knuth, *The Art of Computer Programming* 5.2.2, algorithm M).
fn network(n: usize) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    if n < 2 {
        return pairs;
    }
    let top = n.next_power_of_two() / 2;
    let mut p = top;
    while p > 0 {
        let (mut q, mut r, mut d) = (top, 0, p);
        loop {
            pairs.extend((0..n - d).filter(|i| i & p == r).map(|i| (i, i + d)));
            if q == p {
                break;
            }
            d = q - p;
            q /= 2;
            r = p;
        }
        p /= 2;
    }
    pairs
}

/// Text of the pass that sorts and blends `layers` layers. They are kept in variables of their own and not in an
/// array: a shader that indexes an array by computed numbers keeps it in memory.
fn resolve_text(layers: usize) -> String {
    let mut text = RESOLVE.to_owned();
    let _ = writeln!(text, "\n@fragment\nfn subsets_resolve(@builtin(position) at: vec4f) -> @location(0) vec4f {{");
    let _ = writeln!(text, "    let pixel = vec2i(at.xy);");
    for i in 0..layers {
        let _ = writeln!(text, "    var s{i} = subsets_layer(pixel, {i}u);");
    }
    for (a, b) in network(layers) {
        let _ = writeln!(text, "    if s{b}.x < s{a}.x {{ let t = s{a}; s{a} = s{b}; s{b} = t; }}");
    }
    let present: Vec<String> = (0..layers).map(|i| format!("u32(s{i}.x != SUBSETS_EMPTY)")).collect();
    let _ = writeln!(text, "    let count = {};", present.join(" + "));
    let _ = writeln!(text, "    if count == 0u {{ discard; }}");
    // What a layer's own optical depth is multiplied by.
    let own: Vec<String> = (0..layers).map(|i| format!("subsets_depth(pixel, s{i})")).collect();
    let _ = writeln!(text, "    let own = {};", own.join(" + "));
    let _ = writeln!(text, "    let scale = min(textureLoad(subsets_opacities, pixel, 0).x, 60000.0) / own;");
    let _ = writeln!(text, "    var front = vec4f(0.0, 0.0, 0.0, 1.0);");
    // A loop, so that shading is in the text once.
    let _ = writeln!(text, "    for (var i = 0u; i < count; i++) {{");
    let _ = writeln!(text, "        var layer = s0;");
    for i in 1..layers {
        let _ = writeln!(text, "        layer = select(layer, s{i}, i == {i}u);");
    }
    let _ = writeln!(text, "        front = subsets_behind(front, layer, at.xy, scale);");
    let _ = writeln!(text, "    }}");
    let _ = writeln!(text, "    return vec4f(front.rgb, 1.0 - front.w);\n}}");
    text
}

#[derive(Debug)]
struct Room {
    size: [u32; 2],
    nearest: Nearest,
    opacity: Layer,
    group: wgpu::BindGroup,
}

/// See the head of this file.
#[derive(Debug)]
pub(crate) struct Subsets {
    /// How many the strands are divided into.
    of: u32,
    layout: wgpu::BindGroupLayout,
    text: String,
    room: Option<Room>,
}

impl Subsets {
    /// All of `k` subsets, `1..=16`.
    pub(crate) fn new(gpu: &Gpu, k: u32) -> Self {
        let of = k.clamp(1, MOST);
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("subsets"),
            entries: &[
                loaded(0, wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2Array),
                loaded(1, PLAIN, wgpu::TextureViewDimension::D2Array),
                loaded(2, PLAIN, wgpu::TextureViewDimension::D2),
            ],
        });
        let text = resolve_text(of as usize);
        Self { of, layout, text, room: None }
    }

    /// The optical depth of the subsets that are drawn.
    fn opacity(&self, context: &Context<'_>, frame: &mut Frame, room: &Room) {
        let pipeline = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "subsets opacity",
                part: HAIR,
                fragment: "subsets_opacity",
                shades: false,
                technique: None,
                targets: &[target(sum_format(context.gpu), Some(ADD))],
                depth: None,
                shape: context.settings.geometry.shape,
            },
        );
        let colors = [cleared(&room.opacity.view, wgpu::Color::TRANSPARENT)];
        let mut pass = frame.render(OWNER, "opacity", &colors, None);
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, context.view_group, &[]);
        context.hair.draw(&mut pass, Part::All);
    }
}

impl Technique for Subsets {
    fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        if self.room.as_ref().is_some_and(|room| room.size == size) {
            return;
        }
        let nearest = Nearest::new(gpu, size, self.of);
        let opacity = Layer::new(gpu, "subsets opacity", size, sum_format(gpu));
        // Said here, since one layer alone is no array by default.
        let [payloads, depths] = [&nearest.payloads, &nearest.depths].map(|all| {
            all.texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            })
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("subsets"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&payloads) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&depths) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&opacity.view) },
            ],
        });
        self.room = Some(Room { size, nearest, opacity, group });
    }

    fn record(&mut self, context: &Context<'_>, frame: &mut Frame) {
        let Some(room) = &self.room else { return };
        for index in 0..self.of {
            let part = Part::Subset { index, of: self.of };
            room.nearest.gather(context, frame, OWNER, format!("subset {}", index + 1), index as usize, part);
        }
        self.opacity(context, frame, room);
        let pipeline = context.stage.screen(
            context.gpu,
            &ScreenPass {
                label: LABELS[self.of as usize],
                part: &self.text,
                fragment: "subsets_resolve",
                shades: true,
                technique: Some(&self.layout),
                targets: &[target(COLOR, Some(OVER))],
                depth: None,
            },
        );
        draw_screen(context, frame, [OWNER, "resolve"], &pipeline, Some(context.shading_group), &room.group);
    }

    fn fragments(&mut self, _gpu: &Gpu) -> Result<Fragments, GpuError> {
        Ok(Fragments::default())
    }

    fn memory(&self) -> Vec<Allocation> {
        let Some(room) = &self.room else { return Vec::new() };
        let mut memory = room.nearest.memory(OWNER);
        memory.push(room.opacity.memory(OWNER, "optical depth"));
        memory
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transparency::opaque::stubs;

    #[test]
    fn its_shaders_are_valid_for_every_number_of_layers() {
        stubs::check_hair(HAIR, false, &["subsets_opacity"]);
        for layers in 1..=MOST as usize {
            stubs::check_screen(&resolve_text(layers), true, &["subsets_resolve"]);
        }
    }

    /// What sorts all sequences of zeros and ones sorts everything (Knuth, theorem 5.3.4Z).
    #[test]
    fn the_network_sorts_whatever_comes() {
        for n in 1..=MOST as usize {
            let pairs = network(n);
            for bits in 0..1_u32 << n {
                let mut values: Vec<u32> = (0..n).map(|i| (bits >> i) & 1).collect();
                for &(a, b) in &pairs {
                    if values[b] < values[a] {
                        values.swap(a, b);
                    }
                }
                assert!(values.is_sorted(), "{n} values, {bits:b}: {values:?}");
            }
        }
    }
}
