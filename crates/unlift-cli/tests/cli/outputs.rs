//! User files are never lost: beside an output, at its path, or as an input; a killed run leaves no
//! half-written output.

use std::fs;
use std::path::Path;
use std::time::Duration;

use crate::common::Place;

const QUICK: &str = "--k 10 --schemes olc --inlier-ratios 1 --quiet";

#[test]
fn files_of_others_survive() {
    let place = Place::with_room(200);
    place.write("site/src/app.ts", "precious");
    // As `npm audit --json > audit.json` writes it, and an empty file.
    for foreign in ["", r#"{"auditReportVersion": 2, "vulnerabilities": {}}"#] {
        place.write("site/audit.json", foreign);
        assert_eq!(
            place.complains(&format!("audit map room.csv {QUICK} --out site"), 2),
            "unlift: --out: site/audit.json: expected nothing, or an audit.json of an earlier run, \
             found another file\n"
        );
        assert_eq!(place.text("site/audit.json"), foreign);
    }
    fs::remove_file(place.path("site/audit.json")).unwrap();
    for more in ["", "--share-safe"] {
        place.ends(&format!("audit map room.csv {QUICK} --out site {more}"), 0);
        assert_eq!(place.text("site/src/app.ts"), "precious");
    }
    assert_eq!(
        place.files(),
        ["room.csv", "site/audit.json", "site/report.html", "site/src/app.ts"]
    );
}

#[test]
fn inputs_are_never_written_over() {
    let place = Place::with_room(200);
    let fixture = "../unlift-io/tests/data/project/database.db";
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join(fixture), place.path("database.db"))
        .unwrap();
    place.ends("obfuscate room.csv --schemes olc --k 10 --out x", 0);
    let before = place.bytes("x/truth.npz");
    #[cfg(unix)]
    std::os::unix::fs::symlink(place.path("database.db"), place.path("soft.h5")).unwrap();
    for line in [
        "features database.db --out database.db",
        "features database.db --out ./x/../database.db",
        "neighbors x/released.npz --neighbors oracle --truth x/truth.npz --inlier-ratios 1 --out x/truth.npz",
        #[cfg(unix)]
        "features database.db --out soft.h5",
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
    let place = Place::with_room(2000);
    let line = |seed: u32| format!("obfuscate room.csv --schemes ppl --k 10 --out x --seed {seed}");
    place.ends(&line(1), 0);
    let old: Vec<_> = place.names("x").iter().map(|n| place.bytes(&format!("x/{n}"))).collect();
    for delay in [2, 5, 10, 20, 40, 80] {
        let mut child = place.start(&line(1));
        std::thread::sleep(Duration::from_millis(delay));
        child.kill().unwrap();
        child.wait().unwrap();
        let left = place.names("x").into_iter().filter(|name| !name.starts_with('.'));
        let left: Vec<_> = left.map(|name| place.bytes(&format!("x/{name}"))).collect();
        assert!(left == old, "killed after {delay} ms");
    }
    place.ends(&line(1), 0);
    let names = place.names("x");
    assert_eq!(names.len(), 2, "{names:?}");
    for name in names {
        let mode = fs::metadata(place.path(&format!("x/{name}"))).unwrap().permissions().mode();
        assert_eq!(mode & 0o077 == 0, name.starts_with("truth"), "{name}: {mode:o}");
    }
}
