//! Blocks chosen by how alike they are, compared with all pairs.

use super::*;
use crate::descriptors::Values;
use crate::neighbors::overlap::Patches;
use crate::neighbors::similarity::Cosine;
use crate::seed::{Draws, Stage};

/// `n` rows around random middles, about six to each.
fn crowds(n: usize, dim: usize) -> Descriptors {
    let mut draws = Draws::new(4, Stage::Synthetic, 0);
    let mut middles = || (0..dim).map(|_| draws.between(20.0, 120.0)).collect::<Vec<f64>>();
    let middles: Vec<Vec<f64>> = (0..n.div_ceil(6)).map(|_| middles()).collect();
    let mut draws = Draws::new(5, Stage::Synthetic, 0);
    let values = (0..n).flat_map(|row| {
        let noise: Vec<f64> = (0..dim).map(|_| 6.0 * draws.normal()).collect();
        let middle = &middles[row % middles.len()];
        middle
            .iter()
            .zip(noise)
            .map(|(x, noise)| (x + noise).clamp(0.0, 255.0) as u8)
            .collect::<Vec<u8>>()
    });
    Descriptors::try_new(Values::U8(values.collect()), dim).unwrap()
}

/// What every slot found: slots instead of rows.
fn found<L: Likeness>(
    likeness: &L,
    descriptors: &Descriptors,
    most: usize,
    exact: usize,
) -> Vec<Vec<(f32, u32)>> {
    let mut rows = Rows::of_all(descriptors);
    let found = search(likeness, &mut rows, most, exact).unwrap();
    let mut by_slot = vec![Vec::new(); rows.len()];
    for (found, &slot) in found.into_iter().zip(&rows.slots) {
        by_slot[slot as usize] =
            found.best.into_iter().map(|(score, row)| (score, rows.slots[row as usize])).collect();
    }
    by_slot
}

/// The share of `right` that is in `found`.
fn recall(found: &[Vec<(f32, u32)>], right: &[Vec<(f32, u32)>]) -> f64 {
    let slots = |list: &[(f32, u32)]| list.iter().map(|&(_, slot)| slot).collect::<Vec<u32>>();
    let in_both: usize = found
        .iter()
        .zip(right)
        .map(|(found, right)| {
            let found = slots(found);
            slots(right).iter().filter(|slot| found.contains(slot)).count()
        })
        .sum();
    in_both as f64 / right.iter().map(Vec::len).sum::<usize>() as f64
}

#[test]
fn few_blocks_all_meet() {
    let descriptors = crowds(1_500, 128);
    const { assert!(1_500 < BLOCK * PARTNERS) };
    let scores = |found: Vec<Vec<(f32, u32)>>| -> Vec<Vec<f32>> {
        found.iter().map(|list| list.iter().map(|&(score, _)| score).collect()).collect()
    };
    let cosines = |exact| scores(found(&Cosine { counts: false }, &descriptors, 10, exact));
    assert_eq!(cosines(0), cosines(MOST_ROWS));
    let patches = Patches::of(&descriptors).unwrap();
    let overlaps = |exact| scores(found(&patches, &descriptors, 10, exact));
    assert_eq!(overlaps(0), overlaps(MOST_ROWS));
}

#[test]
fn of_many_blocks_those_meet_that_look_alike() {
    let descriptors = crowds(30_000, 16);
    let n_blocks = 30_000usize.div_ceil(BLOCK);
    assert!(n_blocks > 3 * PARTNERS, "a third of the blocks");
    let right = found(&Cosine { counts: false }, &descriptors, 5, MOST_ROWS);
    let some = found(&Cosine { counts: false }, &descriptors, 5, 0);
    let recall = recall(&some, &right);
    assert!(recall >= 0.9, "{recall}");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    assert_eq!(pool.install(|| found(&Cosine { counts: false }, &descriptors, 5, 0)), some);
}

#[test]
fn usual_scores_are_those_of_all_rows() {
    let descriptors = crowds(6_000, 128);
    let patches = Patches::of(&descriptors).unwrap();
    let rows = Rows::of_all(&descriptors);
    let all = Pairs::all(rows.len().div_ceil(BLOCK));
    let exact = compare(&patches, &rows, 1, (&all, None));
    let sampled = compare(&patches, &rows, 1, (&all, Some(3)));
    for (exact, sampled) in exact.iter().zip(&sampled) {
        let off = (exact.mean - sampled.mean).abs() / exact.deviation;
        assert!(off < 0.2, "{off}");
        let ratio = sampled.deviation / exact.deviation;
        assert!((0.9..1.1).contains(&ratio), "{ratio}");
    }
}
