//! `unlift check`: the audits of a configuration, each in one line, by one word.

mod common;

use std::fs;

use common::Place;

const QUICK: &str = "k = 10\nschemes = [\"olc\"]\ninlier-ratios = [1, 0.5]\nsolver = \"joint\"\n";

/// A folder with `ci/room.csv`, `ci/photos` and this configuration in `ci`.
fn place(config: &str) -> Place {
    let place = Place::with_photos(&["a.jpg", "b.png"]);
    fs::create_dir(place.path("ci")).unwrap();
    place.write_points("ci/room.csv", &unlift::synthetic::room(1, 400).points);
    fs::rename(place.path("photos"), place.path("ci/photos")).unwrap();
    fs::write(place.path("ci/unlift.toml"), config).unwrap();
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
    assert!(
        lines[2].starts_with(failed)
            && lines[2].ends_with(", joint, recovered within 1.0 x); ci/other/report.html"),
        "{text}"
    );
    for file in ["map/audit.json", "map.xml", "images/report.html", "other/audit.json"] {
        assert!(place.path("ci").join(file).is_file(), "{file}");
    }
    let audit = fs::read_to_string(place.path("ci/map/audit.json")).unwrap();
    assert!(audit.contains("\"0.250\""), "thresholds are names: {audit}");
    let safe = fs::read_to_string(place.path("ci/other/audit.json")).unwrap();
    assert!(!safe.contains("room"), "{safe}");
}

#[test]
fn the_example_of_the_help_runs_and_its_gates_point_to_the_configuration() {
    let place = place(&format!(
        "[[map]]\npath = \"room.csv\"\n{QUICK}\n[[map]]\npath = \"room.csv\"\n{QUICK}\
         gate = [\"all@0.5:1.0<=1\"]\nout = \"audits/office\"\njunit = \"audits/office.xml\"\n\
         sarif = \"more/office.sarif\"\nshare-safe = true\n"
    ));
    for config in ["ci/unlift.toml".to_owned(), place.path("ci/unlift.toml").display().to_string()]
    {
        place.ends(&format!("check {config} --quiet"), 1);
        assert!(place.path("ci/audits/office.xml").is_file());
        let text = fs::read_to_string(place.path("ci/more/office.sarif")).unwrap();
        let log: serde_json::Value = serde_json::from_str(&text).unwrap();
        let result = &log["runs"][0]["results"][0];
        let at = &result["locations"][0]["physicalLocation"];
        assert_eq!(at["artifactLocation"]["uri"], "ci/unlift.toml");
        assert_eq!(at["region"]["startLine"], 8);
        let said = result["message"]["text"].as_str().unwrap();
        assert!(said.contains("; olc, oracle at 0.50, joint, recovered within 1.0 x"), "{said}");
    }
}

#[test]
fn figures_are_those_of_the_command_line() {
    let place = place(&format!("[[map]]\npath = \"room.csv\"\n{QUICK}out = \"a\"\n"));
    place.ends("check ci/unlift.toml --quiet", 0);
    let line =
        "audit map ci/room.csv --k 10 --schemes olc --inlier-ratios 1,0.5 --solver joint --quiet";
    place.ends(&format!("{line} --out b"), 0);
    let results = |name: &str| {
        let text = fs::read_to_string(place.path(name)).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap()["results"].clone()
    };
    assert_eq!(results("ci/a/audit.json"), results("b/audit.json"));
}

#[test]
fn one_word_is_enough() {
    let place = place("");
    let config =
        format!("[[map]]\npath = \"ci/room.csv\"\n{QUICK}gate = \"all:1.0<=100\"\nquiet = true\n");
    fs::write(place.path("unlift.toml"), config).unwrap();
    let (text, _) = place.ends("check", 0);
    assert_eq!(text, "map ci/room.csv: 1 gate held; unlift-audit/report.html\n");
}

#[test]
fn an_audit_that_cannot_run_does_not_keep_the_others() {
    let place = place(&format!(
        "[[map]]\npath = \"gone.csv\"\nout = \"a\"\n\n[[map]]\npath = \"room.csv\"\n{QUICK}\
         gate = \"all:1.0<=1\"\nout = \"b\"\n"
    ));
    let (text, stderr) = place.ends("check ci/unlift.toml --quiet", 3);
    assert!(text.starts_with("map room.csv: 1 of 1 gate FAILED"), "{text}");
    let lines: Vec<&str> = stderr.lines().collect();
    assert!(lines[0].starts_with("unlift: ci/unlift.toml:1: [[map]]: gone.csv: "), "{stderr}");
    assert_eq!(lines.last(), Some(&"unlift: ci/unlift.toml: 1 of 2 audits failed to run"));
}

#[test]
fn what_is_wrong_with_a_configuration_is_one_line_before_any_work() {
    let told = |config: &str, code: i32| {
        let place = place(config);
        let (stdout, stderr) = place.ends("check ci/unlift.toml", code);
        assert!(stdout.is_empty() && !place.path("ci/unlift-audit").exists(), "{stdout}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        stderr.trim_end().to_owned()
    };
    let good = "[[map]]\npath = \"room.csv\"\n";
    let unknown = told(&format!("{good}scal = 1\n"), 2);
    let begin = "unlift: ci/unlift.toml:3: [[map]]: expected one of path, scale, descriptors, ";
    assert!(unknown.starts_with(begin) && unknown.ends_with(", found scal"), "{unknown}");
    assert_eq!(
        told(&format!("{good}gate = \"all\"\n"), 2).split(": expected ").next().unwrap(),
        "unlift: ci/unlift.toml:1: [[map]]: invalid value 'all' for '--gate <GATE>'"
    );
    assert_eq!(
        told(&format!("{good}\n{good}"), 2),
        "unlift: ci/unlift.toml:4: [[map]]: out: expected a place of its own, found unlift-audit, that of line 1"
    );
    let broken = told("[[map]\n", 2);
    assert!(broken.starts_with("unlift: ci/unlift.toml:1: "), "{broken}");
    let (_, stderr) = place("").ends("check", 3);
    assert!(stderr.starts_with("unlift: unlift.toml: "), "{stderr}");
}

/// One place by several names, and outputs over what is read: told before any work.
#[test]
fn no_audit_writes_over_another_or_over_what_is_read() {
    let map = |out: &str| format!("[[map]]\npath = \"room.csv\"\n{QUICK}out = \"{out}\"\n");
    let told = |config: &str| {
        let place = place(config);
        #[cfg(unix)]
        std::os::unix::fs::symlink("real", place.path("ci/link")).unwrap();
        fs::create_dir(place.path("ci/real")).unwrap();
        let (stdout, stderr) = place.ends("check ci/unlift.toml", 2);
        assert!(stdout.is_empty() && !place.path("ci/real/report.html").exists(), "{stdout}");
        assert_eq!(fs::read_to_string(place.path("ci/unlift.toml")).unwrap(), config);
        stderr
    };
    let others = ["new/../real", "./real", "real/x/.."];
    let links = if cfg!(unix) { &["link", "link/a/.."][..] } else { &[] };
    for other in others.iter().chain(links) {
        let stderr = told(&(map("real") + &map(other)));
        assert!(
            stderr.contains(&format!("expected a place of its own, found {other}, that of line 1")),
            "{stderr}"
        );
    }
    let one = "{path=\"room.csv\", out=\"real\"}";
    let stderr = told(&format!("map = [{one}, {one}]\n"));
    assert!(stderr.contains("expected a place of its own, found real, that of line 1"), "{stderr}");
    for (key, file) in
        [("junit", "unlift.toml"), ("sarif", "photos/a.jpg"), ("junit", "./room.csv")]
    {
        let written = format!("gate = \"all:1.0<=100\"\n{key} = \"{file}\"\nforce = true\n");
        let images = "[[images]]\npath = \"photos\"\nout = \"images\"\n";
        let stderr = told(&format!("{}{written}{images}", map("real")));
        assert!(
            stderr.contains(&format!(
                "[[map]]: {key}: expected a file that is not read, found {file}"
            )),
            "{stderr}"
        );
    }
}
