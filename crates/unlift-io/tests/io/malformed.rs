//! Tests malformed maps: the exact error line of each, and no panic for any cut or changed byte of any input.

use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use unlift_io::features::FeatureSource;
use unlift_io::{read, stage};

use super::stages::maps;
use super::{copy_folder, data, fixture, npy as array, shown, write};

pub fn patched(mut file: Vec<u8>, at: usize, bytes: &[u8]) -> Vec<u8> {
    file[at..at + bytes.len()].copy_from_slice(bytes);
    file
}

/// A count that exceeds any file.
pub const MANY: [u8; 8] = 1_000_000_000_000_000_000_u64.to_le_bytes();

/// What is wrong, the files, the path to open (empty for their folder), and the error line.
type Row = (&'static str, Vec<(&'static str, Vec<u8>)>, &'static str, String);

/// A file by itself; `line` follows its name.
fn alone(what: &'static str, name: &'static str, bytes: impl AsRef<[u8]>, line: &str) -> Row {
    (what, vec![(name, bytes.as_ref().to_vec())], name, format!("{name}{line}"))
}

#[test]
fn every_malformed_file_is_refused_with_its_line() {
    let all = [binary(), text(), ply(), tables_and_other_names(), arrays()];
    for (what, files, open, line) in all.into_iter().flatten() {
        let dir = tempfile::tempdir().unwrap();
        for (name, bytes) in &files {
            fs::write(dir.path().join(name), bytes).unwrap();
        }
        let path = dir.path().join(open);
        // Errors in cameras are notes, because points do not need cameras.
        if line.starts_with("cameras") {
            let notes = read::open(&path).expect(what).notes;
            assert!(notes.iter().any(|note| note.ends_with(&line)), "{what}: {notes:?}");
        } else {
            assert_eq!(shown(dir.path(), &read::open(&path).expect_err(what)), line, "{what}");
        }
    }
}

/// They must be an error before they are opened.
#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let map = read::open(&data("cloud.ply")).unwrap();
    let check = |name: &str| {
        let (path, dir) = (dir.path().join(name), dir.path());
        let line = format!("{name}: expected a file, found a pipe, a socket or a device");
        assert_eq!(shown(dir, &read::open(&path).unwrap_err()), line);
        assert_eq!(shown(dir, &read::descriptors(&path, &map).unwrap_err()), line);
        assert_eq!(shown(dir, &FeatureSource::open(&path).err().unwrap()), line);
    };
    for name in ["a.csv", "a.xyz", "a.ply", "a.npy", "points3D.bin", "points3D.txt"] {
        std::os::unix::fs::symlink("/dev/zero", dir.path().join(name)).unwrap();
        check(name);
    }
    let pipe = dir.path().join("pipe.ply");
    if std::process::Command::new("mkfifo").arg(pipe).status().is_ok_and(|made| made.success()) {
        check("pipe.ply");
    }
}

/// The model without rigs and frames.
const MODEL: &str = "project/sparse/0";

fn model_file(name: &str) -> Vec<u8> {
    fixture(&format!("{MODEL}/{name}"))
}

/// The model with other bytes in one file; `line` follows its name.
fn in_model(what: &'static str, name: &'static str, bytes: Vec<u8>, line: &str) -> Row {
    let names = ["cameras.bin", "images.bin", "points3D.bin"];
    let file = |of| (of, if of == name { bytes.clone() } else { model_file(of) });
    (what, names.map(file).to_vec(), "", format!("{name}{line}"))
}

#[rustfmt::skip] // One row per line.
fn binary() -> Vec<Row> {
    // After a count of 8 bytes, a point has an id, coordinates, a color, an error and from byte 51 the number of its
    // observations, an image an id, a rotation, a translation, a camera and from byte 72 a name, a camera an id and a model.
    let [points, images, cameras] = ["points3D.bin", "images.bin", "cameras.bin"].map(|name| move || model_file(name));
    let name_to_end = vec![b'a'; images().len() - 72];
    vec![
        in_model("cut in the count", "points3D.bin", points()[..5].to_vec(), ": header (byte 0): expected 8 bytes of the number of points, found 5 bytes before the end of the file"),
        in_model("track of 10^18", "points3D.bin", patched(points(), 51, &MANY), ": record 1 (byte 51): expected at most 46 for the number of observations (375 bytes are left), found 1000000000000000000"),
        in_model("trailing byte", "points3D.bin", [points(), b"x".to_vec()].concat(), ": record 6 (byte 434): expected end of file, found 1 byte more"),
        in_model("repeated id", "points3D.bin", patched(points(), 8, &[3]), ": point 3: expected each id once, found it again"),
        in_model("text where binary is expected", "points3D.bin", b"# 3D point list\n1 0 0 0 0 0 0 0\n".to_vec(), ": header (byte 0): expected binary data (the number of points), found text"),
        in_model("name without end", "images.bin", patched(images(), 72, &name_to_end), ": record 1 (byte 830): expected 1 byte of image name, found end of file"),
        in_model("repeated id", "images.bin", patched(images(), 8, &[2]), ": image 2: expected each id once, found it again"),
        in_model("unknown model", "cameras.bin", patched(cameras(), 12, &[99]), ": record 1 (byte 12): expected a camera model of COLMAP (0 to 17) for camera 1, found 99"),
        in_model("longer model", "cameras.bin", patched(cameras(), 12, &[11]), ": record 1 (byte 64): expected 8 bytes of a parameter, found end of file"),
    ]
}

#[rustfmt::skip] // One row per line.
fn text() -> Vec<Row> {
    let points = |what, text: &str, line: &str| alone(what, "points3D.txt", text, line);
    let model = |what, name, text: &str, line: &str| {
        let files = vec![(name, text.as_bytes().to_vec()), ("points3D.txt", b"1 0 0 0 0 0 0 0".to_vec())];
        (what, files, "", format!("{name}{line}"))
    };
    let long = format!("1 0 0 {} 0 0 0 0", "9a".repeat(60));
    vec![
        points("two coordinates", "# c\n1 2 3\n", ":2: expected 3 coordinates, found end of line"),
        points("long word", &long, ":1: expected 3 coordinates, found \"9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a9a...\""),
        points("NaN", "7 NaN 0 0 0 0 0 0\n", ": expected a point with a place, found 1 without one"),
        points("no error", "7 0 0 0 0 0 0\n", ":1: expected a reprojection error, found end of line"),
        points("half an observation", "7 0 0 0 0 0 0 0 1 2 3\n", ":1: expected observations of 2 numbers (image id, 2D point), found 3 numbers"),
        points("binary where text is expected", "\u{6}\0\0\0\0\0\0\0\u{2}\0\0\n", ":1: expected text, found binary data"),
        model("no name", "images.txt", "1 1 0 0 0 1 2 3 1 \n\n", ":1: expected an image name, found end of line"),
        model("a name twice", "images.txt", "1 1 0 0 0 0 0 0 1 a.jpg\n\n2 1 0 0 0 0 0 0 1 a.jpg\n\n", ": expected each name once, found \"a.jpg\" again"),
        model("2D points cut", "images.txt", "1 1 0 0 0 1 2 3 1 a.jpg\n1 2 3 4\n", ":2: expected 2D points of 3 numbers (x, y, point id), found 4 numbers"),
        model("unknown camera model", "cameras.txt", "1 WIDE 640 480 1 2 3\n", ":1: expected a camera model of COLMAP for camera 1, found \"WIDE\""),
        model("parameter missing", "cameras.txt", "1 PINHOLE 640 480 1 2 3\n", ":1: expected 4 parameters of PINHOLE, found 3"),
    ]
}

#[rustfmt::skip] // One row per line.
fn ply() -> Vec<Row> {
    const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
    let file = |format: &str, elements: &str, body: &[u8]| {
        let header = format!("ply\nformat {format} 1.0\n{elements}end_header\n");
        [header.as_bytes(), body].concat()
    };
    let ascii = |n: &str, body: &str| {
        file("ascii", &format!("element vertex {n}\n{XYZ}"), body.as_bytes())
    };
    let binary = |n: &str, body: &[u8]| {
        file("binary_little_endian", &format!("element vertex {n}\n{XYZ}"), body)
    };
    let ply = |what, bytes: Vec<u8>, line: &str| alone(what, "a.ply", bytes, line);
    let list_before = format!("element face 1\nproperty list uchar int v\nelement vertex 1\n{XYZ}");
    vec![
        ply("not a PLY file", b"solid cube\n".to_vec(), ":1: expected \"ply\", as every PLY file begins, found \"solid cube\""),
        ply("unknown format", file("binary", "", b""), ":2: expected ascii, binary_little_endian or binary_big_endian, found \"binary\""),
        ply("no vertices", file("ascii", "element face 1\n", b""), ": header: expected an element vertex, found none"),
        ply("packed splats", file("binary_little_endian", "element vertex 1\nproperty uint packed_position\n", &[0; 4]), ": header: expected x, y and z, found packed splats (export them unpacked)"),
        ply("unknown type", file("ascii", "element vertex 1\nproperty half x\n", b""), ":4: expected the type of a property, found \"half\""),
        ply("negative count", ascii("-1", ""), ":3: expected the number of elements, found \"-1\""),
        ply("list before vertex: cut", file("binary_big_endian", &list_before, &[20; 13]), ": record 1 (byte 154): expected 80 bytes of a list, found 12 bytes before the end of the file"),
        ply("ascii: count of 10^18", ascii("1000000000000000000", "0 0 0\n"), ": header: expected at most 1 vertices (by the size of the file), found 1000000000000000000"),
        ply("ascii: too few vertices", ascii("3", "0.00 0.00 0.00\n1.00 1.00 1.00\n"), ":10: expected vertex 3 of 3, found end of file"),
        ply("ascii: too many vertices", ascii("1", "0 0 0\n1 1 1\n"), ":9: expected end of file after 1 vertices, found \"1 1 1\""),
        ply("ascii: not a number", ascii("1", "0 zero 0\n"), ":8: expected a number for y, found \"zero\""),
        ply("binary: count of 10^18", binary("1000000000000000000", &[0; 24]), ": header (byte 133): expected 1000000000000000000 rows of vertex, 12 bytes each, found 24 bytes"),
        ply("binary: too many vertices", binary("1", &[0; 24]), ": record 1 (byte 127): expected end of file, found 12 bytes more"),
    ]
}

#[rustfmt::skip] // One row per line.
fn tables_and_other_names() -> Vec<Row> {
    let csv = |what, text: &str, line: &str| alone(what, "a.csv", text, line);
    vec![
        csv("empty", "", ": expected at least one point, found none"),
        csv("two columns later", "1 2 3\n4 5\n", ":2: expected 3 coordinates, found 2"),
        csv("decimal comma", "1,5;2;3\n", ":1: expected a number for x, found \"1,5\""),
        csv("columns without y", "x,north,z\n1,2,3\n", ":1: expected numbers, or columns named x, y and z, found \"x,north,z\""),
        csv("row shorter than its header", "id,x,y,z\n1,2,3\n", ":2: expected 4 columns up to z, found 3"),
        alone("a line without end", "a.csv", vec![b'1'; (16 << 20) + 1], ":1: expected a line of at most 16 MiB, found a longer one"),
        alone("control characters", "a.xyz", "1 2 \u{1b}[31m\n", ":1: expected a number for z, found \"\\u{1b}[31m\""),
        ("empty folder", vec![], "", ": expected points3D.bin or points3D.txt in it, or in sparse, model, models, colmap/sparse or a numbered folder of these, found none".to_owned()),
        alone("a dropped format", "a.laz", "LASF", ": expected a COLMAP folder, a map of OpenSfM, nerfstudio, Bundler or NVM, or a .ply, .csv, .xyz, .txt, .asc, .pts, .npy, .npz or .splat file, found a .laz file (convert it: CloudCompare -O in.laz -SAVE_CLOUDS, or pdal translate in.laz out.ply)"),
        alone("images given by themselves", "images.bin", "", ": expected a file with points, found another file of a COLMAP model (give its folder)"),
        alone("a database", "database.db", "SQLite format 3", ": expected a COLMAP folder, a map of OpenSfM, nerfstudio, Bundler or NVM, or a .ply, .csv, .xyz, .txt, .asc, .pts, .npy, .npz or .splat file, found a .db file"),
    ]
}

#[rustfmt::skip] // One row per line.
fn arrays() -> Vec<Row> {
    let npy = |what, bytes: Vec<u8>, line: &str| alone(what, "a.npy", bytes, line);
    let good = fixture("f8.npy");
    let of = |descr: &str, order: &str, shape: &str| {
        let mut bytes = array(descr, shape, &[0; 48]);
        let at = bytes.windows(5).position(|word| word == b"False").unwrap();
        bytes[at..at + 5].copy_from_slice(format!("{order:5}").as_bytes());
        bytes
    };
    vec![
        npy("not NumPy", b"PK\x03\x04 an npz archive".to_vec(), ": header (byte 0): expected a NumPy file, found \"PK\\u{3}\\u{4} a\""),
        npy("unknown version", patched(good.clone(), 6, &[9]), ": header (byte 0): expected NumPy format 1, 2 or 3, found 9"),
        npy("header cut", good[..60].to_vec(), ": header (byte 10): expected a header of 118 bytes, found 50 bytes"),
        npy("complex numbers", of("'<c8'", "False", "(2, 3)"), ": header (byte 10): expected numbers, or fields of numbers called x, y and z, found \"<c8\""),
        npy("two columns", of("'<f8'", "False", "(3, 2)"), ": header (byte 10): expected an array of shape (n, 3), found \"(3, 2)\""),
        npy("row numbers", array("'|u1'", "(10, 4)", &(0..10).flat_map(|row| [row, 5, 6, 7]).collect::<Vec<u8>>()), ": header (byte 128): expected x, y and z in the first columns, found the row number"),
        npy("a field of another name", array("[('a', '<f4')]", "(1,)", &[0; 4]), ": header (byte 10): expected numbers, or fields of numbers called x, y and z, found \"[('a', '<f4')]\""),
        npy("no order", of("'<f8'", "None", "(2, 3)"), ": header (byte 10): expected fortran_order True or False, found \"None\""),
        npy("2^62 rows", of("'<f8'", "False", "(4611686018427387904, 3)"), ": header (byte 128): expected 4611686018427387904 rows of 24 bytes, found 48 bytes"),
        npy("nothing in the header", [&b"\x93NUMPY\x01\0\x02\0{}"[..], &[0; 48]].concat(), ": header (byte 10): expected numbers, or fields of numbers called x, y and z, found \"\""),
    ]
}

/// Inputs: a folder of fixtures or none, a file in it, and whether it cannot be read without its last byte. The model in
/// `rig-bin` has rigs and frames. Checksums protect a released map.
const INPUTS: [(&str, &str, bool); 17] = [
    (MODEL, "cameras.bin", false),
    (MODEL, "images.bin", true),
    ("rig-bin", "points3D.bin", true),
    ("rig-txt", "cameras.txt", false),
    ("rig-txt", "images.txt", false),
    ("rig-txt", "points3D.txt", false),
    ("", "cloud.ply", true),
    ("", "f8-fortran.npy", true),
    ("", "bundle.out", false),
    ("", "scene.nvm", false),
    ("", "reconstruction.json", true),
    ("", "table.csv", false),
    ("project", "descriptors.bin", false),
    ("project", "database.db", false),
    ("", "features-latest.h5", false),
    ("", "features-earliest.h5", false),
    ("", "released.npz", true),
];

fn bytes_of(folder: &str, name: &str) -> Vec<u8> {
    match name {
        "bundle.out" => super::others::BUNDLER.into(),
        "scene.nvm" => super::others::NVM.into(),
        "reconstruction.json" => super::others::OPENSFM.into(),
        "table.csv" => b"# id x y z\n1,0.5,2,-3e2\n2,1,nan,4\n".to_vec(),
        "released.npz" => {
            let (_dir, path) = write(name, "");
            stage::write_released(&path, &maps::released::<3>(3, 40)[2], None).unwrap();
            fs::read(path).unwrap()
        }
        _ => fixture(Path::new(folder).join(name).to_str().unwrap()),
    }
}

/// Reads the input `name` in `dir`. Errors must be one line. Returns true on success.
fn reads(dir: &Path, name: &str, map: &read::Input) -> bool {
    let path = &dir.join(name);
    let result = match name {
        "descriptors.bin" | "database.db" => read::descriptors(path, map).map(drop),
        "released.npz" => stage::read_released::<3>(path).map(drop),
        _ if name.ends_with(".h5") => FeatureSource::open(path).and_then(|source| {
            (0..source.names().len()).try_for_each(|at| source.get(at).map(drop))
        }),
        _ => {
            let is_model = ["points3D.bin", "points3D.txt"].iter().any(|of| dir.join(of).exists());
            read::open(if is_model { dir } else { path }).map(drop)
        }
    };
    result.as_ref().err().is_none_or(|error| {
        let line = shown(dir, error);
        assert!(!line.contains('\n') && line.contains(": "), "{line}");
        false
    })
}

#[test]
fn inputs_that_are_cut_or_changed_anywhere_are_read_or_refused() {
    let map = read::open(&data("project")).unwrap();
    for (folder, name, is_whole) in INPUTS {
        let dir = tempfile::tempdir().unwrap();
        if !folder.is_empty() {
            copy_folder(&data(folder), dir.path());
        }
        let (path, original) = (dir.path().join(name), bytes_of(folder, name));
        fs::write(&path, &original).unwrap();
        assert!(reads(dir.path(), name, &map), "{folder}/{name}");
        // A part of the bytes of large files, to finish within seconds.
        let places = || (0..original.len()).step_by(original.len().div_ceil(400));
        let mut file = File::options().write(true).open(&path).unwrap();
        for at in places() {
            for other in [0, 0xff, b'9', original[at] ^ 1, original[at]] {
                file.seek(SeekFrom::Start(at as u64)).unwrap();
                file.write_all(&[other]).unwrap();
                if other != original[at] {
                    reads(dir.path(), name, &map);
                }
            }
        }
        for n in places().rev() {
            file.set_len(n as u64).unwrap();
            let opens = reads(dir.path(), name, &map);
            assert!(!opens || !is_whole, "{folder}/{name} cut at {n} opens");
        }
    }
}
