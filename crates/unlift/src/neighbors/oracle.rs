//! Neighborhoods from the originals, at a chosen inlier ratio (paper, section 6).
//!
//! The one module of this stage that reveals: it stands for an attacker of stated quality.

use rayon::prelude::*;

use super::Neighborhoods;
use crate::geometry::knn::Knn;
use crate::seed::{Draws, Stage};
use crate::truth::{Original, Secret};
use crate::{Error, OriginalId, RecordId};

/// The true neighborhoods of every slot: the records that hide its K nearest other points.
///
/// Walking outward from the slot's original in order of (distance, original id), records are taken
/// until K are found: never the slot's own, each once (a paired line may hide two near points),
/// dropped points skipped.
#[derive(Clone, Debug)]
pub struct TrueNeighbors {
    k: usize,
    n_records: usize,
    slots_per_record: usize,
    /// K records per slot, in order of nearness: never released in this order.
    records: Vec<RecordId>,
}

impl TrueNeighbors {
    /// The true neighborhoods of size `k` under the obfuscation that `secret` belongs to. `knn` must
    /// be a search over the original positions.
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
        if k == 0 || n_records < k + 1 {
            let expected = format!("between 1 and {} (other records)", n_records.saturating_sub(1));
            return Err(Error::new("k", expected, k.to_string()));
        }
        let record_of = record_of_originals(secret, slots_per_record);
        let mut records = vec![RecordId(0); n_slots * k];
        records.par_chunks_mut(k).enumerate().for_each_init(
            || (Vec::new(), Vec::new()),
            |(found, chosen), (slot, row)| {
                let own = RecordId::from_index(slot / slots_per_record);
                let original: OriginalId = secret.hidden()[slot];
                // Own partner, shared records and dropped points cost places: look a little further.
                let mut reach = k + 8;
                loop {
                    knn.nearest(original.index(), reach, found);
                    chosen.clear();
                    for &(_, at) in found.iter() {
                        if let Some(record) = record_of[at as usize]
                            && record != own
                            && !chosen.contains(&record)
                        {
                            chosen.push(record);
                            if chosen.len() == k {
                                break;
                            }
                        }
                    }
                    if chosen.len() == k {
                        break;
                    }
                    reach *= 2;
                }
                row.copy_from_slice(chosen);
            },
        );
        Ok(Self { k, n_records, slots_per_record, records })
    }

    /// Neighborhoods of which `round(inlier_ratio * K)` entries are true neighbors, uniformly
    /// chosen, and the others uniformly random non-neighbors. Which true neighbors stay is nested:
    /// a lower ratio keeps a subset of a higher one.
    ///
    /// # Errors
    /// When the ratio is not in `[0, 1]`, or there are too few non-neighbors.
    pub fn at_inlier_ratio(&self, inlier_ratio: f64, seed: u64) -> Result<Neighborhoods, Error> {
        if !(0.0..=1.0).contains(&inlier_ratio) {
            return Err(Error::new("inlier ratio", "0 to 1", inlier_ratio.to_string()));
        }
        let keep = (inlier_ratio * self.k as f64).round() as usize;
        let outliers = self.k - keep;
        let strangers = self.n_records - 1 - self.k;
        if outliers > strangers {
            let what = format!("inlier ratio {inlier_ratio} at K = {}", self.k);
            let expected = format!("at least {outliers} records that are not neighbors");
            return Err(Error::new(what, expected, strangers.to_string()));
        }
        let mut records = vec![RecordId(0); self.records.len()];
        records.par_chunks_mut(self.k).enumerate().for_each_init(Vec::new, |order, (slot, row)| {
            let near = &self.records[slot * self.k..(slot + 1) * self.k];
            let own = RecordId::from_index(slot / self.slots_per_record);
            order.clear();
            order.extend_from_slice(near);
            Draws::new(seed, Stage::OracleKeep, slot as u64).shuffle(order);
            row[..keep].copy_from_slice(&order[..keep]);
            let mut draws = Draws::new(seed, Stage::OracleOutliers, slot as u64);
            let mut at = keep;
            while at < self.k {
                let stranger = RecordId(draws.below(self.n_records as u64) as u32);
                if stranger != own
                    && !near.contains(&stranger)
                    && !row[keep..at].contains(&stranger)
                {
                    row[at] = stranger;
                    at += 1;
                }
            }
            row.sort_unstable();
        });
        let n_slots = self.n_records * self.slots_per_record;
        let offsets = (0..=n_slots as u64).map(|slot| slot * self.k as u64).collect();
        Neighborhoods::try_new(offsets, records, None, self.n_records, self.slots_per_record)
    }

    /// The share of listed entries that are true neighbors, over all slots with a list.
    pub fn measured_inlier_ratio(&self, lists: &Neighborhoods) -> f64 {
        let (hits, listed) = (0..lists.n_slots())
            .into_par_iter()
            .map(|slot| {
                let near = &self.records[slot * self.k..(slot + 1) * self.k];
                let listed = lists.of(slot);
                (listed.iter().filter(|record| near.contains(record)).count(), listed.len())
            })
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        if listed == 0 { 0.0 } else { hits as f64 / listed as f64 }
    }
}

/// The record that hides each original; `None` for dropped ones.
fn record_of_originals(secret: &Secret, slots_per_record: usize) -> Vec<Option<RecordId>> {
    let mut record_of = vec![None; secret.n_originals()];
    for (slot, original) in secret.hidden().iter().enumerate() {
        record_of[original.index()] = Some(RecordId::from_index(slot / slots_per_record));
    }
    record_of
}

/// A search over the originals, for [`TrueNeighbors::new`]; built once per map.
///
/// # Errors
/// When there are no points.
pub fn search<const D: usize>(original: &Original<D>) -> Result<Knn<'_, D>, Error> {
    Knn::new(original.reveal().positions())
}

/// Translates neighbors given by original row (as an owner lists them) to the records of one
/// obfuscation: dropped points, own records and repeats fall away.
///
/// # Errors
/// When the lists do not have one row per original, or name an original out of range.
pub fn from_points(
    offsets: &[u64],
    neighbors: &[u32],
    scores: Option<&[f32]>,
    secret: &Secret,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    let n = secret.n_originals();
    if offsets.len() != n + 1 {
        let found = offsets.len().saturating_sub(1).to_string();
        return Err(Error::new("neighbors by point", format!("{n} rows, one per point"), found));
    }
    if let Some(at) = neighbors.iter().position(|&id| id as usize >= n) {
        let what = format!("neighbor entry {at}");
        return Err(Error::new(what, format!("points below {n}"), neighbors[at].to_string()));
    }
    let ascending = offsets[0] == 0 && offsets.windows(2).all(|w| w[0] <= w[1]);
    if !ascending || offsets[n] != neighbors.len() as u64 {
        let expected = format!("ascending from 0 to {}", neighbors.len());
        return Err(Error::new("offsets of neighbors by point", expected, "another sequence"));
    }
    if let Some(scores) = scores
        && scores.len() != neighbors.len()
    {
        let expected = format!("{} rows", neighbors.len());
        return Err(Error::new("scores of neighbors by point", expected, scores.len().to_string()));
    }
    let record_of = record_of_originals(secret, slots_per_record);
    let mut rows = vec![0u64];
    let mut records = Vec::new();
    let mut kept_scores = scores.map(|_| Vec::new());
    for (slot, original) in secret.hidden().iter().enumerate() {
        let own = RecordId::from_index(slot / slots_per_record);
        let start = records.len();
        for at in offsets[original.index()] as usize..offsets[original.index() + 1] as usize {
            if let Some(record) = record_of[neighbors[at] as usize]
                && record != own
                && !records[start..].contains(&record)
            {
                records.push(record);
                if let (Some(kept), Some(scores)) = (&mut kept_scores, scores) {
                    kept.push(scores[at]);
                }
            }
        }
        rows.push(records.len() as u64);
    }
    let n_records = secret.n_slots() / slots_per_record;
    Neighborhoods::try_new(rows, records, kept_scores, n_records, slots_per_record)
}
