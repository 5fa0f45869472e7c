//! Sources by name: the registry, and several of its sources joined into one.

use std::any::Any;
use std::sync::Arc;

use super::compare::MOST_ROWS;
use super::geometric::Geometric;
use super::overlap::Overlap;
use super::similarity::Similarity;
use super::source::{Needs, Source};
use super::{Neighborhoods, join};
use crate::released::Released;
use crate::{Descriptors, Error};

/// A source of ours as users choose it.
#[derive(Debug)]
pub struct SourceEntry {
    /// Its name.
    pub name: &'static str,
    /// What it does, in one line.
    pub summary: &'static str,
    /// For images, where it is defined on them.
    pub in_2d: Option<fn() -> Arc<dyn Source<2>>>,
    /// For maps, where it is defined on them.
    pub in_3d: Option<fn() -> Arc<dyn Source<3>>>,
}

impl SourceEntry {
    /// The source in `D` dimensions, if it is defined there.
    pub fn of_dimension<const D: usize>(&self) -> Option<Arc<dyn Source<D>>> {
        // A constant cannot choose between two types; `Any` asks whether they are the same.
        let of: &dyn Any = if D == 2 { &self.in_2d } else { &self.in_3d };
        let build = of.downcast_ref::<Option<fn() -> Arc<dyn Source<D>>>>().copied().flatten();
        build.map(|build| build())
    }
}

impl PartialEq for SourceEntry {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// All sources.
pub const SOURCES: &[SourceEntry] = &[
    SourceEntry {
        name: "similarity",
        summary: "records with the most similar descriptors, of any kind",
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

/// The source called `name`.
///
/// # Errors
/// When there is none; the error lists the names.
pub fn source(name: &str) -> Result<&'static SourceEntry, Error> {
    SOURCES.iter().find(|entry| entry.name == name).ok_or_else(|| {
        let names: Vec<&str> = SOURCES.iter().map(|entry| entry.name).collect();
        Error::new("source", format!("one of {}", names.join(", ")), name)
    })
}

/// Sources of the registry as a user names them, and how long their lists shall be.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    entries: Vec<&'static SourceEntry>,
    k: Option<usize>,
}

impl Named {
    /// The sources named in `text`, joined by `+`, each once.
    ///
    /// # Errors
    /// When a name is unknown or stands twice.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let mut entries: Vec<&'static SourceEntry> = Vec::new();
        for name in text.split('+') {
            let entry = source(name.trim())?;
            if entries.contains(&entry) {
                return Err(Error::new("joined sources", "each once", format!("{name} twice")));
            }
            entries.push(entry);
        }
        Ok(Self { entries, k: None })
    }

    /// The same sources with `k` records per list, not as many as they choose.
    #[must_use]
    pub fn with_k(self, k: usize) -> Self {
        Self { k: Some(k), ..self }
    }

    /// The names, joined by `+`.
    pub fn name(&self) -> String {
        self.entries.iter().map(|entry| entry.name).collect::<Vec<_>>().join("+")
    }

    /// The first of the sources that is not defined in `D` dimensions.
    pub fn not_in_dimension<const D: usize>(&self) -> Option<&'static SourceEntry> {
        self.entries.iter().copied().find(|entry| entry.of_dimension::<D>().is_none())
    }

    /// The source in `D` dimensions.
    ///
    /// # Errors
    /// When one of them is not defined there.
    pub fn of_dimension<const D: usize>(&self) -> Result<Arc<dyn Source<D>>, Error> {
        let part = |entry: &&'static SourceEntry| {
            entry.of_dimension::<D>().ok_or_else(|| {
                let expected = format!("one that is defined in {D} dimensions");
                Error::new("source", expected, entry.name)
            })
        };
        let joined = Joined::new(self.entries.iter().map(part).collect::<Result<_, _>>()?)?;
        Ok(Arc::new(match self.k {
            Some(k) => joined.with_k(k),
            None => joined,
        }))
    }
}

/// Several sources as one. Alone a source stays what it is.
#[derive(Clone, Debug)]
pub struct Joined<const D: usize> {
    parts: Vec<Arc<dyn Source<D>>>,
    name: String,
    k: usize,
}

impl<const D: usize> Joined<D> {
    /// Joins `parts`. A list has as many records as the source that chooses most; those that only rank choose
    /// none in company.
    ///
    /// # Errors
    /// When there is no part.
    pub fn new(parts: Vec<Arc<dyn Source<D>>>) -> Result<Self, Error> {
        let names = parts.iter().any(|part| !part.only_ranks());
        let chosen = parts.iter().filter(|part| !(names && part.only_ranks()));
        let Some(k) = chosen.map(|part| part.k()).max() else {
            return Err(Error::new("joined sources", "at least one", "none"));
        };
        let name = parts.iter().map(|part| part.name()).collect::<Vec<_>>().join("+");
        Ok(Self { parts, name, k })
    }

    /// The same sources with `k` records per list.
    #[must_use]
    pub fn with_k(self, k: usize) -> Self {
        Self { k, ..self }
    }
}

impl<const D: usize> Source<D> for Joined<D> {
    fn name(&self) -> &str {
        &self.name
    }

    fn needs(&self) -> Needs {
        let needs = |part: &Arc<dyn Source<D>>| part.needs() == Needs::Descriptors;
        if self.parts.iter().any(needs) { Needs::Descriptors } else { Needs::Nothing }
    }

    fn k(&self) -> usize {
        self.k
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        let lists = self
            .parts
            .iter()
            .map(|part| part.lists(released, k, seed).map_err(|error| error.within(part.name())));
        let mut lists = lists.collect::<Result<Vec<_>, _>>()?;
        match lists.len() {
            1 => Ok(lists.remove(0)),
            _ => {
                let ranks: Vec<bool> = self.parts.iter().map(|part| part.only_ranks()).collect();
                join(&lists, &ranks, k, released.n_records(), released.slots_per_record())
            }
        }
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        self.parts.iter().try_for_each(|part| part.takes(descriptors))
    }

    fn supports(&self, released: &Released<D>) -> Result<(), Error> {
        let supports = |part: &Arc<dyn Source<D>>| {
            part.supports(released).map_err(|error| error.within(part.name()))
        };
        self.parts.iter().try_for_each(supports)
    }

    fn only_ranks(&self) -> bool {
        self.parts.iter().all(|part| part.only_ranks())
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        (self.needs() == Needs::Descriptors && n_slots > MOST_ROWS).then(|| {
            format!(
                "{}: of more than {MOST_ROWS} points each is compared with those whose descriptors look alike on the \
                 whole: some neighbors that all pairs would tell are missed",
                self.name
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_joined_and_the_largest_usual_k_counts() {
        let source = |name: &str| Named::parse(name).unwrap().of_dimension::<3>().unwrap();
        let joined = source("overlap+similarity");
        assert_eq!((joined.name(), joined.k()), ("overlap+similarity", 35));
        assert_eq!(source("overlap").k(), 35);
        assert_eq!(source("overlap+geometric").k(), 35);
        let few = Named::parse("overlap").unwrap().with_k(7);
        assert_eq!(few.of_dimension::<3>().unwrap().k(), 7);
        assert_eq!(few.of_dimension::<2>().unwrap().k(), 7);
        assert_eq!(Named::parse("overlap").unwrap().of_dimension::<2>().unwrap().k(), 10);
    }

    #[test]
    fn unknown_and_repeated_names_are_told() {
        let message = |text: &str| Named::parse(text).unwrap_err().to_string();
        assert!(message("overlop").starts_with("source: expected one of similarity, overlap"));
        assert_eq!(
            message("overlap+overlap"),
            "joined sources: expected each once, found overlap twice"
        );
    }

    #[test]
    fn only_large_maps_with_descriptors_call_for_a_note() {
        let note = |name: &str, n| Named::parse(name).unwrap().of_dimension::<3>().unwrap().note(n);
        assert!(
            note("overlap+geometric", MOST_ROWS + 1)
                .unwrap()
                .starts_with("overlap+geometric: of more")
        );
        assert_eq!(note("overlap", MOST_ROWS), None);
        assert_eq!(note("geometric", MOST_ROWS + 1), None);
    }

    #[test]
    fn every_name_is_one_word_of_its_own() {
        for (at, entry) in SOURCES.iter().enumerate() {
            assert!(entry.name.chars().all(|c| c.is_ascii_lowercase()), "{}", entry.name);
            assert!(SOURCES[..at].iter().all(|other| other.name != entry.name));
        }
    }
}
