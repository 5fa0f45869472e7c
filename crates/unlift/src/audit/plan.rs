//! What is to be audited.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::observer::Measure;
use super::threshold::Threshold;
use crate::neighbors::oracle::Noise;
use crate::neighbors::{Needs, Source, lacks_descriptors};
use crate::obfuscate::{SCHEMES, Scheme, SchemeOptions};
use crate::recover::{Builtin, Delta, Solver};
use crate::{Error, ErrorKind, Unit};

/// Neighbors of every original, by row, as an owner lists them from any source.
#[derive(Clone, Debug, PartialEq)]
pub struct PointNeighbors {
    /// The name of the source in reports.
    pub name: String,
    /// Where each point's list starts; one more entry than there are points.
    pub offsets: Vec<u64>,
    /// Rows of originals.
    pub neighbors: Vec<u32>,
    /// Confidence per entry, if the source gave any.
    pub scores: Option<Vec<f32>>,
}

/// Where the attacker's neighborhoods come from.
#[derive(Clone, Debug)]
pub enum NeighborsBy<const D: usize> {
    /// From the originals, at each inlier ratio of the plan.
    Oracle,
    /// Given; the inlier ratio is measured.
    Given(PointNeighbors),
    /// From the released map alone, as an attacker would; the inlier ratio is measured.
    Source(Arc<dyn Source<D>>),
}

impl<const D: usize> NeighborsBy<D> {
    /// The name in reports.
    pub fn name(&self) -> &str {
        match self {
            Self::Oracle => "oracle",
            Self::Given(given) => &given.name,
            Self::Source(source) => source.name(),
        }
    }

    /// Whether it is the oracle.
    pub fn is_oracle(&self) -> bool {
        matches!(self, Self::Oracle)
    }

    /// The attacker's own source, if it is one.
    pub fn source(&self) -> Option<&dyn Source<D>> {
        match self {
            Self::Source(source) => Some(&**source),
            Self::Oracle | Self::Given(_) => None,
        }
    }
}

/// What tells the rows of one scheme and solver apart.
#[derive(Clone, Copy, Debug)]
pub struct Variant<'a, const D: usize> {
    /// Where neighborhoods come from.
    pub by: &'a NeighborsBy<D>,
    /// How the oracle errs; `None` for other sources.
    pub noise: Option<Noise>,
    /// The inlier ratio; `None` where it will be measured.
    pub inlier_ratio: Option<f64>,
}

/// A plan: every combination of scheme, source, noise model, inlier ratio and solver becomes a row.
#[derive(Clone, Debug)]
pub struct Plan<const D: usize> {
    /// Schemes to audit, ours or anybody's.
    pub schemes: Vec<Arc<dyn Scheme<D>>>,
    /// Where neighborhoods come from; each has its own rows.
    pub neighbors: Vec<NeighborsBy<D>>,
    /// How the oracle errs; a row each.
    pub oracle_noise: Vec<Noise>,
    /// Shares of true neighbors (oracle).
    pub inlier_ratios: Vec<f64>,
    /// True neighbors per slot: of the oracle, and where the inlier ratio of an attacker's own lists
    /// is measured. For given lists, the longest list decides.
    pub k: usize,
    /// Solvers, ours or anybody's: a row each. [`Builtin::JointStart`] after [`Builtin::Joint`] takes no run of its own.
    pub solvers: Vec<Arc<dyn Solver<D>>>,
    /// Whether maps are also attacked by their records alone, the second baseline.
    pub records_alone: bool,
    /// Whether each scheme also gets a row for an attacker who is told the true neighbors' places.
    pub reference: bool,
    /// The distance that decides support.
    pub delta: Delta,
    /// Whether rules that tie records together fix coordinates.
    pub exact_constraints: bool,
    /// What is measured beside errors: figures by name.
    pub measures: Vec<Arc<dyn Measure<D>>>,
    /// When a point counts as recovered.
    pub thresholds: Vec<Threshold>,
    /// Which of the thresholds break-even ratios are about.
    pub headline: usize,
    /// The seed of the first repeat; the others count up.
    pub seed: u64,
    /// How many seeds are averaged.
    pub repeats: u32,
}

/// A map is small if it has fewer points than this many lists have entries.
const SMALL: usize = 150;

impl<const D: usize> Plan<D> {
    /// The plan of a default audit of points in `unit`: all schemes of the registry that are defined on them, six
    /// inlier ratios; of maps at K = 50, of images (pixels) at K = 20.
    pub fn new(unit: Unit) -> Self {
        let thresholds: &[&str] = match unit {
            Unit::Meter => &["0.10", "0.25"],
            Unit::KthNeighbor => &["1.0", "2.5"],
            Unit::Pixel => &["1", "5", "10", "25"],
        };
        let of_images = unit == Unit::Pixel;
        let options = SchemeOptions::usual(unit);
        let threshold = |label: &str| Threshold {
            label: label.to_owned(),
            value: label.parse().unwrap_or(1.0),
        };
        Self {
            schemes: SCHEMES.iter().filter_map(|entry| entry.of_dimension(&options)).collect(),
            neighbors: vec![NeighborsBy::Oracle],
            oracle_noise: vec![Noise::Uniform],
            inlier_ratios: vec![1.0, 0.75, 0.5, 0.3, 0.2, 0.1],
            k: if of_images { 20 } else { 50 },
            // What joint recovery starts from costs nothing more, and is at times the stronger attack.
            solvers: vec![Arc::new(Builtin::Joint), Arc::new(Builtin::JointStart)],
            records_alone: true,
            reference: false,
            delta: Delta::Auto,
            exact_constraints: true,
            measures: Vec::new(),
            thresholds: thresholds.iter().copied().map(threshold).collect(),
            headline: if of_images { 2 } else { 0 },
            seed: 0,
            repeats: 1,
        }
    }

    /// The same for a map of `n_points` with lists of `k`: where a list holds more than a 150th of the points, `joint`
    /// can come out weaker than plain `consensus`, which then has a row of its own.
    #[must_use]
    pub fn for_map(mut self, n_points: usize, k: usize) -> Self {
        if n_points < SMALL * k && !self.has_solver(Builtin::Consensus) {
            self.solvers.push(Arc::new(Builtin::Consensus));
        }
        self
    }

    /// Whether the plan has this solver of ours.
    pub fn has_solver(&self, builtin: Builtin) -> bool {
        self.solvers.iter().any(|solver| Builtin::of(&**solver) == Some(builtin))
    }

    /// Whether the oracle is among the sources.
    pub fn asks_oracle(&self) -> bool {
        self.neighbors.iter().any(NeighborsBy::is_oracle)
    }

    /// The attacker's own sources.
    pub fn own_sources(&self) -> impl Iterator<Item = &dyn Source<D>> {
        self.neighbors.iter().filter_map(NeighborsBy::source)
    }

    /// The rows of one scheme and solver, source by source; those of the oracle noise model by
    /// noise model.
    pub fn variants(&self) -> Vec<Variant<'_, D>> {
        let mut variants = Vec::new();
        for by in &self.neighbors {
            match by {
                NeighborsBy::Oracle => {
                    for &noise in &self.oracle_noise {
                        let ratios = self.inlier_ratios.iter().map(|&ratio| Some(ratio));
                        let noise = Some(noise);
                        variants.extend(ratios.map(|inlier_ratio| Variant {
                            by,
                            noise,
                            inlier_ratio,
                        }));
                    }
                }
                NeighborsBy::Given(_) | NeighborsBy::Source(_) => {
                    variants.push(Variant { by, noise: None, inlier_ratio: None });
                }
            }
        }
        variants
    }

    /// Rows per scheme.
    pub fn rows_per_scheme(&self) -> usize {
        self.variants().len() * self.solvers.len() + usize::from(self.reference)
    }

    /// Checks every field against the one map that it is meant for.
    ///
    /// # Errors
    /// Names the first field out of range.
    pub fn check(&self, n_points: usize, has_descriptors: bool) -> Result<(), Error> {
        if n_points < self.k + 1 {
            let expected = format!("at least K + 1 = {}", self.k + 1);
            let error = Error::new("points", expected, n_points.to_string());
            return Err(error.of_kind(ErrorKind::TooFewPoints));
        }
        self.check_fields()?;
        if has_descriptors { Ok(()) } else { self.without_descriptors() }
    }

    /// Checks every field for a set of many, before any of them is looked at.
    ///
    /// # Errors
    /// Names the first field out of range, or that is for one map alone.
    pub fn check_for_many(&self) -> Result<(), Error> {
        self.check_fields()?;
        let lone = self.solvers.iter().find(|solver| !solver.reads_lists());
        if let (2, Some(solver)) = (D, lone) {
            // In the plane all lines meet: records alone tell nothing.
            return Err(Error::new("solver", "one that recovers from lists", solver.name()));
        }
        if self.k == 0 {
            return Err(Error::new("k", "at least 1", "0"));
        }
        let given = self.neighbors.iter().find(|by| matches!(by, NeighborsBy::Given(_)));
        if let Some(given) = given {
            let expected = "the oracle or one that works on each alone";
            return Err(Error::new("neighbors", expected, given.name()));
        }
        Ok(())
    }

    /// Refuses a source that needs descriptors, where there are none.
    pub(super) fn without_descriptors(&self) -> Result<(), Error> {
        let needy = self.own_sources().find(|source| source.needs() == Needs::Descriptors);
        needy.map_or(Ok(()), |source| Err(lacks_descriptors(source.name())))
    }

    fn check_fields(&self) -> Result<(), Error> {
        check_names("scheme", self.schemes.iter().map(|scheme| scheme.name()))?;
        check_names("solver", self.solvers.iter().map(|solver| solver.name()))?;
        let own = self.solvers.iter().filter(|solver| Builtin::of(&***solver).is_none());
        if let Some(solver) = own.into_iter().find(|one| Builtin::from_name(one.name()).is_ok()) {
            // A report would say of it what is true of ours.
            let expected = "a name that no solver of unlift has";
            return Err(Error::new("solver", expected, solver.name()));
        }
        if self.headline >= self.thresholds.len().max(1) {
            let expected = format!("below {}", self.thresholds.len());
            return Err(Error::new("headline threshold", expected, self.headline.to_string()));
        }
        if let Some(ratio) = self.inlier_ratios.iter().find(|r| !(0.0..=1.0).contains(*r)) {
            return Err(Error::new("inlier ratio", "0 to 1", ratio.to_string()));
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

/// Refuses names that are not plain words, as they become parts of gates and of file names, and names that occur twice.
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
