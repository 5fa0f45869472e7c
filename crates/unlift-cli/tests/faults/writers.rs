//! Two runs that write to one place at the same time: the final output is that of one of them.

use crate::bench::{Bench, finish};
use crate::commands::{Case, Writes, quick};
use crate::tree::differing;
use crate::{full, tables};

/// Part of the error when two runs meet.
const BUSY: &str = "no other run";

#[test]
fn of_two_writers_one_whole_output_stays() {
    let bench = Bench::new();
    let mut rows = Vec::new();
    let n = if full() { 30 } else { 1 };
    for (of, case) in quick().filter(|case| case.writes != Writes::Nothing).enumerate() {
        let (mut stays, mut n_refused) = ([0; 3], 0);
        for at in of..of + n {
            let (whose, is_refused) = race(&bench, case, at);
            stays[whose as usize] += 1;
            n_refused += usize::from(is_refused);
        }
        let cells = [n, stays[0], stays[1], stays[2], n_refused].map(|n| n.to_string());
        rows.push([case.name.to_owned()].into_iter().chain(cells).collect());
    }
    let header = [
        "command",
        "races",
        "the one's output",
        "the other's",
        "files of both",
        "told that another run is at it",
    ];
    tables::print("Two writers", &header, &rows);
}

#[derive(Clone, Copy, Debug)]
enum Whose {
    Ones,
    Others,
    /// Files of each, for commands with independent files.
    Both,
}

/// Runs two at the same time; returns whose output stays, and true if one run was refused.
fn race(bench: &Bench, case: &'static Case, at: usize) -> (Whose, bool) {
    let known = bench.known(case);
    // Alternately with and without an earlier output.
    bench.begin((at % 2 == 1).then_some(&known.old));
    let lines = [case.earlier(), case.line()];
    let children = lines.each_ref().map(|line| bench.start(None, line));
    let mut ended = children.into_iter().map(|child| finish(child, case.name));
    let ended = [ended.next(), ended.next()].map(|ended| ended.expect("two"));
    let is_refused =
        ended.each_ref().map(|ended| ended.code == Some(2) && ended.stderr.contains(BUSY));
    let left = bench.tree();
    for (ended, is_refused) in ended.iter().zip(is_refused) {
        let is_fine = ended.code == Some(0) || is_refused;
        assert!(is_fine, "{}: {ended:?}, {:?}", case.name, left.names().collect::<Vec<_>>());
    }
    assert_ne!(is_refused, [true; 2], "{}: {ended:?}", case.name);
    let either = |name: &str| [known.old.get(name), known.new.get(name)];
    let whose = match () {
        () if left == known.old => Whose::Ones,
        () if left == known.new => Whose::Others,
        () if case.writes == Writes::Each
            && left.names().eq(known.new.names())
            && left.names().all(|name| either(name).contains(&left.get(name))) =>
        {
            Whose::Both
        }
        () => {
            let told = [&known.old, &known.new].map(|one| differing(&left, one));
            panic!("{}: {told:?}, {ended:?}", case.name)
        }
    };
    (whose, is_refused.contains(&true))
}
