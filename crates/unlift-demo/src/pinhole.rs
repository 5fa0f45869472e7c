//! A camera without distortion.

use unlift::synthetic::Camera;

use unlift::synthetic::vectors::{cross, dot, sub, unit};

/// Focal length of a photo in widths: 60 degrees from left to right, as a phone's video.
const FOCAL: f64 = 0.85;

#[derive(Clone, Debug)]
pub(crate) struct Pinhole {
    pub(crate) center: [f64; 3],
    /// Rows: to the right, down, ahead.
    pub(crate) rotation: [[f64; 3]; 3],
    /// In pixels.
    pub(crate) focal: f64,
    pub(crate) size: [usize; 2],
}

impl Pinhole {
    /// A photo taken upright.
    pub(crate) fn handheld(camera: &Camera, size: [usize; 2]) -> Self {
        let right = unit(cross(camera.look, [0.0, 0.0, 1.0]));
        let rotation = [right, cross(camera.look, right), camera.look];
        Self { center: camera.center, rotation, focal: FOCAL * size[0] as f64, size }
    }

    /// The same with so many times as many pixels a side.
    pub(crate) fn finer(&self, times: usize) -> Self {
        let (focal, size) = (self.focal * times as f64, self.size.map(|side| side * times));
        Self { focal, size, ..*self }
    }

    /// A direction of the world as seen from here.
    pub(crate) fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| dot(row, v))
    }

    /// The direction from the camera through a place in the photo, one unit ahead: the corner of the photo is (0, 0).
    pub(crate) fn ray(&self, place: [f64; 2]) -> [f64; 3] {
        let [x, y] = [0, 1].map(|c| (place[c] - 0.5 * self.size[c] as f64) / self.focal);
        [x, y, 1.0]
    }

    /// Where a point is in the photo, and how far ahead of the camera, if it is in it.
    pub(crate) fn project(&self, point: [f64; 3]) -> Option<([f64; 2], f64)> {
        let [x, y, z] = self.turned(sub(point, self.center));
        if z <= 0.0 {
            return None;
        }
        let place = [0, 1].map(|c| [x, y][c] / z * self.focal + 0.5 * self.size[c] as f64);
        let inside = (0..2).all(|c| place[c] >= 0.0 && place[c] < self.size[c] as f64);
        inside.then_some((place, z))
    }

    /// The direction in the world of what [`ray`](Self::ray) gives.
    pub(crate) fn in_world(&self, ray: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|c| (0..3).map(|row| self.rotation[row][c] * ray[row]).sum())
    }
}
