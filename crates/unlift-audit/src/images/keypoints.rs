//! Keypoints and lenses: what is near a place, and where a pinhole camera would see it.

use std::collections::HashMap;

use unlift::geometry::camera::Intrinsics;
use unlift::geometry::vector::squared_distance;
use unlift_vision::pictures::Lens;

/// Keypoints in buckets of the size of a search radius.
pub struct Nearby<'a> {
    keypoints: &'a [[f64; 2]],
    radius: f64,
    buckets: HashMap<[i64; 2], Vec<usize>>,
}

impl<'a> Nearby<'a> {
    pub fn new(keypoints: &'a [[f64; 2]], radius: f64) -> Self {
        let mut nearby = Self { keypoints, radius, buckets: HashMap::new() };
        for (row, place) in keypoints.iter().enumerate() {
            let bucket = nearby.bucket(place);
            nearby.buckets.entry(bucket).or_default().push(row);
        }
        nearby
    }

    fn bucket(&self, place: &[f64; 2]) -> [i64; 2] {
        place.map(|x| (x / self.radius).floor() as i64)
    }

    /// Returns the keypoint nearest to `place` within the radius, the first of equal ones, and its squared distance.
    pub fn nearest(&self, place: &[f64; 2]) -> Option<(f64, usize)> {
        let [x, y] = self.bucket(place);
        let offsets = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
        let near = offsets.map(|(dx, dy)| [x.saturating_add(dx), y.saturating_add(dy)]);
        let rows = near.filter_map(|bucket| self.buckets.get(&bucket)).flatten().copied();
        let rows = rows.map(|row| (squared_distance(&self.keypoints[row], place), row));
        let nearest = rows.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        (nearest.0 <= self.radius * self.radius).then_some(nearest)
    }
}

/// Returns where a pinhole camera sees what the lens sees at `place`.
pub fn undistorted(lens: &Lens, pinhole: &Intrinsics, place: [f64; 2]) -> Option<[f64; 2]> {
    let flat = lens.undistort(place)?;
    Some([0, 1].map(|c| pinhole.focal[c] * flat[c] + pinhole.principal[c]))
}
