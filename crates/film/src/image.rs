//! A picture in memory, and the readers of `.exr`, `.hdr` and `.png`.
//!
//! Readers report and do not repair: NaN, infinite and negative values arrive as they were stored, and
//! [`Image::defects`] says whether there are any. Sizes are checked before pixels are allocated.

use std::fmt::Display;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};

use ::image::codecs::hdr::HdrDecoder;
use ::image::codecs::png::PngDecoder;
use ::image::{DynamicImage, ImageDecoder, Limits};
use exr::math::Vec2;
use exr::meta::attribute::{ChannelDescription, Text};
use exr::meta::header::Header;
use exr::prelude::{ReadChannels as _, ReadLayers as _, ReadSpecificChannel as _};
use math::Rgb;

use crate::frame::{MAX_PIXELS, MAX_SIDE, SizeError, check_size};
use crate::view::decode_srgb;

/// What comes before `R`, `G` and `B` in the channel names that are taken for the picture, by preference.
const PREFIXES: [&str; 2] = ["", "beauty."];

/// The colour channels of a picture, after the prefix.
const COLOURS: [&str; 3] = ["R", "G", "B"];

/// A picture: linear Rec.709 colours and, if it has one, their opacity.
///
/// Rows run from the top, pixels in a row from the left. With an alpha, colours are associated: already
/// multiplied by it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// One colour per pixel, row by row.
    pub pixels: Vec<Rgb>,
    /// One opacity in `0..=1` per pixel, row by row.
    pub alpha: Option<Vec<f32>>,
}

/// How many values of an image are not light, and where the first one is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Defects {
    /// Values that are not a number.
    pub nan: usize,
    /// Values that are infinite, of either sign.
    pub infinite: usize,
    /// Finite values below zero.
    pub negative: usize,
    /// Column and row of the first pixel with any of them.
    pub first: Option<(u32, u32)>,
}

impl Defects {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.first.is_none()
    }
}

impl Image {
    /// An image of the given pixels.
    ///
    /// # Errors
    ///
    /// A size that no film can have, or lists that do not have one entry per pixel.
    pub fn new(width: u32, height: u32, pixels: Vec<Rgb>, alpha: Option<Vec<f32>>) -> Result<Self, SizeError> {
        let image = Self { width, height, pixels, alpha };
        image.check()?;
        Ok(image)
    }

    /// Whether size and lists fit together; the fields are public, so writers ask again.
    ///
    /// # Errors
    ///
    /// As for [`Image::new`].
    pub fn check(&self) -> Result<(), SizeError> {
        let (width, height) = (self.width, self.height);
        check_size(width.into(), height.into())?;
        let lists = [("colours", Some(self.pixels.len())), ("alphas", self.alpha.as_ref().map(Vec::len))];
        for (what, found) in lists {
            if let Some(found) = found
                && found as u64 != u64::from(width) * u64::from(height)
            {
                return Err(SizeError::Length { what, found, width, height });
            }
        }
        Ok(())
    }

    /// The colour in column `x` and row `y`.
    ///
    /// # Panics
    ///
    /// Outside the image.
    pub fn at(&self, x: u32, y: u32) -> Rgb {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) of a {} x {} image", self.width, self.height);
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// Counts the colour and alpha values that are NaN, infinite or negative.
    pub fn defects(&self) -> Defects {
        let mut defects = Defects::default();
        for (index, colour) in self.pixels.iter().enumerate() {
            let alpha = self.alpha.as_ref().and_then(|alpha| alpha.get(index).copied());
            for value in colour.0.into_iter().chain(alpha) {
                if value.is_nan() {
                    defects.nan += 1;
                } else if value.is_infinite() {
                    defects.infinite += 1;
                } else if value < 0.0 {
                    defects.negative += 1;
                } else {
                    continue;
                }
                let width = self.width.max(1) as usize;
                let place = ((index % width) as u32, (index / width) as u32);
                defects.first = defects.first.or(Some(place));
            }
        }
        defects
    }
}

/// Why an image file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadImageError {
    /// The file cannot be opened or read.
    #[error("cannot read {path:?}: {cause}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },

    /// The name does not say one of the known formats.
    #[error("cannot read {path:?}: images are read from .exr, .hdr and .png, and the name ends in {extension:?}")]
    Extension {
        /// The file.
        path: PathBuf,
        /// The extension found, without the dot; empty if there is none.
        extension: String,
    },

    /// The picture is empty or too large.
    #[error("cannot read {path:?}: {cause}")]
    Size {
        /// The file.
        path: PathBuf,
        /// What is wrong with its size.
        cause: SizeError,
    },

    /// An EXR file without a picture that is recognised.
    #[error("cannot read {path:?}: no part has the channels R, G, B or beauty.R, beauty.G, beauty.B; found: {found}")]
    Channels {
        /// The file.
        path: PathBuf,
        /// The channels of its parts.
        found: String,
    },

    /// The contents are damaged or use something that is not supported.
    #[error("cannot read {path:?} as {format}: {what}")]
    Contents {
        /// The file.
        path: PathBuf,
        /// The format, by the name of the file.
        format: &'static str,
        /// What the decoder said.
        what: String,
    },
}

/// Reads an image; the extension of the name says the format, in any case of letters.
///
/// - `.exr`: the first part that has `R`, `G`, `B` or `beauty.R`, `beauty.G`, `beauty.B`, with its `A`
///   if there is one. The data window is the picture; the display window is ignored.
/// - `.hdr`: Radiance RGBE; the `EXPOSURE` line is ignored.
/// - `.png`: decoded from sRGB to linear and multiplied by its alpha if there is one.
///
/// Values are returned as stored, see [`Image::defects`].
///
/// # Errors
///
/// The file cannot be read, is damaged, is none of these formats or holds no picture of a size that
/// [`Film::new`](crate::Film::new) allows.
pub fn read(path: impl AsRef<Path>) -> Result<Image, ReadImageError> {
    let path = path.as_ref();
    let extension = path.extension().map(|text| text.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let (format, decode) = match extension.as_str() {
        "exr" => (EXR, read_exr as Decode),
        "hdr" => (HDR, read_hdr as Decode),
        "png" => (PNG, read_png as Decode),
        _ => {
            return Err(ReadImageError::Extension { path: path.to_path_buf(), extension });
        }
    };
    let io = |cause| ReadImageError::Io { path: path.to_path_buf(), cause };
    let file = File::open(path).map_err(io)?;
    // Devices and pipes may never end.
    if !file.metadata().map_err(io)?.is_file() {
        return Err(io(std::io::Error::other("it is no ordinary file")));
    }
    // The decoders are not ours and check some of their input with assertions; a damaged file must not
    // end a render that has many.
    std::panic::catch_unwind(AssertUnwindSafe(|| decode(path, BufReader::new(file))))
        .unwrap_or_else(|_| Err(contents(path, format, "the decoder could not make sense of it")))
}

type Decode = fn(&Path, BufReader<File>) -> Result<Image, ReadImageError>;

const EXR: &str = "OpenEXR";
const HDR: &str = "Radiance HDR";
const PNG: &str = "PNG";

fn contents(path: &Path, format: &'static str, what: impl Display) -> ReadImageError {
    ReadImageError::Contents { path: path.to_path_buf(), format, what: what.to_string() }
}

/// How many times larger than the file its pixels can be: deflate reaches 1032; EXR's codecs stay below it on
/// blocks and some constant blocks cost a few bytes; a run of the RGBE format is 127 bytes in 2.
const PNG_RATIO: u64 = 1100;
const EXR_RATIO: u64 = 4096;
const HDR_RATIO: u64 = 128;
/// Files may always claim this much.
const FREE_BYTES: u64 = 1 << 20;

/// Refuses a header that claims more pixels than the file can hold, before room is made for them.
fn check_claim(path: &Path, format: &'static str, bytes: u64, ratio: u64) -> Result<(), ReadImageError> {
    let there = std::fs::metadata(path).map_err(|cause| ReadImageError::Io { path: path.to_path_buf(), cause })?.len();
    if bytes > there.saturating_mul(ratio).max(FREE_BYTES) {
        let what = format!("its header claims {bytes} bytes of pixels, which {there} bytes of file cannot hold");
        return Err(contents(path, format, what));
    }
    Ok(())
}

fn check_size_of(path: &Path, width: u64, height: u64) -> Result<(u32, u32), ReadImageError> {
    check_size(width, height)
        // The check leaves nothing that does not fit in 32 bits.
        .map(|()| (width as u32, height as u32))
        .map_err(|cause| ReadImageError::Size { path: path.to_path_buf(), cause })
}

fn read_exr(path: &Path, file: BufReader<File>) -> Result<Image, ReadImageError> {
    let chunks = exr::block::read(file, false).map_err(|error| contents(path, EXR, error))?;
    for Header { layer_size: Vec2(width, height), channels, compression, .. } in chunks.headers() {
        check_size_of(path, *width as u64, *height as u64)?;
        let bytes = *width as u64 * *height as u64 * channels.bytes_per_pixel as u64;
        let most = if *compression == exr::compression::Compression::Uncompressed { 1 } else { EXR_RATIO };
        check_claim(path, EXR, bytes, most)?;
    }
    let has = |header: &Header, name: String| header.channels.list.iter().any(|channel| channel.name.eq(&name));
    let picture = chunks.headers().iter().find_map(|header| {
        PREFIXES.into_iter().find(|prefix| COLOURS.iter().all(|colour| has(header, format!("{prefix}{colour}"))))
    });
    let Some(prefix) = picture else {
        let names = chunks.headers().iter().flat_map(|header| header.channels.list.iter());
        let found = names.map(|channel| channel.name.to_string()).collect::<Vec<_>>().join(", ");
        return Err(ReadImageError::Channels { path: path.to_path_buf(), found });
    };
    let name = |channel: &str| Text::from(format!("{prefix}{channel}").as_str());

    // One thread: a panic in the decoder's own threads could not be caught.
    let decoded = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required::<f32>(name("R"))
        .required::<f32>(name("G"))
        .required::<f32>(name("B"))
        .optional(name("A"), 1.0_f32)
        .collect_pixels(
            |Vec2(width, height): Vec2<usize>,
             (_, _, _, alpha): &(
                ChannelDescription,
                ChannelDescription,
                ChannelDescription,
                Option<ChannelDescription>,
            )| Image {
                width: width as u32,
                height: height as u32,
                pixels: vec![Rgb::black(); width * height],
                alpha: alpha.is_some().then(|| vec![0.0; width * height]),
            },
            |image: &mut Image, Vec2(x, y): Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
                let index = y * image.width as usize + x;
                image.pixels[index] = Rgb([r, g, b]);
                if let Some(alpha) = &mut image.alpha {
                    alpha[index] = a;
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(chunks)
        .map_err(|error| contents(path, EXR, error))?;
    Ok(decoded.layer_data.channel_data.pixels)
}

fn read_hdr(path: &Path, mut file: BufReader<File>) -> Result<Image, ReadImageError> {
    let start = file.fill_buf().map_err(|cause| ReadImageError::Io { path: path.to_path_buf(), cause })?;
    if !start.starts_with(b"#?") {
        return Err(contents(path, HDR, "it does not start with \"#?\""));
    }
    // The decoder's strict mode knows one of the two signatures in use.
    let strict = start.starts_with(b"#?RADIANCE");
    let decoder = HdrDecoder::with_strictness(file, strict).map_err(|error| contents(path, HDR, error))?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size_of(path, width.into(), height.into())?;
    check_claim(path, HDR, 4 * u64::from(width) * u64::from(height), HDR_RATIO)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|error| contents(path, HDR, error))?;
    let pixels = decoded.into_rgb32f().pixels().map(|pixel| Rgb(pixel.0)).collect();
    Ok(Image { width, height, pixels, alpha: None })
}

fn read_png(path: &Path, file: BufReader<File>) -> Result<Image, ReadImageError> {
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    // Eight bytes are the largest pixel of the format; the rest is for its tables and text.
    limits.max_alloc = Some(8 * MAX_PIXELS + (64 << 20));
    let decoder = PngDecoder::with_limits(file, limits).map_err(|error| contents(path, PNG, error))?;
    let (width, height) = decoder.dimensions();
    let (width, height) = check_size_of(path, width.into(), height.into())?;
    check_claim(path, PNG, decoder.total_bytes(), PNG_RATIO)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(|error| contents(path, PNG, error))?;
    let transparent = decoded.color().has_alpha();
    let encoded = decoded.into_rgba32f();
    let pixels = encoded.pixels().map(|pixel| {
        let [r, g, b, a] = pixel.0;
        Rgb([r, g, b]).map(|channel| decode_srgb(channel) * a)
    });
    Ok(Image {
        width,
        height,
        pixels: pixels.collect(),
        alpha: transparent.then(|| encoded.pixels().map(|pixel| pixel.0[3]).collect()),
    })
}

#[cfg(test)]
mod tests {
    use ::image::codecs::hdr::HdrEncoder;

    use super::*;
    use crate::{PngOptions, write_image_exr, write_png};

    fn ramp(width: u32, height: u32, alpha: bool) -> Image {
        let count = width * height;
        let level = |i: u32| i as f32 / count as f32;
        let pixels = (0..count).map(|i| Rgb::new(level(i), 0.5, 1.0 - level(i)) * 0.75).collect();
        let alpha = alpha.then(|| vec![0.75; count as usize]);
        Image::new(width, height, pixels, alpha).unwrap()
    }

    fn write_hdr(path: &Path, image: &Image) {
        let pixels: Vec<_> = image.pixels.iter().map(|colour| ::image::Rgb(colour.0)).collect();
        let file = File::create(path).unwrap();
        HdrEncoder::new(file).encode(&pixels, image.width as usize, image.height as usize).unwrap();
    }

    #[test]
    fn exr_keeps_every_bit_even_of_what_is_no_light() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("odd.EXR");
        let mut image = ramp(5, 3, true);
        image.pixels[7] = Rgb::new(f32::NAN, -1.0, f32::INFINITY);
        image.pixels[9] = Rgb::new(0.0, f32::NEG_INFINITY, 1e-40);
        write_image_exr(&path, &image).unwrap();
        let back = read(&path).unwrap();
        assert_eq!((back.width, back.height), (5, 3));
        assert_eq!(back.alpha, image.alpha);
        for (got, want) in back.pixels.iter().zip(&image.pixels) {
            assert_eq!(got.0.map(f32::to_bits), want.0.map(f32::to_bits));
        }
        let defects = Defects { nan: 1, infinite: 2, negative: 1, first: Some((2, 1)) };
        assert_eq!(back.defects(), defects);
        assert!(!defects.is_empty());
        assert!(ramp(2, 2, true).defects().is_empty());
    }

    #[test]
    fn exr_without_a_picture_lists_its_channels() {
        use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples};
        use exr::prelude::WritableImage as _;
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, channels: &[&str]| {
            let path = folder.path().join(name);
            let level = |index: usize| FlatSamples::F32(vec![index as f32; 2]);
            let list = channels.iter().enumerate().map(|(index, name)| AnyChannel::new(*name, level(index)));
            let channels = AnyChannels::sort(list.collect());
            exr::image::Image::from_encoded_channels((2, 1), Encoding::UNCOMPRESSED, channels)
                .write()
                .to_file(&path)
                .unwrap();
            path
        };
        let error = read(write("depth.exr", &["Z", "diffuse.R"])).unwrap_err();
        assert!(error.to_string().contains("Z, diffuse.R"), "{error}");

        let beauty = read(write("beauty.exr", &["beauty.R", "beauty.G", "beauty.B", "Z"])).unwrap();
        assert_eq!(beauty.pixels, [Rgb::new(0.0, 1.0, 2.0); 2]);
        assert_eq!(beauty.alpha, None);
    }

    #[test]
    fn hdr_keeps_values_to_its_precision() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.hdr");
        let image = ramp(9, 2, false);
        write_hdr(&path, &image);
        let back = read(&path).unwrap();
        assert_eq!((back.width, back.height), (9, 2));
        for (got, want) in back.pixels.iter().zip(&image.pixels) {
            // Eight bits for the largest channel: a step is at most 1/128 of it.
            let step = want.max_channel() / 128.0;
            for channel in 0..3 {
                assert!((got[channel] - want[channel]).abs() <= step, "{got:?} {want:?}");
            }
        }
    }

    #[test]
    fn truncated_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let image = ramp(24, 40, true);
        let whole = ["whole.exr", "whole.hdr", "whole.png"].map(|name| folder.path().join(name));
        write_image_exr(&whole[0], &image).unwrap();
        write_hdr(&whole[1], &image);
        write_png(&whole[2], &image, &PngOptions::default()).unwrap();
        for path in &whole {
            read(path).unwrap();
            let bytes = std::fs::read(path).unwrap();
            let part = folder.path().join("part").with_extension(path.extension().unwrap());
            // To three quarters: after that a PNG only lacks what no pixel depends on.
            for length in (0..bytes.len() * 3 / 4).step_by(bytes.len() / 61 + 1) {
                std::fs::write(&part, &bytes[..length]).unwrap();
                let error = read(&part).expect_err("a part of the file is not the file");
                assert!(error.to_string().contains("part."), "{error}");
            }
        }
    }

    #[test]
    fn damaged_files_never_panic() {
        let folder = tempfile::tempdir().unwrap();
        let image = ramp(7, 5, true);
        let whole = ["whole.exr", "whole.hdr", "whole.png"].map(|name| folder.path().join(name));
        write_image_exr(&whole[0], &image).unwrap();
        write_hdr(&whole[1], &image);
        write_png(&whole[2], &image, &PngOptions::default()).unwrap();
        for (stream, path) in whole.iter().enumerate() {
            let bytes = std::fs::read(path).unwrap();
            let damaged = folder.path().join("damaged").with_extension(path.extension().unwrap());
            for attempt in 0..200 {
                let mut bytes = bytes.clone();
                for hit in 0..3 {
                    let word = math::hash::mix3(stream as u32, attempt, hit);
                    let position = word as usize % bytes.len();
                    bytes[position] = (word >> 24) as u8;
                }
                std::fs::write(&damaged, &bytes).unwrap();
                // Damage to pixel values is still an image; what counts is that this returns.
                if let Ok(image) = read(&damaged) {
                    image.check().unwrap();
                }
            }
        }
    }

    #[test]
    fn garbage_names_the_file_and_the_format() {
        let folder = tempfile::tempdir().unwrap();
        for (name, format) in [("noise.exr", EXR), ("noise.hdr", HDR), ("noise.png", PNG)] {
            let path = folder.path().join(name);
            for bytes in [&b""[..], b"P6 1 1 255 abc", &[0xff; 300], b"#?RADIANCE\n\n-Y 99999999 +X 99999999\n"] {
                std::fs::write(&path, bytes).unwrap();
                let error = read(&path).unwrap_err().to_string();
                assert!(error.contains(name), "{error}");
                assert!(error.contains(format) || error.contains("pixels"), "{error}");
            }
        }
        assert!(matches!(read("picture.jpg"), Err(ReadImageError::Extension { .. })));
        assert!(matches!(read(folder.path().join("absent.exr")), Err(ReadImageError::Io { .. })));
    }

    #[test]
    fn lists_must_fill_the_image() {
        let error = Image::new(2, 2, vec![Rgb::black(); 3], None).unwrap_err();
        assert_eq!(error.to_string(), "3 colours do not fill an image of 2 x 2 pixels");
        assert!(Image::new(1, 1, vec![Rgb::black()], Some(vec![])).is_err());
        assert!(matches!(Image::new(0, 2, vec![], None), Err(SizeError::Side { .. })));
    }
}
