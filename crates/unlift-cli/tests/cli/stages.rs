//! The stages, one after another: they give the results of an audit, and refuse files of another
//! map.

use std::fs;

use serde_json::Value;
use unlift::About;
use unlift::recover::{Estimate, Recovered};
use unlift::truth::Original;
use unlift_io::stage::{
    read_neighborhoods, read_recovered, read_truth, write_neighborhoods, write_recovered,
    write_truth,
};

use crate::common::Place;

const POINTS: usize = 400;

fn place() -> Place {
    let place = Place::with_room(POINTS);
    place.write_descriptors("d.bin", &unlift::synthetic::room(1, POINTS).points, 128);
    place
}

/// Runs obfuscation, oracle lists and recovery in the folder `name`. The truth is moved away during
/// recovery.
fn chain(place: &Place, name: &str, scheme: &str, seed: u32) {
    let map = "room.csv --scale 1 --k 10 --descriptors d.bin";
    place.ends(&format!("obfuscate {map} --scheme {scheme} --seed {seed} --out {name}"), 0);
    let oracle = format!("neighbors oracle {name}/truth.parquet --k 10 --inlier-ratio 0.5");
    place.ends(&format!("{oracle} --seed {seed} --out {name}-lists"), 0);
    let truth = place.path(name).join("truth.parquet");
    fs::rename(&truth, place.path("away")).unwrap();
    let recover = format!("recover {name}/released.parquet --neighbors {name}-lists");
    place.ends(&format!("{recover} --seed {seed} --out {name}-back"), 0);
    fs::rename(place.path("away"), truth).unwrap();
}

/// Returns a row of an audit as `evaluate` prints it, without what depends on the lists alone.
fn as_staged(row: &Value, staged: &Value) -> Value {
    let mut row = row.as_object().expect("a row").clone();
    for name in ["scheme", "neighbors", "oracle_noise", "inlier_ratio", "k", "solver"] {
        assert!(row.remove(name).is_some(), "{name}");
    }
    row.remove("metrics");
    row.retain(|name, _| staged.get(name).is_some() || !name.starts_with("records_alone"));
    Value::Object(row)
}

/// With the same `--seed` everywhere, `evaluate` prints the row of the audit.
#[test]
fn the_stages_print_the_row_of_the_audit() {
    let place = place();
    let sources =
        "--inlier-ratios 0.5 --neighbors oracle --neighbors overlap --neighbors geometric";
    for scheme in ["ppl", "cp"] {
        chain(&place, "hidden", scheme, 7);
        let map = "room.csv --scale 1 --k 10 --descriptors d.bin --seed 7";
        let audit =
            place.prints(&format!("audit map {map} --schemes {scheme} {sources} --json"), 0);
        for (source, n_listed) in [("oracle", 10), ("overlap", 35), ("geometric", 50)] {
            if source != "oracle" {
                let find = format!("neighbors find hidden/released.parquet --source {source}");
                let (told, _) = place.ends(&format!("{find} --seed 7 --out hidden-lists"), 0);
                let expected = format!(
                    "{POINTS} neighborhoods of up to {n_listed} by {source}, in hidden-lists\n"
                );
                assert_eq!(told, expected);
                let recover = "recover hidden/released.parquet --neighbors hidden-lists --seed 7";
                place.ends(&format!("{recover} --out hidden-back"), 0);
            }
            let staged =
                place.prints("evaluate hidden-back --truth hidden/truth.parquet --json", 0);
            let rows = audit["results"].as_array().expect("rows");
            // A source may also have rows of other solvers.
            let row = rows.iter().find(|r| r["neighbors"] == source && r["solver"] == "joint");
            let row = row.expect("a row");
            assert_eq!(
                (row["k"].as_u64(), row["oracle_noise"].is_null()),
                (Some(n_listed), source != "oracle")
            );
            // More list entries are true if as many nearest neighbors count as a list has entries.
            let at_k = row["metrics"]["inlier_ratio_at_k"].as_f64();
            assert!(
                at_k.is_none() == (source == "oracle")
                    && at_k.is_none_or(|ratio| Some(ratio) > row["inlier_ratio"].as_f64())
            );
            assert!(staged["sure_unknown"].is_string(), "{scheme} {source}");
            assert_eq!(as_staged(row, &staged), staged, "{scheme} {source}");
        }
    }
    let mut files = std::collections::BTreeSet::new();
    for noise in ["uniform", "near", "clustered"] {
        let line = "neighbors oracle hidden/truth.parquet --k 10 --inlier-ratio 0.5 --out lists";
        place.ends(&format!("{line} --oracle-noise {noise}"), 0);
        files.insert(place.bytes("lists"));
    }
    assert_eq!(files.len(), 3, "each noise model has lists of its own");
}

/// A file of many images gives the row of the audit, for any number of threads.
#[test]
fn the_stages_of_images_print_the_row_of_the_audit() {
    let place = Place::with_photos(&["a.png", "b.png", "c/d.png"]);
    place.ends("features photos --out f.h5", 0);
    for scheme in ["lines2d", "cp2d", "dcl2d"] {
        place.ends(&format!("obfuscate f.h5 --scheme {scheme} --seed 7 --out hidden"), 0);
        let sources = "--inlier-ratios 0.5 --neighbors oracle --neighbors overlap --solver joint";
        let audit =
            format!("audit images f.h5 --k 10 --seed 7 --schemes {scheme} {sources} --json");
        for row in place.prints(&audit, 0)["results"].as_array().expect("rows") {
            let lists = match row["neighbors"].as_str() {
                Some("oracle") => "oracle hidden/truth.parquet --k 10 --inlier-ratio 0.5",
                _ => "find hidden/released.parquet --source overlap --threads 1",
            };
            place.ends(&format!("neighbors {lists} --seed 7 --out lists"), 0);
            let recover = "recover hidden/released.parquet --neighbors lists --seed 7";
            place.ends(&format!("{recover} --threads 1 --out one"), 0);
            place.ends(&format!("{recover} --threads 2 --out back"), 0);
            assert!(place.bytes("one") == place.bytes("back"), "{scheme}");
            let staged = place.prints("evaluate back --truth hidden/truth.parquet --json", 0);
            assert!(staged["sure_unknown"].is_string(), "{scheme}");
            assert_eq!(as_staged(row, &staged), staged, "{scheme}");
        }
    }
    place.ends("obfuscate f.h5 --scheme lines2d --seed 8 --out other", 0);
    for (line, code, expected) in [
        ("evaluate back --truth other/truth.parquet", 3, "back: fingerprint: expected "),
        (
            "obfuscate f.h5 --scheme lines2d --scale 1 --out x",
            2,
            "--scale: expected with a map, found lines2d, which hides images\n",
        ),
        (
            "neighbors find hidden/released.parquet --source geometric",
            2,
            "--source geometric: expected with a map, found images\n",
        ),
    ] {
        let stderr = place.complains(line, code);
        assert!(stderr.starts_with(&format!("unlift: {expected}")), "{stderr}");
    }
}

#[test]
fn files_of_another_map_are_refused() {
    let place = place();
    chain(&place, "one", "ppl", 1);
    // Both maps have the same number of points and records.
    chain(&place, "two", "ppl", 2);
    for (line, file, of) in [
        ("evaluate one-back --truth two/truth.parquet", "one-back", "two/truth.parquet"),
        (
            "evaluate one-back --truth one/truth.parquet --released two/released.parquet",
            "two/released.parquet",
            "one/truth.parquet",
        ),
        (
            "recover one/released.parquet --neighbors two-lists --out x",
            "two-lists",
            "one/released.parquet",
        ),
        (
            "neighbors oracle one/truth.parquet --released two/released.parquet --inlier-ratio 1 --out x",
            "two/released.parquet",
            "one/truth.parquet",
        ),
    ] {
        let stderr = place.complains(line, 3);
        let expected = format!("that of the released map of {of}, found ");
        assert!(stderr.starts_with(&format!("unlift: {file}: fingerprint: expected ")), "{stderr}");
        assert!(stderr.contains(&expected) && stderr.lines().count() == 1, "{stderr}");
        assert!(!place.path("x").exists(), "{line}");
    }
}

/// A file without a fingerprint is accepted with a note, unless its positions fit another map
/// better.
#[test]
fn files_that_do_not_say_are_taken_with_a_note() {
    let place = place();
    chain(&place, "one", "ppl", 1);
    chain(&place, "two", "ppl", 2);
    let lists = read_neighborhoods(&place.path("one-lists"), POINTS / 2, 2).unwrap();
    write_neighborhoods(&place.path("bare-lists"), &lists.with_about(About::default())).unwrap();
    let recover = "recover one/released.parquet --neighbors bare-lists --out bare-back --seed 1";
    let (_, stderr) = place.ends(recover, 0);
    assert!(
        stderr.contains("unlift: note: bare-lists: does not name its released map"),
        "{stderr}"
    );
    assert!(stderr.contains("does not state what its rows are counted by"), "{stderr}");

    let back = read_recovered::<3>(&place.path("one-back")).unwrap();
    write_recovered(&place.path("bare-back"), &back.with_about(About::default())).unwrap();
    let (stdout, stderr) = place.ends("evaluate bare-back --truth one/truth.parquet --json", 0);
    assert_eq!(stderr.lines().count(), 2, "{stderr}");
    let bare: Value = serde_json::from_str(&stdout).unwrap();
    let stated = place.prints("evaluate one-back --truth one/truth.parquet --json", 0);
    for threshold in ["0.10", "0.25"] {
        let share = |row: &Value| row["recovered_percent"][threshold].as_f64().unwrap();
        assert!(share(&bare) >= share(&stated), "{threshold}");
    }
    let stderr = place.complains("evaluate bare-back --truth two/truth.parquet", 3);
    let start = "unlift: bare-back: positions: expected nearer to their own records or points than to those of others";
    assert!(stderr.starts_with(start), "{stderr}");
}

/// Files with reordered rows or a scaled truth have the right fingerprint, but almost nothing would
/// come back.
#[test]
fn what_does_not_belong_together_is_not_believed_for_its_fingerprint() {
    let place = place();
    for scheme in ["olc", "ppl", "plane", "cp"] {
        chain(&place, "of", scheme, 1);
        let (_, stderr) = place.ends("evaluate of-back --truth of/truth.parquet", 0);
        assert_eq!(stderr, "", "{scheme}");

        let back = read_recovered::<3>(&place.path("of-back")).unwrap();
        let (n, origin, unit) = (back.n_slots(), back.origin(), back.unit());
        // Reordering all rows is an error; reordering a fifth of them is a note.
        for (name, code) in [("rolled", 3), ("some", 0)] {
            let moves = |slot: usize| name == "rolled" || slot % 20 < 4;
            let of = |slot: usize| if moves(slot) { (slot + 8) % n } else { slot };
            let estimates: Vec<Estimate<3>> =
                (0..n).map(|slot| estimate(&back, of(slot))).collect();
            let moved = Recovered::try_new(&estimates, false, None, origin, unit, 0.1).unwrap();
            write_recovered(&place.path(name), &moved.with_about(back.about())).unwrap();
            let line = format!("evaluate {name} --truth of/truth.parquet --json");
            let (stdout, stderr) = place.ends(&line, code);
            assert!(stderr.contains("their own records"), "{scheme}, {name}: {stderr}");
            assert_eq!(stdout.contains("their own records"), code == 0, "{scheme}: {stdout}");
        }

        let (original, secret) = read_truth::<3>(&place.path("of/truth.parquet")).unwrap();
        let larger = original.reveal().scaled(1.3, original.reveal().unit()).unwrap();
        write_truth(&place.path("larger"), &Original::new(larger), &secret).unwrap();
        let line = "evaluate of-back --truth larger --released of/released.parquet";
        let (_, stderr) = place.ends(line, 0);
        let is_told = stderr.contains("truth: ") && stderr.contains("away from their own records");
        assert!(is_told, "{stderr}");
    }
}

fn estimate(of: &Recovered<3>, slot: usize) -> Estimate<3> {
    let origin = of.origin();
    let position = of.position(slot).unwrap_or([f64::NAN; 3]);
    Estimate {
        position: std::array::from_fn(|axis| (position[axis] - origin[axis]) as f32),
        status: of.status()[slot],
        support: of.support()[slot],
        axis: 0,
        evidence: of.evidence()[slot],
    }
}
