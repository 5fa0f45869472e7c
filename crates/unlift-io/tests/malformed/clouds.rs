//! Malformed point clouds and paths.

use super::{Row, alone, fixture, patched, row};

#[rustfmt::skip] // One row per line.
pub fn ply() -> Vec<Row> {
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
    let ply = |what, bytes: Vec<u8>, line| alone(what, "a.ply", bytes, line);
    let list = format!("element vertex 1\n{XYZ}property list uchar int seen\n");
    let list_before = format!("element face 1\nproperty list uchar int v\nelement vertex 1\n{XYZ}");
    vec![
        ply("not a PLY file", b"solid cube\n".to_vec(),
            "a.ply:1: expected \"ply\", as every PLY file begins, found \"solid cube\""),
        ply("unknown format", file("binary", "", b""),
            "a.ply:2: expected ascii, binary_little_endian or binary_big_endian, found \"binary\""),
        ply("no vertices", file("ascii", "element face 1\n", b""),
            "a.ply: header: expected an element vertex, found none"),
        ply("unknown type", file("ascii", "element vertex 1\nproperty half x\n", b""),
            "a.ply:4: expected the type of a property, found \"half\""),
        ply("negative count", ascii("-1", ""), "a.ply:3: expected the number of elements, found \"-1\""),
        ply("list in vertex: cut", file("ascii", &list, b"0 0 0 2 1
"),
            "a.ply:9: expected 6 values of vertex 1, found 5"),
        ply("list before vertex: cut", file("binary_big_endian", &list_before, &[20; 13]),
            "a.ply: record 1 (byte 154): expected 80 bytes of a list, found 12 bytes before the end of the file"),
        ply("ascii: count of 10^18", ascii("1000000000000000000", "0 0 0\n"),
            "a.ply: header: expected at most 1 vertices (by the size of the file), found 1000000000000000000"),
        ply("ascii: too few vertices", ascii("3", "0.00 0.00 0.00\n1.00 1.00 1.00\n"),
            "a.ply:10: expected vertex 3 of 3, found end of file"),
        ply("ascii: too many vertices", ascii("1", "0 0 0\n1 1 1\n"),
            "a.ply:9: expected end of file after 1 vertices, found \"1 1 1\""),
        ply("ascii: not a number", ascii("1", "0 zero 0\n"),
            "a.ply:8: expected a number for y, found \"zero\""),
        ply("binary: count of 10^18", binary("1000000000000000000", &[0; 24]),
            "a.ply: header (byte 133): expected 1000000000000000000 rows of vertex, 12 bytes each, found 24 bytes"),
        ply("binary: too many vertices", binary("1", &[0; 24]),
            "a.ply: end (byte 127): expected end of file, found 12 more bytes"),
        ply("no points", binary("0", &[]), "a.ply: expected at least one point, found none"),
    ]
}

#[rustfmt::skip] // One row per line.
pub fn tables() -> Vec<Row> {
    let csv = |what, text: &str, line| alone(what, "a.csv", text, line);
    vec![
        csv("empty", "", "a.csv: expected at least one point, found none"),
        csv("two columns later", "1 2 3\n4 5\n", "a.csv:2: expected 3 coordinates, found 2"),
        csv("not a number", "x,y,z\n1,2,3\n4,five,6\n", "a.csv:3: expected a number for y, found \"five\""),
        csv("empty fields", "1,,3
", "a.csv: expected a point with a place, found 1 without one"),
        csv("decimal comma", "1,5;2;3\n", "a.csv:1: expected a number for x, found \"1,5\""),
        csv("columns without y", "x,north,z\n1,2,3\n",
            "a.csv:1: expected numbers, or columns named x, y and z, found \"x,north,z\""),
        csv("row shorter than its header", "id,x,y,z\n1,2,3\n",
            "a.csv:2: expected 4 columns up to z, found 3"),
        alone("binary", "a.xyz", [b'1', 0, 200, 10], "a.xyz:1: expected text, found binary data"),
        alone("control characters", "a.xyz", "1 2 \u{1b}[31m\n",
            "a.xyz:1: expected a number for z, found \"\\u{1b}[31m\""),
    ]
}

#[rustfmt::skip] // One row per line.
pub fn arrays() -> Vec<Row> {
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
        npy("empty", vec![],
            "a.npy: header (byte 0): expected 8 bytes of magic and version, found end of file"),
        npy("not NumPy", b"PK\x03\x04 an npz archive".to_vec(),
            "a.npy: header (byte 0): expected a NumPy file, found \"PK\\u{3}\\u{4} a\""),
        npy("unknown version", patched(good.clone(), 6, &[9]),
            "a.npy: header (byte 0): expected NumPy format 1, 2 or 3, found 9"),
        npy("header cut", good[..60].to_vec(),
            "a.npy: header (byte 10): expected a header of 118 bytes, found 50 bytes"),
        npy("data cut", good[..good.len() - 8].to_vec(),
            "a.npy: header (byte 128): expected 4 rows of 24 bytes, found 88 bytes"),
        npy("complex numbers", of("'<c8'", "False", "(2, 3)"),
            "a.npy: header (byte 10): expected numbers, or fields called x, y and z, found \"<c8\""),
        npy("records", of("[('x', '<f8')]", "False", "(2,)"),
            "a.npy: header (byte 10): expected fields of numbers called x, y and z, found \"[('x', '<f8')]\""),
        npy("two columns", of("'<f8'", "False", "(3, 2)"),
            "a.npy: header (byte 10): expected an array of shape (n, 3), found \"(3, 2)\""),
        npy("no order", of("'<f8'", "None", "(2, 3)"),
            "a.npy: header (byte 10): expected fortran_order True or False, found \"None\""),
        npy("2^62 rows", of("'<f8'", "False", "(4611686018427387904, 3)"),
            "a.npy: header (byte 88): expected 4611686018427387904 rows of 24 bytes, found 48 bytes"),
        npy("nothing in the header", header("{}"),
            "a.npy: header (byte 10): expected numbers, or fields called x, y and z, found \"\""),
    ]
}

#[rustfmt::skip] // One row per line.
pub fn paths() -> Vec<Row> {
    vec![
        row("missing", vec![], "nothing.ply", "nothing.ply: expected a file or folder, found nothing"),
        row("empty folder", vec![("project/", vec![])], "project",
            "project: expected points3D.bin or points3D.txt in it, or in sparse, model, models, colmap/sparse or a numbered folder of these, found none"),
        alone("unknown extension", "a.laz", "LASF",
            "a.laz: expected a COLMAP folder, a map of OpenSfM, nerfstudio, Bundler or NVM, or a .ply, .csv, .xyz, .txt, .asc, .pts, .npy, .npz or .splat file, found a .laz file (convert it: CloudCompare -O in.laz -SAVE_CLOUDS, or pdal translate in.laz out.ply)"),
        alone("images given by themselves", "images.bin", "",
            "images.bin: expected a file with points, found another file of a COLMAP model (give its folder)"),
        alone("a database", "database.db", "SQLite format 3",
            "database.db: expected a COLMAP folder, a map of OpenSfM, nerfstudio, Bundler or NVM, or a .ply, .csv, .xyz, .txt, .asc, .pts, .npy, .npz or .splat file, found a .db file"),
    ]
}
