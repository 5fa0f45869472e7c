//! A length of the order of the map's size, from the records alone.

use super::line_rows::LineRow;
use crate::geometry::vector::{along, dot, median, sub, widen};

/// Quartiles are those of parts far from one another where they are so many times as far apart as one part is wide.
const FAR_APART: f64 = 4.0;

/// The distance between the quartiles of sorted values.
pub(crate) fn interquartile_range(sorted: &[f32]) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    f64::from(sorted[last - last / 4]) - f64::from(sorted[last / 4])
}

/// Whether sorted values lie in parts far from one another: four times the width of an eighth of them, about a typical
/// value, is as much as the distance of their quartiles where they are spread evenly.
pub(crate) fn are_in_parts(sorted: &[f32]) -> bool {
    let many = sorted.len() / 8;
    if many == 0 {
        return false;
    }
    let width = |at: usize| f64::from(sorted[at + many]) - f64::from(sorted[at]);
    let mut widths: Vec<f64> = (0..sorted.len() - many).map(width).collect();
    FAR_APART * 4.0 * median(&mut widths) < interquartile_range(sorted)
}

fn length<const D: usize>(v: &[f32; D]) -> f64 {
    v.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt()
}

/// Lines, and rounds (each leaves a third of the error), in which [`line_extent`] looks for the middle of a map.
const MIDDLE: (usize, usize) = (1000, 60);

/// The median distance of the lines from their middle. Distances from the origin would not do: it is
/// rounded, so that a shifted or scaled map has it elsewhere.
pub(crate) fn line_extent<const D: usize>(rows: &[LineRow<D>]) -> f64 {
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

/// The largest distance between centers.
pub(crate) fn ray_extent<const D: usize>(rows: &[LineRow<D>]) -> f64 {
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
