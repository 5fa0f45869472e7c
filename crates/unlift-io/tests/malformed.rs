//! Malformed files: the exact line each is refused with, and no panic for any cut or changed byte.

use std::fs;
use std::path::{Path, PathBuf};

use unlift_io::read;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn fixture(name: &str) -> Vec<u8> {
    fs::read(fixtures().join(name)).unwrap()
}

/// The classic model, whose files the rows cut and change.
const MODEL: &str = "project/sparse/0";

fn model_file(name: &str) -> Vec<u8> {
    fixture(&format!("{MODEL}/{name}"))
}

/// The first `n` bytes of a file of the model.
fn cut(name: &str, n: usize) -> Vec<u8> {
    model_file(name)[..n].to_vec()
}

/// A file of the model with other bytes at `at`.
fn patched(mut file: Vec<u8>, at: usize, bytes: &[u8]) -> Vec<u8> {
    file[at..at + bytes.len()].copy_from_slice(bytes);
    file
}

fn appended(mut file: Vec<u8>, bytes: &[u8]) -> Vec<u8> {
    file.extend(bytes);
    file
}

/// One way to be wrong: files (or, ending in `/`, a folder), which of them is opened, and the line.
struct Row {
    what: &'static str,
    files: Vec<(&'static str, Vec<u8>)>,
    open: &'static str,
    line: &'static str,
}

fn row(
    what: &'static str,
    files: Vec<(&'static str, Vec<u8>)>,
    open: &'static str,
    line: &'static str,
) -> Row {
    Row {
        what,
        files,
        open,
        line,
    }
}

/// A single file of any kind.
fn alone(
    what: &'static str,
    name: &'static str,
    bytes: impl AsRef<[u8]>,
    line: &'static str,
) -> Row {
    row(what, vec![(name, bytes.as_ref().to_vec())], name, line)
}

/// The classic model with one file replaced.
fn in_model(what: &'static str, name: &'static str, bytes: Vec<u8>, line: &'static str) -> Row {
    let mut files: Vec<_> = ["cameras.bin", "images.bin", "points3D.bin"]
        .into_iter()
        .map(|name| (name, model_file(name)))
        .collect();
    files.iter_mut().find(|f| f.0 == name).unwrap().1 = bytes;
    row(what, files, "", line)
}

const MANY: [u8; 8] = 1_000_000_000_000_000_000_u64.to_le_bytes();

/// Offsets in the classic model: a count of 8 bytes, then records.
mod at {
    /// In `points3D.bin`: id, coordinates, color, error, number of observations, observations.
    pub const POINT: usize = 8;
    pub const X: usize = POINT + 8;
    pub const COLOR: usize = X + 24;
    pub const ERROR: usize = COLOR + 3;
    pub const N_TRACK: usize = ERROR + 8;
    pub const TRACK: usize = N_TRACK + 8;
    /// In `images.bin`: id, rotation, translation, camera, name, number of 2D points, 2D points.
    pub const IMAGE: usize = 8;
    pub const ROTATION: usize = IMAGE + 4;
    pub const TRANSLATION: usize = ROTATION + 32;
    pub const IMAGE_CAMERA: usize = TRANSLATION + 24;
    pub const NAME: usize = IMAGE_CAMERA + 4;
    pub const N_POINTS2D: usize = NAME + "küche/ä 0.jpg".len() + 1;
    /// In `cameras.bin`: id, model, width, height, parameters.
    pub const CAMERA: usize = 8;
    pub const CAMERA_MODEL: usize = CAMERA + 4;
    pub const WIDTH: usize = CAMERA_MODEL + 4;
    pub const HEIGHT: usize = WIDTH + 8;
    pub const PARAMS: usize = HEIGHT + 8;
}

fn colmap_binary() -> Vec<Row> {
    let nan = f64::NAN.to_le_bytes();
    let points = || model_file("points3D.bin");
    let images = || model_file("images.bin");
    let cameras = || model_file("cameras.bin");
    let point_rows = [
        (
            "empty",
            cut("points3D.bin", 0),
            "points3D.bin: header (byte 0): expected 8 bytes of the number of points, found end of file",
        ),
        (
            "cut in the count",
            cut("points3D.bin", 5),
            "points3D.bin: header (byte 0): expected 8 bytes of the number of points, found 5 bytes before the end of the file",
        ),
        (
            "cut after the count",
            cut("points3D.bin", at::POINT),
            "points3D.bin: header (byte 0): expected at most 0 for the number of points (0 bytes are left), found 6",
        ),
        (
            "NaN",
            patched(points(), at::X, &nan),
            "points3D.bin: record 1 (byte 16): expected finite coordinates of point 2, found [NaN, 4.649684750233829, -4.352846916476389]",
        ),
        (
            "count of 10^18",
            patched(points(), 0, &MANY),
            "points3D.bin: header (byte 0): expected at most 8 for the number of points (426 bytes are left), found 1000000000000000000",
        ),
        (
            "one point too many",
            patched(points(), 0, &[7]),
            "points3D.bin: record 7 (byte 434): expected 8 bytes of point id, found end of file",
        ),
        (
            "one point too few",
            patched(points(), 0, &[5]),
            "points3D.bin: end (byte 367): expected end of file, found 67 more bytes",
        ),
        (
            "track of 10^18",
            patched(points(), at::N_TRACK, &MANY),
            "points3D.bin: record 1 (byte 51): expected at most 46 for the number of observations (375 bytes are left), found 1000000000000000000",
        ),
        (
            "trailing byte",
            appended(points(), b"x"),
            "points3D.bin: end (byte 434): expected end of file, found 1 more byte",
        ),
        (
            "repeated id",
            patched(points(), at::POINT, &[3]),
            "points3D.bin: point 3: expected each id once, found it again",
        ),
        (
            "text where binary is expected",
            b"# 3D point list\n1 0 0 0 0 0 0 0\n".to_vec(),
            "points3D.bin: header (byte 0): expected binary data (the number of points), found text",
        ),
        (
            "no points",
            vec![0; 8],
            "points3D.bin: expected at least one point, found none",
        ),
    ];
    let image_rows = [
        (
            "empty",
            cut("images.bin", 0),
            "images.bin: header (byte 0): expected 8 bytes of the number of images, found end of file",
        ),
        (
            "cut in the last 2D points",
            cut("images.bin", images().len() - 1),
            "images.bin: record 3 (byte 630): expected at most 7 for the number of 2D points (191 bytes are left), found 8",
        ),
        (
            "NaN rotation",
            patched(images(), at::ROTATION, &nan),
            "images.bin: record 1 (byte 44): expected a finite pose of image 1, found [NaN, 0.144524286912638, 0.45859493447525507, -0.05452847088216712] [0.41835250088922316, -0.37602715054974273, 0.06756920600942723]",
        ),
        (
            "zero rotation",
            patched(images(), at::ROTATION, &[0; 32]),
            "images.bin: record 1 (byte 44): expected a finite pose of image 1, found [0.0, 0.0, 0.0, 0.0] [0.41835250088922316, -0.37602715054974273, 0.06756920600942723]",
        ),
        (
            "count of 10^18",
            patched(images(), 0, &MANY),
            "images.bin: header (byte 0): expected at most 11 for the number of images (822 bytes are left), found 1000000000000000000",
        ),
        (
            "2D points of 10^18",
            patched(images(), at::N_POINTS2D, &MANY),
            "images.bin: record 1 (byte 88): expected at most 30 for the number of 2D points (734 bytes are left), found 1000000000000000000",
        ),
        (
            "name without end",
            {
                let name_to_end = vec![b'a'; images().len() - at::NAME];
                patched(images(), at::NAME, &name_to_end)
            },
            "images.bin: record 1 (byte 72): expected a zero byte at the end of the image name, found end of file",
        ),
        (
            "unknown camera",
            patched(images(), at::IMAGE_CAMERA, &[9]),
            "images.bin: image 1: expected the id of a camera in cameras.bin, found 9",
        ),
        (
            "trailing bytes",
            appended(images(), &[0; 9]),
            "images.bin: end (byte 830): expected end of file, found 9 more bytes",
        ),
        (
            "repeated id",
            patched(images(), at::IMAGE, &[2]),
            "images.bin: image 2: expected each id once, found it again",
        ),
    ];
    let camera_rows = [
        (
            "empty",
            cut("cameras.bin", 0),
            "cameras.bin: header (byte 0): expected 8 bytes of the number of cameras, found end of file",
        ),
        (
            "unknown model",
            patched(cameras(), at::CAMERA_MODEL, &[99]),
            "cameras.bin: record 1 (byte 12): expected a camera model of COLMAP (0 to 17) for camera 1, found 99",
        ),
        (
            "negative model",
            patched(cameras(), at::CAMERA_MODEL, &[255; 4]),
            "cameras.bin: record 1 (byte 12): expected a camera model of COLMAP (0 to 17) for camera 1, found -1",
        ),
        (
            "longer model",
            patched(cameras(), at::CAMERA_MODEL, &[11]),
            "cameras.bin: record 1 (byte 64): expected 8 bytes of a parameter, found end of file",
        ),
        (
            "shorter model",
            patched(cameras(), at::CAMERA_MODEL, &[0]),
            "cameras.bin: end (byte 56): expected end of file, found 8 more bytes",
        ),
        (
            "count of 10^18",
            patched(cameras(), 0, &MANY),
            "cameras.bin: header (byte 0): expected at most 1 for the number of cameras (56 bytes are left), found 1000000000000000000",
        ),
    ];
    let all = [
        ("points3D.bin", point_rows.to_vec()),
        ("images.bin", image_rows.to_vec()),
        ("cameras.bin", camera_rows.to_vec()),
    ];
    all.into_iter()
        .flat_map(|(name, rows)| {
            rows.into_iter()
                .map(move |(what, bytes, line)| in_model(what, name, bytes, line))
        })
        .collect()
}

/// The last record of each file cut inside every field. (Cut in an earlier one, a file is refused by
/// its count or by the next record, which the sweeps below cover.)
fn last_record_cuts() -> Vec<Row> {
    let files = [
        model_file("points3D.bin"),
        model_file("images.bin"),
        model_file("cameras.bin"),
    ];
    let names = ["points3D.bin", "images.bin", "cameras.bin"];
    // The last point has a track of two, the last image a name of six bytes and eight 2D points.
    let starts = [
        files[0].len() - (at::TRACK - at::POINT) - 2 * 8,
        files[1].len() - (at::NAME - at::IMAGE) - 7 - 8 - 8 * 24,
        at::CAMERA,
    ];
    let (rotation, translation) = (at::ROTATION - at::IMAGE, at::TRANSLATION - at::IMAGE);
    let (camera, name) = (at::IMAGE_CAMERA - at::IMAGE, at::NAME - at::IMAGE);
    let rows: Vec<(&str, usize, usize, &str)> = vec![
        (
            "before the last point",
            0,
            0,
            "points3D.bin: record 6 (byte 367): expected 8 bytes of point id, found end of file",
        ),
        (
            "point id",
            0,
            7,
            "points3D.bin: record 6 (byte 367): expected 8 bytes of point id, found 7 bytes before the end of the file",
        ),
        (
            "coordinates",
            0,
            at::COLOR - at::POINT - 1,
            "points3D.bin: record 6 (byte 375): expected 24 bytes of coordinates, found 23 bytes before the end of the file",
        ),
        (
            "color",
            0,
            at::ERROR - at::POINT - 1,
            "points3D.bin: record 6 (byte 399): expected 3 bytes of color, found 2 bytes before the end of the file",
        ),
        (
            "reprojection error",
            0,
            at::N_TRACK - at::POINT - 1,
            "points3D.bin: record 6 (byte 402): expected 8 bytes of reprojection error, found 7 bytes before the end of the file",
        ),
        (
            "number of observations",
            0,
            at::TRACK - at::POINT - 1,
            "points3D.bin: record 6 (byte 410): expected 8 bytes of the number of observations, found 7 bytes before the end of the file",
        ),
        (
            "observations",
            0,
            at::TRACK - at::POINT + 2 * 8 - 1,
            "points3D.bin: record 6 (byte 410): expected at most 1 for the number of observations (15 bytes are left), found 2",
        ),
        (
            "before the last image",
            1,
            0,
            "images.bin: record 3 (byte 559): expected 4 bytes of image id, found end of file",
        ),
        (
            "image id",
            1,
            rotation - 1,
            "images.bin: record 3 (byte 559): expected 4 bytes of image id, found 3 bytes before the end of the file",
        ),
        (
            "rotation",
            1,
            translation - 1,
            "images.bin: record 3 (byte 563): expected 32 bytes of rotation, found 31 bytes before the end of the file",
        ),
        (
            "translation",
            1,
            camera - 1,
            "images.bin: record 3 (byte 595): expected 24 bytes of translation, found 23 bytes before the end of the file",
        ),
        (
            "camera of the image",
            1,
            name - 1,
            "images.bin: record 3 (byte 619): expected 4 bytes of camera id, found 3 bytes before the end of the file",
        ),
        (
            "name",
            1,
            name + 6,
            "images.bin: record 3 (byte 623): expected a zero byte at the end of the image name, found end of file",
        ),
        (
            "number of 2D points",
            1,
            name + 7 + 7,
            "images.bin: record 3 (byte 630): expected 8 bytes of the number of 2D points, found 7 bytes before the end of the file",
        ),
        (
            "2D points",
            1,
            name + 7 + 8 + 8 * 24 - 1,
            "images.bin: record 3 (byte 630): expected at most 7 for the number of 2D points (191 bytes are left), found 8",
        ),
        (
            "parameters",
            2,
            at::PARAMS - at::CAMERA + 4 * 8 - 1,
            "cameras.bin: record 1 (byte 56): expected 8 bytes of a parameter, found 7 bytes before the end of the file",
        ),
    ];
    rows.into_iter()
        .map(|(what, file, end, line)| {
            let bytes = files[file][..starts[file] + end].to_vec();
            in_model(what, names[file], bytes, line)
        })
        .collect()
}

fn colmap_text() -> Vec<Row> {
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
        points(
            "empty text",
            "",
            "points3D.txt: expected at least one point, found none",
        ),
        points(
            "only comments",
            "# nothing\n",
            "points3D.txt: expected at least one point, found none",
        ),
        points(
            "two coordinates",
            "# c\n1 2 3\n",
            "points3D.txt:2: expected 3 coordinates, found end of line",
        ),
        points(
            "not a number",
            "1 2 3 abc 0 0 0 0\n",
            "points3D.txt:1: expected 3 coordinates, found \"abc\"",
        ),
        points(
            "long word",
            &long,
            "points3D.txt:1: expected 3 coordinates, found \"9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a...\"",
        ),
        points(
            "NaN",
            "1 0 0 0 0 0 0 0\n7 NaN 0 0 0 0 0 0\n",
            "points3D.txt:2: expected finite coordinates of point 7, found [NaN, 0.0, 0.0]",
        ),
        points(
            "infinite",
            "7 0 -inf 0 0 0 0 0\n",
            "points3D.txt:1: expected finite coordinates of point 7, found [0.0, -inf, 0.0]",
        ),
        points(
            "negative id",
            "-7 0 0 0 0 0 0 0\n",
            "points3D.txt:1: expected a point id, found \"-7\"",
        ),
        points(
            "no error",
            "7 0 0 0 0 0 0\n",
            "points3D.txt:1: expected a reprojection error, found end of line",
        ),
        points(
            "half an observation",
            "7 0 0 0 0 0 0 0 1 2 3\n",
            "points3D.txt:1: expected observations of 2 numbers (image id, 2D point), found 3 numbers",
        ),
        points(
            "binary where text is expected",
            "\u{6}\0\0\0\0\0\0\0\u{2}\0\0\n",
            "points3D.txt:1: expected text, found binary data",
        ),
        model(
            "unknown camera model",
            "cameras.txt",
            "1 WIDE 640 480 1 2 3\n",
            "cameras.txt:1: expected a camera model of COLMAP for camera 1, found \"WIDE\"",
        ),
        model(
            "parameter missing",
            "cameras.txt",
            "1 PINHOLE 640 480 1 2 3\n",
            "cameras.txt:1: expected 4 parameters of PINHOLE, found 3",
        ),
        model(
            "no width",
            "cameras.txt",
            "1 PINHOLE\n",
            "cameras.txt:1: expected a width in pixels, found end of line",
        ),
        model(
            "pose cut",
            "images.txt",
            "1 1 0 0 0 1 2\n\n",
            "images.txt:1: expected a translation (3 numbers), found end of line",
        ),
        model(
            "zero rotation",
            "images.txt",
            "1 0 0 0 0 1 2 3 1 a.jpg\n\n",
            "images.txt:1: expected a finite pose of image 1, found [0.0, 0.0, 0.0, 0.0] [1.0, 2.0, 3.0]",
        ),
        model(
            "no name",
            "images.txt",
            "1 1 0 0 0 1 2 3 1\n\n",
            "images.txt:1: expected an image name, found end of line",
        ),
        model(
            "2D points cut",
            "images.txt",
            "1 1 0 0 0 1 2 3 1 a.jpg\n1 2 3 4\n",
            "images.txt:2: expected 2D points of 3 numbers (x, y, point id), found 4 numbers",
        ),
    ]
}

fn ply() -> Vec<Row> {
    const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
    let file = |format: &str, elements: &str, body: &[u8]| {
        let header = format!("ply\nformat {format} 1.0\n{elements}end_header\n");
        [header.as_bytes(), body].concat()
    };
    let ascii = |n: &str, body: &str| {
        file(
            "ascii",
            &format!("element vertex {n}\n{XYZ}"),
            body.as_bytes(),
        )
    };
    let binary = |n: &str, body: &[u8]| {
        file(
            "binary_little_endian",
            &format!("element vertex {n}\n{XYZ}"),
            body,
        )
    };
    let ply = |what, bytes: Vec<u8>, line| alone(what, "a.ply", bytes, line);
    let nan = [[0; 4], [0; 4], f32::NAN.to_le_bytes()].concat();
    let list = format!("element vertex 1\n{XYZ}property list uchar int seen\n");
    let list_before = format!("element face 1\nproperty list uchar int v\nelement vertex 1\n{XYZ}");
    vec![
        ply(
            "empty",
            vec![],
            "a.ply:1: expected \"ply\", as every PLY file begins, found end of file",
        ),
        ply(
            "not a PLY file",
            b"solid cube\n".to_vec(),
            "a.ply:1: expected \"ply\", as every PLY file begins, found \"solid cube\"",
        ),
        ply(
            "header cut",
            b"ply\nformat ascii 1.0\nelement ver".to_vec(),
            "a.ply:3: expected a header that ends with end_header, found end of file",
        ),
        ply(
            "unknown format",
            file("binary", "", b""),
            "a.ply:2: expected ascii, binary_little_endian or binary_big_endian, found \"binary\"",
        ),
        ply(
            "no format",
            b"ply\nelement vertex 1\nend_header\n".to_vec(),
            "a.ply: header: expected a line with the format, found none",
        ),
        ply(
            "no vertices",
            file("ascii", "element face 1\n", b""),
            "a.ply: header: expected an element vertex, found none",
        ),
        ply(
            "no z",
            file(
                "ascii",
                "element vertex 1\nproperty float x\nproperty float y\n",
                b"",
            ),
            "a.ply: header: expected a property z of type float or double in element vertex, found none",
        ),
        ply(
            "integer x",
            file("ascii", "element vertex 1\nproperty int x\n", b""),
            "a.ply: header: expected a property x of type float or double in element vertex, found an integer type",
        ),
        ply(
            "unknown type",
            file("ascii", "element vertex 1\nproperty half x\n", b""),
            "a.ply:4: expected the type of a property, found \"half\"",
        ),
        ply(
            "negative count",
            ascii("-1", ""),
            "a.ply:3: expected the number of elements, found \"-1\"",
        ),
        ply(
            "property first",
            file("ascii", "property float x\n", b""),
            "a.ply:3: expected an element before its properties, found \"property float x\"",
        ),
        ply(
            "list in vertex",
            file("ascii", &list, b"0 0 0 0\n"),
            "a.ply: header: expected vertices of fixed size, found a list property in element vertex",
        ),
        ply(
            "list before vertex",
            file("binary_big_endian", &list_before, &[0; 20]),
            "a.ply: header: expected elements of fixed size before vertex, found \"face\" with a list property",
        ),
        ply(
            "nonsense in the header",
            file("ascii", "elephant vertex 1\n", b""),
            "a.ply:3: expected a line of a PLY header, found \"elephant vertex 1\"",
        ),
        ply(
            "ascii: count of 10^18",
            ascii("1000000000000000000", "0 0 0\n"),
            "a.ply: header: expected at most 1 vertices (by the size of the file), found 1000000000000000000",
        ),
        ply(
            "ascii: too few vertices",
            ascii("3", "0.00 0.00 0.00\n1.00 1.00 1.00\n"),
            "a.ply:10: expected vertex 3 of 3, found end of file",
        ),
        ply(
            "ascii: too many vertices",
            ascii("1", "0 0 0\n1 1 1\n"),
            "a.ply:9: expected end of file after 1 vertices, found \"1 1 1\"",
        ),
        ply(
            "ascii: two values",
            ascii("1", "0.0000 0.0000\n"),
            "a.ply:8: expected 3 values of vertex 1, found 2",
        ),
        ply(
            "ascii: not a number",
            ascii("1", "0 zero 0\n"),
            "a.ply:8: expected a number for y, found \"zero\"",
        ),
        ply(
            "ascii: NaN",
            ascii("1", "0 0 nan\n"),
            "a.ply:8: expected finite coordinates of vertex 1, found [0.0, 0.0, NaN]",
        ),
        ply(
            "binary: count of 10^18",
            binary("1000000000000000000", &[0; 24]),
            "a.ply: header (byte 133): expected 1000000000000000000 rows of vertex, 12 bytes each, found 24 bytes",
        ),
        ply(
            "binary: too few vertices",
            binary("3", &[0; 24]),
            "a.ply: header (byte 115): expected 3 rows of vertex, 12 bytes each, found 24 bytes",
        ),
        ply(
            "binary: too many vertices",
            binary("1", &[0; 24]),
            "a.ply: end (byte 127): expected end of file, found 12 more bytes",
        ),
        ply(
            "binary: NaN",
            binary("1", &nan),
            "a.ply: record 1 (byte 115): expected finite coordinates of vertex 1, found [0.0, 0.0, NaN]",
        ),
        ply(
            "no points",
            binary("0", &[]),
            "a.ply: expected at least one point, found none",
        ),
    ]
}

fn tables() -> Vec<Row> {
    let csv = |what, text: &str, line| alone(what, "a.csv", text, line);
    vec![
        csv(
            "empty",
            "",
            "a.csv: expected at least one point, found none",
        ),
        csv(
            "only a header",
            "x,y,z\n",
            "a.csv: expected at least one point, found none",
        ),
        csv(
            "two columns",
            "1,2\n",
            "a.csv:1: expected 3 coordinates, found 2",
        ),
        csv(
            "two columns later",
            "1 2 3\n4 5\n",
            "a.csv:2: expected 3 coordinates, found 2",
        ),
        csv(
            "not a number",
            "x,y,z\n1,2,3\n4,five,6\n",
            "a.csv:3: expected a number for y, found \"five\"",
        ),
        csv(
            "empty field",
            "1,,3\n",
            "a.csv:1: expected a number for y, found \"\"",
        ),
        csv(
            "decimal comma",
            "1,5;2;3\n",
            "a.csv:1: expected a number for x, found \"1,5\"",
        ),
        csv(
            "NaN",
            "1,2,3\n1,nan,3\n",
            "a.csv:2: expected finite coordinates of point 1, found [1.0, NaN, 3.0]",
        ),
        csv(
            "columns without y",
            "x,north,z\n1,2,3\n",
            "a.csv:1: expected numbers, or columns named x, y and z, found \"x,north,z\"",
        ),
        csv(
            "row shorter than its header",
            "id,x,y,z\n1,2,3\n",
            "a.csv:2: expected 4 columns up to z, found 3",
        ),
        csv(
            "separator changes",
            "1,2,3\n4 5 6\n",
            "a.csv:2: expected a number for x, found \"4 5 6\"",
        ),
        csv(
            "one word",
            "hello\n",
            "a.csv:1: expected a number for x, found \"hello\"",
        ),
        alone(
            "binary",
            "a.xyz",
            [b'1', 0, 200, 10],
            "a.xyz:1: expected text, found binary data",
        ),
        alone(
            "control characters",
            "a.xyz",
            "1 2 \u{1b}[31m\n",
            "a.xyz:1: expected a number for z, found \"\\u{1b}[31m\"",
        ),
    ]
}

fn arrays() -> Vec<Row> {
    let npy = |what, bytes: Vec<u8>, line| alone(what, "a.npy", bytes, line);
    let good = fixture("f8.npy");
    let header = |text: &str| {
        let mut bytes = b"\x93NUMPY\x01\0".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.bytes());
        bytes.extend([0; 48]);
        bytes
    };
    let of = |descr: &str, order: &str, shape: &str| {
        header(&format!(
            "{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n"
        ))
    };
    vec![
        npy(
            "empty",
            vec![],
            "a.npy: header (byte 0): expected 8 bytes of magic and version, found end of file",
        ),
        npy(
            "not NumPy",
            b"PK\x03\x04 an npz archive".to_vec(),
            "a.npy: header (byte 0): expected a NumPy file, found \"PK\\u{3}\\u{4} a\"",
        ),
        npy(
            "unknown version",
            patched(good.clone(), 6, &[9]),
            "a.npy: header (byte 0): expected NumPy format 1, 2 or 3, found 9",
        ),
        npy(
            "header cut",
            good[..60].to_vec(),
            "a.npy: header (byte 10): expected a header of 118 bytes, found 50 bytes",
        ),
        npy(
            "data cut",
            good[..good.len() - 8].to_vec(),
            "a.npy: header (byte 128): expected 4 rows of 24 bytes, found 88 bytes",
        ),
        npy(
            "trailing byte",
            appended(good.clone(), b"x"),
            "a.npy: header (byte 128): expected 4 rows of 24 bytes, found 97 bytes",
        ),
        npy(
            "integers",
            of("'<i8'", "False", "(2, 3)"),
            "a.npy: header (byte 10): expected floats of 4 or 8 bytes (f4, f8), found \"<i8\"",
        ),
        npy(
            "records",
            of("[('x', '<f8')]", "False", "(2,)"),
            "a.npy: header (byte 10): expected floats of 4 or 8 bytes (f4, f8), found \"[('x\"",
        ),
        npy(
            "two columns",
            of("'<f8'", "False", "(3, 2)"),
            "a.npy: header (byte 10): expected an array of shape (n, 3), found \"(3, 2)\"",
        ),
        npy(
            "one dimension",
            of("'<f8'", "False", "(6,)"),
            "a.npy: header (byte 10): expected an array of shape (n, 3), found \"(6,)\"",
        ),
        npy(
            "no order",
            of("'<f8'", "None", "(2, 3)"),
            "a.npy: header (byte 10): expected fortran_order True or False, found \"None\"",
        ),
        npy(
            "2^62 rows",
            of("'<f8'", "False", "(4611686018427387904, 3)"),
            "a.npy: header (byte 88): expected 4611686018427387904 rows of 24 bytes, found 48 bytes",
        ),
        npy(
            "10^18 rows",
            of("'<f8'", "False", "(1000000000000000000, 3)"),
            "a.npy: header (byte 88): expected 1000000000000000000 rows of 24 bytes, found 48 bytes",
        ),
        npy(
            "NaN",
            patched(good.clone(), good.len() - 8, &f64::NAN.to_le_bytes()),
            "a.npy: header (byte 216): expected a finite coordinate of point 3, found NaN",
        ),
        npy(
            "nothing in the header",
            header("{}"),
            "a.npy: header (byte 10): expected floats of 4 or 8 bytes (f4, f8), found \"\"",
        ),
    ]
}

fn paths() -> Vec<Row> {
    vec![
        row(
            "missing",
            vec![],
            "nothing.ply",
            "nothing.ply: expected a file or folder, found nothing",
        ),
        row(
            "missing folder",
            vec![],
            "no/where",
            "no/where: expected a file or folder, found nothing",
        ),
        row(
            "empty folder",
            vec![("project/", vec![])],
            "project",
            "project: expected points3D.bin or points3D.txt in it, in sparse/0, sparse, 0 or model, found none",
        ),
        row(
            "folder with a file's name",
            vec![("a.ply/", vec![])],
            "a.ply",
            "a.ply: expected points3D.bin or points3D.txt in it, in sparse/0, sparse, 0 or model, found none",
        ),
        alone(
            "unknown extension",
            "a.las",
            "LASF",
            "a.las: expected a COLMAP folder or a .ply, .csv, .xyz, .txt or .npy file, found a .las file",
        ),
        alone(
            "no extension",
            "cloud",
            "1 2 3",
            "cloud: expected a COLMAP folder or a .ply, .csv, .xyz, .txt or .npy file, found a file without extension",
        ),
        alone(
            "images given by themselves",
            "images.bin",
            "",
            "images.bin: expected a file with points, found another file of a COLMAP model (give its folder)",
        ),
        alone(
            "a database",
            "database.db",
            "SQLite format 3",
            "database.db: expected a COLMAP folder or a .ply, .csv, .xyz, .txt or .npy file, found a .db file",
        ),
    ]
}

/// Makes the files of a row in `dir`; the path to open.
fn make(dir: &Path, row: &Row) -> PathBuf {
    for (name, bytes) in &row.files {
        let path = dir.join(name);
        if name.ends_with('/') {
            fs::create_dir_all(path).unwrap();
        } else {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }
    if row.open.is_empty() {
        dir.to_owned()
    } else {
        dir.join(row.open)
    }
}

/// The error without the temporary folder.
fn shown(dir: &Path, error: &unlift_io::Error) -> String {
    let dir = dir.to_str().unwrap();
    let line = error.to_string();
    let line = line.strip_prefix(dir).expect("errors begin with the path");
    line.trim_start_matches(['/', '\\']).to_owned()
}

#[test]
fn every_malformed_file_is_refused_with_its_line() {
    let tables = [
        colmap_binary(),
        last_record_cuts(),
        colmap_text(),
        ply(),
        tables(),
        arrays(),
        paths(),
    ];
    for row in tables.into_iter().flatten() {
        let dir = tempfile::tempdir().unwrap();
        let path = make(dir.path(), &row);
        let error = read::open(&path).expect_err(row.what);
        assert_eq!(shown(dir.path(), &error), row.line, "{}", row.what);
    }
}

/// What is wrong with a file of descriptors: its bytes, or a statement run on the database.
enum Wrong {
    Bytes(Vec<u8>),
    Sql(&'static str),
}

#[test]
fn every_malformed_file_of_descriptors_is_refused_with_its_line() {
    let good = fixture("project/descriptors.bin");
    let input = read::open(&fixtures().join("project")).unwrap();
    let n = good.len();
    let bytes = |what, bytes, line| (what, Wrong::Bytes(bytes), line);
    let sql = |what, statement, line| (what, Wrong::Sql(statement), line);
    let zeros = appended(good[..n - 6 * 128].to_vec(), &[0; 6 * 128]);
    let rows: Vec<(&str, Wrong, &str)> = vec![
        bytes(
            "empty",
            vec![],
            "d: expected a file that begins with P3DESC01, or a COLMAP database (SQLite), found an empty file",
        ),
        bytes(
            "short",
            b"P3D".to_vec(),
            "d: expected a file that begins with P3DESC01, or a COLMAP database (SQLite), found a file of 3 bytes",
        ),
        bytes(
            "another form",
            b"\x89HDF\r\n\x1a\n".to_vec(),
            "d: expected a file that begins with P3DESC01, or a COLMAP database (SQLite), found \"�HDF\\r\\n\\u{1a}\\n\"",
        ),
        bytes(
            "cut in the header",
            good[..18].to_vec(),
            "d: header (byte 8): expected at most 0 for the number of descriptors (2 bytes are left), found 6",
        ),
        bytes(
            "cut in the ids",
            good[..40].to_vec(),
            "d: header (byte 8): expected at most 3 for the number of descriptors (24 bytes are left), found 6",
        ),
        bytes(
            "cut in the values",
            good[..n - 1].to_vec(),
            "d: header (byte 24): expected 6 ids and rows of 128 bytes, found 815 bytes",
        ),
        bytes(
            "trailing byte",
            appended(good.clone(), b"x"),
            "d: header (byte 24): expected 6 ids and rows of 128 bytes, found 817 bytes",
        ),
        bytes(
            "count of 10^18",
            patched(good.clone(), 8, &MANY),
            "d: header (byte 8): expected at most 103 for the number of descriptors (824 bytes are left), found 1000000000000000000",
        ),
        bytes(
            "dimension of 2^32 - 1",
            patched(good.clone(), 16, &[255; 4]),
            "d: header (byte 24): expected 6 ids and rows of 4294967295 bytes, found 816 bytes",
        ),
        bytes(
            "dimension of 0",
            patched(good.clone(), 16, &[0; 4]),
            "d: header (byte 24): expected 6 ids and rows of 0 bytes, found 816 bytes",
        ),
        bytes(
            "unknown type",
            patched(good.clone(), 20, &[2]),
            "d: header (byte 20): expected type 1 (bytes), found 2",
        ),
        bytes(
            "repeated id",
            patched(good.clone(), 24 + 8, &[2]),
            "d: record 2 (byte 32): expected each id once, found id 2 again",
        ),
        bytes(
            "id of a point missing",
            patched(good.clone(), 24 + 8, &[100]),
            "d: point 3: expected a descriptor, found none among 6",
        ),
        bytes(
            "dummies",
            zeros,
            "d: descriptors: expected real descriptors, found only zeros (dummies)",
        ),
        bytes(
            "a database cut short",
            fixture("project/database.db")[..100].to_vec(),
            "d: table images: expected a COLMAP database, found database disk image is malformed",
        ),
        sql(
            "a database without images",
            "PRAGMA foreign_keys=0; DROP TABLE images",
            "d: table images: expected a COLMAP database, found no such table: images",
        ),
        sql(
            "a database without descriptors",
            "DROP TABLE descriptors",
            "d: table descriptors: expected a COLMAP database, found no such table: descriptors",
        ),
        sql(
            "an image under another name",
            "UPDATE images SET name = 'x' WHERE name = 'i2.jpg'",
            "d: image \"i2.jpg\": expected this image of the model, found no such image",
        ),
        sql(
            "an image without descriptors",
            "DELETE FROM descriptors WHERE image_id = 1",
            "d: image \"i3.jpg\": expected descriptors, found none",
        ),
        sql(
            "fewer descriptors than keypoints",
            "UPDATE descriptors SET rows = 2, data = substr(data, 1, 256)",
            "d: image \"küche/ä 0.jpg\": expected a descriptor for keypoint 2, found 2 descriptors",
        ),
        sql(
            "a blob cut short",
            "UPDATE descriptors SET data = substr(data, 1, 1000)",
            "d: image \"küche/ä 0.jpg\": expected 8 descriptors of 128 bytes, found 1000 bytes",
        ),
        sql(
            "no blob",
            "UPDATE descriptors SET data = NULL",
            "d: image \"küche/ä 0.jpg\": expected 8 descriptors of 128 bytes, found 0 bytes",
        ),
        sql(
            "negative rows",
            "UPDATE descriptors SET rows = -8",
            "d: image \"küche/ä 0.jpg\": expected sizes of descriptors, found -8 x 128",
        ),
        sql(
            "rows of 2^62",
            "UPDATE descriptors SET rows = 4611686018427387904",
            "d: image \"küche/ä 0.jpg\": expected 4611686018427387904 descriptors of 128 bytes, found 1024 bytes",
        ),
        sql(
            "text for rows",
            "UPDATE descriptors SET rows = 'many'",
            "d: table descriptors: expected a COLMAP database, found Invalid column type Text at index: 0, name: rows",
        ),
        sql(
            "two kinds in one database",
            "UPDATE descriptors SET type = 1 WHERE image_id = 1",
            "d: image \"i3.jpg\": expected 128 columns of Bytes as in other images, found 128 of Floats",
        ),
        sql(
            "dummies in a database",
            "UPDATE descriptors SET data = zeroblob(1024)",
            "d: descriptors: expected real descriptors, found only zeros (dummies)",
        ),
        sql(
            "NaN in a database",
            "UPDATE descriptors SET type = 1, cols = 4, data = x'0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f'",
            "d: descriptor 0, value 0: expected a finite value, found NaN",
        ),
    ];
    for (what, wrong, line) in rows {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("d");
        match wrong {
            Wrong::Bytes(bytes) => fs::write(&path, bytes).unwrap(),
            Wrong::Sql(statement) => {
                fs::write(&path, fixture("project/database.db")).unwrap();
                let database = rusqlite::Connection::open(&path).unwrap();
                database.execute_batch(statement).unwrap();
                database.close().unwrap();
            }
        }
        let error = read::descriptors(&path, &input).expect_err(what);
        assert_eq!(shown(dir.path(), &error), line, "{what}");
    }
}

#[test]
fn descriptors_need_a_database_or_a_model_that_fit() {
    let cloud = read::open(&fixtures().join("f8.npy")).unwrap();
    let database = fixtures().join("project/database.db");
    let error = read::descriptors(&database, &cloud).unwrap_err();
    assert_eq!(
        shown(&fixtures(), &error),
        "project/database.db: expected a COLMAP model, whose tracks lead to a database, found npy points"
    );
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_read_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.csv");
    fs::write(&path, "1,2,3").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::read(&path).is_ok() {
        eprintln!("skipped: this user may read everything");
        return;
    }
    assert_eq!(
        shown(dir.path(), &read::open(&path).unwrap_err()),
        "a.csv: expected a readable file, found no permission to read"
    );
}

/// Opens what lies at `path`; an error must be one line that begins with a path in `dir`.
fn opens_or_one_line(dir: &Path, path: &Path) -> bool {
    match read::open(path) {
        Ok(_) => true,
        Err(error) => {
            let line = shown(dir, &error);
            assert!(!line.contains('\n') && line.contains(": "), "{line}");
            false
        }
    }
}

/// Every variant of the file called `name` of a fixture, in its place: what `opened` says of each.
fn sweep(folder: &str, name: &str, mut check: impl FnMut(&Path, &Path, &Path, &[u8])) {
    let dir = tempfile::tempdir().unwrap();
    let is_model = !folder.is_empty();
    if is_model {
        for file in fs::read_dir(fixtures().join(folder)).unwrap() {
            let file = file.unwrap();
            fs::copy(file.path(), dir.path().join(file.file_name())).unwrap();
        }
    }
    let original = fixture(Path::new(folder).join(name).to_str().unwrap());
    let path = dir.path().join(name);
    let opened = if is_model { dir.path() } else { &path };
    check(dir.path(), opened, &path, &original);
}

/// Every file that can be opened.
const FIXTURES: [(&str, &str); 17] = [
    (MODEL, "cameras.bin"),
    (MODEL, "images.bin"),
    (MODEL, "points3D.bin"),
    ("rig-bin", "cameras.bin"),
    ("rig-bin", "frames.bin"),
    ("rig-bin", "images.bin"),
    ("rig-bin", "points3D.bin"),
    ("rig-bin", "rigs.bin"),
    ("rig-txt", "cameras.txt"),
    ("rig-txt", "frames.txt"),
    ("rig-txt", "images.txt"),
    ("rig-txt", "points3D.txt"),
    ("rig-txt", "rigs.txt"),
    ("", "cloud.ply"),
    ("", "f8.npy"),
    ("", "f8-fortran.npy"),
    ("", "f4-big-endian.npy"),
];

#[test]
fn files_cut_at_any_length_open_or_are_refused() {
    for (folder, name) in FIXTURES {
        sweep(folder, name, |dir, opened, path, original| {
            // A text may end after any line; rigs and frames are not needed. The others have counts.
            let is_needed = !["rigs.bin", "frames.bin"].contains(&name);
            let needs_all = is_needed && !name.ends_with(".txt");
            for n in 0..original.len() {
                fs::write(path, &original[..n]).unwrap();
                let opens = opens_or_one_line(dir, opened);
                assert!(!(opens && needs_all), "{folder}/{name} cut at {n} opens");
            }
        });
    }
}

#[test]
fn files_with_any_byte_changed_open_or_are_refused() {
    for (folder, name) in FIXTURES {
        sweep(folder, name, |dir, opened, path, original| {
            let mut changed = original.to_vec();
            for at in 0..original.len() {
                for byte in [0, 0xff, b'9'] {
                    changed[at] = byte;
                    fs::write(path, &changed).unwrap();
                    opens_or_one_line(dir, opened);
                }
                changed[at] = original[at];
            }
        });
    }
}

#[test]
fn descriptors_cut_at_any_length_or_with_any_byte_changed_are_read_or_refused() {
    let input = read::open(&fixtures().join("project")).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("d");
    // Databases in steps: SQLite has tests of its own.
    for (name, step) in [
        ("descriptors.bin", 1),
        ("database.db", 37),
        ("floats.db", 37),
    ] {
        let original = fixture(&format!("project/{name}"));
        for at in (0..original.len()).step_by(step) {
            fs::write(&path, &original[..at]).unwrap();
            let cut = read::descriptors(&path, &input);
            assert!(
                cut.is_err() || name != "descriptors.bin",
                "{name} cut at {at}"
            );
            let mut changed = original.clone();
            changed[at] ^= 0xff;
            fs::write(&path, &changed).unwrap();
            if let Err(error) = read::descriptors(&path, &input) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}
