//! Kills every command at many moments. The output must be all old or all new, and the next run
//! must succeed and remove unfinished files.

use std::os::unix::fs::MetadataExt;
use std::process::{Child, Command};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::bench::{Bench, Ended, Known, finish};
use crate::commands::{CASES, Case, Writes};
use crate::tree::{Tree, is_part, is_partial};
use crate::verdict::{State, state};
use crate::{full, tables};

#[derive(Clone, Copy, Debug)]
enum Moment {
    /// After this share of the usual duration.
    Share(f64),
    /// When an unfinished file appears.
    Begun,
    /// When the first file is in its place; others may follow.
    Placed,
}

#[derive(Clone, Copy, Debug)]
struct Kill {
    moment: Moment,
    signal: &'static str,
    had_old: bool,
}

#[derive(Default)]
struct Row {
    kills: usize,
    /// Nothing had begun.
    before: usize,
    /// The program removed its unfinished files.
    cleared: usize,
    /// Unfinished files were left.
    left: usize,
    /// The new output was complete.
    after: usize,
    /// Some files were old and some new, all complete.
    some: usize,
}

/// Returns the kills of one case; the short version has two, spread over all cases.
fn plan(case: &Case, at: usize) -> Vec<Kill> {
    let kill = |moment, signal, had_old| Kill { moment, signal, had_old };
    if case.is_slow {
        let mut kills =
            vec![kill(Moment::Begun, "KILL", true), kill(Moment::Share(0.02), "TERM", false)];
        if full() {
            kills.extend([0.3, 0.7].map(|share| kill(Moment::Share(share), "KILL", false)));
            kills.push(kill(Moment::Placed, "KILL", true));
        }
        return kills;
    }
    // The moments are the same in every run, and differ between cases.
    let jitter = |of: usize| ((of * 61 + at * 23) % 100) as f64 / 100.0;
    if !full() {
        let aimed = if at.is_multiple_of(3) { Moment::Placed } else { Moment::Begun };
        let signal = if at.is_multiple_of(2) { "INT" } else { "TERM" };
        return vec![
            kill(Moment::Share(0.1 + 0.9 * jitter(0)), signal, at % 4 < 2),
            kill(aimed, "KILL", at % 4 < 3),
        ];
    }
    const SPREAD: usize = 12;
    let signals = ["KILL", "TERM", "KILL", "INT"];
    let share = |of: usize| 1.1 * (of as f64 + jitter(of)) / SPREAD as f64;
    let spread =
        (0..SPREAD).map(|of| kill(Moment::Share(share(of)), signals[of % 4], of / 2 % 2 == 1));
    let aimed = [
        (Moment::Begun, false),
        (Moment::Begun, true),
        (Moment::Placed, false),
        (Moment::Placed, true),
        (Moment::Placed, true),
    ];
    spread.chain(aimed.map(|(moment, had_old)| kill(moment, "KILL", had_old))).collect()
}

/// Sends a signal; the run may have ended already.
fn send(child: &mut Child, signal: &str) {
    if signal == "KILL" {
        child.kill().expect("it can be killed");
    } else {
        let _ = Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).output();
    }
}

/// Waits for the moment, or for the end of the run.
fn wait(bench: &Bench, case: &Case, known: &Known, child: &mut Child, moment: Moment) {
    let work = bench.path("work");
    let inodes = || -> Vec<Option<u64>> {
        let places = if case.is_slow { known.old.names() } else { known.new.names() };
        let places = places.filter(|name| !name.ends_with('/'));
        places.map(|name| work.join(name).metadata().ok().map(|found| found.ino())).collect()
    };
    let at_first = inodes();
    let has_come = || match moment {
        Moment::Share(_) => true,
        Moment::Begun => Tree::of(&work).names().any(is_partial),
        Moment::Placed => inodes() != at_first,
    };
    if let Moment::Share(share) = moment {
        sleep(known.took.mul_f64(share));
    }
    let most = known.took * 20 + Duration::from_secs(10);
    let started = Instant::now();
    while case.writes != Writes::Nothing && !has_come() {
        let has_ended = child.try_wait().expect("a state").is_some();
        if has_ended || (!case.is_slow && started.elapsed() > most) {
            break;
        }
    }
}

/// Kills a run once, and checks the next run.
fn try_one(bench: &Bench, case: &'static Case, known: &Known, kill: Kill, row: &mut Row) {
    let what = format!("{}, {kill:?}", case.name);
    bench.begin(kill.had_old.then_some(&known.old));
    let begun = bench.tree();
    let mut child = bench.start(None, &case.line());
    wait(bench, case, known, &mut child, kill.moment);
    send(&mut child, kill.signal);
    let Ended { code, signal, stderr } = finish(child, &what);
    let left = bench.tree();
    let found = state(known, kill.had_old, &left).unwrap_or_else(|told| panic!("{what}: {told}"));
    let rest = left.names().find(|name| is_partial(name) || is_part(name));
    row.kills += 1;
    match (found, rest, code) {
        // Files are renamed one by one, so `kill -9` may come between two.
        (State::Some, ..) if case.writes == Writes::Each || kill.signal == "KILL" => row.some += 1,
        (State::Some, ..) => panic!("{what}: some files are old, others new"),
        (State::New, ..) if case.writes != Writes::Nothing => row.after += 1,
        (_, Some(_), _) => row.left += 1,
        (_, None, Some(0)) => row.after += 1,
        (_, None, Some(_)) => row.cleared += 1,
        (_, None, None) => row.before += 1,
    }
    if kill.signal != "KILL" {
        let expected = if kill.signal == "INT" { 130 } else { 143 };
        // Before the handler is installed, the signal itself ends the program.
        let is_usual = [Some(0), Some(expected)].contains(&code) || signal.is_some();
        assert!(is_usual && !left.names().any(is_partial), "{what}: {code:?}, {rest:?}: {stderr}");
        let is_one = left == begun || found == State::New || rest.is_some();
        assert!(
            is_one || case.writes == Writes::Each,
            "{what}: {:?}",
            left.names().collect::<Vec<_>>()
        );
    }
    bench.goes_on(case, &format!("{kill:?}"));
}

#[test]
fn a_kill_at_any_moment_leaves_all_of_the_old_or_all_of_the_new() {
    let bench = Bench::new();
    let mut rows = Vec::new();
    let mut total = Row::default();
    for (at, case) in CASES.iter().enumerate() {
        let known = bench.known(case);
        let mut row = Row::default();
        for kill in plan(case, at) {
            try_one(&bench, case, &known, kill, &mut row);
        }
        assert!(bench.inputs_are_whole(), "{}", case.name);
        rows.push(row.cells(case.name, known.took));
        total.add(&row);
    }
    let aimed = total.cleared + total.left;
    assert!(aimed >= CASES.len() / 3, "only {aimed} of {} kills met work", total.kills);
    rows.push(total.cells("all", Duration::ZERO));
    let header = [
        "command",
        "seconds",
        "kills",
        "before work",
        "cleared away",
        "rest, swept",
        "output there",
        "some files",
    ];
    tables::print("Kills", &header, &rows);
}

impl Row {
    fn cells(&self, name: &str, took: Duration) -> Vec<String> {
        let counts = [self.kills, self.before, self.cleared, self.left, self.after, self.some];
        [name.to_owned(), format!("{:.2}", took.as_secs_f64())]
            .into_iter()
            .chain(counts.map(|n| n.to_string()))
            .collect()
    }

    fn add(&mut self, row: &Self) {
        self.kills += row.kills;
        self.before += row.before;
        self.cleared += row.cleared;
        self.left += row.left;
        self.after += row.after;
        self.some += row.some;
    }
}
