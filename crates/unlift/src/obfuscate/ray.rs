//! Schemes of half-lines: from one of two centers, which is chosen at random for every point (`ray`) or by a checkerboard of voxels
//! (`ray-voxel`); from one of two anchors of an image (`dcl2d`); and from the center of a map, among decoys (`sphere`).

use super::scheme::{Entry, Lift, Lifted, LocalPoints};
use crate::geometry::vector::{along, dot, squared_distance, sub, widen};
use crate::released::{Obfuscation, Rays};
use crate::seed::{Key, Stage};
use crate::truth::{DropReason, Dropped};
use crate::{Error, OriginalId};
use unlift_attack::parallel;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    title: "Ray cloud, two centers",
    rule: "Each point becomes a ray from one of two published centers; seen from there, the rays are a picture of the scene.",
    color: 3,
    source: "Moon et al., Efficient Privacy-Preserving Visual Localization Using 3D Ray Clouds, CVPR 2024",
    hidden: "the range from the center (1 of 3 coordinates)",
    patents: "US 2025/0329045 A1; PCT application declared by its authors",
    ..Entry::new("ray", Lift::In3d(|points, key, _| lift(points.positions, key)))
};

/// Restarts of k-means (scikit-learn's `n_init` in the authors' code).
const RESTARTS: usize = 10;
/// Maximum number of iterations per restart (scikit-learn's default).
const MAX_ROUNDS: usize = 300;

/// Ray clouds.
fn lift(points: &[[f64; 3]], key: &Key) -> Result<Lifted<3>, Error> {
    let choices = key.stage(Stage::Scheme);
    from_centers(points, key, |row, _| choices.draws(row as u64).below(2) as usize)
}

/// Registry entry of `ray-voxel`.
pub const VOXEL: Entry = Entry {
    name: "ray-voxel",
    title: "Ray cloud, voxel parity",
    rule: "Each point becomes a ray from one of two published centers, by its voxel; seen from there, the rays are a picture of the scene.",
    color: 4,
    patents: "as ray",
    lift: Lift::In3d(|points, key, options| by_voxel(points.positions, key, options.voxel)),
    parameters: |options| vec![("voxel", options.voxel)],
    ..ENTRY
};

/// Ray clouds, voxel variant.
fn by_voxel(points: &[[f64; 3]], key: &Key, voxel: f64) -> Result<Lifted<3>, Error> {
    if !(voxel.is_finite() && voxel > 0.0) {
        return Err(Error::new("voxel", "a positive length", voxel));
    }
    // The grid starts half a voxel below the smallest coordinates, as in Open3D.
    let low = |c: usize| points.iter().map(|point| point[c]).fold(f64::INFINITY, f64::min);
    let start = [0, 1, 2].map(|c| low(c) - 0.5 * voxel);
    from_centers(points, key, |_, point| {
        let cell = |c: usize| ((point[c] - start[c]) / voxel).floor();
        (0..3).map(|c| cell(c).rem_euclid(2.0) as usize).sum::<usize>() % 2
    })
}

/// Returns rays from two centers to every point: those of the best of several runs of k-means, which depend on
/// points and `key` alone. `choose` returns the center of a row.
fn from_centers(
    points: &[[f64; 3]],
    key: &Key,
    choose: impl Fn(usize, &[f64; 3]) -> usize,
) -> Result<Lifted<3>, Error> {
    if points.len() < 2 {
        return Err(Error::new("points", "at least 2 for two centers", points.len()));
    }
    let run = |restart: usize| lloyd(points, spread_start(points, key, restart as u64));
    let runs = parallel::map(RESTARTS, run);
    // The first of equally good runs counts.
    let best = runs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, mut centers) = best.expect("a restart");
    // The order of the centers must not depend on which restart won.
    centers.sort_unstable_by(|a, b| a.partial_cmp(b).expect("finite points"));
    let (rays, hidden, dropped) = rays_from(&centers, points, choose)?;
    Ok(Lifted { hidden, dropped, ..Lifted::one_each(Obfuscation::Rays(rays)) })
}

/// Chooses initial centers with k-means++: the second by its squared distance to the first.
fn spread_start(points: &[[f64; 3]], key: &Key, restart: u64) -> [[f64; 3]; 2] {
    let mut draws = key.draws(Stage::KMeans, restart);
    let first = points[draws.below(points.len() as u64) as usize];
    let weight = |p: &[f64; 3]| squared_distance(p, &first);
    let mut left = draws.unit() * points.iter().map(weight).sum::<f64>();
    let chosen = points.iter().position(|p| {
        left -= weight(p);
        left <= 0.0
    });
    [first, points[chosen.unwrap_or(points.len() - 1)]]
}

/// Returns the sum of squared distances and the centers of Lloyd's algorithm. Sums are in row order.
fn lloyd(points: &[[f64; 3]], mut centers: [[f64; 3]; 2]) -> (f64, [[f64; 3]; 2]) {
    let mut cost = f64::INFINITY;
    for _ in 0..MAX_ROUNDS {
        let (mut sums, mut counts, mut new_cost) = ([[0.0; 3]; 2], [0u64; 2], 0.0);
        for point in points {
            let [first, second] = centers.map(|center| squared_distance(point, &center));
            // The first of equally near centers counts.
            let at = usize::from(second < first);
            new_cost += first.min(second);
            counts[at] += 1;
            sums[at] = along(&sums[at], 1.0, point);
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

/// Returns rays from `centers` to every point, the original of each ray, and the points without one. `choose`
/// returns the center of a row.
fn rays_from<const D: usize>(
    centers: &[[f64; D]],
    points: &[[f64; D]],
    choose: impl Fn(usize, &[f64; D]) -> usize,
) -> Result<(Rays<D>, Vec<OriginalId>, Vec<Dropped>), Error> {
    // Rays start at the stored center, which is rounded to `f32`.
    let centers: Vec<[f64; D]> = centers.iter().map(|c| c.map(|x| f64::from(x as f32))).collect();
    let (mut hidden, mut dropped) = (Vec::new(), Vec::new());
    let (mut center, mut direction) = (Vec::new(), Vec::new());
    for (row, point) in points.iter().enumerate() {
        let original = OriginalId::from_index(row);
        let chosen = choose(row, point);
        let ray = sub(point, &centers[chosen]);
        let length2 = dot(&ray, &ray);
        if length2 <= 1e-24 * dot(point, point) {
            dropped.push(Dropped { original, reason: DropReason::OnCenter });
            continue;
        }
        hidden.push(original);
        center.push(chosen as u8);
        direction.push(ray.map(|x| x / length2.sqrt()));
    }
    Ok((Rays::try_new(&centers, center, &direction)?, hidden, dropped))
}

/// Registry entry of `dcl2d`.
pub const DCL2D: Entry = Entry {
    title: "Dual convergent lines",
    rule: "Each keypoint becomes a ray from the anchor of its half of the image.",
    color: 3,
    source: "Kim et al., Dual Convergent Lines, CVPR 2026",
    hidden: "the range from the anchor (1 of 2 coordinates)",
    patents: "none found",
    ..Entry::new("dcl2d", Lift::In2d(|points, _, _| dual_convergent(points)))
};

/// Dual convergent lines: through one of two anchors, chosen by the half of the image.
///
/// The authors have published no code. This follows the paper, with these assumptions:
///
/// - The split is vertical, at half of the width. The anchors are the two ends of the split: the
///   upper one for the left half, the lower one for the right half. Their distance, the image
///   height, is the one recommended.
/// - A keypoint on the split belongs to the right half.
/// - A keypoint on its anchor has no line and is dropped.
/// - The line reveals its anchor, and so the half. It is therefore released as a ray.
fn dual_convergent(points: &LocalPoints<'_, 2>) -> Result<Lifted<2>, Error> {
    let Some(image) = points.bounds else {
        return Err(Error::new("image size", "known: anchors lie on its border", "none"));
    };
    let center = image.center();
    let half = (image.high[1] - image.low[1]) / 2.0;
    let anchors = [-1.0, 1.0].map(|side| [center[0], center[1] + side * half]);
    let chosen = |_, point: &[f64; 2]| usize::from(point[0] >= center[0]);
    let (mut first, mut second) = (image, image);
    (first.high[0], second.low[0]) = (center[0], center[0]);
    let (rays, hidden, dropped) = rays_from(&anchors, points.positions, chosen)?;
    let rays = Obfuscation::Rays(rays.with_regions(vec![first, second])?);
    Ok(Lifted { hidden, dropped, ..Lifted::one_each(rays) })
}

/// Share of the points that keep their bearing.
const KEPT: f64 = 1.0 / 3.0;
/// Variance of the noise of a decoy, per component of its unit direction.
const VARIANCE: f64 = 0.1;

/// Registry entry of `sphere`.
pub const SPHERE: Entry = Entry {
    title: "Sphere cloud, a third of the bearings real",
    rule: "Each point becomes its bearing from the center of the map, among decoys.",
    color: 7,
    source: "Moon et al., Depth-Guided Privacy-Preserving Visual Localization Using 3D Sphere Clouds, BMVC 2024",
    hidden: "the range from the center (1 of 3 coordinates)",
    patents: "PCT application declared by its authors",
    parameters: |_| vec![("share of real bearings", KEPT)],
    ..Entry::new("sphere", Lift::In3d(|points, key, _| among_decoys(points.positions, key)))
};

/// Sphere clouds: the bearing of every point from the center of the map, among decoys.
///
/// The center is the mean of all points. A share of the points keeps its bearing. The other records
/// are decoys: the bearing of a withheld point with Gaussian noise on each component, brought to
/// length 1, and the descriptor of that point, so that the number of records stays. In the secret, a
/// decoy stands for the point that it withholds; its ray does not pass through it.
///
/// The published code confirms the center and the share. It makes no decoys: the variance of the
/// noise and the source of a decoy's descriptor are assumptions.
fn among_decoys(points: &[[f64; 3]], key: &Key) -> Result<Lifted<3>, Error> {
    let n = points.len();
    if n < 2 {
        return Err(Error::new("points", "at least 2", n));
    }
    let center: [f64; 3] =
        std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f64>() / n as f64);
    let order = key.draws(Stage::Scheme, 0).permutation(n);
    let mut is_decoy = vec![true; n];
    let n_kept = (KEPT * n as f64).round() as usize;
    order[..n_kept].iter().for_each(|&row| is_decoy[row as usize] = false);
    let noise = key.stage(Stage::Scheme);
    let moved = |(direction, &OriginalId(row)): (&[f32; 3], &OriginalId)| {
        let direction = widen(direction);
        if !is_decoy[row as usize] {
            return direction;
        }
        let mut draws = noise.draws(1 + u64::from(row));
        direction.map(|x| x + VARIANCE.sqrt() * draws.normal())
    };
    let (rays, hidden, dropped) = rays_from(&[center], points, |_, _| 0)?;
    let directions: Vec<[f64; 3]> = rays.direction().iter().zip(&hidden).map(moved).collect();
    let centers: Vec<[f64; 3]> = rays.centers().iter().map(widen).collect();
    let rays = Rays::try_new(&centers, rays.center().to_vec(), &directions)?;
    Ok(Lifted { hidden, dropped, ..Lifted::one_each(Obfuscation::Rays(rays)) })
}
