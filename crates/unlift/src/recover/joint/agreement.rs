//! How well records agree with estimates: the judge of rounds.
//!
//! Estimates that agree with each other prove nothing: they may have drifted together. Records cannot
//! drift. If fewer of them pass near the estimates of a round than before, beyond chance, the round
//! made things worse.

use rayon::prelude::*;

use crate::Error;
use crate::recover::map::bytes::{Reader, Writer};
use crate::recover::map::edges::record_of;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::with_pieces::WithPieces;
use crate::recover::result::estimate::{Estimate, Status};

/// Slots looked at: the mean over so many is known better than the share by which it may fall.
const SLOTS: usize = 1 << 12;

/// The mean number of records at the other ends of a slot's edges that pass near its estimate, less
/// that expected by chance.
pub(super) fn of<const D: usize, P: Pieces<D>>(
    pieces: &P,
    judges: &Judges,
    estimates: &[Estimate<D>],
    delta2: f32,
) -> f64 {
    let of_part = |part: &[(usize, Vec<u32>)]| {
        part.iter()
            .map(|(slot, ends)| of_slot(pieces, (*slot, ends), &estimates[*slot], delta2))
            .sum()
    };
    let parts: Vec<f64> = judges.0.par_chunks(256).map(of_part).collect();
    parts.iter().sum::<f64>() / judges.0.len().max(1) as f64
}

/// [`of`] as something to be done with pieces, at a delta.
pub(crate) struct Agree<'a, const D: usize> {
    pub(crate) judges: &'a Judges,
    pub(crate) estimates: &'a [Estimate<D>],
    pub(crate) delta: f32,
}

impl<const D: usize> WithPieces<D> for Agree<'_, D> {
    type Output = f64;

    fn run<P: Pieces<D>>(self, pieces: &P) -> f64 {
        of(pieces, self.judges, self.estimates, self.delta * self.delta)
    }
}

/// The slots that are looked at, with the other ends of their edges.
pub(crate) struct Judges(Vec<(usize, Vec<u32>)>);

impl Judges {
    /// Slots spread evenly over `graph`.
    ///
    /// # Errors
    /// When edges cannot be read.
    pub(super) fn new(graph: &Graph) -> Result<Self, Error> {
        let n = graph.n_slots();
        let row = |slot: usize| Ok((slot, graph.rows(&(slot..slot + 1))?.ends().to_vec()));
        (0..n).step_by(n.div_ceil(SLOTS).max(1)).map(row).collect::<Result<_, _>>().map(Self)
    }

    /// Appends them to `to`.
    pub(super) fn write(&self, to: &mut Writer) {
        to.u64(self.0.len() as u64);
        for (slot, ends) in &self.0 {
            to.u32(*slot as u32);
            to.u32s(ends);
        }
    }

    /// Those that [`write`](Self::write) appended, of a map with so many slots.
    ///
    /// # Errors
    /// When there are none.
    pub(super) fn read(from: &mut Reader<'_>, n_slots: usize) -> Result<Self, Error> {
        let n = from.count(SLOTS)?;
        let row = |_| {
            let slot = from.below(n_slots)? as usize;
            let ends = from.u32s(2 * n_slots)?;
            from.all_below(&ends, n_slots)?;
            Ok((slot, ends))
        };
        (0..n).map(row).collect::<Result<_, _>>().map(Self)
    }
}

fn of_slot<const D: usize, P: Pieces<D>>(
    pieces: &P,
    (slot, ends): (usize, &[u32]),
    estimate: &Estimate<D>,
    delta2: f32,
) -> f64 {
    if estimate.status != Status::Ok {
        return 0.0;
    }
    let (mut near, mut all) = (0u32, 0u32);
    for &end in ends {
        let record = record_of(end as usize, pieces.slots_per_record());
        if pieces.may_vote(slot, record) {
            all += 1;
            near += u32::from(pieces.record_distance2(record, &estimate.position) <= delta2);
        }
    }
    let chance = pieces.record_chance(slot, &estimate.position);
    f64::from(near) - f64::from(all) * f64::from(chance)
}
