//! The probability that two records belong together, from the distance at which they pass.

/// Rounds of estimation.
const ROUNDS: usize = 50;
/// Least noise, as a share of the usual distance.
const LEAST: f64 = 1e-12;
/// Most noise, as a share of the usual distance, at which right links stand out.
const MOST: f64 = 0.1;

/// Returns the probability of each link and the noise of the right ones. A distance of 1 is usual of wrong links.
///
/// Distances of wrong links are exponential, those of right ones are Cauchy's, because the noise depends on the angle between
/// records. Their scale and share are learned from all links (expectation maximization).
pub(super) fn trust(distances: &[f64]) -> (Vec<f64>, f64) {
    if distances.is_empty() {
        return (Vec::new(), LEAST);
    }
    let mut sorted = distances.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut scale = sorted[sorted.len() / 10].max(LEAST);
    let mut share = 0.5;
    let mut found = vec![0.0; distances.len()];
    for _ in 0..ROUNDS {
        let (mut sum, mut squares) = (0.0, 0.0);
        for (found, &distance) in found.iter_mut().zip(distances) {
            let ratio2 = (distance / scale) * (distance / scale);
            let right = share * std::f64::consts::FRAC_2_PI / scale / (1.0 + ratio2);
            let wrong = (1.0 - share) * libm::exp(-distance);
            *found = right / (right + wrong);
            sum += *found;
            squares += *found * 2.0 * distance * distance / (1.0 + ratio2);
        }
        if sum <= 0.0 {
            break;
        }
        scale = (squares / sum).sqrt().max(LEAST);
        share = (sum / distances.len() as f64).clamp(0.001, 0.999);
    }
    if scale > MOST {
        // Nothing stands out from wrong links.
        found.fill(0.0);
    }
    (found, scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    #[test]
    fn right_links_are_told_from_wrong_ones() {
        for noise in [1e-7, 1e-4, 1e-2] {
            let mut draws = Draws::new(1, Stage::Synthetic, 0);
            let mut exponential = || -draws.between(1e-9, 1.0).ln();
            let right: Vec<f64> = (0..700).map(|_| noise * exponential()).collect();
            let wrong: Vec<f64> = (0..300).map(|_| exponential()).collect();
            let (found, scale) = trust(&[right, wrong].concat());
            assert!((0.2..2.0).contains(&(scale / noise)), "{scale} for {noise}");
            let sure = |range: std::ops::Range<usize>| {
                found[range].iter().filter(|&&found| found >= 0.9).count()
            };
            assert!(sure(0..700) > 650 && sure(700..1000) < 30, "{noise}");
        }
    }
}
