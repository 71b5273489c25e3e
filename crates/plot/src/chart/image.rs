//! Pictures in figures: rendered images side by side, with labels.

use ::image::codecs::png::PngEncoder;
use ::image::{ExtendedColorType, ImageEncoder as _};

use super::{Figure, Panel, Plot};

/// Largest side, pixels.
const MAX_SIDE: u32 = 16_384;

/// An opaque picture as it is displayed: 8 bits per channel, sRGB-encoded, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

/// The bytes are not a picture of that size.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{bytes} bytes are no picture of {width} x {height} pixels (sides of 1 to 16384, three bytes a pixel)")]
pub struct PictureError {
    /// Columns asked for.
    pub width: u32,
    /// Rows asked for.
    pub height: u32,
    /// Bytes given.
    pub bytes: usize,
}

impl Picture {
    /// From red, green and blue of every pixel.
    ///
    /// # Errors
    ///
    /// A side is 0 or above 16384, or the bytes are not three for each pixel.
    pub fn new(width: u32, height: u32, rgb: Vec<u8>) -> Result<Self, PictureError> {
        let sides = 1..=MAX_SIDE;
        let pixels = u64::from(width) * u64::from(height);
        if !sides.contains(&width) || !sides.contains(&height) || rgb.len() as u64 != 3 * pixels {
            return Err(PictureError { width, height, bytes: rgb.len() });
        }
        Ok(Self { width, height, rgb })
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Red, green and blue of every pixel, rows from the top.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The picture as a PNG file.
    pub fn png(&self) -> Vec<u8> {
        let mut file = Vec::new();
        PngEncoder::new(&mut file)
            .write_image(&self.rgb, self.width, self.height, ExtendedColorType::Rgb8)
            .expect("a picture of checked size goes into memory");
        file
    }
}

/// Pictures in a grid with a label above each, at their own shapes.
pub fn strip(title: &str, pictures: Vec<(String, Picture)>, columns: usize) -> Figure {
    let columns = columns.max(1);
    let panels = pictures
        .into_iter()
        .map(|(label, picture)| Panel { title: label, ..Panel::new("", Plot::Picture(picture)) })
        .collect();
    Figure { title: title.to_owned(), columns, width: 40.0 + 260.0 * columns as f64, panels, ..Figure::default() }
}

/// RFC 4648, with padding.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = (byte(0) << 16) | (byte(1) << 8) | byte(2);
        for i in 0..4 {
            let letter = LETTERS[((word >> (18 - 6 * i)) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_follows_the_vectors_of_its_standard() {
        let vectors = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (length, want) in vectors.iter().enumerate() {
            assert_eq!(base64(&b"foobar"[..length]), *want);
        }
    }

    #[test]
    fn a_picture_survives_its_file() {
        let rgb: Vec<u8> = (0..5 * 3 * 3).map(|i| (i * 37 % 256) as u8).collect();
        let picture = Picture::new(5, 3, rgb.clone()).unwrap();
        let back = ::image::load_from_memory(&picture.png()).unwrap().into_rgb8();
        assert_eq!((back.dimensions(), back.into_raw()), ((5, 3), rgb));
    }

    #[test]
    fn bytes_that_are_no_picture_are_refused() {
        assert!(Picture::new(2, 2, vec![0; 12]).is_ok());
        for (width, height, bytes) in [(0, 2, 0), (2, 2, 11), (20_000, 1, 60_000)] {
            let error = Picture::new(width, height, vec![0; bytes]).unwrap_err();
            assert!(error.to_string().contains(&bytes.to_string()), "{error}");
        }
    }
}
