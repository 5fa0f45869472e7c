use image::buffer::ConvertBuffer;
use image::{GrayImage as Luma, ImageBuffer, Rgb};
use unlift::Error;

use crate::features::GrayImage;
use crate::features::fit::fitted;

/// A color image.
///
/// `pixels` is `(height, width, 3)`, row-major: red, green and blue as bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorImage {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl ColorImage {
    /// Creates an image of `width` x `height` pixels from its rows.
    ///
    /// # Errors
    /// If a side is zero or above 2^24, or the length of `pixels` is not `3 * width * height`.
    pub fn try_new(width: usize, height: usize, pixels: Vec<u8>) -> Result<Self, Error> {
        let sides = 1..=1 << 24;
        if !sides.contains(&width) || !sides.contains(&height) {
            let found = format!("{width} x {height}");
            return Err(Error::new("image", "1 to 16777216 pixels a side", found));
        }
        if 3 * width * height != pixels.len() {
            let expected = format!("{width} x {height} pixels of 3 bytes");
            return Err(Error::new("image", expected, format!("{} bytes", pixels.len())));
        }
        Ok(Self { width, height, pixels })
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Returns all values, `(height, width, 3)`, row-major.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Returns red, green and blue of the pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }

    /// Converts the image to gray values, as [`read`](crate::features::load::read) does.
    ///
    /// # Errors
    /// Never: the length of the pixels was checked.
    pub fn gray(&self) -> Result<GrayImage, Error> {
        let (width, height) = (self.width as u32, self.height as u32);
        let pixels = ImageBuffer::<Rgb<u8>, &[u8]>::from_raw(width, height, &self.pixels);
        let luma: Option<Luma> = pixels.map(|pixels| pixels.convert());
        GrayImage::from_bytes(self.width, self.height, luma.unwrap_or_default().as_raw())
    }

    /// Halves the image: every pixel is the mean of four. An odd last row or column is omitted.
    ///
    /// # Errors
    /// If a side has less than two pixels.
    pub fn halved(&self) -> Result<Self, Error> {
        let (width, height) = (self.width / 2, self.height / 2);
        let mut pixels = Vec::with_capacity(3 * width * height);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (2 * y, 2 * x))) {
            let corners =
                [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| self.pixel(x, y));
            pixels.extend((0..3).map(|color| {
                let sum: u32 = corners.iter().map(|corner| u32::from(corner[color])).sum();
                ((sum + 2) / 4) as u8
            }));
        }
        Self::try_new(width, height, pixels)
    }

    /// Converts the position `place` in `small`, this image downsized, to pixels of this image.
    /// Pixel centers have integer coordinates.
    pub(crate) fn unshrunk<T: Into<f64>>(&self, small: &Self, place: [T; 2]) -> [f32; 2] {
        let scales = [(self.width, small.width), (self.height, small.height)];
        let [x, y] = place.map(Into::into);
        let full = |at: f64, (large, small): (usize, usize)| match large == small {
            true => at as f32,
            false => ((at + 0.5) * (large as f64 / small as f64) - 0.5) as f32,
        };
        [full(x, scales[0]), full(y, scales[1])]
    }

    /// Downsizes the image so that no side exceeds `most` pixels; `None` if it is small enough.
    pub(crate) fn fitted(&self, most: usize) -> Option<Self> {
        let pixels = ImageBuffer::<Rgb<u8>, &[u8]>::from_raw(
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
        let text = |result: Result<ColorImage, Error>| result.unwrap_err().to_string();
        assert_eq!(
            text(ColorImage::try_new(0, 4, vec![])),
            "image: expected 1 to 16777216 pixels a side, found 0 x 4"
        );
        assert_eq!(
            text(ColorImage::try_new(2, 2, vec![1; 4])),
            "image: expected 2 x 2 pixels of 3 bytes, found 4 bytes"
        );
    }

    #[test]
    fn fitting_rounds_sides_down_and_keeps_colors() {
        let image = ColorImage::try_new(100, 33, [10, 20, 30].repeat(3300)).unwrap();
        assert!(image.fitted(100).is_none());
        let small = image.fitted(50).unwrap();
        assert_eq!((small.width(), small.height()), (50, 16));
        assert_eq!(small.pixel(49, 15), [10, 20, 30]);
        assert_eq!(image.unshrunk(&small, [0.0, 0.0])[0], 0.5);
        assert_eq!(image.unshrunk(&image, [7.25, 3.0]), [7.25, 3.0]);
        assert_eq!(image.fitted(1).unwrap().height(), 1);
    }

    #[test]
    fn halving_takes_means_of_four() {
        let image = ColorImage::try_new(3, 2, (0..18).map(|at| 10 * at).collect()).unwrap();
        let small = image.halved().unwrap();
        assert_eq!((small.width(), small.height()), (1, 1));
        assert_eq!(small.pixel(0, 0), [60, 70, 80]);
        assert!(small.halved().is_err());
    }
}
