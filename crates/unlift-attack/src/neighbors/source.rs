//! The trait [`Source`]: it makes neighborhoods from a released map alone. You can implement it.

use std::fmt::Debug;

use super::{KeptPairs, Neighborhoods};
use crate::released::Released;
use crate::{About, Descriptors, Error, RowOrder};

/// The data that a source needs besides the records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// The descriptors that are released with the records.
    Descriptors,
}

/// Makes lists of near records from what is released. An audit takes `Arc<dyn Source<D>>`;
/// [`SOURCES`](super::sources::SOURCES) lists the sources of this crate. What a source has learned elsewhere, such as the
/// weights of a network, is in its fields.
pub trait Source<const D: usize>: Debug + Send + Sync {
    /// Name in rows, gates and reports: one word.
    fn name(&self) -> &str;

    /// The data it needs besides the records.
    fn needs(&self) -> Needs;

    /// Default number of records per list for this map: few if the first records of a ranking are much better than the rest.
    fn k(&self, released: &Released<D>) -> usize;

    /// Returns lists of at most `k` records for every slot. If descriptors distinguish the slots of a record, rows are in the order
    /// of descriptors ([`RowOrder`](crate::RowOrder)); a source that reads records alone states [`RowOrder::Either`]. Scores, if
    /// any, are higher for likelier neighbors; recovery learns what they mean. All randomness comes from `seed`.
    ///
    /// # Errors
    /// When this map allows no lists.
    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error>;

    /// Rejects descriptors that the source cannot read.
    ///
    /// # Errors
    /// States what kind of descriptors it expects, and what it found.
    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        let _ = descriptors;
        Ok(())
    }

    /// Rejects a map that the source cannot work on, before anything is computed.
    ///
    /// # Errors
    /// States what it expects of a map, and what it found.
    fn supports(&self, released: &Released<D>) -> Result<(), Error> {
        match (self.needs(), released.descriptors()) {
            (Needs::Nothing, _) => Ok(()),
            (Needs::Descriptors, Some(descriptors)) => self.takes(descriptors),
            (Needs::Descriptors, None) => Err(lacks_descriptors(self.name())),
        }
    }

    /// Returns the lists of [`lists`](Self::lists). A source that compares all descriptors of a map keeps the scores of pairs, for further
    /// maps with nearly the same descriptors.
    ///
    /// # Errors
    /// When [`lists`](Self::lists) fails.
    fn lists_keeping(
        &self,
        released: &Released<D>,
        k: usize,
        seed: u64,
        kept: &mut KeptPairs,
    ) -> Result<Neighborhoods, Error> {
        let _ = kept;
        self.lists(released, k, seed)
    }

    /// Whether lists follow from the descriptors alone, whatever their order, without the records and the seed. Then an audit makes
    /// them once for all schemes that release the same descriptors ([`KeptLists`](super::KeptLists)).
    fn reads_descriptors_alone(&self) -> bool {
        false
    }

    /// Returns a note for users about lists for `n_slots` hidden points, if there is one.
    fn note(&self, n_slots: usize) -> Option<String> {
        let _ = n_slots;
        None
    }
}

/// Returns the lists of `source`; shorter ones if there are fewer other records than a list has, and empty ones for a single record.
///
/// # Errors
/// When the source does not support this map.
pub fn of_what_there_is<const D: usize>(
    source: &dyn Source<D>,
    released: &Released<D>,
    seed: u64,
) -> Result<Neighborhoods, Error> {
    let others = released.n_records().saturating_sub(1);
    if others > 0 {
        source.supports(released)?;
        return source.lists(released, source.k(released).min(others), seed);
    }
    let map = Some(released.fingerprint());
    let about = About { map, order: RowOrder::DescriptorRows, ..About::default() };
    Ok(Neighborhoods::empty(released.n_slots()).with_about(about))
}

/// Creates the error of a source that needs descriptors for a map without them.
pub fn lacks_descriptors(name: &str) -> Error {
    Error::new("descriptors", format!("some, as neighbors by {name} need them"), "none")
}
