//! Sources of neighborhoods by name: those of the core, those that need a network, and the best one
//! for given descriptors.

use std::sync::Arc;

use unlift::neighbors::sources::{self, Named, SourceEntry};
use unlift::neighbors::{Needs, Neighborhoods, Overlap, Similarity, Source};
use unlift::released::Released;
use unlift::{Descriptors, Error};

/// The source `descriptors`: the best one for the given descriptors.
pub(crate) const BY_DESCRIPTORS: SourceEntry = SourceEntry {
    name: "descriptors",
    summary: "the best that descriptors allow: learned with a network for them, else overlap or similarity",
    in_2d: Some(|| Arc::new(ByDescriptors)),
    in_3d: Some(|| Arc::new(ByDescriptors)),
};

/// Returns all sources.
pub fn all() -> Vec<&'static SourceEntry> {
    let all = sources::SOURCES.iter();
    all.chain(unlift_vision::network::SOURCES).chain([&BY_DESCRIPTORS]).collect()
}

/// Returns the source called `name`.
///
/// # Errors
/// If there is none; the error lists the names.
pub fn named(name: &str) -> Result<Named, Error> {
    Named::parse_among(name, &all())
}

/// Uses `learned` if there is a network for the descriptors, otherwise `overlap` for SIFT and
/// `similarity` for others.
#[derive(Clone, Copy, Debug)]
struct ByDescriptors;

fn best<const D: usize>(descriptors: Option<&Descriptors>) -> Box<dyn Source<D>> {
    let takes = |source: &dyn Source<D>| descriptors.is_some_and(|some| source.takes(some).is_ok());
    if takes(&unlift_vision::network::Learned) {
        return Box::new(unlift_vision::network::Learned);
    }
    if takes(&Overlap) { Box::new(Overlap) } else { Box::new(Similarity) }
}

impl<const D: usize> Source<D> for ByDescriptors {
    fn name(&self) -> &str {
        BY_DESCRIPTORS.name
    }

    fn needs(&self) -> Needs {
        Needs::Descriptors
    }

    fn k(&self, released: &Released<D>) -> usize {
        best(released.descriptors()).k(released)
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        best(released.descriptors()).lists(released, k, seed)
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        best::<D>(Some(descriptors)).takes(descriptors)
    }

    fn reads_descriptors_alone(&self) -> bool {
        true
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        Source::<D>::note(&Overlap, n_slots)
    }
}

#[cfg(test)]
mod tests {
    use unlift::descriptors::Values;

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
            best::<3>(Some(&descriptors)).name().to_owned()
        };
        let floats =
            |dim: usize| Values::F32((0..dim * 8).map(|at| (at * 37 % 11) as f32 - 5.0).collect());
        let sift = Values::U8((0..128 * 8).map(|at| (at * 37 % 101) as u8).collect());
        assert_eq!(best(sift, 128), "learned");
        assert_eq!(best(floats(128), 128), "learned");
        assert_eq!(best(floats(64), 64), "similarity");
    }
}
