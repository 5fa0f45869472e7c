//! Where an attacker gets neighborhoods from a released map alone: the seam that anybody may implement.

use std::fmt::Debug;

use super::Neighborhoods;
use crate::released::Released;
use crate::{About, Descriptors, Error, RowOrder};

/// What a source needs beside the records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Needs {
    /// Nothing: the records suffice.
    Nothing,
    /// The descriptors that are released with the records.
    Descriptors,
}

/// Makes lists of near records from what is released. Anybody may write one: what is audited is
/// `Arc<dyn Source<D>>`, and [`SOURCES`](super::sources::SOURCES) only lists ours. What it has learned elsewhere
/// (weights of a network) are fields of the type.
pub trait Source<const D: usize>: Debug + Send + Sync {
    /// The name in rows, gates and reports: one word.
    fn name(&self) -> &str;

    /// What it needs beside the records.
    fn needs(&self) -> Needs;

    /// Records per list for this map unless asked otherwise: the attack's own choice, few where the first of a
    /// ranking are much better than the rest.
    fn k(&self, released: &Released<D>) -> usize;

    /// Lists of at most `k` records for every slot, by descriptor row where slots of a record are told apart by
    /// descriptors ([`RowOrder`](crate::RowOrder)); a source that looks at records alone says
    /// [`RowOrder::Either`]. Scores, where there are some, are higher for likelier
    /// neighbors; recovery learns what they are worth. All chance comes from `seed`, the attacker's.
    ///
    /// # Errors
    /// When this map allows no lists.
    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error>;

    /// Refuses descriptors of a kind that it cannot read.
    ///
    /// # Errors
    /// What it expects, and what it found.
    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        let _ = descriptors;
        Ok(())
    }

    /// Refuses a map that it cannot work on, before anything is computed.
    ///
    /// # Errors
    /// What it expects of a map, and what it found.
    fn supports(&self, released: &Released<D>) -> Result<(), Error> {
        match (self.needs(), released.descriptors()) {
            (Needs::Nothing, _) => Ok(()),
            (Needs::Descriptors, Some(descriptors)) => self.takes(descriptors),
            (Needs::Descriptors, None) => Err(lacks_descriptors(self.name())),
        }
    }

    /// What a user should know about lists for `n_slots` hidden points, if anything.
    fn note(&self, n_slots: usize) -> Option<String> {
        let _ = n_slots;
        None
    }
}

/// The lists of `source`, as long as can be where there are fewer other records than a list has: empty ones of a single
/// record. An attacker takes what there is.
///
/// # Errors
/// When the source does not support this map.
pub fn of_what_there_is<const D: usize>(
    source: &dyn Source<D>,
    released: &Released<D>,
    seed: u64,
) -> Result<Neighborhoods, Error> {
    let (n_slots, n_records) = (released.n_slots(), released.n_records());
    let others = n_records.saturating_sub(1);
    if others > 0 {
        source.supports(released)?;
        return source.lists(released, source.k(released).min(others), seed);
    }
    let (offsets, slots) = (vec![0; n_slots + 1], released.slots_per_record());
    let lists = Neighborhoods::try_new(offsets, Vec::new(), None, n_records, slots)?;
    let map = Some(released.fingerprint());
    Ok(lists.with_about(About { map, order: RowOrder::DescriptorRows, ..About::default() }))
}

/// The error of a source that needs descriptors and has none.
pub fn lacks_descriptors(name: &str) -> Error {
    Error::new("descriptors", format!("some, as neighbors by {name} need them"), "none")
}
