//! The stages as a user chains them: the audit's figures, and no file of another map.

mod common;

use common::Place;
use serde_json::Value;
use unlift::About;
use unlift::recover::{Estimate, Recovered};
use unlift::truth::Original;
use unlift_io::stage::{
    read_neighborhoods, read_recovered, read_truth, write_neighborhoods, write_recovered,
    write_truth,
};

const POINTS: u32 = 400;

/// A small room with made-up descriptors.
struct Stages(Place);

impl std::ops::Deref for Stages {
    type Target = Place;

    fn deref(&self) -> &Place {
        &self.0
    }
}

impl Stages {
    fn new() -> Self {
        let place = Place::with_room(POINTS as usize);
        let rows = unlift::synthetic::room(1, POINTS as usize).points;
        let mut bytes = b"P3DESC01".to_vec();
        bytes.extend(u64::from(POINTS).to_le_bytes());
        bytes.extend(128u32.to_le_bytes());
        bytes.extend(1u32.to_le_bytes());
        (0..u64::from(POINTS)).for_each(|id| bytes.extend(id.to_le_bytes()));
        for row in &rows {
            let wave = |c: u32| {
                let phase = row[0] + row[1] * f64::from(c % 3) + row[2] * f64::from(c % 5);
                (60.0 + 55.0 * (phase + f64::from(c * c)).sin()) as u8
            };
            bytes.extend((0..128).map(wave));
        }
        std::fs::write(place.path("d.bin"), bytes).expect("a writable folder");
        Self(place)
    }

    fn json(&self, line: &str) -> Value {
        serde_json::from_str(&self.ends(line, 0).0).expect("JSON")
    }

    /// An obfuscation, oracle lists and recovered points in the folder `name`.
    fn chain(&self, name: &str, scheme: &str, seed: u32) {
        let map = "room.csv --scale 1 --k 10 --descriptors d.bin";
        self.ends(&format!("obfuscate {map} --scheme {scheme} --seed {seed} --out {name}"), 0);
        let oracle = format!("neighbors oracle {name}/truth.parquet --k 10 --inlier-ratio 0.5");
        self.ends(&format!("{oracle} --seed {seed} --out {name}-lists"), 0);
        let recover = format!("recover {name}/released.parquet --neighbors {name}-lists");
        self.ends(&format!("{recover} --seed {seed} --out {name}-back"), 0);
    }
}

fn remove(row: &mut Value, name: &str) -> Option<Value> {
    row.as_object_mut().and_then(|row| row.remove(name))
}

/// The same `--seed` everywhere: `evaluate` prints the row of the audit, figure by figure.
#[test]
fn the_stages_print_the_row_of_the_audit() {
    let place = Stages::new();
    for scheme in ["ppl", "cp"] {
        place.chain("hidden", scheme, 7);
        let audit = format!(
            "audit map room.csv --scale 1 --k 10 --descriptors d.bin --seed 7 --schemes {scheme} \
             --inlier-ratios 0.5 --neighbors oracle --neighbors overlap --neighbors geometric --json"
        );
        let audit = place.json(&audit);
        for source in ["oracle", "overlap", "geometric"] {
            if source != "oracle" {
                let find = format!("neighbors find hidden/released.parquet --source {source}");
                place.ends(&format!("{find} --seed 7 --out hidden-lists"), 0);
                let recover = "recover hidden/released.parquet --neighbors hidden-lists --seed 7";
                place.ends(&format!("{recover} --out hidden-back"), 0);
            }
            let staged = place.json("evaluate hidden-back --truth hidden/truth.parquet --json");
            let rows = audit["results"].as_array().expect("rows");
            // The strongest attack of a source may have rows of other solvers beside it.
            let row = rows.iter().find(|r| r["neighbors"] == source && r["solver"] == "joint");
            let mut row = row.expect("a row").as_object().expect("a row").clone();
            for name in ["scheme", "neighbors", "oracle_noise", "inlier_ratio", "k", "solver"] {
                assert!(row.remove(name).is_some(), "{name}");
            }
            // Of the lists alone, as their ratio and K.
            row.remove("metrics");
            row.retain(|name, _| staged.get(name).is_some() || !name.starts_with("records_alone"));
            assert!(staged["sure_unknown"].is_string(), "{scheme} {source}");
            assert_eq!(Value::Object(row), staged, "{scheme} {source}");
        }
    }
}

/// The same of many images in one file, whatever the number of threads.
#[test]
fn the_stages_of_images_print_the_row_of_the_audit() {
    let place = Place::with_photos(&["a.png", "b.png", "c/d.png"]);
    let ends = |line: &str| place.ends(line, 0);
    let json = |line: &str| -> Value { serde_json::from_str(&ends(line).0).expect("JSON") };
    ends("features photos --out f.h5");
    for scheme in ["lines2d", "cp2d", "dcl2d"] {
        ends(&format!("obfuscate f.h5 --scheme {scheme} --seed 7 --out hidden"));
        let audit = json(&format!(
            "audit images f.h5 --k 10 --seed 7 --schemes {scheme} --inlier-ratios 0.5 --neighbors oracle \
             --neighbors overlap --solver joint --json"
        ));
        for row in audit["results"].as_array().expect("rows") {
            match row["neighbors"].as_str() {
                Some("oracle") => ends(
                    "neighbors oracle hidden/truth.parquet --k 10 --inlier-ratio 0.5 --seed 7 --out lists",
                ),
                _ => ends(
                    "neighbors find hidden/released.parquet --source overlap --seed 7 --threads 1 --out lists",
                ),
            };
            let recover = "recover hidden/released.parquet --neighbors lists --seed 7";
            ends(&format!("{recover} --threads 1 --out one"));
            ends(&format!("{recover} --threads 2 --out back"));
            let bytes = |name: &str| std::fs::read(place.path(name)).unwrap();
            assert!(bytes("one") == bytes("back"), "{scheme}");
            let staged = json("evaluate back --truth hidden/truth.parquet --json");
            let mut row = row.clone();
            for name in ["scheme", "neighbors", "oracle_noise", "inlier_ratio", "k", "solver"] {
                assert!(remove(&mut row, name).is_some(), "{name}");
            }
            // Of the lists alone, as their ratio and K.
            remove(&mut row, "metrics");
            assert!(staged["sure_unknown"].is_string(), "{scheme}");
            assert_eq!(row, staged, "{scheme}");
        }
    }
    // Files of another obfuscation, and of maps.
    ends("obfuscate f.h5 --scheme lines2d --seed 8 --out other");
    let (_, stderr) = place.ends("evaluate back --truth other/truth.parquet", 3);
    assert!(stderr.starts_with("unlift: back: fingerprint: expected "), "{stderr}");
    let (_, stderr) = place.ends("obfuscate f.h5 --scheme lines2d --scale 1 --out x", 2);
    assert_eq!(stderr, "unlift: --scale: expected with a map, found lines2d, which hides images\n");
    let (_, stderr) = place.ends("neighbors find hidden/released.parquet --source geometric", 2);
    assert_eq!(stderr, "unlift: --source geometric: expected with a map, found images\n");
}

#[test]
fn parts_are_what_the_file_is() {
    let stages = Stages::new();
    for scheme in ["ppl", "ray"] {
        stages.chain(scheme, scheme, 1);
        let parts = |file: &str, out: &str| {
            let line = format!("split {scheme}{file} --rows 99 --out {scheme}{out}");
            stages.ends(&line, 0).0
        };
        let told = parts("-lists", "/lists");
        assert_eq!(
            told,
            format!("neighborhoods of slots: 400 rows in 4 parts, in {scheme}/lists\n")
        );
        parts("/released.parquet", "/released");
        parts("/truth.parquet", "/truth");
        let bytes = |file: &str| std::fs::read(stages.path(&format!("{scheme}{file}"))).unwrap();
        let recover = format!("recover {scheme}/released --neighbors {scheme}/lists --seed 1");
        stages.ends(&format!("{recover} --out {scheme}/again"), 0);
        assert!(bytes("/again") == bytes("-back"), "{scheme}");
        parts("-back", "/back");
        let evaluate = |back: &str, truth: &str| {
            let released = format!("--released {scheme}/released.parquet");
            stages.ends(&format!("evaluate {scheme}{back} --truth {scheme}{truth} {released}"), 0).0
        };
        assert_eq!(evaluate("/back", "/truth"), evaluate("-back", "/truth.parquet"));
        let audit = |released: &str, truth: &str, out: &str| {
            let line =
                format!("audit released {scheme}{released} --truth {scheme}{truth} --name x");
            let plan = format!("--k 10 --inlier-ratios 0.5 --seed 1 --json --force --out {out}");
            let audit = stages.json(&format!("{line} {plan}"));
            let rows = audit["results"].as_array().expect("rows");
            assert!(!rows.is_empty());
            rows.clone()
        };
        let whole = audit("/released.parquet", "/truth.parquet", "whole");
        assert_eq!(audit("/released", "/truth", "parts"), whole);
        std::fs::remove_file(stages.path(&format!("{scheme}/lists/part-000003.parquet"))).unwrap();
        let line = format!("recover {scheme}/released --neighbors {scheme}/lists --out none");
        let expected = "expected part-000003.parquet, as in _manifest.json, found no such file\n";
        assert!(stages.ends(&line, 3).1.ends_with(expected));
        // What cannot be written is told before the work.
        let refused =
            stages.ends(&format!("split {scheme}-lists --rows 300 --out {scheme}/truth"), 2);
        assert!(refused.1.contains("expected a folder without other parts"), "{}", refused.1);
        stages.ends(&format!("split {scheme}/released/_manifest.json --out {scheme}/none"), 3);
    }
}

#[test]
fn files_of_another_map_are_refused() {
    let place = Stages::new();
    place.chain("one", "ppl", 1);
    // As many points and records; only the released content differs.
    place.chain("two", "ppl", 2);
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
        let (stdout, stderr) = place.ends(line, 3);
        assert!(stdout.is_empty() && stderr.lines().count() == 1, "{line}\n{stderr}");
        assert!(stderr.starts_with(&format!("unlift: {file}: fingerprint: expected ")), "{stderr}");
        assert!(stderr.contains(&format!("that of the released map of {of}, found ")), "{stderr}");
        assert!(!place.path("x").exists(), "{line}");
    }
}

/// What somebody else wrote does not say which map it is of: it is taken, and told, unless its positions lie where
/// only those of another map would.
#[test]
fn files_that_do_not_say_are_taken_with_a_note() {
    let place = Stages::new();
    place.chain("one", "ppl", 1);
    place.chain("two", "ppl", 2);
    let at = |name: &str| place.path(name);
    let records = POINTS as usize / 2;
    let lists = read_neighborhoods(&at("one-lists"), records, 2).unwrap();
    write_neighborhoods(&at("bare-lists"), &lists.with_about(About::default())).unwrap();
    let recover = "recover one/released.parquet --neighbors bare-lists --out bare-back --seed 1";
    let (_, stderr) = place.ends(recover, 0);
    assert!(stderr.contains("unlift: note: bare-lists: says not which released map"), "{stderr}");
    assert!(stderr.contains("says not what its rows are counted by"), "{stderr}");

    let back = read_recovered::<3>(&at("one-back")).unwrap();
    write_recovered(&at("bare-back"), &back.with_about(About::default())).unwrap();
    let line = "evaluate bare-back --truth one/truth.parquet --json";
    let (stdout, stderr) = place.ends(line, 0);
    assert_eq!(stderr.lines().count(), 2, "{stderr}");
    let bare: Value = serde_json::from_str(&stdout).unwrap();
    let stated = place.json("evaluate one-back --truth one/truth.parquet --json");
    for threshold in ["0.10", "0.25"] {
        let share = |row: &Value| row["recovered_percent"][threshold].as_f64().unwrap();
        assert!(share(&bare) >= share(&stated), "{threshold}");
    }

    let (stdout, stderr) = place.ends("evaluate bare-back --truth two/truth.parquet", 3);
    assert!(stdout.is_empty(), "{stdout}");
    let start = "unlift: bare-back: positions: expected nearer to their own records or points than to those of others";
    assert!(stderr.starts_with(start), "{stderr}");
}

/// Rows in another order, and a truth in another scale, with the fingerprint of the right one copied: next to nothing comes back,
/// as if the scheme protected the map.
#[test]
fn what_does_not_belong_together_is_not_believed_for_its_fingerprint() {
    let place = Stages::new();
    for scheme in ["olc", "ppl", "plane", "cp"] {
        let out = format!("{scheme}-of");
        place.chain(&out, scheme, 1);
        let truth = place.path(&out).join("truth.parquet");
        let (_, stderr) =
            place.ends(&format!("evaluate {out}-back --truth {out}/truth.parquet"), 0);
        assert_eq!(stderr, "", "{scheme}");

        let back = read_recovered::<3>(&place.path(&format!("{out}-back"))).unwrap();
        let n = back.n_slots();
        // All rows in other places, or of every fifth place: once seen by where they lie, once told.
        let rolled = |slot: usize| (slot + 8) % n;
        let some = |slot: usize| if slot % 20 < 4 { rolled(slot) } else { slot };
        for (name, code) in [("rolled", 3), ("some", 0)] {
            let of = |slot| if name == "rolled" { rolled(slot) } else { some(slot) };
            let estimates: Vec<Estimate<3>> =
                (0..n).map(|slot| estimate(&back, of(slot))).collect();
            let (origin, unit) = (back.origin(), back.unit());
            let moved = Recovered::try_new(&estimates, false, None, origin, unit, 0.1).unwrap();
            write_recovered(&place.path(name), &moved.with_about(back.about())).unwrap();
            let line = format!("evaluate {name} --truth {out}/truth.parquet --json");
            let (stdout, stderr) = place.ends(&line, code);
            assert!(stderr.contains("their own records"), "{scheme}, {name}: {stderr}");
            assert_eq!(stdout.contains("their own records"), code == 0, "{scheme}: {stdout}");
        }

        let (original, secret) = read_truth::<3>(&truth).unwrap();
        let larger = original.reveal().scaled(1.3, original.reveal().unit()).unwrap();
        write_truth(&place.path("larger"), &Original::new(larger), &secret).unwrap();
        let line = format!("evaluate {out}-back --truth larger --released {out}/released.parquet");
        let (_, stderr) = place.ends(&line, 0);
        assert!(
            stderr.contains("truth: ") && stderr.contains("away from their own records"),
            "{stderr}"
        );
    }
}

/// The estimate of one slot.
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

/// What makes figures smaller than those of the whole map is said.
#[test]
fn a_thinned_map_is_told() {
    let place = Stages::new();
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc --inlier-ratios 0.5 --quiet";
    let (_, stderr) = place.ends(&format!("{audit} --max-points 200"), 0);
    let note = "unlift: note: --max-points: 200 of 400 points are audited";
    assert!(stderr.contains(note), "{stderr}");
    // Whoever reads only the page or the JSON file is told as well.
    for file in ["audit.json", "report.html"] {
        let written = std::fs::read_to_string(place.path("unlift-audit").join(file)).unwrap();
        assert!(written.contains(&note["unlift: note: ".len()..]), "{file}");
    }
    let (_, stderr) = place.ends(&format!("{audit} --max-points 400"), 0);
    assert!(!stderr.contains("--max-points"), "{stderr}");
}
