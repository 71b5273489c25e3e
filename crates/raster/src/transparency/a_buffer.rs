//! A-buffer: every fragment in a list per pixel, sorted and blended when all are there.
//!
//! # Theory
//!
//! Carpenter 1984, as lists on the GPU by Yang et al. 2010; section 5.1 of Hunz 2016. The fully sorted form is what
//! the other techniques are compared with. Ours differs in that
//!
//! - lists of any length are sorted exactly: a list is walked once for each 16 fragments, and those next in depth are
//!   kept in registers. Walking ends where nothing shines through any more;
//! - the form that blends the `k` foremost only (section 5.2 there, after Yu et al. 2012) blends what lies behind them
//!   as one fragment with their joint opacity and their mean colour, weighted by optical depth. With deferred shading
//!   that would shade everything, so the mean colour is then that of the foremost;
//! - fragments that find no room are counted, and the next frame has the room. Where that is more than a shader can
//!   see at once, the picture is drawn in bands.
//!
//! # Resources
//!
//! | buffer | size | written by |
//! |---|---|---|
//! | heads | 4 bytes a pixel of a band, and a counter for each of at most 256 bands | fill |
//! | links | 8 bytes a fragment: depth bits, next node | fill |
//! | payloads | 8 bytes a fragment: see `fragment_payload` | fill |
//!
//! Room is made for 8 fragments a pixel at first, then for 1.1 times those that were counted; it is given back where
//! it is more than 1.25 times that.
//!
//! # Rejected
//!
//! - One buffer of nodes: 16 bytes each let a binding of 128 MiB hold half as many.
//! - Sorting in an array in private memory: slow, limited in length, and wrong on one driver when done while walking.
//! - Counting before filling (a pass over the hair, then a prefix sum): it needs no second attempt, but every frame
//!   pays for it, and a moving picture needs the second attempt once.

use crate::frame::{Frame, kept};
use crate::gpu::{Gpu, GpuError};
use crate::meter::{Allocation, Fragments};
use crate::settings::{ShadingTime, Transparency};
use crate::stage::{COLOR, Context, HairPass, OVER, ScreenPass, target};
use crate::strands::Part;
use crate::transparency::Technique;
use crate::transparency::bands::{
    MOST_BANDS, Plan, Room, allocation, band_buffer, group, layout, storage_buffer, untouched, words,
};
use crate::transparency::chain::{self, by_count};

const FILL: &str = include_str!("../../shaders/transparency/a_buffer.wgsl");
const RESOLVE: &str = include_str!("../../shaders/transparency/a_buffer_resolve.wgsl");

/// Labels of the last pass by the number of foremost fragments; the first one is for all.
const RESOLVE_LABELS: [&str; 17] = by_count!("a-buffer resolve");

/// Fragments a pixel that there is room for before any were counted.
const FIRST_PER_PIXEL: f64 = 8.0;

/// Whether what lies behind the foremost fragments is blended as one; the thesis leaves it out.
const TAIL: bool = true;

/// Bytes of a node in each of its two buffers.
const NODE_BYTES: u64 = 8;

/// Lists of all fragments.
#[derive(Debug)]
pub(crate) struct ABuffer {
    foremost: Option<u32>,
    owner: &'static str,
    fill_layout: wgpu::BindGroupLayout,
    resolve_layout: wgpu::BindGroupLayout,
    /// Once a frame was drawn.
    texts: Option<Texts>,
    /// What was counted last, with something in reserve: for pictures of another size.
    per_pixel: f64,
    /// What the next frame is to be drawn with, if that is something else.
    next: Option<Plan>,
    store: Option<Store>,
}

/// Buffers for pictures of one size.
#[derive(Debug)]
struct Store {
    plan: Plan,
    heads: wgpu::Buffer,
    links: wgpu::Buffer,
    payloads: wgpu::Buffer,
    /// A copy of the counters.
    counts: wgpu::Buffer,
    /// Per band: to fill, to resolve.
    groups: Vec<[wgpu::BindGroup; 2]>,
    drawn: bool,
}

impl ABuffer {
    /// `foremost`: see [`Transparency::ABuffer`].
    pub(crate) fn new(gpu: &Gpu, foremost: Option<u32>) -> Self {
        Self {
            foremost: foremost.map(|k| k.clamp(1, chain::LONGEST)),
            owner: Transparency::ABuffer { foremost }.name(),
            fill_layout: layout(gpu, "a-buffer fill", &[false; 3]),
            resolve_layout: layout(gpu, "a-buffer resolve", &[true; 3]),
            texts: None,
            per_pixel: FIRST_PER_PIXEL,
            next: None,
            store: None,
        }
    }

    /// The lists of the last frame, nearest first: depth bits and payload of each fragment, pixel by pixel. Empty when
    /// nothing was drawn, or the frame had several bands.
    #[cfg(test)]
    pub(crate) fn lists(&self, gpu: &Gpu, size: [u32; 2]) -> Result<chain::Lists, GpuError> {
        let one_band = |store: &&Store| store.drawn && store.plan.size == size && store.plan.bands.len() == 1;
        let Some(store) = self.store.as_ref().filter(one_band) else { return Ok(Vec::new()) };
        let (heads, links, payloads) =
            (words(&gpu.fetch(&store.heads)?), words(&gpu.fetch(&store.links)?), words(&gpu.fetch(&store.payloads)?));
        let list = |head: &u32| -> Vec<(u32, [u32; 2])> {
            let mut nodes = Vec::new();
            let mut node = *head;
            while node != 0 {
                let at = 2 * (node as usize - 1);
                nodes.push((links[at], node, [payloads[at], payloads[at + 1]]));
                node = links[at + 1];
            }
            nodes.sort_unstable();
            nodes.into_iter().map(|(depth, _, payload)| (depth, payload)).collect()
        };
        Ok(heads[MOST_BANDS as usize..].iter().map(list).collect())
    }
}

impl Store {
    fn new(gpu: &Gpu, plan: Plan, fill_layout: &wgpu::BindGroupLayout, resolve_layout: &wgpu::BindGroupLayout) -> Self {
        let heads = storage_buffer(gpu, "a-buffer heads", 4 * (u64::from(MOST_BANDS) + plan.pixels()));
        let nodes = |label| storage_buffer(gpu, label, NODE_BYTES * u64::from(plan.capacity));
        let (links, payloads) = (nodes("a-buffer links"), nodes("a-buffer payloads"));
        let counts = storage_buffer(gpu, "a-buffer counts", 4 * plan.bands.len() as u64);
        let groups = (0..plan.bands.len())
            .map(|band| {
                let uniform = band_buffer(gpu, &plan, band);
                [fill_layout, resolve_layout]
                    .map(|layout| group(gpu, layout, &uniform, &[&heads, &links, &payloads], None))
            })
            .collect();
        Self { plan, heads, links, payloads, counts, groups, drawn: false }
    }
}

/// Room for lists.
fn room(gpu: &Gpu) -> Room {
    Room::new(gpu, 4, NODE_BYTES)
}

/// WGSL of the passes for one time of shading: long, and the same for many frames.
#[derive(Debug)]
struct Texts {
    when: ShadingTime,
    fill: String,
    resolve: String,
}

impl Texts {
    fn new(foremost: Option<u32>, when: ShadingTime) -> Self {
        Self { when, fill: fill_text(when), resolve: resolve_text(foremost, when) }
    }
}

/// What all texts begin with.
fn constants(when: ShadingTime) -> String {
    format!(
        "const A_BUFFER_COUNTERS: u32 = {MOST_BANDS}u;\nconst A_BUFFER_TAIL: bool = {TAIL};\nconst \
         A_BUFFER_TAIL_COLORS: bool = {};\n",
        when == ShadingTime::Forward
    )
}

/// WGSL that fills the lists: `a_buffer_fill`.
fn fill_text(when: ShadingTime) -> String {
    chain::text(1, &[&constants(when), FILL])
}

/// WGSL that blends the lists: `a_buffer_all`, `a_buffer_foremost`.
fn resolve_text(foremost: Option<u32>, when: ShadingTime) -> String {
    chain::text(foremost.unwrap_or(chain::LONGEST), &[&constants(when), RESOLVE])
}

impl Technique for ABuffer {
    fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        let size = size.map(|side| side.max(1));
        let fits = self.store.as_ref().is_some_and(|store| store.plan.size == size);
        let plan = match self.next.take().filter(|plan| plan.size == size) {
            Some(plan) => plan,
            None if fits => return,
            None => Plan::first(size, self.per_pixel, room(gpu)),
        };
        // The old buffers go before there are new ones.
        self.store = None;
        self.store = Some(Store::new(gpu, plan, &self.fill_layout, &self.resolve_layout));
    }

    fn record(&mut self, context: &Context<'_>, frame: &mut Frame) {
        let when = context.settings.shading.when;
        let texts = match self.texts.take() {
            Some(texts) if texts.when == when => self.texts.insert(texts),
            _ => self.texts.insert(Texts::new(self.foremost, when)),
        };
        let Some(store) = &mut self.store else { return };
        let fill = context.stage.hair(
            context.gpu,
            &HairPass {
                label: "a-buffer fill",
                part: &texts.fill,
                fragment: "a_buffer_fill",
                shades: true,
                technique: Some(&self.fill_layout),
                targets: &[untouched()],
                depth: None,
                shape: context.settings.geometry.shape,
            },
        );
        let resolve = context.stage.screen(
            context.gpu,
            &ScreenPass {
                label: RESOLVE_LABELS[self.foremost.unwrap_or(0) as usize],
                part: &texts.resolve,
                fragment: if self.foremost.is_some() { "a_buffer_foremost" } else { "a_buffer_all" },
                shades: true,
                technique: Some(&self.resolve_layout),
                targets: &[target(COLOR, Some(OVER))],
                depth: None,
            },
        );
        let color = &context.targets.color_view;
        for (i, (&band, [fill_group, resolve_group])) in store.plan.bands.iter().zip(&store.groups).enumerate() {
            // The counters of the bands before stay.
            let from = if i == 0 { 0 } else { 4 * u64::from(MOST_BANDS) };
            frame.encoder.clear_buffer(&store.heads, from, None);
            {
                let mut pass = frame.render(self.owner, store.plan.name("fill", i), &[kept(color)], None);
                store.plan.confine(&mut pass, band);
                pass.set_pipeline(&fill);
                pass.set_bind_group(0, context.view_group, &[]);
                pass.set_bind_group(2, context.shading_group, &[]);
                pass.set_bind_group(3, fill_group, &[]);
                context.hair.draw(&mut pass, Part::All);
            }
            let mut pass = frame.render(self.owner, store.plan.name("resolve", i), &[kept(color)], None);
            store.plan.confine(&mut pass, band);
            pass.set_pipeline(&resolve);
            pass.set_bind_group(0, context.view_group, &[]);
            pass.set_bind_group(2, context.shading_group, &[]);
            pass.set_bind_group(3, resolve_group, &[]);
            pass.draw(0..3, 0..1);
        }
        frame.encoder.copy_buffer_to_buffer(&store.heads, 0, &store.counts, 0, store.counts.size());
        store.drawn = true;
    }

    fn fragments(&mut self, gpu: &Gpu) -> Result<Fragments, GpuError> {
        let Some(store) = self.store.as_ref().filter(|store| store.drawn) else { return Ok(Fragments::default()) };
        let counts = words(&gpu.fetch(&store.counts)?);
        let plan = &store.plan;
        let mut fragments = Fragments::default();
        for &count in &counts {
            fragments.stored += u64::from(count.min(plan.capacity));
            fragments.dropped += u64::from(count.saturating_sub(plan.capacity));
        }
        let [width, height] = plan.size.map(f64::from);
        self.per_pixel = 1.1 * (fragments.stored + fragments.dropped) as f64 / (width * height);
        self.next = plan.refit(&counts, room(gpu));
        Ok(fragments)
    }

    fn memory(&self) -> Vec<Allocation> {
        let Some(store) = &self.store else { return Vec::new() };
        [("heads", &store.heads), ("links", &store.links), ("payloads", &store.payloads), ("counts", &store.counts)]
            .map(|(name, buffer)| allocation(self.owner, name, buffer.size()))
            .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transparency::chain::stubs;

    #[test]
    fn shaders_are_valid_for_every_length() {
        for when in [ShadingTime::Forward, ShadingTime::Deferred] {
            let points = stubs::hair(&fill_text(when)).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(points, ["a_buffer_fill"]);
            for foremost in std::iter::once(None).chain((1..=chain::LONGEST).map(Some)) {
                let text = resolve_text(foremost, when);
                let points = stubs::screen(&text).unwrap_or_else(|error| panic!("{foremost:?}: {error}"));
                assert_eq!(points, ["a_buffer_all", "a_buffer_foremost"]);
                assert!(!text.contains("// <"), "a line was not replaced:\n{text}");
                let farthest = foremost.unwrap_or(16) - 1;
                assert!(text.contains(&format!("chain_before(carry, chain_{farthest})")), "{text}");
            }
        }
    }
}
