//! The source `geometric`: neighborhoods from tomography of the records alone, without descriptors.
//!
//! Chelani et al. (CVPR 2021) list by distances between lines. Many lines pass each other closely, but few estimates are close by chance.

use super::Neighborhoods;
use super::compare::higher_first;
use super::sources::{Needs, Source};
use crate::density::{Peaks, tomography};
use crate::geometry::knn::Knn;
use crate::geometry::vector::{along, distance, dot, sub, widen};
use crate::parallel;
use crate::released::{Obfuscation, Rays, Released};
use crate::{Error, RecordId, RowOrder};

/// Estimates searched per listed record: some belong to the same record, and some records pass too far away.
const LOOK: usize = 3;
/// Largest number of estimates searched per listed record: coinciding estimates of rays of one center may not list each other.
const MOST_LOOKED: usize = 64 * LOOK;

/// Lists, per slot, the `k` records most likely to hide points near its own; none without an estimate. The score is the negative distance
/// between estimates plus the distance from the estimate to the record (where known), in units of the resolution.
///
/// The slots of a paired line get the lists of its two estimates in their order along the line. Rays list only rays of other centers.
///
/// The cost is that of tomography (linear in the records) and of nearest neighbors of points.
///
/// # Errors
/// When `k` is 0, the map is not in three dimensions, or its records alone give no positions (planes, rays of one center).
pub fn geometric<const D: usize>(released: &Released<D>, k: usize) -> Result<Neighborhoods, Error> {
    check(released, k)?;
    geometric_by(released, k, &tomography(released).unwrap_or_default())
}

/// The function [`geometric`] as a source.
#[derive(Clone, Copy, Debug)]
pub struct Geometric;

impl Geometric {
    /// Default number of records per list.
    pub const K: usize = 50;
}

impl Source<3> for Geometric {
    fn name(&self) -> &str {
        "geometric"
    }

    fn needs(&self) -> Needs {
        Needs::Nothing
    }

    fn k(&self, _: &Released<3>) -> usize {
        Self::K
    }

    fn lists(&self, released: &Released<3>, k: usize, _: u64) -> Result<Neighborhoods, Error> {
        geometric(released, k)
    }

    fn supports(&self, released: &Released<3>) -> Result<(), Error> {
        check(released, Self::K)
    }
}

/// Makes the lists of [`geometric`] from given estimates of tomography.
pub(crate) fn geometric_by<const D: usize>(
    released: &Released<D>,
    k: usize,
    peaks: &Peaks,
) -> Result<Neighborhoods, Error> {
    check(released, k)?;
    let centers = released.obfuscation().rays().map(Rays::center);
    let known = peaks.of.iter().enumerate();
    let known = known.filter_map(|(slot, peak)| Some((slot, widen(&peak.as_ref()?.position))));
    let (slots, positions): (Vec<usize>, Vec<[f64; 3]>) = known.unzip();
    let mut rows: Vec<Vec<(f32, RecordId)>> = vec![Vec::new(); released.n_slots()];
    // There may be no positions at all.
    let Ok(knn) = Knn::new(&positions) else {
        return Neighborhoods::scored(rows, released, RowOrder::Either);
    };
    let per_record = released.slots_per_record();
    let near = |scratch: &mut Vec<(f64, u32)>, at: usize| {
        let own = RecordId::from_index(slots[at] / per_record);
        let may_list = |record: RecordId| {
            record != own && centers.is_none_or(|c| c[record.index()] != c[own.index()])
        };
        let mut look = LOOK * k;
        loop {
            knn.nearest(at, look, scratch);
            let mut row: Vec<(f32, RecordId)> = Vec::new();
            for &(squared, near) in scratch.iter() {
                let record = RecordId::from_index(slots[near as usize] / per_record);
                if may_list(record) && row.iter().all(|&(_, listed)| listed != record) {
                    let miss = distance_to(released, record, &positions[at]);
                    let far = (squared.sqrt() + miss) / peaks.resolution;
                    row.push((-(far as f32), record));
                }
            }
            // Own records and rays of the own center take up places.
            if row.len() >= k || scratch.len() < look || look >= MOST_LOOKED * k {
                row.sort_unstable_by(higher_first);
                row.truncate(k);
                return row;
            }
            look *= 2;
        }
    };
    let listed = parallel::map_with(positions.len(), Vec::new, near);
    for (row, slot) in listed.into_iter().zip(slots) {
        rows[slot] = row;
    }
    Neighborhoods::scored(rows, released, RowOrder::Either)
}

/// Rejects records that alone give no positions.
fn check<const D: usize>(released: &Released<D>, k: usize) -> Result<(), Error> {
    if k == 0 {
        return Err(Error::new("k", "at least 1", "0"));
    }
    let what = "geometric neighborhoods";
    if D != 3 {
        return Err(Error::new(what, "a map in three dimensions", D));
    }
    match released.obfuscation() {
        Obfuscation::AxisPlanes(_) => {
            Err(Error::new(what, "lines, rays or axis candidates", "planes"))
        }
        Obfuscation::Rays(rays) if rays.centers().len() < 2 => {
            Err(Error::new(what, "rays of two or more centers", "one center"))
        }
        Obfuscation::Rays(_) | Obfuscation::Lines(_) | Obfuscation::AxisCandidates(_) => Ok(()),
    }
}

/// Returns the distance from `x` to the line of a record; 0 for axis candidates, which have three lines.
fn distance_to<const D: usize>(released: &Released<D>, record: RecordId, x: &[f64; 3]) -> f64 {
    let Some(line) = released.obfuscation().line(record.index()) else { return 0.0 };
    let [through, direction] =
        [line.0, line.1].map(|v| -> [f64; 3] { std::array::from_fn(|c| f64::from(v[c % D])) });
    let t = dot(&sub(x, &through), &direction);
    distance(x, &along(&through, t, &direction))
}
