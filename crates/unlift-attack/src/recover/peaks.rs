//! Points at the peaks of densities that the records alone give.

use crate::density::{Peaks, tomography};
use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::recover::map::{distance2, rows_of};
use crate::recover::result::{Estimate, Recovered, Status, Unknown};
use crate::released::Released;
use crate::{Error, RowOrder};

/// Places lost slots that have no list, such as those whose descriptors are zeros, at the peaks of the density that the records give; of the two
/// points of a line, at the peak farther from the other point.
pub(super) fn place_unlisted<const D: usize>(
    estimates: &mut [Estimate<D>],
    released: &Released<D>,
    lists: &Neighborhoods,
) {
    let is_lost = |slot: &usize| lists.of(*slot).is_empty() && !estimates[*slot].is_known();
    let lost: Vec<usize> = (0..estimates.len()).filter(is_lost).collect();
    let says_more = lists.scores().is_some() && lists.about().order != RowOrder::Either;
    let Some(peaks) = (!lost.is_empty() && says_more).then(|| tomography(released)).flatten()
    else {
        return;
    };
    for slot in lost {
        let (own, other) = match released.slots_per_record() {
            2 if estimates[slot ^ 1].is_known() => (slot & !1..(slot | 1) + 1, slot ^ 1),
            _ => (slot..slot + 1, slot),
        };
        let from = estimates[other].position;
        let away = |peak: &Estimate<D>| distance2(&peak.position, &from);
        let own = own.filter_map(|slot| peak(&peaks, slot));
        let farthest = own.max_by(|a, b| away(a).total_cmp(&away(b)));
        estimates[slot] = farthest.unwrap_or(estimates[slot]);
    }
}

/// Returns the estimate at the peak of `slot`, if it has one. There are peaks in three dimensions only.
fn peak<const D: usize>(peaks: &Peaks, slot: usize) -> Option<Estimate<D>> {
    let Estimate { position, axis, evidence, .. } = peaks.of.get(slot).copied().flatten()?;
    Some(Estimate::at(std::array::from_fn(|c| position[c % 3]), 0, axis.into(), evidence))
}

/// Returns the points at `peaks`.
///
/// Lists decide which of the two positions of a paired line belongs to which slot, by the distances to the listed records (Eq. (4)).
pub(super) fn at_peaks<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    peaks: &Peaks,
) -> Result<Recovered<D>, Error> {
    let rows = rows_of(released, None);
    // Delta is the resolution of the peaks.
    let delta = if peaks.resolution > 0.0 { peaks.resolution } else { 1.0 };
    let peak = |slot: usize| peak(peaks, slot).unwrap_or(Estimate::lost(Status::NoSupport));
    // Only lines and rays have rows.
    let distances = |slot: usize, x: [f32; D]| {
        let rows = lists.of(slot).iter().filter_map(|record| rows.get(record.index()));
        rows.map(move |row| row.distance2(&x, row.along(&x)).sqrt())
    };
    let cost = |at: usize, slot: usize| distances(slot, peak(at).position).sum::<f32>();
    let place = |slot: usize| {
        let (a, b) = (slot & !1, slot | 1);
        let is_crossed =
            released.slots_per_record() == 2 && cost(a, a) + cost(b, b) > cost(b, a) + cost(a, b);
        let estimate = peak(if is_crossed { slot ^ 1 } else { slot });
        let near = distances(slot, estimate.position).filter(|&d| d <= delta as f32);
        Estimate { support: u16::try_from(near.count()).unwrap_or(u16::MAX), ..estimate }
    };
    let estimates = parallel::map(released.n_slots(), place);
    let recovered = Recovered::new(released, lists, &estimates, delta)?;
    Ok(recovered.without_confidence(Unknown::OtherSolver))
}
