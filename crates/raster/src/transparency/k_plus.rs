//! K+-buffer: the `k` nearest fragments of each pixel, found without keeping the others.
//!
//! # Theory
//!
//! Vasilakis and Fudos 2014; section 5.2 of Hunz 2016. Three forms:
//!
//! - *Lock-free*, ours and the default. The hair is drawn twice. The first time every fragment takes its depth along
//!   the slots of its pixel: an atomic minimum leaves the nearer of two there, and the other one goes on. Whatever the
//!   order in which fragments come, slot `i` ends with the `i`-th nearest depth. The second time a fragment looks for
//!   its depth and puts its payload there; those that have no slot are added up (colour and optical depth) and blended
//!   behind the others, which the paper leaves out. Of fragments at exactly the same depth each gets a slot of its own.
//!   Both passes compute depths by the same expression; where a driver gives it other last digits in one of them all
//!   the same, a fragment does not find its slot. It is blended behind the others then, and its slot, which holds a
//!   depth and no payload, is counted as a fragment dropped: in the right place it is missing, and drawing again does
//!   not bring it back.
//!   With deferred shading the colour of those behind is the mean of those kept, so that no more than `k` are shaded.
//! - *Max-array* and *max-heap*, the paper's. A semaphore per pixel keeps fragments apart; the array's first entry is
//!   the farthest one, the heap has the farthest at its root. Slots that hold nothing count as infinitely far, so no
//!   number of entries is kept, and a fragment that is behind the first entry never asks for the semaphore. Asking is
//!   bounded: a fragment that asked 4,096 times in vain is dropped and counted. What is behind the `k` is left out.
//!
//! # Resources
//!
//! | buffer | size | written by |
//! |---|---|---|
//! | slots | 4 `k` bytes a pixel | depths; fill |
//! | payloads | 8 `k` bytes a pixel | payloads; fill |
//! | tail, lock-free only | 8 bytes a pixel: colour times optical depth, optical depth, as halves | payloads |
//! | locks, not lock-free | 4 bytes a pixel, and a counter | fill |
//! | counts | 4 bytes a row of the picture | resolve |
//!
//! Depths are kept as `0x7fffffff` less their bits: cleared memory is then "infinitely far", the nearest of two is the
//! larger number, and the highest bit is free to say that a slot has its payload.
//!
//! # Rejected
//!
//! - 64-bit atomics, which need one pass only: not in WebGPU.
//! - The semaphore as the default: nothing in WebGPU promises that its holder gets on while its neighbours spin, nor
//!   that others see what it wrote before they see the semaphore free.
//! - Slots by a depth that both passes are bound to agree about, which is that of `@invariant` positions alone. Their `w`
//!   reaches fragment shaders as it is on Direct3D 12 and inverted elsewhere, and naga leaves it so (gfx-rs/wgpu issue
//!   4963). Depth from `z` has steps of up to 6e-4 of itself where the near plane is a 10,000th of the far one.
//! - Counting stored fragments where they are stored: an atomic operation on one address for each of them. Rows are
//!   counted when they are blended.

use crate::frame::{Frame, cleared, kept};
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::settings::{KPlusForm, ShadingTime, Transparency};
use crate::stage::{COLOR, Context, HairPass, OVER, ScreenPass, entry, target, texture, texture_2d, texture_bytes};
use crate::strands::Part;
use crate::transparency::Technique;
use crate::transparency::bands::{
    Plan, Room, allocation, band_buffer, group, layout, layout_with, storage_buffer, untouched, words,
};
use crate::transparency::chain::{self, by_count};

const FREE: &str = include_str!("../../shaders/transparency/k_plus.wgsl");
const LOCK: &str = include_str!("../../shaders/transparency/k_plus_lock.wgsl");
const RESOLVE: &str = include_str!("../../shaders/transparency/k_plus_resolve.wgsl");

const DEPTHS_LABELS: [&str; 17] = by_count!("k-plus depths");
const PAYLOADS_LABELS: [&str; 17] = by_count!("k-plus payloads");
const ORDERED_LABELS: [&str; 17] = by_count!("k-plus resolve");
const ARRAY_LABELS: [&str; 17] = by_count!("k-plus array fill");
const HEAP_LABELS: [&str; 17] = by_count!("k-plus heap fill");
const UNORDERED_LABELS: [&str; 17] = by_count!("k-plus unordered resolve");

/// Whether what has no slot is blended behind the others; the paper leaves it out.
const TAIL: bool = true;

/// Format of what is added up behind the slots.
const TAIL_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// In a slot of the lock-free form: its payload is there.
#[cfg(test)]
const TAKEN: u32 = 0x8000_0000;

/// The nearest fragments.
#[derive(Debug)]
pub(crate) struct KPlus {
    k: u32,
    form: KPlusForm,
    owner: &'static str,
    fill_layout: wgpu::BindGroupLayout,
    resolve_layout: wgpu::BindGroupLayout,
    store: Option<Store>,
}

/// Buffers for pictures of one size.
#[derive(Debug)]
struct Store {
    plan: Plan,
    slots: wgpu::Buffer,
    payloads: wgpu::Buffer,
    /// Of the forms with a semaphore.
    locks: Option<wgpu::Buffer>,
    /// Of the form without.
    tail: Option<(wgpu::Texture, wgpu::TextureView)>,
    /// Stored fragments of each row, then those that were dropped: slots without a payload, or fragments that the
    /// semaphore was not free for.
    counts: wgpu::Buffer,
    /// Per band: to fill, to resolve.
    groups: Vec<[wgpu::BindGroup; 2]>,
    drawn: bool,
}

impl KPlus {
    /// See [`Transparency::KPlus`].
    pub(crate) fn new(gpu: &Gpu, k: u32, form: KPlusForm) -> Self {
        let (fill_layout, resolve_layout) = if form == KPlusForm::LockFree {
            let sampled = texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);
            let tail = entry(4, wgpu::ShaderStages::FRAGMENT, sampled);
            (layout(gpu, "k-plus fill", &[false; 2]), layout_with(gpu, "k-plus resolve", &[true, true, false], &[tail]))
        } else {
            (layout(gpu, "k-plus fill", &[false; 3]), layout(gpu, "k-plus resolve", &[true, true, false]))
        };
        Self {
            k: k.clamp(1, chain::LONGEST),
            form,
            owner: Transparency::KPlus { k, form }.name(),
            fill_layout,
            resolve_layout,
            store: None,
        }
    }

    /// What the last frame kept, nearest first: depth bits and payload of each fragment, pixel by pixel. Empty when
    /// nothing was drawn, or the frame had several bands.
    #[cfg(test)]
    pub(crate) fn slots(&self, gpu: &Gpu, size: [u32; 2]) -> Result<chain::Lists, GpuError> {
        let one_band = |store: &&Store| store.drawn && store.plan.size == size && store.plan.bands.len() == 1;
        let Some(store) = self.store.as_ref().filter(one_band) else { return Ok(Vec::new()) };
        let (slots, payloads) = (words(&gpu.fetch(&store.slots)?), words(&gpu.fetch(&store.payloads)?));
        let free = self.form == KPlusForm::LockFree;
        let k = self.k as usize;
        let pixel = |(slots, payloads): (&[u32], &[u32])| {
            let mut kept: Vec<(u32, [u32; 2])> = slots
                .iter()
                .zip(payloads.chunks_exact(2))
                .filter(|&(&slot, _)| if free { slot >= TAKEN } else { slot != 0 })
                .map(|(&slot, payload)| (!TAKEN - (slot & !TAKEN), [payload[0], payload[1]]))
                .collect();
            if !free {
                kept.sort_unstable();
            }
            kept
        };
        Ok(slots.chunks_exact(k).zip(payloads.chunks_exact(2 * k)).map(pixel).collect())
    }
}

impl Store {
    fn new(gpu: &Gpu, owner: &KPlus, size: [u32; 2]) -> Self {
        let k = u64::from(owner.k);
        // Payloads are the largest; semaphores need less than them, and their counter fits where counters are.
        let plan = Plan::even(size, Room::new(gpu, 8 * k, 8).pixels);
        let slots = storage_buffer(gpu, "k-plus slots", 4 * k * plan.pixels());
        let payloads = storage_buffer(gpu, "k-plus payloads", 8 * k * plan.pixels());
        let free = owner.form == KPlusForm::LockFree;
        let locks = (!free).then(|| storage_buffer(gpu, "k-plus locks", 4 * (1 + plan.pixels())));
        let tail = free.then(|| {
            let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
            let texture = gpu.device.create_texture(&texture_2d("k-plus tail", plan.size, 1, TAIL_FORMAT, usage));
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            (texture, view)
        });
        let counts = storage_buffer(gpu, "k-plus counts", 4 * (u64::from(plan.size[1]) + 1));
        let groups = (0..plan.bands.len())
            .map(|band| {
                let uniform = band_buffer(gpu, &plan, band);
                let filled: Vec<&wgpu::Buffer> = [&slots, &payloads].into_iter().chain(&locks).collect();
                let tail = tail.as_ref().map(|(_, view)| view);
                [
                    group(gpu, &owner.fill_layout, &uniform, &filled, None),
                    group(gpu, &owner.resolve_layout, &uniform, &[&slots, &payloads, &counts], tail),
                ]
            })
            .collect();
        Self { plan, slots, payloads, locks, tail, counts, groups, drawn: false }
    }
}

/// What all texts begin with.
fn constants(k: u32, when: ShadingTime) -> String {
    format!(
        "const K_PLUS_LENGTH: u32 = {k}u;\nconst K_PLUS_TAIL: bool = {TAIL};\nconst K_PLUS_TAIL_COLORS: bool = {};\n",
        when == ShadingTime::Forward
    )
}

/// WGSL that fills the slots: `k_plus_depths` and `k_plus_store`, or `k_plus_fill`.
fn fill_text(k: u32, form: KPlusForm, when: ShadingTime) -> String {
    let constants = constants(k, when);
    match form {
        KPlusForm::LockFree => chain::text(1, &[&constants, FREE]),
        KPlusForm::MaxArray => chain::text(1, &[&constants, LOCK, &insert_into_array(k)]),
        KPlusForm::MaxHeap => chain::text(1, &[&constants, LOCK, &insert_into_heap(k)]),
    }
}

/// WGSL that blends the slots: `k_plus_ordered`, `k_plus_unordered`.
fn resolve_text(k: u32, when: ShadingTime) -> String {
    chain::text(k, &[&constants(k, when), RESOLVE])
}

/// Puts a fragment in the place of the farthest; the farthest of those that are left goes to the front.
///
/// Written out, because a loop would stand inside the one that waits for the semaphore.
fn insert_into_array(k: u32) -> String {
    let steps: String = (1..k)
        .map(|i| {
            format!(
                "    let key_{i} = atomicLoad(&k_plus_slots[base + {i}u]);\n    place = select(place, {i}u, key_{i} < \
                 least);\n    least = min(least, key_{i});\n"
            )
        })
        .collect();
    format!(
        "fn k_plus_insert(base: u32, key: u32, payload: vec2u) {{
    if key <= atomicLoad(&k_plus_slots[base]) {{
        return;
    }}
    var least = key;
    var place = 0u;
{steps}    if place != 0u {{
        k_plus_move(base, base + place);
    }}
    k_plus_put(base + place, key, payload);
}}
"
    )
}

/// Puts a fragment in the place of the root, and lets it sink to where all below are nearer. Written out likewise.
fn insert_into_heap(k: u32) -> String {
    let levels: String = (0..k.max(1).ilog2())
        .map(|i| {
            format!(
                "    let left_{i} = k_plus_node(base, 2u * hole + 1u);
    let right_{i} = k_plus_node(base, 2u * hole + 2u);
    sinks = sinks && min(left_{i}, right_{i}) < key;
    if sinks {{
        let child = 2u * hole + select(1u, 2u, right_{i} < left_{i});
        k_plus_move(base + hole, base + child);
        hole = child;
    }}
"
            )
        })
        .collect();
    format!(
        "fn k_plus_insert(base: u32, key: u32, payload: vec2u) {{
    if key <= atomicLoad(&k_plus_slots[base]) {{
        return;
    }}
    var hole = 0u;
    var sinks = true;
{levels}    k_plus_put(base + hole, key, payload);
}}
"
    )
}

impl Technique for KPlus {
    fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        let size = size.map(|side| side.max(1));
        if self.store.as_ref().is_none_or(|store| store.plan.size != size) {
            // The old buffers go before there are new ones.
            self.store = None;
            self.store = Some(Store::new(gpu, self, size));
        }
    }

    fn record(&mut self, context: &Context<'_>, frame: &mut Frame) {
        let Some(store) = &mut self.store else { return };
        let (k, form, owner) = (self.k, self.form, self.owner);
        let when = context.settings.shading.when;
        let fill_text = fill_text(k, form, when);
        let hair = |labels: &[&'static str; 17], fragment, target| {
            context.stage.hair(
                context.gpu,
                &HairPass {
                    label: labels[k as usize],
                    part: &fill_text,
                    fragment,
                    // The text holds all passes, and one of them shades: the others have to know its functions too.
                    shades: true,
                    technique: Some(&self.fill_layout),
                    targets: &[target],
                    depth: None,
                    shape: context.settings.geometry.shape,
                },
            )
        };
        let add = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let tail_target = target(TAIL_FORMAT, Some(wgpu::BlendState { color: add, alpha: add }));
        // Name, pipeline, whether it draws into the tail.
        let fills = match form {
            KPlusForm::LockFree => vec![
                ("depths", hair(&DEPTHS_LABELS, "k_plus_depths", untouched()), false),
                ("payloads", hair(&PAYLOADS_LABELS, "k_plus_store", tail_target), true),
            ],
            KPlusForm::MaxArray => vec![("fill", hair(&ARRAY_LABELS, "k_plus_fill", untouched()), false)],
            KPlusForm::MaxHeap => vec![("fill", hair(&HEAP_LABELS, "k_plus_fill", untouched()), false)],
        };
        let (labels, fragment) = match form {
            KPlusForm::LockFree => (&ORDERED_LABELS, "k_plus_ordered"),
            KPlusForm::MaxArray | KPlusForm::MaxHeap => (&UNORDERED_LABELS, "k_plus_unordered"),
        };
        let resolve = context.stage.screen(
            context.gpu,
            &ScreenPass {
                label: labels[k as usize],
                part: &resolve_text(k, when),
                fragment,
                shades: true,
                technique: Some(&self.resolve_layout),
                targets: &[target(COLOR, Some(OVER))],
                depth: None,
            },
        );
        let color = &context.targets.color_view;
        frame.encoder.clear_buffer(&store.counts, 0, None);
        for (i, (&band, [fill_group, resolve_group])) in store.plan.bands.iter().zip(&store.groups).enumerate() {
            frame.encoder.clear_buffer(&store.slots, 0, None);
            if let Some(locks) = &store.locks {
                // The counter goes on from band to band.
                frame.encoder.clear_buffer(locks, if i == 0 { 0 } else { 4 }, None);
            }
            for (name, pipeline, tailed) in &fills {
                let attachment = match &store.tail {
                    // Clearing is not confined to a band.
                    Some((_, tail)) if *tailed && i == 0 => cleared(tail, wgpu::Color::TRANSPARENT),
                    Some((_, tail)) if *tailed => kept(tail),
                    _ => kept(color),
                };
                let mut pass = frame.render(owner, store.plan.name(name, i), &[attachment], None);
                store.plan.confine(&mut pass, band);
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, context.view_group, &[]);
                pass.set_bind_group(2, context.shading_group, &[]);
                pass.set_bind_group(3, fill_group, &[]);
                context.hair.draw(&mut pass, Part::All);
            }
            let mut pass = frame.render(owner, store.plan.name("resolve", i), &[kept(color)], None);
            store.plan.confine(&mut pass, band);
            pass.set_pipeline(&resolve);
            pass.set_bind_group(0, context.view_group, &[]);
            pass.set_bind_group(2, context.shading_group, &[]);
            pass.set_bind_group(3, resolve_group, &[]);
            pass.draw(0..3, 0..1);
        }
        if let Some(locks) = &store.locks {
            let rows = 4 * u64::from(store.plan.size[1]);
            frame.encoder.copy_buffer_to_buffer(locks, 0, &store.counts, rows, 4);
        }
        store.drawn = true;
    }

    fn fragments(&mut self, gpu: &Gpu) -> Result<Fragments, GpuError> {
        let Some(store) = self.store.as_ref().filter(|store| store.drawn) else { return Ok(Fragments::default()) };
        let counts = words(&gpu.fetch(&store.counts)?);
        let (rows, rest) = counts.split_at(store.plan.size[1] as usize);
        let sum = |counts: &[u32]| counts.iter().copied().map(u64::from).sum::<u64>();
        Ok(Fragments { stored: sum(rows), dropped: sum(rest) })
    }

    fn memory(&self) -> Vec<Allocation> {
        let Some(store) = &self.store else { return Vec::new() };
        let mut memory: Vec<Allocation> =
            [("slots", &store.slots), ("payloads", &store.payloads), ("counts", &store.counts)]
                .map(|(name, buffer)| allocation(self.owner, name, buffer.size()))
                .into();
        memory.extend(store.locks.as_ref().map(|locks| allocation(self.owner, "locks", locks.size())));
        memory.extend(store.tail.as_ref().map(|(tail, _)| allocation(self.owner, "tail", texture_bytes(tail))));
        memory
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transparency::chain::stubs;

    #[test]
    fn shaders_are_valid_for_every_k_and_form() {
        for k in 1..=chain::LONGEST {
            for when in [ShadingTime::Forward, ShadingTime::Deferred] {
                for (form, expected) in [
                    (KPlusForm::LockFree, &["k_plus_depths", "k_plus_store"][..]),
                    (KPlusForm::MaxArray, &["k_plus_fill"][..]),
                    (KPlusForm::MaxHeap, &["k_plus_fill"][..]),
                ] {
                    let points = stubs::hair(&fill_text(k, form, when));
                    assert_eq!(points.unwrap_or_else(|error| panic!("{k} {form:?}: {error}")), expected);
                }
                let text = resolve_text(k, when);
                let points = stubs::screen(&text).unwrap_or_else(|error| panic!("{k}: {error}"));
                assert_eq!(points, ["k_plus_ordered", "k_plus_unordered"]);
                assert!(!text.contains("// <"), "a line was not replaced:\n{text}");
            }
        }
    }

    #[test]
    fn a_heap_has_as_many_levels_as_its_deepest_node_needs() {
        for k in 1..=chain::LONGEST {
            // From the last node up to the root.
            let (mut node, mut levels) = (k - 1, 0);
            while node > 0 {
                node = (node - 1) / 2;
                levels += 1;
            }
            assert_eq!(insert_into_heap(k).matches("k_plus_move").count(), levels, "{k}");
            assert_eq!(insert_into_array(k).matches("atomicLoad").count(), k as usize, "{k}");
        }
    }
}
