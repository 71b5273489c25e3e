//! Cem Yuksel's `.hair`: a header of 128 bytes, then up to five arrays, everything little-endian.
//!
//! | offset | type | what |
//! |---|---|---|
//! | 0 | 4 bytes | `HAIR` |
//! | 4 | u32 | strands |
//! | 8 | u32 | points of all strands |
//! | 12 | u32 | which arrays follow: bit 0 segments, 1 points, 2 thickness, 3 transparency, 4 colour |
//! | 16 | u32 | segments per strand where there is no such array |
//! | 20 | f32 | thickness where there is no such array |
//! | 24 | f32 | transparency where there is no such array |
//! | 28 | 3 f32 | colour where there is no such array |
//! | 40 | 88 bytes | text about the file |
//!
//! The arrays follow in the order of their bits: u16 segments per strand, 3 f32 per point, f32 thickness per
//! point, f32 transparency per point, 3 f32 colour per point. A strand of n segments has n + 1 points.
//!
//! - Thickness is a *diameter*; [`Groom::radius`] is half of it. A default thickness of 0 means that the file
//!   has no widths.
//! - Transparency becomes the attribute [`TRANSPARENCY`], colour the attribute [`COLOR`]; defaults do not
//!   become attributes but are kept in [`Defaults`].
//! - Source: the format's description at www.cemyuksel.com/research/hairmodels, checked against the files
//!   published there.

use std::io::{Read, Write};

use groom::{Attribute, Groom, Values};
use math::Vec3;

/// Name of the attribute that holds transparency: floats per point, 0 opaque to 1 invisible.
pub const TRANSPARENCY: &str = "transparency";

/// Name of the attribute that holds colour: vectors per point.
pub const COLOR: &str = "color";

const MAGIC: [u8; 4] = *b"HAIR";
const HEADER: u64 = 128;
const INFO: usize = 88;
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
const TRANSPARENCIES: u32 = 8;
const COLORS: u32 = 16;
const KNOWN: u32 = SEGMENTS | POINTS | THICKNESS | TRANSPARENCIES | COLORS;

/// What is read at a time, so that a lying header costs no more memory than the file is long.
const CHUNK: usize = 1 << 20;

/// A `.hair` file's content.
#[derive(Clone, Debug, PartialEq)]
pub struct HairFile {
    /// The strands, with y taken as up and no unit: the format says neither.
    pub groom: Groom,
    /// The text of the header, without trailing zeros; bytes that are not UTF-8 are replaced.
    pub info: String,
    /// What the header says for arrays that are absent.
    pub defaults: Defaults,
    /// What is odd about the file, each a sentence.
    pub warnings: Vec<String>,
}

/// What a header says about points that have no array of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defaults {
    /// Diameter, in the file's unit; 0 for none.
    pub thickness: f32,
    /// 0 opaque to 1 invisible.
    pub transparency: f32,
    /// Colour.
    pub color: [f32; 3],
}

impl Default for Defaults {
    fn default() -> Self {
        Self { thickness: 0.0, transparency: 0.0, color: [1.0; 3] }
    }
}

/// How to write a file; by default, as compactly as the groom allows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WriteOptions {
    /// Text for the header; at most 87 bytes of it are kept.
    pub info: String,
    /// Values for absent arrays. Where the groom has no widths, its thickness is what readers will use.
    pub defaults: Defaults,
    /// Write the number of segments per strand even if all strands have the same.
    pub always_segments: bool,
}

/// Why a `.hair` file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HairError {
    /// It is some other kind of file.
    #[error("not a .hair file: it starts with {found:02x?}, not with \"HAIR\"")]
    Magic {
        /// The first bytes.
        found: [u8; 4],
    },
    /// The file ends too early for what its header promises.
    #[error("{array} needs {needed} bytes at offset {offset}, but only {left} are left")]
    Truncated {
        /// What was being read.
        array: &'static str,
        /// Where it begins in the file, in bytes.
        offset: u64,
        /// Its size in bytes.
        needed: u64,
        /// How many bytes there are from its beginning.
        left: u64,
    },
    /// The header names arrays that the format does not have.
    #[error("the header's flags are {found:#x}; only the lowest five bits (0x1f) have a meaning")]
    Flags {
        /// All flags.
        found: u32,
    },
    /// The header says that there are no points.
    #[error("there is no points array (flags {flags:#x}), so there are no strands to read")]
    NoPoints {
        /// All flags.
        flags: u32,
    },
    /// There is nothing in it.
    #[error("the file has no strands")]
    NoStrands,
    /// No strand is left once those of one point are dropped.
    #[error("each of the {count} strands has a single point; a strand needs at least 2")]
    SinglePoints {
        /// How many strands there are.
        count: u32,
    },
    /// Segments and points do not fit together.
    #[error("the header declares {declared} points, but the strands' segments make {sum}")]
    Counts {
        /// Points in the header.
        declared: u32,
        /// Points that the strands need.
        sum: u64,
    },
    /// A coordinate is infinite or not a number.
    #[error("point {point} of strand {strand} is at {found:?}, which is not finite")]
    NotFinite {
        /// The strand, from 0.
        strand: u32,
        /// The point within the strand, from 0 at the root.
        point: u32,
        /// Its coordinates.
        found: [f32; 3],
    },
    /// A thickness is negative, infinite or not a number.
    #[error("the thickness at point {point} of strand {strand} is {found}; it must be finite and >= 0")]
    Thickness {
        /// The strand, from 0.
        strand: u32,
        /// The point within the strand, from 0 at the root.
        point: u32,
        /// The thickness.
        found: f32,
    },
    /// The header's thickness is negative, infinite or not a number.
    #[error("the header's default thickness is {found}; it must be finite and >= 0")]
    DefaultThickness {
        /// The thickness.
        found: f32,
    },
    /// A transparency or a colour is infinite or not a number.
    #[error("the {array} at point {point} of strand {strand} is not finite")]
    Value {
        /// Which array.
        array: &'static str,
        /// The strand, from 0.
        strand: u32,
        /// The point within the strand, from 0 at the root.
        point: u32,
    },
    /// A strand to write is longer than the format can say.
    #[error("strand {strand} has {segments} segments; the format holds at most 65535")]
    TooManySegments {
        /// The strand, from 0.
        strand: usize,
        /// Its segments.
        segments: usize,
    },
    /// Widths or attributes do not fit the groom they come with.
    #[error("there are {found} values of {array} for {expected} points")]
    Length {
        /// Which array.
        array: &'static str,
        /// How many values there are.
        found: usize,
        /// How many points.
        expected: usize,
    },
    /// Reading or writing failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Reads a `.hair` file.
///
/// `len_hint` is the length of the whole file, if it is known; then a header that promises more than the file
/// holds is refused before anything is read. Without it, memory grows with what really arrives.
///
/// Strands of a single point are dropped, with a warning; strands whose points all coincide stay, with a warning.
///
/// # Errors
/// When this is no `.hair` file, it ends early, its numbers contradict each other, or a value is not finite.
pub fn read(reader: &mut impl Read, len_hint: Option<u64>) -> Result<HairFile, HairError> {
    let mut source = Source { reader, offset: 0, len: len_hint };
    let mut magic = [0; 4];
    let got = source.fill(&mut magic)?;
    if magic != MAGIC && (got == 4 || magic[..got] != MAGIC[..got]) {
        return Err(HairError::Magic { found: magic });
    }
    let mut header = [0; HEADER as usize];
    header[..4].copy_from_slice(&magic);
    let got = got + if got == 4 { source.fill(&mut header[4..])? } else { 0 };
    if got < HEADER as usize {
        return Err(HairError::Truncated { array: "the header", offset: 0, needed: HEADER, left: got as u64 });
    }
    let word = |at: usize| [header[at], header[at + 1], header[at + 2], header[at + 3]];
    let uint = |at: usize| u32::from_le_bytes(word(at));
    let float = |at: usize| f32::from_le_bytes(word(at));
    let (strand_count, point_count, flags, default_segments) = (uint(4), uint(8), uint(12), uint(16));
    let defaults = Defaults { thickness: float(20), transparency: float(24), color: [float(28), float(32), float(36)] };
    let info = String::from_utf8_lossy(&header[40..]).trim_end_matches('\0').to_owned();

    if flags & !KNOWN != 0 {
        return Err(HairError::Flags { found: flags });
    }
    if flags & POINTS == 0 {
        return Err(HairError::NoPoints { flags });
    }
    if strand_count == 0 {
        return Err(HairError::NoStrands);
    }
    let has_thickness = flags & THICKNESS != 0;
    let sane = defaults.thickness >= 0.0 && defaults.thickness.is_finite();
    if !has_thickness && !sane {
        return Err(HairError::DefaultThickness { found: defaults.thickness });
    }

    // Points per strand; constant where there is no array, so that four billion strands cost nothing yet.
    let strands = u64::from(strand_count);
    let counts = if flags & SEGMENTS != 0 {
        let bytes = source.take("the segments array", 2 * strands)?;
        Counts::Each(bytes.chunks_exact(2).map(|b| u32::from(u16::from_le_bytes([b[0], b[1]])) + 1).collect())
    } else {
        Counts::All { strands: strand_count, points: u64::from(default_segments) + 1 }
    };
    let sum = counts.sum();
    if sum != u64::from(point_count) {
        return Err(HairError::Counts { declared: point_count, sum });
    }

    let n = u64::from(point_count);
    let points: Vec<Vec3> = vectors(&source.take("the points array", 12 * n)?).map(Vec3::from_array).collect();
    if let Some(i) = points.iter().position(|p| !p.is_finite()) {
        let (strand, point) = counts.locate(i as u64);
        return Err(HairError::NotFinite { strand, point, found: points[i].to_array() });
    }
    let mut radius = None;
    if has_thickness {
        let bytes = source.take("the thickness array", 4 * n)?;
        let values: Vec<f32> = floats(&bytes).collect();
        if let Some(i) = values.iter().position(|t| !(*t >= 0.0 && t.is_finite())) {
            let (strand, point) = counts.locate(i as u64);
            return Err(HairError::Thickness { strand, point, found: values[i] });
        }
        radius = Some(values.into_iter().map(|t| 0.5 * t).collect::<Vec<f32>>());
    } else if defaults.thickness > 0.0 {
        radius = Some(vec![0.5 * defaults.thickness; points.len()]);
    }
    let mut transparency = None;
    if flags & TRANSPARENCIES != 0 {
        let bytes = source.take("the transparency array", 4 * n)?;
        let values: Vec<f32> = floats(&bytes).collect();
        if let Some(i) = values.iter().position(|t| !t.is_finite()) {
            let (strand, point) = counts.locate(i as u64);
            return Err(HairError::Value { array: "transparency", strand, point });
        }
        transparency = Some(values);
    }
    let mut color = None;
    if flags & COLORS != 0 {
        let bytes = source.take("the colour array", 12 * n)?;
        let values: Vec<[f32; 3]> = vectors(&bytes).collect();
        if let Some(i) = values.iter().position(|c| !c.iter().all(|x| x.is_finite())) {
            let (strand, point) = counts.locate(i as u64);
            return Err(HairError::Value { array: "colour", strand, point });
        }
        color = Some(values);
    }

    let mut warnings = Vec::new();
    if source.has_more()? {
        warnings.push(format!("something follows the last array, which ends at byte {}", source.offset));
    }
    let parts = Parts { points, radius, transparency, color };
    let groom = parts.into_groom(&counts, &mut warnings)?;
    Ok(HairFile { groom, info, defaults, warnings })
}

/// Writes a `.hair` file; the arrays are those that the groom has.
///
/// Widths, the point attribute [`TRANSPARENCY`] and the point attribute [`COLOR`] are written; other attributes,
/// the up axis and the unit have no place in the format.
///
/// # Errors
/// When a strand has more than 65535 segments, there is no strand, widths do not match the points, or writing
/// fails.
pub fn write(writer: &mut impl Write, groom: &Groom, options: &WriteOptions) -> Result<(), HairError> {
    let strand_count = u32::try_from(groom.strand_count()).unwrap_or(u32::MAX);
    if strand_count == 0 {
        return Err(HairError::NoStrands);
    }
    let defaults = options.defaults;
    if !(defaults.thickness >= 0.0 && defaults.thickness.is_finite()) {
        return Err(HairError::DefaultThickness { found: defaults.thickness });
    }
    let mut segments = Vec::with_capacity(groom.strand_count());
    for (strand, points) in groom.strands().enumerate() {
        let n = points.len() - 1;
        segments.push(u16::try_from(n).map_err(|_| HairError::TooManySegments { strand, segments: n })?);
    }
    let first = segments.first().copied().unwrap_or_default();
    let each = options.always_segments || segments.iter().any(|&s| s != first);
    let radius = groom.radius.as_deref();
    let transparency = match groom.attributes.get(TRANSPARENCY).map(|a| &a.values) {
        Some(Values::Float(v)) if v.len() == groom.point_count() => Some(v),
        _ => None,
    };
    let color = match groom.attributes.get(COLOR).map(|a| &a.values) {
        Some(Values::Vec3(v)) if v.len() == groom.point_count() => Some(v),
        _ => None,
    };
    if let Some(found) = radius.map(<[f32]>::len).filter(|&len| len != groom.point_count()) {
        return Err(HairError::Length { array: "radius", found, expected: groom.point_count() });
    }

    let flag = |present: bool, bit: u32| if present { bit } else { 0 };
    let flags = POINTS
        | flag(each, SEGMENTS)
        | flag(radius.is_some(), THICKNESS)
        | flag(transparency.is_some(), TRANSPARENCIES)
        | flag(color.is_some(), COLORS);
    writer.write_all(&MAGIC)?;
    let points = u32::try_from(groom.point_count()).unwrap_or(u32::MAX);
    let default_segments = if each { 0 } else { u32::from(first) };
    for word in [strand_count, points, flags, default_segments] {
        writer.write_all(&word.to_le_bytes())?;
    }
    let [r, g, b] = defaults.color;
    for value in [defaults.thickness, defaults.transparency, r, g, b] {
        writer.write_all(&value.to_le_bytes())?;
    }
    writer.write_all(&info_bytes(&options.info))?;
    if each {
        for s in segments {
            writer.write_all(&s.to_le_bytes())?;
        }
    }
    for p in groom.points() {
        write_floats(writer, &p.to_array())?;
    }
    for r in radius.unwrap_or_default() {
        writer.write_all(&(2.0 * r).to_le_bytes())?;
    }
    write_floats(writer, transparency.map_or(&[][..], Vec::as_slice))?;
    for c in color.map_or(&[][..], Vec::as_slice) {
        write_floats(writer, c)?;
    }
    Ok(())
}

fn write_floats(writer: &mut impl Write, values: &[f32]) -> std::io::Result<()> {
    values.iter().try_for_each(|v| writer.write_all(&v.to_le_bytes()))
}

/// The header's text: as much as fits before a closing zero, without cutting a character in two.
fn info_bytes(info: &str) -> [u8; INFO] {
    let mut end = info.len().min(INFO - 1);
    while !info.is_char_boundary(end) {
        end -= 1;
    }
    let mut bytes = [0; INFO];
    bytes[..end].copy_from_slice(&info.as_bytes()[..end]);
    bytes
}

/// Points per strand.
enum Counts {
    All { strands: u32, points: u64 },
    Each(Vec<u32>),
}

impl Counts {
    fn sum(&self) -> u64 {
        match self {
            // At most (2³² - 1) · 2³², which fits.
            Self::All { strands, points } => u64::from(*strands) * points,
            Self::Each(counts) => counts.iter().map(|&n| u64::from(n)).sum(),
        }
    }

    /// Strand and point within it of point `i` of all.
    fn locate(&self, i: u64) -> (u32, u32) {
        match self {
            Self::All { points, .. } => ((i / points) as u32, (i % points) as u32),
            Self::Each(counts) => {
                let mut before = 0;
                for (strand, &n) in counts.iter().enumerate() {
                    if i < before + u64::from(n) {
                        return (strand as u32, (i - before) as u32);
                    }
                    before += u64::from(n);
                }
                (counts.len() as u32, 0)
            }
        }
    }

    /// One count per strand; only called once the points are known to be there.
    fn to_vec(&self) -> Vec<u32> {
        match self {
            Self::All { strands, points } => {
                vec![u32::try_from(*points).unwrap_or(u32::MAX); *strands as usize]
            }
            Self::Each(counts) => counts.clone(),
        }
    }
}

/// Everything of a file, before strands of one point are taken out.
struct Parts {
    points: Vec<Vec3>,
    radius: Option<Vec<f32>>,
    transparency: Option<Vec<f32>>,
    color: Option<Vec<[f32; 3]>>,
}

impl Parts {
    fn into_groom(mut self, counts: &Counts, warnings: &mut Vec<String>) -> Result<Groom, HairError> {
        let mut counts = counts.to_vec();
        let single = counts.iter().filter(|&&n| n < 2).count();
        if single > 0 {
            warnings.push(format!("{single} of {} strands have a single point and were left out", counts.len()));
            let keep: Vec<bool> = counts.iter().flat_map(|&n| std::iter::repeat_n(n >= 2, n as usize)).collect();
            retain(&mut self.points, &keep);
            self.radius.iter_mut().for_each(|v| retain(v, &keep));
            self.transparency.iter_mut().for_each(|v| retain(v, &keep));
            self.color.iter_mut().for_each(|v| retain(v, &keep));
            counts.retain(|&n| n >= 2);
            if counts.is_empty() {
                return Err(HairError::SinglePoints { count: single as u32 });
            }
        }
        let (declared, sum) = (self.points.len(), counts.iter().map(|&n| u64::from(n)).sum());
        let mismatch = HairError::Counts { declared: u32::try_from(declared).unwrap_or(u32::MAX), sum };
        // All of these were checked above, with places that the errors of `groom` do not know.
        let Ok(mut groom) = Groom::new(self.points, counts) else {
            return Err(mismatch);
        };
        if let Some(radius) = self.radius
            && groom.set_radius(radius).is_err()
        {
            return Err(mismatch);
        }
        let mut insert = |name: &str, attribute: Attribute| groom.attributes.insert(name, attribute).is_ok();
        let stored = self.transparency.is_none_or(|v| insert(TRANSPARENCY, Attribute::point_floats(v)))
            && self.color.is_none_or(|v| insert(COLOR, Attribute::point_vectors(v)));
        if !stored {
            return Err(mismatch);
        }
        let flat = groom.strands().filter(|s| s.windows(2).all(|w| w[0] == w[1])).count();
        if flat > 0 {
            warnings.push(format!("{flat} of {} strands have no length", groom.strand_count()));
        }
        Ok(groom)
    }
}

/// Keeps the values whose flag is set.
fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut flags = keep.iter();
    values.retain(|_| flags.next().copied().unwrap_or(true));
}

fn floats(bytes: &[u8]) -> impl Iterator<Item = f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

fn vectors(bytes: &[u8]) -> impl Iterator<Item = [f32; 3]> {
    bytes.chunks_exact(12).map(|b| {
        let float = |at: usize| f32::from_le_bytes([b[at], b[at + 1], b[at + 2], b[at + 3]]);
        [float(0), float(4), float(8)]
    })
}

/// A reader that knows where it is.
struct Source<'a, R> {
    reader: &'a mut R,
    offset: u64,
    /// Length of the whole file, where it is known.
    len: Option<u64>,
}

impl<R: Read> Source<'_, R> {
    /// Reads until `buffer` is full or the file ends; returns how much came.
    fn fill(&mut self, buffer: &mut [u8]) -> Result<usize, HairError> {
        let mut got = 0;
        while got < buffer.len() {
            match self.reader.read(&mut buffer[got..]) {
                Ok(0) => break,
                Ok(n) => got += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e.into()),
            }
        }
        self.offset += got as u64;
        Ok(got)
    }

    /// The next `needed` bytes, in chunks: what is not there is never allocated.
    fn take(&mut self, array: &'static str, needed: u64) -> Result<Vec<u8>, HairError> {
        let offset = self.offset;
        if let Some(left) = self.len.map(|len| len.saturating_sub(offset)).filter(|&left| left < needed) {
            return Err(HairError::Truncated { array, offset, needed, left });
        }
        let mut bytes = Vec::new();
        while (bytes.len() as u64) < needed {
            let start = bytes.len();
            let chunk = (needed - start as u64).min(CHUNK as u64) as usize;
            bytes.resize(start + chunk, 0);
            let got = self.fill(&mut bytes[start..])?;
            if got < chunk {
                let left = (start + got) as u64;
                return Err(HairError::Truncated { array, offset, needed, left });
            }
        }
        Ok(bytes)
    }

    /// Whether anything follows; does not count as read.
    fn has_more(&mut self) -> Result<bool, HairError> {
        let at = self.offset;
        let more = self.fill(&mut [0])? > 0;
        self.offset = at;
        Ok(more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::hash;
    use proptest::prelude::*;

    fn get(bytes: &[u8]) -> Result<HairFile, HairError> {
        read(&mut &*bytes, Some(bytes.len() as u64))
    }

    /// Written from the table in the module's documentation, by other means than `write`.
    fn by_hand(flags: u32, segments: &[u16], points: &[[f32; 3]]) -> Vec<u8> {
        let mut b = b"HAIR".to_vec();
        b.extend((segments.len() as u32).to_le_bytes());
        b.extend((points.len() as u32).to_le_bytes());
        b.extend(flags.to_le_bytes());
        b.extend(u32::from(segments.first().copied().unwrap_or(0)).to_le_bytes());
        for x in [0.25_f32, 0.5, 0.75, 0.625, 0.125] {
            b.extend(x.to_le_bytes());
        }
        let mut info = b"by hand".to_vec();
        info.resize(88, 0);
        b.extend(info);
        assert_eq!(b.len(), 128);
        if flags & 1 != 0 {
            b.extend(segments.iter().flat_map(|s| s.to_le_bytes()));
        }
        if flags & 2 != 0 {
            b.extend(points.iter().flatten().flat_map(|x| x.to_le_bytes()));
        }
        if flags & 4 != 0 {
            b.extend((0..points.len()).flat_map(|i| (0.5 * i as f32).to_le_bytes()));
        }
        if flags & 8 != 0 {
            b.extend((0..points.len()).flat_map(|i| (0.125 * i as f32).to_le_bytes()));
        }
        if flags & 16 != 0 {
            b.extend((0..3 * points.len()).flat_map(|i| (0.25 * i as f32).to_le_bytes()));
        }
        b
    }

    fn places(n: usize) -> Vec<[f32; 3]> {
        (0..n as u32).map(|i| [hash::signed(i, 1), hash::signed(i, 2), hash::signed(i, 3)]).collect()
    }

    #[test]
    fn the_documented_layout_is_read() {
        let b = by_hand(31, &[1, 2], &places(5));
        let file = get(&b).unwrap();
        let g = &file.groom;
        assert_eq!(g.offsets(), [0, 2, 5]);
        assert_eq!(g.points()[3].to_array(), places(5)[3]);
        // Thickness is a diameter.
        assert_eq!(g.radius, Some(vec![0.0, 0.25, 0.5, 0.75, 1.0]));
        assert_eq!(g.attributes.float(TRANSPARENCY, 1, 3, 0.0), Some(0.375));
        assert_eq!(g.attributes.vec3(COLOR, 0, 1, 0.0), Some([0.75, 1.0, 1.25]));
        assert_eq!((file.info.as_str(), file.warnings.len()), ("by hand", 0));
        let expected = Defaults { thickness: 0.25, transparency: 0.5, color: [0.75, 0.625, 0.125] };
        assert_eq!(file.defaults, expected);

        // Without arrays the header's values hold: 2 segments each, a diameter of a quarter.
        let file = get(&by_hand(2, &[2, 2], &places(6))).unwrap();
        assert_eq!(file.groom.offsets(), [0, 3, 6]);
        assert_eq!(file.groom.radius, Some(vec![0.125; 6]));
        assert!(file.groom.attributes.is_empty());
    }

    #[test]
    fn every_combination_of_arrays_survives_to_the_bit() {
        for flags in (0..32_u32).filter(|f| f & POINTS != 0) {
            let segments: &[u16] = if flags & SEGMENTS != 0 { &[3, 1, 4] } else { &[2, 2, 2] };
            let n: usize = segments.iter().map(|&s| usize::from(s) + 1).sum();
            let first = get(&by_hand(flags, segments, &places(n))).unwrap();
            let options = WriteOptions {
                info: first.info.clone(),
                // Widths become an array on writing where only the header had one.
                defaults: first.defaults,
                always_segments: false,
            };
            let mut bytes = Vec::new();
            write(&mut bytes, &first.groom, &options).unwrap();
            let second = get(&bytes).unwrap();
            assert_eq!(first, second, "flags {flags:#x}");
            let written = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]);
            assert_eq!(written, flags | THICKNESS, "flags {flags:#x}");
            // Without a hint the same comes out.
            assert_eq!(read(&mut bytes.as_slice(), None).unwrap(), second);
            if flags & THICKNESS != 0 {
                let mut by_hand = by_hand(flags, segments, &places(n));
                if flags & SEGMENTS != 0 {
                    // The header's own count means nothing here, and is written as 0.
                    by_hand[16..20].fill(0);
                }
                assert_eq!(bytes, by_hand, "flags {flags:#x}");
            }
        }
    }

    #[test]
    fn missing_points_and_unknown_arrays_are_refused() {
        assert!(matches!(get(&by_hand(29, &[1], &places(2))), Err(HairError::NoPoints { flags: 29 })));
        assert!(matches!(get(&by_hand(34, &[1], &places(2))), Err(HairError::Flags { found: 34 })));
        assert!(matches!(get(&by_hand(3, &[], &[])), Err(HairError::NoStrands)));
        assert!(matches!(get(b"PNG\x0d1234"), Err(HairError::Magic { .. })));
    }

    #[test]
    fn truncation_anywhere_is_an_error_that_says_where() {
        let whole = by_hand(31, &[1, 2, 3], &places(9));
        for end in (0..whole.len()).step_by(7).chain([3, 4, 127, 128, whole.len() - 1]) {
            for hint in [None, Some(end as u64)] {
                let error = read(&mut &whole[..end], hint).unwrap_err();
                match error {
                    HairError::Truncated { offset, needed, left, .. } => {
                        assert!(left < needed && offset + left == end as u64, "{end}: {error}");
                    }
                    other => panic!("cut at {end}: {other}"),
                }
            }
        }
    }

    #[test]
    fn lying_headers_are_caught_before_memory_is_taken() {
        // Four billion strands in a file of 200 bytes, with and without an array of counts.
        for flags in [2_u32, 3, 31] {
            let mut b = by_hand(flags, &[1, 1], &places(4));
            b.resize(200, 0);
            b[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
            for hint in [None, Some(200)] {
                assert!(read(&mut b.as_slice(), hint).is_err());
            }
            b[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
            // One point per strand makes the counts agree.
            b[16..20].copy_from_slice(&0_u32.to_le_bytes());
            for hint in [None, Some(200)] {
                let error = read(&mut b.as_slice(), hint).unwrap_err();
                assert!(matches!(error, HairError::Truncated { needed, .. } if needed > 1 << 32), "{error}");
            }
        }
        let mut b = by_hand(3, &[1, 2], &places(5));
        b[8] = 6;
        assert!(matches!(get(&b), Err(HairError::Counts { declared: 6, sum: 5 })));
    }

    #[test]
    fn values_that_are_no_numbers_are_named() {
        let mut p = places(5);
        p[3][1] = f32::NAN;
        let error = get(&by_hand(3, &[1, 2], &p)).unwrap_err();
        assert!(matches!(error, HairError::NotFinite { strand: 1, point: 1, .. }), "{error}");

        let whole = by_hand(31, &[1, 2], &places(5));
        let thickness = 128 + 4 + 60;
        for bad in [-1.0_f32, f32::NAN, f32::INFINITY] {
            let mut b = whole.clone();
            b[thickness + 8..thickness + 12].copy_from_slice(&bad.to_le_bytes());
            assert!(matches!(get(&b), Err(HairError::Thickness { strand: 1, point: 0, .. })));
        }
        for (at, name) in [(thickness + 20, "transparency"), (thickness + 40, "colour")] {
            let mut b = whole.clone();
            b[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
            assert!(matches!(get(&b), Err(HairError::Value { array, strand: 0, point: 0 }) if array == name));
        }
        let mut b = by_hand(2, &[1], &places(2));
        b[20..24].copy_from_slice(&(-1.0_f32).to_le_bytes());
        assert!(matches!(get(&b), Err(HairError::DefaultThickness { .. })));
    }

    #[test]
    fn odd_but_readable_files_come_with_warnings() {
        // A strand of one point goes, and everything that belongs to it.
        let file = get(&by_hand(31, &[1, 0, 2], &places(6))).unwrap();
        assert_eq!(file.groom.offsets(), [0, 2, 5]);
        assert_eq!(file.groom.points()[2].to_array(), places(6)[3]);
        assert_eq!(file.groom.radius.as_ref().unwrap()[2], 0.75);
        assert_eq!(file.groom.attributes.float(TRANSPARENCY, 1, 2, 0.0), Some(0.375));
        assert_eq!(file.warnings.len(), 1);
        assert!(matches!(get(&by_hand(3, &[0, 0], &places(2))), Err(HairError::SinglePoints { count: 2 })));

        let mut b = by_hand(2, &[1, 1], &[[0.0; 3], [1.0; 3], [2.0; 3], [2.0; 3]]);
        assert_eq!(get(&b).unwrap().warnings.len(), 1, "a strand without length");
        b.push(0);
        let file = get(&b).unwrap();
        assert!(file.warnings.iter().any(|w| w.contains("176")), "{:?}", file.warnings);
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        let info = format!("{}é", "x".repeat(86));
        let options = WriteOptions { info, ..WriteOptions::default() };
        let groom = Groom::new(vec![Vec3::ZERO, Vec3::X], [2]).unwrap();
        let mut bytes = Vec::new();
        write(&mut bytes, &groom, &options).unwrap();
        assert_eq!(get(&bytes).unwrap().info, "x".repeat(86));
    }

    proptest! {
        /// Whatever the bytes, reading ends with a groom or an error.
        #[test]
        fn random_bytes_never_panic(tail in prop::collection::vec(any::<u8>(), 0..400), flags in 0..40_u32) {
            let _ = get(&tail);
            let mut b = by_hand(flags, &[2, 1], &places(5));
            let at = tail.len() % b.len();
            for (x, y) in b[at..].iter_mut().zip(&tail) {
                *x = *y;
            }
            for hint in [None, Some(b.len() as u64)] {
                let _ = read(&mut b.as_slice(), hint);
            }
        }
    }
}
