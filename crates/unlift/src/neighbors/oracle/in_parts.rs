//! Lists that do not fit into memory: some slots at a time.

use std::ops::Range;

use super::nearness::Nearness;
use super::{Noise, Outliers, TrueNeighbors, about, check_k};
use crate::geometry::knn::Knn;
use crate::truth::Secret;
use crate::{About, Error, RecordId};

/// What [`TrueNeighbors::lists`] makes of a whole map, made for any slots: the same lists, whichever are asked for together.
pub struct InParts<'a, const D: usize> {
    nearness: Nearness<'a, D>,
    /// Where each original stands in spatial order: slots of one place are looked at in turn.
    rank: Vec<u32>,
    /// Of no slot: what is the same for all.
    none: TrueNeighbors,
    outliers: Outliers,
    keep: usize,
    seed: u64,
}

impl<'a, const D: usize> InParts<'a, D> {
    /// Lists of `k` records at `inlier_ratio`, of which the others are as `noise` says.
    ///
    /// # Errors
    /// As of [`TrueNeighbors::new`] and [`TrueNeighbors::lists`].
    pub fn new(
        knn: &'a Knn<'a, D>,
        (secret, slots_per_record): (&'a Secret, usize),
        (k, inlier_ratio): (usize, f64),
        noise: Noise,
        seed: u64,
    ) -> Result<Self, Error> {
        let n_records = secret.n_slots() / slots_per_record;
        check_k(k, n_records)?;
        let (map, records) = (secret.map(), Vec::new());
        let none = TrueNeighbors { k, n_records, slots_per_record, map, first: 0, records };
        let nearness = Nearness::new(knn, secret, slots_per_record);
        let outliers = match noise {
            Noise::Uniform => Outliers::uniform(),
            Noise::Near => Outliers::near(&none, 0, seed, |_, _, _| ()),
            Noise::Clustered => Outliers::clustered(&none, knn, secret, &nearness, seed),
        };
        let keep = none.kept(inlier_ratio, &outliers)?;
        let mut rank = vec![0; secret.n_originals()];
        for (at, &original) in knn.spatial_order().iter().enumerate() {
            rank[original as usize] = at as u32;
        }
        Ok(Self { nearness, rank, none, outliers, keep, seed })
    }

    /// Which released map the lists are of, and what their rows are counted by.
    pub fn about(&self) -> About {
        about(self.none.map)
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.none.n_records * self.none.slots_per_record
    }

    /// The lists of `slots` end to end, each of K records in ascending order.
    ///
    /// # Panics
    /// When there are not so many slots.
    pub fn lists(&self, slots: Range<usize>) -> Vec<RecordId> {
        let n = slots.len();
        let mut truth = TrueNeighbors {
            first: slots.start,
            records: vec![RecordId(0); n * self.none.k],
            ..self.none.clone()
        };
        let of = || (slots.clone(), &self.rank[..]);
        self.nearness.each_of(truth.k, of(), &mut truth.records, &|_, near, row| {
            row.copy_from_slice(near);
        });
        let near = (self.outliers.noise() == Noise::Near).then(|| {
            Outliers::near(&truth, n, self.seed, |n, rows, make| {
                self.nearness.each_of(n, of(), rows, make);
            })
        });
        truth.rows(self.keep, near.as_ref().unwrap_or(&self.outliers), self.seed)
    }
}

impl<const D: usize> std::fmt::Debug for InParts<'_, D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("InParts").field("k", &self.none.k).finish_non_exhaustive()
    }
}
