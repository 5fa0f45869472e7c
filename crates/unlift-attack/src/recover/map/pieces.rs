//! Feasible sets of slots as flat pieces: the only part of joint recovery that depends on the record family.

use crate::recover::map::chance::{CandidateField, ChanceField, tube};
use crate::recover::map::family::Settings;
use crate::recover::map::graph::record_of;
use crate::recover::map::lines::{LineRow, ln};
use crate::recover::map::planes::SortedPlanes;
use crate::released::AxisPlanes;

/// A flat piece of a feasible set: a line, a chord, a half-line or a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const D: usize> {
    /// A point of the piece; the end of a half-line.
    pub(crate) through: [f32; D],
    /// Projection matrix onto the directions of the piece.
    pub(crate) along: [[f32; D]; D],
    /// Direction of a half-line or a chord; zero for other pieces.
    sense: [f32; D],
    /// Length in that direction.
    to: f32,
    /// Whether the piece is a ray: a point near `through` is near all rays of that center.
    pub(crate) from_center: bool,
}

impl<const D: usize> Piece<D> {
    fn line(through: [f32; D], direction: [f32; D]) -> Self {
        let along = std::array::from_fn(|r| std::array::from_fn(|c| direction[r] * direction[c]));
        Self { through, along, sense: [0.0; D], to: f32::INFINITY, from_center: false }
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

/// The feasible sets of a map, and constants of joint recovery that depend on the family.
pub(crate) trait Pieces<const D: usize>: Sync {
    const PER_SLOT: usize = 1;
    /// Whether pieces are planes with a normal, not lines with a direction.
    const NORMAL: bool = false;
    /// Largest weight of an estimate along its own piece in least squares, relative to 1 across it.
    const MOST_ALONG: f32 = 0.25;
    /// With `n` estimates, the weight along the own piece is at most `ALONG / n`.
    const ALONG: f32 = 2.0;
    /// In least squares, an estimate has half weight at this likelihood ratio of a true neighbor against chance.
    const HALF_WEIGHT_RATIO: f32 = 1.0;
    /// Whether wrong entries of the same region count as background and not as true neighbors: along a line they would draw a place
    /// into the middle of its region. Planes and candidates keep them, because a neighbor fixes few coordinates and more are better.
    const SUBTRACTS_BACKGROUND: bool = false;
    /// Largest radius of the distribution of neighbors, in deltas. Without it, the radius would grow where most estimates are wrong.
    const MOST_RADIUS: f32 = 0.95;

    fn slots_per_record(&self) -> usize {
        1
    }
    fn piece(&self, slot: usize, piece: usize) -> Piece<D>;
    /// Returns the unit direction of a piece, or its normal.
    fn direction(&self, slot: usize, piece: usize) -> [f32; D];
    /// Whether a record near a place is evidence for a point of `slot`.
    fn may_vote(&self, slot: usize, record: usize) -> bool;
    /// Returns the squared distance from `x` to the feasible set of `record`.
    fn record_distance2(&self, record: usize, x: &[f32; D]) -> f32;
    /// Returns the chance that a random record that may vote for `slot` passes within delta of `x`.
    fn record_chance(&self, slot: usize, x: &[f32; D]) -> f32;
    /// Returns the logarithm of the range prior at `x`, `p_range` of joint recovery; 0 where the prior is uniform.
    #[inline(always)]
    fn ln_spread(&self, _: usize, _: &[f32; D]) -> f32 {
        0.0
    }
}

pub(crate) struct LinePieces<'a, const D: usize> {
    rows: &'a [LineRow<D>],
    slots_per_record: usize,
    chance: &'a [ChanceField<D>],
    tube: f32,
    /// Whether these are rays whose centers have regions.
    anchored: bool,
}

/// Least range in the range prior, as a fraction of the ray.
const LEAST_RANGE: f32 = 1e-3;

impl<'a, const D: usize> LinePieces<'a, D> {
    pub(crate) fn new(
        rows: &'a [LineRow<D>],
        slots_per_record: usize,
        (chance, anchored): (&'a [ChanceField<D>], bool),
        delta: f32,
    ) -> Self {
        Self { rows, slots_per_record, chance, tube: tube(D, delta), anchored }
    }

    #[inline(always)]
    fn own(&self, slot: usize) -> &LineRow<D> {
        &self.rows[record_of(slot, self.slots_per_record)]
    }
}

impl<const D: usize> Pieces<D> for LinePieces<'_, D> {
    const MOST_ALONG: f32 = 0.35;
    const ALONG: f32 = 50.0;
    const SUBTRACTS_BACKGROUND: bool = true;

    fn slots_per_record(&self) -> usize {
        self.slots_per_record
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
        let away: [f32; D] = std::array::from_fn(|c| x[c] - row.through[c]);
        let t = row.clamp(away.iter().zip(&row.direction).map(|(a, d)| a * d).sum());
        away.iter().zip(&row.direction).map(|(a, d)| (a - t * d) * (a - t * d)).sum()
    }

    #[inline(always)]
    fn record_chance(&self, slot: usize, x: &[f32; D]) -> f32 {
        let own = self.own(slot);
        let field = &self.chance[if own.is_ray() { own.group as usize } else { 0 }];
        field.at(x, self.tube)
    }

    // Points are uniform over the region and rays diverge, so the prior grows with the range. Without it, estimates drift to where all
    // bearings meet.
    #[inline(always)]
    fn ln_spread(&self, slot: usize, x: &[f32; D]) -> f32 {
        if !self.anchored {
            return 0.0;
        }
        let own = self.own(slot);
        let t: f32 = (0..D).map(|c| (x[c] - own.through[c]) * own.direction[c]).sum();
        (D - 1) as f32 * ln((t / own.to).max(LEAST_RANGE))
    }
}

#[inline(always)]
fn unit<const D: usize>(axis: usize) -> [f32; D] {
    std::array::from_fn(|c| if c == axis { 1.0 } else { 0.0 })
}

pub(crate) struct PlanePieces<'a, const D: usize> {
    planes: &'a AxisPlanes<D>,
    chance: f32,
}

impl<'a, const D: usize> PlanePieces<'a, D> {
    pub(crate) fn new(planes: &'a AxisPlanes<D>, sorted: &SortedPlanes, delta: f32) -> Self {
        Self { planes, chance: sorted.typical_chance(delta) }
    }

    #[inline(always)]
    fn axis(&self, record: usize) -> usize {
        usize::from(self.planes.axis()[record])
    }
}

impl<const D: usize> Pieces<D> for PlanePieces<'_, D> {
    const NORMAL: bool = true;
    // Two coordinates are free: where few neighbors are true, their estimates are the only evidence.
    const HALF_WEIGHT_RATIO: f32 = 0.2;

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
        self.planes.axis()[slot] != self.planes.axis()[record]
    }

    #[inline(always)]
    fn record_distance2(&self, record: usize, x: &[f32; D]) -> f32 {
        let d = x[self.axis(record)] - self.planes.offset()[record];
        d * d
    }

    #[inline(always)]
    fn record_chance(&self, _: usize, _: &[f32; D]) -> f32 {
        self.chance
    }
}

pub(crate) struct CandidatePieces<'a, const D: usize> {
    rows: &'a [[f32; D]],
    chance: &'a CandidateField<D>,
    tubes: [f32; D],
}

impl<'a, const D: usize> CandidatePieces<'a, D> {
    pub(crate) fn new(rows: &'a [[f32; D]], chance: &'a CandidateField<D>, delta: f32) -> Self {
        Self { rows, chance, tubes: chance.tubes(delta) }
    }
}

impl<const D: usize> Pieces<D> for CandidatePieces<'_, D> {
    const PER_SLOT: usize = D;
    const MOST_RADIUS: f32 = Settings::of_dimension::<D>().most_radius_of_candidates;

    #[inline(always)]
    fn piece(&self, slot: usize, piece: usize) -> Piece<D> {
        Piece::line(self.rows[slot], unit(piece))
    }

    #[inline(always)]
    fn direction(&self, _: usize, piece: usize) -> [f32; D] {
        unit(piece)
    }

    #[inline(always)]
    fn may_vote(&self, _: usize, _: usize) -> bool {
        true
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
    fn record_chance(&self, _: usize, x: &[f32; D]) -> f32 {
        self.chance.at(x, &self.tubes)
    }
}
