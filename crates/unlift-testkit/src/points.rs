//! Points for tests, and their distances to records.

use unlift::geometry::frame::Bounds;
use unlift::geometry::vector::{along, distance, dot, sub, widen};
use unlift::released::Obfuscation;
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

/// Returns the distance of `point` to the feasible set of `record`.
pub fn distance_to_record<const D: usize>(
    obfuscation: &Obfuscation<D>,
    record: usize,
    point: &[f64; D],
) -> f64 {
    let from_line = |through: &[f32; D], direction: &[f32; D], floor: f64| {
        let (through, direction) = (widen(through), widen(direction));
        let t = dot(&sub(point, &through), &direction) / dot(&direction, &direction);
        distance(point, &along(&through, t.max(floor), &direction))
    };
    match obfuscation {
        Obfuscation::Lines(lines) => {
            from_line(&lines.foot()[record], &lines.direction()[record], f64::NEG_INFINITY)
        }
        Obfuscation::Rays(rays) => {
            let center = rays.centers()[usize::from(rays.center()[record])];
            from_line(&center, &rays.direction()[record], 0.0)
        }
        Obfuscation::AxisPlanes(planes) => {
            let axis = usize::from(planes.axis()[record]);
            (point[axis] - f64::from(planes.offset()[record])).abs()
        }
        Obfuscation::AxisCandidates(candidates) => {
            let off = sub(point, &widen(&candidates.position()[record]));
            let along = |axis: usize| {
                (0..D).filter(|&c| c != axis).map(|c| off[c] * off[c]).sum::<f64>().sqrt()
            };
            (0..D).map(along).fold(f64::INFINITY, f64::min)
        }
    }
}
