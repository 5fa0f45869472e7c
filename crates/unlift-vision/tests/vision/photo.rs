//! Photos that can be read, turned photos, and files that are not photos.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use unlift_vision::features::photo::{Turn, decode, read, read_color};

fn colors(width: u32, height: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| Rgb([(7 * x) as u8, (5 * y) as u8, (3 * x + y) as u8]))
}

fn encode(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn text(bytes: &[u8], name: &str) -> String {
    decode(bytes, name).unwrap_err().to_string()
}

#[test]
fn gray_values_are_those_of_colmap() {
    let image = DynamicImage::from(colors(31, 20));
    for format in [ImageFormat::Png, ImageFormat::WebP] {
        let gray = decode(&encode(&image, format), "photo").unwrap();
        assert_eq!((gray.width(), gray.height()), (31, 20));
        // 0.2126 * 70 + 0.7152 * 15 + 0.0722 * 33 = 27.99
        assert_eq!(gray.row(3)[10], 28.0 / 255.0);
        let clear = encode(&image.to_rgba8().into(), format);
        assert_eq!(decode(&clear, "photo").unwrap(), gray, "transparency is ignored");
    }
    let plain = encode(&image.to_luma8().into(), ImageFormat::Png);
    let luma = f32::from(image.to_luma8().get_pixel(10, 3).0[0]);
    assert_eq!(decode(&plain, "photo").unwrap().row(3)[10], luma / 255.0);
    let deep = encode(&image.to_luma16().into(), ImageFormat::Png);
    assert_eq!(decode(&deep, "photo").unwrap().width(), 31);
}

/// Encodes a JPEG whose EXIF header contains only the orientation.
fn turned(image: &DynamicImage, orientation: u8) -> Vec<u8> {
    let jpeg = encode(image, ImageFormat::Jpeg);
    let mut exif = b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    let mut bytes = jpeg[..2].to_vec();
    bytes.extend([0xff, 0xe1, 0, exif.len() as u8 + 2]);
    bytes.extend(exif);
    bytes.extend(&jpeg[2..]);
    bytes
}

#[test]
fn photos_are_turned_upright() {
    let image = DynamicImage::from(colors(24, 16));
    let plain = decode(&encode(&image, ImageFormat::Jpeg), "photo").unwrap();
    let same = decode(&turned(&image, 1), "photo").unwrap();
    assert_eq!(same, plain);
    // Orientation 6 turns the photo right: (x, y) moves to (height - 1 - y, x).
    let right = decode(&turned(&image, 6), "photo").unwrap();
    assert_eq!((right.width(), right.height()), (16, 24));
    assert_eq!(right.row(20)[3], plain.row(16 - 1 - 3)[20]);
}

#[test]
fn a_file_that_is_no_photo_gives_one_line() {
    let expected = "expected a JPEG, PNG or WebP image, found";
    assert_eq!(text(b"", "a.jpg"), format!("a.jpg: {expected} an empty file"));
    assert_eq!(text(b"Dear Sir,\n", "a.jpg"), format!("a.jpg: {expected} text"));
    assert_eq!(text(b"GIF89a\x01\0\x01\0", "a.jpg"), format!("a.jpg: {expected} a GIF image"));
    let line = format!("a.jpg: {expected} a file that starts with 00 01 02 ff");
    assert_eq!(text(&[0, 1, 2, 0xff, 4], "a.jpg"), line);
    assert_eq!(text(b"x", "a\nb.jpg"), format!("a\\nb.jpg: {expected} text"));
}

#[test]
fn a_truncated_photo_gives_one_line() {
    let image = DynamicImage::from(colors(200, 150));
    let jpeg = encode(&image, ImageFormat::Jpeg);
    for end in [3, 30, jpeg.len() / 3, jpeg.len() - 2] {
        let line = "a.jpg: expected a whole JPEG image, found one that is cut off";
        assert_eq!(text(&jpeg[..end], "a.jpg"), line);
    }
    // The end marker of a thumbnail in the header does not count.
    let mut thumbnail = jpeg[..2].to_vec();
    thumbnail.extend([0xff, 0xe1, 0, 6, 1, 1, 0xff, 0xd9]);
    thumbnail.extend(&jpeg[2..]);
    assert!(decode(&thumbnail, "a.jpg").is_ok());
    assert!(text(&thumbnail[..jpeg.len() / 2], "a.jpg").contains("cut off"));
    // Some cameras append data.
    let appended = [&jpeg[..], b"maker notes"].concat();
    assert!(decode(&appended, "a.jpg").is_ok());
    for format in [ImageFormat::Png, ImageFormat::WebP] {
        let whole = encode(&image, format);
        for end in [whole.len() / 10, whole.len() / 2] {
            let line = text(&whole[..end], "a");
            assert!(line.starts_with("a: expected a whole "), "{line}");
            assert_eq!(line.lines().count(), 1, "{line}");
        }
    }
}

#[test]
fn a_header_with_too_many_pixels_is_refused_before_memory_is_allocated() {
    let mut png = encode(&DynamicImage::from(colors(8, 8)), ImageFormat::Png);
    // Width and height of the header, and its checksum (Python's `zlib.crc32`).
    png[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    png[29..33].copy_from_slice(&0xe3e6_a7b4_u32.to_be_bytes());
    let line = "a.png: expected at most 268435456 pixels, found 65536 x 65536";
    assert_eq!(text(&png, "a.png"), line);
}

/// Decoders fill in what a JPEG lacks: 2^28 gray pixels from 700 bytes, for seconds.
#[test]
fn a_header_with_more_pixels_than_its_bytes_can_hold_is_refused() {
    let mut jpeg = encode(&DynamicImage::from(colors(8, 8)), ImageFormat::Jpeg);
    let frame = jpeg.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0x40, 0, 0x40, 0]);
    let expected =
        format!("a: expected at most 16777216 pixels in {} bytes, found 16384 x 16384", jpeg.len());
    assert_eq!(text(&jpeg, "a"), expected);
    // A single color is allowed up to the size of cameras, in every format.
    for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP] {
        let black = encode(&DynamicImage::new_luma8(2048, 1024).into_rgb8().into(), format);
        assert_eq!(decode(&black, "black").unwrap().width(), 2048);
    }
}

#[test]
fn files_are_read_by_content_and_missing_ones_named() {
    let read = |path: &Path| read(path, Turn::Upright);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("really a png.jpg");
    std::fs::write(&path, encode(&DynamicImage::from(colors(8, 8)), ImageFormat::Png)).unwrap();
    assert_eq!(read(&path).unwrap().width(), 8);
    assert_eq!(read_color(&path, Turn::Upright).unwrap(), colors(8, 8));
    let error = read(Path::new("nowhere/photo.jpg")).unwrap_err().to_string();
    assert!(error.starts_with("nowhere/photo.jpg: expected a JPEG, PNG or WebP image, found "));
    assert!(read(folder.path()).is_err());
    if cfg!(unix) {
        let error = read(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(error.ends_with("found a pipe, a socket or a device"), "{error}");
    }
}
