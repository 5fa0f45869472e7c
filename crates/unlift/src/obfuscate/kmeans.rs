//! k-means with several restarts, for the centers of ray clouds.

use rayon::prelude::*;

use crate::geometry::vector::squared_distance;
use crate::seed::{Key, Stage};

/// Maximum number of Lloyd iterations per restart (scikit-learn's default).
const MAX_ROUNDS: usize = 300;

/// Returns the `k` centers of the best of `restarts` runs of Lloyd's algorithm with k-means++
/// initialization.
///
/// The result depends only on `key`, which keeps the initial centers secret. Restarts run in
/// parallel; sums within a run are in row order.
///
/// # Panics
/// When `points` is empty or `k` or `restarts` is 0.
pub fn kmeans<const D: usize>(
    points: &[[f64; D]],
    k: usize,
    restarts: u64,
    key: &Key,
) -> Vec<[f64; D]> {
    assert!(!points.is_empty() && k > 0 && restarts > 0);
    let runs: Vec<(f64, Vec<[f64; D]>)> = (0..restarts)
        .into_par_iter()
        .map(|restart| lloyd(points, spread_start(points, k, key, restart)))
        .collect();
    // The first of equally good runs counts.
    let best = runs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, mut centers) = best.expect("a restart");
    // The order of the centers must not depend on which restart won.
    centers.sort_unstable_by(|a, b| {
        a.iter()
            .zip(b)
            .map(|(x, y)| x.total_cmp(y))
            .find(|o| o.is_ne())
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    centers
}

/// Chooses initial centers with k-means++: with probability proportional to the squared distance to
/// the nearest center so far.
fn spread_start<const D: usize>(
    points: &[[f64; D]],
    k: usize,
    key: &Key,
    restart: u64,
) -> Vec<[f64; D]> {
    let mut draws = key.draws(Stage::KMeans, restart);
    let mut centers = vec![points[draws.below(points.len() as u64) as usize]];
    while centers.len() < k {
        let weight = |p: &[f64; D]| {
            centers.iter().map(|c| squared_distance(p, c)).fold(f64::INFINITY, f64::min)
        };
        let total: f64 = points.iter().map(weight).sum();
        let mut left = draws.unit() * total;
        let chosen = points.iter().position(|p| {
            left -= weight(p);
            left <= 0.0
        });
        centers.push(points[chosen.unwrap_or(points.len() - 1)]);
    }
    centers
}

fn lloyd<const D: usize>(points: &[[f64; D]], mut centers: Vec<[f64; D]>) -> (f64, Vec<[f64; D]>) {
    let mut cost = f64::INFINITY;
    for _ in 0..MAX_ROUNDS {
        let mut sums = vec![[0.0; D]; centers.len()];
        let mut counts = vec![0u64; centers.len()];
        let mut new_cost = 0.0;
        for point in points {
            let (at, distance) = nearest(point, &centers);
            new_cost += distance;
            counts[at] += 1;
            for c in 0..D {
                sums[at][c] += point[c];
            }
        }
        for (at, center) in centers.iter_mut().enumerate() {
            if counts[at] > 0 {
                *center = sums[at].map(|s| s / counts[at] as f64);
            }
        }
        let converged = new_cost >= cost * (1.0 - 1e-9);
        cost = new_cost;
        if converged {
            break;
        }
    }
    (cost, centers)
}

/// Returns the index of the nearest center (the first of equals) and the squared distance to it.
fn nearest<const D: usize>(point: &[f64; D], centers: &[[f64; D]]) -> (usize, f64) {
    let of = |(at, center)| (at, squared_distance(point, center));
    let nearest = centers.iter().enumerate().map(of).min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.expect("a center")
}
