//! Families of records behind one trait: feasible sets as flat pieces, distances to records, and chance.

use crate::RecordId;
use crate::recover::map::lines::{LineRow, Scratch};
use crate::recover::map::places::distance2;
use crate::recover::result::Estimate;

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
    /// Length in that direction.
    pub(crate) to: f32,
    /// Whether the piece is a ray: a point near `through` is near all rays of that center.
    pub(crate) from_center: bool,
}

impl<const D: usize> Piece<D> {
    #[inline(always)]
    pub(crate) fn line(through: [f32; D], direction: [f32; D]) -> Self {
        let along = std::array::from_fn(|r| std::array::from_fn(|c| direction[r] * direction[c]));
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

/// Records of one family: where a point of theirs may be, how near they pass to a place, and how likely that is by chance. All steps are
/// generic over it, so that no step depends on a family.
pub(crate) trait Family<const D: usize>: Sync {
    /// Number of pieces of each feasible set.
    const PIECES: usize = 1;
    /// Whether pieces are planes with a normal, not lines with a direction.
    const NORMAL: bool = false;

    // Joint recovery.

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

    /// How often joint recovery runs again from exact coordinates. This improves images. On maps it gains 0.2 points and takes half as
    /// long again.
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
    /// Whether a narrow delta stays near the lower edge of the plateau. In an image, lines cross everywhere, so that this edge is
    /// noise.
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
    /// Returns two limits on chance for maps in which a list holds the fraction `share` of all records: a delta with less chance than
    /// the first is never too wide, and one with less than the second is too narrow.
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
    /// Returns the least delta of a map in which a list holds the fraction `share` of all records; 0 without a limit.
    fn least_delta(&self, _share: f64) -> f64 {
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
