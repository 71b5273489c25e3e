//! The film: sums over samples, per pixel.
//!
//! - Beauty and the squares of its luminance are summed in `f64`, since the picture and its error
//!   estimate must not depend on how many samples came before; the rest is summed in `f32`.
//! - A sample that is not finite is counted and left out: one NaN would otherwise be the pixel.
//! - A pixel depends only on its own samples and their order, so pixels may be filled by any number
//!   of threads.

use std::ops::RangeInclusive;

use math::{Rgb, Vec3};

use crate::Image;

/// The strand index of a sample that hit no hair.
pub const NO_STRAND: u32 = u32::MAX;

/// The longest side of a film or an image, in pixels.
pub const MAX_SIDE: u32 = 65_536;

/// The most pixels of a film or an image: 16 384 × 8 192.
pub const MAX_PIXELS: u64 = 1 << 27;

/// What the estimate of relative noise adds to the luminance, so that black pixels do not dominate it.
const NOISE_FLOOR: f64 = 0.01;

/// Why a film or an image of some size cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SizeError {
    /// A side is zero or too long.
    #[error("{width} x {height} pixels: each side must be between 1 and {max}", max = MAX_SIDE)]
    Side {
        /// Width found, in pixels.
        width: u64,
        /// Height found, in pixels.
        height: u64,
    },

    /// Both sides are allowed, their product is not.
    #[error("{width} x {height} pixels: at most {max} pixels are allowed", max = MAX_PIXELS)]
    Area {
        /// Width found, in pixels.
        width: u64,
        /// Height found, in pixels.
        height: u64,
    },

    /// The pixel list does not have one entry per pixel.
    #[error("{found} {what} do not fill an image of {width} x {height} pixels")]
    Length {
        /// Which list: `"colours"` or `"alphas"`.
        what: &'static str,
        /// Entries found.
        found: usize,
        /// Width of the image, in pixels.
        width: u32,
        /// Height of the image, in pixels.
        height: u32,
    },

    /// The system does not give the memory.
    #[error("a film of {width} x {height} pixels needs {bytes} bytes, which are not available")]
    Memory {
        /// Width asked for, in pixels.
        width: u32,
        /// Height asked for, in pixels.
        height: u32,
        /// Bytes needed.
        bytes: u64,
    },
}

/// Refuses sizes outside `1..=MAX_SIDE` per side and `MAX_PIXELS` in all.
pub(crate) fn check_size(width: u64, height: u64) -> Result<(), SizeError> {
    let sides = 1..=u64::from(MAX_SIDE);
    if !sides.contains(&width) || !sides.contains(&height) {
        return Err(SizeError::Side { width, height });
    }
    if width * height > MAX_PIXELS {
        return Err(SizeError::Area { width, height });
    }
    Ok(())
}

/// What one sample found; the tracer fills it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Light that arrives along the ray, linear Rec.709.
    pub beauty: Rgb,
    /// Opacity, `0..=1`: 0 if the ray left the scene, 1 if it was stopped.
    pub alpha: f32,
    /// The part of `beauty` that came from a light in one bounce, or straight from it.
    pub direct: Rgb,
    /// The part of `beauty` that came in more bounces.
    pub indirect: Rgb,
    /// The part of `beauty` that left the first hit by lobe R, TT, TRT and the residual, in this order.
    pub lobes: [Rgb; 4],
    /// Distance along the ray to the first hit in scene units; infinite if there is none.
    pub depth: f32,
    /// Tangent of the strand at the first hit, root to tip; zero off hair.
    pub tangent: Vec3,
    /// Reflectance of the first hit per channel; its mean lies in `0..=1`, one sample's may lie above.
    pub albedo: Rgb,
    /// Index of the strand at the first hit; [`NO_STRAND`] off hair.
    pub strand: u32,
}

impl Default for Sample {
    /// A ray that found nothing and brought no light.
    fn default() -> Self {
        Self {
            beauty: Rgb::black(),
            alpha: 0.0,
            direct: Rgb::black(),
            indirect: Rgb::black(),
            lobes: [Rgb::black(); 4],
            depth: f32::INFINITY,
            tangent: Vec3::ZERO,
            albedo: Rgb::black(),
            strand: NO_STRAND,
        }
    }
}

impl Sample {
    /// Whether every field is a number; the depth may be infinite.
    pub fn is_finite(&self) -> bool {
        self.beauty.is_finite()
            && self.alpha.is_finite()
            && self.direct.is_finite()
            && self.indirect.is_finite()
            && self.lobes.iter().all(|lobe| lobe.is_finite())
            && self.depth > f32::NEG_INFINITY
            && self.tangent.is_finite()
            && self.albedo.is_finite()
    }
}

/// The sums of one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    beauty: Rgb<f64>,
    luminance_squared: f64,
    alpha: f32,
    direct: Rgb,
    indirect: Rgb,
    lobes: [Rgb; 4],
    depth: f32,
    tangent: Vec3,
    albedo: Rgb,
    /// Samples with a finite depth, which `depth` is the sum of.
    hits: u32,
    samples: u32,
    rejected: u32,
    strand: u32,
}

impl Default for Pixel {
    fn default() -> Self {
        Self {
            beauty: Rgb::black(),
            luminance_squared: 0.0,
            alpha: 0.0,
            direct: Rgb::black(),
            indirect: Rgb::black(),
            lobes: [Rgb::black(); 4],
            depth: 0.0,
            tangent: Vec3::ZERO,
            albedo: Rgb::black(),
            hits: 0,
            samples: 0,
            rejected: 0,
            strand: NO_STRAND,
        }
    }
}

impl Pixel {
    /// Adds one sample; call in the order of the sample indices.
    ///
    /// A sample that is not finite is left out and counted in [`rejected`](Self::rejected); the answer
    /// is then `false`.
    pub fn add(&mut self, sample: &Sample) -> bool {
        if !sample.is_finite() {
            self.rejected = self.rejected.saturating_add(1);
            return false;
        }
        let beauty = sample.beauty.cast::<f64>();
        let luminance = beauty.luminance();
        self.beauty += beauty;
        self.luminance_squared += luminance * luminance;
        self.alpha += sample.alpha;
        self.direct += sample.direct;
        self.indirect += sample.indirect;
        for (sum, lobe) in self.lobes.iter_mut().zip(sample.lobes) {
            *sum += lobe;
        }
        self.albedo += sample.albedo;
        if sample.depth.is_finite() {
            self.depth += sample.depth;
            self.hits += 1;
        }
        if sample.strand != NO_STRAND {
            self.tangent += sample.tangent;
            if self.strand == NO_STRAND {
                self.strand = sample.strand;
            }
        }
        self.samples += 1;
        true
    }

    /// Samples added.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Samples left out because they were not finite.
    pub fn rejected(&self) -> u32 {
        self.rejected
    }

    /// Mean light; black without samples.
    pub fn beauty(&self) -> Rgb {
        (self.beauty * self.inverse_count()).cast()
    }

    /// Mean opacity, `0..=1`.
    pub fn alpha(&self) -> f32 {
        self.mean(self.alpha)
    }

    /// Mean light after one bounce.
    pub fn direct(&self) -> Rgb {
        self.mean_rgb(self.direct)
    }

    /// Mean light after more bounces.
    pub fn indirect(&self) -> Rgb {
        self.mean_rgb(self.indirect)
    }

    /// Mean light by lobe of the first hit: R, TT, TRT, residual.
    pub fn lobes(&self) -> [Rgb; 4] {
        self.lobes.map(|lobe| self.mean_rgb(lobe))
    }

    /// Mean reflectance of the first hit.
    pub fn albedo(&self) -> Rgb {
        self.mean_rgb(self.albedo)
    }

    /// Mean distance in scene units over the samples that hit something; infinite if none did.
    pub fn depth(&self) -> f32 {
        if self.hits == 0 { f32::INFINITY } else { self.depth / self.hits as f32 }
    }

    /// Mean strand tangent over the samples that hit hair, unit length; zero if none did or if they
    /// cancel.
    pub fn tangent(&self) -> Vec3 {
        self.tangent.normalize_or_zero()
    }

    /// Strand that the first sample to hit hair found; [`NO_STRAND`] if none did.
    pub fn strand(&self) -> u32 {
        self.strand
    }

    /// Estimated variance of the mean luminance, from the spread of the samples; `None` below two.
    pub fn variance(&self) -> Option<f64> {
        if self.samples < 2 {
            return None;
        }
        let n = f64::from(self.samples);
        let mean = self.beauty.luminance() / n;
        // Equal samples may come out a rounding error below zero.
        let spread = (self.luminance_squared - n * mean * mean).max(0.0);
        Some(spread / ((n - 1.0) * n))
    }

    /// Whether every sum is a finite number.
    pub fn is_finite(&self) -> bool {
        self.beauty.is_finite()
            && self.luminance_squared.is_finite()
            && self.alpha.is_finite()
            && self.direct.is_finite()
            && self.indirect.is_finite()
            && self.lobes.iter().all(|lobe| lobe.is_finite())
            && self.depth.is_finite()
            && self.tangent.is_finite()
            && self.albedo.is_finite()
    }

    /// Standard error of the luminance over the luminance; infinite while it cannot be estimated.
    fn relative_error(&self) -> f64 {
        let mean = self.beauty.luminance() * self.inverse_count();
        self.variance().map_or(f64::INFINITY, |variance| variance.sqrt() / (mean.max(0.0) + NOISE_FLOOR))
    }

    fn inverse_count(&self) -> f64 {
        if self.samples == 0 { 0.0 } else { 1.0 / f64::from(self.samples) }
    }

    fn mean(&self, sum: f32) -> f32 {
        (f64::from(sum) * self.inverse_count()) as f32
    }

    fn mean_rgb(&self, sum: Rgb) -> Rgb {
        sum.map(|channel| self.mean(channel))
    }
}

/// Sums over samples, for every pixel of a picture.
///
/// Rows run from the top, pixels in a row from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    pixels: Vec<Pixel>,
}

impl Film {
    /// An empty film.
    ///
    /// # Errors
    ///
    /// Sides outside `1..=`[`MAX_SIDE`], more than [`MAX_PIXELS`] pixels, or no memory for them.
    pub fn new(width: u32, height: u32) -> Result<Self, SizeError> {
        check_size(width.into(), height.into())?;
        let out_of_memory = || SizeError::Memory { width, height, bytes: Self::bytes_for(width, height) };
        let count = usize::try_from(u64::from(width) * u64::from(height)).map_err(|_| out_of_memory())?;
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(count).map_err(|_| out_of_memory())?;
        pixels.resize(count, Pixel::default());
        Ok(Self { width, height, pixels })
    }

    /// Bytes that the pixels of a film of this size take.
    pub fn bytes_for(width: u32, height: u32) -> u64 {
        (u64::from(width) * u64::from(height)).saturating_mul(size_of::<Pixel>() as u64)
    }

    /// Bytes that the pixels of this film take.
    pub fn bytes(&self) -> u64 {
        Self::bytes_for(self.width, self.height)
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// All pixels, row by row; split it in chunks of [`width`](Self::width) to share out rows.
    pub fn pixels_mut(&mut self) -> &mut [Pixel] {
        &mut self.pixels
    }

    /// The pixel in column `x` and row `y`.
    ///
    /// # Panics
    ///
    /// Outside the film.
    pub fn pixel(&self, x: u32, y: u32) -> &Pixel {
        &self.pixels[self.index(x, y)]
    }

    /// The pixel in column `x` and row `y`, to add to.
    ///
    /// # Panics
    ///
    /// Outside the film.
    pub fn pixel_mut(&mut self, x: u32, y: u32) -> &mut Pixel {
        let index = self.index(x, y);
        &mut self.pixels[index]
    }

    /// Mean light of the pixel in column `x` and row `y`.
    ///
    /// # Panics
    ///
    /// Outside the film.
    pub fn mean_beauty(&self, x: u32, y: u32) -> Rgb {
        self.pixel(x, y).beauty()
    }

    /// How noisy the picture is: the standard error of the luminance over (luminance + 0.01), averaged
    /// over the pixels with some coverage.
    ///
    /// 0 without such pixels, infinite while one of them has fewer than two samples.
    pub fn noise(&self) -> f64 {
        let covered = self.pixels.iter().filter(|pixel| pixel.alpha > 0.0);
        let (sum, count) = covered.fold((0.0, 0_u64), |(sum, count), pixel| (sum + pixel.relative_error(), count + 1));
        if count == 0 { 0.0 } else { sum / count as f64 }
    }

    /// The fewest and the most samples of any pixel.
    pub fn sample_counts(&self) -> RangeInclusive<u32> {
        let counts = || self.pixels.iter().map(Pixel::samples);
        counts().min().unwrap_or(0)..=counts().max().unwrap_or(0)
    }

    /// Samples left out of all pixels because they were not finite.
    pub fn rejected(&self) -> u64 {
        self.pixels.iter().map(|pixel| u64::from(pixel.rejected)).sum()
    }

    /// Whether every sum of every pixel is a finite number.
    pub fn is_finite(&self) -> bool {
        self.pixels.iter().all(Pixel::is_finite)
    }

    /// The mean light and opacity of every pixel.
    pub fn image(&self) -> Image {
        Image {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(Pixel::beauty).collect(),
            alpha: Some(self.pixels.iter().map(Pixel::alpha).collect()),
        }
    }

    fn index(&self, x: u32, y: u32) -> usize {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) of a {} x {} film", self.width, self.height);
        y as usize * self.width as usize + x as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(light: f32) -> Sample {
        Sample { beauty: Rgb::splat(light), alpha: 1.0, ..Sample::default() }
    }

    #[test]
    fn sizes_are_checked() {
        for (width, height) in [(0, 4), (4, 0), (MAX_SIDE + 1, 1), (1, MAX_SIDE + 1)] {
            assert!(matches!(Film::new(width, height), Err(SizeError::Side { .. })), "{width} x {height}");
        }
        assert!(matches!(Film::new(MAX_SIDE, MAX_SIDE), Err(SizeError::Area { .. })));
        assert!(Film::new(MAX_SIDE, 1).is_ok());
        let text = SizeError::Side { width: 0, height: 7 }.to_string();
        assert_eq!(text, "0 x 7 pixels: each side must be between 1 and 65536");
    }

    #[test]
    fn noise_of_two_known_samples() {
        // Luminances 1 and 3: mean 2, variance 2, variance of the mean 1.
        let mut film = Film::new(2, 1).unwrap();
        film.pixel_mut(0, 0).add(&grey(1.0));
        assert_eq!(film.noise(), f64::INFINITY, "one sample says nothing about noise");
        film.pixel_mut(0, 0).add(&grey(3.0));
        // 1e-12: the luminance weights add up to one only to rounding.
        assert!((film.pixel(0, 0).variance().unwrap() - 1.0).abs() < 1e-12);
        assert!((film.noise() - 1.0 / 2.01).abs() < 1e-12, "the empty pixel is not covered");
        assert_eq!(film.sample_counts(), 0..=2);
    }

    #[test]
    fn equal_samples_have_no_noise() {
        let mut film = Film::new(1, 1).unwrap();
        for _ in 0..1000 {
            film.pixel_mut(0, 0).add(&grey(0.3));
        }
        // Cancellation leaves about sqrt(n · 2⁻⁵²) of the sum: 1e-8 per sample at the most.
        assert!(film.noise() < 1e-6);
        assert!(film.is_finite());
    }

    #[test]
    fn means_are_over_what_they_say() {
        let mut pixel = Pixel::default();
        let hair = Sample { depth: 2.0, tangent: Vec3::X, strand: 7, lobes: [Rgb::splat(4.0); 4], ..grey(1.0) };
        let wall = Sample { depth: 6.0, albedo: Rgb::splat(0.5), ..grey(2.0) };
        let other = Sample { tangent: Vec3::Y, strand: 3, depth: 1.0, ..hair };
        for sample in [Sample::default(), wall, hair, other] {
            assert!(pixel.add(&sample));
        }
        assert_eq!(pixel.depth(), 3.0, "the miss has no depth");
        assert_eq!(pixel.strand(), 7, "the first sample that hit hair");
        assert!((pixel.tangent() - Vec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-6);
        assert_eq!(pixel.alpha(), 0.75);
        assert_eq!(pixel.beauty(), Rgb::splat(1.0));
        assert_eq!(pixel.lobes()[2], Rgb::splat(2.0));
        assert_eq!(pixel.albedo(), Rgb::splat(0.125));
    }

    #[test]
    fn samples_that_are_not_finite_are_counted_and_left_out() {
        let bad = [
            Sample { beauty: Rgb::new(0.0, f32::NAN, 0.0), ..grey(1.0) },
            Sample { indirect: Rgb::splat(f32::INFINITY), ..grey(1.0) },
            Sample { depth: f32::NAN, ..grey(1.0) },
            Sample { tangent: Vec3::splat(f32::NAN), ..grey(1.0) },
        ];
        let mut film = Film::new(1, 1).unwrap();
        assert!(film.pixel_mut(0, 0).add(&grey(0.5)));
        let before = film.image();
        for sample in &bad {
            assert!(!film.pixel_mut(0, 0).add(sample), "{sample:?}");
        }
        assert_eq!(film.rejected(), 4);
        assert_eq!(film.pixel(0, 0).samples(), 1);
        assert_eq!(film.image(), before);
        assert!(film.is_finite());
    }

    #[test]
    fn an_empty_pixel_is_black_far_and_hairless() {
        let pixel = Pixel::default();
        assert_eq!(pixel.beauty(), Rgb::black());
        assert_eq!(pixel.depth(), f32::INFINITY);
        assert_eq!(pixel.strand(), NO_STRAND);
        assert_eq!(pixel.variance(), None);
        assert_eq!(pixel.tangent(), Vec3::ZERO);
    }
}
