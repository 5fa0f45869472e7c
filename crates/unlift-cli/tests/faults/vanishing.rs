//! Inputs that are removed, cut or replaced while they are read: the output of the old input, or an
//! error.

use std::fs;
use std::path::Path;
use std::thread::sleep;

use crate::bench::{Bench, Ended, finish};
use crate::commands::{Case, quick};
use crate::tree::{Tree, differing};
use crate::verdict::{Found, of_failure};
use crate::{full, tables};

#[derive(Clone, Copy, Debug)]
enum Fate {
    Removed,
    /// The file is cut to half of its bytes.
    Cut,
    /// The file is replaced by one of the same kind.
    Replaced,
    /// The file is replaced by text.
    Spoiled,
}

const FATES: [Fate; 4] = [Fate::Removed, Fate::Cut, Fate::Replaced, Fate::Spoiled];

impl Fate {
    fn befall(self, folder: &Path, input: &str) {
        let path = folder.join(input);
        let other = folder.join("made-beside");
        match self {
            Self::Removed => fs::remove_file(path).unwrap(),
            Self::Cut => {
                let file = fs::OpenOptions::new().write(true).open(path).unwrap();
                file.set_len(file.metadata().unwrap().len() / 2).unwrap();
            }
            Self::Replaced => {
                fs::copy(folder.join(input.replace('2', "1").replace("room", "other")), &other)
                    .unwrap();
                fs::rename(other, path).unwrap();
            }
            Self::Spoiled => {
                fs::write(&other, "nothing of use\n").unwrap();
                fs::rename(other, path).unwrap();
            }
        }
    }
}

#[test]
fn an_input_that_changes_gives_its_output_or_a_line() {
    let bench = Bench::new();
    let mut rows = Vec::new();
    for (at, case) in quick().enumerate() {
        let mut row = [0; 6];
        for (of, input) in case.inputs.iter().enumerate() {
            let n = if full() { 8 } else { 1 };
            for which in 0..n * 4 {
                if full() || which == (at + of) % 4 {
                    let share = which as f64 / (n * 4) as f64;
                    let found = try_one(&bench, case, input, FATES[which % 4], share);
                    (row[0], row[found]) = (row[0] + 1, row[found] + 1);
                }
            }
        }
        bench.restore_inputs();
        rows.push([case.name.to_owned()].into_iter().chain(row.map(|n| n.to_string())).collect());
    }
    let header = [
        "command",
        "runs",
        "output of what was there",
        "output of what came",
        "told in a line",
        "fewer images",
        "figures of one, hash or picture of the other, told",
    ];
    tables::print("Vanishing inputs", &header, &rows);
}

/// Returns the result: 1, the output of the old input; 2, that of the changed input; 3, an error;
/// 4, an error, and the other images; 5, results of one input with the hash or a picture of the
/// other, and a note.
fn try_one(bench: &Bench, case: &'static Case, input: &str, fate: Fate, share: f64) -> usize {
    bench.restore_inputs();
    let known = bench.known(case);
    bench.begin(Some(&known.old));
    let child = bench.start(None, &case.line());
    sleep(known.took.mul_f64(share));
    fate.befall(&bench.path("in"), input);
    let ended = finish(child, case.name);
    let left = bench.tree();
    let what = format!("{}, {input} {fate:?} at {share:.2}", case.name);
    assert!(!ended.stderr.contains("panicked"), "{what}: {ended:?}");
    match of_failure(case, &known, true, (&ended, &left)) {
        Ok(Found::Worked) => return 1,
        Ok(Found::Told) => return 3,
        Ok(Found::FewerImages) => return 4,
        Err(_) => {}
    }
    // The changed input is used, or those of its images that are usable.
    bench.begin(Some(&known.old));
    let Ended { code, stderr, .. } = bench.run(None, &case.line());
    let expected = bench.tree();
    let is_same = code == ended.code && left == expected;
    // An audit hashes photos after its results, and reads them again to draw them. So the hash or a
    // picture may be of another file than the results; a note says so, and no gate holds.
    let figures = [&known.new, &expected].map(Tree::figures);
    let is_audit = ended.code == Some(0) && case.name.starts_with("audit");
    if !is_same && is_audit && figures.contains(&left.figures()) {
        assert!(ended.stderr.contains(": changed since reading began:"), "{what}: {ended:?}");
        return 5;
    }
    // A photo that vanished while others were painted is in the rows, and is named.
    let named =
        format!("note: not painted: image {}", input.split_once('/').map_or(input, |x| x.1));
    if is_audit && case.name.contains("--invert") && ended.stderr.contains(&named) {
        return 4;
    }
    let differ = [differing(&left, &known.new), differing(&left, &expected)];
    assert!(is_same, "{what}: {ended:?}, new and changed: {differ:?}; after that: {stderr}");
    2
}
