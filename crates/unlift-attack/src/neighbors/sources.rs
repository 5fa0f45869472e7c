//! The trait [`Source`], which makes neighborhoods from a released map alone and which you can implement, and the registry of sources.

use std::fmt::Debug;
use std::sync::Arc;

use super::{Geometric, KeptPairs, Neighborhoods, Overlap, Similarity};
use crate::compiled::Both;
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
    /// These descriptors alone, whatever their order, without the records and the seed. An audit makes lists once for all schemes that
    /// release the same descriptors ([`KeptLists`](super::KeptLists)).
    DescriptorsAlone,
}

/// Makes lists of near records from what is released. An audit takes `Arc<dyn Source<D>>`; [`SOURCES`] lists the sources of this crate.
pub trait Source<const D: usize>: Debug + Send + Sync {
    /// Name in rows, gates and reports: one word.
    fn name(&self) -> &str;

    /// The data it needs besides the records.
    fn needs(&self) -> Needs;

    /// Default number of records per list for this map: few if the first records of a ranking are much better than the rest.
    fn k(&self, released: &Released<D>) -> usize;

    /// Returns lists of at most `k` records for every slot. If descriptors distinguish the slots of a record, rows are in the order
    /// of descriptors ([`RowOrder`]); a source that reads records alone states [`RowOrder::Either`]. Scores, if
    /// any, are higher for likelier neighbors; recovery learns what they mean. All randomness comes from `seed`.
    ///
    /// # Errors
    /// When this map allows no lists.
    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error>;

    /// Rejects descriptors that the source cannot read.
    ///
    /// # Errors
    /// States what kind of descriptors it expects, and what it found.
    fn takes(&self, _descriptors: &Descriptors) -> Result<(), Error> {
        Ok(())
    }

    /// Rejects a map that the source cannot work on, before anything is computed.
    ///
    /// # Errors
    /// States what it expects of a map, and what it found.
    fn supports(&self, released: &Released<D>) -> Result<(), Error> {
        match (self.needs(), released.descriptors()) {
            (Needs::Nothing, _) => Ok(()),
            (_, Some(descriptors)) => self.takes(descriptors),
            (_, None) => Err(lacks_descriptors(self.name())),
        }
    }

    /// Returns the lists of [`lists`](Self::lists), and keeps the scores of pairs for further maps with nearly the same descriptors.
    ///
    /// # Errors
    /// When [`lists`](Self::lists) fails.
    fn lists_keeping(
        &self,
        released: &Released<D>,
        k: usize,
        seed: u64,
        _kept: &mut KeptPairs,
    ) -> Result<Neighborhoods, Error> {
        self.lists(released, k, seed)
    }

    /// Returns a note for users about lists for `n_slots` hidden points, if there is one.
    fn note(&self, _n_slots: usize) -> Option<String> {
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

/// A source of the registry.
#[derive(Debug)]
pub struct SourceEntry {
    /// Its name.
    pub name: &'static str,
    /// One line about how it works.
    pub summary: &'static str,
    /// Creates the source for images, if it is defined on them.
    pub in_2d: Option<fn() -> Arc<dyn Source<2>>>,
    /// Creates the source for maps, if it is defined on them.
    pub in_3d: Option<fn() -> Arc<dyn Source<3>>>,
}

impl SourceEntry {
    /// Returns the source in `D` dimensions, if it is defined there.
    pub fn of_dimension<const D: usize>(&self) -> Option<Arc<dyn Source<D>>> {
        let build = Both(self.in_2d, self.in_3d).of::<Option<fn() -> Arc<dyn Source<D>>>>();
        build.ok().flatten().map(|build| build())
    }
}

impl PartialEq for SourceEntry {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// All sources of this crate. `unlift-audit` adds those that need a network, and `descriptors`.
pub const SOURCES: &[SourceEntry] = &[
    SourceEntry {
        name: "similarity",
        summary: "records with the most similar descriptors, of any kind; of learned ones with a short walk",
        in_2d: Some(|| Arc::new(Similarity)),
        in_3d: Some(|| Arc::new(Similarity)),
    },
    SourceEntry {
        name: "overlap",
        summary: "records whose SIFT patches overlap, and a short walk from these; no training",
        in_2d: Some(|| Arc::new(Overlap)),
        in_3d: Some(|| Arc::new(Overlap)),
    },
    SourceEntry {
        name: "geometric",
        summary: "records that meet where records alone say that points are; no descriptors",
        in_2d: None,
        in_3d: Some(|| Arc::new(Geometric)),
    },
];

/// A source of the registry and the length of its lists.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    entry: &'static SourceEntry,
    k: Option<usize>,
}

impl Named {
    /// Returns the source of [`SOURCES`] with this name.
    ///
    /// # Errors
    /// When there is none. The error lists the names.
    pub fn parse(name: &str) -> Result<Self, Error> {
        Self::parse_among(name, &SOURCES.iter().collect::<Vec<_>>())
    }

    /// Returns the source with this name from a registry that other crates have extended.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn parse_among(name: &str, known: &[&'static SourceEntry]) -> Result<Self, Error> {
        let name = name.trim();
        let entry = known.iter().copied().find(|entry| entry.name == name).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|entry| entry.name).collect();
            Error::new("source", format!("one of {}", names.join(", ")), name)
        })?;
        Ok(Self { entry, k: None })
    }

    /// Sets the number of records per list, in place of the default of the source.
    #[must_use]
    pub fn with_k(self, k: usize) -> Self {
        Self { k: Some(k), ..self }
    }

    /// Name of the source.
    pub fn name(&self) -> &'static str {
        self.entry.name
    }

    /// Returns the source in `D` dimensions.
    ///
    /// # Errors
    /// When it is not defined there.
    pub fn of_dimension<const D: usize>(&self) -> Result<Arc<dyn Source<D>>, Error> {
        let Some(source) = self.entry.of_dimension::<D>() else {
            let expected = format!("one that is defined in {D} dimensions");
            return Err(Error::new("source", expected, self.entry.name));
        };
        Ok(Arc::new(Chosen { source, k: self.k }))
    }
}

/// A source with a chosen list length; its errors contain its name.
#[derive(Clone, Debug)]
struct Chosen<const D: usize> {
    source: Arc<dyn Source<D>>,
    k: Option<usize>,
}

impl<const D: usize> Source<D> for Chosen<D> {
    fn name(&self) -> &str {
        self.source.name()
    }

    fn needs(&self) -> Needs {
        self.source.needs()
    }

    fn k(&self, released: &Released<D>) -> usize {
        self.k.unwrap_or_else(|| self.source.k(released))
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        self.source.lists(released, k, seed).map_err(|error| error.within(self.name()))
    }

    fn lists_keeping(
        &self,
        released: &Released<D>,
        k: usize,
        seed: u64,
        kept: &mut KeptPairs,
    ) -> Result<Neighborhoods, Error> {
        let lists = self.source.lists_keeping(released, k, seed, kept);
        lists.map_err(|error| error.within(self.name()))
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        self.source.takes(descriptors)
    }

    fn supports(&self, released: &Released<D>) -> Result<(), Error> {
        self.source.supports(released).map_err(|error| error.within(self.name()))
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        self.source.note(n_slots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptors::Values;
    use crate::neighbors::compare::MOST_ROWS;
    use crate::neighbors::described;

    fn named(name: &str) -> Named {
        Named::parse(name).unwrap()
    }

    #[test]
    fn lists_are_as_long_as_the_source_chooses_or_as_asked() {
        let sift = Values::U8((0..=255).collect());
        let learned = Values::F32((0..256).map(|at| -(at as f32)).collect());
        let [sift, learned] =
            [sift, learned].map(|values| described(Descriptors::try_new(values, 128).unwrap(), 1));
        for (source, map, k) in [
            (named("overlap"), &sift, 35),
            (named("similarity"), &sift, 30),
            (named("similarity"), &learned, 12),
            (named("overlap").with_k(7), &sift, 7),
        ] {
            assert_eq!(source.of_dimension::<3>().unwrap().k(map), k);
        }
    }

    #[test]
    fn only_large_maps_with_descriptors_call_for_a_note() {
        let note = |name: &str, n| named(name).of_dimension::<3>().unwrap().note(n);
        assert!(note("similarity", MOST_ROWS + 1).unwrap().starts_with("similarity: of more"));
        assert_eq!(note("overlap", MOST_ROWS), None);
        assert_eq!(note("geometric", MOST_ROWS + 1), None);
    }
}
