//! Tests point clouds: PLY, tables and arrays in every form, files that deviate from their format in common ways, and exports.

use std::fs;

use half::f16;
use unlift_io::{clouds, read};

use super::{POINTS, archive, close, data, npy, open, refused, shown, total, write};

fn bytes<const N: usize>(all: impl IntoIterator<Item = f64>, of: fn(f64) -> [u8; N]) -> Vec<u8> {
    all.into_iter().flat_map(of).collect()
}

fn f4(x: f64) -> [u8; 4] {
    (x as f32).to_le_bytes()
}

#[test]
fn ply_reads_the_same_in_every_form() {
    let text = POINTS.map(|[x, y, z]| format!("255\t{x}  {y} {z:e} -4 \r\n")).concat().into();
    let bytes = |of: fn(f64) -> Vec<u8>| {
        POINTS.map(|point| [vec![255], point.map(of).concat(), vec![1, 2, 3, 4]].concat()).concat()
    };
    for (encoding, real, rows) in [
        ("ascii", "double", text),
        ("binary_little_endian", "float", bytes(|x| (x as f32).to_le_bytes().into())),
        ("binary_big_endian", "float64", bytes(|x| x.to_be_bytes().into())),
    ] {
        let head = format!(
            "ply\nformat {encoding} 1.0\ncomment made by hand\nelement camera 1\nproperty short id\n\
             element vertex 3\nproperty uchar red\nproperty {real} x\nproperty {real} y\n\
             property {real} z\nproperty int label\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n"
        );
        let (camera, face): (&[u8], &[u8]) = match encoding {
            "ascii" => (b"7\n", b"3 0 1 0\n"),
            _ => (&[0, 7], &[1, 0, 0, 0, 0]),
        };
        let input = open("a.PLY", [head.as_bytes(), camera, &rows, face].concat());
        assert_eq!(input.positions, POINTS, "{encoding} {real}");
        assert_eq!(input.format, format!("ply {}", encoding.replace('_', " ")));
    }
}

#[test]
fn files_of_pycolmap_and_numpy_are_read() {
    let [cloud, model] = ["cloud.ply", "rig-bin"].map(|name| read::open(&data(name)).unwrap());
    assert_eq!(cloud.positions.len(), 8);
    // In `float`: 16 times the rounding error of the largest coordinate, 15.
    close(total(&cloud.positions), total(&model.positions), 1e-5);
    let expected: Vec<[f64; 3]> =
        (0..4).map(|row| std::array::from_fn(|column| (3 * row + column) as f64 / 8.0)).collect();
    for name in ["f8.npy", "f4-big-endian.npy", "f8-fortran.npy"] {
        assert_eq!(read::open(&data(name)).unwrap().positions, expected, "{name}");
    }
}

#[test]
#[rustfmt::skip] // One row per line.
fn tables_are_read_as_intended_or_refused_with_a_reason() {
    // Names, the text before the points, and a row, in which i is the number of the row and E is z with an exponent.
    let any = &["a.csv", "a.xyz", "a.TXT"][..];
    const POSES: &str = "found a trajectory, poses of cameras";
    // The map is read as `POINTS` without (or with) a doubt, or is refused with the end of a line.
    const POINTS_ONLY: Result<&str, &str> = Ok("");
    let rows = [
        (any, "", "x,y,z", POINTS_ONLY),
        (any, "", "x, y, E, 17, rd", POINTS_ONLY),
        (any, "", "x;y;z\r", POINTS_ONLY),
        (any, "", "x y   z\n", POINTS_ONLY),
        (any, "# x y z\n// X,Y,Z\n", "  x\ty\tz", POINTS_ONLY),
        (any, "id,Z,\"Y\",x\n", "7,z,y,x\n# between", POINTS_ONLY),
        (any, "name\tx\ty\tz\n", "\tx\ty\tz", POINTS_ONLY),
        (any, "sep=,\n\"x\",\"y\",\"z\"\n", "\"x\",\"y\",\"z\"", POINTS_ONLY),
        (any, "\"Points:0\",\"Points:1\",\"Points:2\"\n", "x,y,z", POINTS_ONLY),
        (any, "Intensity,Points_0,Points_1,Points_2\n", "i,x,y,z", POINTS_ONLY),
        (any, "X Y Z R G B\n", "x y z 1 2 3", POINTS_ONLY),
        (any, "\u{feff}x;y;z\n", "x;y;z", POINTS_ONLY),
        // Comments name the columns.
        (any, "# id x y z\n", "i x y z", POINTS_ONLY),
        (any, "//ID X Y Z\n", "i x y z", POINTS_ONLY),
        (any, "# made by hand\n# columns: id X[m] Y[m] Z[m]\n# 3 rows\n", "i x y z", POINTS_ONLY),
        (any, "# nx,ny,nz,x,y,z\n", "0,0,1,x,y,z", POINTS_ONLY),
        (any, "# made by hand in an hour or so\n", "x y z", POINTS_ONLY),
        (any, "# my first room\n", "x y z", Ok("columns: the first three are read as")),
        (any, "# id east north up\n", "i x y z", Err("columns named x, y and z, found \"id east north up\"")),
        (any, "# id x y z label\n", "i x y z", Err("5 columns, as a comment names them, found \"id x y z label\"")),
        // A count before the points.
        (&["a.pts", "a.asc", "a.xyz"], "3\n", "x y z -100 1 2 3", POINTS_ONLY),
        (&["a.pts", "a.asc", "a.xyz"], "//X Y Z\n3\n", "x y z", POINTS_ONLY),
        (&["a.pts"], "4\n", "x y z", Err(":4: expected 4 points, as declared in the line before them, found 3 up to here")),
        // Trajectories.
        (any, "", "i x y z 0 0 0.6 0.8", Err(POSES)),
        (any, "#timestamp tx ty tz qx qy qz qw\n", "i x y z 0 0 0.6 0.8", Err(POSES)),
        (any, "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n", "i,x,y,z,0,0,0.6,0.8", Err(POSES)),
        (any, "", "1 0 0 x 0 1 0 y 0 0 1 z", Err(POSES)),
        // `points3D.txt` of other programs is a table. A damaged row of COLMAP must not be read as a point.
        (&["points3D.txt"], "", "x y z", POINTS_ONLY),
        (&["points3D.txt"], "", "x, y, z", POINTS_ONLY),
        (&["points3D.txt"], "", "1 x y z", Err("points3D.txt:1: expected a color (3 numbers), found end of line")),
    ];
    for (names, head, row, read) in rows {
        let points = POINTS.iter().enumerate().map(|(at, [x, y, z])| {
            let row = row.replace('i', &at.to_string()).replace('E', &format!("{z:e}"));
            let row = row.replace('x', &x.to_string()).replace('y', &y.to_string());
            row.replace('z', &z.to_string()) + "\n"
        });
        let text = head.to_owned() + &points.collect::<String>();
        for name in names {
            let (_dir, path) = write(name, &text);
            match (read::open(&path), read) {
                (Ok(map), Ok(doubt)) => {
                    assert!(map.positions == POINTS && map.doubts.is_empty() == doubt.is_empty(), "{text}: {:?}", map.doubts);
                    assert!(map.doubts.iter().all(|its| its.starts_with(doubt)), "{:?}", map.doubts);
                }
                (Err(error), Err(end)) => assert!(error.to_string().ends_with(end), "{error}: {text}"),
                (found, _) => panic!("{text}: {found:?}"),
            }
        }
    }
    let numbered: String = (1..=20).map(|at| format!("{at} 0.5 {at} 3\n")).collect();
    assert!(refused("a.xyz", numbered).ends_with("found the row number in the first column"));
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 179\n";
    assert!(refused("a.ply", pointer).ends_with("found a pointer of Git LFS (run git lfs pull)"));
}

#[test]
fn points_of_colmap_are_known_under_any_name() {
    let text = fs::read_to_string(data("rig-txt/points3D.txt")).unwrap();
    let expected = read::open(&data("rig-txt")).unwrap();
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    for text in [&text, &rows.join("\n")] {
        let input = open("cloud.txt", text);
        assert_eq!((input.format, &input.ids), ("COLMAP points", &expected.ids));
        assert_eq!(input.positions, expected.positions);
    }
    let images = fs::read(data("rig-txt/images.txt")).unwrap();
    assert!(refused("poses.txt", images).ends_with("found a trajectory, poses of cameras"));
}

#[test]
fn points_without_a_place_are_left_out_and_many_at_one_place_are_counted() {
    for none in ["nan", "-inf", "NaN", "-nan(ind)", "1.#QNAN", ""] {
        let row = |at: usize| match at {
            7 => format!("1,{none},3\n"),
            _ => format!("{at},{at},{}\n", at * at),
        };
        let input = open("a.csv", format!("x,y,z\n{}", (0..40).map(row).collect::<String>()));
        assert_eq!((input.positions.len(), input.n_rows()), (39, 40), "{none}");
        assert_eq!((input.ids[6], input.ids[7], input.left_out), (6, 8, vec![7]));
        assert_eq!(input.notes, ["1 of 40 points have no place"]);
        assert!(input.doubts.is_empty());
    }
    // More than 5 % of the points are a doubt.
    let input = open("a.xyz", "nan 1 2\n3 4 5\n6 7 8\n");
    assert_eq!(input.doubts, ["1 of 3 points have no place: what is audited is not the whole map"]);
    let row = |at| if at % 2 == 0 { "0 -0.0 0\n".to_owned() } else { format!("{at} 1 2\n") };
    let note = "15 of 30 points are at exactly one place, [0.0, -0.0, 0.0]";
    assert_eq!(open("a.xyz", (0..30).map(row).collect::<String>()).notes, [note]);
}

fn binary_ply(vertex: &str, rows: &[u8]) -> Vec<u8> {
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
        rows.extend([&[at, 0][..], &vec![7; 4 * usize::from(at)]].concat());
        rows.extend((-300 - i16::from(at)).to_le_bytes());
        rows.extend([&[2 - at][..], &vec![7; usize::from(2 - at)]].concat());
        rows.extend((70_000 + u32::from(at)).to_le_bytes());
        rows.push((-5 - at as i8) as u8);
    }
    let expected = [0.0, 1.0, 2.0].map(|at| [-300.0 - at, 70_000.0 + at, -5.0 - at]);
    assert_eq!(open("a.ply", binary_ply(head, &rows)).positions, expected);
    let rows = "3 0 1 2 9\n0 9\n0 -300 2 7 7 70000 -5\n1 7.5 -301 1 7 70001 -6\n2 7.5 7.5 -302 0 70002 -7\n";
    let text = format!("ply\nformat ascii 1.0\n{head}end_header\n{rows}");
    assert_eq!(open("a.ply", &text).positions, expected);
    let line = refused("a.ply", text.replace("0 70002", "3 70002"));
    assert_eq!(line, "a.ply:17: expected 10 values of vertex 3, found 7");
}

#[test]
fn of_splats_the_centers_are_read() {
    let names = ["x", "y", "z", "f_dc_0", "opacity", "scale_0", "rot_0"]
        .map(|name| format!("property float {name}\n"));
    let rows = POINTS.map(|[x, y, z]| bytes([x, y, z, 0.0, 1.0, 1.0, 1.0], f4)).concat();
    let splats = binary_ply(&format!("element vertex 3\n{}", names.concat()), &rows);
    let flat = POINTS.map(|point| [bytes(point, f4), vec![1; 20]].concat()).concat();
    for (name, bytes) in [("a.ply", splats), ("a.splat", flat)] {
        let input = open(name, bytes);
        assert_eq!(input.positions, POINTS);
        assert_eq!(input.notes, ["Gaussian splats: only their centers are read"]);
    }
}

/// It must not allocate memory of that size.
#[test]
fn a_file_with_holes_is_one_line() {
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 200000000000\nproperty float x\n\
                property float y\nproperty float z\nend_header\n";
    let (_dir, path) = write("a.ply", head);
    let file = fs::OpenOptions::new().write(true).open(&path).unwrap();
    // Some file systems do not support such files.
    if file.set_len(head.len() as u64 + 12 * 200_000_000_000).is_ok() {
        let error = read::open(&path).unwrap_err().to_string();
        assert!(error.contains("expected data that fits into memory, found "), "{error}");
    }
}

#[test]
#[rustfmt::skip] // One row per line.
fn arrays_may_have_more_columns_or_names() {
    let six = bytes(POINTS.iter().flat_map(|&[x, y, z]| [x, y, z, 1.0, 2.0, 3.0]), f4);
    let input = open("a.npy", npy("'<f4'", "(3, 6)", &six));
    assert_eq!(input.positions, POINTS);
    assert_eq!(input.notes, ["the first 3 of 6 columns are read as x, y and z"]);
    let signed = [-100.0, -1.0, 2.0];
    let (unsigned, large) = ([65236.0, 1.0, 2.0], [9_223_372_036_854_775_808.0, 1.0, 2.0]);
    for (descr, values, whole) in [
        ("'<f2'", signed, bytes(signed, |x| f16::from_f64(x).to_le_bytes())),
        ("'|i1'", signed, bytes(signed, |x| (x as i8).to_le_bytes())),
        ("'<i2'", signed, bytes(signed, |x| (x as i16).to_le_bytes())),
        ("'>i2'", signed, bytes(signed, |x| (x as i16).to_be_bytes())),
        ("'<i4'", signed, bytes(signed, |x| (x as i32).to_le_bytes())),
        ("'<i8'", signed, bytes(signed, |x| (x as i64).to_le_bytes())),
        ("'>u2'", unsigned, bytes(unsigned, |x| (x as u16).to_be_bytes())),
        ("'<u8'", large, bytes(large, |x| (x as u64).to_le_bytes())),
    ] {
        assert_eq!(open("a.npy", npy(descr, "(1, 3)", &whole)).positions, [values], "{descr}");
    }

    let row = |[x, y, z]: [f64; 3]| {
        [vec![9; 3], (z as f32).to_be_bytes().into(), x.to_le_bytes().into(), vec![0; 8], f4(y).into()].concat()
    };
    let rows = POINTS.map(row).concat();
    let descr = "[('rgb', '|u1', (3,)), ('Z', '>f4'), ('x', '<f8'), ('', '|V4'), ('s', '<U1'), ('y', '<f4')]";
    assert_eq!(open("a.npy", npy(descr, "(3,)", &rows)).positions, POINTS);
    let descr = "[('id', '<i4'), ('xyz', '<f4', (3,))]";
    let rows = POINTS.map(|point| [vec![1, 0, 0, 0], bytes(point, f4)].concat()).concat();
    assert_eq!(open("a.npy", npy(descr, "(3,)", &rows)).positions, POINTS);
}

#[test]
fn the_points_of_an_archive_are_read() {
    let points = || npy("'<f8'", "(3, 3)", &bytes(POINTS.concat(), f64::to_le_bytes));
    let other = || npy("'<f8'", "(2, 128)", &[0; 2048]);
    let input = open("a.npz", archive(&[("descriptors", other()), ("arr_0", points())]));
    assert_eq!(input.positions, POINTS);
    let input = open("a.npz", archive(&[("colors", points()), ("xyz", points())]));
    assert_eq!(input.positions, POINTS);
    assert_eq!(input.notes, ["read, the array \"xyz\" of 2"]);
    let line = |arrays: &[(&str, Vec<u8>)]| refused("a.npz", archive(arrays));
    assert!(line(&[("a", points()), ("b", points())]).ends_with("found \"a\", \"b\""));
    assert!(line(&[("d", other())]).ends_with("found \"d\""));
    assert!(refused("a.npz", b"PK\x03\x04").contains("expected an archive of NumPy arrays"));
    // OpenSfM stores position, size and angle of keypoints beside their descriptors.
    for arrays in [
        [("points", 4), ("descriptors", 128)],
        [("points", 3), ("OPENSFM_FEATURES_VERSION", 1)],
        [("keypoints", 3), ("scores", 1)],
    ] {
        let array = |d: usize| npy("'<f4'", &format!("(30, {d})"), &vec![0; 4 * 30 * d]);
        let line = line(&arrays.map(|(name, d)| (name, array(d))));
        assert_eq!(line, "a.npz: expected points of a map, found features of an image");
    }
}

#[test]
fn points_are_written_if_they_are_finite() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let points = [[1.0, 2.0, 3.0], [-1e-9, 4e6, 0.0]];
    clouds::write_points(&path("p.ply"), &points).unwrap();
    assert_eq!(read::open(&path("p.ply")).unwrap().positions, points);
    let error = clouds::write_points(&path("a"), &[[0.0, f64::NAN, 0.0]]).unwrap_err();
    let line = "a: point 0: expected finite coordinates, found [0.0, NaN, 0.0]";
    assert_eq!(shown(folder.path(), &error), line);
    assert!(!path("a").exists());
}
