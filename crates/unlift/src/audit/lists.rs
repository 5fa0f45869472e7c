//! Neighborhoods of one obfuscation, from every source of a plan.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::plan::{NeighborsBy, Variant};
use crate::geometry::knn::Knn;
use crate::neighbors::oracle::{self, Noise, Outliers, TrueNeighbors};
use crate::neighbors::{KeptLists, KeptPairs, Needs, Neighborhoods, Source, of_what_there_is};
use crate::released::Released;
use crate::truth::Secret;
use crate::{About, Error, RowOrder};

/// Lists and their quality.
#[derive(Debug)]
pub struct Made {
    /// The lists.
    pub lists: Neighborhoods,
    /// Inlier ratio, as requested or measured.
    pub ratio: f64,
    /// Records per list.
    pub k: usize,
    /// Inlier ratio of lists other than the oracle's, with as many true neighbors as they have records.
    /// `ratio` uses the K of the plan instead.
    pub ratio_at_k: Option<f64>,
}

/// Lists and pair scores of sources that read descriptors alone, kept by the name of the source for further schemes and repeats.
#[derive(Debug, Default)]
pub struct Kept(RefCell<BTreeMap<String, OfSource>>);

/// What one source made.
#[derive(Debug, Default)]
struct OfSource {
    /// By the length that was requested.
    lists: BTreeMap<usize, KeptLists>,
    pairs: KeptPairs,
}

impl Kept {
    /// Returns the lists of `source` for `released`: kept ones if they apply, else new ones, from kept pair scores if they apply.
    fn lists<const D: usize>(
        &self,
        source: &dyn Source<D>,
        released: &Released<D>,
        seed: u64,
    ) -> Result<Neighborhoods, Error> {
        let k = source.k(released);
        if source.needs() != Needs::DescriptorsAlone {
            return source.lists(released, k, seed);
        }
        let mut kept = self.0.borrow_mut();
        let kept = kept.entry(source.name().to_owned()).or_default();
        if let Some(lists) = kept.lists.get(&k).and_then(|kept| kept.of(released)) {
            return Ok(lists);
        }
        let lists = source.lists_keeping(released, k, seed, &mut kept.pairs)?;
        if !kept.lists.contains_key(&k) {
            kept.lists.extend(KeptLists::new(released, &lists).map(|lists| (k, lists)));
        }
        Ok(lists)
    }
}

/// Makes lists for one obfuscation. Searches true neighborhoods on first use and keeps them.
pub struct Lists<'a, const D: usize> {
    /// True neighbors per slot, [`Plan::k`](super::Plan::k).
    plan_k: usize,
    search: &'a Knn<'a, D>,
    released: &'a Released<D>,
    secret: &'a Secret,
    /// The secret by descriptor row.
    by_row: Secret,
    /// Seeds of the oracle and of the attacker.
    seeds: (u64, u64),
    kept: &'a Kept,
    /// True neighbors, by their number and by whether they are counted by descriptor row.
    near: BTreeMap<(usize, bool), TrueNeighbors>,
    /// K, noise model and outliers of the last variant: variants with the same model are consecutive.
    outliers: Option<(usize, Noise, Outliers)>,
}

impl<'a, const D: usize> Lists<'a, D> {
    /// Prepares lists for `hidden`. `seeds` are those of the oracle and of the attacker.
    pub fn new(
        plan_k: usize,
        search: &'a Knn<'a, D>,
        hidden: &'a (Released<D>, Secret),
        seeds: (u64, u64),
        kept: &'a Kept,
    ) -> Self {
        let (released, secret) = (&hidden.0, &hidden.1);
        let (by_row, near, outliers) = (secret.by_descriptor_row(), BTreeMap::new(), None);
        Self { plan_k, search, released, secret, by_row, seeds, kept, near, outliers }
    }

    /// Makes the lists of one variant of the plan. If `may_be_short`, they are shorter than requested
    /// where there are too few records, and empty only for a single record.
    ///
    /// # Errors
    /// When the source cannot make lists for this obfuscation.
    pub fn make(&mut self, variant: &Variant<'_, D>, may_be_short: bool) -> Result<Made, Error> {
        let plan_k = self.plan_k;
        let others = self.released.n_records().saturating_sub(1);
        match variant.by {
            NeighborsBy::Oracle => {
                let ratio = variant.inlier_ratio.unwrap_or(1.0);
                // Wrong entries need records, too, so a list may be shorter than `others`.
                let lists = match may_be_short {
                    false => Some(self.oracle(variant, plan_k)?),
                    true => {
                        let mut lengths = (1..=plan_k.min(others)).rev();
                        lengths.find_map(|k| self.oracle(variant, k).ok())
                    }
                };
                let Some(lists) = lists else { return Ok(self.none(variant)) };
                Ok(Made { lists, ratio, k: plan_k, ratio_at_k: None })
            }
            NeighborsBy::Given(points) => {
                let scores = points.scores.as_deref();
                let (offsets, neighbors) = (&points.offsets, &points.neighbors);
                let lists = oracle::from_points(offsets, neighbors, scores, self.secret)?;
                let k = lists.longest().min(others).max(1);
                let ratio = self.near(plan_k.min(others), false)?.measured_inlier_ratio(&lists);
                let ratio_at_k = self.near(k, false)?.measured_inlier_ratio(&lists);
                Ok(Made { lists, ratio, k, ratio_at_k: Some(ratio_at_k) })
            }
            NeighborsBy::Source(_) if may_be_short && others == 0 => Ok(self.none(variant)),
            NeighborsBy::Source(source) => {
                let k = source.k(self.released);
                let is_short = may_be_short && others < k.max(plan_k);
                let lists = match is_short {
                    true => of_what_there_is(&**source, self.released, self.seeds.1)?,
                    false => {
                        source.supports(self.released)?;
                        self.kept.lists(&**source, self.released, self.seeds.1)?
                    }
                };
                // Lists of such sources are in the order of descriptor rows, not of slots.
                let [near_plan, near] =
                    [plan_k, k].map(|k| if is_short { k.min(others) } else { k });
                let ratio = self.near(near_plan, true)?.measured_inlier_ratio(&lists);
                let ratio_at_k = self.near(near, true)?.measured_inlier_ratio(&lists);
                Ok(Made { lists, ratio, k, ratio_at_k: Some(ratio_at_k) })
            }
        }
    }

    fn none(&self, variant: &Variant<'_, D>) -> Made {
        let map = Some(self.released.fingerprint());
        let about = About { map, order: RowOrder::Slots, ..About::default() };
        let lists = Neighborhoods::empty(self.released.n_slots()).with_about(about);
        let (k, ratio_at_k) = match variant.by {
            // The metric is a mean over all points, so an empty list counts as 0.
            NeighborsBy::Source(source) => (source.k(self.released), Some(0.0)),
            NeighborsBy::Oracle | NeighborsBy::Given(_) => (self.plan_k, None),
        };
        Made { lists, ratio: variant.inlier_ratio.unwrap_or(0.0), k, ratio_at_k }
    }

    fn oracle(&mut self, variant: &Variant<'_, D>, k: usize) -> Result<Neighborhoods, Error> {
        let (noise, ratio) =
            (variant.noise.unwrap_or(Noise::Uniform), variant.inlier_ratio.unwrap_or(1.0));
        let seed = self.seeds.0;
        let (search, secret, kept) = (self.search, self.secret, self.outliers.take());
        let near = self.near(k, false)?;
        let outliers = match kept {
            Some((of_k, of, outliers)) if (of_k, of) == (k, noise) => outliers,
            _ => Outliers::new(noise, near, search, secret, seed)?,
        };
        let lists = near.lists(ratio, &outliers, seed);
        self.outliers = Some((k, noise, outliers));
        lists
    }

    /// Returns the `k` true neighbors of every slot, in the order of slots or of descriptor rows.
    fn near(&mut self, k: usize, by_row: bool) -> Result<&TrueNeighbors, Error> {
        // With one slot per record the two orders are equal.
        let by_row = by_row && self.secret.slots_per_record() > 1;
        if let Entry::Vacant(near) = self.near.entry((k, by_row)) {
            let secret = if by_row { &self.by_row } else { self.secret };
            near.insert(TrueNeighbors::new(self.search, secret, k)?);
        }
        Ok(&self.near[&(k, by_row)])
    }
}
