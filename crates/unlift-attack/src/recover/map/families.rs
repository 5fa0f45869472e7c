//! The three families: lines and rays, axis planes, and axis candidates.

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::consensus::{self, Scratch};
use crate::recover::map::chance::{
    self, CandidateField, ChanceField, interquartile_range, line_extent, ray_extent, tube,
};
use crate::recover::map::family::{Family, Piece};
use crate::recover::map::graph::record_of;
use crate::recover::map::lines::{LineRow, ln, rows_of};
use crate::recover::map::planes::{SortedPlanes, window_chance};
use crate::recover::result::Estimate;
use crate::released::{AxisPlanes, Released};
use crate::simd::prefetch;

/// Lines with one or two slots each, or rays, which have a group.
pub(crate) struct LineFamily<const D: usize> {
    pub(crate) rows: Vec<LineRow<D>>,
    slots_per_record: usize,
    /// One field for lines; for rays, one per center.
    chance: Vec<ChanceField<D>>,
    /// Whether these are rays whose centers have regions.
    anchored: bool,
}

/// Least range in the range prior, as a fraction of the ray.
const LEAST_RANGE: f32 = 1e-3;

impl<const D: usize> LineFamily<D> {
    /// Prepares lines or rays, cut at the bounds where these are known, and learns their chance from `lists`.
    pub(crate) fn new(released: &Released<D>, lists: &Neighborhoods, anchored: bool) -> Self {
        let slots_per_record = released.slots_per_record();
        let bounds = released.bounds().map(|bounds| bounds.about(&released.origin()));
        let rows = rows_of(released, bounds.as_ref());
        let chance = chance::of_lines(&rows, lists, slots_per_record);
        Self { rows, slots_per_record, chance, anchored }
    }

    #[inline(always)]
    pub(crate) fn own(&self, slot: usize) -> &LineRow<D> {
        &self.rows[record_of(slot, self.slots_per_record)]
    }

    fn is_of_rays(&self) -> bool {
        self.rows.first().is_some_and(LineRow::is_ray)
    }

    /// Returns the chance of the records that may vote for a point on `own`.
    #[inline(always)]
    pub(crate) fn field(&self, own: &LineRow<D>) -> &ChanceField<D> {
        &self.chance[if own.is_ray() { own.group as usize } else { 0 }]
    }
}

impl<const D: usize> Family<D> for LineFamily<D> {
    const MOST_ALONG: f32 = 0.35;
    const ALONG: f32 = 50.0;
    const SUBTRACTS_BACKGROUND: bool = true;

    /// The volume per length of a tube of radius delta.
    type AtDelta = f32;

    fn at_delta(&self, delta: f32) -> f32 {
        tube(D, delta)
    }

    fn slots_per_record(&self) -> usize {
        self.slots_per_record
    }

    fn anchored(&self) -> Option<&[LineRow<D>]> {
        self.anchored.then_some(&self.rows[..])
    }

    /// Lines: their median distance from their middle. Rays: the largest distance between centers.
    fn extent(&self) -> f64 {
        match self.rows.is_empty() {
            true => 0.0,
            false if self.is_of_rays() => ray_extent(&self.rows),
            false => line_extent(&self.rows),
        }
    }

    fn typical_chance(&self, delta: f32) -> f32 {
        self.chance.iter().map(ChanceField::typical).fold(0.0, f32::max) * tube(D, delta)
    }

    // Rays are dense near their centers, so chance is large at a typical place.
    fn limits(&self, share: f64) -> [f64; 2] {
        let factor = if self.is_of_rays() { 3.0 } else { 1.0 };
        [factor * libm::pow(share, 2.0 / 3.0), libm::pow(share, 2.0)]
    }

    #[inline(always)]
    fn prefetch(&self, record: usize) {
        prefetch(&self.rows, record);
    }

    #[inline(always)]
    fn consensus(
        &self,
        slot: usize,
        listed: &[RecordId],
        at: (f32, &f32),
        scratch: &mut Scratch<D>,
    ) -> Estimate<D> {
        scratch.lines.gather(&self.rows, listed);
        consensus::on_line(self, slot, at, scratch)
    }

    #[inline(always)]
    fn piece(&self, slot: usize, _: usize) -> Piece<D> {
        let own = self.own(slot);
        let sense = if own.floor() == 0.0 { own.direction } else { [0.0; D] };
        let line = Piece::line(own.through, own.direction);
        Piece { sense, to: own.to, from_center: own.is_ray(), ..line }
    }

    #[inline(always)]
    fn direction(&self, slot: usize, _: usize) -> [f32; D] {
        self.own(slot).direction
    }

    #[inline(always)]
    fn may_vote(&self, slot: usize, record: usize) -> bool {
        self.rows[record].may_vote_for(self.own(slot))
    }

    #[inline(always)]
    fn record_distance2(&self, record: usize, x: &[f32; D]) -> f32 {
        let row = &self.rows[record];
        row.distance2(x, row.clamp(row.along(x)))
    }

    #[inline(always)]
    fn record_chance(&self, slot: usize, x: &[f32; D], &tube: &f32) -> f32 {
        self.field(self.own(slot)).at(x, tube)
    }

    // Points are uniform over the region and rays diverge, so the prior grows with the range. Without it, estimates drift to where all
    // bearings meet.
    #[inline(always)]
    fn ln_spread(&self, slot: usize, x: &[f32; D]) -> f32 {
        if !self.anchored {
            return 0.0;
        }
        let own = self.own(slot);
        (D - 1) as f32 * ln((own.along(x) / own.to).max(LEAST_RANGE))
    }
}

#[inline(always)]
fn unit<const D: usize>(axis: usize) -> [f32; D] {
    std::array::from_fn(|c| if c == axis { 1.0 } else { 0.0 })
}

/// Axis planes, sorted by their offsets.
pub(crate) struct PlaneFamily<'a, const D: usize> {
    pub(crate) planes: &'a AxisPlanes<D>,
    sorted: SortedPlanes,
}

impl<'a, const D: usize> PlaneFamily<'a, D> {
    pub(crate) fn new(planes: &'a AxisPlanes<D>) -> Self {
        Self { planes, sorted: SortedPlanes::new(planes) }
    }

    #[inline(always)]
    fn axis(&self, record: usize) -> usize {
        usize::from(self.planes.axis()[record])
    }
}

impl<const D: usize> Family<D> for PlaneFamily<'_, D> {
    const NORMAL: bool = true;
    // Two coordinates are free: where few neighbors are true, their estimates are the only evidence.
    const HALF_WEIGHT_RATIO: f32 = 0.2;
    // Evidence hardly depends on delta, so that noise widens the plateau.
    const DELTA_CHUNKS: usize = if D == 2 { 4 } else { 24 };
    // A wider support helps two free coordinates.
    const ACROSS: f64 = 3.0 / 4.0;
    const KEEPS_NEAR_EDGE: bool = false;

    /// Per record, the chance of the window that starts at its offset; and the typical chance.
    type AtDelta = (Vec<f32>, f32);

    fn at_delta(&self, delta: f32) -> (Vec<f32>, f32) {
        (window_chance(self.planes, &self.sorted, delta), self.typical_chance(delta))
    }

    /// The largest interquartile range over the axes.
    fn extent(&self) -> f64 {
        self.sorted.extent()
    }

    fn typical_chance(&self, delta: f32) -> f32 {
        self.sorted.typical_chance(delta)
    }

    fn limits(&self, share: f64) -> [f64; 2] {
        [0.5 * libm::pow(share, 0.5), libm::pow(share, 1.0)]
    }

    #[inline(always)]
    fn consensus(
        &self,
        slot: usize,
        listed: &[RecordId],
        (delta, at): (f32, &(Vec<f32>, f32)),
        scratch: &mut Scratch<D>,
    ) -> Estimate<D> {
        consensus::on_plane(self.planes, slot, listed, (delta, &at.0), &mut scratch.by_axis)
    }

    #[inline(always)]
    fn piece(&self, slot: usize, _: usize) -> Piece<D> {
        let (own, offset) = (self.axis(slot), self.planes.offset()[slot]);
        let at = |c: usize| if c == own { offset } else { 0.0 };
        let free = |r: usize| if r == own { [0.0; D] } else { unit(r) };
        let along = std::array::from_fn(free);
        Piece { along, ..Piece::line(std::array::from_fn(at), [0.0; D]) }
    }

    #[inline(always)]
    fn direction(&self, slot: usize, _: usize) -> [f32; D] {
        unit(self.axis(slot))
    }

    #[inline(always)]
    fn may_vote(&self, slot: usize, record: usize) -> bool {
        self.axis(slot) != self.axis(record)
    }

    #[inline(always)]
    fn record_distance2(&self, record: usize, x: &[f32; D]) -> f32 {
        let d = x[self.axis(record)] - self.planes.offset()[record];
        d * d
    }

    #[inline(always)]
    fn record_chance(&self, _: usize, _: &[f32; D], at: &(Vec<f32>, f32)) -> f32 {
        at.1
    }
}

/// Axis candidates: published points of which one coordinate is foreign.
pub(crate) struct CandidateFamily<'a, const D: usize> {
    pub(crate) rows: &'a [[f32; D]],
    pub(crate) chance: CandidateField<D>,
}

/// Chance at the least delta, as a multiple of the fraction of all records in one list: if points lie on surfaces, one line passes as close
/// as neighbors are with that probability, and a record has three lines.
const LEAST_CHANCE: f64 = 3.0;
/// Upper bound of that chance, for lists with a large fraction of all records.
const MOST_LEAST_CHANCE: f64 = 0.25;
/// Least delta in flat maps, as a fraction of the radius that holds a list's neighbors.
const LEAST_OF_FLAT: f64 = 0.5;

impl<'a, const D: usize> CandidateFamily<'a, D> {
    pub(crate) fn new(rows: &'a [[f32; D]], lists: &Neighborhoods) -> Self {
        Self { rows, chance: chance::of_candidates(rows, lists) }
    }
}

impl<const D: usize> Family<D> for CandidateFamily<'_, D> {
    const PIECES: usize = D;
    // Delta is narrower in images.
    const MOST_RADIUS: f32 = if D == 2 { 3.0 } else { 0.95 };
    // In an image, both lines of a record cross the whole plane, so random records agree more often.
    const TOO_WIDE: f32 = if D == 2 { 0.12 } else { 0.04 };
    const KEEPS_TO_LIMIT: bool = D == 2;
    const RERUNS: usize = if D == 2 { 2 } else { 0 };

    /// Per axis, the volume per length of a tube of radius delta within the map.
    type AtDelta = [f32; D];

    fn at_delta(&self, delta: f32) -> [f32; D] {
        self.chance.tubes(delta)
    }

    /// The largest interquartile range over the axes.
    fn extent(&self) -> f64 {
        let range = |axis: usize| {
            let mut column: Vec<f32> = self.rows.iter().map(|row| row[axis]).collect();
            column.sort_unstable_by(f32::total_cmp);
            interquartile_range(&column)
        };
        (0..D).map(range).fold(0.0, f64::max)
    }

    fn typical_chance(&self, delta: f32) -> f32 {
        self.chance.typical_chance(delta)
    }

    fn radius_if_flat(&self, share: f64) -> Option<f64> {
        self.chance.radius_if_flat(share)
    }

    fn least_delta(&self, share: f64) -> f64 {
        let least = (LEAST_CHANCE * share).min(MOST_LEAST_CHANCE) as f32;
        // Chance grows with delta: bisect to more than 32 bits.
        let (mut below, mut above) = (0.0, self.extent());
        for _ in 0..48 {
            let middle = 0.5 * (below + above);
            if self.typical_chance(middle as f32) < least {
                below = middle;
            } else {
                above = middle;
            }
        }
        let of_flat = self.radius_if_flat(share).map_or(0.0, |radius| LEAST_OF_FLAT * radius);
        f64::max(above, of_flat)
    }

    #[inline(always)]
    fn prefetch(&self, record: usize) {
        prefetch(self.rows, record);
    }

    #[inline(always)]
    fn consensus(
        &self,
        slot: usize,
        listed: &[RecordId],
        at: (f32, &[f32; D]),
        scratch: &mut Scratch<D>,
    ) -> Estimate<D> {
        scratch.candidates.fill(listed, |record| self.rows[record.index()]);
        consensus::on_candidates(&self.rows[slot], &self.chance, at, scratch)
    }

    #[inline(always)]
    fn piece(&self, slot: usize, piece: usize) -> Piece<D> {
        Piece::line(self.rows[slot], unit(piece))
    }

    #[inline(always)]
    fn direction(&self, _: usize, piece: usize) -> [f32; D] {
        unit(piece)
    }

    #[inline(always)]
    fn record_distance2(&self, record: usize, x: &[f32; D]) -> f32 {
        let (mut sum, mut largest) = (0.0f32, 0.0f32);
        for (x, published) in x.iter().zip(&self.rows[record]) {
            let d = x - published;
            sum += d * d;
            largest = largest.max(d * d);
        }
        (sum - largest).max(0.0)
    }

    #[inline(always)]
    fn record_chance(&self, _: usize, x: &[f32; D], tubes: &[f32; D]) -> f32 {
        self.chance.at(x, tubes)
    }
}
