//! Where an attacker gets neighborhoods from a released map alone: one entry per source.

use std::any::Any;

use super::compare::MOST_ROWS;
use super::overlap::{self, overlap};
use super::{Neighborhoods, geometric, join, similarity};
use crate::released::Released;
use crate::{About, Descriptors, Error, RowOrder};

/// Makes lists of a number of records per slot; the last argument is the attacker's seed.
pub type Make<const D: usize> = fn(&Released<D>, usize, u64) -> Result<Neighborhoods, Error>;

/// A source as users choose it.
#[derive(Clone, Copy, Debug)]
pub struct SourceEntry {
    /// Its name.
    pub name: &'static str,
    /// What it does, in one line.
    pub summary: &'static str,
    /// Whether the released map must have descriptors.
    pub needs_descriptors: bool,
    /// Refuses descriptors of a kind that it cannot read.
    pub takes: fn(&Descriptors) -> Result<(), Error>,
    /// Records per list unless asked otherwise: the attack's own choice, few where the first of a
    /// ranking are much better than the rest.
    pub usual_k: usize,
    /// Whether in company it only ranks what the others list: recovery errs as it does, so that its own
    /// entries would confirm wrong places.
    pub only_ranks: bool,
    /// The same for images: of their fewer keypoints, only the first of a ranking are near.
    pub usual_k_2d: usize,
    /// For images, where it is defined on them.
    pub in_2d: Option<Make<2>>,
    /// For maps, where it is defined on them.
    pub in_3d: Option<Make<3>>,
}

impl SourceEntry {
    /// How it makes lists in `D` dimensions, if it does.
    pub fn of_dimension<const D: usize>(&self) -> Option<Make<D>> {
        // A constant cannot choose between two types; `Any` asks whether they are the same.
        let of: &dyn Any = if D == 2 { &self.in_2d } else { &self.in_3d };
        of.downcast_ref::<Option<Make<D>>>().copied().flatten()
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
        needs_descriptors: true,
        takes: |_| Ok(()),
        usual_k: 30,
        usual_k_2d: 10,
        only_ranks: false,
        in_2d: Some(|released, k, _| similarity(released, k)),
        in_3d: Some(|released, k, _| similarity(released, k)),
    },
    SourceEntry {
        name: "overlap",
        summary: "records whose SIFT patches overlap, and a short walk from these; no training",
        needs_descriptors: true,
        takes: overlap::check,
        usual_k: 35,
        usual_k_2d: 10,
        only_ranks: false,
        in_2d: Some(|released, k, _| overlap(released, k)),
        in_3d: Some(|released, k, _| overlap(released, k)),
    },
    SourceEntry {
        name: "geometric",
        summary: "records that meet where records alone say that points are; no descriptors",
        needs_descriptors: false,
        takes: |_| Ok(()),
        usual_k: 50,
        usual_k_2d: 10,
        only_ranks: true,
        in_2d: None,
        in_3d: Some(|released, k, _| geometric(released, k)),
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

/// One source or several joined ones, and how many records a list has.
#[derive(Clone, Debug, PartialEq)]
pub struct Joined {
    parts: Vec<&'static SourceEntry>,
    k: usize,
}

impl Joined {
    /// The sources named in `text`, joined by `+`, each once. A list has as many records as the
    /// source that chooses most; those that only rank choose none in company.
    ///
    /// # Errors
    /// When a name is unknown or stands twice.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let mut parts: Vec<&'static SourceEntry> = Vec::new();
        for name in text.split('+') {
            let entry = source(name.trim())?;
            if parts.contains(&entry) {
                return Err(Error::new("joined sources", "each once", format!("{name} twice")));
            }
            parts.push(entry);
        }
        let names = parts.iter().any(|entry| !entry.only_ranks);
        let chosen = parts.iter().filter(|entry| !(names && entry.only_ranks));
        let k = chosen.map(|entry| entry.usual_k).max().unwrap_or(1);
        Ok(Self { parts, k })
    }

    /// The same sources with as many records per list as they choose in images.
    #[must_use]
    pub fn for_images(self) -> Self {
        let k = self.parts.iter().map(|entry| entry.usual_k_2d).max().unwrap_or(1);
        self.with_k(k)
    }

    /// The first of the sources that is not defined in `D` dimensions.
    pub fn not_in_dimension<const D: usize>(&self) -> Option<&'static SourceEntry> {
        self.parts.iter().copied().find(|entry| entry.of_dimension::<D>().is_none())
    }

    /// The same sources with `k` records per list.
    #[must_use]
    pub fn with_k(self, k: usize) -> Self {
        Self { k, ..self }
    }

    /// The names, joined by `+`.
    pub fn name(&self) -> String {
        self.parts.iter().map(|entry| entry.name).collect::<Vec<_>>().join("+")
    }

    /// Records per list.
    pub fn k(&self) -> usize {
        self.k
    }

    /// Whether a map without descriptors is of no use.
    pub fn needs_descriptors(&self) -> bool {
        self.parts.iter().any(|entry| entry.needs_descriptors)
    }

    /// Refuses descriptors of a kind that one of the sources cannot read.
    ///
    /// # Errors
    /// What that source expects, and what it found.
    pub fn check_descriptors(&self, descriptors: &Descriptors) -> Result<(), Error> {
        self.parts.iter().try_for_each(|entry| (entry.takes)(descriptors))
    }

    /// What a user should know about lists for `n_slots` hidden points, if anything.
    pub fn note(&self, n_slots: usize) -> Option<String> {
        (self.needs_descriptors() && n_slots > MOST_ROWS).then(|| {
            format!(
                "{}: of more than {MOST_ROWS} points each is compared with those whose descriptors look alike on the \
                 whole: some neighbors that all pairs would tell are missed",
                self.name()
            )
        })
    }

    /// Lists for every slot of a released map or image, from it alone.
    ///
    /// # Errors
    /// When a source is not defined in `D` dimensions, or cannot work on this one.
    pub fn make<const D: usize>(
        &self,
        released: &Released<D>,
        seed: u64,
    ) -> Result<Neighborhoods, Error> {
        let lists = self.parts.iter().map(|entry| {
            let make = entry.of_dimension::<D>().ok_or_else(|| {
                let expected = format!("one that is defined in {D} dimensions");
                Error::new("source", expected, entry.name)
            })?;
            make(released, self.k, seed).map_err(|error| error.within(entry.name))
        });
        let mut lists = lists.collect::<Result<Vec<_>, _>>()?;
        match lists.len() {
            1 => Ok(lists.remove(0)),
            _ => {
                let ranks: Vec<bool> = self.parts.iter().map(|entry| entry.only_ranks).collect();
                let (n_records, slots) = (released.n_records(), released.slots_per_record());
                join(&lists, &ranks, self.k, n_records, slots)
            }
        }
    }

    /// The same, with lists as long as can be where there are fewer other records than a list has: empty ones of a
    /// single record. An attacker takes what there is.
    ///
    /// # Errors
    /// As [`make`](Self::make).
    pub fn make_of_what_there_is<const D: usize>(
        &self,
        released: &Released<D>,
        seed: u64,
    ) -> Result<Neighborhoods, Error> {
        let (n_slots, n_records) = (released.n_slots(), released.n_records());
        let others = n_records.saturating_sub(1);
        if others > 0 {
            return self.clone().with_k(self.k.min(others)).make(released, seed);
        }
        let (offsets, slots) = (vec![0; n_slots + 1], released.slots_per_record());
        let lists = Neighborhoods::try_new(offsets, Vec::new(), None, n_records, slots)?;
        let map = Some(released.fingerprint());
        Ok(lists.with_about(About { map, order: RowOrder::DescriptorRows }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_joined_and_the_largest_usual_k_counts() {
        let joined = Joined::parse("overlap+similarity").unwrap();
        assert_eq!((joined.name().as_str(), joined.k()), ("overlap+similarity", 35));
        assert_eq!(Joined::parse("overlap").unwrap().k(), 35);
        assert_eq!(Joined::parse("overlap").unwrap().with_k(7).k(), 7);
    }

    #[test]
    fn unknown_and_repeated_names_are_told() {
        let message = |text: &str| Joined::parse(text).unwrap_err().to_string();
        assert!(message("overlop").starts_with("source: expected one of similarity, overlap"));
        assert_eq!(
            message("overlap+overlap"),
            "joined sources: expected each once, found overlap twice"
        );
    }

    #[test]
    fn only_large_maps_with_descriptors_call_for_a_note() {
        let note = |name: &str, n| Joined::parse(name).unwrap().note(n);
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
