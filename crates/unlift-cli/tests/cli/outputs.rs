//! User files are never lost: beside an output, at its path, or as an input; a killed run leaves no
//! half-written output.

use std::fs;

use crate::common::Place;

const QUICK: &str = "--k 10 --schemes olc --inlier-ratios 1 --quiet";

#[test]
fn files_of_others_survive() {
    let place = Place::with_room(200);
    place.write("site/src/app.ts", "precious");
    // As `npm audit --json > audit.json` writes it, and an empty file.
    for foreign in ["", r#"{"auditReportVersion": 2, "vulnerabilities": {}}"#] {
        place.write("site/audit.json", foreign);
        let told = place.complains(&format!("audit map room.csv {QUICK} --out site"), 2);
        assert!(
            told.starts_with("unlift: --out: site/audit.json: expected nothing, or "),
            "{told}"
        );
        assert_eq!(place.text("site/audit.json"), foreign);
    }
    fs::remove_file(place.path("site/audit.json")).unwrap();
    for more in ["", "--share-safe"] {
        place.ends(&format!("audit map room.csv {QUICK} --out site {more}"), 0);
        assert_eq!(place.text("site/src/app.ts"), "precious");
    }
    let files = ["room.csv", "site/audit.json", "site/report.html", "site/src/app.ts"];
    assert_eq!(place.files(), files);
}

#[test]
fn inputs_are_never_written_over() {
    let place = Place::with_room(200);
    place.ends("obfuscate room.csv --schemes olc --k 10 --out x", 0);
    let before = place.bytes("x/truth.npz");
    #[cfg(unix)]
    std::os::unix::fs::symlink(place.path("room.csv"), place.path("soft.h5")).unwrap();
    for line in [
        "features room.csv --out room.csv",
        "features room.csv --out ./x/../room.csv",
        "neighbors x/released.npz --neighbors oracle --truth x/truth.npz --inlier-ratios 1 --out x/truth.npz",
        #[cfg(unix)]
        "features room.csv --out soft.h5",
    ] {
        let stderr = place.complains(line, 2);
        assert!(stderr.contains("expected a file that is not read, found the input"), "{stderr}");
    }
    assert_eq!(place.bytes("x/truth.npz"), before);
}

/// Outputs that show points are readable by their owner only, whenever the run is killed.
#[cfg(unix)]
#[test]
fn a_killed_run_leaves_the_old_output_and_the_next_one_goes_on() {
    use std::os::unix::fs::PermissionsExt;
    use std::process::Stdio;
    use std::time::Duration;
    let place = Place::with_room(2000);
    let line = "obfuscate room.csv --schemes ppl --k 10 --out x --seed 1";
    place.ends(line, 0);
    let found = || ["x/released.npz", "x/truth.npz"].map(|name| place.bytes(name));
    let old = found();
    for delay in [2, 5, 10, 20, 40, 80] {
        let mut program = place.program(line.split(' '));
        let mut child = program.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(delay));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(found() == old, "killed after {delay} ms");
    }
    place.ends(line, 0);
    assert_eq!(place.files(), ["room.csv", "x/released.npz", "x/truth.npz"]);
    for (name, is_private) in [("x/released.npz", false), ("x/truth.npz", true)] {
        let mode = fs::metadata(place.path(name)).unwrap().permissions().mode();
        assert_eq!(mode & 0o077 == 0, is_private, "{name}: {mode:o}");
    }
}
