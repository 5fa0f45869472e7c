//! Limits on open files, file size and memory, full disks, and closed streams: all of the output or
//! none of it, and an error that names it.

use std::process::Command;

use crate::bench::{Bench, Ended};
use crate::commands::{Case, Writes, named, quick};
use crate::full;
use crate::tables;
use crate::tree::{Tree, is_partial};
use crate::verdict::{Found, State, of_failure, state};

const ABORTED: i32 = 6;
const PAGE: usize = 4096;
/// Runs the program after the commands of the shell.
const EXEC: &str = "exec \"$0\" \"$@\"";

/// Counts of how runs under one limit ended.
#[derive(Default)]
struct Row {
    runs: usize,
    worked: usize,
    told: usize,
    /// Ended because memory or threads were refused, without our error.
    refused: usize,
    /// Left unfinished files, which the next run removed.
    swept: usize,
}

impl Row {
    /// Counts a run, which succeeded or reported an error.
    fn add(&mut self, found: Result<Found, String>, what: &str, ended: &Ended) {
        self.runs += 1;
        match found {
            Ok(Found::Worked) => self.worked += 1,
            Ok(_) => self.told += 1,
            Err(told) => panic!("{what}: {told}: {ended:?}"),
        }
        assert!(!ended.stderr.contains(".partial"), "{what}: {ended:?}");
    }
}

/// Returns every quick command in the full version, else those with these names.
fn cases<const N: usize>(names: [&'static str; N]) -> Vec<&'static Case> {
    if full() { quick().collect() } else { names.map(named).into() }
}

fn usual_cases() -> Vec<&'static Case> {
    cases(["obfuscate", "recover, images", "features", "audit map", "invert"])
}

/// Runs a case under each limit, alternately with and without an earlier output.
fn sweep(bench: &Bench, case: &'static Case, option: &str, limits: &[usize]) -> Row {
    let known = bench.known(case);
    let mut row = Row::default();
    for (at, limit) in limits.iter().enumerate() {
        let had_old = at % 2 == 1;
        bench.begin(had_old.then_some(&known.old));
        let before = format!("ulimit {option} {limit} || exit 99; {EXEC}");
        let ended = bench.run(Some(&before), &case.line());
        assert_ne!(ended.code, Some(99), "the shell knows no ulimit {option}");
        let mut left = bench.tree();
        let what = format!("{}, ulimit {option} {limit}", case.name);
        let is_refused = option == "-v" && is_refused(&ended);
        if left.names().any(is_partial) && (is_refused || option == "-n") {
            // Without file descriptors folders cannot be emptied; the next run does it.
            row.swept += 1;
            bench.goes_on(case, &what);
            left = left.files_without(is_partial);
        }
        if is_refused {
            (row.runs, row.refused) = (row.runs + 1, row.refused + 1);
            let found = state(&known, had_old, &left);
            // Commands with independent files may have written some of them.
            let some = found == Ok(State::Some) && !matches!(case.writes, Writes::Whole);
            let all_or_nothing = [Ok(State::Before), Ok(State::New)].contains(&found);
            assert!(all_or_nothing || some, "{what}: {found:?}");
            continue;
        }
        row.add(of_failure(case, &known, had_old, (&ended, &left)), &what, &ended);
        let is_named = ended.stderr.contains("found a limit on the size of files");
        assert!(option != "-f" || ended.code == Some(0) || is_named, "{what}: {ended:?}");
    }
    bench.goes_on(case, option);
    row
}

/// Returns true if Rust or rayon ended the run because memory or threads were refused.
fn is_refused(ended: &Ended) -> bool {
    let is_told = ended.stderr.contains("Resource temporarily unavailable");
    ended.signal == Some(ABORTED) || ended.code == Some(101) && is_told
}

fn print(title: &str, rows: impl Iterator<Item = (&'static str, Row)>) {
    let cells = |(name, row): (&'static str, Row)| {
        let counts = [row.runs, row.worked, row.told, row.refused, row.swept];
        [name.to_owned()].into_iter().chain(counts.map(|n| n.to_string())).collect()
    };
    let rows: Vec<Vec<String>> = rows.map(cells).collect();
    let header = ["command", "runs", "worked", "told in a line", "aborted", "rest, swept"];
    tables::print(title, &header, &rows);
}

#[test]
fn few_open_files_leave_all_or_nothing() {
    let bench = Bench::new();
    let limits: Vec<usize> = if full() { (4..=40).collect() } else { vec![5, 6, 7, 8, 10, 13, 16] };
    let row = |case: &'static Case| (case.name, sweep(&bench, case, "-n", &limits));
    print("Open files, `ulimit -n` 4 to 40", usual_cases().into_iter().map(row));
}

#[test]
fn small_files_leave_all_or_nothing() {
    let bench = Bench::new();
    let row = |case: &'static Case| {
        // Most shells count blocks of 512 bytes, some of 1024.
        let blocks = bench.known(case).new.largest() / 500 + 4;
        let n = if full() { 12 } else { 2 };
        let limits: Vec<usize> = (0..=n).map(|step| blocks * step / n).collect();
        (case.name, sweep(&bench, case, "-f", &limits))
    };
    print("Size of files, `ulimit -f` 0 to the largest", usual_cases().into_iter().map(row));
}

#[test]
fn little_memory_leaves_all_or_nothing() {
    let bench = Bench::new();
    // From the limit where the program starts to the one where it can do everything.
    let starts = |kib: usize| {
        let before = format!("ulimit -v {kib} || exit 99; {EXEC}");
        bench.run(Some(&before), "--version").code == Some(0)
    };
    let Some(least) = (1..400).map(|at| at * 4096).find(|&kib| starts(kib)) else {
        println!("the shell cannot set `ulimit -v`");
        return;
    };
    let (n, factor) = if full() { (32, 1.1) } else { (6, 1.5) };
    let limits: Vec<usize> =
        (0..n).map(|step| (least as f64 * f64::powi(factor, step)) as usize).collect();
    let row = |case: &'static Case| (case.name, sweep(&bench, case, "-v", &limits));
    print(&format!("Memory, `ulimit -v` {least} KiB and up"), usual_cases().into_iter().map(row));
}

/// Returns the command with which a shell can mount a private disk, if the system allows it.
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
    let steps = if full() { 10 } else { 3 };
    let on_disks = |case: &'static Case| {
        let known = bench.known(case);
        let mut row = Row::default();
        for step in 0..=steps {
            let had_old = step % 2 == 1;
            bench.begin(had_old.then_some(&known.old));
            // The disk has as much room as the present files, which are copied back in the end.
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
            row.add(of_failure(case, &known, had_old, (&ended, &left)), &what, &ended);
            let full = "expected space to write, found a full disk";
            let is_named = ended.stderr.lines().any(|line| line.ends_with(full));
            assert!(ended.code == Some(0) || is_named, "{what}: {ended:?}");
        }
        (case.name, row)
    };
    let cases = cases(["obfuscate", "features", "invert", "audit map"]).into_iter();
    print("Full disks", cases.filter(|case| case.writes != Writes::Nothing).map(on_disks));
}

/// Checks that a file that gets the descriptor of a closed stream receives no messages.
#[test]
fn closed_streams_change_no_byte_of_an_output() {
    let bench = Bench::new();
    let closed = |case: &'static Case| {
        let known = bench.known(case);
        let mut row = Row::default();
        for which in 0..8 {
            let streams = [(0, "<&-"), (1, ">&-"), (2, "2>&-")];
            let closed = streams.map(|(bit, text)| if which >> bit & 1 == 1 { text } else { "" });
            bench.begin(None);
            let before = format!("{EXEC} {}", closed.join(" "));
            let ended = bench.run(Some(&before), &case.line());
            let found = of_failure(case, &known, false, (&ended, &bench.tree()));
            assert_eq!(found, Ok(Found::Worked), "{}, {before}: {ended:?}", case.name);
            row.add(found, case.name, &ended);
        }
        (case.name, row)
    };
    // These commands write to both streams.
    print("Closed streams", cases(["obfuscate", "features", "audit map"]).into_iter().map(closed));
}
