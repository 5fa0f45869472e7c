//! The stages, one after another: they give the results of an audit, and refuse files of another
//! map.

use std::fs;

use serde_json::Value;

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
    let oracle = format!(
        "neighbors {name}/released.npz --source oracle --truth {name}/truth.npz --k 10 --inlier-ratio 0.5"
    );
    place.ends(&format!("{oracle} --seed {seed} --out {name}-lists"), 0);
    let truth = place.path(name).join("truth.npz");
    fs::rename(&truth, place.path("away")).unwrap();
    let recover = format!("recover {name}/released.npz --neighbors {name}-lists");
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
        place.ends(&format!("audit map {map} --schemes {scheme} {sources} --out a"), 0);
        let audit = place.json("a/audit.json");
        for (source, n_listed) in [("oracle", 10), ("overlap", 35), ("geometric", 50)] {
            if source != "oracle" {
                let find = format!("neighbors hidden/released.npz --source {source}");
                let (told, _) = place.ends(&format!("{find} --seed 7 --out hidden-lists"), 0);
                let expected = format!(
                    "{POINTS} neighborhoods of up to {n_listed} by {source}, in hidden-lists\n"
                );
                assert_eq!(told, expected);
                let recover = "recover hidden/released.npz --neighbors hidden-lists --seed 7";
                place.ends(&format!("{recover} --out hidden-back"), 0);
            }
            let staged = place.prints("evaluate hidden-back --truth hidden/truth.npz --json", 0);
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
        let line = "neighbors hidden/released.npz --source oracle --truth hidden/truth.npz --k 10 --inlier-ratio 0.5 --out lists";
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
        let audit = format!("audit images f.h5 --k 10 --seed 7 --schemes {scheme} {sources}");
        place.ends(&format!("{audit} --out a"), 0);
        for row in place.json("a/audit.json")["results"].as_array().expect("rows") {
            let lists = match row["neighbors"].as_str() {
                Some("oracle") => "oracle --truth hidden/truth.npz --k 10 --inlier-ratio 0.5",
                _ => "overlap",
            };
            let line = format!("neighbors hidden/released.npz --source {lists} --seed 7");
            place.ends(&format!("{line} --out lists"), 0);
            let recover = "recover hidden/released.npz --neighbors lists --seed 7";
            place.ends(&format!("RAYON_NUM_THREADS=1 {recover} --out one"), 0);
            place.ends(&format!("RAYON_NUM_THREADS=2 {recover} --out back"), 0);
            assert!(place.bytes("one") == place.bytes("back"), "{scheme}");
            let staged = place.prints("evaluate back --truth hidden/truth.npz --json", 0);
            assert!(staged["sure_unknown"].is_string(), "{scheme}");
            assert_eq!(as_staged(row, &staged), staged, "{scheme}");
        }
    }
    place.ends("obfuscate f.h5 --scheme lines2d --seed 8 --out other", 0);
    for (line, code, expected) in [
        ("evaluate back --truth other/truth.npz", 3, "back: fingerprint: expected "),
        (
            "obfuscate f.h5 --scheme lines2d --scale 1 --out x",
            2,
            "--scale: expected with a map, found lines2d, which hides images\n",
        ),
        (
            "neighbors hidden/released.npz --source geometric",
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
        ("evaluate one-back --truth two/truth.npz", "one-back", "two/truth.npz"),
        ("recover one/released.npz --neighbors two-lists --out x", "two-lists", "one/released.npz"),
        (
            "neighbors two/released.npz --source oracle --truth one/truth.npz --inlier-ratio 1 --out x",
            "two/released.npz",
            "one/truth.npz",
        ),
    ] {
        let stderr = place.complains(line, 3);
        let expected = format!("that of the released map of {of}, found ");
        assert!(stderr.starts_with(&format!("unlift: {file}: fingerprint: expected ")), "{stderr}");
        assert!(stderr.contains(&expected) && stderr.lines().count() == 1, "{stderr}");
        assert!(!place.path("x").exists(), "{line}");
    }
}
