//! What the program says, and to whom: streams that nobody reads, disks that are full, names that a terminal obeys.

#![cfg(unix)]

mod common;

use std::fs;
use std::process::{Command, Output, Stdio};

use common::Place;

const HIDE: &str = "obfuscate room.csv --scheme olc --k 10 --seed 1 --out hidden";

/// What a line of the shell does, `unlift` being the program.
fn shell(place: &Place, line: &str) -> Output {
    Command::new("sh")
        .args(["-c", &line.replace("unlift", env!("CARGO_BIN_EXE_unlift"))])
        .current_dir(place.path(""))
        .stdin(Stdio::null())
        .output()
        .expect("a shell")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// The names in a folder, sorted.
fn names(place: &Place, folder: &str) -> Vec<String> {
    let entries = fs::read_dir(place.path(folder)).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn messages_that_nobody_hears_change_nothing() {
    let place = Place::with_room(200);
    let mut redirections = vec!["2>&-", "2>&1 | true"];
    if cfg!(target_os = "linux") {
        redirections.push("2>/dev/full");
    }
    for redirection in redirections {
        // It has something to say: whose seed is known, the records can be undone.
        let done = shell(&place, &format!("{{ unlift {HIDE}; echo $? >code; }} {redirection}"));
        assert!(done.status.success());
        assert_eq!(fs::read_to_string(place.path("code")).unwrap(), "0\n", "{redirection}");
        assert_eq!(names(&place, "hidden"), ["released.parquet", "truth.parquet"]);
        fs::remove_dir_all(place.path("hidden")).unwrap();
        // Errors of the command line, of options and of files keep their codes.
        for (line, code) in [
            ("schemes --no-such", "2\n"),
            ("features room.csv --max-features 9", "2\n"),
            ("recover gone.parquet --neighbors x --out y.parquet", "3\n"),
        ] {
            shell(&place, &format!("{{ unlift {line}; echo $? >code; }} {redirection}"));
            assert_eq!(
                fs::read_to_string(place.path("code")).unwrap(),
                code,
                "{line} {redirection}"
            );
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_stdout_does_not_take_are_an_error() {
    let place = Place::with_room(200);
    for line in ["schemes", "models --json", "--help", HIDE] {
        let done = shell(&place, &format!("unlift {line} >/dev/full"));
        let stderr = text(&done.stderr);
        assert_eq!(done.status.code(), Some(3), "{line}: {stderr}");
        assert_eq!(
            stderr.lines().last(),
            Some("unlift: stdout: expected space to write, found a full disk"),
            "{line}"
        );
        let both = shell(&place, &format!("unlift {line} >/dev/full 2>&1"));
        assert_eq!(both.status.code(), Some(3), "{line}");
    }
}

#[test]
fn a_reader_that_has_enough_ends_the_output_quietly() {
    let place = Place::with_room(200);
    for line in ["schemes", "--help", "models --json"] {
        let done = shell(&place, &format!("{{ unlift {line}; echo $? >code; }} | true"));
        assert_eq!(fs::read_to_string(place.path("code")).unwrap(), "0\n", "{line}");
        assert_eq!(text(&done.stderr), "", "{line}");
    }
}

#[test]
fn a_limit_on_the_size_of_files_is_one_line_that_names_the_output() {
    let place = Place::with_room(2000);
    fs::create_dir(place.path("photos")).unwrap();
    common::photo(0).save(place.path("photos/a.png")).unwrap();
    let before = names(&place, "");
    for (line, output) in [
        (HIDE, "hidden/truth.parquet"),
        (
            "audit map room.csv --k 10 --schemes olc --inlier-ratios 1 --quiet --out a",
            "a/report.html",
        ),
        ("features photos --out f.h5", "f.h5"),
        ("invert photos --out pictures", "pictures/a.png.png"),
    ] {
        let done = shell(&place, &format!("ulimit -f 1; exec unlift {line}"));
        let stderr = text(&done.stderr);
        assert_eq!(done.status.code(), Some(3), "{line}: {stderr}");
        let told = format!(
            "unlift: {output}: expected space to write, found a limit on the size of files"
        );
        assert!(stderr.lines().any(|line| line == told), "{line}: {stderr}");
        assert!(!stderr.contains(".partial") && !stderr.contains(".part."), "{stderr}");
        // Finished parts stay for the next run.
        let _ = fs::remove_dir(place.path("f.h5.parts"));
        let _ = fs::remove_dir(place.path("pictures"));
        assert_eq!(names(&place, ""), before, "{line}");
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
    // No file can be made in /proc, whoever asks.
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
        let (stdout, stderr) = place.ends(line, 2);
        assert_eq!(stdout, "", "{line}");
        assert!(stderr.starts_with("unlift: --out: /proc"), "{line}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{line}: {stderr}");
    }
}

#[test]
fn a_link_to_nothing_is_named() {
    let place = Place::with_photos(&["a.png"]);
    std::os::unix::fs::symlink("gone/features.h5", place.path("link.h5")).unwrap();
    let (_, stderr) = place.ends("features photos --out link.h5", 2);
    assert_eq!(
        stderr,
        "unlift: --out: link.h5: expected a file, a folder, or nothing, found a link to \
         gone/features.h5, which is not there\n"
    );
}

#[test]
fn no_name_reaches_the_terminal_as_it_is() {
    let odd = "\x1b]0;owned\x07\u{9b}2J\u{202e}gpj\u{2028}\nunlift: done";
    let place = Place::with_photos(&["a.png", "b.png"]);
    fs::rename(place.path("photos/a.png"), place.path(&format!("photos/{odd}.png"))).unwrap();
    fs::write(place.path(&format!("photos/{odd}.jpg")), "no photo").unwrap();
    fs::rename(place.path("photos"), place.path(odd)).unwrap();
    let run = |args: &[&str]| {
        let done = Command::new(env!("CARGO_BIN_EXE_unlift"))
            .args(args)
            .current_dir(place.path(""))
            .output()
            .expect("the program starts");
        let said = [text(&done.stdout), text(&done.stderr)];
        for text in &said {
            let obeyed: Vec<char> =
                text.chars().filter(|&c| c != '\n' && unlift::is_obeyed(c)).collect();
            assert!(obeyed.is_empty(), "{obeyed:?} in {text:?}");
            assert!(!text.lines().any(|line| line.starts_with("unlift: done")), "{text}");
        }
        assert!(said.concat().contains("]0;owned"), "{said:?}");
        said
    };
    run(&["features", odd, "--out", "x.h5"]);
    run(&["features", odd, "--out", &format!("{odd}.h5")]);
    run(&["audit", "images", odd, "--inlier-ratios", "1", "--out", &format!("{odd}a"), "--json"]);
    run(&["audit", "images", odd, "--inlier-ratios", "1", "--out", &format!("{odd}a")]);
    run(&["invert", odd, "--out", "pictures"]);
    run(&["metrics", odd, "pictures"]);
    run(&["schemes", odd]);
    run(&["features", "gone", &format!("--{odd}")]);
    run(&["audit", "map", odd, "--out", odd]);
}
