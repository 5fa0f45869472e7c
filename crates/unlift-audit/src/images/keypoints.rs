//! Keypoints and cameras: what is near a place, where a pinhole camera would see it, and sizes.

use unlift::geometry::camera::Intrinsics;
use unlift::geometry::knn::Knn;
use unlift_vision::pictures::Lens;

/// Keypoints, of which the one nearest to a place is searched within a radius.
pub struct Nearby<'a> {
    /// Absent without keypoints.
    tree: Option<Knn<'a, 2>>,
    radius: f64,
}

impl<'a> Nearby<'a> {
    pub fn new(keypoints: &'a [[f64; 2]], radius: f64) -> Self {
        Self { tree: Knn::new(keypoints).ok(), radius }
    }

    /// Returns the keypoint nearest to `place` within the radius, the first of equal ones, and its squared distance.
    pub fn nearest(&self, place: &[f64; 2]) -> Option<(f64, usize)> {
        let mut nearest = Vec::new();
        self.tree.as_ref()?.nearest_to(*place, 1, &mut nearest);
        let &(distance2, row) = nearest.first()?;
        (distance2 <= self.radius * self.radius).then_some((distance2, row as usize))
    }
}

/// Returns what was expected and found if the size of an image is known, and is not that of its camera.
pub fn other_size(found: Option<[u32; 2]>, camera: [f64; 2]) -> Option<(String, String)> {
    let [width, height] = found?.map(f64::from);
    let expected = format!("{} x {} pixels, as its camera in the model", camera[0], camera[1]);
    ([width, height] != camera).then(|| (expected, format!("{width} x {height}")))
}

/// Returns where a pinhole camera sees what the lens sees at `place`.
pub fn undistorted(lens: &Lens, pinhole: &Intrinsics, place: [f64; 2]) -> Option<[f64; 2]> {
    let flat = lens.undistort(place)?;
    Some([0, 1].map(|c| pinhole.focal[c] * flat[c] + pinhole.principal[c]))
}
