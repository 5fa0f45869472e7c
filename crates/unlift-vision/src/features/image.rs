use image::{ImageBuffer, Luma};
use unlift::Error;

use crate::features::fit::fitted;

/// A gray image.
///
/// `pixels` is `(height, width)`, row-major; 0 is black, 1 is white. Thresholds of the extractor
/// use this scale.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayImage {
    width: usize,
    height: usize,
    pixels: Vec<f32>,
}

impl GrayImage {
    /// Creates an image of `width` x `height` pixels from its rows.
    ///
    /// # Errors
    /// If a side is zero, the length of `pixels` is not `width * height`, or a value is not finite.
    pub fn try_new(width: usize, height: usize, pixels: Vec<f32>) -> Result<Self, Error> {
        if width == 0 || height == 0 {
            let found = format!("{width} x {height}");
            return Err(Error::new("image", "at least one pixel", found));
        }
        if width.checked_mul(height) != Some(pixels.len()) {
            let expected = format!("{width} x {height} pixels");
            return Err(Error::new("image", expected, format!("{} pixels", pixels.len())));
        }
        if let Some(at) = pixels.iter().position(|value| !value.is_finite()) {
            let what = format!("image: pixel ({}, {})", at % width, at / width);
            return Err(Error::new(what, "a finite value", pixels[at].to_string()));
        }
        Ok(Self { width, height, pixels })
    }

    /// Creates an image from bytes: 0 is black, 255 is white.
    ///
    /// # Errors
    /// See [`try_new`](Self::try_new).
    pub fn from_bytes(width: usize, height: usize, bytes: &[u8]) -> Result<Self, Error> {
        let pixels = bytes.iter().map(|&byte| f32::from(byte) / 255.0).collect();
        Self::try_new(width, height, pixels)
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns row `y`, of `width` pixels.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.pixels[y * self.width..(y + 1) * self.width]
    }

    /// Downsizes the image so that no side exceeds `most` pixels; `None` if it is small enough.
    pub(crate) fn fitted(&self, most: usize) -> Option<Self> {
        let pixels = ImageBuffer::<Luma<f32>, &[f32]>::from_raw(
            self.width as u32,
            self.height as u32,
            &self.pixels,
        )?;
        let small = fitted(&pixels, most)?;
        let (width, height) = (small.width() as usize, small.height() as usize);
        Some(Self { width, height, pixels: small.into_raw() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_states_what_is_wrong_with_it() {
        let text = |result: Result<GrayImage, Error>| result.map_err(|error| error.to_string());
        assert_eq!(
            text(GrayImage::try_new(0, 4, vec![])).unwrap_err(),
            "image: expected at least one pixel, found 0 x 4"
        );
        assert_eq!(
            text(GrayImage::from_bytes(2, 2, &[1, 2, 3])).unwrap_err(),
            "image: expected 2 x 2 pixels, found 3 pixels"
        );
        assert_eq!(
            text(GrayImage::try_new(2, 1, vec![0.0, f32::NAN])).unwrap_err(),
            "image: pixel (1, 0): expected a finite value, found NaN"
        );
    }
}
