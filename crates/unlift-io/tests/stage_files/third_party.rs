//! Tests files written by pyarrow (tests/data/third_party.py).

use std::path::{Path, PathBuf};
use unlift::RecordId;
use unlift::descriptors::Values;
use unlift::recover::Status;
use unlift::released::{Lines, Obfuscation};
use unlift_io::stage;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn file(name: &str) -> PathBuf {
    data().join("third_party").join(name)
}

#[test]
fn lines_and_neighborhoods_of_the_documented_example() {
    let released = stage::read_released::<3>(&file("map.parquet")).unwrap();
    assert_eq!((released.n_records(), released.origin()), (12, [0.0; 3]));
    let Obfuscation::Lines(lines) = released.obfuscation() else {
        panic!("{} is not lines", released.obfuscation().family());
    };
    // In normal form, through the points.
    let widen = |rows: &[[f32; 3]]| -> Vec<_> { rows.iter().map(|r| r.map(f64::from)).collect() };
    let again = Lines::through(&widen(lines.foot()), &widen(lines.direction())).unwrap();
    assert_eq!(*lines, again);
    for (row, (foot, direction)) in lines.foot().iter().zip(lines.direction()).enumerate() {
        let hidden = 11 - row as u32;
        let point = [hidden / 4, hidden / 2 % 2, hidden % 2].map(|x| x as f32);
        let from_foot: [f32; 3] = std::array::from_fn(|c| point[c] - foot[c]);
        let along: f32 = (0..3).map(|c| from_foot[c] * direction[c]).sum();
        for c in 0..3 {
            assert!((from_foot[c] - along * direction[c]).abs() < 1e-5);
        }
    }
    let lists = stage::read_neighborhoods(&file("neighborhoods.parquet"), 12, 1).unwrap();
    assert_eq!(lists.of(11).len(), 11);
    assert_eq!(lists.of(2)[..3], [0, 1, 3].map(RecordId));
}

#[test]
fn other_types_and_unknown_columns() {
    let released = stage::read_released::<3>(&file("rays.parquet")).unwrap();
    let Obfuscation::Rays(rays) = released.obfuscation() else {
        panic!("{} is not rays", released.obfuscation().family());
    };
    assert_eq!(rays.centers(), [[0.0; 3], [2.0, 1.5, 1.0]]);
    assert_eq!(rays.center(), [0, 1].repeat(6));
    let descriptors = released.descriptors().unwrap();
    assert_eq!(descriptors.dim(), 4);
    assert_eq!(*descriptors.values(), Values::U8((0..48).collect()));
}

#[test]
fn rows_in_any_order_without_metadata() {
    let path = file("shuffled.parquet");
    assert_eq!(stage::peek(&path).unwrap().kind, stage::Kind::Neighborhoods);
    let lists = stage::read_neighborhoods(&path, 12, 1).unwrap();
    for slot in 0..12 {
        let others: Vec<u32> = (0..12).filter(|&r| r != slot).collect();
        let listed: Vec<u32> = lists.of(slot as usize).iter().map(|r| r.0).collect();
        assert_eq!(listed, others);
        let scores = lists.scores_of(slot as usize).unwrap();
        assert_eq!(scores.iter().map(|&s| s as u32).collect::<Vec<_>>(), others);
    }
}

#[test]
fn the_point_form_with_points_left_out() {
    let path = file("points.parquet");
    assert_eq!(stage::peek(&path).unwrap().kind, stage::Kind::PointNeighborhoods);
    let lists = stage::read_point_neighborhoods(&path, 6).unwrap();
    assert_eq!(lists.n_points(), 6);
    assert_eq!(lists.offsets(), [0, 2, 2, 2, 2, 2, 4]);
    assert_eq!(lists.neighbors(), [2, 1, 4, 3]);
    assert_eq!((lists.of(0), lists.of(5), lists.of(3)), (&[2, 1][..], &[4, 3][..], &[][..]));
}

#[test]
fn zstd_is_read_and_another_compression_is_named() {
    let read = |name| stage::read_point_neighborhoods(&file(name), 6);
    assert_eq!(read("zstd.parquet").unwrap(), read("points.parquet").unwrap());
    let error = read("gzip.parquet").unwrap_err().to_string();
    let line =
        "gzip.parquet: column neighbors: expected no compression, Snappy or zstd, found GZIP";
    assert!(error.ends_with(line), "{error}");
}

#[test]
fn recovered_points_with_coordinates_only() {
    let recovered = stage::read_recovered::<2>(&file("found.parquet")).unwrap();
    assert_eq!(recovered.status(), [Status::Ok, Status::NoSupport]);
    assert_eq!((recovered.position(0), recovered.position(1)), (Some([1.5, 2.5]), None));
}
