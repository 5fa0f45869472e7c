//! Structural similarity.
//!
//! Source: Wang et al., "Image Quality Assessment: From Error Visibility to Structural Similarity",
//! IEEE TIP 2004, with the defaults of scikit-image, which inversion papers use: uniform windows,
//! sample covariance.

use crate::features::ColorImage;
use unlift::Error;

use crate::pictures::sizes::check_sizes;

const WINDOW: usize = 7;
const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);

/// Sums over some pixels of one color of both pictures.
#[derive(Clone, Copy, Default)]
struct Sums {
    a: u64,
    b: u64,
    aa: u64,
    bb: u64,
    ab: u64,
}

impl Sums {
    fn of(a: u8, b: u8) -> Self {
        let (a, b) = (u64::from(a), u64::from(b));
        Self { a, b, aa: a * a, bb: b * b, ab: a * b }
    }

    fn zip(self, other: Self, f: impl Fn(u64, u64) -> u64) -> Self {
        Self {
            a: f(self.a, other.a),
            b: f(self.b, other.b),
            aa: f(self.aa, other.aa),
            bb: f(self.bb, other.bb),
            ab: f(self.ab, other.ab),
        }
    }

    /// Adds the entering and subtracts the leaving sums.
    fn moved(self, enters: Self, leaves: Self) -> Self {
        self.zip(enters, |x, y| x + y).zip(leaves, |x, y| x - y)
    }

    fn similarity(self) -> f64 {
        let n = (WINDOW * WINDOW) as f64;
        let mean = |sum: u64| sum as f64 / n;
        let (a, b) = (mean(self.a), mean(self.b));
        let sample = n / (n - 1.0);
        let aa = sample * (mean(self.aa) - a * a);
        let bb = sample * (mean(self.bb) - b * b);
        let ab = sample * (mean(self.ab) - a * b);
        ((2.0 * a * b + C1) * (2.0 * ab + C2)) / ((a * a + b * b + C1) * (aa + bb + C2))
    }
}

/// Returns the mean structural similarity over all windows of 7 x 7 pixels inside the pictures, and
/// over the colors.
///
/// # Errors
/// If the pictures differ in size, or a side has less than 7 pixels.
pub fn ssim(a: &ColorImage, b: &ColorImage) -> Result<f64, Error> {
    check_sizes(a, b, WINDOW)?;
    let (width, height) = (a.width(), a.height());
    let stride = 3 * width;
    let mut columns = vec![Sums::default(); stride];
    let pair =
        |y: usize, x: usize| Sums::of(a.pixels()[y * stride + x], b.pixels()[y * stride + x]);
    let mut total = 0.0;
    for y in 0..height {
        for (x, column) in columns.iter_mut().enumerate() {
            let leaves = if y < WINDOW { Sums::default() } else { pair(y - WINDOW, x) };
            *column = column.moved(pair(y, x), leaves);
        }
        if y + 1 < WINDOW {
            continue;
        }
        for color in 0..3 {
            let mut window = Sums::default();
            for x in 0..width {
                let leaves = x.checked_sub(WINDOW).map(|x| columns[3 * x + color]);
                window = window.moved(columns[3 * x + color], leaves.unwrap_or_default());
                if x + 1 >= WINDOW {
                    total += window.similarity();
                }
            }
        }
    }
    Ok(total / (3 * (width + 1 - WINDOW) * (height + 1 - WINDOW)) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, value: impl Fn(usize) -> u8) -> ColorImage {
        ColorImage::try_new(width, height, (0..3 * width * height).map(value).collect()).unwrap()
    }

    #[test]
    fn equal_pictures_are_alike_and_inverted_ones_are_not() {
        let a = picture(19, 11, |at| (at * 37 % 256) as u8);
        let inverted = picture(19, 11, |at| 255 - (at * 37 % 256) as u8);
        assert_eq!(ssim(&a, &a).unwrap(), 1.0);
        assert!(ssim(&a, &inverted).unwrap() < 0.0);
    }

    #[test]
    fn windows_that_slide_say_what_windows_summed_one_by_one_say() {
        let a = picture(13, 10, |at| (at * at % 251) as u8);
        let b = picture(13, 10, |at| (at * 29 % 241) as u8);
        let mut total = 0.0;
        for (y, x, color) in (0..4 * 7 * 3).map(|at| (at / 21, at / 3 % 7, at % 3)) {
            let mut window = Sums::default();
            for (dy, dx) in (0..49).map(|at| (at / 7, at % 7)) {
                let at = |image: &ColorImage| image.pixel(x + dx, y + dy)[color];
                window = window.moved(Sums::of(at(&a), at(&b)), Sums::default());
            }
            total += window.similarity();
        }
        assert!((ssim(&a, &b).unwrap() - total / 84.0).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_compared_is_said() {
        let text = |a: &ColorImage, b: &ColorImage| ssim(a, b).unwrap_err().to_string();
        let a = picture(8, 8, |_| 3);
        assert_eq!(
            text(&a, &picture(8, 9, |_| 3)),
            "pictures: expected another picture of 8 x 8 pixels, found one of 8 x 9"
        );
        let small = picture(8, 6, |_| 3);
        assert_eq!(
            text(&small, &small),
            "pictures: expected pictures of at least 7 x 7 pixels, found 8 x 6"
        );
    }
}
