//! Tests scans: LAS, PCD, E57.

#[path = "../made/mod.rs"]
mod made;

use unlift_io::read::{self, Input};

use super::write;
use made::POINTS;

/// The doubt about one point of four.
const NO_PLACE: &str = "1 of 4 points have no place: what is audited is not the whole map";

fn same(input: &Input, format: &str, tolerance: f64) {
    assert_eq!((input.format, input.positions.len()), (format, 3));
    for (found, expected) in input.positions.iter().zip(POINTS) {
        super::close(*found, expected, tolerance);
    }
}

#[test]
fn las_of_every_version_and_size_of_points() {
    for (minor, record) in [(0, 20), (2, 20), (3, 34), (4, 20), (4, 25)] {
        let (_dir, path) = write("a.LAS", made::las(minor, record));
        let input = read::open(&path).unwrap();
        same(&input, "LAS", 1e-9);
        assert!(input.notes.is_empty() && input.files == [path], "{minor} {record}");
    }
}

#[test]
fn pcd_reads_the_same_in_every_form() {
    for (data, format) in
        [("ascii", "PCD ascii"), ("binary", "PCD binary"), ("binary_compressed", "PCD compressed")]
    {
        let (_dir, path) = write("a.pcd", made::pcd(data));
        let input = read::open(&path).unwrap();
        same(&input, format, 0.0);
        assert_eq!((input.ids, input.left_out), (vec![0, 2, 3], vec![1]), "{data}");
        assert_eq!(input.doubts, [NO_PLACE], "{data}");
    }
}

#[test]
fn e57_brings_its_scans_into_one_frame() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.e57");
    made::e57(&path);
    let input = read::open(&path).unwrap();
    same(&input, "E57", 1e-12);
    assert_eq!(input.notes, ["read, all 2 scans, in one frame"]);
    assert_eq!(input.doubts, [NO_PLACE]);
}

#[test]
fn e57_turns_by_quaternions_of_any_length_but_zero() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.e57");
    made::e57(&path);
    let file = std::fs::read(&path).unwrap();
    // Replaces both numbers of the quaternion, with as many digits.
    let half = 0.5_f64.sqrt().to_string();
    let to = |x: f64| made::e57_with(file.clone(), &half, &format!("{x:.*}", half.len() - 2));
    let expected = read::open(&path).unwrap().positions;
    std::fs::write(&path, to(4.0)).unwrap();
    for (found, expected) in read::open(&path).unwrap().positions.iter().zip(expected) {
        super::close(*found, expected, 1e-12);
    }
    std::fs::write(&path, to(0.0)).unwrap();
    let notes = read::open(&path).unwrap().notes;
    assert_eq!(notes[0], "scan 2: the rotation is zero and is ignored");
}

#[test]
fn degrees_of_las_are_told() {
    let wkt = b"GEOGCS[\"WGS 84\",UNIT[\"degree\",0.0174532925199433]]\0".to_vec();
    let keys = |keys: &[[u16; 4]]| {
        let all = [[1, 1, 0, keys.len() as u16]]
            .iter()
            .chain(keys)
            .flatten()
            .copied()
            .collect::<Vec<_>>();
        all.iter().flat_map(|key| key.to_le_bytes()).collect::<Vec<_>>()
    };
    for (id, record, is_geographic) in [
        (2112, wkt.clone(), true),
        (2112, [b"PROJCS[\"UTM\",".as_slice(), &wkt, b"]"].concat(), false),
        (34735, keys(&[[1024, 0, 1, 2], [2048, 0, 1, 4326]]), true),
        (34735, keys(&[[2048, 0, 1, 4326]]), true),
        (34735, keys(&[[1024, 0, 1, 1], [2048, 0, 1, 4326], [3072, 0, 1, 32632]]), false),
        (7, wkt.clone(), false),
    ] {
        for minor in [2, 4] {
            for long in [false, true] {
                let (_dir, path) = write("a.las", made::las_with(minor, id, &record, long));
                let input = read::open(&path).unwrap();
                let expected = is_geographic && (minor == 4 || !long);
                // Old files have no records after their points: extra data may be points.
                let n_doubts = usize::from(expected) + usize::from(minor == 2 && long);
                assert_eq!(
                    (input.is_geographic, input.doubts.len()),
                    (expected, n_doubts),
                    "{id} {minor} {long}"
                );
                assert_eq!(input.positions.len(), 3);
            }
        }
    }
}

#[test]
fn files_with_more_points_than_they_declare_are_doubted() {
    let doubts = |name: &str, bytes: Vec<u8>| {
        let (_dir, path) = write(name, bytes);
        read::open(&path).unwrap().doubts
    };
    for (minor, at) in [(2, 107), (4, 247)] {
        let mut file = made::las(minor, 34);
        assert!(doubts("a.las", file.clone()).is_empty(), "{minor}");
        file[at] = 1;
        assert_eq!(doubts("a.las", file.clone()).len(), 1, "{minor}");
        if minor == 4 {
            // The header declares records of another kind after the points.
            let end = file.len() - 2 * 34;
            file[235..243].copy_from_slice(&(end as u64).to_le_bytes());
            assert!(doubts("a.las", file).is_empty(), "{minor}");
        }
    }
    let text = made::pcd("binary");
    assert_eq!(doubts("a.pcd", text.clone()), [NO_PLACE]);
    let at = text.windows(8).position(|word| word == b"POINTS 4").unwrap();
    let mut less = text;
    less[at + 7] = b'2';
    let less = doubts("a.pcd", less);
    assert!(less[0].starts_with("2 points are declared, and 2 more seem to follow"), "{less:?}");
}

/// It must not allocate memory of that size.
#[test]
fn a_file_with_holes_is_one_line() {
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 200000000000\nproperty float x\n\
                property float y\nproperty float z\nend_header\n";
    let (_dir, path) = write("a.ply", head);
    let file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
    // Some file systems do not support such files.
    if file.set_len(head.len() as u64 + 12 * 200_000_000_000).is_ok() {
        let error = read::open(&path).unwrap_err().to_string();
        assert!(error.contains("expected data that fits into memory, found "), "{error}");
    }
}

/// Writes the files for `fuzz/seeds`: a byte with the kind, which the target `points` reads, and
/// the scan.
#[test]
#[ignore = "writes seeds of fuzzing into the folder UNLIFT_SEEDS"]
fn seeds_of_fuzzing() {
    let folder = std::path::PathBuf::from(std::env::var_os("UNLIFT_SEEDS").expect("UNLIFT_SEEDS"));
    let put = |name: &str, kind: u8, bytes: Vec<u8>| {
        std::fs::write(folder.join(name), [vec![kind], bytes].concat()).unwrap();
    };
    put("las-1.2", 7, made::las(2, 20));
    put("las-1.4", 7, made::las(4, 25));
    for data in ["ascii", "binary", "binary_compressed"] {
        put(&format!("pcd-{data}"), 8, made::pcd(data));
    }
    let dir = tempfile::tempdir().unwrap();
    made::e57(&dir.path().join("a.e57"));
    put("e57", 9, std::fs::read(dir.path().join("a.e57")).unwrap());
}
