//! Tests that files are read back equal, and that equal values make equal bytes.

use std::fs;
use std::path::{Path, PathBuf};

use unlift::neighbors::Neighborhoods;
use unlift::released::{AxisCandidates, Lines, Obfuscation, Released};
use unlift::truth::Original;
use unlift::{PointSet, RecordId, Unit};
use unlift_io::Error;
use unlift_io::stage::{self, ImageFile, Kind};

use super::maps;
use crate::{place, write_images};

/// Writes a value twice, which gives the same bytes, and returns the path of a file.
fn written(folder: &Path, kind: Kind, write: &dyn Fn(&Path) -> Result<(), Error>) -> PathBuf {
    let [a, b] = ["a.npz", "b.npz"].map(|name| folder.join(name));
    write(&a).unwrap();
    write(&b).unwrap();
    assert!(fs::read(&a).unwrap() == fs::read(&b).unwrap(), "two files of one value differ");
    assert_eq!((stage::kind(&a).unwrap(), stage::declared_kind(&a)), (kind, Some(kind)));
    a
}

/// Writes and reads values of every kind, of `n` points each. `change` may write a file again.
pub fn values_come_back<const D: usize>(folder: &Path, sizes: &[usize], change: impl Fn(&Path)) {
    let written = |kind, write: &dyn Fn(&Path) -> Result<(), Error>| {
        let path = written(folder, kind, write);
        change(&path);
        path
    };
    for (&n, seed) in sizes.iter().zip(0..) {
        for released in maps::released::<D>(seed, n) {
            let family = released.obfuscation().family();
            let path =
                written(Kind::Released, &|path| stage::write_released(path, &released, None));
            let read = stage::read_released::<D>(&path).unwrap();
            assert!(read == released, "{family} of {n} records in {D}D");
            // A released file says nothing of its source.
            let text = String::from_utf8_lossy(&fs::read(&path).unwrap()).into_owned();
            let leaks = [folder.file_name().unwrap().to_str().unwrap(), "original", "truth"];
            assert!(n > 100 || !leaks.iter().any(|leak| text.contains(leak)), "{family}");
        }

        let (original, secret) = maps::truth::<D>(seed, n);
        let path = written(Kind::Truth, &|path| stage::write_truth(path, &original, &secret));
        let (read_original, read_secret) = stage::read_truth::<D>(&path).unwrap();
        assert_eq!((read_original.reveal(), read_secret), (original.reveal(), secret));

        let recovered = maps::recovered::<D>(seed, n);
        let path = written(Kind::Recovered, &|path| stage::write_recovered(path, &recovered));
        let read = stage::read_recovered::<D>(&path, None).unwrap();
        // NaN is not equal to itself, so the texts are compared.
        assert!(format!("{read:?}") == format!("{recovered:?}"), "{n} points in {D}D");

        let n = n.min(1000);
        for slots in [1, 2] {
            let lists = maps::neighborhoods(seed, n, slots);
            let write = |path: &Path| stage::write_neighborhoods(path, &lists);
            let path = written(Kind::Neighborhoods, &write);
            assert_eq!(stage::read_neighborhoods(&path, n, slots).unwrap(), lists);
        }
    }
}

#[test]
fn values_of_every_kind_come_back() {
    let folder = tempfile::tempdir().unwrap();
    values_come_back::<2>(folder.path(), &[2, 3, 40, 20_000], |_| ());
    values_come_back::<3>(folder.path(), &[2, 3, 40, 20_000], |_| ());
}

#[test]
fn a_map_without_records_comes_back_and_a_secret_about_other_points_is_refused() {
    let (_folder, path) = place("empty.npz");
    let none = Obfuscation::AxisCandidates(AxisCandidates::<3>::try_new(&[]).unwrap());
    let released = Released::try_new(none, 1, [0.0; 3], Unit::Meter, None).unwrap();
    stage::write_released(&path, &released, None).unwrap();
    assert_eq!(stage::read_released::<3>(&path).unwrap(), released);
    let lists = Neighborhoods::try_new(vec![0], Vec::<RecordId>::new(), None, 0, 1).unwrap();
    stage::write_neighborhoods(&path, &lists).unwrap();
    assert_eq!(stage::read_neighborhoods(&path, 0, 1).unwrap(), lists);

    let (_, secret) = maps::truth::<3>(1, 10);
    let points = PointSet::try_new(vec![[0.0; 3]; 2], Unit::Meter).unwrap();
    let (folder, path) = place("truth.npz");
    assert!(stage::write_truth(&path, &Original::new(points), &secret).is_err());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Images with any name come back, in order; those without rows are not stored.
#[test]
fn images_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let in_pixels = |family: usize, n: usize| {
        let released = maps::released::<2>(n as u64, n).swap_remove(family);
        let (kept, descriptors) = (released.obfuscation().clone(), released.descriptors().cloned());
        Released::try_new(kept, 1, released.origin(), Unit::Pixel, descriptors).unwrap()
    };
    let names = ["a.jpg", "day/b \u{e9}.png", "../c", "/d\\e", "f.npy"];
    let maps: Vec<Released<2>> = (0..names.len()).map(|at| in_pixels(0, 7 + at)).collect();
    let none = Obfuscation::Lines(Lines::through(&[], &[]).unwrap());
    let none = Released::<2>::try_new(none, 1, [0.0; 2], Unit::Pixel, None).unwrap();
    let path = written(folder.path(), Kind::Released, &|path| {
        write_images(path, |images| {
            images.released("none.jpg", &none).unwrap();
            names.iter().zip(&maps).for_each(|(name, map)| images.released(name, map).unwrap());
        });
        Ok(())
    });
    let mut images = ImageFile::open(&path, Kind::Released).unwrap();
    for (name, map) in names.iter().zip(&maps) {
        let image = images.next_image().unwrap().unwrap();
        assert_eq!(image.name(), *name);
        assert!(image.released().unwrap() == *map, "{name}");
    }
    assert!(images.next_image().unwrap().is_none());
    write_images(&path, |images| {
        images.released("a", &maps[0]).unwrap();
        assert!(images.released("b", &in_pixels(3, 5)).is_err(), "another family");
    });
}
