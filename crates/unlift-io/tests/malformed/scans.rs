//! Malformed scans.

#[path = "../made/mod.rs"]
mod made;

use std::path::Path;

pub use made::sealed;

use super::{MANY, Row, alone, patched};

pub fn e57_file() -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.e57");
    made::e57(&path);
    std::fs::read(&path).unwrap()
}

/// E57 of points in steps of a half whose value is 7 to `most`: a bit per coordinate, or none.
fn of_steps(most: i64) -> Vec<u8> {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.e57");
    let mut writer = E57Writer::from_file(&path, "file").unwrap();
    let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let data_type = RecordDataType::ScaledInteger { min: 7, max: 8, scale: 0.5, offset: 0.0 };
    let record = |name| Record { name, data_type: data_type.clone() };
    let mut scan = writer.add_pointcloud("a", names.map(record).to_vec()).unwrap();
    scan.add_point(vec![RecordValue::ScaledInteger(7); 3]).unwrap();
    scan.finalize().unwrap();
    drop(scan);
    writer.finalize().unwrap();
    let file = std::fs::read(&path).unwrap();
    made::e57_with(file, "maximum=\"8\"", &format!("maximum=\"{most}\""))
}

pub fn write_all(folder: &Path) -> [&'static str; 5] {
    let put = |name: &str, bytes: Vec<u8>| std::fs::write(folder.join(name), bytes).unwrap();
    put("a.las", made::las(2, 20));
    put("ascii.pcd", made::pcd("ascii"));
    put("binary.pcd", made::pcd("binary"));
    put("compressed.pcd", made::pcd("binary_compressed"));
    put("a.e57", e57_file());
    ["a.las", "ascii.pcd", "binary.pcd", "compressed.pcd", "a.e57"]
}

#[rustfmt::skip] // One row per line.
pub fn las() -> Vec<Row> {
    let file = || made::las(2, 20);
    let las = |what, bytes: Vec<u8>, line| alone(what, "a.las", bytes, line);
    vec![
        las("another file", vec![b'x'; 200],
            "a.las: header (byte 0): expected \"LASF\", as every LAS file begins, found \"xxxx\""),
        las("version 2", patched(file(), 24, &[2]), "a.las: header (byte 0): expected LAS 1.0 to 1.4, found 2.2"),
        las("compressed", patched(file(), 104, &[0x80]),
            "a.las: header (byte 0): expected uncompressed points, found compressed points, LAZ (convert it: pdal translate IN.laz OUT.las)"),
        las("format 11", patched(file(), 104, &[11]),
            "a.las: header (byte 0): expected a point format from 0 to 10, found 11"),
        las("points too small for their format", patched(file(), 104, &[3]),
            "a.las: header (byte 0): expected points of at least 34 bytes, as format 3 has them, found 20"),
        las("points in the head", patched(file(), 96, &[0; 4]),
            "a.las: header (byte 0): expected points after the header of 179 bytes, found at byte 0"),
        las("count of 10^18", patched(made::las(4, 20), 247, &MANY),
            "a.las: header (byte 435): expected 1000000000000000000 points, 20 bytes each, found 60 bytes"),
        las("no points", patched(file(), 107, &[0; 4]), "a.las: expected at least one point, found none"),
    ]
}

#[rustfmt::skip] // One row per line.
pub fn pcd() -> Vec<Row> {
    let head = |from: &str, to: &str, data: &str| made::pcd_head(2, data).replace(from, to);
    let pcd = |what, text: String, line| alone(what, "a.pcd", text, line);
    let binary = |n: &str, bytes: usize| {
        [head("POINTS 2", &format!("POINTS {n}"), "binary").into_bytes(), vec![0; bytes]].concat()
    };
    let packed = |size: u32, bytes: &[u8]| {
        let sizes = [(bytes.len() as u32).to_le_bytes(), size.to_le_bytes()].concat();
        [head("", "", "binary_compressed").into_bytes(), sizes, bytes.to_vec()].concat()
    };
    let size = 2 * made::PCD_STRIDE as u32;
    vec![
        pcd("empty", String::new(), "a.pcd:1: expected a PCD header that ends with DATA, found end of file"),
        pcd("another file", "solid cube\n".into(), "a.pcd:1: expected a line of a PCD header, found \"solid cube\""),
        pcd("unknown form", head("", "", "zip"),
            "a.pcd:11: expected DATA ascii, binary or binary_compressed, found \"DATA zip\""),
        pcd("fewer types", head("TYPE F U F F I", "TYPE F U", "ascii"),
            "a.pcd: header: expected as many FIELDS as SIZE, TYPE and COUNT, found 5, 5, 2 and 5"),
        pcd("no z", head("FIELDS x rgb y z", "FIELDS x rgb y w", "ascii"),
            "a.pcd: header: expected a field z, found none"),
        pcd("unknown type", head("TYPE F", "TYPE X", "ascii"),
            "a.pcd: header: expected one value of type F, I or U for x, found X 4 1"),
        pcd("no count", head("POINTS 2\n", "", "ascii").replace("WIDTH 2\n", ""),
            "a.pcd: header: expected POINTS, or WIDTH and HEIGHT, found neither"),
        pcd("points of 2^66 bytes", head("COUNT 1 1 1 1 2", "COUNT 1 9223372036854775807 9223372036854775807 1 1", "binary"),
            "a.pcd: header: expected points of less than 2^64 bytes, found more"),
        pcd("ascii: count of 10^18", head("POINTS 2", "POINTS 1000000000000000000", "ascii"),
            "a.pcd: header: expected at most 0 points (by the size of the file), found 1000000000000000000"),
        pcd("ascii: too few", head("", "", "ascii") + "0.00 1 0.00 0.00 1 2\n# and that is all of it\n",
            "a.pcd:14: expected point 2 of 2, found end of file"),
        pcd("ascii: not a number", head("POINTS 2", "POINTS 1", "ascii") + "zero 1 0 0 1 2\n",
            "a.pcd:12: expected a number for a coordinate, found \"zero\""),
        pcd("no points, each of 2^62 bytes", head("COUNT 1 1 1 1 2", "COUNT 1 1000000000000000000 1 1 2", "binary").replace("POINTS 2", "POINTS 0"),
            "a.pcd: expected at least one point, found none"),
        alone("binary: count of 10^18", "a.pcd", binary("1000000000000000000", 24),
            "a.pcd: header (byte 205): expected 1000000000000000000 points, 24 bytes each, found 24 bytes"),
        alone("compressed: another size", "a.pcd", packed(size - 1, &[0, 0]),
            "a.pcd: header (byte 202): expected 2 points, 24 bytes each, found 47 bytes"),
        alone("compressed: damaged", "a.pcd", packed(size, &[0, 0]),
            "a.pcd: header (byte 206): expected 48 bytes after decompression, found another size, or damaged data"),
    ]
}

#[rustfmt::skip] // One row per line.
pub fn e57() -> Vec<Row> {
    let e57 = |what, bytes: Vec<u8>, line| alone(what, "a.e57", bytes, line);
    let file = e57_file;
    vec![
        e57("empty", vec![], "a.e57: header: expected \"ASTM-E57\", as every E57 file begins, found end of file"),
        e57("another file", vec![b'x'; 64], "a.e57: header: expected \"ASTM-E57\", as every E57 file begins, found something else"),
        e57("XML of 10^18 bytes", patched(file(), 32, &MANY),
            Box::leak(format!("a.e57: header: expected an XML part of at most {} bytes (by the size of the file), found 1000000000000000000", file().len()).into_boxed_str())),
        e57("values for which no byte stands", of_steps(7),
            "a.e57: scan 1: expected points with a value that takes a bit, found none"),
        e57("a byte of the points changed", patched(file(), 100, &[0xaa, 0xbb]),
            "a.e57: expected an E57 file, found Failed to read E57: File appears to be truncated: cannot read 2581 bytes of XML data: Detected invalid checksum (expected: [85, 54, 18, 217], actual: [139, 151, 219, 98]) for page 0"),
    ]
}
