//! From scene-linear light to a display: exposure, tone curve, sRGB encoding, PNG.
//!
//! Every view maps black to black and mid-grey (0.18) to mid-grey, so switching views does not change
//! the exposure. All are applied per channel after `2^exposure`; NaN and negative light are black,
//! infinite light is as white as can be.

use std::fmt;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use std::str::FromStr;

use ::image::codecs::png::PngEncoder;
use ::image::{ExtendedColorType, ImageEncoder as _};
use math::Rgb;

use crate::Image;
use crate::atomic::{self, WriteError};

/// Scene-linear mid-grey, and what it is shown as, display-linear.
const MID_GREY: f32 = 0.18;

/// Brighter light than any curve tells apart, and still small enough to square.
const CEILING: f32 = 1_048_576.0;

/// How scene-linear light is brought to a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// Clipped at 1 and encoded: exact below, hard above.
    #[default]
    Srgb,
    /// A film-like curve per channel: toe, a slope of 1.2 around mid-grey, white 6.5 stops above it.
    Filmic,
    /// After the idea of AgX: bright saturated light runs to white and does not change its hue much.
    Agx,
}

impl View {
    /// All views.
    pub const ALL: [Self; 3] = [Self::Srgb, Self::Filmic, Self::Agx];

    /// The sRGB-encoded colour on the display, `0..=1` per channel; `exposure_ev` is in stops.
    pub fn to_display(self, linear: Rgb, exposure_ev: f32) -> [f32; 3] {
        let gain = exposure_ev.exp2();
        // NaN compares false and so becomes black too.
        let scene = linear.0.map(|light| if light * gain > 0.0 { (light * gain).min(CEILING) } else { 0.0 });
        let display = match self {
            Self::Srgb => scene,
            Self::Filmic => scene.map(filmic),
            Self::Agx => agx(scene),
        };
        display.map(|light| encode_srgb(light.clamp(0.0, 1.0)).clamp(0.0, 1.0))
    }

    fn name(self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::Filmic => "filmic",
            Self::Agx => "agx",
        }
    }
}

impl fmt::Display for View {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The text is not the name of a view.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found:?} is not a view: choose srgb, filmic or agx")]
pub struct ParseViewError {
    /// The text found.
    pub found: String,
}

impl FromStr for View {
    type Err = ParseViewError;

    fn from_str(text: &str) -> Result<Self, ParseViewError> {
        let named = |view: &Self| view.name().eq_ignore_ascii_case(text);
        Self::ALL.into_iter().find(named).ok_or_else(|| ParseViewError { found: text.to_owned() })
    }
}

/// The sRGB encoding of linear light; inverse of [`decode_srgb`].
pub fn encode_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The linear light of an sRGB-encoded value, as IEC 61966-2-1 defines it.
pub fn decode_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The film-like curve, from scene-linear to display-linear.
///
/// The ratio `x (a x + b) / (x (c x + d) + 1)` rises everywhere for positive coefficients with
/// `a d > b c`, and is fixed by four wishes: `b` is the slope of the toe, the value at `MID_GREY` is
/// `MID_GREY`, the value at `WHITE` is 1, and `a / c`, which it would reach at infinity, is `LIMIT`. A
/// limit nearer to 1 gives more contrast at mid-grey; this one gives 1.18 in log-log.
fn filmic(x: f32) -> f32 {
    /// Slope at black: below 1, so shadows are pressed together.
    const TOE: f64 = 0.5;
    /// 6.5 stops above mid-grey.
    const WHITE: f64 = MID * 90.509_667_991_878;
    const LIMIT: f64 = 1.02;
    const MID: f64 = 0.18;
    // The two values are two linear equations for a and d, with c = a / LIMIT.
    const A: f64 =
        (1.0 - TOE + MID * (TOE - 1.0 / WHITE)) / (MID - MID * MID / LIMIT - MID * WHITE * (1.0 - 1.0 / LIMIT));
    const C: f64 = A / LIMIT;
    const D: f64 = A * WHITE * (1.0 - 1.0 / LIMIT) + TOE - 1.0 / WHITE;

    // In double precision the shoulder, where the slope is nearly zero, still rises.
    let x = f64::from(x);
    ((x * (A * x + TOE)) / (x * (C * x + D) + 1.0)).min(1.0) as f32
}

/// The AgX-like view, from scene-linear to display-linear.
///
/// Not the published AgX: the same construction with matrices and a curve of our own.
///
/// 1. *Inset*: every channel moves towards the mean of the three, as with the matrix that has 0.85 on
///    its diagonal and 0.075 elsewhere. A pure colour now has some of every channel.
/// 2. *Log*: `log2(x / 0.18)` from −10 to +6.5 stops becomes 0 to 1.
/// 3. *Curve* per channel, to sRGB-encoded values: see [`sigmoid`]. Where one channel is at its end the
///    others still rise, which is the way to white.
/// 4. *Outset*: the inverse of the inset, on display-linear light, gives the colour back; what leaves
///    the display is clipped by the caller.
fn agx(scene: [f32; 3]) -> [f32; 3] {
    /// What remains of the difference to the mean: 1 − 0.225, and 0.775 + 0.225 / 3 = 0.85.
    const KEEP: f32 = 0.775;
    const STOPS_BELOW: f32 = 10.0;
    const STOPS: f32 = 16.5;

    let towards_mean = |colour: [f32; 3], keep: f32| {
        let mean = (colour[0] + colour[1] + colour[2]) / 3.0;
        colour.map(|channel| mean + (channel - mean) * keep)
    };
    let display = towards_mean(scene, KEEP).map(|light| {
        let stops = (light.max(f32::MIN_POSITIVE) / MID_GREY).log2();
        let position = ((stops + STOPS_BELOW) / STOPS).clamp(0.0, 1.0);
        decode_srgb(sigmoid(position, STOPS_BELOW / STOPS))
    });
    towards_mean(display, 1.0 / KEEP)
}

/// From log position to sRGB-encoded value, both `0..=1`: two power curves that meet at `pivot`, where
/// the value is mid-grey, with one slope.
fn sigmoid(position: f32, pivot: f32) -> f32 {
    /// Slope at the pivot; gives a contrast of 1.12 in log-log of linear light.
    const SLOPE: f32 = 2.75;

    let grey = encode_srgb(MID_GREY);
    if position < pivot {
        grey * (position / pivot).powf(SLOPE * pivot / grey)
    } else {
        let (rest, left) = (1.0 - pivot, 1.0 - grey);
        1.0 - left * ((1.0 - position) / rest).powf(SLOPE * rest / left)
    }
}

/// Bits per channel of a PNG file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 256 levels.
    #[default]
    Eight,
    /// 65 536 levels.
    Sixteen,
}

/// How [`write_png`] shows an image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PngOptions {
    /// From light to display.
    pub view: View,
    /// Exposure in stops, before the view.
    pub exposure_ev: f32,
    /// Bits per channel.
    pub depth: BitDepth,
    /// Whether to keep the alpha, as straight alpha; otherwise the colours are written as they are,
    /// which is over black where nothing is behind the hair.
    pub transparent: bool,
}

/// Writes a view of an image as PNG; the file is complete or not there.
///
/// # Errors
///
/// The file cannot be written, or the lists of the image do not fill it.
pub fn write_png(path: impl AsRef<Path>, image: &Image, options: &PngOptions) -> Result<(), WriteError> {
    let path = path.as_ref();
    image.check().map_err(|cause| WriteError::Size { path: path.to_path_buf(), cause })?;
    let alpha = image.alpha.as_ref().filter(|_| options.transparent);
    let (color, channel_bytes) = match (alpha.is_some(), options.depth) {
        (false, BitDepth::Eight) => (ExtendedColorType::Rgb8, 1),
        (true, BitDepth::Eight) => (ExtendedColorType::Rgba8, 1),
        (false, BitDepth::Sixteen) => (ExtendedColorType::Rgb16, 2),
        (true, BitDepth::Sixteen) => (ExtendedColorType::Rgba16, 2),
    };
    let channels = if alpha.is_some() { 4 } else { 3 };
    let mut bytes = Vec::with_capacity(image.pixels.len() * channels * channel_bytes);
    let mut push = |value: f32| match options.depth {
        BitDepth::Eight => bytes.push(quantised(value, 255.0) as u8),
        BitDepth::Sixteen => bytes.extend(quantised(value, 65_535.0).to_ne_bytes()),
    };
    for (index, &colour) in image.pixels.iter().enumerate() {
        // An opacity that is not a number compares false and is none.
        let opacity = alpha.map(|alpha| if alpha[index] > 0.0 { alpha[index].min(1.0) } else { 0.0 });
        let straight = match opacity {
            Some(opacity) if opacity > 0.0 => colour / opacity,
            _ => colour,
        };
        options.view.to_display(straight, options.exposure_ev).into_iter().chain(opacity).for_each(&mut push);
    }
    atomic::write(path, |file| {
        let mut file = BufWriter::new(file);
        PngEncoder::new(&mut file)
            .write_image(&bytes, image.width, image.height, color)
            .map_err(|error| error.to_string())?;
        file.flush().map_err(|error| error.to_string())
    })
}

/// The nearest of the levels `0..=top` to a value in `0..=1`.
fn quantised(value: f32, top: f32) -> u16 {
    (value * top + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exposures from far below to far above every curve, in stops around mid-grey.
    fn stops() -> impl Iterator<Item = f32> {
        (-400..=400).map(|step| step as f32 * 0.05)
    }

    #[test]
    fn encoding_and_decoding_are_inverse() {
        for step in 0..=1000 {
            let encoded = step as f32 / 1000.0;
            // 1e-5: the two published pieces meet with a jump of about that size.
            assert!((encode_srgb(decode_srgb(encoded)) - encoded).abs() < 1e-5, "{encoded}");
        }
        assert!((decode_srgb(0.5) - 0.214_041).abs() < 1e-6);
    }

    #[test]
    fn views_rise_from_black_to_white() {
        for view in View::ALL {
            assert_eq!(view.to_display(Rgb::black(), 3.0), [0.0; 3], "{view}");
            let mut last = 0.0;
            for stop in stops() {
                let shown = view.to_display(Rgb::splat(MID_GREY * stop.exp2()), 0.0)[0];
                // 1e-6: single-precision rounding on the flat ends.
                assert!(shown >= last - 1e-6, "{view} falls at {stop} stops: {last} to {shown}");
                last = shown;
            }
            assert!(last > 0.999, "{view} ends at {last}");
        }
    }

    #[test]
    fn views_use_their_range() {
        // Six stops above mid-grey is not white yet, except where the view clips; ten below is black.
        let six_up = Rgb::splat(MID_GREY);
        // The curve itself ends one unit in the last place below 1.
        assert!(View::Srgb.to_display(six_up, 6.0)[0] >= 1.0 - f32::EPSILON);
        for view in [View::Filmic, View::Agx] {
            let shown = view.to_display(six_up, 6.0)[0];
            assert!((0.95..0.9999).contains(&shown), "{view}: {shown}");
            assert!(view.to_display(six_up, 6.6)[0] > 0.9999, "{view}");
            assert!(view.to_display(six_up, -10.0)[0] < 0.002, "{view}");
        }
    }

    #[test]
    fn mid_grey_stays() {
        for view in View::ALL {
            let shown = decode_srgb(view.to_display(Rgb::splat(MID_GREY), 0.0)[0]);
            // It is built in exactly; 1e-5 is rounding through powers and logarithms.
            assert!((shown - MID_GREY).abs() < 1e-5, "{view}: {shown}");
            let exposed = view.to_display(Rgb::splat(MID_GREY / 8.0), 3.0);
            assert_eq!(exposed, view.to_display(Rgb::splat(MID_GREY), 0.0), "{view}");
        }
    }

    #[test]
    fn neutral_stays_neutral() {
        for view in View::ALL {
            for stop in stops() {
                let [r, g, b] = view.to_display(Rgb::splat(MID_GREY * stop.exp2()), 0.0);
                assert_eq!((r, g), (b, b), "{view} at {stop} stops");
            }
        }
    }

    #[test]
    fn bright_saturated_light_runs_to_white_in_agx() {
        let red = Rgb::new(1.0, 0.05, 0.0);
        let saturation = |view: View, ev: f32| {
            let [r, _, b] = view.to_display(red, ev);
            r - b
        };
        assert!(saturation(View::Agx, 8.0) < 0.1);
        assert!(saturation(View::Agx, 0.0) > 0.3);
        assert!(saturation(View::Srgb, 8.0) > 0.9);
    }

    #[test]
    fn nothing_that_is_no_light_gets_through() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX, f32::MIN_POSITIVE, -0.0];
        for view in View::ALL {
            for a in odd {
                for b in odd {
                    for ev in [0.0, 200.0, -200.0, f32::NAN, f32::INFINITY] {
                        let shown = view.to_display(Rgb::new(a, b, 0.5), ev);
                        assert!(shown.iter().all(|x| (0.0..=1.0).contains(x)), "{view} {a} {b} {ev}: {shown:?}");
                    }
                }
            }
            assert_eq!(view.to_display(Rgb::splat(-1.0), 0.0), [0.0; 3]);
            assert_eq!(view.to_display(Rgb::splat(f32::NAN), 0.0), [0.0; 3]);
        }
    }

    #[test]
    fn names_are_read_back() {
        for view in View::ALL {
            assert_eq!(view.to_string().parse::<View>(), Ok(view));
        }
        assert_eq!("AgX".parse::<View>(), Ok(View::Agx));
        let error = "aces".parse::<View>().unwrap_err().to_string();
        assert_eq!(error, "\"aces\" is not a view: choose srgb, filmic or agx");
    }

    #[test]
    fn png_keeps_values_to_half_a_level() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ramp.png");
        let levels: Vec<f32> = (0..=255).map(|level| level as f32 / 255.0).collect();
        let pixels = levels.iter().map(|&level| Rgb::new(decode_srgb(level), decode_srgb(1.0 - level), 0.5)).collect();
        let image = Image::new(16, 16, pixels, None).unwrap();
        for (depth, top) in [(BitDepth::Eight, 255.0), (BitDepth::Sixteen, 65_535.0)] {
            write_png(&path, &image, &PngOptions { depth, ..PngOptions::default() }).unwrap();
            let back = crate::image::read(&path).unwrap();
            assert_eq!((back.width, back.height, &back.alpha), (16, 16, &None));
            for (got, want) in back.pixels.iter().zip(&image.pixels) {
                for channel in 0..3 {
                    let error = encode_srgb(got[channel]) - encode_srgb(want[channel]);
                    // Half a level, and 1e-5 for going through the encoding twice more.
                    assert!(error.abs() <= 0.5 / top + 1e-5, "{depth:?}: {got:?} for {want:?}");
                }
            }
        }
    }

    #[test]
    fn alpha_is_straight_in_the_file_and_associated_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("soft.png");
        let pixels = vec![Rgb::new(0.2, 0.1, 0.05), Rgb::black(), Rgb::splat(0.3)];
        let image = Image::new(3, 1, pixels, Some(vec![0.5, 0.0, f32::NAN])).unwrap();
        let options = PngOptions { depth: BitDepth::Sixteen, transparent: true, ..PngOptions::default() };
        write_png(&path, &image, &options).unwrap();
        let back = crate::image::read(&path).unwrap();
        let alpha = back.alpha.unwrap();
        // One level of 65 535, and for the colours its slope of at most 2.3 in linear light.
        assert!((alpha[0] - 0.5).abs() < 2e-5);
        assert_eq!(alpha[1..], [0.0, 0.0]);
        assert!((back.pixels[0] - image.pixels[0]).0.iter().all(|error| error.abs() < 5e-5));

        write_png(&path, &image, &PngOptions { transparent: false, ..options }).unwrap();
        assert_eq!(crate::image::read(&path).unwrap().alpha, None);
    }

    #[test]
    fn png_errors_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let image = Image::new(1, 1, vec![Rgb::black()], None).unwrap();
        let error = write_png(folder.path().join("absent/a.png"), &image, &PngOptions::default()).unwrap_err();
        assert!(error.to_string().contains("absent"), "{error}");
        assert!(write_png(folder.path(), &image, &PngOptions::default()).is_err());
        let short = Image { width: 2, ..image };
        assert!(write_png(folder.path().join("b.png"), &short, &PngOptions::default()).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
