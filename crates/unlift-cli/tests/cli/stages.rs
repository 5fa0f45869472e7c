//! The stages, one after another: they give the results of an audit, and refuse files of another map.

use std::fs;

use serde_json::Value;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::obfuscate::SCHEMES;

use crate::common::{Place, descriptor, recovered, row, rows};

const MAP: &str = "room.csv --scale 1 --k 10 --descriptors d.bin";

/// Makes lists for the release `name` and recovers its points while the truth is away. Returns what
/// `evaluate` prints.
fn staged(place: &Place, name: &str, lists: &str, seed: u32) -> Value {
    let lists = format!("neighbors {name}/released.npz --neighbors {lists} --seed {seed}");
    place.ends(&format!("{lists} --out {name}-lists"), 0);
    let truth = place.path(name).join("truth.npz");
    fs::rename(&truth, place.path("away")).unwrap();
    let recover = format!("recover {name}/released.npz --neighbors {name}-lists --seed {seed}");
    place.ends(&format!("RAYON_NUM_THREADS=2 {recover} --out {name}-back"), 0);
    fs::rename(place.path("away"), truth).unwrap();
    place.prints(&format!("evaluate {name}-back --truth {name}/truth.npz --json"), 0)
}

/// Returns the options for lists by a source; the oracle is one of the release `hidden`.
fn lists_by(source: &str, noise: &str) -> String {
    match source {
        "oracle" => format!(
            "oracle --truth hidden/truth.npz --k 10 --inlier-ratios 0.5 --oracle-noise {noise}"
        ),
        other => other.to_owned(),
    }
}

/// Checks that `evaluate` prints a row of an audit, without what depends on the lists alone.
fn assert_same(row: &Value, staged: &Value) {
    let of_lists =
        ["scheme", "neighbors", "oracle_noise", "inlier_ratio", "k", "solver", "metrics"];
    let mut expected = row.as_object().expect("a row").clone();
    expected.retain(|name, _| {
        let is_of_lists = of_lists.contains(&&**name) || name.starts_with("records_alone");
        staged.get(name).is_some() || !is_of_lists
    });
    if let Some(interval) = expected["interval"].as_object_mut() {
        interval.remove("records_alone_percent");
    }
    assert_eq!(Value::Object(expected), *staged, "{row}");
}

/// With the same `--seed` everywhere, `evaluate` prints the row of the audit, whatever the scheme and the source of lists.
#[test]
fn the_stages_print_the_row_of_the_audit() {
    let place = Place::with_described_room(400, 128);
    let noises = ["uniform", "near", "clustered"].into_iter().cycle();
    let all = SCHEMES.iter().filter(|entry| entry.dimensions() == 3).map(|entry| entry.name);
    for (scheme, noise) in all.zip(noises) {
        place.ends(&format!("obfuscate {MAP} --schemes {scheme} --seed 7 --out hidden"), 0);
        let mut sources = vec!["oracle", "similarity", "overlap"];
        // Records of planes alone say nothing about neighbors.
        sources.extend((scheme != "plane").then_some("geometric"));
        let names: String = sources.iter().map(|name| format!(" --neighbors {name}")).collect();
        let options = format!("--solver joint --inlier-ratios 0.5 --oracle-noise {noise}{names}");
        place.ends(&format!("audit map {MAP} --seed 7 --schemes {scheme} {options} --out a"), 0);
        let audit = place.json("a/audit.json");
        assert_eq!(rows(&audit).len(), sources.len(), "{scheme}");
        for source in sources {
            let row = row(&audit, scheme, source);
            assert_eq!(row["oracle_noise"].as_str(), (source == "oracle").then_some(noise));
            // More list entries are true if as many nearest neighbors count as a list has entries.
            let at_k = row["metrics"]["inlier_ratio_at_k"].as_f64();
            assert_eq!(at_k.is_none(), source == "oracle", "{scheme} {source}");
            assert!(at_k.is_none_or(|ratio| Some(ratio) > row["inlier_ratio"].as_f64()));
            assert!(row["sure_unknown"].is_string(), "{scheme} {source}");
            assert_same(row, &staged(&place, "hidden", &lists_by(source, noise), 7));
        }
    }
}

/// A file of many images gives the row of the audit, for any number of threads.
#[test]
#[rustfmt::skip] // One row per line.
fn the_stages_of_images_print_the_row_of_the_audit() {
    let place = Place::empty();
    let image = |(image, n): (usize, usize)| {
        let point = |at: usize| [(at * 97 + 31 * image) % 631, (at * 61 + 17 * image) % 467];
        let keypoints: Vec<[f64; 2]> = (0..n).map(|at| point(at).map(|x| x as f64)).collect();
        let places = keypoints.iter().map(|[x, y]| [x / 90.0, y / 90.0, 0.0]);
        let bytes = places.flat_map(|place| descriptor(&place, 128).collect::<Vec<u8>>()).collect();
        let descriptors = Some(Descriptors::try_new(Values::U8(bytes), 128).unwrap());
        (format!("c/{image}.png"), keypoints, descriptors)
    };
    // One has fewer keypoints than a list has entries; some schemes do not release a single keypoint.
    place.write_features("f.h5", [90, 5, 1, 70].into_iter().enumerate().map(image));
    for scheme in SCHEMES.iter().filter(|entry| entry.dimensions() == 2).map(|entry| entry.name) {
        place.ends(&format!("obfuscate f.h5 --schemes {scheme} --seed 7 --out hidden"), 0);
        let sources = "--inlier-ratios 0.5 --neighbors oracle --neighbors overlap --solver joint";
        let audit = format!("audit images f.h5 --k 10 --seed 7 --schemes {scheme} {sources}");
        place.ends(&format!("{audit} --out a"), 0);
        for row in rows(&place.json("a/audit.json")) {
            let lists = lists_by(row["neighbors"].as_str().unwrap(), "uniform");
            assert_same(row, &staged(&place, "hidden", &lists, 7));
            assert!(row["sure_unknown"].is_string(), "{scheme}");
            let recover = "recover hidden/released.npz --neighbors hidden-lists --seed 7 --out one";
            place.ends(&format!("RAYON_NUM_THREADS=1 {recover}"), 0);
            assert!(place.bytes("one") == place.bytes("hidden-back"), "{scheme}");
        }
    }
    place.ends("obfuscate f.h5 --schemes lines2d --seed 8 --out other", 0);
    place.refuses("", &[
        ("evaluate hidden-back --truth other/truth.npz", 3, "unlift: hidden-back: fingerprint: expected "),
        ("obfuscate f.h5 --schemes lines2d --scale 1 --out x", 2, "unlift: --scale: expected with a map, found lines2d, which hides images\n"),
        ("neighbors hidden/released.npz --neighbors geometric", 2, "unlift: --neighbors geometric: expected with a map, found images\n"),
    ]);
}

/// Records that are given are audited beside schemes of ours, on the same points, but not with files
/// of another map that has as many points and records.
#[test]
#[rustfmt::skip] // One row per line.
fn given_records_are_audited_with_their_truth_only() {
    let place = Place::with_described_room(400, 128);
    for (name, seed) in [("two", 2), ("hidden", 3)] {
        place.ends(&format!("obfuscate {MAP} --schemes olc --seed {seed} --out {name}"), 0);
    }
    staged(&place, "hidden", &lists_by("oracle", "uniform"), 3);
    let oracle = "--neighbors oracle --truth hidden/truth.npz --inlier-ratios 1 --out x";
    for (line, file, of) in [
        ("evaluate hidden-back --truth two/truth.npz", "hidden-back", "two/truth.npz"),
        ("recover two/released.npz --neighbors hidden-lists --out x", "hidden-lists", "two/released.npz"),
        (&format!("neighbors two/released.npz {oracle}"), "two/released.npz", "hidden/truth.npz"),
    ] {
        let told = place.complains(line, 3);
        assert!(told.starts_with(&format!("unlift: {file}: fingerprint: expected ")), "{told}");
        assert!(told.contains(&format!("that of the released map of {of}, found ")), "{told}");
    }
    let long = format!("{oracle} --k 5000");
    place.refuses("neighbors hidden/released.npz", &[(&long, 3, "unlift: hidden/truth.npz: k: expected between 1 and ")]);
    let audit = "audit released hidden/released.npz --k 10 --truth";
    place.refuses(audit, &[
        ("two/truth.npz --out x", 3, "unlift: hidden/released.npz: fingerprint: expected "),
        ("hidden/truth.npz --out x --gate ppl@1:0.25<=5", 2, "scheme: expected one of olc, found ppl"),
        ("hidden/truth.npz --out x --name all", 2, "(not all), found all"),
        ("hidden/truth.npz --out x --name olc --schemes olc", 2, "unlift: --schemes: expected other schemes"),
    ]);
    assert!(!place.path("x").exists());
    let options = "--inlier-ratios 0.5 --neighbors oracle --neighbors similarity --no-records-alone --solver joint";
    place.ends(&format!("{audit} hidden/truth.npz {options} --out a --name mine --schemes olc,plane"), 0);
    let document = place.json("a/audit.json");
    let percent = |scheme, by| recovered(row(&document, scheme, by), "0.10");
    assert_eq!(rows(&document).len(), 6, "{document}");
    for by in ["oracle", "similarity"] {
        let (mine, olc) = (percent("mine", by), percent("olc", by));
        assert!((mine - olc).abs() < 5.0 && percent("plane", by) < mine, "{by}: {mine}, {olc}");
    }
    // Ours hide the points that a release hides, with its descriptors.
    place.ends(&format!("obfuscate {MAP} --schemes olc --mitigate thin:1/2 --out part"), 0);
    let audit = "audit released part/released.npz --truth part/truth.npz --k 10 --neighbors similarity";
    let (_, notes) = place.ends(&format!("{audit} --name mine --schemes ppl --out b"), 0);
    assert!(notes.contains("points are in no record, and left out"), "{notes}");
    let document = place.json("b/audit.json");
    assert_eq!(document["not_audited"].as_array().map_or(0, Vec::len), 0, "{document}");
    let n = |scheme| row(&document, scheme, "similarity")["n_points"].as_u64();
    assert!(n("mine").is_some() && n("mine") == n("ppl"), "{document}");
}

/// A release with a mitigation or protected descriptors has the figures of its audit, and `--audit` prints them.
#[test]
fn a_release_is_made_as_it_was_audited() {
    let place = Place::with_described_room(400, 128);
    let (map, release) = (format!("{MAP} --seed 7"), "--audit a/audit.json --out");
    let [thin, subspace, ldp] = [
        "--mitigate thin:1/2",
        "--protect-descriptors subspace:2:random",
        "--protect-descriptors ldp:16,2,8",
    ];
    let audit = "--neighbors similarity --no-records-alone --solver joint --schemes olc,ppl";
    place.ends(&format!("audit map {map} {audit} {thin} {subspace} {ldp} --out a"), 0);
    let document = place.json("a/audit.json");
    for (scheme, change, name) in [
        ("ppl", thin, "ppl_thin2"),
        ("olc", subspace, "olc_subspace2.random"),
        ("ppl", subspace, "ppl_subspace2.random"),
        ("ppl", ldp, "ppl_ldp16.2.8"),
    ] {
        let replaces = place.path("r").exists();
        let line = format!("obfuscate {map} --schemes {scheme} {change} {release} r");
        let (told, notes) = place.ends(&line, 0);
        assert_eq!(notes.contains("an earlier release is replaced"), replaces, "{notes}");
        let row = row(&document, name, "similarity");
        let blind = row["blind_percent"]["0.10"].as_f64().unwrap();
        let percent = recovered(row, "0.10").max(blind);
        let leak = format!("Today, from the released data alone: {percent:.1} % (");
        assert!(told.starts_with(name) && told.contains("\naudited: "), "{told}");
        assert!(told.contains(&leak), "{leak} in {told}");
        assert_same(row, &staged(&place, "r", "similarity", 7));
    }
    let gate = "olc:joint:0.10<=0";
    let gated = format!("audit map {map} --no-records-alone --schemes olc --gate {gate} --out b");
    place.ends(&gated, 1);
    let hide = format!("obfuscate {map} --schemes olc --audit b/audit.json --out x");
    let held = format!("gates on this scheme held (all: on every scheme), found {gate}");
    assert!(place.complains(&hide, 3).contains(&held));
    place.write("other.csv", place.text("room.csv").replacen("0.", "1.", 1));
    for (line, expected) in [
        (map.replace("room", "other"), "a/audit.json: hash of the map or images: expected "),
        (format!("{map} --max-points 300"), "points: expected 300, as of this release, found 400"),
        (map.replace("--scale 1", "--scale 2"), "scale: expected 2, as of this release, found 1"),
        (format!("{map} --mitigate bits:2"), "schemes: expected olc_bits2, found olc, "),
    ] {
        place.refuses("obfuscate --schemes olc", &[(&format!("{line} {release} x"), 3, expected)]);
    }
    assert!(!place.path("x").exists());
}
