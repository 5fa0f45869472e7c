//! Tests files that deviate from their format in common ways: they are read as intended, or the
//! error explains what they are.

use std::fs;
use std::path::Path;

use half::f16;
use unlift_io::read::{self, Input};

use super::{data, write};

const POINTS: [[f64; 3]; 3] = [[0.5, -1.25, 3.0], [1000.0, 2.0, -0.0625], [0.125, 0.25, 0.375]];

fn open(name: &str, contents: impl AsRef<[u8]>) -> Input {
    let (_dir, path) = write(name, contents);
    read::open(&path).unwrap()
}

fn refused(name: &str, contents: impl AsRef<[u8]>) -> String {
    let (dir, path) = write(name, contents);
    let line = read::open(&path).unwrap_err().to_string();
    line.replace(&format!("{}/", dir.path().display()), "")
}

fn table(head: &str, row: impl Fn(usize, [f64; 3]) -> String) -> String {
    let rows = POINTS.iter().enumerate().map(|(at, &point)| row(at, point) + "\n");
    head.to_owned() + &rows.collect::<String>()
}

#[test]
fn comments_name_the_columns_of_a_table() {
    for head in
        ["# id x y z\n", "//ID X Y Z\n", "# made by hand\n# columns: id X[m] Y[m] Z[m]\n# 3 rows\n"]
    {
        let text = table(head, |at, [x, y, z]| format!("{at} {x} {y} {z}"));
        assert_eq!(open("a.txt", text).positions, POINTS, "{head}");
    }
    let text = table("# nx,ny,nz,x,y,z\n", |_, [x, y, z]| format!("0,0,1,{x},{y},{z}"));
    assert_eq!(open("a.csv", text).positions, POINTS);
    let plain = |_, [x, y, z]: [f64; 3]| format!("{x} {y} {z}");
    for head in
        ["# the x y z of my room\n", "# made by hand in an hour or so\n", "//X Y Z\n3\n", "3\n"]
    {
        let input = open("a.asc", table(head, plain));
        assert_eq!((&input.positions[..], input.doubts.len()), (&POINTS[..], 0), "{head}");
    }
    // The comment has as many words as columns but no known names: read with a doubt.
    let input = open("a.xyz", table("# my first room\n", plain));
    assert!(
        input.doubts[0].starts_with("columns: the first three are read as"),
        "{:?}",
        input.doubts
    );
    let four = |at, [x, y, z]: [f64; 3]| format!("{at} {x} {y} {z}");
    for (head, expected) in [
        ("# id east north up\n", "columns named x, y and z, found \"id east north up\""),
        ("# time lat lon\n", "columns named x, y and z, found \"time lat lon\""),
        ("# id x y z label\n", "5 columns, as a comment names them, found \"id x y z label\""),
    ] {
        assert_eq!(
            refused("a.txt", table(head, four)).split_once("expected ").unwrap().1,
            expected
        );
    }
    let line = refused("a.txt", table("# lat lon alt\n", plain));
    assert!(line.contains("expected columns named x, y and z"), "{line}");
}

#[test]
fn a_count_before_points_is_that() {
    let row = |_, [x, y, z]: [f64; 3]| format!("{x} {y} {z} -100 1 2 3");
    let two = table("3\n", row) + &table("3\n", row);
    assert_eq!(open("a.pts", two).positions.len(), 6);
    let line = refused("a.pts", table("4\n", row));
    assert_eq!(
        line,
        "a.pts:4: expected 4 points, as declared in the line before them, found 3 up to here"
    );
}

#[test]
fn rows_that_are_no_points_are_refused() {
    let mut time = 0.0;
    let mut pose = |[x, y, z]: [f64; 3]| {
        time += 0.5;
        format!("{time} {x} {y} {z} 0 0 0.6 0.8\n")
    };
    let bare: String = POINTS.iter().map(|&point| pose(point)).collect();
    let named = format!("#timestamp tx ty tz qx qy qz qw\n{bare}");
    let commas = format!(
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n{}",
        bare.replace(' ', ",")
    );
    let kitti = "1 0 0 5 0 1 0 6 0 0 1 7\n0 -1 0 5 1 0 0 6 0 0 1 7\n".to_owned();
    for text in [bare, named, commas, kitti] {
        let line = refused("a.txt", &text);
        assert!(line.ends_with("found a trajectory, poses of cameras"), "{line}");
    }
    let numbered: String = (1..=20).map(|at| format!("{at} 0.5 {at} 3\n")).collect();
    let line = refused("a.xyz", numbered);
    assert!(line.ends_with("found the row number in the first column"), "{line}");
}

#[test]
fn points_of_colmap_are_known_under_any_name() {
    let text = fs::read_to_string(data("rig-txt/points3D.txt")).unwrap();
    let expected = read::open(&data("rig-txt")).unwrap();
    let rows: String = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| format!("{line}\n"))
        .collect();
    for text in [text, rows] {
        let input = open("cloud.txt", text);
        assert_eq!((input.format, &input.ids), ("COLMAP points", &expected.ids));
        assert_eq!(input.positions, expected.positions);
    }
    let images = fs::read(data("rig-txt/images.txt")).unwrap();
    assert!(refused("poses.txt", images).ends_with("found a trajectory, poses of cameras"));
}

#[test]
fn points_without_a_place_are_left_out_and_counted() {
    for none in ["nan", "-inf", "NaN", "-nan(ind)", "1.#QNAN", ""] {
        let mut text = "x,y,z\n".to_owned();
        for at in 0..40 {
            text +=
                &if at == 7 { format!("1,{none},3\n") } else { format!("{at},{at},{}\n", at * at) };
        }
        let input = open("a.csv", text);
        assert_eq!((input.positions.len(), input.n_rows()), (39, 40), "{none}");
        assert_eq!((input.ids[6], input.ids[7], input.left_out), (6, 8, vec![7]));
        assert_eq!(input.notes, ["1 of 40 points have no place"]);
        assert!(input.doubts.is_empty());
    }
    // More than 5 % of the points are a doubt.
    let text =
        table("", |at, [x, y, z]| if at == 0 { "nan 1 2".into() } else { format!("{x} {y} {z}") });
    let input = open("a.xyz", text);
    assert_eq!(input.doubts, ["1 of 3 points have no place: what is audited is not the whole map"]);
    assert_eq!(
        refused("a.xyz", "nan 1 2\n"),
        "a.xyz: expected a point with a place, found 1 without one"
    );
}

#[test]
fn descriptors_are_of_the_points_that_have_a_place() {
    let (_dir, path) = write("a.xyz", "0 0 1\nnan 0 1\n0 2 1\n3 0 1\n");
    let input = read::open(&path).unwrap();
    let text = "{'descr': '|u1', 'fortran_order': False, 'shape': (4, 2), }";
    let mut array = b"\x93NUMPY\x01\0".to_vec();
    array.extend((text.len() as u16).to_le_bytes());
    array.extend(text.bytes());
    array.extend([1, 2, 3, 4, 5, 6, 7, 8]);
    let (_dir, path) = write("d.npy", array);
    let descriptors = read::descriptors(&path, &input).unwrap();
    assert_eq!(descriptors.values(), &unlift::descriptors::Values::U8(vec![1, 2, 5, 6, 7, 8]));
}

#[test]
fn many_points_at_one_place_are_told() {
    let text: String = (0..30)
        .map(|at| if at % 2 == 0 { "0 -0.0 0\n".to_owned() } else { format!("{at} 1 2\n") })
        .collect();
    assert_eq!(
        open("a.xyz", text).notes,
        ["15 of 30 points are at exactly one place, [0.0, -0.0, 0.0]"]
    );
}

fn ply(vertex: &str, rows: &[u8]) -> Vec<u8> {
    let head = format!("ply\nformat binary_little_endian 1.0\n{vertex}end_header\n");
    [head.as_bytes(), rows].concat()
}

#[test]
fn ply_may_have_lists_and_integers_anywhere() {
    let head = "element face 2\nproperty list uchar int vertex_indices\nproperty uchar flag\n\
                element vertex 3\nproperty list ushort float before\nproperty short X\nproperty list uchar uchar between\n\
                property uint Y\nproperty char Z\n";
    let mut rows = vec![3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 9, 0, 9];
    for at in 0..3u8 {
        rows.extend(u16::from(at).to_le_bytes());
        rows.extend(vec![7; 4 * usize::from(at)]);
        rows.extend((-300 - i16::from(at)).to_le_bytes());
        rows.push(2 - at);
        rows.extend(vec![7; usize::from(2 - at)]);
        rows.extend((70_000 + u32::from(at)).to_le_bytes());
        rows.push(-(5 + at as i8) as u8);
    }
    let expected: Vec<[f64; 3]> =
        (0..3).map(|at| at as f64).map(|at| [-300.0 - at, 70_000.0 + at, -5.0 - at]).collect();
    assert_eq!(open("a.ply", ply(head, &rows)).positions, expected);
    let text = format!(
        "ply\nformat ascii 1.0\n{head}end_header\n3 0 1 2 9\n0 9\n0 -300 2 7 7 70000 -5\n1 7.5 -301 1 7 70001 -6\n2 7.5 7.5 -302 0 70002 -7\n"
    );
    assert_eq!(open("a.ply", &text).positions, expected);
    let line = refused("a.ply", text.replace("0 70002", "3 70002"));
    assert_eq!(line, "a.ply:17: expected 10 values of vertex 3, found 7");
    let endless = ply(
        "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty list uint int far\n",
        &[0xff; 16],
    );
    assert!(refused("a.ply", endless).contains("bytes of a list, found end of file"));
}

#[test]
fn of_splats_the_centers_are_read() {
    let names = ["x", "y", "z", "f_dc_0", "opacity", "scale_0", "rot_0"]
        .map(|name| format!("property float {name}\n"));
    let rows: Vec<u8> = POINTS
        .iter()
        .flat_map(|&[x, y, z]| [x, y, z, 0.0, 1.0, 1.0, 1.0])
        .flat_map(|x| (x as f32).to_le_bytes())
        .collect();
    let splats = ply(&format!("element vertex 3\n{}", names.concat()), &rows);
    let flat: Vec<u8> = POINTS
        .iter()
        .flat_map(|point| {
            let mut splat: Vec<u8> = point.iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
            splat.resize(32, 1);
            splat
        })
        .collect();
    for (name, bytes) in [("a.ply", splats), ("a.splat", flat)] {
        let input = open(name, bytes);
        assert_eq!((&input.positions[..], input.notes.len()), (&POINTS[..], 1));
        assert_eq!(input.notes, ["Gaussian splats: only their centers are read"]);
    }
}

fn npy(descr: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
    let head = [b"\x93NUMPY\x01\0".as_slice(), &(text.len() as u16).to_le_bytes(), text.as_bytes()];
    [&head.concat(), values].concat()
}

fn bytes<const N: usize>(
    values: impl IntoIterator<Item = f64>,
    of: impl Fn(f64) -> [u8; N],
) -> Vec<u8> {
    values.into_iter().flat_map(of).collect()
}

#[test]
fn arrays_may_have_more_columns_or_names() {
    let f4 = |x: f64| (x as f32).to_le_bytes();
    let six = bytes(POINTS.iter().flat_map(|&[x, y, z]| [x, y, z, 1.0, 2.0, 3.0]), f4);
    let input = open("a.npy", npy("'<f4'", "(3, 6)", &six));
    assert_eq!(input.positions, POINTS);
    assert_eq!(input.notes, ["the first 3 of 6 columns are read as x, y and z"]);
    let halves = bytes([0.5, 1.0, 2.0], |x| f16::from_f64(x).to_le_bytes());
    assert_eq!(open("a.npy", npy("'<f2'", "(1, 3)", &halves)).positions, [[0.5, 1.0, 2.0]]);
    let whole = bytes([-5.0, 1e6, 2.0], |x| (x as i64).to_le_bytes());
    assert_eq!(open("a.npy", npy("'<i8'", "(1, 3)", &whole)).positions, [[-5.0, 1e6, 2.0]]);

    let rows: Vec<u8> = POINTS
        .iter()
        .flat_map(|&[x, y, z]| {
            let mut row = vec![9, 9, 9];
            row.extend((z as f32).to_be_bytes());
            row.extend(x.to_le_bytes());
            row.extend([0; 8]);
            row.extend((y as f32).to_le_bytes());
            row
        })
        .collect();
    let descr = "[('rgb', '|u1', (3,)), ('Z', '>f4'), ('x', '<f8'), ('', '|V4'), ('s', '<U1'), ('y', '<f4')]";
    assert_eq!(open("a.npy", npy(descr, "(3,)", &rows)).positions, POINTS);
    let descr = "[('id', '<i4'), ('xyz', '<f4', (3,))]";
    let rows: Vec<u8> =
        POINTS.iter().flat_map(|point| [vec![1, 0, 0, 0], bytes(*point, f4)].concat()).collect();
    assert_eq!(open("a.npy", npy(descr, "(3,)", &rows)).positions, POINTS);
    let numbered = bytes((0..10).flat_map(|row| [f64::from(row), 5.0, 6.0, 7.0]), f4);
    assert!(refused("a.npy", npy("'<f4'", "(10, 4)", &numbered)).ends_with("found the row number"));
    assert!(
        refused("a.npy", npy("[('a', '<f4')]", "(1,)", &[0; 4]))
            .contains("fields of numbers called x, y and z")
    );
    assert!(
        refused("a.npy", npy("'<f4'", "(10, 128)", &[]))
            .contains("expected an array of shape (n, 3)")
    );
}

fn archive(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
    use std::io::Write;
    use zip::write::{SimpleFileOptions, ZipWriter};
    let mut out = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (at, (name, bytes)) in arrays.iter().enumerate() {
        let method = [zip::CompressionMethod::Stored, zip::CompressionMethod::Deflated][at % 2];
        let options = SimpleFileOptions::default().compression_method(method);
        out.start_file(format!("{name}.npy"), options).unwrap();
        out.write_all(bytes).unwrap();
    }
    out.finish().unwrap().into_inner()
}

#[test]
fn the_points_of_an_archive_are_found() {
    let points = npy("'<f8'", "(3, 3)", &bytes(POINTS.concat(), f64::to_le_bytes));
    let other = npy("'<f8'", "(2, 128)", &[0; 2048]);
    assert_eq!(
        open("a.npz", archive(&[("descriptors", other.clone()), ("arr_0", points.clone())]))
            .positions,
        POINTS
    );
    let input = open("a.npz", archive(&[("colors", points.clone()), ("xyz", points.clone())]));
    assert_eq!(
        (&input.positions[..], &input.notes[..]),
        (&POINTS[..], &["read, the array \"xyz\" of 2".to_owned()][..])
    );
    let line = refused("a.npz", archive(&[("a", points.clone()), ("b", points)]));
    assert!(line.ends_with("found \"a\", \"b\""), "{line}");
    assert!(refused("a.npz", archive(&[("d", other)])).ends_with("found \"d\""));
    assert!(refused("a.npz", b"PK\x03\x04").contains("expected an archive of NumPy arrays"));
}

#[test]
fn cameras_are_not_needed_for_points() {
    for (file, from, to, note) in [
        (
            "cameras.txt",
            "SIMPLE_PINHOLE",
            "SPHERICAL",
            "expected a camera model of COLMAP for camera",
        ),
        // A pose with NaN, and one of zeros.
        ("images.txt", "\n3 0.2448454332437206 ", "\n3 nan ", "1 of 20 cameras have no place"),
        (
            "images.txt",
            "\n2 0.69121825575770734 0.46875053236901132 0.54926565388881932 -0.028240091521257206",
            "\n2 0 0 0 0",
            "1 of 20 cameras have no place",
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        for name in ["cameras.txt", "images.txt", "points3D.txt"] {
            let text = fs::read_to_string(data("rig-txt").join(name)).unwrap();
            let text = if name == file { text.replace(from, to) } else { text };
            fs::write(dir.path().join(name), text).unwrap();
        }
        let input = read::open(dir.path()).unwrap();
        assert_eq!((input.positions.len(), input.cameras.len() + input.n_unplaced), (8, 20));
        assert!(input.notes.len() == 1 && input.notes[0].contains(note), "{:?}", input.notes);
    }
}

#[test]
fn models_of_undistorted_images_are_found_where_there_is_no_other() {
    let copy = |root: &Path, to: &str| {
        fs::create_dir_all(root.join(to)).unwrap();
        for name in ["cameras.bin", "images.bin", "points3D.bin"] {
            fs::copy(data("project/sparse/0").join(name), root.join(to).join(name)).unwrap();
        }
    };
    for place in ["dense/0/sparse", "dense/sparse"] {
        let dir = tempfile::tempdir().unwrap();
        copy(dir.path(), place);
        assert_eq!(read::open(dir.path()).unwrap().model, Some(dir.path().join(place)));
        copy(dir.path(), "sparse/0");
        let input = read::open(dir.path()).unwrap();
        assert_eq!((input.model, input.notes), (Some(dir.path().join("sparse/0")), vec![]));
    }
}

/// OpenSfM stores position, size and angle of keypoints beside their descriptors.
#[test]
fn an_archive_of_features_is_no_map() {
    let array = |shape: [usize; 2]| {
        npy("'<f4'", &format!("({}, {})", shape[0], shape[1]), &vec![0; 4 * shape[0] * shape[1]])
    };
    for arrays in [
        [("points", [30, 4]), ("descriptors", [30, 128])],
        [("points", [30, 3]), ("OPENSFM_FEATURES_VERSION", [1, 1])],
        [("keypoints", [30, 3]), ("scores", [30, 1])],
    ] {
        let line = refused("a.npz", archive(&arrays.map(|(name, shape)| (name, array(shape)))));
        assert_eq!(line, "a.npz: expected points of a map, found features of an image");
    }
}

#[test]
fn points3d_of_others_are_a_table() {
    for row in ["{} {} {}", "{}, {}, {}"] {
        let text = POINTS.map(|point| {
            point.iter().fold(row.to_owned(), |row, x| row.replacen("{}", &x.to_string(), 1))
        });
        assert_eq!(open("points3D.txt", text.join("\n")).positions, POINTS);
    }
    // A damaged row of COLMAP must not be read as a point.
    assert!(refused("points3D.txt", "1 0.5 0.5 0.5\n").contains("points3D.txt:1: expected"));
}

/// Python writes NaN and Infinity, which JSON does not allow.
#[test]
fn json_with_numbers_that_are_none_has_points_left_out() {
    let point = |x: &str| format!(r#"{{"coordinates": [{x}, 2.0, 3.0]}}"#);
    let points: Vec<String> = ["1.0", "NaN", "-1.5", "Infinity", "-Infinity", "4.0"]
        .iter()
        .enumerate()
        .map(|(at, x)| format!("\"{at} NaN \\\" I\": {}", point(x)))
        .collect();
    let text = format!(r#"[{{"shots": {{}}, "points": {{{}}}}}]"#, points.join(", "));
    let input = open("reconstruction.json", text);
    assert_eq!(input.positions, [[1.0, 2.0, 3.0], [-1.5, 2.0, 3.0], [4.0, 2.0, 3.0]]);
}

#[test]
fn json_of_others_is_told() {
    for other in [r#"{"points": [[1, 2, 3]]}"#, r#"{"frames": [{}]}"#] {
        let line = refused("a.json", other);
        assert!(line.contains("a map of OpenSfM or nerfstudio"), "{line}");
        assert!(line.contains("found other JSON ("), "{line}");
    }
}

#[test]
fn a_file_that_was_not_fetched_is_told() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 179\n";
    for name in ["a.ply", "a.pts"] {
        let line = refused(name, pointer);
        assert!(line.ends_with("found a pointer of Git LFS (run git lfs pull)"), "{line}");
    }
}
