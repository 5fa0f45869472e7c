//! The oracle: neighborhoods from ground truth at a chosen inlier ratio (paper, section 6).
//!
//! It simulates an attacker of known quality. No other source reads ground truth.

use super::Neighborhoods;
use crate::geometry::knn::Knn;
use crate::seed::{Draws, Stage};
use crate::truth::{Original, Secret};
use crate::{About, Error, Fingerprint, RecordId, RowOrder};
use unlift_attack::parallel;

/// The true neighborhoods of every slot: the K records nearest to its original, by (distance,
/// original id), each once, without its own record and dropped points.
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
    /// Finds true neighborhoods of size `k` for `secret` by a search over the originals.
    ///
    /// # Errors
    /// When `k` is 0 or fewer than `k` other records exist.
    pub fn new<const D: usize>(knn: &Knn<'_, D>, secret: &Secret, k: usize) -> Result<Self, Error> {
        let slots_per_record = secret.slots_per_record();
        let n_records = secret.n_slots() / slots_per_record;
        if k == 0 || n_records <= k {
            let expected = match n_records.saturating_sub(1) {
                0 => "more than one record".to_owned(),
                others => format!("between 1 and {others} (other records)"),
            };
            return Err(Error::new("k", expected, k));
        }
        let nearness = Nearness::new(knn, secret);
        let records = nearness.each(k, k, &|_, near, row| row.copy_from_slice(near));
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
        let keep = self.kept(inlier_ratio, outliers)?;
        let mut records = vec![RecordId(0); self.records.len()];
        let mut rows: Vec<&mut [RecordId]> = records.chunks_mut(self.k).collect();
        parallel::for_each_mut(&mut rows, Vec::new, |order, slot, row| {
            order.clear();
            order.extend_from_slice(self.of(slot));
            Draws::new(seed, Stage::OracleKeep, slot as u64).shuffle(order);
            row[..keep].copy_from_slice(&order[..keep]);
            outliers.fill(self, slot, seed, order, &mut row[keep..]);
            row.sort_unstable();
        });
        let (n_records, slots) = (self.n_records, self.slots_per_record);
        let offsets = (0..=n_records * slots).map(|slot| (slot * self.k) as u64).collect();
        let lists = Neighborhoods::try_new(offsets, records, None, n_records, slots)?;
        let about = About { map: self.map, order: RowOrder::Slots, by_oracle: true };
        Ok(lists.with_about(about))
    }

    /// Returns the number of true neighbors per list at an inlier ratio.
    fn kept(&self, inlier_ratio: f64, outliers: &Outliers) -> Result<usize, Error> {
        if !(0.0..=1.0).contains(&inlier_ratio) {
            return Err(Error::new("inlier ratio", "0 to 1", inlier_ratio));
        }
        // Lists without any true neighbor must not pass for lists with a few.
        let keep = (inlier_ratio * self.k as f64).round() as usize;
        let keep = keep.max(usize::from(inlier_ratio > 0.0));
        let n_wrong = self.k - keep;
        let (available, meaning) = match outliers {
            Outliers::Near(_, per_slot) => (*per_slot, "between the 2K-th and the 10K-th nearest"),
            _ => (self.n_records - 1 - self.k, "not neighbors"),
        };
        if n_wrong > available {
            let what = format!("inlier ratio {inlier_ratio} at K = {}", self.k);
            let expected = format!("at least {n_wrong} records that are {meaning}");
            return Err(Error::new(what, expected, available));
        }
        Ok(keep)
    }

    /// Returns the true neighbors of `slot`, nearest first.
    fn of(&self, slot: usize) -> &[RecordId] {
        &self.records[slot * self.k..(slot + 1) * self.k]
    }

    /// Returns the share of listed entries that are true neighbors. If the order of a record's two
    /// lists is unknown, the order with more true neighbors counts, as in evaluation.
    pub fn measured_inlier_ratio(&self, lists: &Neighborhoods) -> f64 {
        let hits = |slot: usize, of: usize| {
            let near = self.of(of);
            lists.of(slot).iter().filter(|record| near.contains(record)).count()
        };
        let slots = self.slots_per_record;
        let either = slots == 2 && lists.about().order == RowOrder::Either;
        let of_record = |record: usize| {
            let own = record * slots..(record + 1) * slots;
            let straight: usize = own.clone().map(|slot| hits(slot, slot)).sum();
            let crossed = match either {
                true => hits(own.start, own.start + 1) + hits(own.start + 1, own.start),
                false => 0,
            };
            straight.max(crossed)
        };
        let hits: usize = parallel::map(lists.n_slots() / slots, of_record).iter().sum();
        let listed = lists.records().len();
        if listed == 0 { 0.0 } else { hits as f64 / listed as f64 }
    }
}

/// Builds a search over the originals for [`TrueNeighbors::new`], once per map.
///
/// # Errors
/// When there are no points.
pub fn search<const D: usize>(original: &Original<D>) -> Result<Knn<'_, D>, Error> {
    Knn::new(original.reveal().positions())
}

/// Additional originals to search: own partners, shared records and dropped points do not count.
const MARGIN: usize = 8;

/// Callback with a slot, its nearest records in order, and the row to fill.
type Make<'a> = dyn Fn(usize, &mut [RecordId], &mut [RecordId]) + Sync + 'a;

/// A search over originals that returns records.
struct Nearness<'a, const D: usize> {
    knn: &'a Knn<'a, D>,
    secret: &'a Secret,
    /// The record that hides each original; `None` for dropped points.
    record_of: Vec<Option<RecordId>>,
}

impl<'a, const D: usize> Nearness<'a, D> {
    fn new(knn: &'a Knn<'a, D>, secret: &'a Secret) -> Self {
        let mut record_of = vec![None; secret.n_originals()];
        for (slot, id) in secret.hidden().iter().enumerate() {
            let record = RecordId::from_index(slot / secret.slots_per_record());
            record_of[id.index()] = Some(record);
        }
        Self { knn, secret, record_of }
    }

    /// Calls `make(slot, the n records nearest to its original, row)` for every slot, and returns the rows of
    /// `length` records, slot by slot. At least `n` other records must exist.
    fn each(&self, n: usize, length: usize, make: &Make<'_>) -> Vec<RecordId> {
        let hidden = self.secret.hidden();
        let mut all = vec![RecordId(0); hidden.len() * length];
        let mut rows: Vec<&mut [RecordId]> = all.chunks_mut(length.max(1)).collect();
        parallel::for_each_mut(&mut rows, Default::default, |(near, records), slot, row| {
            self.from(hidden[slot].index(), n, near, records);
            make(slot, records, row);
        });
        all
    }

    /// Writes the `n` records nearest to `original` (fewer if there are fewer) to `records`, each once, without its own.
    fn from(
        &self,
        original: usize,
        n: usize,
        near: &mut Vec<(f64, u32)>,
        records: &mut Vec<RecordId>,
    ) {
        let (own, several) = (self.record_of[original], self.secret.slots_per_record() > 1);
        let mut reach = n + MARGIN;
        loop {
            self.knn.nearest(original, reach, near);
            records.clear();
            for &(_, at) in near.iter() {
                if records.len() < n
                    && let Some(record) = self.record_of[at as usize]
                    && Some(record) != own
                    && !(several && listed(records, record))
                {
                    records.push(record);
                }
            }
            if records.len() == n || near.len() < reach {
                return;
            }
            reach *= 2;
        }
    }
}

/// Returns true if `records` contains `record`; comparing all is faster than stopping early.
#[inline(always)]
fn listed(records: &[RecordId], record: RecordId) -> bool {
    records.iter().fold(false, |hit, &known| hit | (known == record))
}

/// Translates neighbors by original row to records, without the slot's own record and repeats.
///
/// # Errors
/// When the lists do not have one row per original, or contain an original out of range.
pub fn from_points(
    offsets: &[u64],
    neighbors: &[u32],
    scores: Option<&[f32]>,
    secret: &Secret,
) -> Result<Neighborhoods, Error> {
    let (n, n_entries) = (secret.n_originals(), neighbors.len());
    let n_rows = offsets.len().saturating_sub(1);
    Error::check_len("neighbors by point", n_rows, n, " rows, one per point")?;
    if let Some(at) = neighbors.iter().position(|&id| id as usize >= n) {
        let expected = format!("points below {n}");
        return Err(Error::new(format!("neighbor entry {at}"), expected, neighbors[at]));
    }
    let ends = offsets.first().zip(offsets.last());
    if ends != Some((&0, &(n_entries as u64))) || !offsets.is_sorted() {
        let expected = format!("ascending from 0 to {n_entries}");
        return Err(Error::new("offsets of neighbors by point", expected, "another sequence"));
    }
    let n_scores = scores.map_or(n_entries, <[_]>::len);
    Error::check_len("scores of neighbors by point", n_scores, n_entries, " rows")?;
    let slots_per_record = secret.slots_per_record();
    let mut slot_of = vec![None; n];
    secret.hidden().iter().enumerate().for_each(|(slot, of)| slot_of[of.index()] = Some(slot));
    let (mut rows, mut records, mut named) = (vec![0u64], Vec::new(), Vec::new());
    let mut kept_scores = scores.map(|_| Vec::new());
    for (slot, original) in secret.hidden().iter().enumerate() {
        let own = RecordId::from_index(slot / slots_per_record);
        let start = records.len();
        let row = offsets[original.index()] as usize..offsets[original.index() + 1] as usize;
        let mut row: Vec<usize> = row.collect();
        // Of the two points of a line, the one with the better score is listed.
        if let Some(scores) = scores {
            row.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
        }
        for at in row {
            let Some(near) = slot_of[neighbors[at] as usize] else { continue };
            let record = RecordId::from_index(near / slots_per_record);
            if record != own && !records[start..].contains(&record) {
                records.push(record);
                named.push(near as u32);
                kept_scores.iter_mut().zip(scores).for_each(|(kept, all)| kept.push(all[at]));
            }
        }
        rows.push(records.len() as u64);
    }
    let n_records = secret.n_slots() / slots_per_record;
    let lists = Neighborhoods::try_new(rows, records, kept_scores, n_records, slots_per_record)?;
    let lists = if slots_per_record == 2 { lists.with_slots(named)? } else { lists };
    Ok(lists.with_about(About { map: secret.map(), order: RowOrder::Slots, ..About::default() }))
}

unlift_attack::named! {
    /// Noise model of the oracle.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Noise {
        /// Outliers are uniformly random records that are no true neighbors.
        Uniform = "uniform",
        /// Outliers are uniformly random among the 2K-th to 10K-th nearest records: in the right region, at the wrong place.
        Near = "near",
        /// Nearby points share their outliers, as with similar-looking descriptors.
        ///
        /// The originals are split in half along the longest side of their box until a patch holds at
        /// most 2K of them. Outliers of a patch come from the K records nearest to two random
        /// originals outside the 10K nearest, and from all records if these are too few.
        Clustered = "clustered",
    }
}

impl Noise {
    /// Returns the model called `name`.
    ///
    /// # Errors
    /// When there is no such model; the message lists all.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        let all = || format!("one of {}", Self::ALL.map(Self::name).join(", "));
        Self::named(name).ok_or_else(|| Error::new("oracle noise", all(), name))
    }
}

/// Range of ranks from which [`Noise::Near`] draws, in multiples of K.
const RING: (usize, usize) = (2, 10);
/// Maximum number of originals in a patch of [`Noise::Clustered`], in multiples of K.
const PATCH: usize = 2;
const PLACES: usize = 2;
/// Maximum number of draws for a far place; small maps may have none.
const MAX_DRAWS: usize = 64;

/// Outliers of one noise model, prepared for one obfuscation.
#[derive(Clone, Debug)]
pub enum Outliers {
    /// Uniformly random records, which need no preparation.
    Uniform,
    /// Rows of records in random order, slot by slot, and the length of a row.
    Near(Vec<RecordId>, usize),
    /// Records that the slots of a patch share, by patch, and the patch of each slot.
    Clustered(Vec<Vec<RecordId>>, Vec<u32>),
}

impl Outliers {
    /// Prepares outliers of the model `noise` for `truth`, which `secret` and `knn` made.
    ///
    /// # Errors
    /// When `secret` belongs to another obfuscation.
    pub fn new<const D: usize>(
        noise: Noise,
        truth: &TrueNeighbors,
        knn: &Knn<'_, D>,
        secret: &Secret,
        seed: u64,
    ) -> Result<Self, Error> {
        let n_slots = truth.n_records * truth.slots_per_record;
        Error::check_len("secret", secret.n_slots(), n_slots, " slots")?;
        let nearness = Nearness::new(knn, secret);
        Ok(match noise {
            Noise::Uniform => Self::Uniform,
            Noise::Near => Self::near(truth, &nearness, seed),
            Noise::Clustered => Self::clustered(truth, &nearness, seed),
        })
    }

    fn near<const D: usize>(truth: &TrueNeighbors, nearness: &Nearness<'_, D>, seed: u64) -> Self {
        let first = RING.0 * truth.k;
        let end = (RING.1 * truth.k).min(truth.n_records - 1);
        let per_slot = truth.k.min(end.saturating_sub(first));
        // Without a ring there are no rows.
        let records = nearness.each(end, per_slot, &|slot, near, row| {
            let ring = &mut near[first..];
            let mut draws = Draws::new(seed, Stage::OracleOutliers, slot as u64);
            for (at, entry) in row.iter_mut().enumerate() {
                ring.swap(at, at + draws.below((ring.len() - at) as u64) as usize);
                *entry = ring[at];
            }
        });
        Self::Near(records, per_slot)
    }

    fn clustered<const D: usize>(
        truth: &TrueNeighbors,
        nearness: &Nearness<'_, D>,
        seed: u64,
    ) -> Self {
        let Nearness { knn, secret, .. } = nearness;
        let mut patches = Vec::new();
        let mut patch_of_original = vec![0u32; secret.n_originals()];
        let (mut around, mut around_place, mut near) = (Vec::new(), Vec::new(), Vec::new());
        for (at, patch) in knn.patches(PATCH * truth.k).iter().enumerate() {
            let middle = patch[patch.len() / 2];
            knn.nearest(middle as usize, RING.1 * truth.k, &mut around);
            let mut draws = Draws::new(seed, Stage::OracleLookAlikes, at as u64);
            let mut records = Vec::new();
            for _ in 0..PLACES {
                let mut place = middle;
                for _ in 0..MAX_DRAWS {
                    place = draws.below(secret.n_originals() as u64) as u32;
                    if place != middle && around.iter().all(|&(_, other)| other != place) {
                        break;
                    }
                }
                let hidden_there = nearness.record_of[place as usize];
                nearness.from(place as usize, truth.k, &mut around_place, &mut near);
                for record in hidden_there.into_iter().chain(near.iter().copied()).take(truth.k) {
                    if !listed(&records, record) {
                        records.push(record);
                    }
                }
            }
            patches.push(records);
            patch.iter().for_each(|&row| patch_of_original[row as usize] = at as u32);
        }
        let patch_of = secret.hidden().iter().map(|id| patch_of_original[id.index()]).collect();
        Self::Clustered(patches, patch_of)
    }

    /// Fills `row` with outliers of `slot`. A shorter row is a prefix of a longer one.
    #[inline(always)]
    fn fill(
        &self,
        truth: &TrueNeighbors,
        slot: usize,
        seed: u64,
        scratch: &mut Vec<RecordId>,
        row: &mut [RecordId],
    ) {
        if let Self::Near(records, per_slot) = self {
            row.copy_from_slice(&records[slot * per_slot..][..row.len()]);
            return;
        }
        let (near, own) = (truth.of(slot), RecordId::from_index(slot / truth.slots_per_record));
        let mut draws = Draws::new(seed, Stage::OracleOutliers, slot as u64);
        let mut at = 0;
        if let Self::Clustered(patches, patch_of) = self {
            let alike = &patches[patch_of[slot] as usize];
            scratch.clear();
            scratch.extend(alike.iter().filter(|&&r| r != own && !listed(near, r)));
            draws.shuffle(scratch);
            at = row.len().min(scratch.len());
            row[..at].copy_from_slice(&scratch[..at]);
        }
        while at < row.len() {
            let stranger = RecordId(draws.below(truth.n_records as u64) as u32);
            if stranger != own && !listed(near, stranger) && !listed(&row[..at], stranger) {
                row[at] = stranger;
                at += 1;
            }
        }
    }
}
