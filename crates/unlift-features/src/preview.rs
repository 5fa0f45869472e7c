//! Small pictures of photos, for reports.

use std::path::Path;

use ::image::codecs::jpeg::JpegEncoder;
use ::image::imageops::FilterType;
use unlift::Error;

use crate::load;

/// Quality of the JPEG, of 100: good enough to recognize, small enough to embed.
const QUALITY: u8 = 72;

/// The photo at `path`, upright and shrunk so that no side exceeds `longest` pixels, as the bytes of a
/// JPEG in color. Nothing of its metadata is kept.
///
/// # Errors
/// As [`load::read`].
pub fn jpeg(path: &Path, longest: u32) -> Result<Vec<u8>, Error> {
    let (bytes, name) = load::bytes_of(path)?;
    let photo = load::upright(&bytes, &name)?;
    let photo = match photo.width().max(photo.height()) > longest {
        true => photo.resize(longest, longest, FilterType::Triangle),
        false => photo,
    };
    let mut small = Vec::new();
    let encoded =
        photo.to_rgb8().write_with_encoder(JpegEncoder::new_with_quality(&mut small, QUALITY));
    encoded.map_err(|error| Error::new(name, "a photo that can be shrunk", error.to_string()))?;
    Ok(small)
}
