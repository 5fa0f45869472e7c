use std::ops::Deref;

use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Pixel};

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
