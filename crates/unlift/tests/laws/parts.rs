//! Consensus in parts, each with only its own lists, gives byte-identical results.

use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, Delta, Model, RecoverOptions, prepare};
use unlift::released::Obfuscation;

use crate::maps::*;

const CONSENSUS: RecoverOptions =
    RecoverOptions { delta: Delta::Auto, seed: 0, exact_constraints: true, confidence: false };

/// Returns parts of different sizes, one of them empty; none ends at the end of a chunk.
fn cuts(n: usize) -> Vec<std::ops::Range<usize>> {
    let at = [0, n / 7, n / 7, n / 3 + 1, n - 1, n];
    at.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

fn lists_of_others_change_nothing<const D: usize>(name: &str, scheme: &Entry) {
    let hidden = hide::<D>(scheme, &room(61, 500), 6);
    let lists = hidden.lists(15, 0.5, 6);
    let (released, per) = (&hidden.released, hidden.released.slots_per_record());
    let options = RecoverOptions { seed: 9, ..CONSENSUS };
    let whole = solve(released, &lists, (Builtin::Consensus, options));
    let bytes = prepare(released, &lists, &options).unwrap().to_bytes();
    let model = Model::<D>::from_bytes(&bytes).unwrap();
    let of_part = |slots: std::ops::Range<usize>| {
        let [from, to] = [slots.start, slots.end].map(|slot| lists.offsets()[slot]);
        let offsets: Vec<u64> =
            lists.offsets()[slots.start..=slots.end].iter().map(|at| at - from).collect();
        let records = lists.records()[from as usize..to as usize].to_vec();
        let map = (released.n_records(), per);
        let own = Neighborhoods::of_slots(slots.start, &offsets, records, None, map).unwrap();
        model.solve_part(released, &own, slots)
    };
    let of_anchors =
        matches!(released.obfuscation(), Obfuscation::Rays(rays) if rays.regions().is_some());
    let cuts = cuts(released.n_records()).into_iter().map(|cut| per * cut.start..per * cut.end);
    let parts: Result<Vec<_>, _> = cuts.map(of_part).collect();
    if of_anchors {
        assert!(parts.is_err(), "{name}");
        return;
    }
    let joined = model.join(released, parts.unwrap()).unwrap();
    assert!(recovered_bytes(&joined) == recovered_bytes(&whole), "{name}");
    assert_eq!(
        (joined.about(), joined.descriptor_row()),
        (whole.about(), whole.descriptor_row()),
        "{name}"
    );
    if per == 2 {
        assert!(of_part(0..1).is_err(), "{name}");
    }
}

#[test]
fn lists_of_a_part_are_all_that_it_needs() {
    over_schemes!(lists_of_others_change_nothing);
}

#[test]
fn parts_are_all_there() {
    let (hidden, lists) = (hidden_lines(), hidden_lines().lists(12, 0.5, 6));
    let model = prepare(&hidden.released, &lists, &CONSENSUS).unwrap();
    let part = model.solve_part(&hidden.released, &lists, 0..150).unwrap();
    let error = model.join(&hidden.released, [part]).unwrap_err();
    assert_eq!(error.to_string(), "estimates: expected 200, one per slot, found 150");
    let error = Neighborhoods::of_slots(199, &[0, 0, 0], Vec::new(), None, (200, 1)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "neighborhoods: expected lists within 200 slots, found 2 from slot 199 on"
    );
}

fn hidden_lines() -> Hidden<3> {
    let olc = unlift::obfuscate::scheme("olc").unwrap();
    hide::<3>(olc, &room(62, 200), 6)
}

#[test]
fn a_model_is_one_of_its_map() {
    let (hidden, lists) = (hidden_lines(), hidden_lines().lists(12, 0.5, 6));
    let options = RecoverOptions { delta: Delta::Fixed(0.1), ..CONSENSUS };
    let model = prepare(&hidden.released, &lists, &options).unwrap();
    assert_eq!((model.delta(), model.map()), (0.1, hidden.released.fingerprint()));
    assert!(model.solve_part(&hidden.released, &lists, 150..201).is_err());
    let ppl = unlift::obfuscate::scheme("ppl").unwrap();
    let other = hide::<3>(ppl, &room(62, 200), 6);
    let lists = other.lists(12, 0.5, 6);
    let error = model.solve_part(&other.released, &lists, 0..200).unwrap_err();
    assert!(error.to_string().starts_with("model: fingerprint: "), "{error}");
}

#[test]
fn other_bytes_are_no_model() {
    let (hidden, lists) = (hidden_lines(), hidden_lines().lists(12, 0.5, 6));
    let bytes = prepare(&hidden.released, &lists, &CONSENSUS).unwrap().to_bytes();
    assert!(bytes.len() < 200_000, "{} bytes", bytes.len());
    for n in (0..100).chain([bytes.len() / 2, bytes.len() - 1]) {
        assert!(Model::<3>::from_bytes(&bytes[..n]).is_err(), "{n} bytes");
    }
    assert!(Model::<3>::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
    assert!(Model::<2>::from_bytes(&bytes).is_err());
    // A broken byte gives an error or another model, but no panic.
    for at in 0..80 {
        let mut broken = bytes.clone();
        broken[at] ^= 0xff;
        let _ = Model::<3>::from_bytes(&broken);
    }
}
