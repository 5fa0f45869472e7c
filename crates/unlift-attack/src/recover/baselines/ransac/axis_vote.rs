//! Which coordinate of a permuted point was exchanged: the vote of supplement A.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::map::sections::{NO_VOTE, Sections};

/// The exchanged axis of every record, by majority over all neighborhoods it appears in.
///
/// In a neighborhood (a slot's record and those listed for it), each member guesses the axis along
/// which its summed distance to the others is largest. "Relatively larger" in the paper is undefined;
/// sums are divided by their mean over the neighborhood, else every record votes for the long axis
/// of an elongated map. Ties go to the lower axis.
pub(super) fn vote<const D: usize>(rows: &[[f32; D]], lists: &Neighborhoods) -> Vec<u8> {
    let votes: Vec<[AtomicU32; D]> =
        rows.iter().map(|_| std::array::from_fn(|_| AtomicU32::new(0))).collect();
    (0..lists.n_slots()).into_par_iter().for_each_init(
        || (Vec::new(), std::array::from_fn::<Vec<f32>, D, _>(|_| Vec::new())),
        |(members, sums), slot| {
            members.clear();
            members.push(RecordId::from_index(slot));
            members.extend_from_slice(lists.of(slot));
            for (axis, sums) in sums.iter_mut().enumerate() {
                relative_distances(rows, members, axis, sums);
            }
            for (at, member) in members.iter().enumerate() {
                let guess = largest::<D>(|axis| sums[axis][at]);
                votes[member.index()][usize::from(guess)].fetch_add(1, Ordering::Relaxed);
            }
        },
    );
    votes
        .iter()
        .map(|votes| largest::<D>(|axis| votes[axis].load(Ordering::Relaxed) as f32))
        .collect()
}

/// The axis with the largest value, the lowest of equals.
fn largest<const D: usize>(value: impl Fn(usize) -> f32) -> u8 {
    let mut best = 0;
    for axis in 1..D {
        if value(axis) > value(best) {
            best = axis;
        }
    }
    best as u8
}

/// Per member the sum of distances to the others along `axis`, divided by its mean.
fn relative_distances<const D: usize>(
    rows: &[[f32; D]],
    members: &[RecordId],
    axis: usize,
    sums: &mut Vec<f32>,
) {
    let value = |member: &RecordId| rows[member.index()][axis];
    sums.clear();
    sums.extend(
        members
            .iter()
            .map(|one| members.iter().map(|other| (value(one) - value(other)).abs()).sum::<f32>()),
    );
    let mean = sums.iter().sum::<f32>() / sums.len() as f32;
    if mean > 0.0 {
        sums.iter_mut().for_each(|sum| *sum /= mean);
    }
}

/// Listed records, each reduced to the one line its vote left.
#[derive(Clone, Debug)]
pub(super) struct VotedColumns<const D: usize> {
    position: Vec<[f32; D]>,
    axis: Vec<u8>,
}

impl<const D: usize> Default for VotedColumns<D> {
    fn default() -> Self {
        Self { position: Vec::new(), axis: Vec::new() }
    }
}

impl<const D: usize> VotedColumns<D> {
    /// Gathers `records` and their axes.
    #[inline(always)]
    pub(super) fn gather(&mut self, rows: &[[f32; D]], axes: &[u8], records: &[RecordId]) {
        self.position.clear();
        self.position.extend(records.iter().map(|record| rows[record.index()]));
        self.axis.clear();
        self.axis.extend(records.iter().map(|record| axes[record.index()]));
    }

    /// Sections with the line through `own` along `axis`: perpendicular, or parallel and silent.
    #[inline(always)]
    pub(super) fn sections(&self, own: &[f32; D], axis: u8, out: &mut Sections) {
        out.resize(self.position.len());
        for (j, (position, &other)) in self.position.iter().zip(&self.axis).enumerate() {
            let mut miss2 = 0.0;
            for c in 0..D {
                let d = position[c] - own[c];
                miss2 += if c == axis.into() || c == other.into() { 0.0 } else { d * d };
            }
            out.at[j] = position[usize::from(axis)];
            out.bend[j] = 1.0;
            out.miss2[j] = if other == axis { NO_VOTE } else { miss2 };
        }
    }
}
