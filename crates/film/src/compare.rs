//! How far one picture is from another.
//!
//! Errors of light are taken in scene-linear values, over all channels and pixels, in `f64`. Alpha is
//! not compared. FLIP is the odd one: it asks what a viewer would notice, so it sees both pictures
//! exposed, clipped and sRGB-encoded, in the eight bits its library takes.

use math::Rgb;

use crate::frame::SizeError;
use crate::image::Image;

/// Added to the squared reference in the relative error, so that black pixels do not divide by zero.
const RELATIVE_FLOOR: f64 = 1e-4;

/// One pixel in so many is left out of the trimmed error.
const TRIMMED_SHARE: usize = 1000;

/// Why two images cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// They differ in size.
    #[error("the test image has {}x{} pixels and the reference {}x{}", .test.0, .test.1, .reference.0, .reference.1)]
    Size {
        /// Width and height of the test image.
        test: (u32, u32),
        /// Width and height of the reference.
        reference: (u32, u32),
    },

    /// One of them is not an image.
    #[error("the {which} image: {cause}")]
    Image {
        /// `"test"` or `"reference"`.
        which: &'static str,
        /// What is wrong with its size.
        cause: SizeError,
    },

    /// A value is not a finite number, which would make every mean of it one too.
    #[error("the {which} image is not finite at pixel ({x}, {y})")]
    NotFinite {
        /// `"test"` or `"reference"`.
        which: &'static str,
        /// Column of the first such pixel.
        x: u32,
        /// Row of the first such pixel.
        y: u32,
    },
}

/// The difference between a test image and a reference, in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Mean squared error.
    pub mse: f64,
    /// Mean of squared error / (reference² + 10⁻⁴).
    pub relmse: f64,
    /// The same without the worst thousandth of the pixels, rounded down: fireflies do not decide it.
    pub relmse_trimmed: f64,
    /// Mean colour of the test image.
    pub mean_test: Rgb<f64>,
    /// Mean colour of the reference.
    pub mean_reference: Rgb<f64>,
    /// Mean test colour over mean reference colour; 1 where both are zero.
    pub mean_ratio: Rgb<f64>,
    /// The largest difference of any channel.
    pub max_abs: f64,
    /// Peak signal-to-noise ratio in dB for a peak of 1; infinite for equal images.
    pub psnr: f64,
    /// Mean FLIP error, `0..=1`, at the library's default of 67 pixels per degree. `None` without the
    /// feature `flip`.
    pub flip: Option<f32>,
    /// FLIP error per pixel in the magma colours, black to pale yellow, as linear light. `None` without
    /// the feature `flip`.
    pub flip_map: Option<Image>,
}

impl Comparison {
    /// Compares two images of one size, without exposure.
    ///
    /// # Errors
    ///
    /// The sizes differ, or a value is not finite.
    pub fn of(test: &Image, reference: &Image) -> Result<Self, CompareError> {
        Self::at_exposure(test, reference, 0.0)
    }

    /// Compares two images of one size; FLIP sees them after `exposure_ev` stops, all else is without.
    ///
    /// # Errors
    ///
    /// As for [`of`](Self::of).
    pub fn at_exposure(test: &Image, reference: &Image, exposure_ev: f32) -> Result<Self, CompareError> {
        let mut comparison = Self::numbers(test, reference)?;
        (comparison.flip, comparison.flip_map) = flip(test, reference, exposure_ev);
        Ok(comparison)
    }

    /// Compares two images of one size without FLIP, which takes much longer than all else.
    ///
    /// # Errors
    ///
    /// As for [`of`](Self::of).
    pub fn numbers(test: &Image, reference: &Image) -> Result<Self, CompareError> {
        check(test, reference)?;
        let count = test.pixels.len() as f64;
        let mut squared = 0.0;
        let mut max_abs = 0.0_f64;
        let mut relative = Vec::with_capacity(test.pixels.len());
        for (test, reference) in test.pixels.iter().zip(&reference.pixels) {
            let (test, reference) = (test.cast::<f64>(), reference.cast::<f64>());
            let difference = test - reference;
            let error = difference * difference;
            squared += sum(error);
            max_abs = max_abs.max(difference.map(f64::abs).max_channel());
            relative.push(sum(error / (reference * reference + Rgb::splat(RELATIVE_FLOOR))) / 3.0);
        }
        let mse = squared / (3.0 * count);
        let relmse = relative.iter().sum::<f64>() / count;
        let mean = |image: &Image| image.pixels.iter().map(|colour| colour.cast::<f64>()).sum::<Rgb<f64>>() / count;
        let (mean_test, mean_reference) = (mean(test), mean(reference));
        Ok(Self {
            mse,
            relmse,
            relmse_trimmed: trimmed_mean(relative),
            mean_test,
            mean_reference,
            mean_ratio: mean_test.zip(
                mean_reference,
                |test, reference| {
                    if test == reference { 1.0 } else { test / reference }
                },
            ),
            max_abs,
            psnr: -10.0 * mse.log10(),
            flip: None,
            flip_map: None,
        })
    }
}

/// The absolute difference of two images, times `scale`, as an image.
///
/// # Errors
///
/// The sizes differ, or a value is not finite.
pub fn difference_image(test: &Image, reference: &Image, scale: f32) -> Result<Image, CompareError> {
    check(test, reference)?;
    let pairs = test.pixels.iter().zip(&reference.pixels);
    Ok(Image {
        width: test.width,
        height: test.height,
        pixels: pairs.map(|(&test, &reference)| (test - reference).map(|error| error.abs() * scale)).collect(),
        alpha: None,
    })
}

fn check(test: &Image, reference: &Image) -> Result<(), CompareError> {
    let size = |image: &Image| (image.width, image.height);
    if size(test) != size(reference) {
        return Err(CompareError::Size { test: size(test), reference: size(reference) });
    }
    for (which, image) in [("test", test), ("reference", reference)] {
        image.check().map_err(|cause| CompareError::Image { which, cause })?;
        if let Some(index) = image.pixels.iter().position(|colour| !colour.is_finite()) {
            let width = image.width as usize;
            return Err(CompareError::NotFinite { which, x: (index % width) as u32, y: (index / width) as u32 });
        }
    }
    Ok(())
}

fn sum(colour: Rgb<f64>) -> f64 {
    colour.0.iter().sum()
}

/// The mean of all but the largest thousandth.
fn trimmed_mean(mut values: Vec<f64>) -> f64 {
    let kept = values.len() - values.len() / TRIMMED_SHARE;
    if kept < values.len() {
        values.select_nth_unstable_by(kept, f64::total_cmp);
        values.truncate(kept);
    }
    values.iter().sum::<f64>() / kept as f64
}

#[cfg(feature = "flip")]
fn flip(test: &Image, reference: &Image, exposure_ev: f32) -> (Option<f32>, Option<Image>) {
    use crate::view::{View, decode_srgb};

    let seen = |image: &Image| {
        let shown = image.pixels.iter().flat_map(|&colour| View::Srgb.to_display(colour, exposure_ev));
        let bytes: Vec<u8> = shown.map(|value| (value * 255.0 + 0.5) as u8).collect();
        nv_flip::FlipImageRgb8::with_data(image.width, image.height, &bytes)
    };
    let errors = nv_flip::flip(seen(reference), seen(test), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    let values = errors.to_vec();
    let mean = values.iter().map(|&error| f64::from(error)).sum::<f64>() / values.len() as f64;
    let coloured = errors.apply_color_lut(&nv_flip::magma_lut()).to_vec();
    let light = |byte: u8| decode_srgb(f32::from(byte) / 255.0);
    let map = Image {
        width: test.width,
        height: test.height,
        pixels: coloured.chunks_exact(3).map(|rgb| Rgb([light(rgb[0]), light(rgb[1]), light(rgb[2])])).collect(),
        alpha: None,
    };
    (Some(mean as f32), Some(map))
}

#[cfg(not(feature = "flip"))]
fn flip(_: &Image, _: &Image, _: f32) -> (Option<f32>, Option<Image>) {
    (None, None)
}

#[cfg(test)]
mod tests {
    use math::hash;

    use super::*;

    fn noise(width: u32, height: u32) -> Image {
        let pixels = (0..width * height).map(|i| Rgb::new(hash::unit(i, 1), hash::unit(i, 2), hash::unit(i, 3)));
        Image::new(width, height, pixels.collect(), None).unwrap()
    }

    fn plain(width: u32, height: u32, colour: Rgb) -> Image {
        Image::new(width, height, vec![colour; (width * height) as usize], None).unwrap()
    }

    #[test]
    fn an_image_equals_itself() {
        let image = noise(24, 16);
        let same = Comparison::of(&image, &image).unwrap();
        assert_eq!((same.mse, same.relmse, same.relmse_trimmed, same.max_abs), (0.0, 0.0, 0.0, 0.0));
        assert_eq!(same.psnr, f64::INFINITY);
        assert_eq!(same.mean_ratio, Rgb::splat(1.0));
        assert_eq!(same.flip.is_some(), cfg!(feature = "flip"));
        assert_eq!(same.flip.unwrap_or(0.0), 0.0);
        assert_eq!(difference_image(&image, &image, 10.0).unwrap(), plain(24, 16, Rgb::black()));
    }

    #[test]
    fn a_known_offset_has_known_errors() {
        let reference = plain(8, 8, Rgb::new(0.5, 0.25, 0.0));
        let test = plain(8, 8, Rgb::new(0.75, 0.25, 0.0));
        let found = Comparison::of(&test, &reference).unwrap();
        // All values are powers of two: only the last sums and divisions round.
        assert!((found.mse - 0.0625 / 3.0).abs() < 1e-15);
        assert!((found.relmse - 0.0625 / (0.25 + 1e-4) / 3.0).abs() < 1e-14);
        assert_eq!(found.max_abs, 0.25);
        assert!((found.psnr - 10.0 * (48.0_f64).log10()).abs() < 1e-9);
        assert_eq!(found.mean_ratio, Rgb::new(1.5, 1.0, 1.0), "nothing over nothing is 1");
        assert_eq!(difference_image(&test, &reference, 4.0).unwrap().at(3, 3), Rgb::new(1.0, 0.0, 0.0));
    }

    #[test]
    fn trimming_drops_the_worst_thousandth() {
        let reference = plain(50, 40, Rgb::splat(0.5));
        let mut test = reference.clone();
        test.pixels[17] = Rgb::splat(1000.0);
        test.pixels[1999] = Rgb::splat(500.0);
        let found = Comparison::numbers(&test, &reference).unwrap();
        assert!(found.relmse > 1000.0);
        assert_eq!(found.relmse_trimmed, 0.0, "two of two thousand");
        test.pixels[3] = Rgb::splat(0.75);
        assert!(Comparison::numbers(&test, &reference).unwrap().relmse_trimmed > 0.0, "the third counts");
    }

    #[test]
    fn sizes_and_values_are_checked() {
        let (a, b) = (noise(4, 3), noise(3, 4));
        let error = Comparison::of(&a, &b).unwrap_err();
        assert_eq!(error.to_string(), "the test image has 4x3 pixels and the reference 3x4");
        assert!(difference_image(&a, &b, 1.0).is_err());
        let mut broken = a.clone();
        broken.pixels[6] = Rgb::new(0.0, f32::NAN, 0.0);
        let error = Comparison::of(&a, &broken).unwrap_err();
        assert_eq!(error, CompareError::NotFinite { which: "reference", x: 2, y: 1 });
    }

    #[cfg(feature = "flip")]
    #[test]
    fn flip_sees_what_a_viewer_sees() {
        let reference = plain(32, 24, Rgb::splat(0.18));
        let flip = |test: &Image, ev: f32| Comparison::at_exposure(test, &reference, ev).unwrap();
        let slight = flip(&plain(32, 24, Rgb::splat(0.2)), 0.0).flip.unwrap();
        let strong = flip(&plain(32, 24, Rgb::new(0.9, 0.1, 0.1)), 0.0);
        let strong_mean = strong.flip.unwrap();
        assert!(0.0 < slight && slight < strong_mean && strong_mean <= 1.0, "{slight} {strong_mean}");
        // Both clip to white eight stops up, and nobody sees a difference.
        assert_eq!(flip(&plain(32, 24, Rgb::splat(0.2)), 8.0).flip, Some(0.0));
        let map = strong.flip_map.unwrap();
        assert_eq!((map.width, map.height, map.pixels.len()), (32, 24, 32 * 24));
        assert!(map.at(16, 12).luminance() > 0.01, "a strong error is bright in the map");
    }
}
