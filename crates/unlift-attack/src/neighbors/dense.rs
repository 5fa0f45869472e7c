//! Scores of all pairs of a few descriptors: the input of a network.

use super::compare::Likeness;
use super::overlap::{Hypotheses, REACHES};
use super::similarity::Cosine;
use crate::parallel;
use crate::simd::BLOCK;
use crate::{Descriptors, Error};

/// Largest number of descriptors, for which the matrices take 800 MB.
const MOST: usize = 1 << 13;

/// Computes the similarity of all pairs of `n` descriptors: the overlap of their patches per reach for SIFT, the cosine for others.
///
/// Returns scores `(reaches, n, n)`, with [`REACHES`] reaches for SIFT and one for others: the best score of each reach in standard
/// deviations above the mean, averaged over both rows. Mean and deviation are those of a row's best scores over all reaches. Scores are
/// symmetric; 0 between a descriptor and itself.
///
/// For a part of a larger set, whose scores are higher, `usual` gives the mean and deviation in the larger set ([`usual`](usual())).
///
/// # Errors
/// When there are fewer than two descriptors or more than 8,192, or `usual` has another number of entries.
pub fn dense(descriptors: &Descriptors, usual: Option<&[(f64, f64)]>) -> Result<Vec<f32>, Error> {
    let n = descriptors.len();
    check(n)?;
    let n_usual = usual.map_or(n, <[_]>::len);
    Error::check_len("dense scores", n_usual, n, " means and deviations")?;
    let mut scores = raw(descriptors);
    let usual = usual.map_or_else(|| within(&scores, n), <[_]>::to_vec);
    let standardize = |(): &mut (), at: usize, line: &mut &mut [f32]| {
        let row = at % n;
        for (column, score) in line.iter_mut().enumerate() {
            // A blank descriptor has a deviation of 0.
            let [own, others] = [usual[row], usual[column]]
                .map(|(mean, deviation)| (f64::from(*score) - mean) / deviation.max(1e-9));
            *score = if column == row { 0.0 } else { ((own + others) / 2.0) as f32 };
        }
    };
    let mut lines: Vec<&mut [f32]> = scores.chunks_mut(n).collect();
    parallel::for_each_mut(&mut lines, || (), standardize);
    Ok(scores)
}

/// Returns `(reaches, n, n)` scores before standardization.
fn raw(descriptors: &Descriptors) -> Vec<f32> {
    match Hypotheses::of(descriptors) {
        Ok(hypotheses) => {
            let best = |reach: usize, a: &_, b: &_, found: &mut [f32]| {
                hypotheses.best(a, b, |shift| shift.min(REACHES - 1) == reach, found);
            };
            all_pairs(&hypotheses, descriptors, REACHES, best)
        }
        Err(_) => all_pairs(&Cosine, descriptors, 1, |_, a, b, found| Cosine.scores(a, b, found)),
    }
}

/// Returns mean and deviation of the scores of each descriptor with all others, for parts of these in [`dense`].
///
/// # Errors
/// When [`dense`] fails.
pub fn usual(descriptors: &Descriptors) -> Result<Vec<(f64, f64)>, Error> {
    check(descriptors.len())?;
    Ok(within(&raw(descriptors), descriptors.len()))
}

fn check(n: usize) -> Result<(), Error> {
    if (2..=MOST).contains(&n) {
        return Ok(());
    }
    Err(Error::new("dense scores", format!("2 to {MOST} descriptors"), n))
}

/// Computes `(reaches, n, n)` symmetric scores; `score` compares two blocks, `(BLOCK, BLOCK)`, at a reach.
fn all_pairs<L: Likeness>(
    likeness: &L,
    descriptors: &Descriptors,
    reaches: usize,
    score: impl Fn(usize, &L::Block, &L::Block, &mut [f32]) + Sync,
) -> Vec<f32> {
    let n = descriptors.len();
    let slots: Vec<u32> = (0..n as u32).collect();
    let block =
        |at: usize| likeness.block(descriptors, &slots[at * BLOCK..n.min((at + 1) * BLOCK)]);
    let blocks = parallel::map(n.div_ceil(BLOCK), block);
    let mut scores = vec![0.0f32; reaches * n * n];
    for (reach, scores) in scores.chunks_exact_mut(n * n).enumerate() {
        let scratch = || vec![0.0f32; BLOCK * BLOCK];
        let mut stripes: Vec<&mut [f32]> = scores.chunks_mut(BLOCK * n).collect();
        parallel::for_each_mut(&mut stripes, scratch, |found, a, stripe| {
            for (b, block) in blocks.iter().enumerate().skip(a) {
                score(reach, &blocks[a], block, found);
                let columns = b * BLOCK..n.min((b + 1) * BLOCK);
                for (row, found) in stripe.chunks_exact_mut(n).zip(found.chunks_exact(BLOCK)) {
                    row[columns.clone()].copy_from_slice(&found[..columns.len()]);
                }
            }
        });
        for row in 1..n {
            for column in 0..row {
                scores[row * n + column] = scores[column * n + row];
            }
        }
    }
    scores
}

/// Returns mean and deviation of each row's scores with the others, by the best of all reaches.
fn within(scores: &[f32], n: usize) -> Vec<(f64, f64)> {
    let reaches = scores.len() / (n * n);
    let of_row = |row: usize| {
        let (mut sum, mut squares) = (0.0f64, 0.0f64);
        for column in (0..n).filter(|&column| column != row) {
            let of = |reach: usize| scores[(reach * n + row) * n + column];
            let best = f64::from((0..reaches).map(of).fold(f32::NEG_INFINITY, f32::max));
            sum += best;
            squares += best * best;
        }
        let mean = sum / (n - 1) as f64;
        (mean, (squares / (n - 1) as f64 - mean * mean).max(0.0).sqrt())
    };
    parallel::map(n, of_row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptors::Values;
    use crate::seed::{Draws, Stage};

    #[test]
    fn a_shifted_copy_is_found_at_its_reach() {
        let mut draws = Draws::new(3, Stage::Synthetic, 0);
        let mut all: Vec<u8> = (0..200 * 128).map(|_| draws.below(60) as u8).collect();
        // Patch 150 shows the content of patch 3, one cell to the right.
        for cell in (0..4).flat_map(|row| [4 * row, 4 * row + 1, 4 * row + 2]) {
            let from = 3 * 128 + (cell + 1) * 8;
            all.copy_within(from..from + 8, 150 * 128 + cell * 8);
        }
        let of = |values: &[u8]| Descriptors::try_new(Values::U8(values.to_vec()), 128).unwrap();
        let scores = dense(&of(&all), None).unwrap();
        let score = |reach: usize, i: usize, j: usize| scores[(reach * 200 + i) * 200 + j];
        let shifted = score(1, 3, 150);
        assert!(shifted > score(0, 3, 150) + 2.0 && shifted > score(2, 3, 150) + 2.0);
        let best = (0..200).max_by(|&a, &b| score(1, 3, a).total_cmp(&score(1, 3, b)));
        assert_eq!(best, Some(150));
        for (i, j) in [(3, 150), (0, 199), (17, 17)] {
            assert_eq!(score(2, i, j), score(2, j, i));
        }
        assert_eq!(score(0, 17, 17), 0.0);
        let message = dense(&of(&all[..128]), None).unwrap_err().to_string();
        assert_eq!(message, "dense scores: expected 2 to 8192 descriptors, found 1");
    }

    #[test]
    fn others_than_sift_are_compared_by_cosine() {
        let mut draws = Draws::new(4, Stage::Synthetic, 0);
        let mut values: Vec<f32> = (0..40 * 16).map(|_| draws.between(-1.0, 1.0) as f32).collect();
        for c in 0..16 {
            values[7 * 16 + c] = 3.0 * values[c];
        }
        let all = Descriptors::try_new(Values::F32(values), 16).unwrap();
        let scores = dense(&all, None).unwrap();
        assert_eq!(scores.len(), 40 * 40);
        let of = |i: usize, j: usize| scores[i * 40 + j];
        let best = (1..40).max_by(|&a, &b| of(0, a).total_cmp(&of(0, b)));
        assert_eq!((best, of(0, 7), of(9, 9)), (Some(7), of(7, 0), 0.0));
        // Standardized scores of every row have mean 0, so all of them do.
        let mean = scores.iter().sum::<f32>() / 1600.0;
        assert!(mean.abs() < 1e-4, "{mean}");
        // Twice the deviation gives half the score.
        let [narrow, wide] = [1.0, 2.0].map(|by| dense(&all, Some(&[(0.0, by); 40])).unwrap()[7]);
        assert!(narrow == 2.0 * wide && (narrow - 1.0).abs() < 1e-6);
    }
}
