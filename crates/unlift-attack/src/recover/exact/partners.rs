//! Who may have exchanged a coordinate with whom: pairs of records that would explain each other.

use rayon::prelude::*;

use crate::geometry::curve;

/// Records whose partners are looked for by one thread at a time: a fixed number, so that sums do not depend on threads.
pub(super) const PART: usize = 1 << 10;
/// Partners looked at per record, as a mean over the records: time and memory stay linear in the map.
const MOST: f64 = 16.0;
/// Records on which the number of partners is counted: a mean needs no more.
const SAMPLE: usize = 1 << 12;
/// Partners looked at of one record, where a shorter reach does not make them few: coordinates that are equal (a floor at 0, a
/// few exact heights) would be partners each with each.
const MOST_OF_TIES: usize = 64;

/// Possible partners of every record: each pair from both sides.
pub(super) struct Partners {
    pub(super) offsets: Vec<usize>,
    /// The partner.
    pub(super) of: Vec<u32>,
    /// The place of the same pair among the entries of the partner.
    pub(super) back: Vec<u32>,
    /// Partners published farther from an estimate than this are not looked at.
    pub(super) reach: f32,
}

impl Partners {
    /// Pairs of `sides` on one axis whose estimates lie within `reach` of what the other published; a
    /// shorter reach where that would be too many. `None` if there are no such pairs.
    pub(super) fn find(sides: &[Side], axes: usize, reach: f32) -> Option<Self> {
        let wide = Strips::new(sides, axes, reach);
        let every = sides.len().div_ceil(SAMPLE).max(1);
        let mean = |strips: &Strips| {
            let looked: Vec<usize> = (0..sides.len()).step_by(every).collect();
            let found: usize = looked.par_iter().map(|&i| strips.of(sides, i).count()).sum();
            found as f64 / looked.len().max(1) as f64
        };
        // As many as there is area.
        let found = mean(&wide);
        let (strips, reach) = if found > MOST {
            let reach = reach * (MOST / found).sqrt() as f32;
            (Strips::new(sides, axes, reach), reach)
        } else {
            (wide, reach)
        };
        if found > MOST && mean(&strips) > MOST_OF_TIES as f64 {
            return Self::of_ties(sides, &strips, reach);
        }
        let rows: Vec<Vec<Vec<u32>>> = (0..sides.len().div_ceil(PART))
            .into_par_iter()
            .map(|part| {
                let records = part * PART..sides.len().min((part + 1) * PART);
                let row = |i: usize| {
                    let mut row: Vec<u32> = strips.of(sides, i).collect();
                    row.sort_unstable();
                    row
                };
                records.map(row).collect()
            })
            .collect();
        let mut offsets = Vec::with_capacity(sides.len() + 1);
        offsets.push(0);
        let mut of: Vec<u32> = Vec::new();
        for row in rows.iter().flatten() {
            of.extend(row);
            offsets.push(of.len());
        }
        Self::of_rows(offsets, of, reach)
    }

    /// Some of the partners of records that have very many: whom one of the two looks at.
    fn of_ties(sides: &[Side], strips: &Strips, reach: f32) -> Option<Self> {
        let both =
            |i: usize| strips.some_of(sides, i).flat_map(move |j| [(i as u32, j), (j, i as u32)]);
        let mut pairs: Vec<(u32, u32)> =
            (0..sides.len()).into_par_iter().flat_map_iter(both).collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        let mut offsets = vec![0; sides.len() + 1];
        for (i, _) in &pairs {
            offsets[*i as usize + 1] += 1;
        }
        for i in 0..sides.len() {
            offsets[i + 1] += offsets[i];
        }
        Self::of_rows(offsets, pairs.into_iter().map(|(_, j)| j).collect(), reach)
    }

    /// Rows in ascending order in which every pair stands twice.
    fn of_rows(offsets: Vec<usize>, of: Vec<u32>, reach: f32) -> Option<Self> {
        if of.is_empty() || of.len() > u32::MAX as usize {
            return None;
        }
        // Pairs stand in both rows and rows in ascending order: those of record j are met in their order.
        let mut next = offsets.clone();
        let mut back = vec![0; of.len()];
        for (e, &j) in of.iter().enumerate() {
            back[e] = next[j as usize] as u32;
            next[j as usize] += 1;
        }
        Some(Self { offsets, of, back, reach })
    }

    /// The entries of record `i`.
    pub(super) fn entries(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }
}

/// Records by axis, by what they publish in steps of the reach, and by estimate within a step.
struct Strips {
    /// (axis and step, estimate, record), sorted.
    rows: Vec<(u64, f32, u32)>,
    low: f64,
    reach: f64,
    /// A little more than the reach: rounding may not tell the two sides of a pair apart.
    step: f64,
}

/// Steps along one axis at most: with the axis above them they fit a sorting key.
const MOST_STEPS: f64 = (1u64 << 40) as f64;

impl Strips {
    fn new(sides: &[Side], axes: usize, reach: f32) -> Self {
        let known = || sides.iter().filter(|side| side.axis < axes);
        let low = known().map(|side| side.published.min(side.estimate)).fold(f32::MAX, f32::min);
        let (low, reach) = (f64::from(low), f64::from(reach));
        let mut strips = Self { rows: Vec::new(), low, reach, step: 1.01 * reach };
        strips.rows = sides
            .iter()
            .enumerate()
            .filter(|(_, side)| side.axis < axes)
            .map(|(i, side)| (strips.strip(side.axis, side.published), side.estimate, i as u32))
            .collect();
        strips.rows.par_sort_unstable_by(|a, b| {
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))
        });
        strips
    }

    fn strip(&self, axis: usize, value: f32) -> u64 {
        let steps = ((f64::from(value) - self.low) / self.step).min(MOST_STEPS);
        // One step below the lowest is looked at, too.
        (axis as u64) << 48 | (steps as u64 + 1)
    }

    /// The records of one step whose estimates are about what record `own` published, for each step about its estimate.
    fn about<'a>(&'a self, own: &Side) -> impl Iterator<Item = &'a [(u64, f32, u32)]> + use<'a> {
        let middle = own.is_known().then(|| self.strip(own.axis, own.estimate));
        let published = f64::from(own.published);
        let (low, high) = (published - self.step, published + self.step);
        let strips = middle.into_iter().flat_map(|middle| middle - 1..=middle + 1);
        strips.map(move |strip| {
            let from = self
                .rows
                .partition_point(|row| row.0 < strip || row.0 == strip && f64::from(row.1) < low);
            let rows = &self.rows[from..];
            &rows[..rows.partition_point(|row| row.0 == strip && f64::from(row.1) <= high)]
        })
    }

    /// Whether records `i` and `j` are possible partners.
    fn fit(&self, sides: &[Side], i: usize, j: usize) -> bool {
        let near = |a: f32, b: f32| (f64::from(a) - f64::from(b)).abs() <= self.reach;
        let (own, other) = (&sides[i], &sides[j]);
        near(other.published, own.estimate) && near(other.estimate, own.published) && j != i
    }

    /// The possible partners of record `i`.
    fn of<'a>(&'a self, sides: &'a [Side], i: usize) -> impl Iterator<Item = u32> + 'a {
        let rows = self.about(&sides[i]).flatten();
        rows.map(|row| row.2).filter(move |&j| self.fit(sides, i, j as usize))
    }

    /// Some of the possible partners of record `i`: a few of each set of equal values, and other ones for every record.
    fn some_of<'a>(&'a self, sides: &'a [Side], i: usize) -> impl Iterator<Item = u32> + 'a {
        let few = move |rows: &'a [(u64, f32, u32)]| {
            let n = rows.len().min(MOST_OF_TIES / 2);
            // Evenly over all, from a start of the record's own: an odd multiple meets every remainder.
            let start = i.wrapping_mul(0x9e37_79b9) % rows.len().max(1);
            (0..n).map(move |at| rows[(start + at * rows.len() / n) % rows.len()].2)
        };
        let rows = self.about(&sides[i]).flat_map(few);
        rows.filter(move |&j| self.fit(sides, i, j as usize))
    }
}

// The probability of every pair when each record is in at most one: belief propagation on the
// monomer-dimer model, one pass whenever the law is learned anew.
//
// Fixing sure pairs one by one would be final; here a rival of either side takes its share of
// every pair until the end.

/// Messages along pairs: `at[e]` is what the record of entry `e` tells the partner: how free it is.
pub(super) struct Messages {
    at: Vec<f32>,
    next: Vec<f32>,
}

impl Messages {
    pub(super) fn new(partners: &Partners) -> Self {
        let n = partners.of.len();
        Self { at: vec![0.5; n], next: vec![0.0; n] }
    }

    /// Sends every message once. `weight` is that of each pair (the same from both sides), `alone` that of each record
    /// without one.
    pub(super) fn send(&mut self, partners: &Partners, weight: &[f32], alone: &[f32]) {
        let at = &self.at;
        by_part(partners, &mut self.next).into_par_iter().for_each(|(part, out)| {
            let records = part * PART..alone.len().min((part + 1) * PART);
            let first = partners.offsets[records.start];
            for i in records {
                let entries = partners.entries(i);
                let offer = |e: usize| weight[e] * at[partners.back[e] as usize];
                let all: f32 = alone[i] + entries.clone().map(offer).sum::<f32>();
                for e in entries {
                    // Never below what is there without any offer.
                    out[e - first] = 1.0 / (all - offer(e)).max(alone[i]);
                }
            }
        });
        std::mem::swap(&mut self.at, &mut self.next);
    }

    /// The probability of the pair at entry `e`.
    #[inline(always)]
    pub(super) fn probability(&self, partners: &Partners, weight: &[f32], e: usize) -> f32 {
        // The product of both messages first: the same from both sides to the last bit.
        let odds = weight[e] * (self.at[e] * self.at[partners.back[e] as usize]);
        odds / (1.0 + odds)
    }
}

/// `column` cut at the parts of the records.
pub(super) fn by_part<'a, T>(
    partners: &Partners,
    mut column: &'a mut [T],
) -> Vec<(usize, &'a mut [T])> {
    let n = partners.offsets.len() - 1;
    let mut parts = Vec::with_capacity(n.div_ceil(PART));
    for part in 0..n.div_ceil(PART) {
        let (first, last) = (part * PART, n.min((part + 1) * PART));
        let (head, tail) = column.split_at_mut(partners.offsets[last] - partners.offsets[first]);
        parts.push((part, head));
        column = tail;
    }
    parts
}

// How far estimates lie from the hidden coordinate: learned from the pairs themselves.

/// Records are told apart by their evidence into this many classes of one size: the better founded, the nearer.
pub(super) const CLASSES: usize = 8;
/// Normal distributions that make up the law, each half as wide as the one before: down to 1 / 512 of the reach.
pub(super) const SCALES: usize = 9;
/// The share of good estimates in a class is at least and at most this: a share of 0 or 1 would never change again.
const SHARE: (f64, f64) = (0.02, 0.995);

/// Steps from 0 to the reach in which distances are counted: as fine as the narrowest distribution.
const STEPS: usize = 1 << 9;

/// Per class: the share of estimates that are near the hidden coordinate, and how near they are.
#[derive(Clone, Debug)]
pub(super) struct Law {
    good: [f64; CLASSES],
    weight: [[f64; SCALES]; CLASSES],
    /// The density of each scale in the middle of each step.
    shapes: Vec<[f64; SCALES]>,
    reach: f32,
    /// Density times share, per class and step.
    table: Vec<[f64; STEPS]>,
}

impl Law {
    /// Before anything is known; partners are looked for within `reach`.
    pub(super) fn new(reach: f32) -> Self {
        let weight = [[1.0 / SCALES as f64; SCALES]; CLASSES];
        let shape = |step: usize, scale: usize| {
            let away = (step as f64 + 0.5) / STEPS as f64;
            // In units of the reach; 1 / sqrt(2 pi).
            let inverse = f64::from(2u32 << scale);
            let z = away * inverse;
            0.398_942_280_4 * inverse / f64::from(reach) * libm::exp(-0.5 * z * z)
        };
        let shapes =
            (0..STEPS).map(|step| std::array::from_fn(|scale| shape(step, scale))).collect();
        let table = vec![[0.0; STEPS]; CLASSES];
        Self { good: [0.8; CLASSES], weight, shapes, reach, table }.tabulated()
    }

    /// The weighted density of each scale of `class` in the middle of a step.
    fn parts(&self, class: usize, step: usize) -> [f64; SCALES] {
        let shape = &self.shapes[step];
        std::array::from_fn(|s| shape[s] * self.weight[class][s])
    }

    fn tabulated(mut self) -> Self {
        for class in 0..CLASSES {
            for step in 0..STEPS {
                let sum: f64 = self.parts(class, step).iter().sum();
                self.table[class][step] = self.good[class] * sum;
            }
        }
        self
    }

    #[inline(always)]
    fn step(&self, away: f32) -> usize {
        ((away / self.reach * STEPS as f32) as usize).min(STEPS - 1)
    }

    /// The density of a good estimate's distance, times the share of good ones.
    #[inline(always)]
    pub(super) fn density(&self, class: usize, away: f32) -> f64 {
        self.table[class][self.step(away)]
    }

    /// The weight of "no partner is known" for a record of `class`, when a share `others` of the
    /// partners can be found.
    pub(super) fn alone(&self, class: usize, others: f64) -> f64 {
        1.0 - self.good[class] * others
    }

    /// The mean share of good estimates.
    pub(super) fn mean_good(&self) -> f64 {
        self.good.iter().sum::<f64>() / CLASSES as f64
    }

    /// The law that `tally` suggests, where this one was used to find the pairs.
    pub(super) fn learned(&self, tally: &Tally) -> Self {
        let mut next = self.clone();
        let others = self.mean_good().max(0.1);
        for class in 0..CLASSES {
            if tally.records[class] == 0.0 {
                continue;
            }
            let mut scales = [0.0; SCALES];
            for (step, found) in tally.found[class].iter().enumerate().filter(|x| *x.1 > 0.0) {
                let parts = self.parts(class, step);
                let sum = parts.iter().sum::<f64>().max(f64::MIN_POSITIVE);
                for (to, part) in scales.iter_mut().zip(parts) {
                    *to += found * part / sum;
                }
            }
            let total: f64 = scales.iter().sum();
            let good = total / tally.records[class] / others;
            next.good[class] = good.clamp(SHARE.0, SHARE.1);
            // One pair more, spread over all scales.
            let spread = |s: f64| (s + 1.0 / SCALES as f64) / (total + 1.0);
            next.weight[class] = scales.map(spread);
        }
        next.tabulated()
    }
}

/// What pairs show about distances, per class and step.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    pub(super) records: [f64; CLASSES],
    found: Vec<[f64; STEPS]>,
}

impl Default for Tally {
    fn default() -> Self {
        Self { records: [0.0; CLASSES], found: vec![[0.0; STEPS]; CLASSES] }
    }
}

impl Tally {
    /// Counts an estimate of `class` that lies `away` from its partner's value with `probability`.
    #[inline(always)]
    pub(super) fn add(&mut self, law: &Law, class: usize, away: f32, probability: f64) {
        self.found[class][law.step(away)] += probability;
    }

    pub(super) fn merge(&mut self, other: &Self) {
        for class in 0..CLASSES {
            self.records[class] += other.records[class];
            for (to, more) in self.found[class].iter_mut().zip(&other.found[class]) {
                *to += more;
            }
        }
    }
}

// What one record says of a possible exchange.

/// A record on the axis it is believed to have exchanged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// The axis; out of range where nothing was recovered.
    pub(super) axis: usize,
    pub(super) published: f32,
    pub(super) estimate: f32,
}

impl Side {
    pub(super) fn is_known(&self) -> bool {
        self.axis != LOST
    }
}

/// The axis of a record that was not recovered.
pub(super) const LOST: usize = usize::MAX;

// The order in which records are looked at: possible partners one after the other.

/// Cells per value, as a power of two: two of them and the axis make a key.
const BITS: u32 = 20;

/// All records, so that those that may have exchanged a coordinate stand side by side: the estimate of each is
/// near what the other published, so both have about the same two values. Results do not depend on it,
/// but a partner that is in the cache costs a tenth.
pub(super) fn side_by_side(sides: &[Side], reach: f32) -> Vec<u32> {
    let low = sides.iter().map(|side| side.published.min(side.estimate)).fold(f32::MAX, f32::min);
    let cell = |value: f32| ((value - low) / reach) as u32 & ((1 << BITS) - 1);
    let place = |side: &Side| {
        let (a, b) = (cell(side.published), cell(side.estimate));
        curve::along(&[a.min(b), a.max(b)], BITS)
    };
    let mut keys: Vec<(usize, u64, u32)> = sides
        .par_iter()
        .enumerate()
        .map(|(record, side)| (side.axis, place(side), record as u32))
        .collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key.2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor at exactly 0: every record publishes what every other is believed to hide.
    #[test]
    fn equal_coordinates_have_as_many_partners_as_there_is_room_for() {
        let side = Side { axis: 2, published: 0.0, estimate: 0.0 };
        let sides = vec![side; 50_000];
        let partners = Partners::find(&sides, 3, 0.1).unwrap();
        let n = partners.of.len() / sides.len();
        assert!((32..=256).contains(&n), "{n} partners a record");
        for (i, entry) in [0, 777, 49_999].map(|i| (i, partners.entries(i).start)) {
            let (j, back) = (partners.of[entry] as usize, partners.back[entry] as usize);
            assert!(partners.entries(j).contains(&back) && partners.of[back] as usize == i);
        }
    }
}
