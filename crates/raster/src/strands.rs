//! Strands on the device: uploaded once as points, expanded to ribbons or lines by the vertex shader.
//!
//! # Resources
//!
//! | buffer | bytes | holds |
//! |---|---|---|
//! | points | 16 a point | position, radius |
//! | marks | 8 a point | strand, entry of the palette, place along the strand |
//! | order | 4 a segment | first point of each segment, in the order of drawing |
//!
//! Strands lie in random order, seeded: any range of them is a random subset, and the first ones are a level of detail.
//! What does not fit into one binding goes into several batches, each with whole strands. A [`Portion`] is one use of
//! them: a share of the strands, a shape, and perhaps an order of its own.
//!
//! *Rejected:* vertex buffers with both ends of every piece. They need four times the memory, and again that for every
//! subdivision.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable, bytes_of, cast_slice};
use groom::Groom;
use math::{Vec3, hash};
use rayon::prelude::*;
use scene::{CurveBasis, Scene};

use crate::RasterError;
use crate::gpu::Gpu;
use crate::meter::Allocation;
use crate::palette::Palette;
use crate::settings::{Geometry, Shape, Sort};
use crate::stage::{Stage, entry, storage, uniform};
use crate::view::View;

const OWNER: &str = "strands";

/// Stream of the random order.
const SHUFFLE: u32 = 0x7368_7566;

/// Bytes of a point in the largest buffer.
const POINT_BYTES: u64 = 16;

/// Largest batch however large bindings may be: with 16 subdivisions its vertices still have 32-bit numbers.
const MOST_BATCH_BYTES: u64 = 256 << 20;

/// Cells along the longest side of the box in which [`Strands::mean_spacing`] looks for hair.
const CELLS: f32 = 64.0;

/// Slabs of depth that several batches are drawn in, when they are sorted.
const SLABS: usize = 64;

/// Twin of `HairGeometry` in `shaders/strands.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct HairGeometry {
    width: f32,
    opacity: f32,
    subdivisions: u32,
    curved: u32,
    slanted: u32,
}

/// Marks of a point, besides its entry; the shader knows them too.
const ROOT: u32 = 1 << 16;
const TIP: u32 = 1 << 17;
const U_SHIFT: u32 = 18;
const U_MOST: f32 = 16383.0;

/// All strands of a scene, numbered through in the order of its grooms.
#[derive(Debug)]
struct Source {
    grooms: Vec<Arc<Groom>>,
    /// Strands before each groom.
    firsts: Vec<u32>,
    count: u32,
}

impl Source {
    fn new(grooms: Vec<Arc<Groom>>) -> Result<Self, RasterError> {
        let found: u64 = grooms.iter().map(|groom| groom.strand_count() as u64).sum();
        let most = u64::from(u32::MAX);
        let count = u32::try_from(found).map_err(|_| RasterError::TooLarge { what: "strands", found, most })?;
        let firsts = grooms.iter().scan(0_u32, |before, groom| {
            let first = *before;
            *before += groom.strand_count() as u32;
            Some(first)
        });
        let firsts = firsts.collect();
        Ok(Self { grooms, firsts, count })
    }

    /// Groom and strand within it.
    fn locate(&self, strand: u32) -> (usize, usize) {
        let groom = self.firsts.partition_point(|&first| first <= strand).saturating_sub(1);
        (groom, (strand - self.firsts[groom]) as usize)
    }

    fn points(&self, strand: u32) -> &[Vec3] {
        let (groom, strand) = self.locate(strand);
        self.grooms[groom].strand(strand)
    }

    /// Points with their radii, root first.
    fn widths(&self, strand: u32) -> impl ExactSizeIterator<Item = (Vec3, f32)> {
        let (groom, strand) = self.locate(strand);
        let groom = &self.grooms[groom];
        let radii = groom.radius.as_deref().unwrap_or_default();
        // A scene's grooms have radii; hair without would be invisible.
        groom.point_range(strand).map(move |i| (groom.points()[i], radii.get(i).copied().unwrap_or(0.0)))
    }

    /// Sum of length times diameter.
    fn area(&self, strand: u32) -> f32 {
        let mut sum = 0.0;
        let mut last: Option<(Vec3, f32)> = None;
        for (p, r) in self.widths(strand) {
            if let Some((q, s)) = last {
                sum += p.distance(q) * (r + s);
            }
            last = Some((p, r));
        }
        sum
    }

    /// The box around all curves, widths included.
    fn bounds(&self, curved: bool) -> Option<(Vec3, Vec3)> {
        let strands = (0..self.count).into_par_iter();
        let boxes: Vec<(Vec3, Vec3)> = strands.filter_map(|strand| self.strand_bounds(strand, curved)).collect();
        boxes.into_iter().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    fn strand_bounds(&self, strand: u32, curved: bool) -> Option<(Vec3, Vec3)> {
        let points = self.points(strand);
        let mut bounds: Option<(Vec3, Vec3)> = None;
        let mut reach = |p: Vec3, radius: f32| {
            let (lo, hi) = bounds.unwrap_or((p, p));
            bounds = Some((lo.min(p - radius), hi.max(p + radius)));
        };
        let mut last_radius = 0.0_f32;
        for (i, (p, radius)) in self.widths(strand).enumerate() {
            reach(p, radius);
            if curved && i > 0 {
                // The span's Bézier points hold it: it may swing out between its ends. Nowhere is it wider than at the
                // wider one of them.
                let from = points[i - 1];
                let before = if i > 1 { points[i - 2] } else { from + from - p };
                let after = if i + 1 < points.len() { points[i + 1] } else { p + p - from };
                let wider = radius.max(last_radius);
                reach(from + (p - before) / 6.0, wider);
                reach(p - (after - from) / 6.0, wider);
            }
            last_radius = radius;
        }
        bounds
    }

    /// Volume of the cells that hold hair over the sum of length times diameter.
    fn mean_spacing(&self, bounds: Option<(Vec3, Vec3)>) -> f32 {
        let Some((least, greatest)) = bounds else { return f32::MAX };
        let longest = (greatest - least).max_element();
        let area: f64 = (0..self.count).map(|strand| f64::from(self.area(strand))).sum();
        if !(longest > 0.0 && longest.is_finite() && area > 0.0) {
            return f32::MAX;
        }
        let cell = longest / CELLS;
        let cells = ((greatest - least) / cell).to_array().map(|n| (n.ceil() as usize).clamp(1, CELLS as usize));
        let mut occupied = vec![false; cells[0] * cells[1] * cells[2]];
        let mut mark = |p: Vec3| {
            let at = ((p - least) / cell).to_array();
            let [x, y, z]: [usize; 3] = std::array::from_fn(|axis| (at[axis] as usize).min(cells[axis] - 1));
            occupied[(z * cells[1] + y) * cells[0] + x] = true;
        };
        for strand in 0..self.count {
            for ends in self.points(strand).windows(2) {
                // Half a cell a step passes no cell by but at its corners.
                let steps = (2.0 * ends[0].distance(ends[1]) / cell).ceil().max(1.0);
                for step in 0..=steps as u32 {
                    mark(ends[0].lerp(ends[1], step as f32 / steps));
                }
            }
        }
        let volume = occupied.iter().filter(|&&is| is).count() as f64 * f64::from(cell).powi(3);
        ((volume / area) as f32).min(f32::MAX)
    }
}

/// All numbers below `count` in an order that depends on `count` alone.
fn shuffled(count: u32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count).collect();
    for i in (1..count).rev() {
        // An even number in 0..=i, up to the bias of i in 2³².
        let j = (u64::from(hash::mix2(SHUFFLE, i)) * (u64::from(i) + 1)) >> 32;
        order.swap(i as usize, j as usize);
    }
    order
}

/// Part `index` of `of` equal parts of `0..count`; together the parts are the whole.
fn cut(count: u32, index: u32, of: u32) -> Range<u32> {
    let of = u64::from(of.max(1));
    let at = |i: u64| (u64::from(count) * i.min(of) / of) as u32;
    at(u64::from(index))..at(u64::from(index) + 1)
}

/// Strands whose points are in one buffer.
#[derive(Debug, PartialEq)]
struct Batch {
    /// Numbers of the strands, in their order in the buffer.
    strands: Vec<u32>,
    /// Segments before each strand, and the total. A strand has one point more than segments.
    firsts: Vec<u32>,
    /// Length times diameter of each strand.
    areas: Vec<f32>,
}

impl Batch {
    fn segments(&self) -> u32 {
        self.firsts.last().copied().unwrap_or(0)
    }

    /// Place of a strand's first point in the buffer.
    fn first_point(&self, place: usize) -> u32 {
        self.firsts[place] + place as u32
    }
}

/// Puts strands into batches of at most `most` points.
fn batches(source: &Source, order: &[u32], most: u64) -> Result<Vec<Batch>, RasterError> {
    let mut batches = Vec::new();
    let mut batch = Batch { strands: Vec::new(), firsts: vec![0], areas: Vec::new() };
    let mut points = 0;
    for &strand in order {
        let found = source.points(strand).len() as u64;
        if found > most {
            return Err(RasterError::TooLarge { what: "points of one strand", found, most });
        }
        if points + found > most {
            let next = Batch { strands: Vec::new(), firsts: vec![0], areas: Vec::new() };
            batches.push(std::mem::replace(&mut batch, next));
            points = 0;
        }
        points += found;
        let segments = batch.segments() + found as u32 - 1;
        batch.strands.push(strand);
        batch.firsts.push(segments);
        batch.areas.push(source.area(strand));
    }
    if !batch.strands.is_empty() {
        batches.push(batch);
    }
    Ok(batches)
}

/// What the three buffers of a batch hold.
struct Content {
    points: Vec<[f32; 4]>,
    marks: Vec<[u32; 2]>,
    order: Vec<u32>,
}

fn content(source: &Source, batch: &Batch, entries: &[Vec<u16>]) -> Content {
    let segments = batch.segments() as usize;
    let count = segments + batch.strands.len();
    let mut content = Content {
        points: Vec::with_capacity(count),
        marks: Vec::with_capacity(count),
        order: Vec::with_capacity(segments),
    };
    for &strand in &batch.strands {
        let (groom, within) = source.locate(strand);
        let first = source.grooms[groom].point_range(within).start;
        let widths = source.widths(strand);
        let last = widths.len() - 1;
        for (i, (p, radius)) in widths.enumerate() {
            let entry = entries.get(groom).and_then(|of| of.get(first + i)).copied().unwrap_or(0);
            let u = i as f32 / last as f32;
            let mut mark = u32::from(entry) | (((u * U_MOST).round() as u32) << U_SHIFT);
            if i == 0 {
                mark |= ROOT;
            }
            if i == last {
                mark |= TIP;
            } else {
                content.order.push(content.points.len() as u32);
            }
            content.points.push([p.x, p.y, p.z, radius]);
            content.marks.push([strand, mark]);
        }
    }
    content
}

/// How many strands of `count` a share is: at least one.
fn drawn(count: usize, share: f32) -> usize {
    ((count as f64 * f64::from(share)).round() as usize).clamp(usize::from(count > 0), count)
}

/// What widths are multiplied by when only the first strands of each batch are drawn, so that these cover what all
/// would.
fn widening<'a>(batches: impl Iterator<Item = &'a Batch>, share: f32) -> f32 {
    let (mut all, mut kept) = (0.0_f64, 0.0_f64);
    for batch in batches {
        let sum = |areas: &[f32]| areas.iter().map(|&area| f64::from(area)).sum::<f64>();
        all += sum(&batch.areas);
        kept += sum(&batch.areas[..drawn(batch.areas.len(), share)]);
    }
    // Strands without length or width cover nothing, whatever is done.
    if kept > 0.0 { (all / kept) as f32 } else { 1.0 }
}

/// A batch on the device.
#[derive(Debug)]
struct Uploaded {
    batch: Batch,
    points: wgpu::Buffer,
    marks: wgpu::Buffer,
    order: wgpu::Buffer,
}

/// A storage buffer with this content.
fn upload(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    // Not mapped: a device without memory for it answers with an error and not with a panic.
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// All hair of a scene, on the device.
#[derive(Debug)]
pub(crate) struct Strands {
    source: Arc<Source>,
    batches: Vec<Arc<Uploaded>>,
    curved: bool,
    /// See [`Gpu::slants_lines`].
    slanted: bool,
    bounds: Option<(Vec3, Vec3)>,
    spacing: f32,
}

impl Strands {
    /// Uploads the hair of a scene.
    pub(crate) fn new(gpu: &Gpu, scene: &Scene, palette: &Palette) -> Result<Self, RasterError> {
        Self::with_limit(gpu, scene, palette, gpu.largest_binding())
    }

    /// The same with bindings of at most `limit` bytes.
    pub(crate) fn with_limit(gpu: &Gpu, scene: &Scene, palette: &Palette, limit: u64) -> Result<Self, RasterError> {
        let source = Source::new(scene.grooms.iter().map(|groom| Arc::clone(&groom.groom)).collect())?;
        let curved = scene.render.curve_basis == CurveBasis::CatmullRom;
        let most = limit.min(gpu.largest_binding()).min(MOST_BATCH_BYTES) / POINT_BYTES;
        let mut uploaded = Vec::new();
        for batch in batches(&source, &shuffled(source.count), most)? {
            let content = content(&source, &batch, &palette.of_point);
            uploaded.push(Arc::new(Uploaded {
                points: upload(gpu, "strand points", cast_slice(&content.points)),
                marks: upload(gpu, "strand marks", cast_slice(&content.marks)),
                order: upload(gpu, "strand order", cast_slice(&content.order)),
                batch,
            }));
            // Else the copies of all batches wait for the first frame.
            gpu.queue.submit([]);
            gpu.check()?;
        }
        let bounds = source.bounds(curved);
        let spacing = source.mean_spacing(bounds);
        let slanted = gpu.slants_lines()?;
        Ok(Self { source: Arc::new(source), batches: uploaded, curved, slanted, bounds, spacing })
    }

    /// What one use of the strands binds and draws.
    pub(crate) fn portion(&self, gpu: &Gpu, stage: &Stage, geometry: &Geometry) -> Portion {
        let subdivisions = if self.curved { geometry.subdivisions.clamp(1, 16) } else { 1 };
        let numbers = HairGeometry {
            width: widening(self.batches.iter().map(|one| &one.batch), geometry.strands),
            opacity: geometry.opacity,
            subdivisions,
            curved: u32::from(self.curved),
            slanted: u32::from(self.slanted),
        };
        let numbers_buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("hair geometry"),
            size: size_of::<HairGeometry>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.queue.write_buffer(&numbers_buffer, 0, bytes_of(&numbers));
        let chunks: Vec<Chunk> = self
            .batches
            .iter()
            .map(|uploaded| Chunk {
                group: group(gpu, stage, &numbers_buffer, uploaded, &uploaded.order),
                uploaded: Arc::clone(uploaded),
                strands: drawn(uploaded.batch.strands.len(), geometry.strands),
            })
            .collect();
        let runs = chunks.iter().enumerate().map(|(chunk, one)| Run {
            chunk,
            segments: 0..one.uploaded.batch.firsts[one.strands],
            by_strand: true,
        });
        let runs = runs.collect();
        let vertices = subdivisions
            * match geometry.shape {
                Shape::Ribbon => 6,
                Shape::Line => 2,
            };
        Portion {
            shape: geometry.shape,
            source: Arc::clone(&self.source),
            numbers: numbers_buffer,
            chunks,
            runs,
            vertices,
        }
    }

    /// The box around all hair, widths included; `None` without hair.
    pub(crate) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    /// Segments between points, all strands together.
    pub(crate) fn segments(&self) -> u64 {
        self.batches.iter().map(|one| u64::from(one.batch.segments())).sum()
    }

    /// Expected distance between two fibers along a ray that meets them at right angles inside the hair, scene units:
    /// the volume that the hair takes up over the sum of its fibers' lengths times diameters. Very large without hair.
    pub(crate) fn mean_spacing(&self) -> f32 {
        self.spacing
    }

    /// What is kept on the device.
    pub(crate) fn memory(&self) -> Vec<Allocation> {
        let sum = |of: fn(&Uploaded) -> &wgpu::Buffer| self.batches.iter().map(|one| of(one).size()).sum::<u64>();
        let one = |name: &str, bytes| Allocation { owner: OWNER, name: name.to_owned(), bytes };
        vec![one("points", sum(|b| &b.points)), one("marks", sum(|b| &b.marks)), one("order", sum(|b| &b.order))]
    }
}

/// Layout of group 1.
pub(crate) fn layout_entries() -> Vec<wgpu::BindGroupLayoutEntry> {
    let vertex = wgpu::ShaderStages::VERTEX;
    vec![
        entry(0, vertex, uniform()),
        entry(1, vertex, storage(true)),
        entry(2, vertex, storage(true)),
        entry(3, vertex, storage(true)),
    ]
}

/// Group 1 for one batch.
fn group(
    gpu: &Gpu,
    stage: &Stage,
    numbers: &wgpu::Buffer,
    uploaded: &Uploaded,
    order: &wgpu::Buffer,
) -> wgpu::BindGroup {
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("strands"),
        layout: &stage.strands_layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: numbers.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: uploaded.points.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 2, resource: uploaded.marks.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 3, resource: order.as_entire_binding() },
        ],
    })
}

/// Which of the strands of a portion are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// All of them.
    All,
    /// Subset `index` of `of` random ones without common strands, which together are all.
    Subset {
        /// Which.
        index: u32,
        /// Of how many.
        of: u32,
    },
}

/// One batch of a portion.
#[derive(Clone, Debug)]
struct Chunk {
    uploaded: Arc<Uploaded>,
    group: wgpu::BindGroup,
    /// So many of the first strands are drawn.
    strands: usize,
}

/// One draw call.
#[derive(Clone, Debug, PartialEq)]
struct Run {
    chunk: usize,
    /// Range of the chunk's order.
    segments: Range<u32>,
    /// Whether they are those of its strands in the random order, so that subsets can be cut between strands.
    by_strand: bool,
}

/// Strands for one use: how many, in which shape, in which order. It keeps alive what it draws.
#[derive(Clone, Debug)]
pub(crate) struct Portion {
    /// What the pipeline must be made for.
    pub(crate) shape: Shape,
    source: Arc<Source>,
    numbers: wgpu::Buffer,
    chunks: Vec<Chunk>,
    runs: Vec<Run>,
    /// Vertices of a segment.
    vertices: u32,
}

impl Portion {
    /// Draws; the pipeline and all groups but 1 are set. Draws nothing when there is no hair.
    ///
    /// Subsets of a sorted portion are cut from its order: they are farther and nearer parts and not random ones.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, part: Part) {
        for run in &self.runs {
            let chunk = &self.chunks[run.chunk];
            let segments = match part {
                Part::All => run.segments.clone(),
                Part::Subset { index, of } if run.by_strand => {
                    let strands = cut(chunk.strands as u32, index, of);
                    let firsts = &chunk.uploaded.batch.firsts;
                    firsts[strands.start as usize]..firsts[strands.end as usize]
                }
                Part::Subset { index, of } => {
                    let cut = cut(run.segments.end - run.segments.start, index, of);
                    run.segments.start + cut.start..run.segments.start + cut.end
                }
            };
            if !segments.is_empty() {
                pass.set_bind_group(1, &chunk.group, &[]);
                pass.draw(segments.start * self.vertices..segments.end * self.vertices, 0..1);
            }
        }
    }

    /// The same portion from back to front as `view` sees it; [`Sort::None`] changes nothing.
    ///
    /// Where the hair does not fit into one binding, the order is exact between slabs of depth, and within a slab for
    /// each batch.
    pub(crate) fn sorted(&self, gpu: &Gpu, stage: &Stage, view: &View, sort: Sort) -> Self {
        let mut sorted = self.clone();
        if sort == Sort::None || self.chunks.is_empty() {
            return sorted;
        }
        let (eye, forward) = (Vec3::from(view.eye), Vec3::from(view.forward));
        let depth = |p: Vec3| (p - eye).dot(forward);
        let mut depths = Vec::with_capacity(self.chunks.len());
        for chunk in &mut sorted.chunks {
            let (order, at) = back_to_front(&self.source, &chunk.uploaded.batch, chunk.strands, depth, sort);
            let order = upload(gpu, "sorted strands", cast_slice(&order));
            chunk.group = group(gpu, stage, &self.numbers, &chunk.uploaded, &order);
            depths.push(at);
        }
        sorted.runs = slabs(&depths);
        sorted
    }

    /// Bytes of an order of its own, as [`sorted`](Self::sorted) makes one.
    pub(crate) fn order_bytes(&self) -> u64 {
        self.chunks.iter().map(|chunk| 4 * u64::from(chunk.uploaded.batch.firsts[chunk.strands])).sum()
    }
}

/// First points of the segments of the first `strands` strands, farthest first, and the depth by which each was
/// sorted.
fn back_to_front(
    source: &Source,
    batch: &Batch,
    strands: usize,
    depth: impl Fn(Vec3) -> f32 + Sync,
    sort: Sort,
) -> (Vec<u32>, Vec<f32>) {
    let segments = batch.firsts[strands] as usize;
    let farthest_first = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    let points = |place: usize| source.points(batch.strands[place]);
    let (mut order, mut depths) = (Vec::with_capacity(segments), Vec::with_capacity(segments));
    if sort == Sort::Pieces {
        let mut pieces: Vec<(f32, u32)> = (0..strands)
            .into_par_iter()
            .flat_map_iter(|place| {
                let first = batch.first_point(place);
                let middles = points(place).windows(2).map(|ends| depth(0.5 * (ends[0] + ends[1])));
                middles.enumerate().map(move |(i, at)| (at, first + i as u32)).collect::<Vec<_>>()
            })
            .collect();
        pieces.par_sort_unstable_by(farthest_first);
        order.extend(pieces.iter().map(|piece| piece.1));
        depths.extend(pieces.iter().map(|piece| piece.0));
        return (order, depths);
    }
    let middles = (0..strands).into_par_iter().map(|place| {
        let points = points(place);
        (depth(points[points.len() / 2]), place as u32)
    });
    let mut whole: Vec<(f32, u32)> = middles.collect();
    whole.par_sort_unstable_by(farthest_first);
    for (at, place) in whole {
        let points = points(place as usize);
        let first = batch.first_point(place as usize);
        let count = points.len() as u32 - 1;
        // Within a strand from its farther end.
        if depth(points[0]) >= depth(points[points.len() - 1]) {
            order.extend(first..first + count);
        } else {
            order.extend((first..first + count).rev());
        }
        depths.extend(std::iter::repeat_n(at, count as usize));
    }
    (order, depths)
}

/// Draw calls for batches that are sorted each for itself (`depths` fall within each): slab by slab of depth, farthest
/// first.
fn slabs(depths: &[Vec<f32>]) -> Vec<Run> {
    let run = |chunk, from: usize, to: usize| Run { chunk, segments: from as u32..to as u32, by_strand: false };
    if let [only] = depths {
        return vec![run(0, 0, only.len())];
    }
    let farthest = depths.iter().filter_map(|of| of.first()).fold(f32::NEG_INFINITY, |a, &b| a.max(b));
    let nearest = depths.iter().filter_map(|of| of.last()).fold(f32::INFINITY, |a, &b| a.min(b));
    let mut done = vec![0; depths.len()];
    let mut runs = Vec::new();
    for slab in 1..=SLABS {
        let to = farthest + (nearest - farthest) * (slab as f32 / SLABS as f32);
        for (chunk, (of, done)) in depths.iter().zip(&mut done).enumerate() {
            // The last slab takes all that is left, whatever rounding did to its border.
            let end = if slab == SLABS { of.len() } else { of.partition_point(|&at| at > to).max(*done) };
            if end > *done {
                runs.push(run(chunk, *done, end));
                *done = end;
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Strands of 2 to 9 points that wander about, with radii of their own.
    fn wild(strands: u32, seed: u32) -> Arc<Groom> {
        let counts: Vec<u32> = (0..strands).map(|s| 2 + hash::mix2(seed, s) % 8).collect();
        let total: u32 = counts.iter().sum();
        let number = |i: u32, axis: u32| hash::signed(i, hash::mix2(seed, axis));
        let points = (0..total).map(|i| Vec3::new(number(i, 1), 2.0 * number(i, 2), number(i, 3))).collect();
        let mut groom = Groom::new(points, counts).unwrap();
        groom.set_radius((0..total).map(|i| 0.01 * hash::unit(i, seed)).collect()).unwrap();
        Arc::new(groom)
    }

    fn source() -> Source {
        let empty = Arc::new(Groom::new(Vec::new(), []).unwrap());
        Source::new(vec![empty.clone(), wild(700, 1), empty.clone(), wild(300, 2), empty]).unwrap()
    }

    #[test]
    fn the_order_is_a_permutation_whose_beginning_is_random() {
        let order = shuffled(10_000);
        let mut back = order.clone();
        back.sort_unstable();
        assert!(back.iter().enumerate().all(|(i, &n)| i == n as usize));
        assert_eq!(order, shuffled(10_000));
        // The mean of 1000 of the numbers 0..10000 has a standard deviation of 86.6: five of them are passed with
        // probability 6e-7, and the order is fixed.
        for part in order.chunks(1000) {
            let mean = part.iter().map(|&n| f64::from(n)).sum::<f64>() / 1000.0;
            assert!((mean - 4999.5).abs() < 5.0 * 86.6, "{mean}");
        }
        assert!(shuffled(0).is_empty());
    }

    #[test]
    fn parts_are_the_whole_without_overlap() {
        for (count, of) in [(0, 3), (1, 8), (7, 8), (1000, 7), (u32::MAX, 16)] {
            let mut end = 0;
            for index in 0..of {
                let part = cut(count, index, of);
                assert_eq!(part.start, end);
                assert!(part.end - part.start <= count / of + 1);
                end = part.end;
            }
            assert_eq!(end, count);
        }
    }

    #[test]
    fn every_strand_is_in_one_batch_with_all_its_points() {
        let source = source();
        let entries: Vec<Vec<u16>> =
            source.grooms.iter().map(|g| (0..g.point_count()).map(|i| (i % 999) as u16).collect()).collect();
        let order = shuffled(source.count);
        for most in [9, 100, 1 << 20] {
            let batches = batches(&source, &order, most).unwrap();
            let mut seen = Vec::new();
            for batch in &batches {
                let content = content(&source, batch, &entries);
                assert!(content.points.len() as u64 <= most);
                assert_eq!(content.order.len(), batch.segments() as usize);
                assert_eq!(content.points.len(), content.marks.len());
                // Walk over the marks as a shader would, and find the strands again.
                let mut place = 0;
                for strand in &batch.strands {
                    let (groom, within) = source.locate(*strand);
                    let groom_points = source.grooms[groom].point_range(within);
                    assert_eq!(batch.first_point(seen.len() - first_of(&batches, batch)), place as u32);
                    for (i, point) in groom_points.clone().enumerate() {
                        let [name, mark] = content.marks[place];
                        let [x, y, z, radius] = content.points[place];
                        assert_eq!(name, *strand);
                        assert_eq!(mark & 0xffff, u32::from(entries[groom][point]));
                        assert_eq!(mark & ROOT != 0, i == 0);
                        assert_eq!(mark & TIP != 0, i + 1 == groom_points.len());
                        let u = (mark >> U_SHIFT) as f32 / U_MOST;
                        assert!((u - source.grooms[groom].u_of_point(within, point)).abs() < 1e-4);
                        assert_eq!(Vec3::new(x, y, z), source.grooms[groom].points()[point]);
                        assert_eq!(Some(radius), source.grooms[groom].radius.as_ref().map(|r| r[point]));
                        assert_eq!(content.order.contains(&(place as u32)), i + 1 < groom_points.len());
                        place += 1;
                    }
                    seen.push(*strand);
                }
                assert_eq!(place, content.points.len());
            }
            assert_eq!(seen, order);
        }
    }

    /// Strands in the batches before this one.
    fn first_of(batches: &[Batch], batch: &Batch) -> usize {
        batches.iter().take_while(|other| *other != batch).map(|other| other.strands.len()).sum()
    }

    #[test]
    fn a_strand_that_fits_no_buffer_is_refused() {
        let groom = Groom::new((0..12).map(|i| Vec3::X * i as f32).collect(), [2, 10]).unwrap();
        let source = Source::new(vec![Arc::new(groom)]).unwrap();
        let error = batches(&source, &[0, 1], 9).unwrap_err();
        assert_eq!(error, RasterError::TooLarge { what: "points of one strand", found: 10, most: 9 });
        assert_eq!(batches(&source, &[0, 1], 10).unwrap().len(), 2);
        let nothing = Source::new(Vec::new()).unwrap();
        assert_eq!(batches(&nothing, &[], 9).unwrap(), Vec::new());
        assert_eq!((nothing.bounds(true), nothing.mean_spacing(None)), (None, f32::MAX));
    }

    #[test]
    fn fewer_strands_cover_as_much() {
        let source = source();
        let batches = batches(&source, &shuffled(source.count), 500).unwrap();
        assert!(batches.len() > 5);
        let all: f64 = (0..source.count).map(|s| f64::from(source.area(s))).sum();
        for share in [1.0, 0.5, 0.1, 1e-9] {
            let width = widening(batches.iter(), share);
            let kept = batches.iter().flat_map(|batch| {
                let kept = drawn(batch.strands.len(), share);
                assert!(kept >= 1);
                batch.strands[..kept].iter()
            });
            let kept: f64 = kept.map(|&s| f64::from(source.area(s))).sum();
            assert!((kept * f64::from(width) / all - 1.0).abs() < 1e-6, "{share}: {width}");
        }
        assert_eq!(widening(batches.iter(), 1.0), 1.0);
        assert_eq!((drawn(0, 0.5), drawn(10, 0.26), drawn(10, f32::NAN)), (0, 3, 1));
        // Half of many random strands have about half of the area: one with a relative deviation of 0.7 a strand gives
        // 0.7 / √500 = 0.03 for the sum; four of them are passed with probability 6e-5.
        assert!((widening(batches.iter(), 0.5) - 2.0).abs() < 0.25);
    }

    #[test]
    fn a_grid_of_fibers_is_as_dense_as_it_is() {
        // 16 by 16 fibers, a quarter apart, 64 long: the box is 64 cells of 1 long and 4 by 4 cells wide.
        let radius = 0.01;
        let mut points = Vec::new();
        for (i, j) in (0..256).map(|k| (k % 16, k / 16)) {
            let (x, y) = (0.25 * i as f32, 0.25 * j as f32);
            points.extend([Vec3::new(x, y, 0.0), Vec3::new(x, y, 17.3), Vec3::new(x, y, 64.0)]);
        }
        let mut groom = Groom::new(points, [3; 256]).unwrap();
        groom.set_radius(vec![radius; 768]).unwrap();
        let source = Source::new(vec![Arc::new(groom)]).unwrap();
        // A ray across meets in each layer of a quarter a fiber with the probability of its diameter over a quarter.
        let expected = 0.25 * 0.25 / (2.0 * radius);
        // The box is a diameter larger than the fibers are long: a cell is 64.02 / 64, and its volume 1.0009.
        let spacing = source.mean_spacing(source.bounds(false));
        assert!((spacing / expected - 1.0).abs() < 2e-3, "{spacing} and {expected}");
    }

    #[test]
    fn the_box_holds_the_curve() {
        let source = source();
        let (lo, hi) = source.bounds(true).unwrap();
        let (low, high) = source.bounds(false).unwrap();
        let mut outside = 0;
        for strand in 0..source.count {
            let at: Vec<(Vec3, f32)> = source.widths(strand).collect();
            for i in 1..at.len() {
                let (b, c) = (at[i - 1].0, at[i].0);
                let a = if i > 1 { at[i - 2].0 } else { b + b - c };
                let d = if i + 1 < at.len() { at[i + 1].0 } else { c + c - b };
                for t in (0..=20).map(|k| k as f32 / 20.0) {
                    // Barry and Goldman's form: nested lines, not the polynomial.
                    let knot = |p: Vec3, q: Vec3, s: f32| p.lerp(q, t + s);
                    let (ab, bc, cd) = (knot(a, b, 1.0), knot(b, c, 0.0), knot(c, d, -1.0));
                    let p = ab.lerp(bc, 0.5 * (t + 1.0)).lerp(bc.lerp(cd, 0.5 * t), t);
                    let r = math::lerp(at[i - 1].1, at[i].1, t);
                    let (p0, p1) = (p - r, p + r);
                    assert!(p0.cmpge(lo - 1e-6).all() && p1.cmple(hi + 1e-6).all(), "{p}");
                    outside += usize::from(!(p0.cmpge(low).all() && p1.cmple(high).all()));
                }
            }
        }
        // The plain box does not hold it, or this would show nothing.
        assert!(outside > 0);
        assert!(at_rest(&source, low, high));
    }

    /// Whether all points with their radii lie in a box.
    fn at_rest(source: &Source, low: Vec3, high: Vec3) -> bool {
        (0..source.count)
            .flat_map(|s| source.widths(s))
            .all(|(p, r)| (p - r).cmpge(low).all() && (p + r).cmple(high).all())
    }

    #[test]
    fn sorting_keeps_all_and_orders_them() {
        let source = source();
        let batches = batches(&source, &shuffled(source.count), 2000).unwrap();
        assert!(batches.len() > 1);
        let depth = |p: Vec3| p.dot(Vec3::new(0.3, -0.5, 0.8));
        for sort in [Sort::Strands, Sort::Pieces] {
            let mut all = Vec::new();
            for batch in &batches {
                let strands = drawn(batch.strands.len(), 0.7);
                let plain = content(&source, batch, &[]);
                let (order, depths) = back_to_front(&source, batch, strands, depth, sort);
                assert!(depths.windows(2).all(|two| two[0] >= two[1]));
                let mut back = order.clone();
                back.sort_unstable();
                assert_eq!(back, plain.order[..batch.firsts[strands] as usize]);
                if sort == Sort::Pieces {
                    let point = |i: u32| Vec3::from_slice(&plain.points[i as usize][..3]);
                    for (&first, at) in order.iter().zip(&depths) {
                        assert_eq!(*at, depth(0.5 * (point(first) + point(first + 1))));
                    }
                }
                all.push(depths);
            }
            // Over all batches nothing is drawn behind what is more than a slab nearer.
            let mut done = vec![0; all.len()];
            let (mut nearest, mut farthest) = (f32::INFINITY, f32::NEG_INFINITY);
            for of in all.iter().flatten() {
                (nearest, farthest) = (nearest.min(*of), farthest.max(*of));
            }
            let slab = (farthest - nearest) / SLABS as f32;
            let mut drawn_down_to = f32::INFINITY;
            for run in slabs(&all) {
                assert_eq!(run.segments.start, done[run.chunk]);
                done[run.chunk] = run.segments.end;
                for i in run.segments {
                    let at = all[run.chunk][i as usize];
                    assert!(at <= drawn_down_to + slab * 1.001);
                    drawn_down_to = drawn_down_to.min(at);
                }
            }
            assert!(done.iter().zip(&all).all(|(&done, of)| done as usize == of.len()));
        }
        assert_eq!(slabs(&[vec![3.0, 2.0]]), vec![Run { chunk: 0, segments: 0..2, by_strand: false }]);
    }

    #[test]
    fn the_shader_is_valid_and_its_numbers_lie_where_they_are_put() {
        let test = "@fragment fn probe(v: HairVertex) -> @location(0) vec4f { return vec4f(hair_fragment(v).alpha); }";
        let text = [crate::stage::FRAME, crate::stage::FRAGMENT, crate::stage::STRANDS, test].join("\n");
        let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        let flags = naga::valid::ValidationFlags::all();
        let mut validator = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        let (_, twin) = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("HairGeometry")).unwrap();
        let naga::TypeInner::Struct { members, span } = &twin.inner else { panic!("not a structure") };
        let theirs: Vec<(&str, u32)> = members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset)).collect();
        let ours = [
            ("width", std::mem::offset_of!(HairGeometry, width) as u32),
            ("opacity", std::mem::offset_of!(HairGeometry, opacity) as u32),
            ("subdivisions", std::mem::offset_of!(HairGeometry, subdivisions) as u32),
            ("curved", std::mem::offset_of!(HairGeometry, curved) as u32),
            ("slanted", std::mem::offset_of!(HairGeometry, slanted) as u32),
        ];
        assert_eq!((theirs.as_slice(), *span), (ours.as_slice(), size_of::<HairGeometry>() as u32));
    }
}
