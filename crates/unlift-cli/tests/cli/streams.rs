//! Output streams: unread pipes, full disks, and names with terminal control characters.

use std::fs;

use crate::common::{Place, said};

const HIDE: &str = "obfuscate room.csv --scheme olc --k 10 --seed 1 --out hidden";

#[test]
fn messages_that_nobody_hears_change_nothing() {
    let place = Place::with_room(200);
    let full = cfg!(target_os = "linux").then_some("2>/dev/full");
    for redirection in ["2>&-", "2>&1 | true"].into_iter().chain(full) {
        // Obfuscation with a seed prints a note. Exit codes of errors do not change.
        for (line, code) in [
            (HIDE, "0\n"),
            ("schemes --no-such", "2\n"),
            ("features room.csv --max-features 9", "2\n"),
            ("recover gone.parquet --neighbors x --out y.parquet", "3\n"),
        ] {
            place.shell(&format!("{{ unlift {line}; echo $? >code; }} {redirection}"));
            assert_eq!(place.text("code"), code, "{line} {redirection}");
        }
        assert_eq!(place.names("hidden"), ["released.parquet", "truth.parquet"]);
        fs::remove_dir_all(place.path("hidden")).unwrap();
    }
}

#[test]
fn a_reader_that_has_enough_ends_the_output_and_a_full_disk_is_an_error() {
    let place = Place::with_room(200);
    for line in ["schemes", "--help", "models --json", HIDE] {
        let done = place.shell(&format!("{{ unlift {line} 2>errors; echo $? >code; }} | true"));
        assert_eq!(place.text("code"), "0\n", "{line}: {done:?}");
        assert!(!place.text("errors").contains("stdout"), "{line}");
        if cfg!(target_os = "linux") {
            let done = place.shell(&format!("unlift {line} >/dev/full"));
            let told = said(&done).1;
            assert_eq!(done.status.code(), Some(3), "{line}: {told}");
            let full = "unlift: stdout: expected space to write, found a full disk";
            assert_eq!(told.lines().last(), Some(full), "{line}");
            let both = place.shell(&format!("unlift {line} >/dev/full 2>&1"));
            assert_eq!(both.status.code(), Some(3), "{line}");
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_place_that_cannot_be_written_is_an_error_of_the_command_line() {
    let place = Place::with_photos(&["a.png"]);
    place.write_points("room.csv", &unlift::synthetic::room(1, 200).points);
    place.ends(HIDE, 0);
    let oracle = "neighbors oracle hidden/truth.parquet --inlier-ratio 1 --k 10 --out";
    place.ends(&format!("{oracle} lists.parquet"), 0);
    // Nobody can create a file in /proc.
    for line in [
        "obfuscate room.csv --scheme olc --k 10 --out /proc",
        "audit map room.csv --k 10 --schemes olc --out /proc",
        "audit images photos --out /proc/x",
        "features photos --out /proc/x.h5",
        "invert photos --out /proc/x",
        "recover hidden/released.parquet --neighbors lists.parquet --out /proc/x.parquet",
        "neighbors find hidden/released.parquet --source geometric --out /proc/x.parquet",
        &format!("{oracle} /proc/x.parquet"),
        "demo --out /proc/x",
    ] {
        let stderr = place.complains(line, 2);
        assert!(stderr.starts_with("unlift: --out: /proc"), "{line}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{line}: {stderr}");
    }
    std::os::unix::fs::symlink("gone/features.h5", place.path("link.h5")).unwrap();
    let stderr = place.complains("features photos --out link.h5", 2);
    assert!(stderr.starts_with("unlift: --out: link.h5: cannot write: "), "{stderr}");
}

#[test]
fn no_name_reaches_the_terminal_as_it_is() {
    let odd = "\x1b]0;owned\x07\u{9b}2J\u{202e}gpj\u{2028}\nunlift: done";
    let place = Place::with_photos(&["a.png", "b.png"]);
    fs::rename(place.path("photos/a.png"), place.path(&format!("photos/{odd}.png"))).unwrap();
    place.write(&format!("photos/{odd}.jpg"), "no photo");
    fs::rename(place.path("photos"), place.path(odd)).unwrap();
    let (file, folder) = (format!("{odd}.h5"), format!("{odd}a"));
    for words in [
        &["features", odd, "--out", "x.h5"][..],
        &["features", odd, "--out", &file],
        &["audit", "images", odd, "--inlier-ratios", "1", "--out", &folder, "--json"],
        &["audit", "images", odd, "--inlier-ratios", "1", "--out", &folder],
        &["invert", odd, "--out", "pictures"],
        &["schemes", odd],
        &["features", "gone", &format!("--{odd}")],
        &["audit", "map", odd, "--out", odd],
    ] {
        let output = place.program(words.iter().copied()).output().expect("the program starts");
        let (stdout, stderr) = said(&output);
        let text = stdout + &stderr;
        let is_obeyed = |c: &char| *c != '\n' && unlift::is_obeyed(*c);
        assert_eq!(text.chars().find(is_obeyed), None, "{text:?}");
        assert!(!text.lines().any(|line| line.starts_with("unlift: done")), "{text}");
        assert!(text.contains("]0;owned"), "{text}");
    }
}
