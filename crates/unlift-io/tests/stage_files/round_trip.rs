//! Tests that files are read back equal, and that equal values make equal bytes.

use crate::maps;
use std::fs;
use std::path::Path;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::{SCHEMES, SchemeOptions, obfuscate};
use unlift::released::{AxisCandidates, Obfuscation, Released};
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{PointSet, RecordId, Unit};
use unlift_io::stage::{self, Kind};

const SIZES: [usize; 5] = [2, 3, 40, 1000, 20_000];

fn written_twice(folder: &Path, write: impl Fn(&Path)) -> Vec<u8> {
    let paths = [folder.join("a.parquet"), folder.join("b.parquet")];
    for path in &paths {
        write(path);
    }
    let [a, b] = paths.map(|path| fs::read(path).unwrap());
    assert!(a == b, "two files of one value differ");
    a
}

fn released_law<const D: usize>() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, n) in SIZES.into_iter().enumerate() {
        for released in maps::released::<D>(seed as u64, n) {
            let family = released.obfuscation().family();
            written_twice(folder.path(), |path| stage::write_released(path, &released).unwrap());
            let path = folder.path().join("a.parquet");
            let read = stage::read_released::<D>(&path).unwrap();
            assert!(read == released, "{family} of {n} records in {D}D");
            let header = stage::peek(&path).unwrap();
            assert_eq!(
                (header.kind, header.dimension, header.n_rows),
                (Kind::Released, Some(D), n as u64)
            );
        }
    }
}

#[test]
fn released_maps() {
    released_law::<2>();
    released_law::<3>();
}

/// Public data about an image is released with it: without the image size, recovery has less
/// information.
#[test]
fn released_images() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    let bounds = Bounds::try_new([0.0, 0.0], [640.0, 480.1]).unwrap();
    let keypoints: Vec<[f64; 2]> =
        (0..90).map(|i| [7.1 * f64::from(i), 5.0 + 0.3 * f64::from(i * i % 1500)]).collect();
    let points = PointSet::try_new(keypoints, Unit::Pixel).unwrap();
    let original = Original::within(points, bounds).unwrap();
    for entry in SCHEMES {
        let Some(scheme) = entry.of_dimension::<2>(&SchemeOptions { voxel: 50.0 }) else {
            continue;
        };
        let (released, _) = obfuscate(&*scheme, &original, None, &Key::from_seed(3)).unwrap();
        assert!(released.bounds().is_some());
        written_twice(folder.path(), |path| stage::write_released(path, &released).unwrap());
        assert!(stage::read_released::<2>(&path).unwrap() == released, "{}", entry.name);
    }
}

fn truth_law<const D: usize>() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, n) in SIZES.into_iter().enumerate() {
        let (original, secret) = maps::truth::<D>(seed as u64, n);
        written_twice(folder.path(), |path| stage::write_truth(path, &original, &secret).unwrap());
        let path = folder.path().join("a.parquet");
        let (read_original, read_secret) = stage::read_truth::<D>(&path).unwrap();
        assert_eq!(read_original.reveal(), original.reveal());
        assert_eq!(read_secret, secret);
        let header = stage::peek(&path).unwrap();
        assert_eq!((header.kind, header.dimension), (Kind::Truth, Some(D)));
    }
}

#[test]
fn truth() {
    truth_law::<2>();
    truth_law::<3>();
}

#[test]
fn neighborhoods() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, n) in [2, 3, 40, 1000].into_iter().enumerate() {
        for slots in [1, 2] {
            let lists = maps::neighborhoods(seed as u64, n, slots);
            written_twice(folder.path(), |path| stage::write_neighborhoods(path, &lists).unwrap());
            let path = folder.path().join("a.parquet");
            assert_eq!(stage::read_neighborhoods(&path, n, slots).unwrap(), lists);
            assert_eq!(stage::peek(&path).unwrap().kind, Kind::Neighborhoods);
        }
    }
}

fn recovered_law<const D: usize>() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, n) in SIZES.into_iter().enumerate() {
        let recovered = maps::recovered::<D>(seed as u64, n);
        let write = |value| move |path: &Path| stage::write_recovered(path, value).unwrap();
        let bytes = written_twice(folder.path(), write(&recovered));
        let path = folder.path().join("a.parquet");
        let read = stage::read_recovered::<D>(&path).unwrap();
        // NaN is not equal to itself, so bytes are compared, and fields that are not stored.
        assert!(bytes == written_twice(folder.path(), write(&read)));
        for slot in 0..n {
            assert_eq!(read.position(slot), recovered.position(slot));
        }
        for (a, b) in read.positions().iter().zip(recovered.positions()) {
            assert_eq!(a.map(f32::to_bits), b.map(f32::to_bits));
        }
        assert_eq!(read.about(), recovered.about());
        assert_eq!((read.delta(), read.unit()), (recovered.delta(), recovered.unit()));
        assert_eq!((read.status(), read.support()), (recovered.status(), recovered.support()));
        assert_eq!((read.axis(), read.evidence()), (recovered.axis(), recovered.evidence()));
        assert_eq!(read.descriptor_row(), recovered.descriptor_row());
    }
}

#[test]
fn recovered_points() {
    recovered_law::<2>();
    recovered_law::<3>();
}

#[test]
fn a_map_without_records() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.parquet");
    let none = Obfuscation::AxisCandidates(AxisCandidates::<3>::try_new(&[]).unwrap());
    let released = Released::try_new(none, 1, [0.0; 3], Unit::Meter, None).unwrap();
    stage::write_released(&path, &released).unwrap();
    assert_eq!(stage::read_released::<3>(&path).unwrap(), released);
    let lists = Neighborhoods::try_new(vec![0], Vec::<RecordId>::new(), None, 0, 1).unwrap();
    stage::write_neighborhoods(&path, &lists).unwrap();
    assert_eq!(stage::read_neighborhoods(&path, 0, 1).unwrap(), lists);
}

#[test]
fn a_released_file_says_nothing_of_its_source() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("secret-project-name.parquet");
    for released in maps::released::<3>(1, 10) {
        stage::write_released(&path, &released).unwrap();
        let text = String::from_utf8_lossy(&fs::read(&path).unwrap()).into_owned();
        for leak in ["secret-project-name", "arrow", "parquet-rs", "original", "truth"] {
            assert!(!text.contains(leak), "{leak} in {}", released.obfuscation().family());
        }
    }
}

#[test]
fn a_secret_about_other_points_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (_, secret) = maps::truth::<3>(1, 10);
    let points = PointSet::try_new(vec![[0.0; 3]; 2], Unit::Meter).unwrap();
    let original = unlift::truth::Original::new(points);
    let path = folder.path().join("truth.parquet");
    assert!(stage::write_truth(&path, &original, &secret).is_err());
    assert!(!path.exists());
}
