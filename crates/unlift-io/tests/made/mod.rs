//! Creates scans in the formats of other programs: three points, and one without coordinates if the
//! format allows it.

// Every test program uses a part of this file.
#![allow(dead_code)]

pub const POINTS: [[f64; 3]; 3] = [[0.5, -1.25, 3.0], [1000.0, 2.0, -0.0625], [0.125, 0.25, 0.375]];

/// Creates LAS of version `1.minor`, with a record before the points, and points of format 0 in
/// `record` bytes.
pub fn las(minor: u8, record: u16) -> Vec<u8> {
    let head: u16 = if minor == 4 { 375 } else { 227 };
    let mut file = vec![0; usize::from(head)];
    let mut put = |at: usize, bytes: &[u8]| file[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, minor]);
    put(94, &head.to_le_bytes());
    put(96, &(u32::from(head) + 60).to_le_bytes());
    put(100, &1u32.to_le_bytes());
    put(105, &record.to_le_bytes());
    // Version 1.4 has another field for the number of points.
    let n = POINTS.len() as u64;
    match minor {
        4 => put(247, &n.to_le_bytes()),
        _ => put(107, &(n as u32).to_le_bytes()),
    }
    let offset = [10.0, 0.0, -5.0_f64];
    for (axis, x) in offset.iter().enumerate() {
        put(131 + 8 * axis, &0.0005_f64.to_le_bytes());
        put(155 + 8 * axis, &x.to_le_bytes());
    }
    file.extend([7; 60]);
    for point in POINTS {
        let mut row = vec![9; usize::from(record)];
        for axis in 0..3 {
            let integer = ((point[axis] - offset[axis]) / 0.0005).round() as i32;
            row[4 * axis..4 * axis + 4].copy_from_slice(&integer.to_le_bytes());
        }
        file.extend(row);
    }
    file
}

/// Creates a LAS file with a record about its coordinate system, before the points or, if `long`,
/// after them.
pub fn las_with(minor: u8, id: u16, record: &[u8], long: bool) -> Vec<u8> {
    let mut file = las(minor, 20);
    let mut head = vec![0; 2];
    head.extend(b"LASF_Projection\0");
    head.extend(id.to_le_bytes());
    if long {
        let at = file.len() as u64;
        if minor == 4 {
            file[235..243].copy_from_slice(&at.to_le_bytes());
            file[243..247].copy_from_slice(&1u32.to_le_bytes());
        }
        head.extend((record.len() as u64).to_le_bytes());
    } else {
        head.extend((record.len() as u16).to_le_bytes());
    }
    head.extend([0; 32]);
    head.extend(record);
    if long {
        file.extend(head);
    } else {
        // Replaces the existing record.
        let start = if minor == 4 { 375 } else { 227 };
        file[96..100].copy_from_slice(&(start as u32 + head.len() as u32).to_le_bytes());
        file.splice(start..start + 60, head);
    }
    file
}

/// Creates the header of a PCD of `n` points with a color between coordinates.
pub fn pcd_head(n: usize, data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x rgb y z normal\nSIZE 4 4 8 4 2\nTYPE F U F F I\n\
         COUNT 1 1 1 1 2\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {data}\n"
    )
}

pub const PCD_STRIDE: usize = 4 + 4 + 8 + 4 + 2 * 2;

fn pcd_fields(x: f64, y: f64, z: f64) -> [Vec<u8>; 5] {
    [
        (x as f32).to_le_bytes().to_vec(),
        vec![1, 2, 3, 4],
        y.to_le_bytes().to_vec(),
        (z as f32).to_le_bytes().to_vec(),
        vec![5, 6, 7, 8],
    ]
}

/// Creates a PCD. The second point has no coordinates.
pub fn pcd(data: &str) -> Vec<u8> {
    let [a, b, c] = POINTS;
    let points = [a, [f64::NAN; 3], b, c];
    let mut file = pcd_head(points.len(), data).into_bytes();
    let rows = points.map(|[x, y, z]| pcd_fields(x, y, z));
    match data {
        "ascii" => {
            for [x, y, z] in points {
                file.extend(format!("{x} 4278190335 {y} {z:e} -1 2\n").to_lowercase().bytes());
            }
        }
        "binary" => file.extend(rows.concat().concat()),
        _ => {
            let by_field: Vec<u8> = (0..5)
                .flat_map(|field| rows.iter().flat_map(move |row| row[field].clone()))
                .collect();
            // Literal runs, except for the colors: a copy of 12 bytes from distance 4.
            let colors = 4 * rows.len();
            let runs = |bytes: &[u8]| -> Vec<u8> {
                bytes.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect()
            };
            let mut packed = runs(&by_field[..colors + 4]);
            packed.extend([7 << 5, 12 - 7 - 2, 3]);
            packed.extend(runs(&by_field[2 * colors..]));
            file.extend((packed.len() as u32).to_le_bytes());
            file.extend((by_field.len() as u32).to_le_bytes());
            file.extend(packed);
        }
    }
    file
}

/// Creates E57 with a scan in Cartesian and one in spherical coordinates. The second is rotated by
/// 90 degrees about z and shifted, and one of its two points is a beam without a return.
pub fn e57(path: &std::path::Path) {
    use e57::{
        E57Writer, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform,
        Translation,
    };
    let mut writer = E57Writer::from_file(path, "file").unwrap();
    let record = |name, data_type| Record { name, data_type };
    let mut scan = writer
        .add_pointcloud(
            "a",
            vec![
                record(RecordName::CartesianX, RecordDataType::F64),
                record(RecordName::CartesianY, RecordDataType::F64),
                record(RecordName::CartesianZ, RecordDataType::F64),
                record(RecordName::RowIndex, RecordDataType::Integer { min: 3, max: 3 }),
            ],
        )
        .unwrap();
    for [x, y, z] in &POINTS[..2] {
        let values = [*x, *y, *z].map(RecordValue::Double).into_iter();
        scan.add_point(values.chain([RecordValue::Integer(3)]).collect()).unwrap();
    }
    scan.finalize().unwrap();
    drop(scan);
    let mut scan = writer
        .add_pointcloud(
            "b",
            vec![
                record(RecordName::SphericalRange, RecordDataType::F64),
                record(RecordName::SphericalAzimuth, RecordDataType::F64),
                record(RecordName::SphericalElevation, RecordDataType::F64),
                record(
                    RecordName::SphericalInvalidState,
                    RecordDataType::Integer { min: 0, max: 2 },
                ),
            ],
        )
        .unwrap();
    let half = 0.5_f64.sqrt();
    scan.set_transform(Some(Transform {
        rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
        translation: Translation { x: 1.0, y: 2.0, z: 3.0 },
    }));
    // The third point in the frame of its scan, where (x, y) is the point's (y, -x).
    let [x, y, z] = [POINTS[2][1] - 2.0, 1.0 - POINTS[2][0], POINTS[2][2] - 3.0];
    let range = (x * x + y * y + z * z).sqrt();
    for invalid in [0, 2] {
        let angles = [range, y.atan2(x), (z / range).asin()].map(RecordValue::Double);
        let values = angles.into_iter().chain([RecordValue::Integer(invalid)]);
        scan.add_point(values.collect()).unwrap();
    }
    scan.finalize().unwrap();
    drop(scan);
    writer.finalize().unwrap();
}

/// Replaces `from` in the XML of an E57 file by `to` of the same length, and updates the checksums.
pub fn e57_with(mut file: Vec<u8>, from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    // Text that crosses a page contains a checksum and is not found.
    let found: Vec<usize> = (0..file.len() - from.len())
        .filter(|&at| file[at..].starts_with(from.as_bytes()))
        .collect();
    assert!(!found.is_empty(), "{from}");
    for at in found {
        file[at..at + to.len()].copy_from_slice(to.as_bytes());
    }
    sealed(file)
}

/// Updates the checksums: CRC-32C of each page of 1024 bytes, in its last four bytes.
pub fn sealed(mut file: Vec<u8>) -> Vec<u8> {
    for page in file.chunks_exact_mut(1024) {
        let (data, sum) = page.split_at_mut(1020);
        let step = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ 0x82f6_3b78 } else { crc >> 1 };
        let of_byte = |crc: u32, &byte: &u8| (0..8).fold(crc ^ u32::from(byte), |crc, _| step(crc));
        let crc = !data.iter().fold(!0, of_byte);
        sum.copy_from_slice(&crc.to_be_bytes());
    }
    file
}
