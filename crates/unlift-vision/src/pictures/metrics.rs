//! Similarity of a picture and its photo: SSIM, PSNR and LPIPS.

use unlift::Error;

use crate::features::ColorImage;
use crate::network::{Network, Tensor};

/// Similarity metrics of a picture and its photo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// Structural similarity, 1 for equal pictures.
    pub ssim: f64,
    /// Peak signal-to-noise ratio in dB; infinite for equal pictures.
    pub psnr: f64,
    /// Learned perceptual distance, 0 for equal pictures.
    pub lpips: f64,
}

impl Metrics {
    /// Computes all metrics of `a` and `b`; they are symmetric.
    ///
    /// # Errors
    /// If the pictures differ in size, or a side has less than 16 pixels.
    pub fn of(a: &ColorImage, b: &ColorImage, lpips: &Lpips) -> Result<Self, Error> {
        Ok(Self { ssim: ssim(a, b)?, psnr: psnr(a, b)?, lpips: lpips.distance(a, b)? })
    }
}

/// Checks that two pictures have the same size, with at least `min_side` pixels per side.
fn check_sizes(a: &ColorImage, b: &ColorImage, min_side: u32) -> Result<(), Error> {
    let size = |image: &ColorImage| format!("{} x {}", image.width(), image.height());
    if a.dimensions() != b.dimensions() {
        let expected = format!("another picture of {} pixels", size(a));
        return Err(Error::new("pictures", expected, format!("one of {}", size(b))));
    }
    if a.width().min(a.height()) < min_side {
        let expected = format!("pictures of at least {min_side} x {min_side} pixels");
        return Err(Error::new("pictures", expected, size(a)));
    }
    Ok(())
}

/// Returns the peak signal-to-noise ratio `10 log10(255^2 / MSE)` in dB, with the mean over all
/// pixels and colors; infinite for equal pictures.
fn psnr(a: &ColorImage, b: &ColorImage) -> Result<f64, Error> {
    check_sizes(a, b, 1)?;
    let square = |(&a, &b): (&u8, &u8)| u64::from(a.abs_diff(b)).pow(2);
    let sum: u64 = a.iter().zip(b.iter()).map(square).sum();
    let mean = sum as f64 / a.len() as f64;
    Ok(10.0 * libm::log10(255.0 * 255.0 / mean))
}

const WINDOW: usize = 7;
const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);

/// Sums over some pixels of one color of both pictures: of a, b, a^2, b^2 and a b.
type Sums = [u64; 5];

fn products(a: u8, b: u8) -> Sums {
    let (a, b) = (u64::from(a), u64::from(b));
    [a, b, a * a, b * b, a * b]
}

/// Adds the entering and subtracts the leaving sums.
fn moved(sums: Sums, enters: Sums, leaves: Sums) -> Sums {
    std::array::from_fn(|at| sums[at] + enters[at] - leaves[at])
}

/// Returns the structural similarity in a window with these sums.
fn similarity(sums: Sums) -> f64 {
    let n = (WINDOW * WINDOW) as f64;
    let [a, b, aa, bb, ab] = sums.map(|sum| sum as f64 / n);
    let sample = n / (n - 1.0);
    let aa = sample * (aa - a * a);
    let bb = sample * (bb - b * b);
    let ab = sample * (ab - a * b);
    ((2.0 * a * b + C1) * (2.0 * ab + C2)) / ((a * a + b * b + C1) * (aa + bb + C2))
}

/// Returns the mean structural similarity over all windows of 7 x 7 pixels and all colors.
///
/// Source: Wang et al., "Image Quality Assessment: From Error Visibility to Structural Similarity", IEEE TIP 2004, with the
/// defaults of scikit-image, which inversion papers use: uniform windows, sample covariance.
///
/// # Errors
/// If the pictures differ in size, or a side has less than 7 pixels.
fn ssim(a: &ColorImage, b: &ColorImage) -> Result<f64, Error> {
    check_sizes(a, b, WINDOW as u32)?;
    let (width, height) = (a.width() as usize, a.height() as usize);
    let stride = 3 * width;
    let (left, right) = (a.as_raw(), b.as_raw());
    let mut columns = vec![Sums::default(); stride];
    let pair = |y: usize, x: usize| products(left[y * stride + x], right[y * stride + x]);
    let mut total = 0.0;
    for y in 0..height {
        for (x, column) in columns.iter_mut().enumerate() {
            let leaves = if y < WINDOW { Sums::default() } else { pair(y - WINDOW, x) };
            *column = moved(*column, pair(y, x), leaves);
        }
        if y + 1 < WINDOW {
            continue;
        }
        for color in 0..3 {
            let mut window = Sums::default();
            for x in 0..width {
                let leaves = x.checked_sub(WINDOW).map(|x| columns[3 * x + color]);
                window = moved(window, columns[3 * x + color], leaves.unwrap_or_default());
                if x + 1 >= WINDOW {
                    total += similarity(window);
                }
            }
        }
    }
    Ok(total / (3 * (width + 1 - WINDOW) * (height + 1 - WINDOW)) as f64)
}

const MODEL: &str = "lpips-squeeze";
/// Smallest side; pooling leaves nothing of smaller pictures.
const MIN_SIDE: u32 = 16;

/// The network of the learned perceptual distance (LPIPS); threads can share it.
///
/// Source: Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric",
/// CVPR 2018: version 0.1 on SqueezeNet 1.1, as in the paper's tables.
#[derive(Debug)]
pub struct Lpips {
    network: Network,
}

impl Lpips {
    /// Loads the embedded model, or the file that replaces it.
    pub fn try_new() -> Result<Self, Error> {
        Ok(Self { network: Network::load(MODEL)? })
    }

    /// Returns the distance of two pictures: 0 for equal ones, about 0.7 for unrelated ones. Uses about a kilobyte of memory per pixel.
    ///
    /// # Errors
    /// If the pictures differ in size, or a side has less than 16 pixels.
    pub fn distance(&self, a: &ColorImage, b: &ColorImage) -> Result<f64, Error> {
        check_sizes(a, b, MIN_SIDE)?;
        let inputs = vec![("a", tensor(a)?), ("b", tensor(b)?)];
        let [distance] = self.network.run(inputs, ["distance"])?;
        Ok(f64::from(distance.values()[0]))
    }
}

/// Returns planes (1, 3, height, width) with values from 0 to 1.
fn tensor(image: &ColorImage) -> Result<Tensor, Error> {
    let plane = |color: usize| image.iter().skip(color).step_by(3);
    let values = (0..3).flat_map(plane).map(|&value| f32::from(value) / 255.0).collect();
    Tensor::try_new(&[1, 3, image.height() as usize, image.width() as usize], values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, value: impl Fn(u32) -> u8) -> ColorImage {
        ColorImage::from_raw(width, height, (0..3 * width * height).map(value).collect()).unwrap()
    }

    #[test]
    fn sliding_windows_give_what_separate_windows_give() {
        let a = picture(13, 10, |at| (at * at % 251) as u8);
        let b = picture(13, 10, |at| (at * 29 % 241) as u8);
        let mut total = 0.0;
        for (y, x, color) in (0..4 * 7 * 3).map(|at| (at / 21, at / 3 % 7, at as usize % 3)) {
            let mut window = Sums::default();
            for (dy, dx) in (0..49).map(|at| (at / 7, at % 7)) {
                let at = |image: &ColorImage| image.get_pixel(x + dx, y + dy)[color];
                window = moved(window, products(at(&a), at(&b)), Sums::default());
            }
            total += similarity(window);
        }
        assert!((ssim(&a, &b).unwrap() - total / 84.0).abs() < 1e-12);
        assert_eq!(ssim(&a, &a).unwrap(), 1.0);
    }

    #[test]
    fn pictures_that_cannot_be_compared_are_one_line() {
        let text = |a: &ColorImage, b: &ColorImage| ssim(a, b).unwrap_err().to_string();
        let a = picture(8, 8, |_| 3);
        let line = "pictures: expected another picture of 8 x 8 pixels, found one of 8 x 9";
        assert_eq!(text(&a, &picture(8, 9, |_| 3)), line);
        let small = picture(8, 6, |_| 3);
        let line = "pictures: expected pictures of at least 7 x 7 pixels, found 8 x 6";
        assert_eq!(text(&small, &small), line);
    }
}
