//! Sources of neighborhoods by name: those of the core, those that need a network, and the best one for given descriptors.

use std::sync::Arc;

use unlift::audit::{NeighborsBy, Plan};
use unlift::neighbors::sources::{self, Named, SourceEntry};
use unlift::neighbors::{
    KeptPairs, Needs, Neighborhoods, Overlap, Similarity, Source, has_usual_order,
};
use unlift::released::Released;
use unlift::{Descriptors, Error, ErrorKind, RecordId};

/// The source `descriptors`: the best one for the given descriptors.
pub(crate) const BY_DESCRIPTORS: SourceEntry = SourceEntry {
    name: "descriptors",
    summary: "the best that descriptors allow: learned with a network for them, overlap or similarity",
    in_2d: Some(|| Arc::new(ByDescriptors)),
    in_3d: Some(|| Arc::new(ByDescriptors)),
};

/// Returns all sources.
pub fn all() -> Vec<&'static SourceEntry> {
    let all = sources::SOURCES.iter();
    all.chain(unlift_vision::network::SOURCES).chain([&BY_DESCRIPTORS]).collect()
}

/// Returns the source called `name`.
pub fn named(name: &str) -> Result<Named, Error> {
    Named::parse_among(name, &all())
}

/// Returns the sources of an audit of a map whose user names none: the attacker's best one, if there are descriptors, and the oracle.
pub fn usual<const D: usize>(has_descriptors: bool) -> Vec<NeighborsBy<D>> {
    let best =
        has_descriptors.then(|| NeighborsBy::Source(Arc::new(ByDescriptors) as Arc<dyn Source<D>>));
    best.into_iter().chain([NeighborsBy::Oracle]).collect()
}

/// Uses `learned` for SIFT whose columns have the usual order, and for others of a network's width unless lists by `similarity` agree better
/// with themselves; `similarity` for all others.
#[derive(Clone, Copy, Debug)]
struct ByDescriptors;

/// Factor by which lists by `similarity` must agree better with themselves than those of a network (docs/decisions/sources.md). A walk
/// along the network's lists of SIFT makes these agree, so that a little less decides there.
const BETTER: f64 = 1.08;
const BETTER_THAN_WALK: f64 = 0.95;

/// Returns the source for the kind of `descriptors`, and another one with its factor if the kind is a guess.
fn candidates<const D: usize>(
    descriptors: Option<&Descriptors>,
) -> (Box<dyn Source<D>>, Option<(Similarity, f64)>) {
    let takes = |source: &dyn Source<D>| descriptors.is_some_and(|some| source.takes(some).is_ok());
    match (takes(&unlift_vision::network::Learned), takes(&Overlap)) {
        (true, is_sift) => {
            let is_sure = is_sift && (D == 2 || descriptors.is_some_and(has_usual_order));
            let factor = if is_sift { BETTER_THAN_WALK } else { BETTER };
            (Box::new(unlift_vision::network::Learned), (!is_sure).then_some((Similarity, factor)))
        }
        (false, true) => (Box::new(Overlap), None),
        (false, false) => (Box::new(Similarity), None),
    }
}

/// Returns how well lists agree with themselves: the share of entries that a list has in common with those of its entries, where only
/// pairs that list each other count.
fn agreement(lists: &Neighborhoods, slots_per_record: usize) -> f64 {
    let (mut common, mut all) = (0, 0);
    for slot in 0..lists.n_slots() {
        let (own, record) = (lists.of(slot), RecordId((slot / slots_per_record) as u32));
        let slots =
            |id: &RecordId| id.index() * slots_per_record..(id.index() + 1) * slots_per_record;
        for others in own.iter().flat_map(slots).map(|record| lists.of(record)) {
            all += others.len();
            if others.binary_search(&record).is_ok() {
                common += others.iter().filter(|id| own.binary_search(id).is_ok()).count();
            }
        }
    }
    common as f64 / all.max(1) as f64
}

impl<const D: usize> Source<D> for ByDescriptors {
    fn name(&self) -> &str {
        BY_DESCRIPTORS.name
    }

    fn needs(&self) -> Needs {
        Needs::DescriptorsAlone
    }

    fn k(&self, released: &Released<D>) -> usize {
        candidates(released.descriptors()).0.k(released)
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        self.lists_keeping(released, k, seed, &mut KeptPairs::default())
    }

    fn lists_keeping(
        &self,
        released: &Released<D>,
        k: usize,
        seed: u64,
        kept: &mut KeptPairs,
    ) -> Result<Neighborhoods, Error> {
        let (first, second) = candidates(released.descriptors());
        let lists = first.lists_keeping(released, k, seed, kept)?;
        let Some((second, factor)) = second else { return Ok(lists) };
        let others = second.lists_keeping(released, k, seed, kept)?;
        let agreement = |lists| agreement(lists, released.slots_per_record());
        Ok(if agreement(&others) > factor * agreement(&lists) { others } else { lists })
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        candidates::<D>(Some(descriptors)).0.takes(descriptors)
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        Source::<D>::note(&Overlap, n_slots)
    }
}

/// Returns an error if a source of `plan` does not support the descriptors. `place` says where they are expected.
pub fn check_fit<const D: usize>(
    plan: &Plan<D>,
    descriptors: Option<&Descriptors>,
    place: &str,
) -> Result<(), crate::Error> {
    for source in plan.own_sources() {
        let wrong =
            |text: String| crate::Error::request(format!("--neighbors {}: {text}", source.name()));
        match descriptors.map(|descriptors| source.takes(descriptors)) {
            None if source.needs() != Needs::Nothing => {
                let expected = format!("expected descriptors {place}");
                return Err(wrong(format!("{}, found none", expected.trim_end())));
            }
            None | Some(Ok(())) => {}
            // Errors of another kind are about the source's model and name its path.
            Some(Err(error)) if error.kind() != ErrorKind::Descriptors => {
                return Err(wrong(error.to_string()));
            }
            Some(Err(error)) => {
                let (expected, found) = (error.expected(), error.found());
                let advice = "--neighbors similarity, which takes descriptors of any kind";
                return Err(wrong(format!("expected {expected}, found {found}")).advise(advice));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use unlift::descriptors::Values;
    use unlift::neighbors::KeptLists;
    use unlift::obfuscate::{obfuscate, olc};
    use unlift::seed::Key;
    use unlift::truth::Original;
    use unlift::{PointSet, Unit};
    use unlift_vision::features::{Extraction, Extractor};

    use super::*;

    #[test]
    fn names_of_all_crates_are_known_and_different() {
        let all = all();
        for (at, entry) in all.iter().enumerate() {
            assert_eq!(named(entry.name).map(|named| named.name()), Ok(entry.name));
            assert!(all[..at].iter().all(|other| other.name != entry.name), "{}", entry.name);
        }
        assert!(all.iter().any(|entry| entry.name == "learned"));
    }

    #[test]
    fn the_best_source_follows_the_descriptors() {
        let best = |values: Values, dim: usize| {
            let descriptors = Descriptors::try_new(values, dim).unwrap();
            let (first, other) = candidates::<3>(Some(&descriptors));
            (first.name().to_owned(), other.is_some())
        };
        let floats =
            |dim: usize| Values::F32((0..dim * 8).map(|at| (at * 37 % 11) as f32 - 5.0).collect());
        let sift = Values::U8((0..128 * 8).map(|at| (at * 37 % 101) as u8).collect());
        assert_eq!(best(sift, 128), ("learned".to_owned(), false));
        assert_eq!(best(floats(128), 128), ("learned".to_owned(), true));
        assert_eq!(best(floats(64), 64), ("similarity".to_owned(), false));
    }

    #[test]
    fn kept_lists_of_a_network_equal_those_of_the_map_alone() {
        let sift = Values::U8((0..128 * 200).map(|at: usize| (at * at % 97) as u8).collect());
        let descriptors = Descriptors::try_new(sift, 128).unwrap();
        let points = (0..200).map(|at| [f64::from(at), f64::from(at % 7), f64::from(at % 11)]);
        let original = Original::new(PointSet::try_new(points.collect(), Unit::Meter).unwrap());
        let [a, b] = [1, 2].map(|seed| {
            obfuscate(&olc::ENTRY, &original, Some(&descriptors), &Key::from_seed(seed)).unwrap().0
        });
        for name in ["learned", "descriptors"] {
            let source = named(name).unwrap().of_dimension::<3>().unwrap();
            let lists = |map| source.lists(map, 12, 0).unwrap();
            assert_ne!(lists(&a), lists(&b), "{name}: records are in another order");
            assert_eq!(KeptLists::new(&a, &lists(&a)).unwrap().of(&b), Some(lists(&b)), "{name}");
        }
    }

    #[test]
    fn lists_that_agree_better_decide_between_aliked_and_others() {
        let photo = "../unlift-cli/src/demo/photos/coffee.jpg".as_ref();
        let photo = Extractor::try_new(&Extraction::ALIKED).unwrap().read(photo).unwrap();
        let Values::F32(aliked) = photo.descriptors else { panic!("no ALIKED") };
        // A Hadamard matrix turns descriptors and keeps their distances, as if another network had made them.
        let turned = aliked.chunks_exact(128).flat_map(|row| {
            let sign = |r: usize, c: usize| {
                if (r & c).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
            };
            (0..128).map(move |r| (0..128).map(|c| sign(r, c) * row[c]).sum::<f32>())
        });
        for (values, is_aliked) in [(aliked.clone(), true), (turned.collect(), false)] {
            let descriptors = Descriptors::try_new(Values::F32(values), 128).unwrap();
            let points = (0..descriptors.len()).map(|at| [at as f64, (at % 7) as f64, 0.0]);
            let original = Original::new(PointSet::try_new(points.collect(), Unit::Meter).unwrap());
            let map = obfuscate(&olc::ENTRY, &original, Some(&descriptors), &Key::from_seed(1))
                .unwrap()
                .0;
            let lists = |source: &dyn Source<3>| source.lists(&map, 7, 0).unwrap();
            let expected: &dyn Source<3> =
                if is_aliked { &unlift_vision::network::Learned } else { &Similarity };
            assert_eq!(lists(&ByDescriptors), lists(expected));
        }
    }
}
