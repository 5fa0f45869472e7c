//! Property tests of schemes, sources and solvers.

use unlift::evaluate::Truth;
use unlift::neighbors::{Neighborhoods, Source};
use unlift::obfuscate::Scheme;
use unlift::recover::{RecoverOptions, Solver, recover};
use unlift::released::Released;

use crate::{hide, on_threads, piles, room, uniform};

/// Records are stored in `f32`: a few units in the last place of the largest coordinate, in meters.
const TOLERANCE: f64 = 4e-6;
/// Maximum share of originals that keep their row.
const MAX_IN_PLACE: f64 = 0.05;
const IMAGE_STEP: f64 = 1.0;

/// Checks all properties of a scheme:
///
/// 1. Its name is one plain word.
/// 2. Every original has one slot or is dropped with a reason: in rooms, piles of coincident points
///    and maps of few points. A map that cannot be hidden gives an error.
/// 3. Every hidden point lies on its record, near the origin and 1000 km away. Bearings from one
///    center may have decoys.
/// 4. The same key gives the same records for any number of threads; another key gives others.
/// 5. The order of records does not reveal the order of the originals.
///
/// In 2D, points are keypoints of an image.
///
/// # Panics
/// When a property does not hold.
pub fn scheme_laws<const D: usize>(scheme: &dyn Scheme<D>) {
    let name = scheme.name();
    check_name(name);
    // Obfuscation itself counts the originals in slots and the dropped ones. A map may be refused, but not for a wrong count.
    let few = [0, 1, 2, 3, 7].into_iter().flat_map(|n| [uniform(9, n), piles(9, 1, n, 0.0)]);
    for points in few.chain([room(5, 300), piles(9, 40, 3, 0.0), uniform(8, 301)]) {
        let error = hide(scheme, &points, IMAGE_STEP, 5).err().map(|error| error.to_string());
        let is_counted = |error: &String| {
            !error.contains("in one slot or dropped once") && !error.contains("originals below")
        };
        assert!(error.iter().all(is_counted), "{name}, {} points: {error:?}", points.len());
    }
    for shift in [0.0, 1e6] {
        let points: Vec<[f64; D]> = room(6, 200).iter().map(|p| p.map(|x| x + shift)).collect();
        let (original, released, secret) = hide(scheme, &points, IMAGE_STEP, 3)
            .unwrap_or_else(|e| panic!("{name} cannot hide a room: {e}"));
        if released.obfuscation().is_bearings() {
            continue;
        }
        let truth = Truth { original: &original, released: &released, secret: &secret };
        for (slot, off) in truth.away_from_own().into_iter().enumerate() {
            let is_on = off <= TOLERANCE + 8.0 * shift * f64::EPSILON;
            assert!(is_on, "{name}: the point of slot {slot} is {off} off its record");
        }
    }
    let points = room(11, 700);
    let on = |threads: usize, seed: u64| {
        let hidden = on_threads(threads, || hide(scheme, &points, IMAGE_STEP, seed));
        let (_, released, secret) = hidden.expect("a room");
        (released, secret)
    };
    let one = on(1, 7);
    assert!(one == on(1, 7), "{name}: the same key gives different maps");
    assert!(one == on(3, 7), "{name}: the number of threads changes the map");
    assert!(one.0 != on(1, 8).0, "{name}: different keys give the same map");
    let (_, _, secret) = hide(scheme, &room(12, 600), IMAGE_STEP, 2).expect("a room");
    let in_place = secret.hidden().iter().enumerate().filter(|(slot, id)| id.index() == *slot);
    let share = in_place.count() as f64 / secret.n_slots().max(1) as f64;
    assert!(share <= MAX_IN_PLACE, "{name}: {share:.2} of the points keep their row");
}

/// Checks all properties of a source on a map that it supports:
///
/// 1. Its name is one plain word, and it chooses at least one record.
/// 2. It makes one list per slot with at most the requested number of records, and finite scores or
///    none.
/// 3. Lists state their map.
/// 4. Lists do not depend on the number of threads.
/// 5. A map without records, or lists longer than the number of records, give an error or shorter
///    lists, but no panic.
///
/// # Panics
/// When a property does not hold, or the source does not support the map.
pub fn source_laws<const D: usize>(source: &dyn Source<D>, released: &Released<D>) {
    let name = source.name();
    check_name(name);
    assert!(source.k(released) > 0, "{name}: k is 0");
    if let Err(error) = source.supports(released) {
        panic!("{name} does not support this map: {error}");
    }
    let listed = |threads| {
        let made = on_threads(threads, || source.lists(released, 6, 1));
        made.unwrap_or_else(|error| panic!("{name} makes no lists: {error}"))
    };
    let lists = listed(1);
    assert_eq!(lists.n_slots(), released.n_slots(), "{name}: not one list per slot");
    assert!(lists.longest() <= 6, "{name}: a list has {} records, not at most 6", lists.longest());
    assert_eq!(lists.about().map, Some(released.fingerprint()), "{name}: wrong map");
    assert!(lists == listed(3), "{name}: the number of threads changes lists");
    if let Ok(lists) = source.lists(released, released.n_records() + 1, 0) {
        assert!(lists.longest() < released.n_records(), "{name}: a record lists itself");
    }
}

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
    let options = RecoverOptions { seed: 1, ..RecoverOptions::default() };
    let solved = |threads| {
        let recovered = on_threads(threads, || recover(released, lists, solver, &options));
        recovered.unwrap_or_else(|error| panic!("{name} cannot recover the map: {error}"))
    };
    let recovered = solved(1);
    assert_eq!(recovered.unit(), released.unit(), "{name}: wrong unit");
    assert_eq!(recovered.origin(), released.origin(), "{name}: wrong origin");
    assert_eq!(recovered.about().map, Some(released.fingerprint()), "{name}: wrong map");
    // Positions of lost points are NaN, which only their text equals.
    let [one, three] = [&recovered, &solved(3)].map(|recovered| format!("{recovered:?}"));
    assert!(one == three, "{name}: the number of threads changes positions");
    let empty = Neighborhoods::empty(released.n_slots());
    if let Ok(recovered) = recover(released, &empty, solver, &RecoverOptions::default()) {
        assert_eq!(recovered.n_slots(), released.n_slots(), "{name}: slots of empty lists");
    }
}

/// Panics if `name` is not one plain word.
fn check_name(name: &str) {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-+_.".contains(c);
    assert!(!name.is_empty() && name.chars().all(is_plain), "{name:?} is not a plain name");
}
