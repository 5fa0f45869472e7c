//! An order in which similar descriptors are adjacent.
//!
//! Rows are split at the median along the direction of largest variance, recursively, until a part is one block. All parts but the
//! last are full.

use rayon::prelude::*;

use crate::descriptors::Values;
use crate::simd::BLOCK;
use crate::{Descriptors, Error};

/// Number of rows from which the direction is computed.
const SAMPLE: usize = 256;
/// Number of power iterations. An approximate direction suffices.
const ITERATIONS: usize = 8;

/// Returns `slots` in that order.
pub fn order(descriptors: &Descriptors, slots: &[u32]) -> Vec<u32> {
    let mut slots = slots.to_vec();
    halve(descriptors, &mut slots);
    slots
}

fn halve(descriptors: &Descriptors, slots: &mut [u32]) {
    if slots.len() <= BLOCK {
        return;
    }
    let direction = widest(descriptors, slots);
    let scratch = || vec![0.0; descriptors.dim()];
    let product = |row: &mut Vec<f32>, &slot: &u32| {
        descriptors.read_row(slot as usize, row);
        (row.iter().zip(&direction).map(|(x, d)| x * d).sum(), slot)
    };
    let mut along: Vec<(f32, u32)> = slots.par_iter().map_init(scratch, product).collect();
    // Whole blocks on the left. Equal rows stay in the order of slots.
    let left = (slots.len() / 2).next_multiple_of(BLOCK);
    let by_place = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    along.par_sort_unstable_by(by_place);
    slots.iter_mut().zip(&along).for_each(|(slot, &(_, moved))| *slot = moved);
    drop(along);
    let (low, high) = slots.split_at_mut(left);
    rayon::join(|| halve(descriptors, low), || halve(descriptors, high));
}

/// Returns the direction of largest variance of a sample of the rows.
fn widest(descriptors: &Descriptors, slots: &[u32]) -> Vec<f32> {
    let every = slots.len().div_ceil(SAMPLE).max(1);
    let mut rows: Vec<Vec<f32>> =
        slots.iter().step_by(every).map(|&slot| descriptors.row(slot as usize)).collect();
    let n = rows.len() as f32;
    let mean: Vec<f32> =
        (0..descriptors.dim()).map(|c| rows.iter().map(|row| row[c]).sum::<f32>() / n).collect();
    for row in &mut rows {
        row.iter_mut().zip(&mean).for_each(|(x, mean)| *x -= mean);
    }
    // Start with the row farthest from the mean.
    let length2 = |row: &Vec<f32>| row.iter().map(|x| x * x).sum::<f32>();
    let farthest = rows.iter().max_by(|a, b| length2(a).total_cmp(&length2(b)));
    let mut direction = farthest.cloned().unwrap_or_default();
    for _ in 0..ITERATIONS {
        let mut next = vec![0.0f32; direction.len()];
        for row in &rows {
            let along: f32 = row.iter().zip(&direction).map(|(x, d)| x * d).sum();
            next.iter_mut().zip(row).for_each(|(next, x)| *next += along * x);
        }
        let length = length2(&next).sqrt();
        if length == 0.0 {
            break;
        }
        direction = next.into_iter().map(|x| x / length).collect();
    }
    direction
}

/// Returns the mean row of each block of `slots`.
///
/// # Errors
/// When all of them are equal.
pub fn means(descriptors: &Descriptors, slots: &[u32]) -> Result<Descriptors, Error> {
    let mean = |slots: &[u32]| {
        let mut sum = vec![0.0f32; descriptors.dim()];
        for &slot in slots {
            sum.iter_mut().zip(descriptors.row(slot as usize)).for_each(|(sum, x)| *sum += x);
        }
        sum.into_iter().map(move |x| x / slots.len() as f32).collect::<Vec<f32>>()
    };
    let values: Vec<f32> = slots.par_chunks(BLOCK).flat_map_iter(mean).collect();
    Descriptors::try_new(Values::F32(values), descriptors.dim())
}
