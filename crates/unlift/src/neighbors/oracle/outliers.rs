//! Noise models: the wrong entries in the oracle's lists.
//!
//! Learned neighborhoods contain points that are slightly too far away, and similar-looking points
//! of other places. Each model simulates one kind of error.

use super::TrueNeighbors;
use super::nearness::{Nearness, listed};
use crate::geometry::knn::Knn;
use crate::seed::{Draws, Stage};
use crate::truth::Secret;
use crate::{Error, RecordId};

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
const MOST_DRAWS: usize = 64;

/// Outliers of one noise model, prepared for one obfuscation.
#[derive(Clone, Debug)]
pub struct Outliers {
    noise: Noise,
    /// For `near`, rows of `per_slot` outliers in random order, slot by slot. For `clustered`, the
    /// outliers of each patch, end to end.
    records: Vec<RecordId>,
    per_slot: usize,
    /// For `clustered`: the start of each patch in `records`, and the patch of each slot.
    starts: Vec<usize>,
    patch_of: Vec<u32>,
}

impl Outliers {
    /// Returns uniformly random outliers, which need no preparation.
    pub(super) fn uniform() -> Self {
        let (records, starts, patch_of) = Default::default();
        Self { noise: Noise::Uniform, records, per_slot: 0, starts, patch_of }
    }

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
        let nearness = Nearness::new(knn, secret, truth.slots_per_record);
        Ok(match noise {
            Noise::Uniform => Self::uniform(),
            Noise::Near => Self::near(truth, &nearness, seed),
            Noise::Clustered => Self::clustered(truth, knn, secret, &nearness, seed),
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
                    let drawn = at + draws.below((ring.len() - at) as u64) as usize;
                    ring.swap(at, drawn);
                    *entry = ring[at];
                }
            });
        }
        Self { noise: Noise::Near, records, per_slot, ..Self::uniform() }
    }

    fn clustered<const D: usize>(
        truth: &TrueNeighbors,
        knn: &Knn<'_, D>,
        secret: &Secret,
        nearness: &Nearness<'_, D>,
        seed: u64,
    ) -> Self {
        let patches = knn.patches(PATCH * truth.k);
        let (mut starts, mut records) = (vec![0], Vec::new());
        let mut patch_of_original = vec![0u32; secret.n_originals()];
        let (mut around, mut near) = (Vec::new(), Vec::new());
        for (at, patch) in patches.iter().enumerate() {
            let middle = patch[patch.len() / 2];
            knn.nearest(middle as usize, RING.1 * truth.k, &mut around);
            let mut draws = Draws::new(seed, Stage::OracleLookAlikes, at as u64);
            let start = records.len();
            for _ in 0..PLACES {
                let mut place = middle;
                for _ in 0..MOST_DRAWS {
                    place = draws.below(secret.n_originals() as u64) as u32;
                    if place != middle && around.iter().all(|&(_, other)| other != place) {
                        break;
                    }
                }
                let hidden_there = nearness.record_of(place as usize);
                nearness.from(place as usize, truth.k, &mut near);
                for record in hidden_there.into_iter().chain(near.iter().copied()).take(truth.k) {
                    if !listed(&records[start..], record) {
                        records.push(record);
                    }
                }
            }
            starts.push(records.len());
            for &original in *patch {
                patch_of_original[original as usize] = at as u32;
            }
        }
        let patch_of = secret.hidden().iter().map(|id| patch_of_original[id.index()]).collect();
        Self { noise: Noise::Clustered, records, per_slot: 0, starts, patch_of }
    }

    /// Returns the noise model.
    pub fn noise(&self) -> Noise {
        self.noise
    }

    /// Returns the number of outliers that every slot can have.
    pub(super) fn most(&self, truth: &TrueNeighbors) -> usize {
        match self.noise {
            Noise::Near => self.per_slot,
            Noise::Uniform | Noise::Clustered => truth.n_records - 1 - truth.k,
        }
    }

    /// Describes the records that [`most`](Self::most) counts, for error messages.
    pub(super) fn meaning(&self) -> &'static str {
        match self.noise {
            Noise::Near => "between the 2K-th and the 10K-th nearest",
            Noise::Uniform | Noise::Clustered => "not neighbors",
        }
    }

    /// Fills `row` with outliers of `slot`. Their order depends only on the seed and the slot, so a
    /// shorter row is a prefix of a longer one.
    #[inline(always)]
    pub(super) fn fill(
        &self,
        truth: &TrueNeighbors,
        slot: usize,
        seed: u64,
        scratch: &mut Vec<RecordId>,
        row: &mut [RecordId],
    ) {
        if self.noise == Noise::Near {
            row.copy_from_slice(&self.records[slot * self.per_slot..][..row.len()]);
            return;
        }
        let (near, own) = (truth.of(slot), truth.own(slot));
        let mut draws = Draws::new(seed, Stage::OracleOutliers, slot as u64);
        let mut at = 0;
        if self.noise == Noise::Clustered {
            let patch = self.patch_of[slot] as usize;
            let alike = &self.records[self.starts[patch]..self.starts[patch + 1]];
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
