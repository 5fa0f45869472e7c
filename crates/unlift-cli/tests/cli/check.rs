//! `unlift check`: runs the audits of a configuration, with one line each.

use std::fs;

use crate::common::Place;

const QUICK: &str = "k = 10\nschemes = [\"olc\"]\ninlier-ratios = [1, 0.5]\nsolver = \"joint\"\n";

/// Creates a folder with `ci/room.csv`, `ci/photos` and this configuration in `ci`.
fn place(config: &str) -> Place {
    let place = Place::empty();
    place.write_photo("ci/photos/a.jpg", 0);
    place.write_photo("ci/photos/b.png", 1);
    place.write_points("ci/room.csv", &unlift::synthetic::room(1, 400).points);
    place.write("ci/unlift.toml", config);
    place
}

#[test]
fn every_audit_is_a_line_and_paths_are_relative_to_the_configuration() {
    let place = place(&format!(
        "[[map]]\npath = \"room.csv\"\nscale = 1\nthresholds = [0.10, 0.250]\n{QUICK}\
         gate = [\"all:0.25<=100\"]\nout = \"map\"\njunit = \"map.xml\"\n\n\
         [[images]]\npath = \"photos\"\nschemes = \"cp2d\"\nk = 5\ninlier-ratios = 1\nout = \"images\"\n\n\
         [[map]]\npath = \"room.csv\"\n{QUICK}gate = [\"olc:1.0<=1\", \"olc:2.5<=100\"]\nout = \"other\"\n\
         share-safe = true\n"
    ));
    let (text, stderr) = place.ends("check ci/unlift.toml --quiet", 1);
    assert!(stderr.is_empty(), "{stderr}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert_eq!(lines[0], "map room.csv: 1 gate held; ci/map/report.html");
    assert_eq!(lines[1], "images photos: audited, no gates; ci/images/report.html");
    let failed = "map room.csv: 1 of 2 gates FAILED: olc:1.0<=1 (found ";
    let of = ", joint, recovered within 1.0 x); ci/other/report.html";
    assert!(lines[2].starts_with(failed) && lines[2].ends_with(of), "{text}");
    for file in ["map/audit.json", "map.xml", "images/report.html", "other/audit.json"] {
        assert!(place.path("ci").join(file).is_file(), "{file}");
    }
    assert!(place.text("ci/map/audit.json").contains("\"0.250\""), "thresholds are names");
    assert!(!place.text("ci/other/audit.json").contains("room"));
    // The results equal those of the command line.
    let line = "audit map ci/room.csv --scale 1 --thresholds 0.10,0.250 --k 10 --schemes olc --inlier-ratios 1,0.5";
    place.ends(&format!("{line} --solver joint --quiet --out b"), 0);
    let results = |name: &str| place.json(name)["results"].clone();
    assert_eq!(results("ci/map/audit.json"), results("b/audit.json"));
}

#[test]
fn an_audit_that_cannot_run_does_not_keep_the_others() {
    let place = Place::with_room(400);
    // The configuration has a default path.
    place.write(
        "unlift.toml",
        format!(
            "[[map]]\npath = \"gone.csv\"\nout = \"a\"\nquiet = true\n\n[[map]]\npath = \"room.csv\"\n{QUICK}\
             gate = \"all:1.0<=100\"\nquiet = true\n"
        ),
    );
    let (text, stderr) = place.ends("check", 3);
    assert_eq!(text, "map room.csv: 1 gate held; unlift-audit/report.html\n");
    let lines: Vec<&str> = stderr.lines().collect();
    assert!(lines[0].starts_with("unlift: unlift.toml:1: [[map]]: gone.csv: "), "{stderr}");
    assert_eq!(lines.last(), Some(&"unlift: unlift.toml: 1 of 2 audits failed to run"));
}

/// A wrong configuration gives one line before any work. Single errors are tested beside the
/// parser.
#[test]
fn what_is_wrong_with_a_configuration_is_one_line_before_any_work() {
    let good = "[[map]]\npath = \"room.csv\"\n";
    for (config, expected) in [
        (format!("{good}scal = 1\n"), ":3: [[map]]: expected one of path, scale, descriptors, "),
        (
            format!("{good}gate = \"all\"\n"),
            ":1: [[map]]: invalid value 'all' for '--gate <GATE>': expected ",
        ),
        (
            format!("{good}\n{good}"),
            ":4: [[map]]: out: expected a place of its own, found unlift-audit, that of line 1",
        ),
        ("[[map]\n".to_owned(), ":1: "),
    ] {
        let place = place(&config);
        let told = place.complains("check ci/unlift.toml", 2);
        assert!(told.starts_with(&format!("unlift: ci/unlift.toml{expected}")), "{told}");
        assert!(told.lines().count() == 1 && !place.path("ci/unlift-audit").exists(), "{told}");
    }
    let told = place("").complains("check", 3);
    assert!(told.starts_with("unlift: unlift.toml: "), "{told}");
}

/// Two outputs at one place, or an output over an input, are refused before any work.
#[test]
fn no_audit_writes_over_another_or_over_what_is_read() {
    let map = |out: &str| format!("[[map]]\npath = \"room.csv\"\n{QUICK}out = \"{out}\"\n");
    let mut wrong: Vec<(String, String)> = Vec::new();
    let links = if cfg!(unix) { &["link", "link/a/.."][..] } else { &[] };
    for other in ["new/../real", "./real", "real/x/.."].iter().chain(links) {
        let expected = format!("expected a place of its own, found {other}, that of line 1");
        wrong.push((map("real") + &map(other), expected));
    }
    let one = "{path=\"room.csv\", out=\"real\"}";
    let expected = "expected a place of its own, found real, that of line 1";
    wrong.push((format!("map = [{one}, {one}]\n"), expected.to_owned()));
    let images = "[[images]]\npath = \"photos\"\nout = \"images\"\n";
    for (key, file) in
        [("junit", "unlift.toml"), ("junit", "photos/a.jpg"), ("junit", "./room.csv")]
    {
        let more = format!("gate = \"all:1.0<=100\"\n{key} = \"{file}\"\nforce = true\n{images}");
        let expected = format!("[[map]]: {key}: expected a file that is not read, found {file}");
        wrong.push((map("real") + &more, expected));
    }
    for (config, expected) in wrong {
        let place = place(&config);
        #[cfg(unix)]
        std::os::unix::fs::symlink("real", place.path("ci/link")).unwrap();
        fs::create_dir(place.path("ci/real")).unwrap();
        let told = place.complains("check ci/unlift.toml", 2);
        assert!(told.contains(&expected), "{told}");
        assert!(!place.path("ci/real/report.html").exists());
        assert_eq!(place.text("ci/unlift.toml"), config);
    }
}
