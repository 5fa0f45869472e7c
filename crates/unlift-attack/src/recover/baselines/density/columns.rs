//! Distances from one line or point to all lines: the hot loops of the published attacks.

use crate::density::Peak;
use crate::density::feasible::FeasibleLine;
use crate::simd::{Kernel, dispatch};

/// Lines with a column per coordinate, so that distances to all of them run over whole vectors.
#[derive(Debug)]
pub(super) struct LineColumns {
    through: [Vec<f32>; 3],
    direction: [Vec<f32>; 3],
}

impl LineColumns {
    /// The lines `rows` of `lines`.
    pub(super) fn new(lines: &[FeasibleLine], rows: &[u32]) -> Self {
        let column = |of: &dyn Fn(&FeasibleLine) -> f32| -> Vec<f32> {
            rows.iter().map(|&row| of(&lines[row as usize])).collect()
        };
        Self {
            through: std::array::from_fn(|c| column(&|line| line.through[c])),
            direction: std::array::from_fn(|c| column(&|line| line.direction[c])),
        }
    }

    /// Squared distances between `line` and every line; infinite for parallel ones.
    pub(super) fn distances_to_line(&self, line: &FeasibleLine, out: &mut Vec<f32>) {
        out.resize(self.through[0].len(), 0.0);
        dispatch(LineToLines { columns: self, line, out });
    }

    /// Squared distances from `point` to every line.
    pub(super) fn distances_to_point(&self, point: &[f32; 3], out: &mut Vec<f32>) {
        out.resize(self.through[0].len(), 0.0);
        dispatch(PointToLines { columns: self, point, out });
    }
}

/// Estimates with a column per coordinate; NaN where there is none.
#[derive(Debug)]
pub(super) struct PointColumns {
    position: [Vec<f32>; 3],
}

impl PointColumns {
    /// The rows `rows` of `estimates`.
    pub(super) fn new(estimates: &[Option<Peak>], rows: &[u32]) -> Self {
        let at = |row: u32, c: usize| estimates[row as usize].map_or(f32::NAN, |p| p.position[c]);
        Self { position: std::array::from_fn(|c| rows.iter().map(|&row| at(row, c)).collect()) }
    }

    /// Squared distances from `line` to every estimate; infinite where there is none.
    pub(super) fn distances_to_line(&self, line: &FeasibleLine, out: &mut Vec<f32>) {
        out.resize(self.position[0].len(), 0.0);
        dispatch(LineToPoints { columns: self, line, out });
    }
}

struct LineToLines<'a> {
    columns: &'a LineColumns,
    line: &'a FeasibleLine,
    out: &'a mut [f32],
}

impl Kernel for LineToLines<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (p, d, n) = (self.line.through, self.line.direction, self.out.len());
        let through: [&[f32]; 3] = std::array::from_fn(|c| &self.columns.through[c][..n]);
        let direction: [&[f32]; 3] = std::array::from_fn(|c| &self.columns.direction[c][..n]);
        for j in 0..n {
            let e = [direction[0][j], direction[1][j], direction[2][j]];
            let normal =
                [d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]];
            let (mut across, mut square) = (0.0, 0.0);
            for c in 0..3 {
                across += (through[c][j] - p[c]) * normal[c];
                square += normal[c] * normal[c];
            }
            let parallel = square < 1e-6;
            self.out[j] = if parallel { f32::INFINITY } else { across * across / square };
        }
    }
}

struct PointToLines<'a> {
    columns: &'a LineColumns,
    point: &'a [f32; 3],
    out: &'a mut [f32],
}

impl Kernel for PointToLines<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let n = self.out.len();
        let through: [&[f32]; 3] = std::array::from_fn(|c| &self.columns.through[c][..n]);
        let direction: [&[f32]; 3] = std::array::from_fn(|c| &self.columns.direction[c][..n]);
        for j in 0..n {
            let away: [f32; 3] = std::array::from_fn(|c| self.point[c] - through[c][j]);
            let d = [direction[0][j], direction[1][j], direction[2][j]];
            self.out[j] = square_across(&away, &d);
        }
    }
}

struct LineToPoints<'a> {
    columns: &'a PointColumns,
    line: &'a FeasibleLine,
    out: &'a mut [f32],
}

impl Kernel for LineToPoints<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (p, d, n) = (self.line.through, self.line.direction, self.out.len());
        let position: [&[f32]; 3] = std::array::from_fn(|c| &self.columns.position[c][..n]);
        for (j, out) in self.out.iter_mut().enumerate() {
            let away: [f32; 3] = std::array::from_fn(|c| position[c][j] - p[c]);
            let square = square_across(&away, &d);
            *out = if square.is_nan() { f32::INFINITY } else { square };
        }
    }
}

/// The squared length of the part of `v` perpendicular to `d`: no difference of large squares.
#[inline(always)]
fn square_across(v: &[f32; 3], d: &[f32; 3]) -> f32 {
    let along = v[0] * d[0] + v[1] * d[1] + v[2] * d[2];
    let mut square = 0.0;
    for c in 0..3 {
        let across = v[c] - along * d[c];
        square += across * across;
    }
    square
}

/// The places of the `k` smallest finite distances (ties by place) into `near`, in no order; returns
/// the largest of them, not squared.
pub(super) fn nearest(squared: &[f32], k: usize, keys: &mut Vec<u64>, near: &mut Vec<u32>) -> f32 {
    keys.clear();
    // Distances are not negative, so their bits order as they do.
    let key = |(at, d): (usize, &f32)| u64::from(d.to_bits()) << 32 | at as u64;
    keys.extend(squared.iter().enumerate().filter(|(_, d)| d.is_finite()).map(key));
    if keys.len() > k {
        keys.select_nth_unstable(k - 1);
        keys.truncate(k);
    }
    near.clear();
    near.extend(keys.iter().map(|&key| key as u32));
    keys.iter().max().map_or(f32::INFINITY, |&key| f32::from_bits((key >> 32) as u32).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};
    use crate::simd::portable;

    fn lines(n: usize) -> Vec<FeasibleLine> {
        let mut draws = Draws::new(4, Stage::Synthetic, 0);
        let line = |_| FeasibleLine {
            through: std::array::from_fn(|_| draws.between(-3.0, 3.0) as f32),
            direction: draws.direction::<3>().map(|x| x as f32),
            from: f32::NEG_INFINITY,
            prior: 1.0,
            group: None,
        };
        (0..n).map(line).collect()
    }

    #[test]
    fn distances_between_lines_are_the_least_over_their_points() {
        let lines = lines(40);
        let rows: Vec<u32> = (0..40).collect();
        let columns = LineColumns::new(&lines, &rows);
        let mut out = Vec::new();
        columns.distances_to_line(&lines[0], &mut out);
        assert_eq!(out[0], f32::INFINITY);
        for (other, &squared) in lines.iter().zip(&out).skip(1) {
            // The nearest point of the first line, by golden steps of a convex function.
            let mut to_point = vec![0.0];
            let single = LineColumns::new(&[*other], &[0]);
            let mut at = |t: f32| {
                let point: [f32; 3] =
                    std::array::from_fn(|c| lines[0].through[c] + t * lines[0].direction[c]);
                single.distances_to_point(&point, &mut to_point);
                to_point[0]
            };
            let (mut low, mut high) = (-1e3f32, 1e3f32);
            for _ in 0..100 {
                let (a, b) = (low + 0.382 * (high - low), low + 0.618 * (high - low));
                if at(a) < at(b) { high = b } else { low = a }
            }
            let least = at(0.5 * (low + high));
            assert!((least.sqrt() - squared.sqrt()).abs() < 2e-3, "{least} {squared}");
        }
    }

    #[test]
    fn vector_and_portable_code_give_the_same_bits() {
        let lines = lines(101);
        let rows: Vec<u32> = (0..101).collect();
        let columns = LineColumns::new(&lines, &rows);
        let (mut fast, mut plain) = (Vec::new(), vec![0.0; 101]);
        columns.distances_to_line(&lines[7], &mut fast);
        portable(LineToLines { columns: &columns, line: &lines[7], out: &mut plain });
        assert_eq!(fast, plain);
        let point = [0.3, -0.2, 1.0];
        columns.distances_to_point(&point, &mut fast);
        portable(PointToLines { columns: &columns, point: &point, out: &mut plain });
        assert_eq!(fast, plain);
    }

    #[test]
    fn nearest_takes_the_smallest_and_counts_ties_by_place() {
        let (mut keys, mut near) = (Vec::new(), Vec::new());
        let squared = [4.0, f32::INFINITY, 1.0, 4.0, 0.0];
        assert_eq!(nearest(&squared, 3, &mut keys, &mut near), 2.0);
        near.sort_unstable();
        assert_eq!(near, [0, 2, 4]);
        assert_eq!(nearest(&[], 3, &mut keys, &mut near), f32::INFINITY);
    }
}
