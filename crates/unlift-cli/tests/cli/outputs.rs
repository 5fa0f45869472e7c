//! User files are never lost: beside an output, at its path, or as an input. `faults` tests
//! interrupts.

use std::fs;
use std::path::Path;

use crate::common::Place;

const QUICK: &str = "--k 10 --schemes olc --inlier-ratios 1 --quiet";

#[test]
fn files_beside_an_audit_survive_and_a_strangers_audit_json_is_refused() {
    let place = Place::with_room(200);
    place.write("site/src/app.ts", "precious");
    // As `npm audit --json > audit.json` writes it, and an empty file.
    for foreign in ["", r#"{"auditReportVersion": 2, "vulnerabilities": {}}"#] {
        place.write("site/audit.json", foreign);
        assert_eq!(
            place.complains(&format!("audit map room.csv {QUICK} --out site"), 2),
            "unlift: --out: site/audit.json: expected nothing, or an audit.json of an earlier run \
             (else --force), found another file\n"
        );
        assert_eq!(place.text("site/audit.json"), foreign);
    }
    for more in ["--force", "", "--write-clouds", "--share-safe"] {
        place.ends(&format!("audit map room.csv {QUICK} --out site {more}"), 0);
        assert_eq!(place.text("site/src/app.ts"), "precious");
    }
    place.write("mine/file", "precious");
    assert_eq!(
        place.complains(&format!("audit map room.csv {QUICK} --out mine/file"), 2),
        "unlift: --out: mine/file: expected a folder, or nothing, found a file\n"
    );
    assert!(!place.path("unlift-audit").exists());
}

#[test]
fn the_current_folder_is_a_place_like_any_other() {
    let place = Place::with_room(200);
    let oracle = "neighbors oracle truth.parquet --inlier-ratio 1 --k 10 --out lists.parquet";
    for _ in 0..2 {
        place.ends(&format!("audit map room.csv {QUICK} --out ."), 0);
        place.ends("obfuscate room.csv --scheme olc --k 10 --out .", 0);
        place.ends(oracle, 0);
    }
    let lists = place.bytes("lists.parquet");
    place.ends("obfuscate room.csv --scheme olc --k 10 --out .", 0);
    assert!(place.bytes("lists.parquet") == lists, "lists survive the next obfuscation");
    let outputs = ["audit.json", "lists.parquet", "released.parquet", "report.html", "room.csv"];
    assert_eq!(place.files(), [&outputs[..], &["truth.parquet"]].concat());
}

#[test]
fn inputs_are_never_written_over() {
    let place = Place::with_room(200);
    let fixture = "../unlift-io/tests/data/project/database.db";
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join(fixture), place.path("database.db"))
        .unwrap();
    fs::hard_link(place.path("database.db"), place.path("hard.h5")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(place.path("database.db"), place.path("soft.h5")).unwrap();
    place.write_photo("photos/p.jpg", 0);
    place.ends("obfuscate room.csv --scheme olc --k 10 --out x", 0);
    let oracle = "neighbors oracle x/truth.parquet --inlier-ratio 1 --k 10 --out";
    place.ends(&format!("{oracle} x/lists.parquet"), 0);
    let recover = "recover x/released.parquet --neighbors x/lists.parquet --out";
    place.ends(&format!("{recover} x/back.parquet"), 0);
    let files = || -> Vec<(String, Vec<u8>)> {
        place.files().into_iter().map(|name| (name.clone(), place.bytes(&name))).collect()
    };
    let before = files();
    let mut lines = vec![
        "features database.db --out database.db".to_owned(),
        "features database.db --out ./photos/../database.db".to_owned(),
        "features database.db --out hard.h5".to_owned(),
        "features photos --out photos/p.jpg".to_owned(),
        format!("{oracle} x/truth.parquet"),
        format!("{oracle} x/released.parquet"),
        "neighbors find x/released.parquet --source geometric --out x/released.parquet".to_owned(),
        format!("{recover} x/lists.parquet"),
        format!("{recover} x/released.parquet"),
    ];
    if cfg!(unix) {
        lines.push("features database.db --out soft.h5".to_owned());
    }
    for line in lines {
        for force in ["", " --force"] {
            let told = place.complains(&format!("{line}{force}"), 2);
            assert!(told.contains("expected a file that is not read, found the input"), "{told}");
        }
    }
    for (line, expected) in [
        // The next run would read this file as a photo.
        ("features photos --out photos/new.jpg", "a name that is not read as a photo"),
        // Stage files of another kind are not replaced.
        (
            &format!("{recover} x/truth.parquet"),
            "a file of recovered points of an earlier run (else --force)",
        ),
    ] {
        let told = place.complains(line, 2);
        assert!(told.contains(expected), "{told}");
    }
    assert!(files() == before);
    place.ends(&format!("{recover} x/back.parquet"), 0);
}

#[test]
fn a_map_given_as_a_cloud_is_no_place_for_its_own_clouds() {
    let place = Place::with_room(200);
    let audit = |map: &str| format!("audit map {map} {QUICK} --write-clouds --out a");
    place.ends(&audit("room.csv"), 0);
    fs::rename(place.path("a/clouds/original.ply"), place.path("kept.ply")).unwrap();
    fs::hard_link(place.path("kept.ply"), place.path("a/clouds/original.ply")).unwrap();
    let before = place.bytes("kept.ply");
    let told = place.complains(&audit("kept.ply"), 2);
    assert!(told.contains("found the input kept.ply"), "{told}");
    assert_eq!(place.bytes("a/clouds/original.ply"), before);
}

#[test]
fn features_of_others_are_not_replaced_and_our_own_are() {
    let place = Place::with_photos(&["a.png"]);
    let foreign = [b"\x89HDF\r\n\x1a\n".as_slice(), &[7; 500]].concat();
    place.write("features.h5", &foreign);
    assert_eq!(
        place.complains("features photos", 2),
        "unlift: --out: features.h5: expected nothing, or features of an earlier run (else --force), \
         found another file\n"
    );
    assert_eq!(place.bytes("features.h5"), foreign);
    place.ends("features photos --force", 0);
    place.ends("features photos", 0);
    assert_eq!(place.files(), ["features.h5", "photos/a.png"]);
}

#[cfg(unix)]
#[test]
fn what_shows_points_is_for_its_owner_alone() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::with_room(200);
    place.ends("obfuscate room.csv --scheme olc --k 10 --out hidden", 0);
    let lists = "--inlier-ratio 1 --k 10 --out lists.parquet";
    place.ends(&format!("neighbors oracle hidden/truth.parquet {lists}"), 0);
    place.ends("recover hidden/released.parquet --neighbors lists.parquet --out back.parquet", 0);
    place.ends(&format!("audit map room.csv {QUICK} --write-clouds --out a"), 0);
    place.ends(&format!("audit map room.csv {QUICK} --share-safe --out b"), 0);
    place.write_photo("photos/p.png", 0);
    place.ends("invert photos --out pictures/new", 0);
    let mode = |name: &str| fs::metadata(place.path(name)).unwrap().permissions().mode() & 0o777;
    let usual = mode("room.csv");
    assert_ne!(usual, 0o600, "the test needs a mask that lets others read");
    let files = "hidden/truth.parquet lists.parquet back.parquet a/audit.json a/report.html a/clouds/original.ply \
                 a/clouds/olc-obfuscated.obj a/clouds/olc-recovered-1-joint.ply pictures/new/p.png.png";
    for (names, expected) in [
        ("hidden a a/clouds pictures pictures/new", 0o700),
        (files, 0o600),
        ("hidden/released.parquet b/audit.json b/report.html", usual),
    ] {
        for name in names.split_whitespace() {
            assert_eq!(mode(name), expected, "{name}: {:o}", mode(name));
        }
    }
}
