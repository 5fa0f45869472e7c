use crate::features::ColorImage;
use unlift::Error;

use crate::pictures::sizes::check_sizes;

/// Returns `10 log10(255^2 / MSE)` in dB, with the mean over all pixels and colors; infinite for
/// equal pictures.
///
/// # Errors
/// If the pictures differ in size.
pub fn psnr(a: &ColorImage, b: &ColorImage) -> Result<f64, Error> {
    check_sizes(a, b, 1)?;
    let square = |(&a, &b): (&u8, &u8)| u64::from(a.abs_diff(b)).pow(2);
    let sum: u64 = a.pixels().iter().zip(b.pixels()).map(square).sum();
    let mean = sum as f64 / a.pixels().len() as f64;
    Ok(10.0 * libm::log10(255.0 * 255.0 / mean))
}
