//! Output streams: unread pipes, full disks, and names with terminal control characters.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use crate::common::{Place, texts};

#[test]
fn an_interrupt_tells_what_was_done_and_that_nothing_is_written() {
    let place = Place::with_room(3000);
    place.write_descriptors("other.bin", &unlift::synthetic::room(2, 3000).points, 128);
    let line = "audit map room.csv --scale 1 --descriptors other.bin --repeats 9 --out a";
    let mut program = place.program(line.split(' ')).stderr(Stdio::piped()).spawn().unwrap();
    // The doubt about the descriptors is told when the work starts.
    let mut stderr = BufReader::new(program.stderr.take().unwrap());
    let mut told = String::new();
    stderr.read_line(&mut told).unwrap();
    let killed = Command::new("kill").args(["-INT", &program.id().to_string()]).status().unwrap();
    stderr.read_to_string(&mut told).unwrap();
    assert_eq!((killed.success(), program.wait().unwrap().code()), (true, Some(130)), "{told}");
    assert!(told.contains("unlift: interrupted at ") && told.contains("nothing is written"));
    assert!(!place.path("a/audit.json").exists());
}

#[test]
fn a_reader_that_has_enough_ends_the_output_and_a_full_disk_is_an_error() {
    let place = Place::with_room(200);
    let hide = "obfuscate room.csv --schemes olc --k 10 --seed 1 --out hidden";
    for line in ["schemes", "--help", "models", hide] {
        let done = place.shell(&format!("{{ unlift {line} 2>errors; echo $? >code; }} | true"));
        assert_eq!(place.text("code"), "0\n", "{line}: {done:?}");
        assert!(!place.text("errors").contains("stdout"), "{line}");
        if cfg!(target_os = "linux") {
            let done = place.shell(&format!("unlift {line} >/dev/full"));
            let told = texts(&done).1;
            assert_eq!(done.status.code(), Some(3), "{line}: {told}");
            let full = "unlift: stdout: expected space to write, found a full disk";
            assert_eq!(told.lines().last(), Some(full), "{line}");
            let both = place.shell(&format!("unlift {line} >/dev/full 2>&1"));
            assert_eq!(both.status.code(), Some(3), "{line}");
        }
    }
}

/// `NO_COLOR` disables colors, also where a terminal or `CLICOLOR_FORCE` would have them.
#[test]
fn no_name_reaches_the_terminal_as_it_is() {
    let odd = "\x1b]0;owned\x07\u{9b}2J\u{202e}gpj\u{2028}\nunlift: done";
    let place = Place::with_photos();
    fs::rename(place.path("photos/a.png"), place.path(&format!("photos/{odd}.png"))).unwrap();
    place.write(&format!("photos/{odd}.jpg"), "no photo");
    fs::rename(place.path("photos"), place.path(odd)).unwrap();
    let (file, folder) = (format!("{odd}.h5"), format!("{odd}a"));
    for words in [
        &["features", odd, "--out", "x.h5"][..],
        &["features", odd, "--out", &file],
        &["audit", "images", odd, "--inlier-ratios", "1", "--out", &folder, "--quiet"],
        &["audit", "images", odd, "--inlier-ratios", "1", "--out", &folder],
        &["invert", odd, "--out", "pictures"],
        &["schemes", odd],
        &["features", "gone", &format!("--{odd}")],
        &["audit", "map", odd, "--out", odd],
    ] {
        let mut program = place.program(words.iter().copied());
        let output = program.env("NO_COLOR", "1").env("CLICOLOR_FORCE", "1").output().unwrap();
        let (stdout, stderr) = texts(&output);
        let text = stdout + &stderr;
        let is_obeyed = |c: &char| *c != '\n' && unlift::is_obeyed(*c);
        assert_eq!(text.chars().find(is_obeyed), None, "{text:?}");
        assert!(!text.lines().any(|line| line.starts_with("unlift: done")), "{text}");
        assert!(text.contains("]0;owned"), "{text}");
    }
}
