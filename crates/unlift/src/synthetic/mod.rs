//! Procedural maps: a furnished room in meters, and other shapes, for experiments without real
//! data.
//!
//! [`room`] furnishes a room (`room.rs`, `furniture.rs`, `objects.rs`), moves cameras through it
//! and samples visible surfaces (`views.rs`, `sampling.rs`) like structure from motion: dense on
//! texture, sparse on plain walls, noisier with distance, with far outliers and coincident points.
//! Only `+ - * /` and `sqrt` are used, so results are bit-identical on all platforms.

mod furniture;
mod objects;
mod purpose;
mod room;
mod sampling;
mod shapes;
mod surfaces;
mod texture;
mod tiled;
pub mod vectors;
mod views;

use vectors::rotate;

pub use sampling::{COINCIDENT_SHARE, OUTLIER_SHARE};
pub use shapes::{Shape, keypoints, shape};
pub use texture::{Material, Sheet};
pub use tiled::tiled;
pub use views::Camera;

/// Number of points of the demo's room.
pub const DEFAULT_N_POINTS: usize = 20_000;

/// Tangent of half the angle (17.06 degrees) between walls and axes. Real maps are not aligned with
/// their walls, and axis-wise schemes must not benefit from alignment.
const HALF_YAW_TANGENT: f64 = 0.15;

/// Map of a furnished room in meters; `z` points up, and the origin is the middle of the floor.
#[derive(Clone, Debug, PartialEq)]
pub struct Room {
    /// Points, `(n, 3)`, in random order.
    pub points: Vec<[f64; 3]>,
    /// Cameras of the photos, in the order of the walk.
    pub cameras: Vec<Camera>,
    /// Visible surfaces.
    pub sheets: Vec<Sheet>,
}

/// Creates the room of `seed` with `n_points` points. Size (about 5 x 4 x 2.6 m), arrangement,
/// objects and cameras depend on the seed.
///
/// ```
/// let room = unlift::synthetic::room(0, 1_000);
/// assert_eq!(room.points.len(), 1_000);
/// ```
pub fn room(seed: u64, n_points: usize) -> Room {
    let scene = room::furnished(seed);
    let mut cameras = views::walk(seed, &scene);
    let mut points = sampling::points(seed, n_points, &scene, &cameras);

    let middle = [0.5 * scene.size[0], 0.5 * scene.size[1], 0.0];
    let yaw = vectors::turn(HALF_YAW_TANGENT);
    let in_frame =
        |p: [f64; 3]| rotate(yaw, [p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]]);
    for point in &mut points {
        *point = in_frame(*point);
    }
    for camera in &mut cameras {
        camera.center = in_frame(camera.center);
        camera.look = rotate(yaw, camera.look);
    }
    let sheets = scene.surfaces.iter().map(|surface| surface.in_frame(middle, yaw)).collect();
    Room { points, cameras, sheets }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Returns the points relative to the room's middle, with axes along its walls.
    fn along_walls(room: &Room) -> Vec<[f64; 3]> {
        let [cos, sin] = vectors::turn(HALF_YAW_TANGENT);
        room.points.iter().map(|&p| rotate([cos, -sin], p)).collect()
    }

    #[test]
    fn same_seed_same_bits_and_other_seed_other_room() {
        assert_eq!(room(3, 500), room(3, 500));
        assert_ne!(room(3, 500), room(4, 500));
    }

    #[test]
    fn bits_are_pinned() {
        // A change here changes every published figure of the demo.
        let sum = room(0, 300)
            .points
            .iter()
            .flatten()
            .fold(0u64, |sum, x| sum.rotate_left(7) ^ x.to_bits());
        assert_eq!(sum, 1_841_576_596_771_213_161);
    }

    #[test]
    fn any_number_of_points_can_be_asked_for() {
        for n in [0, 1, 2, 51, 3_000] {
            let room = room(0, n);
            assert_eq!(room.points.len(), n);
            assert!(room.points.iter().flatten().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn three_percent_are_exact_copies() {
        let room = room(0, 10_000);
        let distinct: HashSet<[u64; 3]> = room.points.iter().map(|p| p.map(f64::to_bits)).collect();
        assert_eq!(room.points.len() - distinct.len(), 300);
    }

    #[test]
    fn outliers_lie_outside_and_the_rest_inside() {
        for seed in 0..4 {
            let points = along_walls(&room(seed, 10_000));
            let outside =
                |p: &&[f64; 3]| p[0].abs() > 3.0 || p[1].abs() > 2.5 || p[2] < -0.3 || p[2] > 3.2;
            let n_outside = points.iter().filter(outside).count();
            // A few outliers fall within the room; copies of outliers count again.
            assert!((100..=170).contains(&n_outside), "seed {seed}: {n_outside}");
        }
    }

    #[test]
    fn the_room_is_five_by_four_by_two_and_a_half_meters() {
        for seed in 0..4 {
            let points = along_walls(&room(seed, 10_000));
            for (axis, expected) in [(0, 5.0), (1, 4.0), (2, 2.6)] {
                let mut column: Vec<f64> = points.iter().map(|p| p[axis]).collect();
                column.sort_unstable_by(f64::total_cmp);
                let extent = column[9_800] - column[200];
                assert!((extent - expected).abs() < 0.7, "seed {seed}, axis {axis}: {extent}");
            }
        }
    }

    #[test]
    fn neighbors_are_as_near_as_in_a_real_map() {
        let room = room(0, DEFAULT_N_POINTS);
        let (mut first, mut fiftieth) = (Vec::new(), Vec::new());
        for p in room.points.iter().step_by(40) {
            let mut squared: Vec<f64> = room
                .points
                .iter()
                .map(|q| (0..3).map(|c| (p[c] - q[c]) * (p[c] - q[c])).sum())
                .collect();
            squared.sort_unstable_by(f64::total_cmp);
            first.push(squared[1].sqrt());
            fiftieth.push(squared[50].sqrt());
        }
        let median = |mut column: Vec<f64>| {
            column.sort_unstable_by(f64::total_cmp);
            column[column.len() / 2]
        };
        let (first, fiftieth) = (median(first), median(fiftieth));
        assert!((0.008..0.02).contains(&first), "nearest: {first} m");
        assert!((0.07..0.13).contains(&fiftieth), "50th: {fiftieth} m");
    }

    #[test]
    fn cameras_stand_in_the_room_and_look_along_unit_vectors() {
        let room = room(1, 100);
        assert!(room.cameras.len() >= 30);
        for camera in &room.cameras {
            let norm: f64 = camera.look.iter().map(|x| x * x).sum();
            assert!((norm - 1.0).abs() < 1e-12);
            assert!(camera.center.iter().all(|x| x.abs() < 2.8));
        }
    }
}
