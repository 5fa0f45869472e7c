//! Tests of outputs under faults: kills, limits, two writers at one place.

#![cfg(unix)]

#[path = "../common/mod.rs"]
mod common;

mod bench;

use std::os::unix::fs::MetadataExt;
use std::process::{Child, Command};
use std::thread::sleep;

use bench::{Bench, CASES, Case, Known, Tree, finish};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The earlier output, or nothing.
    Before,
    New,
    /// Some files of each, all complete.
    Some,
}

/// Returns the state of the output. Every file must be a complete old or new one, a partial file, or
/// a finished image, from which the next run of `features` resumes.
fn state(known: &Known, earlier: &Tree, left: &Tree, what: &str) -> State {
    let mut files = left.clone();
    files.0.retain(|name, _| !name.contains(".partial") && !name.contains(".parts/"));
    for (name, bytes) in &files.0 {
        let of = |tree: &Tree| tree.0.get(name) == Some(bytes);
        assert!(of(&known.new) || of(earlier), "{what}: {name}, {} bytes, is neither", bytes.len());
    }
    match () {
        () if files == known.new => State::New,
        () if files == *earlier => State::Before,
        () => State::Some,
    }
}

#[derive(Clone, Copy, Debug)]
enum Moment {
    /// After this share of the usual duration.
    Share(f64),
    /// When an unfinished file appears.
    Begun,
    /// When the first file is in its place; others may follow.
    Placed,
}

/// Waits for the moment, or for the end of the run.
fn wait(bench: &Bench, known: &Known, child: &mut Child, moment: Moment) {
    let inodes = || -> Vec<Option<u64>> {
        let places = known.new.0.keys().map(|name| bench.work().join(name));
        places.map(|path| path.metadata().ok().map(|found| found.ino())).collect()
    };
    let at_first = inodes();
    if let Moment::Share(share) = moment {
        sleep(known.took.mul_f64(share));
    }
    while child.try_wait().expect("a state").is_none() {
        let has_come = match moment {
            Moment::Share(_) => true,
            Moment::Begun => bench.tree().has_partial(),
            Moment::Placed => inodes() != at_first,
        };
        if has_come {
            break;
        }
    }
}

#[test]
fn a_kill_at_any_moment_leaves_all_of_the_old_or_all_of_the_new() {
    let bench = Bench::new();
    let nothing = Tree::default();
    let mut n_unfinished = 0;
    for (at, case) in CASES.iter().enumerate() {
        let known = bench.known(case);
        // The moments are the same in every run, and differ between cases.
        let share = Moment::Share(0.1 + (at * 23 % 90) as f64 / 100.0);
        let aimed = if at.is_multiple_of(3) { Moment::Placed } else { Moment::Begun };
        let (signal, expected) = if at.is_multiple_of(2) { ("INT", 130) } else { ("TERM", 143) };
        for (moment, signal, had_old) in [(share, signal, at % 4 < 2), (aimed, "KILL", at % 4 < 3)]
        {
            let what = format!("{case:?}, {signal} at {moment:?}");
            bench.begin(had_old.then_some(&known.old));
            let earlier = if had_old { &known.old } else { &nothing };
            let mut child = bench.start(None, &case.line(2));
            wait(&bench, &known, &mut child, moment);
            // The run may have ended already.
            let id = child.id().to_string();
            let _ = Command::new("kill").args([&format!("-{signal}"), &id]).output();
            let ended = finish(child);
            let left = bench.tree();
            let found = state(&known, earlier, &left, &what);
            // Files are renamed one by one, so `kill -9` may come between two.
            assert!(found != State::Some || case.is_each || signal == "KILL", "{what}: {ended:?}");
            // Before the handler is installed, the signal itself ends the program.
            let is_usual = [None, Some(0), Some(expected)].contains(&ended.code);
            assert!(signal == "KILL" || is_usual && !left.has_partial(), "{what}: {ended:?}");
            n_unfinished += usize::from(left.has_partial());
            bench.goes_on(case, &known, &what);
        }
    }
    assert!(n_unfinished >= CASES.len() / 3, "only {n_unfinished} kills met work");
}

/// Runs a case under each limit, alternately with and without an earlier output. It must leave the
/// complete output, or the earlier one and an error with its code.
fn sweep(bench: &Bench, case: &Case, known: &Known, option: &str, limits: &[usize]) {
    let nothing = Tree::default();
    for (at, limit) in limits.iter().enumerate() {
        let earlier = if at % 2 == 1 { &known.old } else { &nothing };
        bench.begin(Some(earlier));
        let what = format!("{case:?}, ulimit {option} {limit}");
        let ended = finish(bench.start(Some(&format!("ulimit {option} {limit}")), &case.line(2)));
        let mut left = bench.tree();
        if option == "-n" && left.has_partial() {
            // Without file descriptors folders cannot be emptied; the next run does it.
            bench.goes_on(case, known, &what);
            left.0.retain(|name, _| !name.contains(".partial"));
        }
        assert!(!left.has_partial(), "{what}");
        let found = state(known, earlier, &left, &what);
        let is_told = ended
            .stderr
            .lines()
            .all(|line| line.starts_with("unlift: ") || line.starts_with("  try: "));
        match ended.code {
            Some(0) => assert_eq!(found, State::New, "{what}"),
            Some(2 | 3) => {
                assert!(is_told && (case.is_each || found == State::Before), "{what}: {ended:?}");
                let names_limit = ended.stderr.contains("found a limit on the size of files");
                assert!(option != "-f" || names_limit, "{what}: {ended:?}");
            }
            _ => panic!("{what}: {ended:?}"),
        }
    }
    bench.goes_on(case, known, option);
}

#[test]
fn few_open_files_or_small_ones_leave_all_or_nothing() {
    let bench = Bench::new();
    for case in [0, 4, 5, 6, 8].map(|at| &CASES[at]) {
        let known = bench.known(case);
        sweep(&bench, case, &known, "-n", &[5, 6, 7, 8, 10, 13, 16]);
        // Most shells count blocks of 512 bytes, some of 1024.
        let blocks = known.new.0.values().map(Vec::len).max().unwrap_or(0) / 500 + 4;
        sweep(&bench, case, &known, "-f", &[0, blocks / 2, blocks]);
    }
}

#[test]
fn of_two_writers_one_whole_output_stays() {
    let bench = Bench::new();
    for (at, case) in CASES.iter().enumerate() {
        let known = bench.known(case);
        bench.begin((at % 2 == 1).then_some(&known.old));
        let children = [1, 2].map(|variant| bench.start(None, &case.line(variant)));
        let ended = children.map(finish);
        let is_refused = ended
            .each_ref()
            .map(|ended| ended.code == Some(2) && ended.stderr.contains("no other run"));
        assert_ne!(is_refused, [true; 2], "{case:?}: {ended:?}");
        for (ended, is_refused) in ended.iter().zip(is_refused) {
            assert!(ended.code == Some(0) || is_refused, "{case:?}: {ended:?}");
        }
        let left = bench.tree();
        assert!(!left.has_partial(), "{case:?}");
        let found = state(&known, &known.old, &left, "two writers");
        assert!(found != State::Some || case.is_each, "{case:?}: {ended:?}");
    }
}
