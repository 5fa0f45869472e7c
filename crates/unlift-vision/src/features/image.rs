//! Gray and color images.

use std::ops::Deref;

use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Luma, Pixel, Rgb};
use unlift::Error;

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

/// Downsizes `image` so that no side exceeds `most` pixels; `None` if it is small enough.
///
/// Sides are rounded down, as in COLMAP; the filter is Lanczos of three lobes.
pub(crate) fn fitted<P: Pixel + 'static, C: Deref<Target = [P::Subpixel]>>(
    image: &ImageBuffer<P, C>,
    most: usize,
) -> Option<ImageBuffer<P, Vec<P::Subpixel>>>
where
    P::Subpixel: 'static,
{
    let longer = image.width().max(image.height()) as usize;
    if longer <= most {
        return None;
    }
    let scale = most as f64 / longer as f64;
    let side = |length: u32| ((f64::from(length) * scale) as u32).max(1);
    Some(resize(image, side(image.width()), side(image.height()), FilterType::Lanczos3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_pixels_are_one_line() {
        for (result, expected) in [
            (GrayImage::try_new(0, 4, vec![]).err(), "at least one pixel, found 0 x 4"),
            (GrayImage::from_bytes(2, 2, &[1; 3]).err(), "2 x 2 pixels, found 3 pixels"),
            (GrayImage::try_new(1, 1, vec![f32::NAN]).err(), "a finite value, found NaN"),
            (ColorImage::try_new(0, 4, vec![]).err(), "1 to 16777216 pixels a side, found 0 x 4"),
            (ColorImage::try_new(2, 2, vec![1; 4]).err(), "2 x 2 pixels of 3 bytes, found 4 bytes"),
        ] {
            let error = result.unwrap().to_string();
            assert!(error.ends_with(&format!(": expected {expected}")), "{error}");
        }
    }

    #[test]
    fn fitting_rounds_sides_down_and_halving_takes_means_of_four() {
        let image = ColorImage::try_new(100, 33, [10, 20, 30].repeat(3300)).unwrap();
        assert!(image.fitted(100).is_none());
        let small = image.fitted(50).unwrap();
        assert_eq!((small.width(), small.height()), (50, 16));
        assert_eq!(small.pixel(49, 15), [10, 20, 30]);
        assert_eq!(image.unshrunk(&small, [0.0, 0.0])[0], 0.5);
        assert_eq!(image.fitted(1).unwrap().height(), 1);
        let image = ColorImage::try_new(3, 2, (0..18).map(|at| 10 * at).collect()).unwrap();
        let small = image.halved().unwrap();
        assert_eq!((small.width(), small.height(), small.pixel(0, 0)), (1, 1, [60, 70, 80]));
        assert!(small.halved().is_err());
    }
}
