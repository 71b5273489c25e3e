//! Pictures for pages: developed, put side by side, and small enough for a repository.

use film::{Image, View, decode_srgb, encode_srgb};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};
use math::Rgb;

use crate::{Error, Picture};

/// The largest file that a page should bring, bytes.
pub const LARGEST: usize = 400_000;

/// Paper.
const WHITE: [u8; 3] = [255; 3];

/// A picture as a display shows it: sRGB, 8 bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    /// Pixels per row, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
    /// Rows from the top, red, green, blue.
    pub pixels: Vec<[u8; 3]>,
}

fn quantised(encoded: f32) -> u8 {
    (encoded.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

impl Raster {
    /// One colour all over.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// An image developed by `view` after `exposure_ev` stops.
    pub fn of(image: &Image, view: View, exposure_ev: f32) -> Self {
        let pixels = image.pixels.iter().map(|&c| view.to_display(c, exposure_ev).map(quantised)).collect();
        Self { width: image.width as usize, height: image.height as usize, pixels }
    }

    /// Linear light developed by the sRGB curve alone; `pixels` are rows from the top.
    pub fn of_light(width: usize, height: usize, mut light: impl FnMut(usize, usize) -> Rgb) -> Self {
        let mut out = Self::filled(width, height, [0; 3]);
        for y in 0..out.height {
            for x in 0..out.width {
                out.pixels[y * width + x] = View::Srgb.to_display(light(x, y), 0.0).map(quantised);
            }
        }
        out
    }

    /// Pictures in rows of `columns`, with white between them. Cells are as large as the largest picture.
    pub fn sheet(pictures: &[Self], columns: usize, gap: usize) -> Self {
        let columns = columns.clamp(1, pictures.len().max(1));
        let rows = pictures.len().div_ceil(columns).max(1);
        let (w, h) = pictures.iter().fold((1, 1), |(w, h), p| (w.max(p.width), h.max(p.height)));
        let mut out = Self::filled(columns * (w + gap) - gap, rows * (h + gap) - gap, WHITE);
        for (i, picture) in pictures.iter().enumerate() {
            let (left, top) = (i % columns * (w + gap), i / columns * (h + gap));
            for (y, row) in picture.pixels.chunks_exact(picture.width).enumerate() {
                let start = (top + y) * out.width + left;
                out.pixels[start..start + picture.width].copy_from_slice(row);
            }
        }
        out
    }

    /// A smaller copy: every pixel is the mean light of what it covers. Larger sizes give the same picture.
    pub fn shrunk(&self, width: usize, height: usize) -> Self {
        let (width, height) = (width.clamp(1, self.width), height.clamp(1, self.height));
        if (width, height) == (self.width, self.height) {
            return self.clone();
        }
        // Columns first, then rows: the box filter is a product.
        let light: Vec<[f32; 3]> =
            self.pixels.iter().map(|p| p.map(|level| decode_srgb(f32::from(level) / 255.0))).collect();
        let narrow: Vec<[f32; 3]> =
            light.chunks_exact(self.width).flat_map(|row| (0..width).map(move |x| covered(row, x, width))).collect();
        let mut out = Self::filled(width, height, [0; 3]);
        for x in 0..width {
            let column: Vec<[f32; 3]> = narrow.iter().skip(x).step_by(width).copied().collect();
            for y in 0..height {
                out.pixels[y * width + x] = covered(&column, y, height).map(|light| quantised(encode_srgb(light)));
            }
        }
        out
    }

    /// The file.
    ///
    /// # Errors
    /// When the encoder fails.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
            .write_image(self.pixels.as_flattened(), self.width as u32, self.height as u32, ExtendedColorType::Rgb8)
            .map_err(|error| Error::Picture(error.to_string()))?;
        Ok(bytes)
    }

    /// The picture of a page, made smaller until its file is.
    ///
    /// # Errors
    /// When the encoder fails.
    pub fn picture(&self, stem: &'static str, caption: impl Into<String>) -> Result<Picture, Error> {
        let mut raster = self.clone();
        let mut png = raster.png()?;
        while png.len() > LARGEST && raster.width.min(raster.height) > 64 {
            // From the original, so that rounding does not add up; a little below what the size asks for.
            let factor = (LARGEST as f64 / png.len() as f64).sqrt().clamp(0.5, 0.97) * raster.width as f64;
            let factor = factor / self.width as f64;
            let side = |full: usize| ((full as f64 * factor) as usize).max(1);
            raster = self.shrunk(side(self.width), side(self.height));
            png = raster.png()?;
        }
        let mut caption = caption.into();
        if raster.width < self.width {
            let share = 100.0 * raster.width as f64 / self.width as f64;
            caption.push_str(&format!(" Shown at {share:.0} % of its size."));
        }
        Ok(Picture { stem, caption, png })
    }
}

/// Mean of the `i`-th of `n` equal parts of a line; its ends count in part.
fn covered(line: &[[f32; 3]], i: usize, n: usize) -> [f32; 3] {
    let scale = line.len() as f32 / n as f32;
    let (from, to) = (i as f32 * scale, (i + 1) as f32 * scale);
    let mut sum = [0.0; 3];
    let mut weight = 0.0;
    for (j, pixel) in line.iter().enumerate().take(to.ceil() as usize).skip(from as usize) {
        let share = ((j + 1) as f32).min(to) - (j as f32).max(from);
        if share > 0.0 {
            weight += share;
            for (sum, light) in sum.iter_mut().zip(pixel) {
                *sum += share * light;
            }
        }
    }
    sum.map(|sum| sum / weight.max(f32::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinking_keeps_the_mean_light() {
        // Half black, half white is display level 188, not 128.
        let mut fine = Raster::filled(10, 6, [0; 3]);
        for (i, pixel) in fine.pixels.iter_mut().enumerate() {
            *pixel = if (i % 10 + i / 10) % 2 == 0 { [255; 3] } else { [0; 3] };
        }
        let coarse = fine.shrunk(5, 3);
        assert!(coarse.pixels.iter().all(|p| *p == [188; 3]), "{coarse:?}");
        // Parts that are no whole number of pixels: a level picture stays level.
        let level = Raster::filled(17, 11, [90, 20, 200]).shrunk(7, 5);
        assert!(level.pixels.iter().all(|p| *p == [90, 20, 200]), "{level:?}");
        assert_eq!(fine.shrunk(99, 99), fine);
    }

    #[test]
    fn sheets_have_their_pictures_in_reading_order() {
        let pictures: Vec<Raster> = (0..3).map(|i| Raster::filled(4, 2, [i; 3])).collect();
        let sheet = Raster::sheet(&pictures, 2, 1);
        assert_eq!((sheet.width, sheet.height), (9, 5));
        let at = |x: usize, y: usize| sheet.pixels[y * 9 + x][0];
        assert_eq!((at(0, 0), at(5, 0), at(0, 3), at(5, 3), at(4, 0)), (0, 1, 2, 255, 255));
    }

    #[test]
    fn files_of_noise_are_made_small_enough() {
        let mut noise = Raster::filled(500, 400, [0; 3]);
        for (i, pixel) in noise.pixels.iter_mut().enumerate() {
            *pixel = [1, 2, 3].map(|s| (math::hash::unit(i as u32, s) * 256.0) as u8);
        }
        assert!(noise.png().unwrap().len() > LARGEST);
        let picture = noise.picture("noise", "").unwrap();
        assert!(picture.png.len() <= LARGEST && picture.png.len() > LARGEST / 4, "{}", picture.png.len());
    }
}
