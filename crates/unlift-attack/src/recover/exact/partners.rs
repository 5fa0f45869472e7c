//! Who may have exchanged a coordinate with whom: pairs of records that would explain each other.

use rayon::prelude::*;

use super::side::Side;

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
