//! Drawing a picture in bands of whole rows, where what its fragments need is more than a shader can see at once.
//!
//! The same buffers serve one band after the other. How many fragments a row has is not known before it was drawn:
//! every frame counts them band by band, also those that found no room, and the next one is cut accordingly.

use crate::gpu::Gpu;
use crate::meter::Allocation;
use crate::stage::{COLOR, entry, storage, uniform};

/// Most bands of a picture: counters are kept for as many.
pub(crate) const MOST_BANDS: u32 = 256;
/// Room for fragments that come with the next frame, as a factor of those that were counted.
const SPARE: f64 = 1.1;
/// Buffers that are larger than what is needed by this factor are given back.
const WASTE: f64 = 1.25;
/// How full the parts of a band are meant to be: they are taken for equal, and are not.
const FULL: f64 = 2.0 / 3.0;
/// Fewest fragments that room is made for.
const LEAST: u64 = 1024;

/// What one binding can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Room {
    /// Pixels.
    pub(crate) pixels: u64,
    /// Fragments.
    pub(crate) fragments: u64,
}

impl Room {
    /// For buffers with so many bytes for a pixel and for a fragment.
    pub(crate) fn new(gpu: &Gpu, pixel_bytes: u64, fragment_bytes: u64) -> Self {
        let most = gpu.largest_binding();
        // Counters stand in front of pixels. Nodes are 32-bit numbers, and the counter must not wrap.
        let pixels = most.saturating_sub(4 * u64::from(MOST_BANDS)) / pixel_bytes.max(1);
        Self { pixels: pixels.max(1), fragments: (most / fragment_bytes.max(1)).clamp(1, 1 << 31) }
    }
}

/// Some rows of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Band {
    /// The uppermost one.
    pub(crate) first: u32,
    /// How many, at least 1.
    pub(crate) rows: u32,
}

/// How a picture is cut.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Plan {
    /// Pixels, at least 1 a side.
    pub(crate) size: [u32; 2],
    /// From top to bottom, without gaps.
    pub(crate) bands: Vec<Band>,
    /// Fragments that a band has room for; 0 where every pixel has the same room.
    pub(crate) capacity: u32,
}

impl Plan {
    /// As few bands as `pixels` a band permit, of nearly equal height.
    pub(crate) fn even(size: [u32; 2], pixels: u64) -> Self {
        let [width, height] = size.map(|side| side.max(1));
        let rows = most_rows([width, height], pixels);
        let count = height.div_ceil(rows);
        // Never more than `rows`, because `count` times `rows` is enough.
        let rows = height.div_ceil(count);
        let bands =
            (0..height).step_by(rows as usize).map(|first| Band { first, rows: rows.min(height - first) }).collect();
        Self { size: [width, height], bands, capacity: 0 }
    }

    /// Room for `per_pixel` fragments a pixel, or for as many as a binding holds.
    pub(crate) fn first(size: [u32; 2], per_pixel: f64, room: Room) -> Self {
        let plan = Self::even(size, room.pixels);
        let capacity = capacity(per_pixel * plan.pixels() as f64, room);
        Self { capacity, ..plan }
    }

    /// Pixels of the tallest band.
    pub(crate) fn pixels(&self) -> u64 {
        let rows = self.bands.iter().map(|band| band.rows).max().unwrap_or(1);
        u64::from(self.size[0]) * u64::from(rows)
    }

    /// What the shaders are told of a band: `ChainBand`.
    pub(crate) fn uniform(&self, band: usize) -> [u32; 4] {
        let first = self.bands.get(band).map_or(0, |band| band.first);
        [self.size[0], first, self.capacity, band as u32]
    }

    /// Confines a pass to a band.
    pub(crate) fn confine(&self, pass: &mut wgpu::RenderPass<'_>, band: Band) {
        pass.set_scissor_rect(0, band.first, self.size[0], band.rows);
    }

    /// A pass's name, with the band if there are several.
    pub(crate) fn name(&self, pass: &str, band: usize) -> String {
        if self.bands.len() == 1 { pass.to_owned() } else { format!("{pass}, band {}", band + 1) }
    }

    /// What fits better, now that the fragments of each band were counted; `None` if this one is good.
    ///
    /// Several frames may be needed until every band fits; a band of one row that does not fit stays.
    pub(crate) fn refit(&self, counts: &[u32], room: Room) -> Option<Self> {
        let total = counts.iter().copied().map(f64::from).sum::<f64>();
        let largest = counts.iter().copied().max().unwrap_or(0);
        let fewest = Self::even(self.size, room.pixels);
        if self.bands.len() > fewest.bands.len() && total * WASTE <= room.fragments as f64 {
            return Some(Self { capacity: capacity(total * SPARE, room), ..fewest });
        }
        if u64::from(largest) <= room.fragments {
            let wanted = capacity(f64::from(largest) * SPARE, room);
            let good = largest <= self.capacity && f64::from(self.capacity) <= WASTE * f64::from(wanted);
            return (!good).then(|| Self { capacity: wanted, ..self.clone() });
        }
        let mut full = FULL * room.fragments as f64;
        let most_rows = most_rows(self.size, room.pixels);
        let mut bands = cut(&self.bands, counts, full, most_rows);
        while bands.len() > MOST_BANDS as usize && full < total {
            full *= 2.0;
            bands = cut(&self.bands, counts, full, most_rows);
        }
        Some(Self { size: self.size, bands, capacity: capacity(f64::INFINITY, room) })
    }
}

/// Most rows that a band may have for its pixels' sake; enough of them for [`MOST_BANDS`], whatever `pixels` says.
fn most_rows([width, height]: [u32; 2], pixels: u64) -> u32 {
    let rows = u32::try_from(pixels / u64::from(width)).unwrap_or(u32::MAX);
    rows.max(height.div_ceil(MOST_BANDS)).clamp(1, height)
}

/// A number of fragments within what is sensible and possible.
fn capacity(fragments: f64, room: Room) -> u32 {
    // At most 2^31, see `Room::new`.
    (fragments as u64).clamp(LEAST.min(room.fragments), room.fragments) as u32
}

/// Cuts bands that have more than `full` fragments into equal parts, and joins neighbours that have few.
///
/// Parts of one band are not joined with others before they were counted: what is known of them is a guess.
fn cut(bands: &[Band], counts: &[u32], full: f64, most_rows: u32) -> Vec<Band> {
    let mut new: Vec<Band> = Vec::new();
    // Fragments of the last new band, if they were counted.
    let mut known: Option<f64> = None;
    for (band, &count) in bands.iter().zip(counts) {
        let count = f64::from(count);
        let parts = ((count / full).ceil() as u32).clamp(1, band.rows);
        if parts > 1 {
            let rows = band.rows.div_ceil(parts);
            let starts = (0..band.rows).step_by(rows as usize);
            new.extend(starts.map(|row| Band { first: band.first + row, rows: rows.min(band.rows - row) }));
            known = None;
            continue;
        }
        match (new.last_mut(), known) {
            (Some(last), Some(sum)) if sum + count <= full && last.rows + band.rows <= most_rows => {
                last.rows += band.rows;
                known = Some(sum + count);
            }
            _ => {
                new.push(*band);
                known = Some(count);
            }
        }
    }
    new
}

/// A target that stays as it is: passes that only write storage need one all the same.
pub(crate) fn untouched() -> Option<wgpu::ColorTargetState> {
    Some(wgpu::ColorTargetState { format: COLOR, blend: None, write_mask: wgpu::ColorWrites::empty() })
}

/// A layout of group 3: the band, then storage buffers that the fragment stage only reads (`true`) or not.
pub(crate) fn layout(gpu: &Gpu, label: &str, read_only: &[bool]) -> wgpu::BindGroupLayout {
    layout_with(gpu, label, read_only, &[])
}

/// The same with more entries behind.
pub(crate) fn layout_with(
    gpu: &Gpu,
    label: &str,
    read_only: &[bool],
    more: &[wgpu::BindGroupLayoutEntry],
) -> wgpu::BindGroupLayout {
    let fragment = wgpu::ShaderStages::FRAGMENT;
    let mut entries = vec![entry(0, fragment, uniform())];
    entries.extend(read_only.iter().zip(1..).map(|(&read, binding)| entry(binding, fragment, storage(read))));
    entries.extend_from_slice(more);
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// A group of such a layout.
pub(crate) fn group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    band: &wgpu::Buffer,
    buffers: &[&wgpu::Buffer],
    texture: Option<&wgpu::TextureView>,
) -> wgpu::BindGroup {
    let buffers = std::iter::once(band).chain(buffers.iter().copied()).map(wgpu::Buffer::as_entire_binding);
    let textures = texture.into_iter().map(wgpu::BindingResource::TextureView);
    let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
        .chain(textures)
        .zip(0..)
        .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("band"), layout, entries: &entries })
}

/// The uniform buffer of a band.
pub(crate) fn band_buffer(gpu: &Gpu, plan: &Plan, band: usize) -> wgpu::Buffer {
    gpu.buffer("band", bytemuck::bytes_of(&plan.uniform(band)), wgpu::BufferUsages::UNIFORM)
}

/// A storage buffer that commands can clear and copy.
pub(crate) fn storage_buffer(gpu: &Gpu, label: &str, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    })
}

/// A line of the memory table.
pub(crate) fn allocation(owner: &'static str, name: &str, bytes: u64) -> Allocation {
    Allocation { owner, name: name.to_owned(), bytes }
}

/// The 32-bit numbers of a buffer.
pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: Room = Room { pixels: 1 << 25, fragments: 100_000 };

    /// Whether every row is in one band, and no band is empty.
    fn whole(plan: &Plan) -> bool {
        let mut next = 0;
        plan.bands.iter().all(|band| {
            let follows = band.first == next && band.rows > 0;
            next += band.rows;
            follows
        }) && next == plan.size[1]
    }

    /// What a frame would count.
    fn counts(plan: &Plan, rows: &[u32]) -> Vec<u32> {
        let band = |band: &Band| rows[band.first as usize..(band.first + band.rows) as usize].iter().sum::<u32>();
        plan.bands.iter().map(band).collect()
    }

    #[test]
    fn even_bands_cover_the_picture_and_hold_no_more_than_they_may() {
        for (size, pixels) in [([656, 861], 10_000), ([1, 1], 1), ([1920, 1080], 1 << 30), ([100, 7], 300), ([0, 0], 5)]
        {
            let plan = Plan::even(size, pixels);
            assert!(whole(&plan), "{plan:?}");
            assert!(plan.pixels() <= pixels, "{plan:?}");
            let fewest = u64::from(plan.size[1]).div_ceil(pixels / u64::from(plan.size[0]));
            assert_eq!(plan.bands.len() as u64, fewest, "{plan:?}");
        }
        // Less than a row: the counters' number decides, and the buffer is refused by the device.
        assert!(Plan::even([4096, 4096], 10).bands.len() <= MOST_BANDS as usize);
    }

    #[test]
    fn what_fits_in_one_band_is_measured_up_and_down() {
        let plan = Plan::first([100, 100], 8.0, ROOM);
        assert_eq!((plan.bands.len(), plan.capacity), (1, 80_000));
        // Too small, far too large, a little too large, beyond what is in reserve.
        // A tenth more, rounded up.
        let refitted = |count| plan.refit(&[count], ROOM).map(|plan| plan.capacity);
        assert!(matches!(refitted(90_000), Some(99_000..=99_001)), "{:?}", refitted(90_000));
        assert!(matches!(refitted(10_000), Some(11_000..=11_001)), "{:?}", refitted(10_000));
        assert_eq!(plan.refit(&[60_000], ROOM), None);
        assert_eq!(plan.refit(&[99_999], ROOM).map(|plan| plan.capacity), Some(100_000));
        assert_eq!(plan.refit(&[0], ROOM).map(|plan| plan.capacity), Some(1024));
    }

    #[test]
    fn uneven_hair_fits_after_a_few_frames_and_comes_together_again() {
        // A head in the middle of the picture, eight times what fits; most of it in a tenth of the rows.
        let height = 861_u32;
        let rows: Vec<u32> = (0..height)
            .map(|row| {
                let x = (f64::from(row) - 300.0) / 40.0;
                (7_800.0 * (-0.5 * x * x).exp()) as u32
            })
            .collect();
        let mut plan = Plan::first([656, height], 8.0, ROOM);
        let mut attempts = 1;
        loop {
            let counts = counts(&plan, &rows);
            if counts.iter().all(|&count| count <= plan.capacity) {
                break;
            }
            attempts += 1;
            assert!(attempts <= 5, "{counts:?}");
            plan = plan.refit(&counts, ROOM).expect("it does not fit, so another plan is made");
            assert!(whole(&plan) && u64::from(plan.capacity) <= ROOM.fragments, "{plan:?}");
        }
        assert!((9..=30).contains(&plan.bands.len()), "{plan:?}");
        // The hair goes away.
        let few: Vec<u32> = rows.iter().map(|count| count / 16).collect();
        let less = plan.refit(&counts(&plan, &few), ROOM).expect("there are too many bands");
        assert_eq!(less.bands.len(), 1);
        assert!(u64::from(less.capacity) >= few.iter().copied().map(u64::from).sum::<u64>());
    }

    #[test]
    fn a_row_that_never_fits_ends_in_a_plan_of_its_own() {
        let mut plan = Plan::first([10, 64], 8.0, ROOM);
        let rows: Vec<u32> = (0..64).map(|row| if row == 30 { 150_000 } else { 10 }).collect();
        for _ in 0..8 {
            plan = plan.refit(&counts(&plan, &rows), ROOM).unwrap_or(plan);
            assert!(whole(&plan) && plan.bands.len() <= MOST_BANDS as usize, "{plan:?}");
        }
        assert!(plan.bands.contains(&Band { first: 30, rows: 1 }), "{plan:?}");
    }
}
