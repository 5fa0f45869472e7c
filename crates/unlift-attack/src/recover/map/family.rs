//! Families of records: the trait that all steps are generic over, and lines with rays, axis planes and axis candidates.

use crate::RecordId;
use crate::geometry::vector::median;
use crate::neighbors::Neighborhoods;
use crate::recover::map::chance::{
    self, CELLS, ChanceField, are_in_parts, interquartile_range, line_extent, ray_extent,
    times_listed, tube,
};
use crate::recover::map::graph::record_of;
use crate::recover::map::grid::Grid;
use crate::recover::map::lines::{LineRow, MOST_CHANCE, Scratch, evidence, ln, rows_of};
use crate::recover::map::places::{distance2, evenly, sorted, trimmed_box, unit};
use crate::recover::result::{Estimate, Status};
use crate::released::{AxisPlanes, Released};
use crate::simd::prefetch;

/// A flat piece of a feasible set: a line, a chord, a half-line or a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const D: usize> {
    /// A point of the piece; the end of a half-line.
    pub(crate) through: [f32; D],
    /// Unit direction of the piece; of a plane, its normal.
    pub(crate) direction: [f32; D],
    /// Projection matrix onto the directions of the piece.
    pub(crate) along: [[f32; D]; D],
    /// Direction of a half-line or a chord; zero for other pieces.
    pub(crate) sense: [f32; D],
    pub(crate) to: f32,
    /// Whether the piece is a ray: a point near `through` is near all rays of that center.
    pub(crate) from_center: bool,
}

impl<const D: usize> Piece<D> {
    #[inline(always)]
    pub(crate) fn line(through: [f32; D], direction: [f32; D]) -> Self {
        let along = direction.map(|r| direction.map(|c| r * c));
        let (sense, to) = ([0.0; D], f32::INFINITY);
        Self { through, direction, along, sense, to, from_center: false }
    }

    /// Returns the point of the piece nearest to `x`.
    #[inline(always)]
    pub(crate) fn project(&self, x: &[f32; D]) -> [f32; D] {
        let away: [f32; D] = std::array::from_fn(|c| x[c] - self.through[c]);
        let distance: f32 = away.iter().zip(&self.sense).map(|(a, s)| s * a).sum();
        let keep = if distance < 0.0 { 0.0 } else { 1.0 };
        let keep = if distance > self.to { self.to / distance } else { keep };
        std::array::from_fn(|r| {
            let moved: f32 = away.iter().zip(&self.along[r]).map(|(a, along)| along * a).sum();
            self.through[r] + keep * moved
        })
    }
}

/// Records of one family: where a point of theirs may be, how near they pass to a place, and how likely that is by chance.
pub(crate) trait Family<const D: usize>: Sync {
    const PIECES: usize = 1;
    /// Whether pieces are planes with a normal, not lines with a direction.
    const IS_PLANE: bool = false;

    // Joint recovery.

    /// Largest weight of an estimate along its own piece in least squares, relative to 1 across it.
    const MOST_ALONG: f32 = 0.25;
    /// With `n` estimates, the weight along the own piece is at most `ALONG / n`.
    const ALONG: f32 = 2.0;
    /// In least squares, an estimate has half weight at this likelihood ratio of a true neighbor against chance.
    const HALF_WEIGHT_RATIO: f32 = 1.0;
    /// Largest radius of the distribution of neighbors, in deltas. Without it, the radius would grow where most estimates are wrong.
    const MOST_RADIUS: f32 = 0.95;

    /// How often joint recovery runs again from exact coordinates, which improves images.
    const RERUNS: usize = 0;

    // The choice of delta.

    /// Chunks of slots that are solved per delta to choose it. Fewer in images, where this takes most of the time.
    const DELTA_CHUNKS: usize = if D == 2 { 4 } else { 12 };
    /// A delta is too wide if a random record agrees with a typical place with this probability.
    const TOO_WIDE: f32 = 0.04;
    /// Whether that limit also holds for the fine ladder.
    const KEEPS_TO_LIMIT: bool = false;
    /// Position of the narrow choice on the plateau, as a fraction of its logarithmic width: the very edge is noisy.
    const ACROSS: f64 = 1.0 / 3.0;
    /// Whether a narrow delta stays near the lower edge of the plateau. In an image, that edge is noise.
    const KEEPS_NEAR_EDGE: bool = D != 2;

    /// What consensus and joint recovery compute once for a delta.
    type AtDelta: Sync;

    fn at_delta(&self, delta: f32) -> Self::AtDelta;
    /// Returns rays whose centers have regions. Such rays of one center meet only there, and rays of two centers do not meet.
    fn anchored(&self) -> Option<&[LineRow<D>]> {
        None
    }
    /// Returns a length of the order of the map's size, from the records alone; 0 for an empty map.
    fn extent(&self) -> f64;
    /// Returns the chance that a random record passes within `delta` of a typical place.
    fn typical_chance(&self, delta: f32) -> f32;
    /// Returns two limits on chance, if a list holds the fraction `share` of all records: of a delta never too wide, and of one too narrow.
    ///
    /// Neighbors then lie in a ball that holds this fraction of the map. A random line passes through it with probability `share^(2/3)` if
    /// points fill space and `share^2` if they lie on a curve; a random plane with `share^(1/3)` and `share`.
    fn limits(&self, share: f64) -> [f64; 2] {
        [libm::pow(share, 2.0 / 3.0), libm::pow(share, 2.0)]
    }
    /// In a flat map, returns the radius about a place that holds the fraction `share` of the points; `None` for other maps.
    fn radius_if_flat(&self, _share: f64) -> Option<f64> {
        None
    }
    /// Returns the likely delta of a map in which a list holds the fraction `share` of all records; 0 without a limit.
    fn likely_delta(&self, _share: f64) -> f64 {
        0.0
    }
    /// Loads a record that is read soon; changes no result.
    #[inline(always)]
    fn prefetch(&self, _record: usize) {}
    /// Returns the estimate of consensus for `slot`, from the records `listed`.
    fn consensus(
        &self,
        slot: usize,
        listed: &[RecordId],
        at: (f32, &Self::AtDelta),
        scratch: &mut Scratch<D>,
    ) -> Estimate<D>;
    fn piece(&self, slot: usize, piece: usize) -> Piece<D>;
    /// Whether any piece of the feasible set of `slot` passes `x` within a squared distance.
    #[inline(always)]
    fn is_near(&self, slot: usize, x: &[f32; D], within2: f32) -> bool {
        let is_near = |piece| distance2(&self.piece(slot, piece).project(x), x) < within2;
        (0..Self::PIECES).any(is_near)
    }
    /// Whether a record near a place is evidence for a point of `slot`.
    #[inline(always)]
    fn may_vote(&self, _slot: usize, _record: usize) -> bool {
        true
    }
    /// Returns the squared distance from `x` to the feasible set of `record`.
    fn record_distance2(&self, record: usize, x: &[f32; D]) -> f32;
    /// Returns the chance that a random record that may vote for `slot` passes within delta of `x`.
    fn record_chance(&self, slot: usize, x: &[f32; D], at: &Self::AtDelta) -> f32;
    /// Returns the logarithm of the range prior at `x`, `p_range` of joint recovery; 0 where the prior is uniform.
    #[inline(always)]
    fn ln_spread(&self, _slot: usize, _x: &[f32; D]) -> f32 {
        0.0
    }
}

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
    pub(crate) fn new(released: &Released<D>, lists: &Neighborhoods) -> Self {
        let slots_per_record = released.slots_per_record();
        let bounds = released.bounds().map(|bounds| bounds.about(&released.origin()));
        let rows = rows_of(released, bounds.as_ref());
        let chance = chance::of_lines(&rows, lists, slots_per_record);
        let anchored = released.obfuscation().rays().is_some_and(|rays| rays.regions().is_some());
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
    fn field(&self, own: &LineRow<D>) -> &ChanceField<D> {
        &self.chance[if own.is_ray() { own.group as usize } else { 0 }]
    }
}

impl<const D: usize> Family<D> for LineFamily<D> {
    const MOST_ALONG: f32 = 0.35;
    const ALONG: f32 = 50.0;

    /// The volume per length of a tube of radius delta.
    type AtDelta = f32;

    fn at_delta(&self, delta: f32) -> f32 {
        tube(D, delta)
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
        (delta, &tube): (f32, &f32),
        scratch: &mut Scratch<D>,
    ) -> Estimate<D> {
        let Scratch { lines, sections, intervals, .. } = scratch;
        let (own, delta2) = (self.own(slot), delta * delta);
        let may_vote = lines.sections(&self.rows, listed, own, sections);
        if sections.n_voting() < 2 {
            return Estimate::lost(Status::not_fixed(may_vote));
        }
        let limits = (delta2, own.floor(), own.to);
        let Some(peak) = intervals.peak(sections, limits, may_vote, |t, cells, chance| {
            self.field(own).add_along((&own.through, &own.direction), t, tube, (cells, chance));
        }) else {
            return Estimate::lost(Status::NoSupport);
        };
        let (t, support) = sections.refit(peak.t, delta2);
        Estimate::at(own.at(own.clamp(t)), support, 0, peak.evidence)
    }

    #[inline(always)]
    fn piece(&self, slot: usize, _: usize) -> Piece<D> {
        let own = self.own(slot);
        let sense = if own.floor() == 0.0 { own.direction } else { [0.0; D] };
        let line = Piece::line(own.through, own.direction);
        Piece { sense, to: own.to, from_center: own.is_ray(), ..line }
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

    // Points are uniform and rays diverge, so the prior grows with the range. Without it, estimates drift to where all bearings meet.
    #[inline(always)]
    fn ln_spread(&self, slot: usize, x: &[f32; D]) -> f32 {
        if !self.anchored {
            return 0.0;
        }
        let own = self.own(slot);
        (D - 1) as f32 * ln((own.along(x) / own.to).max(LEAST_RANGE))
    }
}

/// Axis planes. Each free coordinate is solved on its own, as the densest window of offsets.
pub(crate) struct PlaneFamily<'a, const D: usize> {
    pub(crate) planes: &'a AxisPlanes<D>,
    by_axis: [SortedPlanes; D],
}

struct SortedPlanes {
    order: Vec<u32>,
    quartiles: f64,
    /// Sorted offsets if the map has separate parts along this axis, else empty.
    in_parts: Vec<f32>,
}

/// Half width of the final mean in deltas. The window is already sharp, and a wider mean is more stable.
const REFIT: f32 = 1.5;

impl SortedPlanes {
    fn new<const D: usize>(planes: &AxisPlanes<D>, axis: usize) -> Self {
        let offset = |record: u32| planes.offset()[record as usize];
        let of_axis = (0u32..).zip(planes.axis()).filter(|(_, of)| usize::from(**of) == axis);
        let mut order: Vec<u32> = of_axis.map(|(record, _)| record).collect();
        order.sort_unstable_by(|&a, &b| offset(a).total_cmp(&offset(b)).then(a.cmp(&b)));
        let offsets: Vec<f32> = order.iter().map(|&record| offset(record)).collect();
        let quartiles = interquartile_range(&offsets);
        let in_parts = if are_in_parts(&offsets) { offsets } else { Vec::new() };
        Self { order, quartiles, in_parts }
    }

    /// Returns the chance that a random plane of this axis passes within `delta` of a typical place.
    fn typical_chance(&self, delta: f32) -> f32 {
        let offsets = &self.in_parts;
        if offsets.is_empty() {
            // Half of the planes lie between the quartiles.
            return (f64::from(delta) / self.quartiles.max(f64::from(f32::MIN_POSITIVE))) as f32;
        }
        let share_around = |at: usize| {
            let low = offsets.partition_point(|&offset| offset < offsets[at] - delta);
            let high = offsets.partition_point(|&offset| offset <= offsets[at] + delta);
            (high - low) as f64 / offsets.len() as f64
        };
        let mut shares: Vec<f64> = evenly(offsets.len(), 1 << 10).map(share_around).collect();
        median(&mut shares) as f32
    }
}

impl<'a, const D: usize> PlaneFamily<'a, D> {
    pub(crate) fn new(planes: &'a AxisPlanes<D>) -> Self {
        Self { planes, by_axis: std::array::from_fn(|axis| SortedPlanes::new(planes, axis)) }
    }

    #[inline(always)]
    pub(crate) fn axis(&self, record: usize) -> usize {
        usize::from(self.planes.axis()[record])
    }

    pub(crate) fn gather(&self, listed: &[RecordId], by_axis: &mut Vec<Vec<(f32, RecordId)>>) {
        by_axis.resize_with(D, Vec::new);
        by_axis.iter_mut().for_each(Vec::clear);
        for &record in listed {
            by_axis[self.axis(record.index())].push((self.planes.offset()[record.index()], record));
        }
    }
}

impl<const D: usize> Family<D> for PlaneFamily<'_, D> {
    const IS_PLANE: bool = true;
    // Two coordinates are free: where few neighbors are true, their estimates are the only evidence.
    const HALF_WEIGHT_RATIO: f32 = 0.2;
    // Evidence hardly depends on delta, so that noise widens the plateau.
    const DELTA_CHUNKS: usize = if D == 2 { 4 } else { 24 };
    // A wider support helps two free coordinates.
    const ACROSS: f64 = 3.0 / 4.0;
    const KEEPS_NEAR_EDGE: bool = false;

    /// Per record, the chance that a random plane of its axis is in `[offset, offset + 2 delta]`, counted exactly; and the typical chance.
    type AtDelta = (Vec<f32>, f32);

    fn at_delta(&self, delta: f32) -> (Vec<f32>, f32) {
        let mut chance = vec![0.0; self.planes.axis().len()];
        for SortedPlanes { order, .. } in &self.by_axis {
            let offset = |at: usize| self.planes.offset()[order[at] as usize];
            let mut end = 0;
            for (start, &record) in order.iter().enumerate() {
                while end < order.len() && offset(end) <= offset(start) + 2.0 * delta {
                    end += 1;
                }
                chance[record as usize] = ((end - start) as f32 - 0.5) / (order.len() as f32 + 1.0);
            }
        }
        (chance, self.typical_chance(delta))
    }

    /// The largest interquartile range over the axes.
    fn extent(&self) -> f64 {
        self.by_axis.iter().map(|axis| axis.quartiles).fold(0.0, f64::max)
    }

    fn typical_chance(&self, delta: f32) -> f32 {
        self.by_axis.iter().map(|axis| axis.typical_chance(delta)).fold(0.5, f32::min)
    }

    fn limits(&self, share: f64) -> [f64; 2] {
        [0.5 * libm::pow(share, 0.5), libm::pow(share, 1.0)]
    }

    #[inline(always)]
    fn consensus(
        &self,
        slot: usize,
        listed: &[RecordId],
        (delta, (chance, _)): (f32, &(Vec<f32>, f32)),
        Scratch { by_axis, .. }: &mut Scratch<D>,
    ) -> Estimate<D> {
        self.gather(listed, by_axis);
        let own = self.axis(slot);
        let (mut position, mut support, mut evidence) = ([self.planes.offset()[slot]; D], 0, 0.0);
        for (axis, of_axis) in by_axis.iter_mut().enumerate().filter(|(axis, _)| *axis != own) {
            let Some(window) = best_window(of_axis, chance, delta) else {
                return Estimate::lost(Status::not_fixed(listed.len()));
            };
            position[axis] = window.0;
            support += window.1;
            evidence += window.2;
        }
        Estimate::at(position, support, 0, evidence)
    }

    #[inline(always)]
    fn piece(&self, slot: usize, _: usize) -> Piece<D> {
        let own = self.axis(slot);
        let mut through = [0.0; D];
        through[own] = self.planes.offset()[slot];
        let along = std::array::from_fn(|r| if r == own { [0.0; D] } else { unit(r) });
        Piece { along, ..Piece::line(through, unit(own)) }
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

/// Returns the window of width `2 delta` over the listed planes of one axis with the largest evidence plus prior: the mean of its offsets,
/// their number, and their evidence. `listed`, (offset, record), gets sorted; `chance` is that of a window from the offset of a record.
// Without inlining, consensus on planes takes half as long again.
#[inline(always)]
fn best_window(
    listed: &mut [(f32, RecordId)],
    chance: &[f32],
    delta: f32,
) -> Option<(f32, u32, f32)> {
    listed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best: Option<(f32, f32, usize, usize)> = None;
    let mut end = 0;
    for start in 0..listed.len() {
        while end < listed.len() && listed[end].0 <= listed[start].0 + 2.0 * delta {
            end += 1;
        }
        let p = chance[listed[start].1.index()];
        let evidence = evidence((end - start) as f32, listed.len() as f32, p);
        let score = evidence + ln(p);
        if best.is_none_or(|b| score > b.0) {
            best = Some((score, evidence, start, end));
        }
    }
    let (_, evidence, start, end) = best?;
    // Offsets are summed relative to the first, so that maps far from the origin lose no digits.
    let mean = |rows: &[(f32, RecordId)]| {
        rows[0].0 + rows.iter().map(|r| r.0 - rows[0].0).sum::<f32>() / rows.len() as f32
    };
    let first = mean(&listed[start..end]);
    let low = listed.partition_point(|r| r.0 < first - REFIT * delta);
    let high = listed.partition_point(|r| r.0 <= first + REFIT * delta);
    Some(match low < high {
        true => (mean(&listed[low..high]), (high - low) as u32, evidence),
        false => (first, (end - start) as u32, evidence),
    })
}

/// Axis candidates: published points of which one coordinate is foreign.
pub(crate) struct CandidateFamily<'a, const D: usize> {
    pub(crate) rows: &'a [[f32; D]],
    /// The density of the lines through published points along each axis.
    along: [ChanceField<D>; D],
}

impl<'a, const D: usize> CandidateFamily<'a, D> {
    pub(crate) fn new(rows: &'a [[f32; D]], lists: &Neighborhoods) -> Self {
        let counts = times_listed(lists, rows.len());
        let (low, high) = trimmed_box(rows);
        let weight: f32 = counts.iter().map(|&n| n as f32).sum();
        let along = std::array::from_fn(|axis| {
            let (mut low, mut high) = (low, high);
            (low[axis], high[axis]) = (0.0, 0.0);
            let mut grid = Grid::over(low, high, CELLS / 8);
            for (row, &n) in rows.iter().zip(&counts) {
                let cell = grid.index(row);
                // The grid has one cell along this axis, in which the line is as long as the cell.
                grid.values[cell] += n as f32 * grid.cell;
            }
            ChanceField::new(grid, weight)
        });
        Self { rows, along }
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
        std::array::from_fn(|axis| {
            let sides = self.along[axis].grid.sides();
            let across = (0..D).filter(|c| *c != axis);
            let share = across.map(|c| (sides[c] / (2.0 * delta)).min(1.0));
            tube(D, delta) * share.product::<f32>()
        })
    }

    /// The largest interquartile range over the axes.
    fn extent(&self) -> f64 {
        let column = |axis: usize| sorted(self.rows.iter().map(|row| row[axis]));
        let range = |axis: usize| interquartile_range(&column(axis));
        (0..D).map(range).fold(0.0, f64::max)
    }

    fn typical_chance(&self, delta: f32) -> f32 {
        let along = self.along.iter().zip(self.at_delta(delta));
        along.map(|(field, tube)| field.typical() * tube).sum()
    }

    fn radius_if_flat(&self, share: f64) -> Option<f64> {
        // Each field has no extent along its own axis.
        let side = |c: usize| f64::from(self.along[(c + 1) % D].grid.sides()[c]);
        let mut sides: [f64; D] = std::array::from_fn(side);
        sides.sort_unstable_by(f64::total_cmp);
        let [thin, middle, long] = sides[..] else { return None };
        let radius = (share * middle * long / std::f64::consts::PI).sqrt();
        // Flat: the radius of neighborhoods exceeds twice the thickness.
        (2.0 * thin < radius && 2.0 * radius <= middle).then_some(radius)
    }

    fn likely_delta(&self, share: f64) -> f64 {
        // If points lie on surfaces, one of the three lines of a record passes as close as neighbors with probability `share`.
        let least = (3.0 * share).min(0.25) as f32;
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
        let of_flat = self.radius_if_flat(share).map_or(0.0, |radius| 0.5 * radius);
        f64::max(above, of_flat)
    }

    /// Returns the best estimate on any axis line. Axes are compared by evidence: along a long axis, more records agree by chance.
    #[inline(always)]
    fn consensus(
        &self,
        slot: usize,
        listed: &[RecordId],
        (delta, tubes): (f32, &[f32; D]),
        scratch: &mut Scratch<D>,
    ) -> Estimate<D> {
        let Scratch { candidates, sections, intervals, .. } = scratch;
        candidates.fill(listed, |record| self.rows[record.index()]);
        if listed.len() < 2 {
            return Estimate::lost(Status::TooFewNeighbors);
        }
        let (own, delta2) = (self.rows[slot], delta * delta);
        let limits = (delta2, f32::NEG_INFINITY, f32::INFINITY);
        let mut best = Estimate::lost(Status::NoSupport);
        let mut best_score = f32::NEG_INFINITY;
        for axis in 0..D {
            candidates.sections(&own, axis, delta2, sections);
            let (mut through, direction) = (own, unit(axis));
            through[axis] = 0.0;
            let Some(peak) = intervals.peak(sections, limits, listed.len(), |t, cells, chance| {
                for (field, &tube) in self.along.iter().zip(tubes) {
                    field.add_along((&through, &direction), t, tube, (&mut *cells, &mut *chance));
                }
            }) else {
                continue;
            };
            if peak.score > best_score {
                best_score = peak.score;
                let (t, support) = sections.refit(peak.t, delta2);
                let mut position = own;
                position[axis] = t;
                best = Estimate::at(position, support, axis, peak.evidence);
            }
        }
        best
    }

    #[inline(always)]
    fn piece(&self, slot: usize, piece: usize) -> Piece<D> {
        Piece::line(self.rows[slot], unit(piece))
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
        let along = self.along.iter().zip(tubes);
        along.map(|(field, &tube)| field.at(x, tube)).sum::<f32>().min(MOST_CHANCE)
    }
}
