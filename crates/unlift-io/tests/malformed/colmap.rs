//! Malformed COLMAP models: every record truncated, every count and number falsified.

use super::{MANY, Row, alone, appended, fixture, patched, row};

/// The model without rigs and frames.
pub const MODEL: &str = "project/sparse/0";

fn model_file(name: &str) -> Vec<u8> {
    fixture(&format!("{MODEL}/{name}"))
}

fn cut(name: &str, n: usize) -> Vec<u8> {
    model_file(name)[..n].to_vec()
}

fn in_model(what: &'static str, name: &'static str, bytes: Vec<u8>, line: &'static str) -> Row {
    let mut files: Vec<_> = ["cameras.bin", "images.bin", "points3D.bin"]
        .into_iter()
        .map(|name| (name, model_file(name)))
        .collect();
    files.iter_mut().find(|f| f.0 == name).unwrap().1 = bytes;
    row(what, files, "", line)
}

/// Offsets in the files of the model: a count of 8 bytes, then records.
mod at {
    /// In `points3D.bin`: id, coordinates, color, error, number of observations.
    pub const POINT: usize = 8;
    pub const N_TRACK: usize = POINT + 8 + 24 + 3 + 8;
    /// In `images.bin`: id, rotation, translation, camera, name.
    pub const IMAGE: usize = 8;
    pub const NAME: usize = IMAGE + 4 + 32 + 24 + 4;
    /// In `cameras.bin`: id, model, width, height, parameters.
    pub const CAMERA_MODEL: usize = 8 + 4;
    pub const PARAMS: usize = CAMERA_MODEL + 4 + 8 + 8;
}

#[rustfmt::skip] // One row per line.
pub fn binary() -> Vec<Row> {
    let points = || model_file("points3D.bin");
    let images = || model_file("images.bin");
    let point_rows = [
        ("empty", cut("points3D.bin", 0),
            "points3D.bin: header (byte 0): expected 8 bytes of the number of points, found end of file"),
        ("cut in the count", cut("points3D.bin", 5),
            "points3D.bin: header (byte 0): expected 8 bytes of the number of points, found 5 bytes before the end of the file"),
        ("count of 10^18", patched(points(), 0, &MANY),
            "points3D.bin: header (byte 0): expected at most 8 for the number of points (426 bytes are left), found 1000000000000000000"),
        ("track of 10^18", patched(points(), at::N_TRACK, &MANY),
            "points3D.bin: record 1 (byte 51): expected at most 46 for the number of observations (375 bytes are left), found 1000000000000000000"),
        ("trailing byte", appended(points(), b"x"),
            "points3D.bin: end (byte 434): expected end of file, found 1 more byte"),
        ("repeated id", patched(points(), at::POINT, &[3]),
            "points3D.bin: point 3: expected each id once, found it again"),
        ("text where binary is expected", b"# 3D point list\n1 0 0 0 0 0 0 0\n".to_vec(),
            "points3D.bin: header (byte 0): expected binary data (the number of points), found text"),
        ("no points", vec![0; 8], "points3D.bin: expected at least one point, found none"),
    ];
    let image_rows = [
        ("empty", cut("images.bin", 0),
            "images.bin: header (byte 0): expected 8 bytes of the number of images, found end of file"),
        ("count of 10^18", patched(images(), 0, &MANY),
            "images.bin: header (byte 0): expected at most 11 for the number of images (822 bytes are left), found 1000000000000000000"),
        ("name without end", { let name_to_end = vec![b'a'; images().len() - at::NAME]; patched(images(), at::NAME, &name_to_end) },
            "images.bin: record 1 (byte 72): expected a zero byte at the end of the image name, found end of file"),
        ("repeated id", patched(images(), at::IMAGE, &[2]),
            "images.bin: image 2: expected each id once, found it again"),
    ];
    let all = [
        ("points3D.bin", point_rows.to_vec()),
        ("images.bin", image_rows.to_vec()),
    ];
    all.into_iter()
        .flat_map(|(name, rows)| {
            rows.into_iter()
                .map(move |(what, bytes, line)| in_model(what, name, bytes, line))
        })
        .collect()
}

#[rustfmt::skip] // One row per line.
pub fn text() -> Vec<Row> {
    let points = |what, text: &str, line| alone(what, "points3D.txt", text, line);
    let model = |what, name, text: &str, line| {
        let files = vec![
            (name, text.as_bytes().to_vec()),
            ("points3D.txt", b"1 0 0 0 0 0 0 0".to_vec()),
        ];
        row(what, files, "", line)
    };
    let long = format!("1 0 0 {} 0 0 0 0", "9a".repeat(60));
    vec![
        points("empty text", "", "points3D.txt: expected at least one point, found none"),
        points("two coordinates", "# c\n1 2 3\n",
            "points3D.txt:2: expected 3 coordinates, found end of line"),
        points("not a number", "1 2 3 abc 0 0 0 0\n",
            "points3D.txt:1: expected 3 coordinates, found \"abc\""),
        points("long word", &long,
            "points3D.txt:1: expected 3 coordinates, found \"9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a...\""),
        points("NaN", "7 NaN 0 0 0 0 0 0
", "points3D.txt: expected a point with a place, found 1 without one"),
        points("no error", "7 0 0 0 0 0 0\n",
            "points3D.txt:1: expected a reprojection error, found end of line"),
        points("half an observation", "7 0 0 0 0 0 0 0 1 2 3\n",
            "points3D.txt:1: expected observations of 2 numbers (image id, 2D point), found 3 numbers"),
        points("binary where text is expected", "\u{6}\0\0\0\0\0\0\0\u{2}\0\0\n",
            "points3D.txt:1: expected text, found binary data"),
        model("pose cut", "images.txt", "1 1 0 0 0 1 2\n\n",
            "images.txt:1: expected a translation (3 numbers), found end of line"),
        model("2D points cut", "images.txt", "1 1 0 0 0 1 2 3 1 a.jpg\n1 2 3 4\n",
            "images.txt:2: expected 2D points of 3 numbers (x, y, point id), found 4 numbers"),
    ]
}

/// Errors in cameras are notes, because points do not need cameras.
#[rustfmt::skip] // One row per line.
pub fn cameras() -> Vec<Row> {
    let cameras = || model_file("cameras.bin");
    let camera_rows = [
        ("empty", cut("cameras.bin", 0),
            "cameras.bin: header (byte 0): expected 8 bytes of the number of cameras, found end of file"),
        ("unknown model", patched(cameras(), at::CAMERA_MODEL, &[99]),
            "cameras.bin: record 1 (byte 12): expected a camera model of COLMAP (0 to 17) for camera 1, found 99"),
        ("longer model", patched(cameras(), at::CAMERA_MODEL, &[11]),
            "cameras.bin: record 1 (byte 64): expected 8 bytes of a parameter, found end of file"),
        ("count of 10^18", patched(cameras(), 0, &MANY),
            "cameras.bin: header (byte 0): expected at most 1 for the number of cameras (56 bytes are left), found 1000000000000000000"),
        ("parameters cut", cameras()[..at::PARAMS + 4 * 8 - 1].to_vec(),
            "cameras.bin: record 1 (byte 56): expected 8 bytes of a parameter, found 7 bytes before the end of the file"),
    ];
    let text = |what, text: &str, line| {
        let files = vec![
            ("cameras.txt", text.as_bytes().to_vec()),
            ("points3D.txt", b"1 0 0 0 0 0 0 0".to_vec()),
        ];
        row(what, files, "", line)
    };
    let texts = vec![
        text("unknown camera model", "1 WIDE 640 480 1 2 3\n",
            "cameras.txt:1: expected a camera model of COLMAP for camera 1, found \"WIDE\""),
        text("parameter missing", "1 PINHOLE 640 480 1 2 3\n",
            "cameras.txt:1: expected 4 parameters of PINHOLE, found 3"),
    ];
    let binary = camera_rows.into_iter().map(|(what, bytes, line)| in_model(what, "cameras.bin", bytes, line));
    binary.chain(texts).collect()
}
