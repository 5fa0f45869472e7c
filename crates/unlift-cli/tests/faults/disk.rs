//! A disk that is full: one line that names the output, nothing left, and what stood there is still there.

use std::process::Command;

use crate::bench::Bench;
use crate::commands::{Writes, named, quick};
use crate::tree::Tree;
use crate::verdict::{Found, of_failure};
use crate::{full, tables};

const FULL: &str = "expected space to write, found a full disk";
const PAGE: usize = 4096;

/// What lets a shell mount a disk that nobody else sees, where anything does.
fn unshared() -> Option<&'static str> {
    let works = |options: &str| {
        let line = format!("unshare {options} sh -c 'mount -t tmpfs none /mnt'");
        Command::new("sh").args(["-c", &line]).output().is_ok_and(|done| done.status.success())
    };
    ["-Urm", "-m"].into_iter().find(|options| works(options))
}

#[test]
fn a_full_disk_costs_nothing_that_was_there() {
    let Some(unshared) = unshared() else {
        println!("no disk can be mounted here: not tested");
        return;
    };
    let bench = Bench::new();
    let cases: Vec<_> = match full() {
        true => quick().filter(|case| case.writes != Writes::Nothing).collect(),
        false => ["obfuscate", "features", "invert", "audit map"].map(named).into(),
    };
    let mut rows = Vec::new();
    for case in cases {
        let known = bench.known(case);
        let [mut worked, mut told] = [0; 2];
        let steps = if full() { 10 } else { 3 };
        for step in 0..=steps {
            let had_old = step % 2 == 1;
            bench.begin(had_old.then_some(&known.old));
            // On a disk with as much room beside what is there, which is copied back as it is in the end.
            let pages = |tree: &Tree| tree.size().div_ceil(PAGE) + tree.names().count();
            let room = 1 + pages(&known.new) * step / steps;
            let size = PAGE * (room + if had_old { pages(&known.old) } else { 0 });
            let before = format!(
                "exec unshare {unshared} sh -c '\
                 cp -r . ../kept && mount -t tmpfs -o size={size} none . && cd ../work && \
                 cp -r ../kept/. . || exit 99; \
                 \"$0\" \"$@\"; code=$?; cp -r . ../after; exit $code' \"$0\" \"$@\""
            );
            let ended = bench.run(Some(&before), &case.line());
            let left = Tree::of(&bench.path("after")).settled();
            for folder in ["kept", "after"] {
                std::fs::remove_dir_all(bench.path(folder)).unwrap();
            }
            let what = format!("{}, {room} pages", case.name);
            match of_failure(case, &known, had_old, (&ended, &left)) {
                Ok(Found::Worked) => worked += 1,
                Ok(_) => told += 1,
                Err(told) => panic!("{what}: {told}: {ended:?}"),
            }
            let is_named = ended.stderr.lines().any(|line| line.ends_with(FULL));
            assert!(ended.code == Some(0) || is_named, "{what}: {ended:?}");
            assert!(!ended.stderr.contains(".partial"), "{what}: {ended:?}");
        }
        let cells = [steps + 1, worked, told].map(|n| n.to_string());
        rows.push([case.name.to_owned()].into_iter().chain(cells).collect());
    }
    tables::print("Full disks", &["command", "runs", "worked", "told in a line"], &rows);
}
