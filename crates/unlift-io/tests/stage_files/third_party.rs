//! Tests files written by pyarrow (tests/data/third_party.py).

use std::path::{Path, PathBuf};
use unlift::descriptors::Values;
use unlift::released::Obfuscation;
use unlift_io::stage;

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn file(name: &str) -> PathBuf {
    data().join("third_party").join(name)
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
