//! Small encoded images for reports.

use std::io::Cursor;
use std::path::Path;

use ::image::codecs::jpeg::JpegEncoder;
use ::image::imageops::FilterType;
use ::image::{ImageError, ImageFormat, Rgb, RgbImage};
use unlift::Error;

use crate::features::color::ColorImage;
use crate::features::load::{self, Turn};

/// JPEG quality, of 100: recognizable, and small enough to embed.
const QUALITY: u8 = 72;

/// Encodes the photo at `path` as a color JPEG, downsized so that no side exceeds `longest` pixels,
/// without metadata.
///
/// # Errors
/// See [`load::read`].
pub fn jpeg(path: &Path, longest: u32, turn: Turn) -> Result<Vec<u8>, Error> {
    let photo = load::photo(path, turn)?;
    let photo = match photo.width().max(photo.height()) > longest {
        true => photo.resize(longest, longest, FilterType::Triangle),
        false => photo,
    };
    encoded(&photo.to_rgb8()).map_err(|error| {
        let name = path.display().to_string();
        Error::new(name, "a photo that can be downsized", error.to_string())
    })
}

/// Encodes an image as JPEG, downsized so that no side exceeds `longest` pixels.
///
/// # Errors
/// If a side still has more than 65,535 pixels.
pub fn jpeg_of(image: &ColorImage, longest: usize) -> Result<Vec<u8>, Error> {
    let small = image.fitted(longest);
    encoded(&buffer(small.as_ref().unwrap_or(image)))
        .map_err(|error| Error::new("picture", "at most 65535 pixels a side", error.to_string()))
}

/// Encodes an image as PNG.
///
/// # Errors
/// If encoding fails.
pub fn png_of(image: &ColorImage) -> Result<Vec<u8>, Error> {
    let mut bytes = Cursor::new(Vec::new());
    buffer(image)
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(|error| Error::new("picture", "one that fits a PNG", error.to_string()))?;
    Ok(bytes.into_inner())
}

fn buffer(image: &ColorImage) -> RgbImage {
    let (width, height) = (image.width() as u32, image.height() as u32);
    RgbImage::from_fn(width, height, |x, y| Rgb(image.pixel(x as usize, y as usize)))
}

fn encoded(image: &RgbImage) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY))?;
    Ok(bytes)
}
