//! Which records an oracle lists in place of true neighbors.
//!
//! Learned neighborhoods do not err at random: they list points a little too far away, and points
//! of other places that look alike. Each model here is one such way to err, alone.

use super::TrueNeighbors;
use super::nearness::{Nearness, listed};
use crate::geometry::knn::Knn;
use crate::seed::{Draws, Stage};
use crate::truth::Secret;
use crate::{Error, RecordId};

/// How an oracle errs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// Outliers are uniformly random among all records that are no true neighbors.
    Uniform,
    /// Outliers are uniformly random among the 2K-th to 10K-th nearest records: right about the
    /// region, wrong about the place.
    Near,
    /// Outliers share wrong places, as those of look-alike descriptors do.
    ///
    /// The originals are halved along the longest side of their box until a patch holds at most 2K
    /// of them. Each patch has two wrong places: random originals, none of them among the 10K
    /// nearest of one point of the patch. The K records nearest to either place look like the patch:
    /// outliers of all its points are drawn from these 2K records, and from all records where they
    /// do not suffice.
    Clustered,
}

impl Noise {
    /// Every model.
    pub const ALL: [Noise; 3] = [Self::Uniform, Self::Near, Self::Clustered];

    /// The name used in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Near => "near",
            Self::Clustered => "clustered",
        }
    }

    /// The model called `name`.
    ///
    /// # Errors
    /// When there is none.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|noise| noise.name() == name).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|noise| noise.name()).collect();
            Error::new("oracle noise", format!("one of {}", names.join(", ")), name)
        })
    }
}

/// Ranks of nearness between which [`Noise::Near`] draws, in multiples of K.
const RING: (usize, usize) = (2, 10);
/// Originals of a patch of [`Noise::Clustered`] at most, in multiples of K.
const PATCH: usize = 2;
/// Wrong places of a patch.
const PLACES: usize = 2;
/// Draws for a far place; small maps may have none.
const MOST_DRAWS: usize = 64;

/// What an oracle lists in place of true neighbors: one noise model, made ready for one obfuscation.
#[derive(Clone, Debug)]
pub struct Outliers {
    noise: Noise,
    /// `near`: rows of `per_slot` outliers in random order, slot by slot. `clustered`: the records
    /// that look like each patch, end to end.
    records: Vec<RecordId>,
    per_slot: usize,
    /// `clustered`: where the records of each patch start, and the patch of each slot.
    starts: Vec<usize>,
    patch_of: Vec<u32>,
}

impl Outliers {
    /// Uniformly random outliers need nothing.
    pub(super) fn uniform() -> Self {
        let (records, starts, patch_of) = Default::default();
        Self { noise: Noise::Uniform, records, per_slot: 0, starts, patch_of }
    }

    /// Outliers of model `noise` for the neighborhoods of `truth`, which `secret` and `knn` must be
    /// those of.
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

    /// The model.
    pub fn noise(&self) -> Noise {
        self.noise
    }

    /// How many outliers every slot can have.
    pub(super) fn most(&self, truth: &TrueNeighbors) -> usize {
        match self.noise {
            Noise::Near => self.per_slot,
            Noise::Uniform | Noise::Clustered => truth.n_records - 1 - truth.k,
        }
    }

    /// What [`most`](Self::most) counts, for messages.
    pub(super) fn meaning(&self) -> &'static str {
        match self.noise {
            Noise::Near => "between the 2K-th and the 10K-th nearest",
            Noise::Uniform | Noise::Clustered => "not neighbors",
        }
    }

    /// Fills `row` with outliers of `slot`: the first ones of an order that depends on the seed and
    /// the slot alone, so that a longer row begins with a shorter one.
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
