//! Pinhole camera without distortion.

use unlift::synthetic::Camera;

use unlift::synthetic::vectors::{cross, dot, sub, unit};

/// Focal length of a photo in widths: a field of view of 60 degrees from left to right, as in phone
/// videos.
const FOCAL: f64 = 0.85;

#[derive(Clone, Debug)]
pub(crate) struct Pinhole {
    pub(crate) center: [f64; 3],
    /// Rows: right, down, forward.
    pub(crate) rotation: [[f64; 3]; 3],
    pub(crate) focal: f64,
    pub(crate) size: [usize; 2],
}

impl Pinhole {
    pub(crate) fn handheld(camera: &Camera, size: [usize; 2]) -> Self {
        let right = unit(cross(camera.look, [0.0, 0.0, 1.0]));
        let rotation = [right, cross(camera.look, right), camera.look];
        Self { center: camera.center, rotation, focal: FOCAL * size[0] as f64, size }
    }

    /// Returns the same camera with `times` as many pixels per side.
    pub(crate) fn finer(&self, times: usize) -> Self {
        let (focal, size) = (self.focal * times as f64, self.size.map(|side| side * times));
        Self { focal, size, ..*self }
    }

    /// Rotates a direction from the world to the camera frame.
    pub(crate) fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| dot(row, v))
    }

    /// Returns the direction through a place in the photo, with z = 1. The corner of the photo is
    /// (0, 0).
    pub(crate) fn ray(&self, place: [f64; 2]) -> [f64; 3] {
        let [x, y] = [0, 1].map(|c| (place[c] - 0.5 * self.size[c] as f64) / self.focal);
        [x, y, 1.0]
    }

    /// Projects a point. Returns its place in the photo and its depth if the photo contains it.
    pub(crate) fn project(&self, point: [f64; 3]) -> Option<([f64; 2], f64)> {
        let [x, y, z] = self.turned(sub(point, self.center));
        if z <= 0.0 {
            return None;
        }
        let place = [0, 1].map(|c| [x, y][c] / z * self.focal + 0.5 * self.size[c] as f64);
        let inside = (0..2).all(|c| place[c] >= 0.0 && place[c] < self.size[c] as f64);
        inside.then_some((place, z))
    }

    /// Rotates a direction from [`ray`](Self::ray) to the world frame.
    pub(crate) fn in_world(&self, ray: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|c| (0..3).map(|row| self.rotation[row][c] * ray[row]).sum())
    }
}
