//! Property tests of sources of neighborhoods.

use unlift::descriptors::Values;
use unlift::neighbors::{Neighborhoods, Source};
use unlift::obfuscate::{Scheme, obfuscate};
use unlift::released::Released;
use unlift::seed::{Draws, Key, Stage};
use unlift::truth::{Original, Secret};
use unlift::{Descriptors, PointSet, Unit};

use crate::{check_name, on_threads, room};

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
    let lists = on(1, source, released, 6);
    assert_eq!(lists.n_slots(), released.n_slots(), "{name}: not one list per slot");
    assert!(lists.longest() <= 6, "{name}: a list has {} records, not at most 6", lists.longest());
    let finite = lists.scores().is_none_or(|scores| scores.iter().all(|score| score.is_finite()));
    assert!(finite, "{name}: a score is not finite");
    assert_eq!(lists.about().map, Some(released.fingerprint()), "{name}: wrong map");
    assert!(lists == on(3, source, released, 6), "{name}: the number of threads changes lists");
    if let Ok(lists) = source.lists(released, released.n_records() + 1, 0) {
        assert!(lists.longest() < released.n_records(), "{name}: a record lists itself");
    }
}

fn on<const D: usize>(
    threads: usize,
    source: &dyn Source<D>,
    released: &Released<D>,
    k: usize,
) -> Neighborhoods {
    let made = on_threads(threads, || source.lists(released, k, 1));
    made.unwrap_or_else(|error| panic!("{} makes no lists: {error}", source.name()))
}

/// Returns a room hidden by `scheme`, with SIFT-like descriptors (128 bytes) that change slowly
/// over the room, and the secret, with which you can measure lists.
///
/// # Panics
/// When the scheme cannot hide a room of `n` points.
pub fn described_map(scheme: &dyn Scheme<3>, n: usize) -> (Original<3>, Released<3>, Secret) {
    let points: Vec<[f64; 3]> = room(4, n);
    let value = |point: &[f64; 3], bin: usize| {
        let mut draws = Draws::new(99, Stage::Synthetic, bin as u64);
        let phase: f64 = point.iter().map(|x| draws.between(-3.0, 3.0) * x).sum();
        (60.0 + 55.0 * (phase + draws.between(0.0, 6.0)).sin()) as u8
    };
    let bytes = points.iter().flat_map(|point| (0..128).map(|bin| value(point, bin))).collect();
    let descriptors = Descriptors::try_new(Values::U8(bytes), 128).expect("128 bytes a point");
    let original = Original::new(PointSet::try_new(points, Unit::Meter).expect("finite points"));
    let (released, secret) = obfuscate(scheme, &original, Some(&descriptors), &Key::from_seed(1))
        .unwrap_or_else(|error| panic!("{} cannot hide a room: {error}", scheme.name()));
    (original, released, secret)
}
