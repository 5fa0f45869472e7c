//! User files are never lost: beside an output, at its path, or as an input.

use std::fs;
#[cfg(unix)]
use std::os::unix::fs::{PermissionsExt, symlink};

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
    assert_eq!([place.n_entries(""), place.n_entries("site")], [2, 3]);
}

#[test]
fn inputs_are_never_written_over() {
    let place = Place::with_room(200);
    place.ends("obfuscate room.csv --schemes olc --k 10 --out x", 0);
    let before = place.bytes("x/truth.npz");
    #[cfg(unix)]
    symlink(place.path("room.csv"), place.path("soft.h5")).unwrap();
    let oracle = "neighbors x/released.npz --neighbors oracle --inlier-ratios 1";
    let expected = "expected a file that is not read, found the input";
    let lines = [
        ("features room.csv --out room.csv", 2, expected),
        ("features room.csv --out ./x/../room.csv", 2, expected),
        #[cfg(unix)]
        ("features room.csv --out soft.h5", 2, expected),
        (&format!("{oracle} --truth x/truth.npz --out x/truth.npz"), 2, expected),
    ];
    place.refuses("", &lines);
    assert_eq!(place.bytes("x/truth.npz"), before);
    // Only the owner may read what shows points.
    #[cfg(unix)]
    for (name, is_private) in [("x/released.npz", false), ("x/truth.npz", true)] {
        let mode = fs::metadata(place.path(name)).unwrap().permissions().mode();
        assert_eq!(mode & 0o077 == 0, is_private, "{name}: {mode:o}");
    }
}
