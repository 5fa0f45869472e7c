use crate::features::ColorImage;
use unlift::Error;

use crate::pictures::lpips::Lpips;
use crate::pictures::psnr::psnr;
use crate::pictures::ssim::ssim;

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
