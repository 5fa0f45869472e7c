//! `--junit`: a file beside the audit that replaces nothing else. Other tests check
//! its content.

use std::fs;

use crate::common::Place;

const AUDIT: &str =
    "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 0.5 --quiet --out a";
const GATES: &str = "--gate all@0.5:0.25<=100 --gate olc:0.25<=1 --gate ppl:0.25:gain<=1";

#[test]
fn gates_are_test_cases() {
    let place = Place::with_room(500);
    fs::create_dir(place.path("my maps")).unwrap();
    fs::rename(place.path("room.csv"), place.path("my maps/room.csv")).unwrap();
    // `ends` splits at spaces.
    #[cfg(unix)]
    std::os::unix::fs::symlink("my maps", place.path("maps+")).unwrap();
    let audit = AUDIT.replace("room.csv", "maps+/room.csv");
    place.ends(&format!("{audit} {GATES} --junit gates.xml"), 1);
    let junit = place.text("gates.xml");
    for part in [
        "<testsuite name=\"maps+/room.csv\" tests=\"3\" failures=\"2\" errors=\"0\"",
        "<testcase name=\"olc:0.25&lt;=1\" classname=\"unlift.olc\">\n      <failure message=\"",
        " % came back, at most 1 % may; olc, oracle at 0.50, ",
    ] {
        assert!(junit.contains(part), "{part}\n{junit}");
    }
    // Files of a share-safe audit do not name the map.
    place.ends(&format!("{audit} {GATES} --junit g.xml --share-safe"), 1);
    assert!(!place.text("g.xml").contains("room"));
}

#[test]
fn images_that_cannot_be_used_are_an_error_beside_the_gates() {
    let place = Place::with_photos(&["a.jpg", "b.png"]);
    place.write("photos/c.png", "no picture");
    let line = "audit images photos --schemes cp2d --inlier-ratios 1 --k 5 --quiet --out a";
    place.ends(&format!("{line} --gate cp2d:10<=100 --junit g.xml"), 3);
    let said = "1 of 3 images could not be used, and are in no figure";
    let junit = place.text("g.xml");
    assert!(junit.contains("failures=\"0\" errors=\"1\""), "{junit}");
    assert!(junit.contains(&format!("<error message=\"{said}\"")), "{junit}");
}

#[test]
fn files_of_gates_replace_their_own_kind_and_nothing_else() {
    let place = Place::with_room(300);
    let line = format!("{AUDIT} --gate all:0.25<=100");
    place.write("theirs.xml", "<?xml version=\"1.0\"?><project/>");
    let own = "expected a file of its own, found one of";
    for (more, expected) in [
        (
            "--junit theirs.xml",
            "--junit: theirs.xml: expected nothing, or gates as JUnit XML of an earlier run (else --force), \
             found another file"
                .to_owned(),
        ),
        (
            "--junit room.csv --force",
            "--junit: room.csv: expected a file that is not read, found the input room.csv".to_owned(),
        ),
        // Over the report of the same run.
        ("--junit a/report.html --force", format!("--junit: a/report.html: {own} --out")),
    ] {
        let told = place.complains(&format!("{line} {more}"), 2);
        assert_eq!(told.lines().next(), Some(&*format!("unlift: {expected}")));
        assert!(!place.path("a").join("audit.json").exists(), "nothing is computed");
    }
    let told = place.complains(&format!("{AUDIT} --junit g.xml"), 2);
    assert!(told.contains("--gate <GATE>"), "without a gate it would say that all held: {told}");
    for _ in 0..2 {
        // Missing folders are created, as for the report.
        place.ends(&format!("{line} --junit new/er/g.xml"), 0);
        assert!(place.path("new/er/g.xml").is_file());
    }
}
