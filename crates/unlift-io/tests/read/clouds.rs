//! Tests point clouds: PLY, tables and arrays give the same points in every form.

use unlift_io::read;

use super::{close, data, total, write};

fn read_text(name: &str, text: impl AsRef<[u8]>) -> Vec<[f64; 3]> {
    let (_dir, path) = write(name, text);
    read::open(&path).unwrap().positions
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
    // In `float`: 16 times the rounding error of the largest coordinate, 15.
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
