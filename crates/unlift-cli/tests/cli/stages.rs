//! The stages, one after another: they give the results of an audit, and refuse files of another
//! map.

use std::fs;

use serde_json::Value;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::obfuscate::SCHEMES;
use unlift_io::features::ImageFeatures;

use crate::common::{Place, descriptor, recovered, row, rows};

const POINTS: usize = 400;

fn place() -> Place {
    let place = Place::with_room(POINTS);
    place.write_descriptors("d.bin", &unlift::synthetic::room(1, POINTS).points, 128);
    place
}

/// Runs obfuscation, oracle lists and recovery in the folder `name`. The truth is moved away during
/// recovery.
fn chain(place: &Place, name: &str, scheme: &str, noise: &str, seed: u32) {
    let map = "room.csv --scale 1 --k 10 --descriptors d.bin";
    place.ends(&format!("obfuscate {map} --schemes {scheme} --seed {seed} --out {name}"), 0);
    let oracle = format!(
        "neighbors {name}/released.npz --neighbors oracle --truth {name}/truth.npz --k 10 --inlier-ratios 0.5 \
         --oracle-noise {noise}"
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
    if let Some(interval) = row["interval"].as_object_mut() {
        interval.remove("records_alone_percent");
    }
    Value::Object(row)
}

/// With the same `--seed` everywhere, `evaluate` prints the row of the audit, whatever the scheme and
/// the source of lists.
#[test]
fn the_stages_print_the_row_of_the_audit() {
    let place = place();
    let noises = ["uniform", "near", "clustered"].into_iter().cycle();
    let all = SCHEMES.iter().filter(|entry| entry.dimensions() == 3).map(|entry| entry.name);
    for (scheme, noise) in all.zip(noises) {
        chain(&place, "hidden", scheme, noise, 7);
        let mut sources = vec!["oracle", "similarity", "overlap"];
        // Records of planes alone say nothing about neighbors.
        sources.extend((scheme != "plane").then_some("geometric"));
        let names: String = sources.iter().map(|name| format!(" --neighbors {name}")).collect();
        let map = "room.csv --scale 1 --k 10 --descriptors d.bin --seed 7 --solver joint";
        let oracle = format!("--inlier-ratios 0.5 --oracle-noise {noise}");
        place.ends(&format!("audit map {map} --schemes {scheme} {oracle}{names} --out a"), 0);
        let audit = place.json("a/audit.json");
        assert_eq!(rows(&audit).len(), sources.len(), "{scheme}");
        for source in sources {
            let row = row(&audit, scheme, source);
            if source != "oracle" {
                let find = format!("neighbors hidden/released.npz --neighbors {source}");
                let (told, _) = place.ends(&format!("{find} --seed 7 --out hidden-lists"), 0);
                let expected = format!(" of up to {} by {source}, in hidden-lists\n", row["k"]);
                assert!(told.ends_with(&expected), "{scheme}: {told}");
                let recover = "recover hidden/released.npz --neighbors hidden-lists --seed 7";
                place.ends(&format!("{recover} --out hidden-back"), 0);
            }
            let staged = place.prints("evaluate hidden-back --truth hidden/truth.npz --json", 0);
            assert_eq!(row["oracle_noise"].as_str(), (source == "oracle").then_some(noise));
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
}

/// Writes features of images: one has fewer keypoints than a list has entries, one has a single
/// keypoint, which some schemes do not release.
fn write_features(place: &Place) {
    let image = |(image, n): (usize, usize)| {
        let point = |at: usize| [(at * 97 + 31 * image) % 631, (at * 61 + 17 * image) % 467];
        let keypoints: Vec<[f64; 2]> = (0..n).map(|at| point(at).map(|x| x as f64)).collect();
        let places = keypoints.iter().map(|[x, y]| [x / 90.0, y / 90.0, 0.0]);
        let bytes = places.flat_map(|place| descriptor(&place, 128).collect::<Vec<u8>>()).collect();
        let descriptors = Some(Descriptors::try_new(Values::U8(bytes), 128).unwrap());
        let (name, size) = (format!("c/{image}.png"), Some([640, 480]));
        ImageFeatures { name, size, keypoints, descriptors, ..Default::default() }
    };
    place.write_features("f.h5", [90, 5, 1, 70].into_iter().enumerate().map(image));
}

/// A file of many images gives the row of the audit, for any number of threads.
#[test]
#[rustfmt::skip] // One row per line.
fn the_stages_of_images_print_the_row_of_the_audit() {
    let place = Place::empty();
    write_features(&place);
    for scheme in SCHEMES.iter().filter(|entry| entry.dimensions() == 2).map(|entry| entry.name) {
        place.ends(&format!("obfuscate f.h5 --schemes {scheme} --seed 7 --out hidden"), 0);
        let sources = "--inlier-ratios 0.5 --neighbors oracle --neighbors overlap --solver joint";
        let audit = format!("audit images f.h5 --k 10 --seed 7 --schemes {scheme} {sources}");
        place.ends(&format!("{audit} --out a"), 0);
        for row in rows(&place.json("a/audit.json")) {
            let lists = match row["neighbors"].as_str() {
                Some("oracle") => "oracle --truth hidden/truth.npz --k 10 --inlier-ratios 0.5",
                _ => "overlap",
            };
            let line = format!("neighbors hidden/released.npz --neighbors {lists} --seed 7");
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
    place.ends("obfuscate f.h5 --schemes lines2d --seed 8 --out other", 0);
    place.refuses("", &[
        ("evaluate back --truth other/truth.npz", 3, "unlift: back: fingerprint: expected "),
        ("obfuscate f.h5 --schemes lines2d --scale 1 --out x", 2, "unlift: --scale: expected with a map, found lines2d, which hides images\n"),
        ("neighbors hidden/released.npz --neighbors geometric", 2, "unlift: --neighbors geometric: expected with a map, found images\n"),
    ]);
}

#[test]
#[rustfmt::skip] // One row per line.
fn files_of_another_map_are_refused() {
    let place = place();
    chain(&place, "one", "ppl", "uniform", 1);
    // Both maps have the same number of points and records.
    chain(&place, "two", "ppl", "uniform", 2);
    for (line, file, of) in [
        ("evaluate one-back --truth two/truth.npz", "one-back", "two/truth.npz"),
        ("recover one/released.npz --neighbors two-lists --out x", "two-lists", "one/released.npz"),
        ("neighbors two/released.npz --neighbors oracle --truth one/truth.npz --inlier-ratios 1 --out x", "two/released.npz", "one/truth.npz"),
    ] {
        let stderr = place.complains(line, 3);
        let expected = format!("that of the released map of {of}, found ");
        assert!(stderr.starts_with(&format!("unlift: {file}: fingerprint: expected ")), "{stderr}");
        assert!(stderr.contains(&expected) && stderr.lines().count() == 1, "{stderr}");
    }
    let long = "neighbors one/released.npz --neighbors oracle --truth one/truth.npz --inlier-ratios 1 --k 5000 --out x";
    let stderr = place.complains(long, 3);
    assert!(stderr.starts_with("unlift: one/truth.npz: k: expected between 1 and "), "{stderr}");
    place.refuses("audit released one/released.npz --k 10 --out x --truth", &[
        ("two/truth.npz", 3, "unlift: one/released.npz: fingerprint: expected "),
        ("one/truth.npz --gate olc@1:0.25<=5", 2, "scheme: expected one of released, found olc"),
        ("one/truth.npz --name all", 2, "(not all), found all"),
    ]);
    assert!(!place.path("x").exists());
}

/// A release with a mitigation or protected descriptors has the figures of its audit, and `--audit` prints them.
#[test]
fn a_release_is_made_as_it_was_audited() {
    let place = place();
    let map = "room.csv --scale 1 --k 10 --descriptors d.bin --seed 7";
    let changes = [
        "--mitigate thin:1/2",
        "--protect-descriptors subspace:2:random",
        "--protect-descriptors ldp:16,2,8",
    ];
    let audit = "--neighbors similarity --no-records-alone --solver joint";
    let changed = changes.join(" ");
    place.ends(&format!("audit map {map} {audit} --schemes olc,ppl {changed} --out a"), 0);
    let document = place.json("a/audit.json");
    for (scheme, change, name) in [
        ("ppl", changes[0], "ppl_thin2"),
        ("olc", changes[1], "olc_subspace2.random"),
        ("ppl", changes[1], "ppl_subspace2.random"),
        ("ppl", changes[2], "ppl_ldp16.2.8"),
    ] {
        let release = format!("obfuscate {map} --schemes {scheme} {change} --audit a/audit.json");
        let replaces = place.path("r").exists();
        let (told, notes) = place.ends(&format!("{release} --out r"), 0);
        assert_eq!(notes.contains("an earlier release is replaced"), replaces, "{notes}");
        let row = row(&document, name, "similarity");
        let blind = row["blind_percent"]["0.10"].as_f64().unwrap();
        let percent = recovered(row, "0.10").max(blind);
        let leak = format!("Today, from the released data alone: {percent:.1} % (");
        assert!(told.starts_with(name) && told.contains("\naudited: "), "{told}");
        assert!(told.contains(&leak), "{leak} in {told}");
        place.ends("neighbors r/released.npz --neighbors similarity --seed 7 --out lists", 0);
        place.ends("recover r/released.npz --neighbors lists --seed 7 --out back", 0);
        let staged = place.prints("evaluate back --truth r/truth.npz --json", 0);
        assert_eq!(as_staged(row, &staged), staged, "{name}");
    }
    place.write("other.csv", place.text("room.csv").replacen("0.", "1.", 1));
    let refused = "--audit a/audit.json --out x";
    for (line, expected) in [
        (map.replace("room", "other"), "a/audit.json: hash of the map or images: expected "),
        (format!("{map} --max-points 300"), "points: expected 300, as of this release, found 400"),
        (map.replace("--scale 1", "--scale 2"), "scale: expected 2, as of this release, found 1"),
        (format!("{map} --mitigate bits:2"), "schemes: expected olc_bits2, found olc, "),
    ] {
        let told = place.complains(&format!("obfuscate {line} --schemes olc {refused}"), 3);
        assert!(told.contains(expected) && !place.path("x").exists(), "{told}");
    }
}

/// Our schemes are audited beside given records, on the same points.
#[test]
fn schemes_of_ours_stand_beside_given_records() {
    let place = place();
    chain(&place, "mine", "olc", "uniform", 3);
    let audit = "audit released mine/released.npz --truth mine/truth.npz --k 10 --inlier-ratios 0.5 \
                 --neighbors oracle --neighbors similarity --no-records-alone --solver joint \
                 --out a";
    place.ends(&format!("{audit} --name mine --schemes olc,plane"), 0);
    let document = place.json("a/audit.json");
    let percent = |scheme, by| recovered(row(&document, scheme, by), "0.10");
    assert_eq!(rows(&document).len(), 6, "{document}");
    for by in ["oracle", "similarity"] {
        let (mine, olc) = (percent("mine", by), percent("olc", by));
        assert!((mine - olc).abs() < 5.0 && percent("plane", by) < mine, "{by}: {mine}, {olc}");
    }
    let taken = ("--name olc --schemes olc", 2, "unlift: --name: expected another name");
    place.refuses(audit, &[taken]);
}
