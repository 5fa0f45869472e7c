//! What is to be audited.

use crate::neighbors::oracle::Noise;
use crate::neighbors::sources::Joined;
use crate::obfuscate::{Entry, SchemeOptions};
use crate::recover::{Delta, Solver};
use crate::{Error, Unit};

/// An error below which a point counts as recovered.
#[derive(Clone, Debug, PartialEq)]
pub struct Threshold {
    /// As the user typed it: the key in reports.
    pub label: String,
    /// In the unit of the points.
    pub value: f64,
}

impl Threshold {
    /// Reads a positive number and keeps its text.
    ///
    /// # Errors
    /// When `text` is not a positive number.
    pub fn parse(text: &str) -> Result<Self, Error> {
        match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() && value > 0.0 => {
                Ok(Self { label: text.trim().to_owned(), value })
            }
            _ => Err(Error::new("threshold", "a positive number", format!("{text:?}"))),
        }
    }
}

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
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// From the originals, at each inlier ratio of the plan.
    Oracle,
    /// Given; the inlier ratio is measured.
    Given(PointNeighbors),
    /// From the released map alone, as an attacker would; the inlier ratio is measured.
    Own(Joined),
}

impl Source {
    /// The name in reports.
    pub fn name(&self) -> String {
        match self {
            Self::Oracle => "oracle".to_owned(),
            Self::Given(given) => given.name.clone(),
            Self::Own(joined) => joined.name(),
        }
    }
}

/// What tells the rows of one scheme and solver apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant<'a> {
    /// Where neighborhoods come from.
    pub source: &'a Source,
    /// How the oracle errs; `None` for other sources.
    pub noise: Option<Noise>,
    /// The inlier ratio; `None` where it will be measured.
    pub inlier_ratio: Option<f64>,
}

/// A plan: every combination of scheme, source, noise model, inlier ratio and solver becomes a row.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Schemes to audit.
    pub schemes: Vec<&'static Entry>,
    /// Parameters of schemes.
    pub scheme_options: SchemeOptions,
    /// Where neighborhoods come from; each has its own rows.
    pub sources: Vec<Source>,
    /// How the oracle errs; a row each.
    pub oracle_noise: Vec<Noise>,
    /// Shares of true neighbors (oracle).
    pub inlier_ratios: Vec<f64>,
    /// True neighbors per slot: of the oracle, and where the inlier ratio of an attacker's own lists
    /// is measured. For given lists, the longest list decides.
    pub k: usize,
    /// Recovery methods: a row each. [`Solver::JointStart`] after [`Solver::Joint`] takes no run of its own.
    pub solvers: Vec<Solver>,
    /// Whether maps are also attacked by their records alone, the second baseline.
    pub records_alone: bool,
    /// Whether each scheme also gets a row for an attacker who is told the true neighbors' places.
    pub reference: bool,
    /// The distance that decides support.
    pub delta: Delta,
    /// Whether rules that tie records together fix coordinates.
    pub exact_constraints: bool,
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

impl Plan {
    /// The plan of a default audit of points in `unit`: six inlier ratios; of maps all 3D schemes at
    /// K = 50, of images (pixels) all 2D schemes at K = 20.
    pub fn new(unit: Unit) -> Self {
        let (voxel, thresholds): (f64, &[&str]) = match unit {
            Unit::Meter => (0.5, &["0.10", "0.25"]),
            Unit::KthNeighbor => (5.0, &["1.0", "2.5"]),
            // No 2D scheme has voxels.
            Unit::Pixel => (1.0, &["1", "5", "10", "25"]),
        };
        let of_images = unit == Unit::Pixel;
        let is_meant = |s: &&Entry| if of_images { s.in_2d.is_some() } else { s.in_3d.is_some() };
        let threshold = |label: &str| Threshold {
            label: label.to_owned(),
            value: label.parse().unwrap_or(1.0),
        };
        Self {
            schemes: crate::obfuscate::SCHEMES.iter().filter(is_meant).collect(),
            scheme_options: SchemeOptions { voxel },
            sources: vec![Source::Oracle],
            oracle_noise: vec![Noise::Uniform],
            inlier_ratios: vec![1.0, 0.75, 0.5, 0.3, 0.2, 0.1],
            k: if of_images { 20 } else { 50 },
            // What joint recovery starts from costs nothing more, and is at times the stronger attack.
            solvers: vec![Solver::Joint, Solver::JointStart],
            records_alone: true,
            reference: false,
            delta: Delta::Auto,
            exact_constraints: true,
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
        if n_points < SMALL * k && !self.solvers.contains(&Solver::Consensus) {
            self.solvers.push(Solver::Consensus);
        }
        self
    }

    /// The rows of one scheme and solver, source by source; those of the oracle noise model by
    /// noise model.
    pub fn variants(&self) -> Vec<Variant<'_>> {
        let mut variants = Vec::new();
        for source in &self.sources {
            match source {
                Source::Oracle => {
                    for &noise in &self.oracle_noise {
                        let ratios = self.inlier_ratios.iter().map(|&ratio| Some(ratio));
                        let noise = Some(noise);
                        variants.extend(ratios.map(|inlier_ratio| Variant {
                            source,
                            noise,
                            inlier_ratio,
                        }));
                    }
                }
                Source::Given(_) | Source::Own(_) => {
                    variants.push(Variant { source, noise: None, inlier_ratio: None });
                }
            }
        }
        variants
    }

    /// Checks every field against the map it is meant for.
    ///
    /// # Errors
    /// Names the first field out of range.
    pub fn check(&self, n_points: usize, has_descriptors: bool) -> Result<(), Error> {
        self.scheme_options.check()?;
        if n_points < self.k + 1 {
            let expected = format!("at least K + 1 = {}", self.k + 1);
            return Err(Error::new("points", expected, n_points.to_string()));
        }
        self.check_fields::<3>(has_descriptors)
    }

    /// Checks every field, before any image is looked at.
    ///
    /// # Errors
    /// Names the first field out of range, or that is for maps alone.
    pub fn check_for_images(&self) -> Result<(), Error> {
        self.check_fields::<2>(true)?;
        let lone = |solver: &&Solver| !Solver::FROM_LISTS.contains(solver);
        if let Some(solver) = self.solvers.iter().find(lone) {
            // In the plane all lines meet: records alone tell nothing.
            return Err(Error::new("solver", "one that recovers from lists", solver.name()));
        }
        if self.k == 0 {
            return Err(Error::new("k", "at least 1", "0"));
        }
        for source in &self.sources {
            match source {
                Source::Oracle => {}
                Source::Given(given) => {
                    let expected = "the oracle or one that works on images alone";
                    return Err(Error::new("neighbors", expected, given.name.as_str()));
                }
                Source::Own(joined) => {
                    if let Some(part) = joined.not_in_dimension::<2>() {
                        return Err(Error::new("neighbors", "a source for images", part.name));
                    }
                }
            }
        }
        Ok(())
    }

    /// The first source that needs descriptors.
    pub(super) fn needs_descriptors(&self) -> Option<&Source> {
        let needs = |source: &&Source| match source {
            Source::Own(joined) => joined.needs_descriptors(),
            Source::Oracle | Source::Given(_) => false,
        };
        self.sources.iter().find(needs)
    }

    fn check_fields<const D: usize>(&self, has_descriptors: bool) -> Result<(), Error> {
        let other = |scheme: &&&Entry| scheme.of_dimension::<D>().is_none();
        if let Some(scheme) = self.schemes.iter().find(other) {
            return Err(Error::new("scheme", format!("one for {D}D points"), scheme.name));
        }
        if self.headline >= self.thresholds.len().max(1) {
            let expected = format!("below {}", self.thresholds.len());
            return Err(Error::new("headline threshold", expected, self.headline.to_string()));
        }
        if let Some(ratio) = self.inlier_ratios.iter().find(|r| !(0.0..=1.0).contains(*r)) {
            return Err(Error::new("inlier ratio", "0 to 1", ratio.to_string()));
        }
        if !has_descriptors && let Some(source) = self.needs_descriptors() {
            let expected = format!("some, as neighbors by {} need them", source.name());
            return Err(Error::new("descriptors", expected, "none"));
        }
        if self.repeats == 0 {
            return Err(Error::new("repeats", "at least 1", "0"));
        }
        for (what, empty) in [
            ("schemes", self.schemes.is_empty()),
            ("sources", self.sources.is_empty()),
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
