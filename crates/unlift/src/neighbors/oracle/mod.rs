//! The oracle: neighborhoods from ground truth at a chosen inlier ratio (paper, section 6).
//!
//! It simulates an attacker of known quality. No other source reads ground truth.

mod from_points;
mod nearness;
mod outliers;

use rayon::prelude::*;

pub use from_points::from_points;
pub use outliers::{Noise, Outliers};

use nearness::Nearness;

use super::Neighborhoods;
use crate::geometry::knn::Knn;
use crate::seed::{Draws, Stage};
use crate::truth::{Original, Secret};
use crate::{About, Error, Fingerprint, ListsBy, RecordId, RowOrder};

/// The true neighborhoods of every slot: the K records nearest to its original, by (distance,
/// original id). They exclude the slot's own record and dropped points, and contain each record
/// once (a paired line may hide two near points).
#[derive(Clone, Debug)]
pub struct TrueNeighbors {
    k: usize,
    n_records: usize,
    slots_per_record: usize,
    map: Option<Fingerprint>,
    /// K records per slot, nearest first. This order is never released.
    records: Vec<RecordId>,
}

impl TrueNeighbors {
    /// Finds true neighborhoods of size `k` for the obfuscation of `secret`. `knn` must be a search
    /// over the original positions.
    ///
    /// # Errors
    /// When `k` is 0 or fewer than `k` other records exist.
    pub fn new<const D: usize>(
        knn: &Knn<'_, D>,
        secret: &Secret,
        slots_per_record: usize,
        k: usize,
    ) -> Result<Self, Error> {
        let n_slots = secret.n_slots();
        let n_records = n_slots / slots_per_record;
        check_k(k, n_records)?;
        let mut records = vec![RecordId(0); n_slots * k];
        Nearness::new(knn, secret, slots_per_record).each(k, &mut records, &|_, near, row| {
            row.copy_from_slice(near);
        });
        Ok(Self { k, n_records, slots_per_record, map: secret.map(), records })
    }

    /// Makes lists with `round(inlier_ratio * K)` true neighbors, but at least one above ratio 0.
    /// They are a uniformly random choice; the other entries come from `outliers`. Lists are
    /// nested: a lower ratio keeps a subset of the true neighbors and a superset of the outliers.
    ///
    /// # Errors
    /// When the ratio is not in `[0, 1]`, or there are too few outliers.
    pub fn lists(
        &self,
        inlier_ratio: f64,
        outliers: &Outliers,
        seed: u64,
    ) -> Result<Neighborhoods, Error> {
        let records = self.rows(self.kept(inlier_ratio, outliers)?, outliers, seed);
        let n_slots = self.n_records * self.slots_per_record;
        let offsets = (0..=n_slots as u64).map(|slot| slot * self.k as u64).collect();
        let (n_records, slots) = (self.n_records, self.slots_per_record);
        let lists = Neighborhoods::try_new(offsets, records, None, n_records, slots)?;
        Ok(lists.with_about(about(self.map)))
    }

    /// Returns the number of true neighbors per list at an inlier ratio.
    fn kept(&self, inlier_ratio: f64, outliers: &Outliers) -> Result<usize, Error> {
        if !(0.0..=1.0).contains(&inlier_ratio) {
            return Err(Error::new("inlier ratio", "0 to 1", inlier_ratio.to_string()));
        }
        // Lists without any true neighbor must not pass for lists with a few.
        let keep = (inlier_ratio * self.k as f64).round() as usize;
        let keep = keep.max(usize::from(inlier_ratio > 0.0));
        let wanted = self.k - keep;
        let most = outliers.most(self);
        if wanted > most {
            let what = format!("inlier ratio {inlier_ratio} at K = {}", self.k);
            let expected = format!("at least {wanted} records that are {}", outliers.meaning());
            return Err(Error::new(what, expected, most.to_string()));
        }
        Ok(keep)
    }

    /// Returns all lists end to end: K records each in ascending order, `keep` of them true
    /// neighbors.
    fn rows(&self, keep: usize, outliers: &Outliers, seed: u64) -> Vec<RecordId> {
        let mut records = vec![RecordId(0); self.records.len()];
        records.par_chunks_mut(self.k).enumerate().for_each_init(Vec::new, |order, (slot, row)| {
            order.clear();
            order.extend_from_slice(self.of(slot));
            Draws::new(seed, Stage::OracleKeep, slot as u64).shuffle(order);
            row[..keep].copy_from_slice(&order[..keep]);
            outliers.fill(self, slot, seed, order, &mut row[keep..]);
            row.sort_unstable();
        });
        records
    }

    /// Makes [`lists`](Self::lists) with uniformly random outliers.
    ///
    /// # Errors
    /// Returns the errors of [`lists`](Self::lists).
    pub fn at_inlier_ratio(&self, inlier_ratio: f64, seed: u64) -> Result<Neighborhoods, Error> {
        self.lists(inlier_ratio, &Outliers::uniform(), seed)
    }

    /// Returns the true neighbors of `slot`, nearest first.
    fn of(&self, slot: usize) -> &[RecordId] {
        &self.records[slot * self.k..(slot + 1) * self.k]
    }

    fn own(&self, slot: usize) -> RecordId {
        RecordId::from_index(slot / self.slots_per_record)
    }

    /// Returns the share of listed entries that are true neighbors, over all slots with a list. If
    /// the order of a record's two lists is unknown, the order with more true neighbors counts, as
    /// in evaluation.
    pub fn measured_inlier_ratio(&self, lists: &Neighborhoods) -> f64 {
        let hits = |slot: usize, of: usize| {
            let near = self.of(of);
            lists.of(slot).iter().filter(|record| near.contains(record)).count()
        };
        let slots = self.slots_per_record;
        let either = slots == 2 && lists.about().order == RowOrder::Either;
        let (hits, listed) = (0..lists.n_slots() / slots)
            .into_par_iter()
            .map(|record| {
                let own = record * slots..(record + 1) * slots;
                let straight: usize = own.clone().map(|slot| hits(slot, slot)).sum();
                let crossed = match either {
                    true => hits(own.start, own.start + 1) + hits(own.start + 1, own.start),
                    false => 0,
                };
                (straight.max(crossed), own.map(|slot| lists.of(slot).len()).sum())
            })
            .reduce(|| (0, 0), |a: (usize, usize), b| (a.0 + b.0, a.1 + b.1));
        if listed == 0 { 0.0 } else { hits as f64 / listed as f64 }
    }
}

fn check_k(k: usize, n_records: usize) -> Result<(), Error> {
    if k > 0 && n_records > k {
        return Ok(());
    }
    let others = n_records.saturating_sub(1);
    let expected = match others {
        0 => "more than one record".to_owned(),
        _ => format!("between 1 and {others} (other records)"),
    };
    Err(Error::new("k", expected, k.to_string()))
}

fn about(map: Option<Fingerprint>) -> About {
    About { map, order: RowOrder::Slots, lists_by: ListsBy::Oracle }
}

/// Builds a search over the originals for [`TrueNeighbors::new`], once per map.
///
/// # Errors
/// When there are no points.
pub fn search<const D: usize>(original: &Original<D>) -> Result<Knn<'_, D>, Error> {
    Knn::new(original.reveal().positions())
}
