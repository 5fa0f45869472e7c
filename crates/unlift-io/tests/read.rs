//! Valid files: what pycolmap and NumPy wrote is what is read.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use unlift::descriptors::Values;
use unlift_io::read::{self, Input, colmap};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn write(name: &str, contents: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, contents).unwrap();
    (dir, path)
}

fn read_text(name: &str, text: impl AsRef<[u8]>) -> Vec<[f64; 3]> {
    let (_dir, path) = write(name, text);
    read::open(&path).unwrap().positions
}

#[test]
fn binary_and_text_models_are_equal() {
    let (bin, txt) = (data("rig-bin"), data("rig-txt"));
    let file = |folder: &Path, name: &str, e: &str| folder.join(format!("{name}.{e}"));
    let cameras = colmap::read_cameras(&file(&bin, "cameras", "bin")).unwrap();
    assert_eq!(cameras, colmap::read_cameras(&file(&txt, "cameras", "txt")).unwrap());
    let ids: Vec<i32> = cameras.iter().map(|c| c.model.id).collect();
    assert_eq!(ids, (0..18).collect::<Vec<_>>(), "one camera of every model");

    let images = colmap::read_images(&file(&bin, "images", "bin")).unwrap();
    assert_eq!(images, colmap::read_images(&file(&txt, "images", "txt")).unwrap());
    assert_eq!(images[0].name, "küche/ä 0.jpg".as_bytes());
    assert_eq!(images[0].n_points2d, 4);

    let points = colmap::read_points(&file(&bin, "points3D", "bin"), true).unwrap();
    let same = colmap::read_points(&file(&txt, "points3D", "txt"), true).unwrap();
    assert_eq!(points, same);
    assert_eq!(points.ids, [1, 3, 5, 7, 12, 44, 900, 1 << 40]);
    assert_eq!(points.tracks.unwrap().row(1), [(2, 1), (3, 0), (4, 0)]);

    for (folder, extension) in [(&bin, "bin"), (&txt, "txt")] {
        let rigs = colmap::check_rigs(&file(folder, "rigs", extension));
        let frames = colmap::check_frames(&file(folder, "frames", extension));
        assert_eq!((rigs.unwrap(), frames.unwrap()), (17, 18));
    }
}

#[test]
fn model_folders_open_with_centers_ids_and_files() {
    let bin = read::open(&data("rig-bin")).unwrap();
    let txt = read::open(&data("rig-txt")).unwrap();
    assert_eq!(bin.positions, txt.positions);
    assert_eq!(bin.cameras, txt.cameras);
    assert_eq!((bin.format, txt.format), ("COLMAP binary", "COLMAP text"));
    assert_eq!((bin.files.len(), txt.files.len()), (5, 5));
    assert_eq!((&bin.skipped, &txt.skipped), (&vec![], &vec![]));
    assert_eq!((bin.database, bin.positions.len()), (None, 8));
    // pycolmap: `image.projection_center()` of image 20, the last; the sum of `point3D.xyz`.
    let center = [-0.18425494062287595, 0.11058267526290974, 0.11110621415901362];
    close(*bin.cameras.last().unwrap(), center, 1e-12);
    let sum = [-14.46619668331794, -9.942024018235283, -17.581669871119047];
    close(total(&bin.positions), sum, 1e-12);
}

fn total(rows: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|axis| rows.iter().map(|p| p[axis]).sum())
}

fn close(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let near = |(a, b): (f64, f64)| (a - b).abs() <= tolerance;
    let all = found.into_iter().zip(expected).all(near);
    assert!(all, "{found:?}, expected {expected:?}");
}

#[test]
fn a_project_folder_leads_to_its_model_and_database() {
    let project = data("project");
    let input = read::open(&project).unwrap();
    assert_eq!(input.ids, [2, 3, 4, 6, 9, 11]);
    assert_eq!(input.cameras.len(), 3);
    assert_eq!(input.model, Some(project.join("sparse/0")));
    assert_eq!(input.database, Some(project.join("database.db")));
    assert_eq!(input.files.len(), 3, "the classic layout: {:?}", input.files);
    let direct = read::open(&project.join("sparse/0")).unwrap();
    assert_eq!(direct.positions, input.positions);
    let alone = read::open(&project.join("sparse/0/points3D.bin")).unwrap();
    assert_eq!((&alone.positions, &alone.ids), (&input.positions, &input.ids));
}

#[test]
fn what_lies_beside_the_model_is_noted_or_ignored() {
    let dir = tempfile::tempdir().unwrap();
    for (from, to) in [("rig-bin", "sparse/0"), ("rig-txt", "sparse/0"), ("rig-bin", "sparse/1")] {
        let to = dir.path().join(to);
        fs::create_dir_all(&to).unwrap();
        for file in fs::read_dir(data(from)).unwrap() {
            let file = file.unwrap();
            fs::copy(file.path(), to.join(file.file_name())).unwrap();
        }
    }
    fs::write(dir.path().join("sparse/0/rigs.bin"), b"\x01").unwrap();
    let input = read::open(dir.path()).unwrap();
    assert_eq!(input.format, "COLMAP binary");
    let notes = input.skipped.join("\n");
    let notes = notes.replace(dir.path().to_str().unwrap(), "");
    assert_eq!(
        notes.replace('\\', "/"),
        "/sparse/0/rigs.bin: header (byte 0): expected 8 bytes of the number of rigs, \
         found 1 byte before the end of the file\n\
         points3D.txt: the binary form beside it was read\n\
         sparse/0: read, the largest of 2 models (8 points)\n\
         sparse/1: another model (8 points), give its path to read it"
    );
}

/// A copy of the fixture `from` at `to` in `root`.
fn copy(from: &str, root: &Path, to: &str) {
    let to = root.join(to);
    fs::create_dir_all(&to).unwrap();
    for file in fs::read_dir(data(from)).unwrap() {
        let file = file.unwrap();
        fs::copy(file.path(), to.join(file.file_name())).unwrap();
    }
}

#[test]
fn models_are_found_where_programs_put_them() {
    for place in [
        "",
        "0",
        "sparse",
        "sparse/0",
        "sparse/3",
        "model",
        "models/0",
        "models/2",
        "colmap",
        "colmap/sparse",
        "colmap/sparse/0",
    ] {
        for (fixture, format) in [("rig-bin", "COLMAP binary"), ("rig-txt", "COLMAP text")] {
            let dir = tempfile::tempdir().unwrap();
            copy(fixture, dir.path(), place);
            let input = read::open(dir.path()).unwrap();
            assert_eq!((input.format, input.positions.len()), (format, 8), "{place}");
            assert_eq!(input.model, Some(dir.path().join(place)), "{place}");
            assert_eq!(input.skipped, [""; 0], "{place}");
        }
    }
}

#[test]
fn of_several_models_the_largest_is_read_and_told() {
    // As hloc leaves models that it did not choose, and COLMAP models that it could not join.
    let dir = tempfile::tempdir().unwrap();
    copy("project/sparse/0", dir.path(), "sparse/0");
    copy("rig-txt", dir.path(), "sparse/10");
    copy("project/sparse/0", dir.path(), "models/2");
    fs::create_dir_all(dir.path().join("sparse/11")).unwrap();
    let input = read::open(dir.path()).unwrap();
    assert_eq!((input.format, input.positions.len()), ("COLMAP text", 8));
    assert_eq!(
        input.skipped,
        [
            "sparse/10: read, the largest of 3 models (8 points)",
            "sparse/0: another model (6 points), give its path to read it",
            "models/2: another model (6 points), give its path to read it",
        ]
    );
    // The folder that was named is meant, be it smaller: hloc's best one stands there.
    copy("project/sparse/0", dir.path(), "");
    let input = read::open(dir.path()).unwrap();
    assert_eq!(input.positions.len(), 6);
    assert_eq!(
        input.skipped[0],
        "the model of the folder itself: read, the first of 4 models (6 points)"
    );
}

#[test]
fn the_database_of_a_project_is_found_from_its_model_as_well() {
    for (project, model, database) in [
        ("", "sparse/0", "database.db"),
        ("", "colmap/sparse/0", "colmap/database.db"),
        ("sparse/0", "sparse/0", "database.db"),
        ("sparse", "sparse", "database.db"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        copy("project/sparse/0", dir.path(), model);
        fs::copy(data("project/database.db"), dir.path().join(database)).unwrap();
        let input = read::open(&dir.path().join(project)).unwrap();
        let found = fs::canonicalize(input.database.unwrap()).unwrap();
        assert_eq!(found, fs::canonicalize(dir.path().join(database)).unwrap(), "{model}");
    }
}

#[test]
fn names_need_not_be_utf8() {
    let bytes = fs::read(data("project/sparse/0/images.bin")).unwrap();
    let name = "küche/ä 0.jpg".as_bytes();
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap();
    let mut bytes = bytes;
    bytes[at] = 0xff;
    let (_dir, path) = write("images.bin", bytes);
    let images = colmap::read_images(&path).unwrap();
    assert_eq!(images[0].name[0], 0xff);
}

#[test]
fn text_models_may_have_no_2d_points_and_windows_line_ends() {
    let text = "# c\r\n1 1 0 0 0 1 2 3 1 a b.jpg\r\n\r\n2 1 0 0 0 4 5 6 1 c.jpg\r\n";
    let (_dir, path) = write("images.txt", text);
    let images = colmap::read_images(&path).unwrap();
    assert_eq!(images[0].name, b"a b.jpg");
    assert_eq!(images[0].center, [-1.0, -2.0, -3.0]);
    assert_eq!((images[1].name.as_slice(), images[1].n_points2d), (&b"c.jpg"[..], 0));
}

const POINTS: [[f64; 3]; 2] = [[0.5, -1.25, 3.0], [1e6, 2.0, -0.0625]];

fn ply(encoding: &str, real: &str, row: impl Fn(&mut Vec<u8>, [f64; 3])) -> Vec<u8> {
    let mut file = format!(
        "ply\nformat {encoding} 1.0\ncomment made by hand\nelement camera 1\nproperty short id\n\
         element vertex 2\nproperty uchar red\nproperty {real} x\nproperty {real} y\n\
         property {real} z\nproperty int label\nelement face 1\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    match encoding {
        "ascii" => file.extend(b"7\n"),
        _ => file.extend([0, 7]),
    }
    for point in POINTS {
        row(&mut file, point);
    }
    match encoding {
        "ascii" => file.extend(b"3 0 1 0\n"),
        _ => file.extend([1, 0, 0, 0, 0]),
    }
    file
}

#[test]
fn ply_reads_the_same_in_every_form() {
    type Row = fn(&mut Vec<u8>, [f64; 3]);
    fn binary(file: &mut Vec<u8>, values: impl Iterator<Item = Vec<u8>>) {
        file.push(255);
        values.for_each(|v| file.extend(v));
        file.extend([1, 2, 3, 4]);
    }
    let forms: [(&str, &str, Row); 6] = [
        ("ascii", "float", |f, [x, y, z]| {
            f.extend(format!("255 {x} {y} {z:e} 4\n").bytes());
        }),
        ("ascii", "double", |f, [x, y, z]| {
            f.extend(format!("255\t{x}  {y} {z} -4 \r\n").bytes());
        }),
        ("binary_little_endian", "float", |f, p| {
            binary(f, p.iter().map(|&x| (x as f32).to_le_bytes().to_vec()));
        }),
        ("binary_little_endian", "float64", |f, p| {
            binary(f, p.iter().map(|x| x.to_le_bytes().to_vec()));
        }),
        ("binary_big_endian", "float32", |f, p| {
            binary(f, p.iter().map(|&x| (x as f32).to_be_bytes().to_vec()));
        }),
        ("binary_big_endian", "double", |f, p| {
            binary(f, p.iter().map(|x| x.to_be_bytes().to_vec()));
        }),
    ];
    for (encoding, real, row) in forms {
        let (_dir, path) = write("a.PLY", ply(encoding, real, row));
        let input = read::open(&path).unwrap();
        assert_eq!(input.positions, POINTS, "{encoding} {real}");
        assert_eq!(input.ids, [0, 1]);
        assert_eq!(input.format, format!("ply {}", encoding.replace('_', " ")));
    }
}

#[test]
fn ply_written_by_pycolmap_holds_the_model() {
    let cloud = read::open(&data("cloud.ply")).unwrap();
    let model = read::open(&data("rig-bin")).unwrap();
    assert_eq!(cloud.positions.len(), 8);
    // In `float`: 16 times the rounding of the largest coordinate, 15.
    close(total(&cloud.positions), total(&model.positions), 1e-5);
}

#[test]
fn tables_read_the_same_in_every_form() {
    for text in [
        "0.5,-1.25,3\n1e6,2,-0.0625\n",
        "0.5, -1.25, 3, 17, red\n1e6, 2, -0.0625, 18, blue",
        "0.5;-1.25;3\r\n1000000;2;-0.0625\r\n",
        "0.5 -1.25   3\n\n  1e6\t2 -0.0625\n",
        "# x y z\n// X,Y,Z\n0.5\t-1.25\t3\n1e6\t2\t-0.0625\n",
        "id,Z,\"Y\",x\n7,3,-1.25,0.5\n# between\n8,-0.0625,2,1e6\n",
        "name\tx\ty\tz\n\t0.5\t-1.25\t3\nb c\t1e6\t2\t-0.0625\n",
        "X Y Z R G B\n0.5 -1.25 3 1 2 3\n1e6 2 -0.0625 1 2 3\n",
        "\u{feff}x;y;z\n0.5;-1.25;3\n1e6;2;-0.0625\n",
    ] {
        for name in ["a.csv", "a.xyz", "a.TXT"] {
            assert_eq!(read_text(name, text), POINTS, "{text:?}");
        }
    }
}

#[test]
fn arrays_read_the_same_in_every_form() {
    let expected: Vec<[f64; 3]> =
        (0..4).map(|row| std::array::from_fn(|column| (3 * row + column) as f64 / 8.0)).collect();
    for name in ["f8.npy", "f4-big-endian.npy", "f8-fortran.npy"] {
        assert_eq!(read::open(&data(name)).unwrap().positions, expected, "{name}");
    }
}

#[test]
fn descriptors_through_the_tracks_are_those_of_the_binary_form() {
    let input = read::open(&data("project")).unwrap();
    let joined = read::descriptors(&data("project/descriptors.bin"), &input).unwrap();
    assert_eq!((joined.len(), joined.dim()), (6, 128));
    let mean = read::descriptors(input.database.as_ref().unwrap(), &input).unwrap();
    assert_eq!(mean, joined);
}

#[test]
fn descriptors_follow_the_ids_of_the_input() {
    let all = read::open(&data("project")).unwrap();
    let some = Input {
        ids: vec![all.ids[4], all.ids[1]],
        positions: vec![all.positions[4], all.positions[1]],
        ..all.clone()
    };
    for file in ["descriptors.bin", "database.db", "floats.db"] {
        let path = data("project").join(file);
        let expected = read::descriptors(&path, &all).unwrap().select(&[4, 1]);
        assert_eq!(read::descriptors(&path, &some).unwrap(), expected, "{file}");
    }
}

/// The descriptors of the project as floats: of norm 1, so that halves hold them too.
fn unit_floats(input: &Input) -> Vec<f32> {
    let bytes = read::descriptors(&data("project/descriptors.bin"), input).unwrap();
    let Values::U8(bytes) = bytes.values() else { panic!("bytes expected") };
    bytes.iter().map(|&byte| f32::from(byte) / 512.0).collect()
}

/// The head of a file of the form `P3DESC01` for points `ids` in this order.
fn p3desc(ids: &[u64], dtype: u32) -> Vec<u8> {
    let mut file = b"P3DESC01".to_vec();
    file.extend((ids.len() as u64).to_le_bytes());
    file.extend(128u32.to_le_bytes());
    file.extend(dtype.to_le_bytes());
    ids.iter().for_each(|id| file.extend(id.to_le_bytes()));
    file
}

#[test]
fn binary_descriptors_may_be_floats_of_16_or_32_bits() {
    let input = read::open(&data("project")).unwrap();
    let floats = unit_floats(&input);
    for dtype in [2, 3] {
        // One point more than the map has, and rows in another order: ids join.
        let mut file = p3desc(&[1000, 11, 9, 6, 4, 3, 2], dtype);
        let rows = std::iter::once(&[0.5; 128][..]).chain(floats.chunks(128).rev());
        for value in rows.flatten() {
            match dtype {
                2 => file.extend(half::f16::from_f32(*value).to_le_bytes()),
                _ => file.extend(value.to_le_bytes()),
            }
        }
        let (_dir, path) = write("d.bin", file);
        let read = read::descriptors(&path, &input).unwrap();
        assert_eq!(read.values(), &Values::F32(floats.clone()), "512ths of bytes fit a half");
    }
}

#[test]
fn arrays_of_descriptors_have_a_row_per_point_in_its_order() {
    let all = read::open(&data("project")).unwrap();
    let floats = unit_floats(&all);
    let expected = Values::F32(floats.clone());
    let array = |descr: &str, fortran: &str, values: Vec<u8>| {
        let text =
            format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': (6, 128), }}");
        let mut file = b"\x93NUMPY\x01\0".to_vec();
        file.extend(118u16.to_le_bytes());
        file.extend(format!("{text:117}\n").bytes());
        file.extend(values);
        write("d.npy", file)
    };
    let bytes = |of: fn(f32) -> Vec<u8>| floats.iter().flat_map(|&x| of(x)).collect::<Vec<u8>>();
    for (descr, values) in [
        ("<f2", bytes(|x| half::f16::from_f32(x).to_le_bytes().to_vec())),
        (">f2", bytes(|x| half::f16::from_f32(x).to_be_bytes().to_vec())),
        ("<f4", bytes(|x| x.to_le_bytes().to_vec())),
        (">f8", bytes(|x| f64::from(x).to_be_bytes().to_vec())),
    ] {
        let (_dir, path) = array(descr, "False", values);
        assert_eq!(read::descriptors(&path, &all).unwrap().values(), &expected, "{descr}");
    }
    let columns = (0..128).flat_map(|c| floats.chunks(128).map(move |row| row[c]));
    let (_dir, path) = array("<f4", "True", columns.flat_map(f32::to_le_bytes).collect());
    assert_eq!(read::descriptors(&path, &all).unwrap().values(), &expected, "by columns");
    let of_bytes = read::descriptors(&data("project/descriptors.bin"), &all).unwrap();
    let Values::U8(values) = of_bytes.values() else { panic!("bytes expected") };
    let (_dir, path) = array("|u1", "False", values.clone());
    assert_eq!(read::descriptors(&path, &all).unwrap(), of_bytes);
}

#[test]
fn float_descriptors_keep_their_type_and_get_norm_1() {
    let input = read::open(&data("project")).unwrap();
    let floats = read::descriptors(&data("project/floats.db"), &input).unwrap();
    assert_eq!((floats.len(), floats.dim()), (6, 4));
    let Values::F32(values) = floats.values() else {
        panic!("floats expected");
    };
    for row in values.chunks(4) {
        let norm2: f32 = row.iter().map(|x| x * x).sum();
        // Four values rounded to 24 bits.
        assert!((norm2 - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_database_without_types_is_read_as_bytes() {
    let dir = tempfile::tempdir().unwrap();
    // A name that a URI would misread.
    let path = dir.path().join("a?b#c%20 d.db");
    fs::copy(data("project/database.db"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    database.execute_batch("ALTER TABLE descriptors DROP COLUMN type").unwrap();
    database.close().unwrap();
    let input = read::open(&data("project")).unwrap();
    let expected = read::descriptors(&data("project/descriptors.bin"), &input).unwrap();
    assert_eq!(read::descriptors(&path, &input).unwrap(), expected);
    let left: Vec<_> = fs::read_dir(dir.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "reading writes no journal: {left:?}");
}

#[test]
fn a_database_in_write_ahead_mode_is_read_whole() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("database.db");
    fs::copy(data("project/database.db"), &path).unwrap();
    let writer = rusqlite::Connection::open(&path).unwrap();
    writer
        .execute_batch(
            "PRAGMA journal_mode=WAL; UPDATE images SET name = 'gone' WHERE image_id = 1",
        )
        .unwrap();
    let input = read::open(&data("project")).unwrap();
    let error = read::descriptors(&path, &input).unwrap_err().to_string();
    assert!(error.contains("no such image"), "the journal counts: {error}");
}
