//! Gray and color images.

use std::ops::Deref;

use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Luma, Pixel, Rgb};
use unlift::Error;

/// A color image: `(height, width, 3)`, row-major; red, green and blue as bytes.
pub use image::RgbImage as ColorImage;

/// A gray image.
///
/// `pixels` is `(height, width)`, row-major; 0 is black, 1 is white.
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
            return Err(Error::new("image", "at least one pixel", format!("{width} x {height}")));
        }
        if width.checked_mul(height) != Some(pixels.len()) {
            let expected = format!("{width} x {height} pixels");
            return Err(Error::new("image", expected, format!("{} pixels", pixels.len())));
        }
        if let Some(at) = pixels.iter().position(|value| !value.is_finite()) {
            let what = format!("image: pixel ({}, {})", at % width, at / width);
            return Err(Error::new(what, "a finite value", pixels[at]));
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

    /// Downsizes the image as [`fitted`] does.
    pub(crate) fn fitted(&self, max_side: usize) -> Option<Self> {
        let (width, height) = (self.width as u32, self.height as u32);
        let pixels = ImageBuffer::<Luma<f32>, _>::from_raw(width, height, &self.pixels[..])?;
        let small = fitted(&pixels, max_side)?;
        let (width, height) = (small.width() as usize, small.height() as usize);
        Some(Self { width, height, pixels: small.into_raw() })
    }
}

/// Downsizes `image` so that no side exceeds `max_side` pixels; `None` if it is small enough.
///
/// Sides are rounded down, as in COLMAP; the filter is Lanczos of three lobes.
pub(crate) fn fitted<P: Pixel + 'static, C: Deref<Target = [P::Subpixel]>>(
    image: &ImageBuffer<P, C>,
    max_side: usize,
) -> Option<ImageBuffer<P, Vec<P::Subpixel>>>
where
    P::Subpixel: 'static,
{
    let longer = image.width().max(image.height()) as usize;
    if longer <= max_side {
        return None;
    }
    let scale = max_side as f64 / longer as f64;
    let side = |length: u32| ((f64::from(length) * scale) as u32).max(1);
    Some(resize(image, side(image.width()), side(image.height()), FilterType::Lanczos3))
}

/// Converts a position in `small`, which is `image` downsized, to pixels of `image`.
pub(crate) fn unshrunk(image: &ColorImage, small: &ColorImage, [x, y]: [f32; 2]) -> [f32; 2] {
    let full = |at: f32, large: u32, small: u32| match large == small {
        true => at,
        false => ((f64::from(at) + 0.5) * (f64::from(large) / f64::from(small)) - 0.5) as f32,
    };
    [full(x, image.width(), small.width()), full(y, image.height(), small.height())]
}

/// Halves an image: every pixel is the mean of four. An odd last row or column is omitted.
///
/// # Errors
/// If a side has less than two pixels.
pub fn halved(image: &ColorImage) -> Result<ColorImage, Error> {
    let (width, height) = (image.width() / 2, image.height() / 2);
    check_sides(width, height)?;
    Ok(ColorImage::from_fn(width, height, |x, y| {
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let corners = corners.map(|(dx, dy)| image.get_pixel(2 * x + dx, 2 * y + dy).0);
        let mean = |color: usize| {
            let sum: u32 = corners.iter().map(|corner| u32::from(corner[color])).sum();
            ((sum + 2) / 4) as u8
        };
        Rgb([0, 1, 2].map(mean))
    }))
}

/// Rejects color images without pixels, and with sides above 2^24.
pub(crate) fn check_sides(width: u32, height: u32) -> Result<(), Error> {
    let sides = 1..=1 << 24;
    if sides.contains(&width) && sides.contains(&height) {
        return Ok(());
    }
    Err(Error::new("image", "1 to 16777216 pixels a side", format!("{width} x {height}")))
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
            (check_sides(0, 4).err(), "1 to 16777216 pixels a side, found 0 x 4"),
        ] {
            let error = result.unwrap().to_string();
            assert!(error.ends_with(&format!(": expected {expected}")), "{error}");
        }
    }

    #[test]
    fn fitting_rounds_sides_down_and_halving_takes_means_of_four() {
        let image = ColorImage::from_pixel(100, 33, Rgb([10, 20, 30]));
        assert!(fitted(&image, 100).is_none());
        let small = fitted(&image, 50).unwrap();
        assert_eq!(small.dimensions(), (50, 16));
        assert_eq!(small.get_pixel(49, 15).0, [10, 20, 30]);
        assert_eq!(unshrunk(&image, &small, [0.0, 0.0])[0], 0.5);
        assert_eq!(fitted(&image, 1).unwrap().height(), 1);
        let image = ColorImage::from_raw(3, 2, (0..18).map(|at| 10 * at).collect()).unwrap();
        let small = halved(&image).unwrap();
        assert_eq!((small.dimensions(), small.get_pixel(0, 0).0), ((1, 1), [60, 70, 80]));
        assert!(halved(&small).is_err());
    }
}
