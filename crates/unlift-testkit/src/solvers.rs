//! Property tests of solvers.

use unlift::neighbors::Neighborhoods;
use unlift::recover::{RecoverOptions, Recovered, Solver, recover};
use unlift::released::Released;

use crate::{check_name, on_threads};

/// Checks all properties of a solver on a released map and its lists:
///
/// 1. Its name is one plain word.
/// 2. It returns a result for every slot, with the unit, the origin and the fingerprint of the map.
/// 3. Positions do not depend on the number of threads.
/// 4. Empty lists give an error or positions, but no panic.
///
/// # Panics
/// When a property does not hold, or the solver returns an error for the map.
pub fn solver_laws<const D: usize>(
    solver: &dyn Solver<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
) {
    let name = solver.name();
    check_name(name);
    let recovered = on(1, solver, released, lists);
    assert_eq!(recovered.unit(), released.unit(), "{name}: wrong unit");
    assert_eq!(recovered.origin(), released.origin(), "{name}: wrong origin");
    assert_eq!(recovered.about().map, Some(released.fingerprint()), "{name}: wrong map");
    assert!(
        same(&recovered, &on(3, solver, released, lists)),
        "{name}: the number of threads changes positions"
    );
    let empty = Neighborhoods::empty(released.n_slots());
    if let Ok(recovered) = recover(released, &empty, solver, &RecoverOptions::default()) {
        assert_eq!(recovered.n_slots(), released.n_slots(), "{name}: slots of empty lists");
    }
}

fn on<const D: usize>(
    threads: usize,
    solver: &dyn Solver<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Recovered<D> {
    let options = RecoverOptions { seed: 1, ..RecoverOptions::default() };
    let recovered = on_threads(threads, || recover(released, lists, solver, &options));
    recovered.unwrap_or_else(|error| panic!("{} cannot recover the map: {error}", solver.name()))
}

fn same<const D: usize>(a: &Recovered<D>, b: &Recovered<D>) -> bool {
    let bits = |recovered: &Recovered<D>| -> Vec<[u32; D]> {
        recovered.positions().iter().map(|x| x.map(f32::to_bits)).collect()
    };
    a.status() == b.status() && bits(a) == bits(b)
}
