//! Whether SIFT descriptors have their columns in the usual order, for which networks are trained.

use super::kind::DescriptorKind;
use super::rows::by_content;
use crate::Descriptors;

/// Least mean correlation of SIFT's cells along edges beyond that across them; 0.24 to 0.29 on real maps, and below 0.06 with columns
/// in another order or with much noise.
const ALONG_EDGES: f32 = 0.1;
/// Fewest descriptors whose correlations tell the order of columns.
const FEWEST: usize = 200;
/// Largest number of descriptors that are examined.
const SAMPLE: usize = 2000;

/// Returns whether the 128 columns of SIFT descriptors are in the usual order: four rows of four cells with eight directions each, as COLMAP,
/// OpenCV and `unlift features` write them. An edge across several cells has the same direction in each, so cells along it are alike.
pub fn has_usual_order(descriptors: &Descriptors) -> bool {
    let (n, dim) = (descriptors.len(), descriptors.dim());
    if n < FEWEST || dim != DescriptorKind::Sift.dim() {
        return true;
    }
    // In an order that is the same for every release of the descriptors.
    let mut told = by_content(descriptors);
    told.retain(|&row| !descriptors.is_zero(row as usize));
    let sample = told.iter().step_by(told.len().div_ceil(SAMPLE).max(1));
    let rows: Vec<Vec<f32>> = sample.map(|&row| descriptors.row(row as usize)).collect();
    if rows.len() < FEWEST {
        return true;
    }
    let column = |at: usize| -> Vec<f32> {
        let mean = rows.iter().map(|row| row[at]).sum::<f32>() / rows.len() as f32;
        let away: Vec<f32> = rows.iter().map(|row| row[at] - mean).collect();
        let length = away.iter().map(|x| x * x).sum::<f32>().sqrt().max(f32::MIN_POSITIVE);
        away.into_iter().map(|x| x / length).collect()
    };
    let columns: Vec<Vec<f32>> = (0..dim).map(column).collect();
    // Steps in rows and columns of cells along an edge whose gradient has each of four directions.
    let along = [(1, 0), (1, 1), (0, 1), (1, -1)];
    let correlation = |direction: usize, (down, right): (usize, i32)| {
        let inside = |at: i32| (0..4).contains(&at);
        let cells = (0..16).filter(|cell| cell / 4 + down < 4 && inside((cell % 4) as i32 + right));
        let of_cell = |cell: usize| {
            let next = (cell + 4 * down).wrapping_add_signed(right as isize);
            let both = columns[8 * cell + direction].iter().zip(&columns[8 * next + direction]);
            both.map(|(a, b)| a * b).sum::<f32>()
        };
        let cells: Vec<f32> = cells.map(of_cell).collect();
        cells.iter().sum::<f32>() / cells.len() as f32
    };
    let beyond = |at: usize| correlation(at, along[at % 4]) - correlation(at, along[(at + 2) % 4]);
    (0..8).map(beyond).sum::<f32>() / 8.0 >= ALONG_EDGES
}
