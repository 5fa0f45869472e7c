//! The oracle: neighborhoods from ground truth at a chosen inlier ratio (paper, section 6).
//!
//! It simulates an attacker of known quality. No other source reads ground truth.

use rayon::prelude::*;

use super::Neighborhoods;
use crate::geometry::knn::Knn;
use crate::seed::{Draws, Stage};
use crate::truth::{Original, Secret};
use crate::{About, Error, Fingerprint, RecordId, RowOrder};

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
    pub fn new<const D: usize>(knn: &Knn<'_, D>, secret: &Secret, k: usize) -> Result<Self, Error> {
        let (n_slots, slots_per_record) = (secret.n_slots(), secret.slots_per_record());
        let n_records = n_slots / slots_per_record;
        if k == 0 || n_records <= k {
            let expected = match n_records.saturating_sub(1) {
                0 => "more than one record".to_owned(),
                others => format!("between 1 and {others} (other records)"),
            };
            return Err(Error::new("k", expected, k.to_string()));
        }
        let mut records = vec![RecordId(0); n_slots * k];
        Nearness::new(knn, secret).each(k, &mut records, &|_, near, row| {
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
        let keep = self.kept(inlier_ratio, outliers)?;
        let mut records = vec![RecordId(0); self.records.len()];
        records.par_chunks_mut(self.k).enumerate().for_each_init(Vec::new, |order, (slot, row)| {
            order.clear();
            order.extend_from_slice(self.of(slot));
            Draws::new(seed, Stage::OracleKeep, slot as u64).shuffle(order);
            row[..keep].copy_from_slice(&order[..keep]);
            outliers.fill(self, slot, seed, order, &mut row[keep..]);
            row.sort_unstable();
        });
        let n_slots = self.n_records * self.slots_per_record;
        let offsets = (0..=n_slots as u64).map(|slot| slot * self.k as u64).collect();
        let (n_records, slots) = (self.n_records, self.slots_per_record);
        let lists = Neighborhoods::try_new(offsets, records, None, n_records, slots)?;
        let about = About { map: self.map, order: RowOrder::Slots, by_oracle: true };
        Ok(lists.with_about(about))
    }

    /// Returns the number of true neighbors per list at an inlier ratio.
    fn kept(&self, inlier_ratio: f64, outliers: &Outliers) -> Result<usize, Error> {
        if !(0.0..=1.0).contains(&inlier_ratio) {
            return Err(Error::new("inlier ratio", "0 to 1", inlier_ratio.to_string()));
        }
        // Lists without any true neighbor must not pass for lists with a few.
        let keep = (inlier_ratio * self.k as f64).round() as usize;
        let keep = keep.max(usize::from(inlier_ratio > 0.0));
        let n_wrong = self.k - keep;
        let (available, meaning) = match outliers {
            Outliers::Near { per_slot, .. } => {
                (*per_slot, "between the 2K-th and the 10K-th nearest")
            }
            Outliers::Uniform | Outliers::Clustered { .. } => {
                (self.n_records - 1 - self.k, "not neighbors")
            }
        };
        if n_wrong > available {
            let what = format!("inlier ratio {inlier_ratio} at K = {}", self.k);
            let expected = format!("at least {n_wrong} records that are {meaning}");
            return Err(Error::new(what, expected, available.to_string()));
        }
        Ok(keep)
    }

    /// Makes [`lists`](Self::lists) with uniformly random outliers.
    ///
    /// # Errors
    /// Returns the errors of [`lists`](Self::lists).
    pub fn at_inlier_ratio(&self, inlier_ratio: f64, seed: u64) -> Result<Neighborhoods, Error> {
        self.lists(inlier_ratio, &Outliers::Uniform, seed)
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

/// Builds a search over the originals for [`TrueNeighbors::new`], once per map.
///
/// # Errors
/// When there are no points.
pub fn search<const D: usize>(original: &Original<D>) -> Result<Knn<'_, D>, Error> {
    Knn::new(original.reveal().positions())
}

/// Additional originals to search, because own partners, shared records and dropped points do not
/// count.
const MARGIN: usize = 8;

/// Callback with a slot, its nearest records in order, and the row to fill.
type Make<'a> = dyn Fn(usize, &mut [RecordId], &mut [RecordId]) + Sync + 'a;

/// A search over originals that returns records.
struct Nearness<'a, const D: usize> {
    knn: &'a Knn<'a, D>,
    secret: &'a Secret,
    record_of: Vec<Option<RecordId>>,
}

impl<'a, const D: usize> Nearness<'a, D> {
    fn new(knn: &'a Knn<'a, D>, secret: &'a Secret) -> Self {
        Self { knn, secret, record_of: record_of_originals(secret) }
    }

    /// Calls `make(slot, the n records nearest to its original, row)` for every slot. `rows` holds
    /// rows of equal length, slot by slot. At least `n` other records must exist.
    fn each(&self, n: usize, rows: &mut [RecordId], make: &Make<'_>) {
        let hidden = self.secret.hidden();
        let length = (rows.len() / hidden.len().max(1)).max(1);
        let rows = rows.par_chunks_mut(length).zip(hidden).enumerate();
        rows.for_each_init(Default::default, |(near, records), (slot, (row, original))| {
            self.from(original.index(), n, near, records);
            make(slot, records, row);
        });
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

/// Returns the record that hides each original; `None` for dropped points.
fn record_of_originals(secret: &Secret) -> Vec<Option<RecordId>> {
    let mut record_of = vec![None; secret.n_originals()];
    for (slot, original) in secret.hidden().iter().enumerate() {
        record_of[original.index()] = Some(RecordId::from_index(slot / secret.slots_per_record()));
    }
    record_of
}

/// Returns true if `records` contains `record`. Comparing all of them is faster than stopping
/// early.
#[inline(always)]
fn listed(records: &[RecordId], record: RecordId) -> bool {
    records.iter().fold(false, |hit, &known| hit | (known == record))
}

/// Translates neighbors given by original row to the records of one obfuscation. Omits dropped
/// points, the slot's own record and repeats.
///
/// # Errors
/// When the lists do not have one row per original, or contain an original out of range.
pub fn from_points(
    offsets: &[u64],
    neighbors: &[u32],
    scores: Option<&[f32]>,
    secret: &Secret,
) -> Result<Neighborhoods, Error> {
    let (n, slots_per_record) = (secret.n_originals(), secret.slots_per_record());
    if offsets.len() != n + 1 {
        let found = offsets.len().saturating_sub(1).to_string();
        return Err(Error::new("neighbors by point", format!("{n} rows, one per point"), found));
    }
    if let Some(at) = neighbors.iter().position(|&id| id as usize >= n) {
        let what = format!("neighbor entry {at}");
        return Err(Error::new(what, format!("points below {n}"), neighbors[at].to_string()));
    }
    let ascending = offsets[0] == 0 && offsets.is_sorted();
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
    let record_of = record_of_originals(secret);
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
    let lists = Neighborhoods::try_new(rows, records, kept_scores, n_records, slots_per_record)?;
    Ok(lists.with_about(About { map: secret.map(), order: RowOrder::Slots, ..About::default() }))
}

/// Noise model of the oracle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// Outliers are uniformly random records that are no true neighbors.
    Uniform,
    /// Outliers are uniformly random among the 2K-th to 10K-th nearest records: in the right
    /// region, at the wrong place.
    Near,
    /// Nearby points share their outliers, as with similar-looking descriptors.
    ///
    /// The originals are split in half along the longest side of their box until a patch holds at
    /// most 2K of them. Each patch has two wrong places: random originals outside the 10K nearest
    /// of one point of the patch. The outliers of its points come from the K records nearest to
    /// each place, and from all records if these are too few.
    Clustered,
}

impl Noise {
    /// All models.
    pub const ALL: [Noise; 3] = [Self::Uniform, Self::Near, Self::Clustered];

    /// Returns the name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Near => "near",
            Self::Clustered => "clustered",
        }
    }

    /// Returns the model called `name`.
    ///
    /// # Errors
    /// When there is no such model; the message lists all.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|noise| noise.name() == name).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|noise| noise.name()).collect();
            Error::new("oracle noise", format!("one of {}", names.join(", ")), name)
        })
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
    /// Outliers are uniformly random records, which need no preparation.
    Uniform,
    /// Rows of `per_slot` records in random order, slot by slot.
    Near {
        /// The records of all rows, end to end.
        records: Vec<RecordId>,
        /// Length of a row.
        per_slot: usize,
    },
    /// Records that the slots of a patch share.
    Clustered {
        /// The records of each patch.
        patches: Vec<Vec<RecordId>>,
        /// The patch of each slot.
        patch_of: Vec<u32>,
    },
}

impl Outliers {
    /// Prepares outliers of the model `noise` for the neighborhoods `truth`. `secret` and `knn`
    /// must be those of `truth`.
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
        if secret.n_slots() != n_slots {
            let found = secret.n_slots().to_string();
            return Err(Error::new("secret", format!("{n_slots} slots"), found));
        }
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
        let n_slots = truth.n_records * truth.slots_per_record;
        let mut records = vec![RecordId(0); n_slots * per_slot];
        if per_slot > 0 {
            nearness.each(end, &mut records, &|slot, near, row| {
                let ring = &mut near[first..];
                let mut draws = Draws::new(seed, Stage::OracleOutliers, slot as u64);
                for (at, entry) in row.iter_mut().enumerate() {
                    ring.swap(at, at + draws.below((ring.len() - at) as u64) as usize);
                    *entry = ring[at];
                }
            });
        }
        Self::Near { records, per_slot }
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
            for &original in *patch {
                patch_of_original[original as usize] = at as u32;
            }
        }
        let patch_of = secret.hidden().iter().map(|id| patch_of_original[id.index()]).collect();
        Self::Clustered { patches, patch_of }
    }

    /// Fills `row` with outliers of `slot`. Their order depends only on the seed and the slot, so a
    /// shorter row is a prefix of a longer one.
    #[inline(always)]
    fn fill(
        &self,
        truth: &TrueNeighbors,
        slot: usize,
        seed: u64,
        scratch: &mut Vec<RecordId>,
        row: &mut [RecordId],
    ) {
        if let Self::Near { records, per_slot } = self {
            row.copy_from_slice(&records[slot * per_slot..][..row.len()]);
            return;
        }
        let (near, own) = (truth.of(slot), truth.own(slot));
        let mut draws = Draws::new(seed, Stage::OracleOutliers, slot as u64);
        let mut at = 0;
        if let Self::Clustered { patches, patch_of } = self {
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
