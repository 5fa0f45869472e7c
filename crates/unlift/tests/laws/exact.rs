//! Properties of exact constraints: exchanged coordinates come back exactly.

use unlift::obfuscate::scheme;
use unlift::recover::{Builtin, RecoverOptions, Recovered};
use unlift::released::Obfuscation;

use crate::maps::{Hidden, Options, hide, norm, recovered_bytes, room, solve};

const N: usize = 4000;
const K: usize = 20;

fn hidden(scale: f64) -> Hidden<3> {
    let points: Vec<[f64; 3]> = room(5, N).iter().map(|p| p.map(|x| x * scale)).collect();
    hide(scheme("cp").unwrap(), &points, 5)
}

fn options() -> Options {
    (Builtin::Joint, RecoverOptions { seed: 1, ..Default::default() })
}

/// Returns the share of slots within `most` of ground truth.
fn share(hidden: &Hidden<3>, recovered: &Recovered<3>, most: f64) -> f64 {
    let n = hidden.released.n_slots();
    let off = |slot: usize| {
        let (x, local) = (recovered.positions()[slot], hidden.local(slot));
        norm(&std::array::from_fn::<f64, 3, _>(|c| f64::from(x[c]) - local[c]))
    };
    (0..n).filter(|&slot| off(slot) <= most).count() as f64 / n as f64
}

/// A slot that takes a coordinate which another slot publishes on that axis gives the other slot its own. Results are the same for
/// any number of threads, and almost the same in another unit.
#[test]
fn exchanged_coordinates_come_back_exactly_and_from_a_partner() {
    let hidden = hidden(1.0);
    let lists = hidden.lists(K, 1.0, 2);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&hidden.released, &lists, options()))
    };
    let found = run(1);
    assert!(recovered_bytes(&found) == recovered_bytes(&run(3)));
    // Measured: 18.6 %. Without partners it is at least four points less.
    let exact = share(&hidden, &found, 1e-3);
    assert!(exact > 0.17, "{exact}");
    let Obfuscation::AxisCandidates(records) = hidden.released.obfuscation() else {
        panic!("cp releases candidates");
    };
    let (axis, n) = (found.axis().unwrap(), hidden.released.n_slots());
    let takes = |slot: usize| found.positions()[slot][usize::from(axis[slot])].to_bits();
    let gives = |slot: usize| records.position()[slot][usize::from(axis[slot])].to_bits();
    let published: std::collections::BTreeSet<_> = (0..n).map(|s| (axis[s], gives(s))).collect();
    let mut given: Vec<_> = (0..n).map(|s| (axis[s], gives(s), takes(s))).collect();
    given.sort_unstable();
    let mut taken: Vec<_> = (0..n).map(|s| (axis[s], takes(s), gives(s))).collect();
    taken.retain(|(axis, value, own)| value != own && published.contains(&(*axis, *value)));
    taken.sort_unstable();
    assert!(taken.len() > n / 20);
    let missing = taken.iter().filter(|one| given.binary_search(one).is_err()).count();
    assert_eq!(missing, 0);

    let other = self::hidden(7.3);
    let scaled = solve(&other.released, &other.lists(K, 1.0, 2), options());
    for within in [1e-3, 0.1] {
        let shares = [share(&hidden, &found, within), share(&other, &scaled, 7.3 * within)];
        assert!((shares[0] - shares[1]).abs() < 0.01, "within {within}: {shares:?}");
    }
}
