//! Pose estimation from matches with points or with records: robust least squares.

use nalgebra::{Matrix6, Vector6};

use crate::geometry::camera::{Camera, Intrinsics};
use crate::geometry::vector::{cross, distance, dot, sub};
use crate::seed::{Draws, Stage};

/// A match of a keypoint, in pixels of the pinhole, with a point; one may be known up to a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// The keypoint, or any place on its line.
    pub place: [f64; 2],
    /// The point, or any point of its line.
    pub point: [f64; 3],
    /// Direction of the line.
    pub line: Option<OnLine>,
}

/// Direction of a line that one side of a match lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OnLine {
    /// The direction of a line in space through the point.
    OfMap([f64; 3]),
    /// The direction of a line in the image through the keypoint.
    OfImage([f64; 2]),
}

/// Residuals up to this many pixels are inliers.
const INLIER: f64 = 4.0;
/// Scales of the robust loss in pixels, from the first to the last rounds.
const SCALES: [f64; 6] = [64.0, 32.0, 16.0, 8.0, 4.0, 2.0];
/// Iterations per scale.
const ITERATIONS: usize = 6;
/// Number of perturbed starts.
const STARTS: u64 = 10;
/// Fewest matches with which a pose is estimated.
const FEWEST: usize = 6;

impl Match {
    /// Returns the residuals in pixels, and their number; `None` if the point is behind the camera.
    fn residuals(&self, camera: &Camera) -> Option<([f64; 2], usize)> {
        let Self { place, point, line } = self;
        let (off, length) = match line {
            None => return Some((sub(&camera.project(point)?, place), 2)),
            Some(OnLine::OfMap(direction)) => {
                let x = camera.pose.in_camera(point);
                let d = camera.pose.rotation.map(|row| dot(&row, direction));
                let Intrinsics { focal, principal } = &camera.intrinsics;
                // The plane through the camera and the line, as a line in pixels.
                let plane = cross(&x, &d);
                let (a, b) = (plane[0] / focal[0], plane[1] / focal[1]);
                let away = sub(place, principal);
                (a * away[0] + b * away[1] + plane[2], libm::hypot(a, b))
            }
            Some(OnLine::OfImage(direction)) => {
                let away = sub(&camera.project(point)?, place);
                let off = away[0] * direction[1] - away[1] * direction[0];
                (off, libm::hypot(direction[0], direction[1]))
            }
        };
        (length > 0.0).then_some(([off / length, 0.0], 1))
    }
}

/// Estimates the pose from `matches`, some of which are wrong. Starts from the pose of `start`, as
/// retrieval gives, and from ten perturbed ones; `reach` is the standard deviation of their centers.
/// Returns the estimate with the most inliers and their number; `None` with too few matches.
///
/// The loss is Cauchy's with a decreasing scale, at last truncated at 4 pixels.
pub fn estimate(
    start: &Camera,
    matches: &[Match],
    reach: f64,
    seed: u64,
) -> Option<(Camera, usize)> {
    if matches.len() < FEWEST {
        return None;
    }
    let mut best: Option<(Camera, usize)> = None;
    for at in 0..=STARTS {
        let mut draws = Draws::new(seed, Stage::Localization, at);
        let amount = if at == 0 { 0.0 } else { 1.0 };
        let by =
            std::array::from_fn(|c| amount * draws.normal() * if c < 3 { 0.15 } else { reach });
        let mut camera = moved(start, &by);
        for scale in SCALES {
            refine(&mut camera, matches, |r| 1.0 / (1.0 + (r / scale) * (r / scale)));
        }
        refine(&mut camera, matches, |r| f64::from(u8::from(r < INLIER)));
        let is_inlier = |input: &&Match| size(input, &camera).is_some_and(|r| r < INLIER);
        let n = matches.iter().filter(is_inlier).count();
        if best.as_ref().is_none_or(|(_, max)| n > *max) {
            best = Some((camera, n));
        }
    }
    best
}

fn moved(camera: &Camera, by: &[f64; 6]) -> Camera {
    Camera { pose: camera.pose.moved(by), ..*camera }
}

fn size(input: &Match, camera: &Camera) -> Option<f64> {
    input.residuals(camera).map(|(r, _)| libm::hypot(r[0], r[1]))
}

/// Improves the pose by Levenberg-Marquardt; `weight` is that of a residual in pixels.
fn refine(camera: &mut Camera, matches: &[Match], weight: impl Fn(f64) -> f64) {
    let depths = matches.iter().map(|input| distance(&input.point, &camera.pose.center));
    let depth = depths.sum::<f64>() / matches.len() as f64;
    let mut damping = 1e-4;
    for _ in 0..ITERATIONS {
        let weights: Vec<f64> =
            matches.iter().map(|input| size(input, camera).map_or(0.0, &weight)).collect();
        let cost = |camera: &Camera| {
            let of = |(input, weight): (&Match, &f64)| match size(input, camera) {
                Some(r) => weight * r * r,
                // Moving a point behind the camera must not pay.
                None => weight * 1e6,
            };
            matches.iter().zip(&weights).map(of).sum::<f64>()
        };
        let mut normal = Matrix6::zeros();
        let mut slope = Vector6::zeros();
        let steps: [f64; 6] = std::array::from_fn(|c| if c < 3 { 1e-6 } else { 1e-6 * depth });
        let all_moved: [Camera; 6] = std::array::from_fn(|c| {
            moved(camera, &std::array::from_fn(|k| if k == c { steps[c] } else { 0.0 }))
        });
        for (input, weight) in matches.iter().zip(&weights) {
            let Some((r, n)) = input.residuals(camera).filter(|_| *weight > 0.0) else { continue };
            let mut rows = [Vector6::zeros(); 2];
            for c in 0..6 {
                let Some((after, _)) = input.residuals(&all_moved[c]) else { continue };
                (0..2).for_each(|k| rows[k][c] = (after[k] - r[k]) / steps[c]);
            }
            for k in 0..n {
                normal += rows[k] * rows[k].transpose() * *weight;
                slope += rows[k] * (r[k] * weight);
            }
        }
        let before = cost(camera);
        let mut improved = false;
        for _ in 0..4 {
            let mut damped = normal;
            (0..6).for_each(|c| damped[(c, c)] *= 1.0 + damping);
            let Some(step) = damped.cholesky().map(|factor| factor.solve(&-slope)) else {
                damping = (damping * 100.0).max(1e-6);
                continue;
            };
            let next = moved(camera, &std::array::from_fn(|c| step[c]));
            if cost(&next) < before {
                improved = (before - cost(&next)) > 1e-9 * before;
                (*camera, damping) = (next, damping * 0.1);
                break;
            }
            damping *= 10.0;
        }
        if !improved {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::{Pose, PoseError};
    use crate::geometry::vector::along;

    #[test]
    fn poses_are_found_among_wrong_matches() {
        let intrinsics = Intrinsics { focal: [500.0, 510.0], principal: [320.0, 240.0] };
        let pose = Pose { center: [0.2, -0.1, 0.3], ..Pose::IDENTITY };
        let truth = Camera { intrinsics, pose };
        // 120 matches with half a pixel of noise, every third of them wrong.
        let matches = |kind: &str| -> Vec<Match> {
            let mut draws = Draws::new(5, Stage::Shapes, 0);
            let mut of = |at: usize| {
                let point =
                    [(-2.0, 2.0), (-1.5, 1.5), (3.0, 6.0)].map(|(a, b)| draws.between(a, b));
                let mut place = truth.project(&point).unwrap().map(|x| x + 0.5 * draws.normal());
                if at.is_multiple_of(3) {
                    place = [640.0, 480.0].map(|side| draws.between(0.0, side));
                }
                match kind {
                    "point" => Match { place, point, line: None },
                    "map" => {
                        let direction: [f64; 3] = draws.direction();
                        let line = Some(OnLine::OfMap(direction));
                        Match { place, point: along(&point, 1.7, &direction), line }
                    }
                    _ => {
                        let direction: [f64; 2] = draws.direction();
                        let line = Some(OnLine::OfImage(direction));
                        Match { place: along(&place, 90.0, &direction), point, line }
                    }
                }
            };
            (0..120).map(&mut of).collect()
        };
        let start = moved(&truth, &[0.1, -0.15, 0.1, 0.4, -0.3, 0.3]);
        // Errors of lines are larger, and wrong matches of lines are inliers more often.
        for (kind, most) in [("point", 0.01), ("map", 0.02), ("image", 0.02)] {
            let (found, inliers) = estimate(&start, &matches(kind), 0.3, 0).unwrap();
            let PoseError { center, rotation_degrees: angle } = found.pose.error(&truth.pose);
            assert!(center < most && angle < 0.3, "{kind}: {center} m, {angle} degrees");
            assert!((78..=95).contains(&inliers), "{kind}: {inliers}");
        }
        assert_eq!(estimate(&start, &matches("point")[..5], 0.3, 0), None);
        let moved = truth.pose.moved(&[0.0, 0.02, 0.0, 0.3, 0.0, -0.4]);
        let PoseError { center, rotation_degrees: angle } = moved.error(&truth.pose);
        assert!((center - 0.5).abs() < 1e-12 && (angle - 0.02_f64.to_degrees()).abs() < 1e-9);
    }
}
