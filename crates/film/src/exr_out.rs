//! Films and images as OpenEXR files.
//!
//! One part, ZIP-compressed scan lines, associated alpha, Rec.709 chromaticities. The channels of a film:
//!
//! | channel | type | what |
//! |---|---|---|
//! | `R` `G` `B` `A` | f32 | mean light and opacity |
//! | `direct.*` `indirect.*` | f32 | mean light after one bounce, after more |
//! | `lobe_R.*` `lobe_TT.*` `lobe_TRT.*` `lobe_residual.*` | f32 | mean light by lobe of the first hit |
//! | `albedo.*` | f32 | mean reflectance of the first hit |
//! | `tangent.X` `.Y` `.Z` | f32 | mean strand tangent, unit length; 0 off hair |
//! | `Z` | f32 | mean distance of the first hit, scene units; infinite without one |
//! | `strand_id.ID` | u32 | strand of the first sample that hit hair; 2³² − 1 off hair |
//! | `samples.N` | u32 | samples |
//! | `variance.V` | f32 | variance of the mean luminance; 0 below two samples |
//!
//! Values are computed while they are written, so no second film is held in memory.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::image::{AnyChannel, AnyChannels, Encoding, Layer};
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{AttributeValue, Chromaticities, LevelMode, SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::WritableImage as _;
use math::Rgb;

use crate::atomic::{self, WriteError};
use crate::{Film, Image, Pixel};

/// What every metadata name begins with in the file.
const NAMESPACE: &str = "cuticle/";

/// The lobes of [`Sample::lobes`](crate::Sample::lobes), in its order.
const LOBES: [&str; 4] = ["lobe_R.", "lobe_TT.", "lobe_TRT.", "lobe_residual."];

/// What is known about a picture besides its pixels, as names and values.
///
/// Each becomes a text attribute `cuticle/<name>` of the EXR file. Names are 1 to 200 printable ASCII
/// characters and unique; values are any UTF-8.
///
/// The order of the attributes in the file is not fixed, so two files of the same picture may differ in
/// their headers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata(pub Vec<(String, String)>);

impl Metadata {
    /// With one more entry.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, value: impl ToString) -> Self {
        self.0.push((name.into(), value.to_string()));
        self
    }
}

/// Writes all channels of a film and the metadata; the file is complete or not there.
///
/// # Errors
///
/// The file cannot be written, or a name in the metadata is not allowed.
pub fn write_exr(path: impl AsRef<Path>, film: &Film, metadata: &Metadata) -> Result<(), WriteError> {
    let path = path.as_ref();
    let mut attributes = LayerAttributes::default();
    for (name, value) in &metadata.0 {
        let allowed =
            (1..=200).contains(&name.len()) && name.bytes().all(|byte| byte.is_ascii_graphic() || byte == b' ');
        let key = Text::from_slice_unchecked(format!("{NAMESPACE}{name}").as_bytes());
        let value = AttributeValue::Text(Text::from_slice_unchecked(value.as_bytes()));
        if !allowed || attributes.other.insert(key, value).is_some() {
            return Err(WriteError::MetadataName { path: path.to_path_buf(), name: name.clone() });
        }
    }
    write(path, film.width(), film.height(), attributes, film_channels(film))
}

/// Writes the colours and, if there is one, the alpha of an image; the file is complete or not there.
///
/// # Errors
///
/// The file cannot be written, or the lists of the image do not fill it.
pub fn write_image_exr(path: impl AsRef<Path>, image: &Image) -> Result<(), WriteError> {
    let path = path.as_ref();
    image.check().map_err(|cause| WriteError::Size { path: path.to_path_buf(), cause })?;
    let mut channels = Vec::new();
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        channels.push((name.to_owned(), Values::F32(Box::new(move |index| image.pixels[index][channel]))));
    }
    if let Some(alpha) = &image.alpha {
        channels.push(("A".to_owned(), Values::F32(Box::new(move |index| alpha[index]))));
    }
    write(path, image.width, image.height, LayerAttributes::default(), channels)
}

/// What a channel holds, by the index of the pixel.
enum Values<'a> {
    F32(Box<dyn Fn(usize) -> f32 + Sync + 'a>),
    U32(Box<dyn Fn(usize) -> u32 + Sync + 'a>),
}

/// One channel as the encoder sees it.
struct Plane<'a> {
    width: usize,
    values: Values<'a>,
}

impl<'s, 'a: 's> WritableSamples<'s> for Plane<'a> {
    type Writer = &'s Plane<'a>;

    fn sample_type(&self) -> SampleType {
        match self.values {
            Values::F32(_) => SampleType::F32,
            Values::U32(_) => SampleType::U32,
        }
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'s self, _: &Header) -> Self::Writer {
        self
    }
}

impl SamplesWriter for &Plane<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let Vec2(x, y) = line.location.position;
        let start = y * self.width + x;
        let written = match &self.values {
            Values::F32(get) => line.write_samples(|offset| get(start + offset)),
            Values::U32(get) => line.write_samples(|offset| get(start + offset)),
        };
        // The encoder sizes the line by `sample_type`, so it can not be too short.
        debug_assert!(written.is_ok(), "a line in memory takes all its samples");
    }
}

fn film_channels(film: &Film) -> Vec<(String, Values<'_>)> {
    fn real<'a>(name: &str, pixels: &'a [Pixel], get: impl Fn(&Pixel) -> f32 + Sync + 'a) -> (String, Values<'a>) {
        (name.to_owned(), Values::F32(Box::new(move |index| get(&pixels[index]))))
    }
    fn whole<'a>(name: &str, pixels: &'a [Pixel], get: impl Fn(&Pixel) -> u32 + Sync + 'a) -> (String, Values<'a>) {
        (name.to_owned(), Values::U32(Box::new(move |index| get(&pixels[index]))))
    }
    fn colour<'a>(
        prefix: &str,
        pixels: &'a [Pixel],
        get: impl Fn(&Pixel) -> Rgb + Sync + Copy + 'a,
    ) -> [(String, Values<'a>); 3] {
        [0, 1, 2].map(|channel| {
            let name = format!("{prefix}{}", ["R", "G", "B"][channel]);
            real(&name, pixels, move |pixel| get(pixel)[channel])
        })
    }

    let pixels = film.pixels();
    let mut channels = Vec::new();
    channels.extend(colour("", pixels, Pixel::beauty));
    channels.push(real("A", pixels, Pixel::alpha));
    channels.extend(colour("direct.", pixels, Pixel::direct));
    channels.extend(colour("indirect.", pixels, Pixel::indirect));
    for (lobe, prefix) in LOBES.into_iter().enumerate() {
        channels.extend(colour(prefix, pixels, move |pixel| pixel.lobes()[lobe]));
    }
    channels.extend(colour("albedo.", pixels, Pixel::albedo));
    channels.push(real("tangent.X", pixels, |pixel| pixel.tangent().x));
    channels.push(real("tangent.Y", pixels, |pixel| pixel.tangent().y));
    channels.push(real("tangent.Z", pixels, |pixel| pixel.tangent().z));
    channels.push(real("Z", pixels, Pixel::depth));
    channels.push(whole("strand_id.ID", pixels, Pixel::strand));
    channels.push(whole("samples.N", pixels, Pixel::samples));
    channels.push(real("variance.V", pixels, |pixel| pixel.variance().unwrap_or(0.0) as f32));
    channels
}

fn write(
    path: &Path,
    width: u32,
    height: u32,
    attributes: LayerAttributes,
    channels: Vec<(String, Values<'_>)>,
) -> Result<(), WriteError> {
    let size = Vec2(width as usize, height as usize);
    let list = channels
        .into_iter()
        .map(|(name, values)| AnyChannel::new(name.as_str(), Plane { width: size.0, values }))
        .collect();
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(list));
    let mut image = exr::image::Image::from_layer(layer);
    image.attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    atomic::write(path, |file: &mut File| {
        image.write().to_buffered(BufWriter::new(file)).map_err(|error| error.to_string())
    })
}

#[cfg(test)]
mod tests {
    use exr::image::FlatSamples;
    use exr::prelude::read_first_flat_layer_from_file;
    use math::{Vec3, hash};

    use super::*;
    use crate::Sample;

    /// A film that is taller than one compression block and has something in every channel.
    fn film() -> Film {
        let mut film = Film::new(6, 37).unwrap();
        for (index, pixel) in film.pixels_mut().iter_mut().enumerate() {
            for sample in 0..3 {
                let random = |what: u32| hash::unit(what, hash::mix2(index as u32, sample));
                let colour = |what: u32| Rgb::new(random(what), random(what + 1), random(what + 2));
                let hair = index % 3 != 0;
                pixel.add(&Sample {
                    beauty: colour(0),
                    alpha: if hair { 1.0 } else { 0.0 },
                    direct: colour(10),
                    indirect: colour(20),
                    lobes: [colour(30), colour(40), colour(50), colour(60)],
                    depth: if hair { 1.0 + random(70) } else { f32::INFINITY },
                    tangent: if hair { Vec3::new(random(80), random(81), random(82)) } else { Vec3::ZERO },
                    albedo: colour(90),
                    // Above 2²⁴, where a float would lose the last digits.
                    strand: if hair { 3_000_000_001 + index as u32 } else { crate::NO_STRAND },
                });
            }
        }
        film
    }

    #[test]
    fn a_film_comes_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.exr");
        let film = film();
        let metadata = Metadata::default().with("seed", 7).with("command line", "cuticle render löwe.toml");
        write_exr(&path, &film, &metadata).unwrap();

        let back = read_first_flat_layer_from_file(&path).unwrap();
        let layer = &back.layer_data;
        assert_eq!(layer.size, Vec2(6, 37));
        let names: Vec<String> = layer.channel_data.list.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(
            names.join(" "),
            "A B G R Z albedo.B albedo.G albedo.R direct.B direct.G direct.R indirect.B indirect.G indirect.R \
             lobe_R.B lobe_R.G lobe_R.R lobe_TRT.B lobe_TRT.G lobe_TRT.R lobe_TT.B lobe_TT.G lobe_TT.R \
             lobe_residual.B lobe_residual.G lobe_residual.R samples.N strand_id.ID tangent.X tangent.Y tangent.Z \
             variance.V"
        );

        let stored = |name: &str| &layer.channel_data.list.iter().find(|c| c.name.eq(name)).unwrap().sample_data;
        let real = |name: &str, want: &dyn Fn(&Pixel) -> f32| match stored(name) {
            FlatSamples::F32(got) => {
                let want: Vec<u32> = film.pixels().iter().map(|pixel| want(pixel).to_bits()).collect();
                assert_eq!(got.iter().map(|value| value.to_bits()).collect::<Vec<_>>(), want, "{name}");
            }
            other => panic!("{name} is {other:?}"),
        };
        real("R", &|pixel: &Pixel| pixel.beauty()[0]);
        real("B", &|pixel: &Pixel| pixel.beauty()[2]);
        real("A", &Pixel::alpha);
        real("direct.G", &|pixel: &Pixel| pixel.direct()[1]);
        real("indirect.R", &|pixel: &Pixel| pixel.indirect()[0]);
        real("lobe_R.R", &|pixel: &Pixel| pixel.lobes()[0][0]);
        real("lobe_TT.G", &|pixel: &Pixel| pixel.lobes()[1][1]);
        real("lobe_TRT.B", &|pixel: &Pixel| pixel.lobes()[2][2]);
        real("lobe_residual.R", &|pixel: &Pixel| pixel.lobes()[3][0]);
        real("albedo.B", &|pixel: &Pixel| pixel.albedo()[2]);
        real("tangent.Y", &|pixel: &Pixel| pixel.tangent().y);
        real("Z", &Pixel::depth);
        real("variance.V", &|pixel: &Pixel| pixel.variance().unwrap() as f32);
        let strands = film.pixels().iter().map(Pixel::strand).collect();
        assert_eq!(stored("strand_id.ID"), &FlatSamples::U32(strands));
        assert_eq!(stored("samples.N"), &FlatSamples::U32(vec![3; 6 * 37]));

        let text = |name: &str| match layer.attributes.other.get(&Text::from(name)) {
            Some(AttributeValue::Text(text)) => String::from_utf8(text.bytes().to_vec()).unwrap(),
            other => panic!("{name} is {other:?}"),
        };
        assert_eq!(text("cuticle/seed"), "7");
        assert_eq!(text("cuticle/command line"), "cuticle render löwe.toml");
        assert!(back.attributes.chromaticities.is_some());

        // And our own reader finds the beauty among the others.
        assert_eq!(crate::image::read(&path).unwrap(), film.image());
    }

    #[test]
    fn metadata_names_are_checked_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.exr");
        let film = Film::new(1, 1).unwrap();
        let repeated = Metadata::default().with("seed", 1).with("seed", 2);
        let long = Metadata::default().with("x".repeat(201), "");
        for metadata in [Metadata::default().with("", 1), Metadata::default().with("a\0b", 1), repeated, long] {
            let error = write_exr(&path, &film, &metadata).unwrap_err();
            assert!(matches!(error, WriteError::MetadataName { .. }), "{error}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_missing_folder_or_one_in_the_way_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let film = Film::new(2, 2).unwrap();
        let missing = folder.path().join("absent/film.exr");
        let error = write_exr(&missing, &film, &Metadata::default()).unwrap_err();
        assert!(error.to_string().contains("absent"), "{error}");
        assert!(matches!(write_image_exr(folder.path(), &film.image()), Err(WriteError::Folder { .. })));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn an_image_whose_lists_do_not_fill_it_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let image = Image { width: 2, height: 2, pixels: vec![Rgb::black(); 3], alpha: None };
        let error = write_image_exr(folder.path().join("short.exr"), &image).unwrap_err();
        assert!(matches!(error, WriteError::Size { .. }), "{error}");
    }
}
