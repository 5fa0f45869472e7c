//! Points for tests.

use unlift::geometry::frame::Bounds;
use unlift::seed::{Draws, Stage};

/// Returns points of a room: walls, uneven clusters, scatter, and 3 % that coincide with another
/// point.
pub fn room<const D: usize>(seed: u64, n: usize) -> Vec<[f64; D]> {
    let mut draws = Draws::new(seed, Stage::Synthetic, 1);
    let size: [f64; D] = std::array::from_fn(|c| [6.0, 4.0, 2.5][c]);
    let anywhere = |draws: &mut Draws| std::array::from_fn(|c| draws.between(0.0, size[c]));
    let clusters: Vec<[f64; D]> = (0..6).map(|_| anywhere(&mut draws)).collect();
    let mut points: Vec<[f64; D]> = Vec::with_capacity(n);
    while points.len() < n {
        let kind = draws.below(100);
        let point = if kind < 3 && !points.is_empty() {
            points[draws.below(points.len() as u64) as usize]
        } else if kind < 45 {
            let mut point = anywhere(&mut draws);
            let wall = draws.below(D as u64) as usize;
            point[wall] = size[wall] * draws.below(2) as f64;
            point
        } else if kind < 85 {
            let center = clusters[draws.below(6) as usize];
            center.map(|x| x + 0.25 * draws.normal())
        } else {
            anywhere(&mut draws)
        };
        points.push(point);
    }
    points
}

/// Returns uniform points in a box.
pub fn uniform<const D: usize>(seed: u64, n: usize) -> Vec<[f64; D]> {
    let mut draws = Draws::new(seed, Stage::Synthetic, 2);
    (0..n).map(|_| std::array::from_fn(|c| draws.between(0.0, [6.0, 4.0, 3.0][c]))).collect()
}

/// Returns `copies` points at each of `places` random places, each moved by up to `spread`.
pub fn piles<const D: usize>(
    seed: u64,
    places: usize,
    copies: usize,
    spread: f64,
) -> Vec<[f64; D]> {
    let mut draws = Draws::new(seed, Stage::Synthetic, 3);
    let centers: Vec<[f64; D]> = uniform(seed, places);
    (0..places * copies)
        .map(|i| centers[i / copies].map(|x| x + spread * draws.between(-1.0, 1.0)))
        .collect()
}

/// Returns image bounds around `points`, in whole units of `step`.
pub fn image_around<const D: usize>(points: &[[f64; D]], step: f64) -> Bounds<D> {
    if points.is_empty() {
        return Bounds { low: [0.0; D], high: [step; D] };
    }
    let column = |c: usize| points.iter().map(move |p| p[c]);
    let low = |c: usize| column(c).fold(f64::INFINITY, f64::min);
    let high = |c: usize| column(c).fold(f64::NEG_INFINITY, f64::max);
    Bounds {
        low: std::array::from_fn(|c| ((low(c) / step).floor() - 1.0) * step),
        high: std::array::from_fn(|c| ((high(c) / step).ceil() + 1.0) * step),
    }
}
