//! Standard streams that are closed: a file that gets one of their numbers hears none of our words.

use crate::bench::Bench;
use crate::commands::{named, quick};
use crate::verdict::{Found, of_failure};
use crate::{full, tables};

#[test]
fn closed_streams_change_no_byte_of_an_output() {
    let bench = Bench::new();
    let cases: Vec<_> = match full() {
        true => quick().collect(),
        // They have something to say on both streams.
        false => ["obfuscate", "features", "audit map"].map(named).into(),
    };
    let mut rows = Vec::new();
    for case in cases {
        let known = bench.known(case);
        let mut n = 0;
        for which in 0..8 {
            let closed = |bit: usize, text| if which >> bit & 1 == 1 { text } else { "" };
            let closed = [closed(0, "<&-"), closed(1, ">&-"), closed(2, "2>&-")].join(" ");
            bench.begin(None);
            let ended = bench.run(Some(&format!("exec \"$0\" \"$@\" {closed}")), &case.line());
            let found = of_failure(case, &known, false, (&ended, &bench.tree()));
            assert_eq!(found, Ok(Found::Worked), "{}, {closed}: {ended:?}", case.name);
            n += 1;
        }
        rows.push(vec![case.name.to_owned(), n.to_string(), "the same bytes".to_owned()]);
    }
    tables::print("Closed streams", &["command", "runs", "found"], &rows);
}
