//! Tests that a folder of parts equals the file, and that missing parts are errors.

use crate::maps;
use std::fs;
use std::path::Path;
use unlift::RecordId;
use unlift::neighbors::Neighborhoods;
use unlift_io::Error;
use unlift_io::atomic::Rules;
use unlift_io::stage::{self, Split};

fn split(path: &Path, rows: u64, out: &Path) -> Result<usize, Error> {
    let split = Split::open(path, rows)?;
    let n_parts = split.n_parts();
    let outputs = split.outputs(out, Rules::default())?;
    split.write(outputs)?;
    Ok(n_parts)
}

fn lists(path: &Path, n: u32) {
    let lists: Vec<RecordId> =
        (0..n).flat_map(|slot| [1, 2].map(|step| RecordId((slot + step) % n))).collect();
    let offsets = (0..=u64::from(n)).map(|at| 2 * at).collect();
    let lists = Neighborhoods::try_new(offsets, lists, None, n as usize, 1).unwrap();
    stage::write_neighborhoods(path, &lists).unwrap();
}

#[test]
fn parts_are_read_as_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, again) = (folder.path().join("whole"), folder.path().join("again"));
    for (seed, n) in [2, 999, 20_000].into_iter().enumerate() {
        for (at, released) in maps::released::<3>(seed as u64, n).into_iter().enumerate() {
            stage::write_released(&whole, &released).unwrap();
            let parts = folder.path().join(format!("{n}-{at}"));
            let n_parts = split(&whole, 333, &parts).unwrap();
            assert_eq!(n_parts, n.div_ceil(334));
            assert!(stage::read_released::<3>(&parts).unwrap() == released, "{n}");
            assert_eq!(stage::peek(&parts).unwrap(), stage::peek(&whole).unwrap());
            let one = folder.path().join(format!("{n}-{at}-one"));
            assert_eq!(split(&parts, 1 << 20, &one).unwrap(), 1);
            assert!(stage::read_released::<3>(&one).unwrap() == released, "{n}");
            let before = fs::read(parts.join("part-000000.parquet")).unwrap();
            split(&whole, 333, &parts).unwrap();
            assert!(fs::read(parts.join("part-000000.parquet")).unwrap() == before);
        }
        let (original, secret) = maps::truth::<3>(seed as u64, n);
        stage::write_truth(&whole, &original, &secret).unwrap();
        let parts = folder.path().join(format!("{n}-truth"));
        split(&whole, 100, &parts).unwrap();
        let (read, read_secret) = stage::read_truth::<3>(&parts).unwrap();
        stage::write_truth(&again, &read, &read_secret).unwrap();
        assert!(fs::read(&again).unwrap() == fs::read(&whole).unwrap());
    }
}

#[test]
fn what_is_missing_or_other_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, parts) = (folder.path().join("lists"), folder.path().join("parts"));
    lists(&whole, 100);
    let read = || stage::read_neighborhoods(&parts, 100, 1);
    let line = || read().unwrap_err().to_string();
    split(&whole, 30, &parts).unwrap();
    assert!(read().unwrap() == stage::read_neighborhoods(&whole, 100, 1).unwrap());
    let second = parts.join("part-000001.parquet");
    let kept = fs::read(&second).unwrap();
    fs::remove_file(&second).unwrap();
    assert!(
        line().ends_with("expected part-000001.parquet, as in _manifest.json, found no such file")
    );
    fs::copy(parts.join("part-000003.parquet"), &second).unwrap();
    assert!(line().contains("part-000001.parquet: expected 30 rows in "), "{}", line());
    fs::write(&second, &kept).unwrap();
    fs::write(parts.join("part-000009.parquet"), &kept).unwrap();
    assert!(line().ends_with("found also part-000009.parquet"), "{}", line());
    fs::remove_file(parts.join("part-000009.parquet")).unwrap();
    assert!(read().is_ok());
    fs::write(parts.join("_manifest.json"), "{}").unwrap();
    assert!(line().contains("_manifest.json: unlift: expected the metadata of the parts"));

    // Without a manifest, as an engine writes it: rows are ordered by slot, other files are
    // skipped.
    fs::remove_file(parts.join("_manifest.json")).unwrap();
    for name in ["_SUCCESS", ".part-000000.parquet.crc", "notes.txt"] {
        fs::write(parts.join(name), "x").unwrap();
    }
    assert!(read().is_ok());
    fs::rename(parts.join("part-000000.parquet"), parts.join("part-zzz.parquet")).unwrap();
    assert!(read().unwrap() == stage::read_neighborhoods(&whole, 100, 1).unwrap());
    // A part of another kind.
    let (original, secret) = maps::truth::<3>(1, 40);
    stage::write_truth(&second, &original, &secret).unwrap();
    assert!(
        line().ends_with("expected the metadata of the other parts, found others"),
        "{}",
        line()
    );
    fs::write(&second, "PAR1").unwrap();
    assert!(line().contains("part-000001.parquet: expected a Parquet file"), "{}", line());
    let empty = tempfile::tempdir().unwrap();
    let error = stage::peek(empty.path()).unwrap_err().to_string();
    assert!(error.ends_with("found a folder without .parquet"), "{error}");
}

#[test]
fn parts_of_an_earlier_split_never_stay_beside_new_ones() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, parts) = (folder.path().join("lists"), folder.path().join("parts"));
    lists(&whole, 100);
    split(&whole, 20, &parts).unwrap();
    let error = split(&whole, 50, &parts).unwrap_err().to_string();
    assert!(error.ends_with("expected a folder without other parts, found part-000002.parquet"));
    assert!(stage::read_neighborhoods(&parts, 100, 1).is_ok());
    lists(&whole, 90);
    assert_eq!(split(&whole, 20, &parts).unwrap(), 5);
    assert!(stage::read_neighborhoods(&parts, 90, 1).is_ok());
    // An input is never replaced.
    let split = Split::open(&parts, 20).unwrap();
    let rules = Rules::new([parts.as_path()], true);
    let error = split.outputs(&parts, rules).unwrap_err().to_string();
    assert!(error.contains("expected a file that is not read"), "{error}");
}
