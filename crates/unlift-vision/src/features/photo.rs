//! Photos: decoding to gray values or colors, and small encoded images for reports.

use std::io::Cursor;
use std::path::Path;

use ::image::codecs::jpeg::JpegEncoder;
use ::image::imageops::FilterType;
use ::image::metadata::Orientation;
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Rgb};
use unlift::Error;

use super::image::{ColorImage, GrayImage, check_sides, fitted};
use crate::read_regular;

/// The readable formats, for errors.
const KINDS: &str = "a JPEG, PNG or WebP image";
/// Maximum number of pixels of a photo: 16384 x 16384. A header can declare any size.
const MAX_PIXELS: u64 = 1 << 28;
/// Maximum number of pixels per byte of a JPEG: every block of 8 x 8 pixels takes a bit. A file
/// beyond it is truncated or of one color, but decoders fill in missing blocks.
const JPEG_PIXELS_PER_BYTE: u64 = 512;
/// Maximum number of pixels per byte of other formats: PNG compresses by at most 1032.
const OTHER_PIXELS_PER_BYTE: u64 = 1032;
/// Number of pixels allowed for any file size, 4096 x 4096: black frames exist.
const FREE_PIXELS: u64 = 1 << 24;
/// Bytes that a decoder may allocate besides pixels.
const BESIDE_PIXELS: u64 = 32 << 20;
/// Bytes that a decoder may allocate per pixel: four channels of 16 bits.
const PIXEL_BYTES: u64 = 8;

/// Use of a photo's EXIF orientation. Keypoints are in pixels of the turned photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Turned by the EXIF orientation.
    Upright,
    /// Not turned, as in COLMAP and hloc.
    AsStored,
}

/// Reads the photo at `path` as gray values. The format is detected from the bytes.
///
/// # Errors
/// One line with the path, if the file does not exist, is not JPEG, PNG or WebP, is truncated, or
/// has more than 2^28 pixels or more than its size allows.
pub fn read(path: &Path, turn: Turn) -> Result<GrayImage, Error> {
    gray(open(path, turn)?)
}

/// Reads the photo at `path` in colors.
pub fn read_color(path: &Path, turn: Turn) -> Result<ColorImage, Error> {
    color(open(path, turn)?)
}

/// Decodes the bytes of a photo in a file called `name`, upright, as gray values.
pub fn decode(bytes: &[u8], name: &str) -> Result<GrayImage, Error> {
    gray(decoded(bytes, name, Turn::Upright)?)
}

pub(crate) fn open(path: &Path, turn: Turn) -> Result<DynamicImage, Error> {
    let name = path.display().to_string();
    let bytes = read_regular(path).map_err(|error| Error::new(&*name, KINDS, error))?;
    decoded(&bytes, &name, turn)
}

fn decoded(bytes: &[u8], name: &str, turn: Turn) -> Result<DynamicImage, Error> {
    let wrong = |expected: &str, found: String| Error::new(name, expected, found);
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Jpeg | ImageFormat::Png | ImageFormat::WebP)) => format,
        _ => return Err(wrong(KINDS, kind(bytes))),
    };
    let whole = format!("a whole {} image", label(format));
    if format == ImageFormat::Jpeg && !has_end(bytes) {
        return Err(wrong(&whole, "one that is cut off".to_owned()));
    }
    let broken = |error: ImageError| wrong(&whole, error.to_string());
    let per_byte = match format {
        ImageFormat::Jpeg => JPEG_PIXELS_PER_BYTE,
        _ => OTHER_PIXELS_PER_BYTE,
    };
    let max_pixels = (bytes.len() as u64).saturating_mul(per_byte).clamp(FREE_PIXELS, MAX_PIXELS);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    // The size in a PNG's header limits memory: color profiles can inflate a thousand times.
    let side = |at: usize| Some(u64::from(u32::from_be_bytes(*bytes.get(at..)?.first_chunk()?)));
    let declared = match (format, side(16), side(20)) {
        (ImageFormat::Png, Some(width), Some(height)) => width.saturating_mul(height),
        _ => max_pixels,
    };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(declared.min(max_pixels) * PIXEL_BYTES + BESIDE_PIXELS);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let n_pixels = u64::from(width) * u64::from(height);
    if n_pixels > max_pixels {
        let expected = match n_pixels > MAX_PIXELS {
            true => format!("at most {MAX_PIXELS} pixels"),
            false => format!("at most {max_pixels} pixels in {} bytes", bytes.len()),
        };
        return Err(wrong(&expected, format!("{width} x {height}")));
    }
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut photo = DynamicImage::from_decoder(decoder).map_err(broken)?;
    if turn == Turn::Upright {
        photo.apply_orientation(orientation);
    }
    Ok(photo)
}

/// Converts to gray bytes as COLMAP does: weights of Rec. 709, transparency ignored.
pub(crate) fn gray(photo: DynamicImage) -> Result<GrayImage, Error> {
    let (width, height) = (photo.width() as usize, photo.height() as usize);
    if !photo.color().has_color() {
        return GrayImage::from_bytes(width, height, photo.into_luma8().as_raw());
    }
    let luma = |color: &Rgb<u8>| {
        let [red, green, blue] = color.0.map(f32::from);
        (0.2126 * red + 0.7152 * green + 0.0722 * blue).round() as u8
    };
    let bytes: Vec<u8> = photo.into_rgb8().pixels().map(luma).collect();
    GrayImage::from_bytes(width, height, &bytes)
}

/// Converts to colors as bytes, transparency ignored.
pub(crate) fn color(photo: DynamicImage) -> Result<ColorImage, Error> {
    check_sides(photo.width(), photo.height())?;
    Ok(photo.into_rgb8())
}

fn kind(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        return "an empty file".to_owned();
    }
    if let Ok(format) = image::guess_format(bytes) {
        return format!("a {} image", label(format));
    }
    let start = &bytes[..bytes.len().min(512)];
    let printable = |byte: &u8| !byte.is_ascii_control() || byte.is_ascii_whitespace();
    if start.iter().all(printable) && start.utf8_chunks().count() == 1 {
        return "text".to_owned();
    }
    let first: Vec<String> = bytes.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
    format!("a file that starts with {}", first.join(" "))
}

fn label(format: ImageFormat) -> String {
    match format {
        ImageFormat::WebP => "WebP".to_owned(),
        format => format!("{format:?}").to_uppercase(),
    }
}

/// Returns true if a JPEG has an end marker after its first scan: decoders fill gaps with gray.
fn has_end(bytes: &[u8]) -> bool {
    const SCAN: u8 = 0xda;
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(at..at + 4) {
        match marker {
            // Fill bytes may precede a marker.
            0xff => at += 1,
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
        if marker == SCAN {
            break;
        }
    }
    bytes.get(at..).is_some_and(|rest| rest.windows(2).any(|pair| pair == [0xff, 0xd9]))
}

/// JPEG quality, of 100: recognizable, and small enough to embed.
const QUALITY: u8 = 72;

/// Encodes a photo as a color JPEG without metadata, whose sides are at most `longest` pixels.
pub fn jpeg(path: &Path, longest: u32, turn: Turn) -> Result<Vec<u8>, Error> {
    let photo = open(path, turn)?;
    let photo = match photo.width().max(photo.height()) > longest {
        true => photo.resize(longest, longest, FilterType::Triangle),
        false => photo,
    };
    let wrong =
        |error| Error::new(path.display().to_string(), "a photo that can be downsized", error);
    encoded(&photo.into_rgb8()).map_err(wrong)
}

/// Encodes an image as JPEG, downsized so that no side exceeds `longest` pixels.
///
/// # Errors
/// If a side still has more than 65,535 pixels.
pub fn jpeg_of(image: &ColorImage, longest: usize) -> Result<Vec<u8>, Error> {
    encoded(fitted(image, longest).as_ref().unwrap_or(image))
        .map_err(|error| Error::new("picture", "at most 65535 pixels a side", error))
}

fn encoded(image: &ColorImage) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY))?;
    Ok(bytes)
}

/// Encodes an image as PNG.
pub fn png_of(image: &ColorImage) -> Result<Vec<u8>, Error> {
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write_to(&mut bytes, ImageFormat::Png);
    written.map_err(|error| Error::new("picture", "one that fits a PNG", error))?;
    Ok(bytes.into_inner())
}
