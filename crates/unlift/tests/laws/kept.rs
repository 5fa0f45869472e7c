//! Recovery goes on from where its rounds stood, to the same bits.

use std::io;

use unlift::neighbors::{Listing, Neighborhoods};
use unlift::obfuscate::Entry;
use unlift::recover::{Delta, Kept, RecoverOptions, Solver, recover_kept};
use unlift::released::{Obfuscation, Released};

use crate::maps::*;
use crate::shelved::{Files, put};

/// All that was kept, one after the other, and what is recalled.
#[derive(Default)]
struct All {
    first: Option<Vec<u8>>,
    kept: Vec<Vec<u8>>,
}

impl All {
    fn from(bytes: &[u8]) -> Self {
        Self { first: Some(bytes.to_vec()), kept: Vec::new() }
    }
}

impl Kept for All {
    fn recall(&mut self) -> Option<Vec<u8>> {
        self.first.take()
    }

    fn keep(&mut self, write: &dyn Fn(&mut dyn io::Write) -> io::Result<()>) {
        let mut bytes = Vec::new();
        write(&mut bytes).unwrap();
        self.kept.push(bytes);
    }
}

fn options() -> RecoverOptions {
    RecoverOptions { solver: Solver::Joint, seed: 9, ..RecoverOptions::default() }
}

fn of_anchors<const D: usize>(released: &Released<D>) -> bool {
    matches!(released.obfuscation(), Obfuscation::Rays(rays) if rays.regions().is_some())
}

fn goes_on_after_every_round<const D: usize>(name: &str, scheme: &Entry) {
    let hidden = hide::<D>(scheme, &room(61, 700), 6);
    let released = &hidden.released;
    let lists = hidden.lists(15, 0.5, 6);
    let whole = recovered_bytes(&solve(released, &lists, options()));
    let shelf = Files(10_000);
    let map = (released.n_records(), released.slots_per_record());
    let away = Listing::Away(put(&lists, map, &shelf));
    let here = Listing::Here(lists);
    let mut all = All::default();
    let found = recover_kept(released, (&here, None), &options(), &mut all).unwrap();
    assert!(recovered_bytes(&found) == whole, "{name}");
    // Where bearings say hardly anything there are no rounds.
    assert!(all.kept.len() > 1 || of_anchors(released), "{name}: {} rounds", all.kept.len());
    for (at, bytes) in all.kept.iter().enumerate() {
        let mut rest = All::from(bytes);
        let found = recover_kept(released, (&here, None), &options(), &mut rest).unwrap();
        assert!(recovered_bytes(&found) == whole, "{name}, after round {at}");
        assert!(rest.kept == all.kept[at + 1..], "{name}: other rounds than those left after {at}");
    }
    if !of_anchors(released) {
        let mut rest = All::from(&all.kept[0]);
        let found = recover_kept(released, (&away, Some(&shelf)), &options(), &mut rest).unwrap();
        assert!(recovered_bytes(&found) == whole, "{name}, lists on a shelf");
        assert!(rest.kept == all.kept[1..], "{name}, lists on a shelf");
    }
}

#[test]
fn recovery_goes_on_after_every_round() {
    over_schemes!(goes_on_after_every_round);
}

#[test]
fn what_was_not_kept_of_this_recovery_is_refused() {
    let of = |n: usize| {
        let hidden = hide::<3>(unlift::obfuscate::scheme("ppl").unwrap(), &room(61, n), 6);
        let lists: Neighborhoods = hidden.lists(15, 0.5, 6);
        (hidden, Listing::Here(lists))
    };
    let go_on = |(hidden, lists): &(Hidden<3>, Listing), options, bytes: &[u8]| {
        let mut kept = All::from(bytes);
        recover_kept(&hidden.released, (lists, None), &options, &mut kept)
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    let map = of(400);
    let mut all = All::default();
    recover_kept(&map.0.released, (&map.1, None), &options(), &mut all).unwrap();
    let bytes = &all.kept[0];
    assert_eq!(go_on(&map, options(), bytes), Ok(()));
    for n in [0, 7, 100, bytes.len() - 1] {
        let refused = go_on(&map, options(), &bytes[..n]).unwrap_err();
        assert!(refused.starts_with("kept rounds: expected"), "{refused}");
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(go_on(&map, options(), &longer).is_err());
    let others = "kept rounds: expected rounds of this version, map and options, found others";
    assert_eq!(go_on(&of(500), options(), bytes).unwrap_err(), others);
    let of_others = {
        let hidden = hide::<3>(unlift::obfuscate::scheme("plane").unwrap(), &room(61, 400), 6);
        let listed = |seed: u64| Listing::Here(hidden.lists(15, 0.5, seed));
        let fixed = RecoverOptions { delta: Delta::Fixed(0.1), ..options() };
        let mut all = All::default();
        recover_kept(&hidden.released, (&listed(6), None), &fixed, &mut all).unwrap();
        let mut kept = All::from(&all.kept[0]);
        recover_kept(&hidden.released, (&listed(7), None), &fixed, &mut kept).map(|_| ())
    };
    let refused = of_others.unwrap_err().to_string();
    assert_eq!(refused, "kept rounds: expected those of these lists, found of others");
    let seeded = RecoverOptions { seed: 10, ..options() };
    assert_eq!(go_on(&map, seeded, bytes).unwrap_err(), others);
    let consensus = RecoverOptions { solver: Solver::Consensus, ..options() };
    assert_eq!(go_on(&map, consensus, bytes).unwrap_err(), others);
}
