//! Plan of an audit.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::observer::Measure;
use super::share::Threshold;
use crate::neighbors::oracle::Noise;
use crate::neighbors::{Needs, Source, lacks_descriptors};
use crate::obfuscate::{SCHEMES, Scheme, SchemeOptions};
use crate::recover::{Builtin, Solver};
use crate::seed::{Draws, Key, Stage};
use crate::{Error, ErrorKind, Unit};

/// Neighbors of every original, by row, from any source that the owner chooses.
#[derive(Clone, Debug, PartialEq)]
pub struct PointNeighbors {
    /// The name of the source in reports.
    pub name: String,
    /// Start of each point's list; one more entry than there are points.
    pub offsets: Vec<u64>,
    /// Rows of originals.
    pub neighbors: Vec<u32>,
    /// Confidence of each entry, if the source gives any.
    pub scores: Option<Vec<f32>>,
}

/// Source of the attacker's neighborhoods.
#[derive(Clone, Debug)]
pub enum NeighborsBy<const D: usize> {
    /// Ground truth, at each inlier ratio of the plan.
    Oracle,
    /// Given lists; their inlier ratio is measured.
    Given(PointNeighbors),
    /// A source that reads only the released map, like an attacker; its inlier ratio is measured.
    Source(Arc<dyn Source<D>>),
}

impl<const D: usize> NeighborsBy<D> {
    /// Returns the name used in reports.
    pub fn name(&self) -> &str {
        match self {
            Self::Oracle => "oracle",
            Self::Given(given) => &given.name,
            Self::Source(source) => source.name(),
        }
    }

    /// Returns true for the oracle.
    pub fn is_oracle(&self) -> bool {
        matches!(self, Self::Oracle)
    }

    /// Returns the attacker's own source, if it is one.
    pub fn source(&self) -> Option<&dyn Source<D>> {
        match self {
            Self::Source(source) => Some(&**source),
            Self::Oracle | Self::Given(_) => None,
        }
    }
}

/// Source, noise model and inlier ratio of a row.
#[derive(Clone, Copy, Debug)]
pub struct Variant<'a, const D: usize> {
    /// Source of the neighborhoods.
    pub by: &'a NeighborsBy<D>,
    /// Noise model of the oracle; `None` for other sources.
    pub noise: Option<Noise>,
    /// Requested inlier ratio; `None` if it will be measured.
    pub inlier_ratio: Option<f64>,
}

/// Plan of an audit: a row per scheme, source, noise model, inlier ratio and solver.
#[derive(Clone, Debug)]
pub struct Plan<const D: usize> {
    /// Schemes to audit, built-in or custom.
    pub schemes: Vec<Arc<dyn Scheme<D>>>,
    /// Sources of neighborhoods.
    pub neighbors: Vec<NeighborsBy<D>>,
    /// Noise models of the oracle.
    pub oracle_noise: Vec<Noise>,
    /// Inlier ratios of the oracle.
    pub inlier_ratios: Vec<f64>,
    /// True neighbors per slot, for the oracle and for the measured inlier ratio of an attacker's
    /// own lists. Given lists use the length of the longest list instead.
    pub k: usize,
    /// Solvers, built-in or custom.
    pub solvers: Vec<Arc<dyn Solver<D>>>,
    /// If true, maps are also attacked by records alone, the second baseline.
    pub records_alone: bool,
    /// Additional figures besides errors.
    pub measures: Vec<Arc<dyn Measure<D>>>,
    /// Errors below which a point counts as recovered.
    pub thresholds: Vec<Threshold>,
    /// Index of the threshold that break-even ratios use.
    pub headline: usize,
    /// Seed of the first repeat; each further repeat adds 1.
    pub seed: u64,
    /// Number of seeds to average.
    pub repeats: u32,
}

/// A map is small if it has fewer points than this number times K.
const SMALL: usize = 150;

impl<const D: usize> Plan<D> {
    /// Returns the default plan for points in `unit`: all built-in schemes of that dimension, six
    /// inlier ratios, and K = 50 for maps or K = 20 for images (pixels).
    pub fn new(unit: Unit) -> Self {
        let thresholds: &[&str] = match unit {
            Unit::Meter => &["0.10", "0.25"],
            Unit::KthNeighbor => &["1.0", "2.5"],
            Unit::Pixel => &["1", "5", "10", "25"],
        };
        let of_images = unit == Unit::Pixel;
        let options = SchemeOptions::usual(unit);
        Self {
            schemes: SCHEMES.iter().filter_map(|entry| entry.of_dimension(&options)).collect(),
            neighbors: vec![NeighborsBy::Oracle],
            oracle_noise: vec![Noise::Uniform],
            inlier_ratios: vec![1.0, 0.75, 0.5, 0.3, 0.2, 0.1],
            k: if of_images { 20 } else { 50 },
            solvers: vec![Arc::new(Builtin::Joint)],
            records_alone: true,
            measures: Vec::new(),
            thresholds: thresholds.iter().flat_map(|label| Threshold::parse(label)).collect(),
            headline: if of_images { 2 } else { 0 },
            seed: 0,
            repeats: 1,
        }
    }

    /// Limits the oracle to the inlier ratios 0.5 and 0.1, and adds the solver `consensus` for a map of `n_points`
    /// with fewer than 150 points per list entry, where `joint` can be weaker.
    #[must_use]
    pub fn for_map(mut self, n_points: usize, k: usize) -> Self {
        self.inlier_ratios = vec![0.5, 0.1];
        let lacks_consensus =
            self.solvers.iter().all(|solver| solver.builtin() != Some(Builtin::Consensus));
        if n_points < SMALL * k && lacks_consensus {
            self.solvers.push(Arc::new(Builtin::Consensus));
        }
        self
    }

    /// Returns true if the oracle is among the sources.
    pub fn asks_oracle(&self) -> bool {
        self.neighbors.iter().any(NeighborsBy::is_oracle)
    }

    /// Returns the attacker's own sources.
    pub fn own_sources(&self) -> impl Iterator<Item = &dyn Source<D>> {
        self.neighbors.iter().filter_map(NeighborsBy::source)
    }

    /// Returns the variants of each scheme and solver, source by source and model by model.
    pub fn variants(&self) -> Vec<Variant<'_, D>> {
        let mut variants = Vec::new();
        for by in &self.neighbors {
            if !by.is_oracle() {
                variants.push(Variant { by, noise: None, inlier_ratio: None });
                continue;
            }
            for noise in self.oracle_noise.iter().copied().map(Some) {
                let ratios = self.inlier_ratios.iter().copied().map(Some);
                variants.extend(ratios.map(|inlier_ratio| Variant { by, noise, inlier_ratio }));
            }
        }
        variants
    }

    /// Returns the number of rows per scheme.
    pub fn rows_per_scheme(&self) -> usize {
        self.variants().len() * self.solvers.len()
    }

    /// Checks the plan for a single map.
    ///
    /// # Errors
    /// The first field out of range.
    pub fn check(&self, n_points: usize, has_descriptors: bool) -> Result<(), Error> {
        if n_points < self.k + 1 {
            let expected = format!("at least K + 1 = {}", self.k + 1);
            let error = Error::new("points", expected, n_points);
            return Err(error.of_kind(ErrorKind::TooFewPoints));
        }
        self.check_fields()?;
        if has_descriptors { Ok(()) } else { self.without_descriptors() }
    }

    /// Checks the plan for many items, before the first one is read.
    ///
    /// # Errors
    /// The first field out of range, or that needs a single map.
    pub fn check_for_many(&self) -> Result<(), Error> {
        self.check_fields()?;
        let lone = self.solvers.iter().find(|solver| !solver.reads_lists());
        if let (2, Some(solver)) = (D, lone) {
            // In the plane all lines meet, so records alone contain no information.
            return Err(Error::new("solver", "one that recovers from lists", solver.name()));
        }
        if self.k == 0 {
            return Err(Error::new("k", "at least 1", "0"));
        }
        let given = self.neighbors.iter().find(|by| matches!(by, NeighborsBy::Given(_)));
        if let Some(given) = given {
            let expected = "the oracle, or a source that works on single items";
            return Err(Error::new("neighbors", expected, given.name()));
        }
        Ok(())
    }

    /// Returns an error if a source needs descriptors, for use where there are none.
    pub(super) fn without_descriptors(&self) -> Result<(), Error> {
        let needy = self.own_sources().find(|source| source.needs() != Needs::Nothing);
        needy.map_or(Ok(()), |source| Err(lacks_descriptors(source.name())))
    }

    fn check_fields(&self) -> Result<(), Error> {
        check_names("scheme", self.schemes.iter().map(|scheme| scheme.name()))?;
        check_names("solver", self.solvers.iter().map(|solver| solver.name()))?;
        let mut own = self.solvers.iter().filter(|solver| solver.builtin().is_none());
        if let Some(solver) = own.find(|solver| Builtin::from_name(solver.name()).is_ok()) {
            // Reports describe built-in solvers by their names.
            let expected = "a name that no solver of unlift has";
            return Err(Error::new("solver", expected, solver.name()));
        }
        if self.headline >= self.thresholds.len().max(1) {
            let expected = format!("below {}", self.thresholds.len());
            return Err(Error::new("headline threshold", expected, self.headline));
        }
        if let Some(ratio) = self.inlier_ratios.iter().find(|r| !(0.0..=1.0).contains(*r)) {
            return Err(Error::new("inlier ratio", "0 to 1", ratio));
        }
        if self.repeats == 0 {
            return Err(Error::new("repeats", "at least 1", "0"));
        }
        for (what, empty) in [
            ("schemes", self.schemes.is_empty()),
            ("sources", self.neighbors.is_empty()),
            ("oracle noise models", self.oracle_noise.is_empty()),
            ("inlier ratios", self.inlier_ratios.is_empty()),
            ("solvers", self.solvers.is_empty()),
            ("thresholds", self.thresholds.is_empty()),
        ] {
            if empty {
                return Err(Error::new(what, "at least one", "none"));
            }
        }
        Ok(())
    }
}

/// Checks that names are unique plain words, because they become parts of gates and file names.
fn check_names<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> Result<(), Error> {
    let mut seen = BTreeSet::new();
    for name in names {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-+_.".contains(c);
        if name.is_empty() || !name.chars().all(is_plain) {
            let expected = "a name of letters, digits, - + _ and .";
            return Err(Error::new(what, expected, format!("{name:?}")));
        }
        if !seen.insert(name) {
            return Err(Error::new(format!("{what}s"), "each name once", name));
        }
    }
    Ok(())
}

/// Returns the key of the image `name` in a set with the key `key`.
pub fn key_of(key: &Key, name: &str) -> Key {
    key.of_item(Stage::Image, hash(name))
}

/// Returns the oracle's seed for the image `name` in a run with `seed`.
pub fn oracle_seed(seed: u64, name: &str) -> u64 {
    Draws::new(seed, Stage::Image, hash(name)).bits()
}

/// Hashes `name` with 64-bit FNV-1a.
fn hash(name: &str) -> u64 {
    let step = |h: u64, byte: u8| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
    name.bytes().fold(0xCBF2_9CE4_8422_2325, step)
}
