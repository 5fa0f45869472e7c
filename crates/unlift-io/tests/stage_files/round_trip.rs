//! Tests that files are read back equal, and that equal values make equal bytes.

use crate::maps;
use std::fs;
use std::path::Path;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::{SCHEMES, SchemeOptions, obfuscate};
use unlift::released::{AxisCandidates, Lines, Obfuscation, Released};
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift::{PointSet, RecordId, Unit};
use unlift_io::atomic::{Access, OutputFile};
use unlift_io::stage::{self, ImageFile, ImageWriter, Kind};

const SIZES: [usize; 4] = [2, 3, 40, 20_000];

fn written_twice(folder: &Path, write: impl Fn(&Path)) -> Vec<u8> {
    let paths = [folder.join("a.npz"), folder.join("b.npz")];
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
            let path = folder.path().join("a.npz");
            let read = stage::read_released::<D>(&path).unwrap();
            assert!(read == released, "{family} of {n} records in {D}D");
            assert_eq!(stage::kind(&path).unwrap(), Kind::Released, "{family}");
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
    let path = folder.path().join("a.npz");
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
        let path = folder.path().join("a.npz");
        let (read_original, read_secret) = stage::read_truth::<D>(&path).unwrap();
        assert_eq!(read_original.reveal(), original.reveal());
        // Dropped points come back in the order of originals.
        let in_order = |secret: &Secret| {
            let mut dropped = secret.dropped().to_vec();
            dropped.sort_by_key(|dropped| dropped.original.0);
            (secret.hidden().to_vec(), secret.map(), secret.slots_per_record(), dropped)
        };
        assert_eq!(in_order(&read_secret), in_order(&secret));
        assert_eq!(read_secret.swapped_axis(), secret.swapped_axis());
        assert_eq!(read_secret.descriptor_row(), secret.descriptor_row());
        assert_eq!(stage::kind(&path).unwrap(), Kind::Truth);
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
            let path = folder.path().join("a.npz");
            assert_eq!(stage::read_neighborhoods(&path, n, slots).unwrap(), lists);
            assert_eq!(stage::kind(&path).unwrap(), Kind::Neighborhoods);
        }
    }
}

fn recovered_law<const D: usize>() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, n) in SIZES.into_iter().enumerate() {
        let recovered = maps::recovered::<D>(seed as u64, n);
        let write = |value| move |path: &Path| stage::write_recovered(path, value).unwrap();
        let bytes = written_twice(folder.path(), write(&recovered));
        let path = folder.path().join("a.npz");
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
    let path = folder.path().join("empty.npz");
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
    let path = folder.path().join("secret-project-name.npz");
    for released in maps::released::<3>(1, 10) {
        stage::write_released(&path, &released).unwrap();
        let text = String::from_utf8_lossy(&fs::read(&path).unwrap()).into_owned();
        for leak in ["secret-project-name", "original", "truth"] {
            assert!(!text.contains(leak), "{leak} in {}", released.obfuscation().family());
        }
    }
}

#[test]
fn a_secret_about_other_points_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (_, secret) = maps::truth::<3>(1, 10);
    let points = PointSet::try_new(vec![[0.0; 3]; 2], Unit::Meter).unwrap();
    let original = Original::new(points);
    let path = folder.path().join("truth.npz");
    assert!(stage::write_truth(&path, &original, &secret).is_err());
    assert!(!path.exists());
}

/// Images with any name come back, in order; those without rows are not stored.
#[test]
fn images() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let names = ["a.jpg", "day/b \u{e9}.png", "../c", "/d\\e", "f.npy"];
    let maps: Vec<Released<2>> =
        (0..names.len()).map(|at| maps::released::<2>(at as u64, 7 + at)[0].clone()).collect();
    let in_pixels = |released: &Released<2>| {
        let (kept, slots) = (released.obfuscation().clone(), released.slots_per_record());
        let descriptors = released.descriptors().cloned();
        Released::try_new(kept, slots, released.origin(), Unit::Pixel, descriptors).unwrap()
    };
    let maps: Vec<Released<2>> = maps.iter().map(in_pixels).collect();
    let none = Obfuscation::Lines(Lines::through(&[], &[]).unwrap());
    let none = Released::<2>::try_new(none, 1, [0.0; 2], Unit::Pixel, None).unwrap();
    let write = |path: &Path| {
        let mut output = OutputFile::create(path, Access::Usual).unwrap();
        let mut images = ImageWriter::start(&mut output);
        images.released("none.jpg", &none).unwrap();
        for (name, map) in names.iter().zip(&maps) {
            images.released(name, map).unwrap();
        }
        images.finish().unwrap();
        output.commit().unwrap();
    };
    written_twice(folder.path(), write);
    assert_eq!(stage::kind(&path).unwrap(), Kind::Released);
    assert_eq!(stage::declared_kind(&path), Some(Kind::Released));
    let mut images = ImageFile::open(&path, Kind::Released).unwrap();
    for (name, map) in names.iter().zip(&maps) {
        let image = images.next_image().unwrap().unwrap();
        assert_eq!(image.name(), *name);
        assert!(image.released().unwrap() == *map, "{name}");
    }
    assert!(images.next_image().unwrap().is_none());
    let other = &maps::released::<2>(1, 5)[3];
    let mut output = OutputFile::create(&path, Access::Usual).unwrap();
    let mut images = ImageWriter::start(&mut output);
    images.released("a", &maps[0]).unwrap();
    assert!(images.released("b", &in_pixels(other)).is_err(), "another family");
}
