//! A released map prepared for solving: one row per record, whatever its family.

use super::chance_field::{self, CandidateField, ChanceField, tube};
use super::line_rows::{LineRow, from_lines, from_rays};
use super::plane_windows::SortedPlanes;
use crate::geometry::vector::{along, dot, median, sub, widen};
use crate::neighbors::Neighborhoods;
use crate::released::{AxisPlanes, Obfuscation, Released};

/// Records in the form the solvers read.
#[derive(Debug)]
pub(crate) enum Family<'a, const D: usize> {
    /// Lines, one or two slots each; rays, told apart by their group.
    Lines { rows: Vec<LineRow<D>>, slots_per_record: usize, chance: Vec<ChanceField<D>> },
    /// Axis planes, with the order of their offsets.
    Planes { planes: &'a AxisPlanes<D>, sorted: SortedPlanes },
    /// Axis candidates.
    Candidates { rows: &'a [[f32; D]], chance: CandidateField<D> },
}

impl<'a, const D: usize> Family<'a, D> {
    /// The records of `released`, with the chance that goes with `lists`.
    pub(crate) fn new(released: &'a Released<D>, lists: &Neighborhoods) -> Self {
        let slots_per_record = released.slots_per_record();
        let lines = |rows: Vec<LineRow<D>>| {
            let chance = chance_field::of_lines(&rows, lists, slots_per_record);
            Self::Lines { rows, slots_per_record, chance }
        };
        let bounds = released.bounds().map(|bounds| bounds.about(&released.origin()));
        match released.obfuscation() {
            Obfuscation::Lines(records) => lines(from_lines(records, bounds.as_ref())),
            Obfuscation::Rays(records) => lines(from_rays(records, bounds.as_ref())),
            Obfuscation::AxisPlanes(planes) => {
                Self::Planes { planes, sorted: SortedPlanes::new(planes) }
            }
            Obfuscation::AxisCandidates(candidates) => {
                let rows = candidates.position();
                Self::Candidates { rows, chance: chance_field::of_candidates(rows, lists) }
            }
        }
    }

    /// Slots per record.
    pub(crate) fn slots_per_record(&self) -> usize {
        match self {
            Self::Lines { slots_per_record, .. } => *slots_per_record,
            Self::Planes { .. } | Self::Candidates { .. } => 1,
        }
    }

    /// Whether these are rays.
    pub(crate) fn is_of_rays(&self) -> bool {
        match self {
            Self::Lines { rows, .. } => rows.first().is_some_and(LineRow::is_ray),
            Self::Planes { .. } | Self::Candidates { .. } => false,
        }
    }

    /// Whether these are rays of which it is known where each center's points lie: one ray says nothing
    /// about another of its center, and rays of two centers do not meet.
    pub(crate) fn has_regions(&self) -> bool {
        match self {
            Self::Lines { rows, .. } => rows.iter().any(|row| row.is_ray() && row.to.is_finite()),
            Self::Planes { .. } | Self::Candidates { .. } => false,
        }
    }

    /// How likely a random record agrees with a place where records are, at `delta`.
    pub(crate) fn typical_chance(&self, delta: f32) -> f32 {
        match self {
            Self::Lines { chance, .. } => {
                chance.iter().map(ChanceField::typical).fold(0.0, f32::max) * tube(D, delta)
            }
            Self::Planes { planes, sorted } => sorted.typical_chance(planes, delta),
            Self::Candidates { chance, .. } => chance.typical() * tube(D, delta),
        }
    }

    /// A length of the order of the map's size, from the records alone; 0 for an empty map.
    ///
    /// Lines: their median distance from the place they pass nearest. Rays: the largest distance between
    /// centers. Planes and candidates: the largest interquartile range over the axes.
    pub(crate) fn extent(&self) -> f64 {
        match self {
            Self::Lines { rows, .. } => {
                let Some(first) = rows.first() else {
                    return 0.0;
                };
                if first.is_ray() { ray_extent(rows) } else { line_extent(rows) }
            }
            Self::Planes { planes, sorted } => sorted.interquartile_range(planes),
            Self::Candidates { rows, .. } => (0..D)
                .map(|axis| {
                    let mut column: Vec<f32> = rows.iter().map(|row| row[axis]).collect();
                    column.sort_unstable_by(f32::total_cmp);
                    interquartile_range(&column)
                })
                .fold(0.0, f64::max),
        }
    }
}

/// The distance between the quartiles of sorted values.
pub(super) fn interquartile_range(sorted: &[f32]) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    f64::from(sorted[last - last / 4]) - f64::from(sorted[last / 4])
}

fn length<const D: usize>(v: &[f32; D]) -> f64 {
    v.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt()
}

/// Lines and rounds in which [`line_extent`] looks for the middle of a map.
const MIDDLE: (usize, usize) = (1000, 60);

/// The median distance of the lines from their middle. Distances from the origin would not do: it is
/// rounded, so that a shifted or scaled map has it elsewhere.
fn line_extent<const D: usize>(rows: &[LineRow<D>]) -> f64 {
    // Spread over the file: a third party's map need not be in random order.
    let every = rows.len().div_ceil(MIDDLE.0).max(1);
    let rows: Vec<&LineRow<D>> = rows.iter().step_by(every).collect();
    let offset = |row: &LineRow<D>, from: &[f64; D]| {
        let (through, direction) = (widen(&row.through), widen(&row.direction));
        let away = sub(&through, from);
        along(&away, -dot(&away, &direction), &direction)
    };
    // Each round moves to the mean of the lines' nearest points; what is left of the start shrinks
    // by the mean squared cosine with the lines, about a third.
    let mut middle = [0.0; D];
    for _ in 0..MIDDLE.1 {
        let mut step = [0.0; D];
        for row in &rows {
            step = along(&step, 1.0 / rows.len() as f64, &offset(row, &middle));
        }
        middle = along(&middle, 1.0, &step);
    }
    let mut distances: Vec<f64> = rows
        .iter()
        .map(|row| {
            let away = offset(row, &middle);
            dot(&away, &away).sqrt()
        })
        .collect();
    median(&mut distances)
}

fn ray_extent<const D: usize>(rows: &[LineRow<D>]) -> f64 {
    let mut centers: Vec<&LineRow<D>> = Vec::new();
    for row in rows {
        if !centers.iter().any(|center| center.group == row.group) {
            centers.push(row);
        }
    }
    let mut largest = 0.0;
    for (at, a) in centers.iter().enumerate() {
        for b in &centers[..at] {
            let apart: [f32; D] = std::array::from_fn(|c| a.through[c] - b.through[c]);
            largest = f64::max(largest, length(&apart));
        }
    }
    largest
}
