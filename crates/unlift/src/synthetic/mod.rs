//! Procedural maps: a furnished room in meters, for experiments without real data.
//!
//! [`room`] furnishes a room (`room.rs`, `furniture.rs`), moves cameras through it
//! and samples visible surfaces (`sampling.rs`) like structure from motion: dense on
//! texture, sparse on plain walls, noisier with distance, with far outliers and coincident points.
//! Only `+ - * /` and `sqrt` are used, so results are bit-identical on all platforms.

mod furniture;
mod room;
mod sampling;
mod surfaces;

use crate::geometry::vector::sub;
use crate::seed::{Draws, Stage};
use surfaces::{rotate, turn};

pub use sampling::Camera;

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
}

/// Creates the room of `seed` with `n_points` points. Size (about 5 x 4 x 2.6 m), arrangement, objects and cameras depend on the seed.
///
/// ```
/// let room = unlift::synthetic::room(0, 1_000);
/// assert_eq!(room.points.len(), 1_000);
/// ```
pub fn room(seed: u64, n_points: usize) -> Room {
    let scene = room::furnished(seed);
    let mut cameras = sampling::walk(seed, &scene);
    let mut points = sampling::points(seed, n_points, &scene, &cameras);

    let middle = [0.5 * scene.size[0], 0.5 * scene.size[1], 0.0];
    let yaw = turn(HALF_YAW_TANGENT);
    let in_frame = |p: [f64; 3]| rotate(yaw, sub(&p, &middle));
    points.iter_mut().for_each(|point| *point = in_frame(*point));
    for camera in &mut cameras {
        camera.center = in_frame(camera.center);
        camera.look = rotate(yaw, camera.look);
    }
    Room { points, cameras }
}

/// Purpose of a stream of random numbers.
enum Purpose {
    Layout = 0,
    Texture = 1,
    Walk = 2,
    Copies = 3,
    Order = 4,
    FirstPoint = 16,
}

fn draws(seed: u64, purpose: Purpose, item: usize) -> Draws {
    Draws::new(seed, Stage::Synthetic, purpose as u64 + item as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_pinned_and_any_number_of_points_can_be_asked_for() {
        // A change here changes every published figure of this room.
        let points = room(0, 300).points;
        let sum = points.iter().flatten().fold(0u64, |sum, x| sum.rotate_left(7) ^ x.to_bits());
        assert_eq!(sum, 1_841_576_596_771_213_161);
        for n in [0, 1, 2, 51, 3_000] {
            let points = room(0, n).points;
            assert!(points.len() == n && points.iter().flatten().all(|x| x.is_finite()));
        }
    }
}
