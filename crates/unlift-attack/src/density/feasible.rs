//! Records as the lines on which their points may lie.

use std::any::Any;
use std::cmp::Ordering;

use nalgebra::{Matrix3, Vector3};

use crate::geometry::vector::{along, distance, dot, median, sub, widen};
use crate::recover::map::{LineRow, NO_GROUP, rows_of, unit};
use crate::released::{AxisCandidates, Obfuscation, Released};

/// What a record hides. It decides how the likelihood of a place depends on the density of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hides {
    /// One point; the record is a random line through it.
    One,
    /// Two points. Few pairs are close together: a pair at distance `d` has a likelihood proportional to `d^2`.
    Two,
    /// One point seen from a center: a ray passes more points the farther it goes.
    OnRay,
    /// One point, on one of three axis lines.
    OnAxis,
}

pub(crate) struct Feasible {
    pub(crate) hides: Hides,
    /// Lines and rays without an end, `per_record` per record. Rays of one center always meet there, so they are no evidence for each other.
    pub(crate) lines: Vec<LineRow<3>>,
    /// Prior probability of each line among the lines of its record, up to a common factor; empty if they are equal.
    pub(crate) prior: Vec<f32>,
    pub(crate) per_record: usize,
    pub(crate) n_groups: usize,
}

impl Feasible {
    /// Converts the records of `released`; `None` in 2D, where all lines meet, and for planes, which do not show what belongs together.
    pub(crate) fn new<const D: usize>(released: &Released<D>) -> Option<Self> {
        let released: &Released<3> = (released as &dyn Any).downcast_ref()?;
        let line = |row: LineRow<3>| LineRow { to: f32::INFINITY, ..row };
        let mut lines: Vec<_> = rows_of(released, None).into_iter().map(line).collect();
        let (mut prior, mut n_groups) = (Vec::new(), 0);
        let hides = match released.obfuscation() {
            Obfuscation::Lines(_) if released.slots_per_record() == 2 => Hides::Two,
            Obfuscation::Lines(_) => Hides::One,
            Obfuscation::Rays(rays) => {
                n_groups = rays.centers().len();
                Hides::OnRay
            }
            Obfuscation::AxisPlanes(_) => return None,
            Obfuscation::AxisCandidates(candidates) => {
                // The value on an exchanged axis is random, so it is more probable where values are dense.
                let common = value_densities(candidates);
                for (row, &position) in candidates.position().iter().enumerate() {
                    for axis in 0..3 {
                        let (mut through, direction) = (position, unit(axis));
                        through[axis] = 0.0;
                        let (group, to) = (NO_GROUP, f32::INFINITY);
                        lines.push(LineRow { through, direction, group, to });
                        prior.push(common[axis][row]);
                    }
                }
                Hides::OnAxis
            }
        };
        let per_record = if hides == Hides::OnAxis { 3 } else { 1 };
        Some(Self { hides, lines, prior, per_record, n_groups })
    }

    pub(crate) fn n_records(&self) -> usize {
        self.lines.len() / self.per_record
    }

    /// Measures parameters from the point nearest to `middle`, because shifted maps have other feet. Rays keep their center.
    pub(crate) fn counted_from(mut self, middle: &[f64; 3]) -> Self {
        for line in self.lines.iter_mut().filter(|line| !line.is_ray()) {
            line.through = nearest(line, middle).map(|x| x as f32);
        }
        self
    }

    /// Returns the middle of the map and a length of the order of its size, from the records alone; `None` if they have no extent.
    pub(crate) fn middle(&self) -> Option<([f64; 3], f64)> {
        let (middle, extent) = match self.hides {
            Hides::OnRay => between_centers(&self.lines),
            Hides::One | Hides::Two | Hides::OnAxis => crossing(&self.lines)?,
        };
        // Grids square voxel sides in f32.
        let usable = (extent as f32 * extent as f32).is_normal() && extent > 0.0;
        usable.then_some((middle, extent))
    }
}

/// Returns the mean of the centers of rays, and the largest distance between two of them.
fn between_centers(lines: &[LineRow<3>]) -> ([f64; 3], f64) {
    let mut centers: Vec<[f64; 3]> = lines.iter().map(|line| widen(&line.through)).collect();
    // Sorted, so that the result does not depend on the order of records.
    centers.sort_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
    centers.dedup();
    let n = centers.len() as f64;
    let middle = std::array::from_fn(|c| centers.iter().map(|x| x[c]).sum::<f64>() / n);
    let pairs = centers.iter().flat_map(|a| centers.iter().map(|b| distance(a, b)));
    (middle, pairs.fold(0.0, f64::max))
}

/// Lines are parallel if the determinant of their normal equations is below this fraction of that of random lines.
const PARALLEL: f64 = 1e-5;

/// Returns the least-squares intersection of lines, and the median distance of the lines from it; `None` for parallel lines.
fn crossing(lines: &[LineRow<3>]) -> Option<([f64; 3], f64)> {
    // The squared distance from a line is |(I - d d') (x - p)|^2. Sums of sorted terms do not depend on the order of records.
    let across = |line: &LineRow<3>, row: usize, column: usize| {
        f64::from(u8::from(row == column))
            - f64::from(line.direction[row]) * f64::from(line.direction[column])
    };
    let sum = |term: &dyn Fn(&LineRow<3>) -> f64| {
        let mut terms: Vec<f64> = lines.iter().map(term).collect();
        terms.sort_unstable_by(f64::total_cmp);
        terms.iter().sum::<f64>()
    };
    let matrix = Matrix3::from_fn(|row, column| sum(&|line| across(line, row, column)));
    let right = Vector3::from_fn(|row, _| {
        sum(&|line| (0..3).map(|c| across(line, row, c) * f64::from(line.through[c])).sum())
    });
    // Directions are rounded, so parallel lines are only nearly singular.
    let even = matrix.trace() / 3.0;
    if matrix.determinant() <= PARALLEL * even * even * even {
        return None;
    }
    let middle: [f64; 3] = (matrix.try_inverse()? * right).into();
    let mut distances: Vec<f64> =
        lines.iter().map(|line| distance(&nearest(line, &middle), &middle)).collect();
    let sound = !distances.is_empty() && distances.iter().all(|x| x.is_finite());
    sound.then(|| (middle, median(&mut distances)))
}

fn nearest(line: &LineRow<3>, x: &[f64; 3]) -> [f64; 3] {
    let (through, direction) = (widen(&line.through), widen(&line.direction));
    along(&through, dot(&sub(x, &through), &direction), &direction)
}

/// Number of values to either side over which the density of published values is measured.
const REACH: usize = 50;

fn value_densities(candidates: &AxisCandidates<3>) -> [Vec<f32>; 3] {
    let n = candidates.position().len();
    std::array::from_fn(|axis| {
        let value = |row: u32| candidates.position()[row as usize][axis];
        let mut order: Vec<u32> = (0..n as u32).collect();
        order.sort_by(|&a, &b| value(a).total_cmp(&value(b)));
        let reach = REACH.min(n / 4);
        // The mean spacing is added, because equal values have no width.
        let spacing = match n {
            0 | 1 => 1.0,
            _ => (value(order[n - 1]) - value(order[0])) / n as f32,
        };
        let mut densities = vec![1.0; n];
        for rank in 0..n {
            let (low, high) = (rank.saturating_sub(reach), (rank + reach).min(n - 1));
            let width = value(order[high]) - value(order[low]) + spacing;
            if width > 0.0 {
                densities[order[rank] as usize] = (high - low + 1) as f32 / width;
            }
        }
        densities
    })
}
