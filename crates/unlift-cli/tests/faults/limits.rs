//! Limits on open files, on the size of files and on memory, step by step.

use crate::bench::{Bench, Ended};
use crate::commands::{Case, Writes, named, quick};
use crate::tree::is_partial;
use crate::verdict::{Found, State, of_failure, state};
use crate::{full, tables};

const ABORTED: i32 = 6;

/// How the runs under one limit ended.
#[derive(Default)]
struct Row {
    runs: usize,
    worked: usize,
    told: usize,
    /// Ended for want of memory or threads, without a line of ours.
    refused: usize,
    /// Left something unfinished that the next run cleared away.
    swept: usize,
}

fn cases() -> Vec<&'static Case> {
    match full() {
        true => quick().collect(),
        false => {
            ["obfuscate", "recover, images", "features", "audit map", "invert"].map(named).into()
        }
    }
}

/// Runs a case under each limit, in turn onto nothing and onto an earlier output.
fn sweep(bench: &Bench, case: &'static Case, option: &str, limits: &[usize]) -> Row {
    let known = bench.known(case);
    let mut row = Row::default();
    for (at, limit) in limits.iter().enumerate() {
        let had_old = at % 2 == 1;
        bench.begin(had_old.then_some(&known.old));
        let before = format!("ulimit {option} {limit} || exit 99; exec \"$0\" \"$@\"");
        let ended = bench.run(Some(&before), &case.line());
        assert_ne!(ended.code, Some(99), "the shell knows no ulimit {option}");
        let mut left = bench.tree();
        let what = format!("{}, ulimit {option} {limit}", case.name);
        row.runs += 1;
        let is_refused = option == "-v" && is_refused(&ended);
        if left.names().any(is_partial) && (is_refused || option == "-n") {
            // Folders cannot be emptied when no file can be opened: the next run does it.
            row.swept += 1;
            bench.goes_on(case, &what);
            left = left.files_without(is_partial);
        }
        if is_refused {
            row.refused += 1;
            let found = state(&known, had_old, &left);
            // Who writes files one by one may have written some of them, each of them whole.
            let some = found == Ok(State::Some) && !matches!(case.writes, Writes::Whole);
            let all_or_nothing = [Ok(State::Before), Ok(State::New)].contains(&found);
            assert!(all_or_nothing || some, "{what}: {found:?}");
            continue;
        }
        match of_failure(case, &known, had_old, (&ended, &left)) {
            Ok(Found::Worked) => row.worked += 1,
            Ok(_) => row.told += 1,
            Err(told) => panic!("{what}: {told}: {ended:?}"),
        }
    }
    bench.goes_on(case, option);
    row
}

/// Whether a run ended at once as memory or threads were refused, which is what Rust and rayon do then.
fn is_refused(ended: &Ended) -> bool {
    let is_told = ended.stderr.contains("Resource temporarily unavailable");
    ended.signal == Some(ABORTED) || ended.code == Some(101) && is_told
}

fn print(title: &str, rows: Vec<(&'static str, Row)>) {
    let cells = |(name, row): (&'static str, Row)| {
        let counts = [row.runs, row.worked, row.told, row.refused, row.swept];
        [name.to_owned()].into_iter().chain(counts.map(|n| n.to_string())).collect()
    };
    let rows: Vec<Vec<String>> = rows.into_iter().map(cells).collect();
    tables::print(
        title,
        &["command", "runs", "worked", "told in a line", "aborted", "rest, swept"],
        &rows,
    );
}

#[test]
fn few_open_files_leave_all_or_nothing() {
    let bench = Bench::new();
    let limits: Vec<usize> = if full() { (4..=40).collect() } else { vec![5, 6, 7, 8, 10, 13, 16] };
    let rows = cases().into_iter().map(|case| (case.name, sweep(&bench, case, "-n", &limits)));
    print("Open files, `ulimit -n` 4 to 40", rows.collect());
}

#[test]
fn small_files_leave_all_or_nothing() {
    let bench = Bench::new();
    let of_case = |case: &'static Case| {
        // In the blocks of most shells; those of others are twice as large.
        let blocks = bench.known(case).new.largest() / 500 + 4;
        let n = if full() { 12 } else { 2 };
        let limits: Vec<usize> = (0..=n).map(|step| blocks * step / n).collect();
        (case.name, sweep(&bench, case, "-f", &limits))
    };
    print(
        "Size of files, `ulimit -f` 0 to the largest",
        cases().into_iter().map(of_case).collect(),
    );
}

#[test]
fn little_memory_leaves_all_or_nothing() {
    let bench = Bench::new();
    // From where the program can say what it is, to where it can do everything.
    let starts = |kib: usize| {
        let before = format!("ulimit -v {kib} || exit 99; exec \"$0\" \"$@\"");
        bench.run(Some(&before), "--version").code == Some(0)
    };
    let Some(least) = (1..400).map(|at| at * 4096).find(|&kib| starts(kib)) else {
        println!("the shell cannot set `ulimit -v`");
        return;
    };
    let (n, factor) = if full() { (32, 1.1) } else { (6, 1.5) };
    let limits: Vec<usize> =
        (0..n).map(|step| (least as f64 * f64::powi(factor, step)) as usize).collect();
    let rows = cases().into_iter().map(|case| (case.name, sweep(&bench, case, "-v", &limits)));
    let title = format!("Memory, `ulimit -v` {least} KiB and up");
    print(&title, rows.collect());
}
