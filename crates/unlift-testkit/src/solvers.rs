//! What a solver owes its users.

use unlift::neighbors::Neighborhoods;
use unlift::recover::{RecoverOptions, Recovered, Solver, recover};
use unlift::released::Released;

/// Checks all laws of a solver on a released map and its lists:
///
/// 1. its name is one plain word;
/// 2. it answers for every slot, in the unit and about the origin of the map, and says of which map;
/// 3. the same positions on any number of threads;
/// 4. lists without an entry are answered by an error or by positions, not by a panic.
///
/// # Panics
/// When a law is broken, or the solver refuses the map.
pub fn solver_laws<const D: usize>(
    solver: &dyn Solver<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
) {
    let name = solver.name();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-+_.".contains(c);
    assert!(!name.is_empty() && name.chars().all(is_plain), "{name:?} is no plain name");
    let recovered = on(1, solver, released, lists);
    assert_eq!(recovered.unit(), released.unit(), "{name}: in which unit?");
    assert_eq!(recovered.origin(), released.origin(), "{name}: about which origin?");
    assert_eq!(recovered.about().map, Some(released.fingerprint()), "{name}: of which map?");
    assert!(
        same(&recovered, &on(3, solver, released, lists)),
        "{name}: another number of threads, other positions"
    );
    let (n, slots) = (released.n_records(), released.slots_per_record());
    let empty = Neighborhoods::try_new(vec![0; n * slots + 1], Vec::new(), None, n, slots);
    if let Ok(recovered) =
        recover(released, &empty.expect("lists"), solver, &RecoverOptions::default())
    {
        assert_eq!(recovered.n_slots(), released.n_slots(), "{name}: empty lists");
    }
}

fn on<const D: usize>(
    threads: usize,
    solver: &dyn Solver<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Recovered<D> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    let options = RecoverOptions { seed: 1, ..RecoverOptions::default() };
    let recovered = pool.install(|| recover(released, lists, solver, &options));
    recovered.unwrap_or_else(|error| panic!("{} recovers nothing: {error}", solver.name()))
}

/// Whether both have the same positions, bit for bit.
fn same<const D: usize>(a: &Recovered<D>, b: &Recovered<D>) -> bool {
    let bits = |recovered: &Recovered<D>| -> Vec<[u32; D]> {
        recovered.positions().iter().map(|x| x.map(f32::to_bits)).collect()
    };
    a.status() == b.status() && bits(a) == bits(b)
}
