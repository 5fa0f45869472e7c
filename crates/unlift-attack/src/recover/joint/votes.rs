//! Estimates at the ends of a slot's edges, in columns, and their likelihood for a place.

use crate::recover::map::{
    CLASSES, Columns, Graph, LANES, Lanes, Piece, Side, distance2, ln, side,
};
use crate::recover::result::Estimate;

/// Coordinate of padding: beyond any reach, and finite when squared.
const PADDING_COORDINATE: f32 = 1e19;

/// Estimates farther from a piece than this many radii are ignored.
pub(super) const TUBE: f32 = 6.0;
/// Estimates within this many radii of the center of a ray are ignored: they are close to all its rays, so that a few draw many slots.
const CENTER_RADIUS: f32 = 3.0;

/// Odds that the edges of a slot lead to true neighbors of this slot.
pub(super) struct Odds<'a, const D: usize> {
    pub(super) of_class: &'a [f32; CLASSES],
    /// Place of the other slot of a paired line, and the distribution of neighbors there.
    pub(super) partner: Option<([f32; D], (f32, f32))>,
}

/// The estimates at the ends of a slot's edges, in columns.
#[derive(Default)]
pub(super) struct Ends<const D: usize> {
    x: Columns<D>,
    slot: Vec<u32>,
    class: Vec<u8>,
    /// Buffers: squared distances to a piece, and the rows near it.
    apart2: Vec<f32>,
    kept: Vec<u32>,
}

impl<const D: usize> Ends<D> {
    /// Gathers the estimates at the ends of the edges of `slot`; both estimates of a record where the edge does not specify the slot.
    #[inline(always)]
    pub(super) fn gather(&mut self, graph: &Graph, slot: usize, estimates: &[Estimate<D>]) {
        let room = graph.slots_per_target * graph.of(slot).len();
        self.resize(room);
        let columns = self.x.0.each_mut().map(|column| &mut column[..room]);
        let (slots, classes) = (&mut self.slot[..room], &mut self.class[..room]);
        let mut n = 0;
        for (end, class) in graph.of(slot) {
            let mut set = |i: usize, slot: usize| {
                let x = estimates[slot].position;
                for c in 0..D {
                    columns[c][i] = x[c];
                }
                (slots[i], classes[i]) = (slot as u32, class);
            };
            set(n, end);
            if graph.slots_per_target == 2 {
                // Always written; the next row overwrites it if it is not kept.
                set(n + 1, end | 1);
                n += usize::from(graph.is_either(class));
            }
            n += 1;
        }
        self.resize(n);
    }

    #[inline(always)]
    fn resize(&mut self, n: usize) {
        self.x.resize(n, 0.0);
        self.slot.resize(n, 0);
        self.class.resize(n, 0);
    }

    pub(super) fn len(&self) -> usize {
        self.slot.len()
    }

    /// Copies the estimates near `piece` to `near`, except those at the center of a ray. `radius` is that of true neighbors.
    #[inline(always)]
    pub(super) fn near(
        &mut self,
        piece: &Piece<D>,
        radius: f32,
        odds: &Odds<'_, D>,
        near: &mut Near<D>,
    ) {
        let (reach, center_radius) = (TUBE * radius, CENTER_RADIUS * radius);
        let n = self.slot.len();
        self.apart2.resize(n, 0.0);
        let columns = self.x.first(n);
        let apart2 = &mut self.apart2[..n];
        for i in 0..n {
            let x: [f32; D] = std::array::from_fn(|c| columns[c][i]);
            // A lost estimate is not near, because its distance is no number.
            apart2[i] = distance2(&x, &piece.project(&x));
        }
        if piece.from_center {
            for i in 0..n {
                let d2 = distance2(&std::array::from_fn(|c| columns[c][i]), &piece.through);
                apart2[i] =
                    if d2 < center_radius * center_radius { f32::INFINITY } else { apart2[i] };
            }
        }
        // Every index is written and kept only if it is near, without a branch.
        self.kept.resize(n, 0);
        let (kept, mut n_kept) = (&mut self.kept[..n], 0);
        for (i, apart2) in apart2.iter().enumerate() {
            kept[n_kept] = i as u32;
            n_kept += usize::from(*apart2 < reach * reach);
        }
        near.resize(n_kept, 0.0);
        near.slot.resize(n_kept, 0);
        for (to, &i) in kept[..n_kept].iter().enumerate() {
            let (i, class) = (i as usize, self.class[i as usize]);
            near.x.0.iter_mut().zip(columns).for_each(|(near, column)| near[to] = column[i]);
            near.odds[to] = odds.of_class[usize::from(class)];
            (near.side[to], near.slot[to]) = (side(class), self.slot[i]);
        }
        // Reverse edges may belong to the other slot of the record: the better its place explains them.
        if let Some((partner, (gain, inverse_a2))) = odds.partner {
            let columns = near.x.first(n_kept);
            let (odds, side) = (&mut near.odds[..n_kept], &near.side[..n_kept]);
            for i in 0..n_kept {
                let r2 = distance2(&partner, &std::array::from_fn(|c| columns[c][i]));
                let q = 1.0 / (1.0 + r2 * inverse_a2);
                let may_be_partner = if side[i] == Side::Reverse { 1.0 } else { 0.0 };
                odds[i] /= 1.0 + may_be_partner * odds[i] * gain * q * q * q;
            }
        }
        near.resize(n_kept.next_multiple_of(LANES), PADDING_COORDINATE);
    }
}

/// Estimates near a piece, and the odds that each is a true neighbor's, in columns.
#[derive(Default)]
pub(super) struct Near<const D: usize> {
    /// Padded to whole vectors with rows of no effect, as are `odds` and `side`.
    pub(super) x: Columns<D>,
    pub(super) odds: Vec<f32>,
    side: Vec<Side>,
    pub(super) slot: Vec<u32>,
}

impl<const D: usize> Near<D> {
    /// Resizes the padded columns to `n` rows; new ones are at coordinate `x` and without odds.
    #[inline(always)]
    fn resize(&mut self, n: usize, x: f32) {
        self.x.resize(n, x);
        self.odds.resize(n, 0.0);
        self.side.resize(n, Side::Mutual);
    }

    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.slot.len()
    }

    #[inline(always)]
    pub(super) fn at(&self, i: usize) -> [f32; D] {
        std::array::from_fn(|c| self.x.0[c][i])
    }

    /// Counts the records with an estimate within `1 / sqrt(inverse_reach2)` of `x`. Records have two slots, in adjacent rows.
    #[inline(always)]
    pub(super) fn n_pairs(&self, x: &[f32; D], inverse_reach2: f32) -> u32 {
        let n = self.len();
        let columns = self.x.first(n);
        let is_near = |i: usize| {
            let d2 = distance2(&std::array::from_fn(|c| columns[c][i]), x);
            u32::from(1.0 - d2 * inverse_reach2 > 0.0)
        };
        // Two sums without branches, which are vectorized.
        let slots: u32 = (0..n).map(is_near).sum();
        let is_pair = |i: usize| u32::from(self.slot[i] ^ 1 == self.slot[i - 1]);
        let pairs: u32 = (1..n).map(|i| is_near(i - 1) & is_near(i) & is_pair(i)).sum();
        slots - pairs
    }

    /// Returns the log-likelihood ratio, against chance, of these estimates for a point at `x`:
    /// the sum of `ln(1 + odds * gain * (1 + r^2 / a^2)^-3)`.
    #[inline(always)]
    pub(super) fn log_likelihood(&self, x: &[f32; D], distribution: (f32, f32)) -> f32 {
        let mut sums = [0.0f32; LANES];
        let likelier = self.likelier(x, distribution);
        let n = self.odds.len() / LANES;
        // One logarithm for the product of two ratios, which stays within the range of `f32`.
        for i in 0..n / 2 {
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum += ln(likelier(2 * i, lane) * likelier(2 * i + 1, lane));
            }
        }
        if n % 2 == 1 {
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum += ln(likelier(n - 1, lane));
            }
        }
        sums.iter().sum()
    }

    /// Returns the log-likelihood ratio without that by which forward and reverse edges differ by more than the bound plus mutual ones.
    #[inline(always)]
    pub(super) fn balanced_log_likelihood(
        &self,
        x: &[f32; D],
        distribution: (f32, f32),
        most_imbalance: f32,
    ) -> f32 {
        let mut sums = [[0.0f32; LANES]; 3];
        let likelier = self.likelier(x, distribution);
        for (i, side) in self.side.as_chunks::<LANES>().0.iter().enumerate() {
            for lane in 0..LANES {
                let nats = ln(likelier(i, lane));
                sums[0][lane] += nats;
                sums[1][lane] += if side[lane] == Side::Forward { nats } else { 0.0 };
                sums[2][lane] += if side[lane] == Side::Reverse { nats } else { 0.0 };
            }
        }
        let [all, forward, reverse]: [f32; 3] = sums.map(|lanes| lanes.iter().sum());
        let of_both = all - forward - reverse;
        all - ((forward - reverse).abs() - of_both - most_imbalance).max(0.0)
    }

    /// Returns the likelihood ratio of the estimate in a lane of a vector for a point at `x`.
    #[inline(always)]
    fn likelier(
        &self,
        x: &[f32; D],
        (gain, inverse_a2): (f32, f32),
    ) -> impl Fn(usize, usize) -> f32 + '_ {
        let (odds, _) = self.odds.as_chunks::<LANES>();
        let columns: [&[Lanes]; D] =
            std::array::from_fn(|c| &self.x.0[c].as_chunks().0[..odds.len()]);
        let x = *x;
        move |i: usize, lane: usize| {
            let r2 = distance2(&std::array::from_fn(|c| columns[c][i][lane]), &x);
            let q = 1.0 / (1.0 + r2 * inverse_a2);
            1.0 + odds[i][lane] * gain * (q * q * q)
        }
    }
}
