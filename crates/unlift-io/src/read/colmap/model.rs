//! The parts of a COLMAP model that an audit needs.

use super::camera_models::CameraModel;
use crate::read::pose::scaled_rotation;

/// A camera, shared by any number of images.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The id that images refer to.
    pub id: u32,
    /// The camera model.
    pub model: &'static CameraModel,
    /// Width of the images in pixels.
    pub width_px: u64,
    /// Height of the images in pixels.
    pub height_px: u64,
    /// The `model.n_params` parameters, in the order of COLMAP's documentation.
    pub params: Vec<f64>,
}

impl Camera {
    /// Returns focal lengths and principal point in pixels; `None` for a panorama, which has none.
    pub fn pinhole(&self) -> Option<([f64; 2], [f64; 2])> {
        if self.model.name == "EQUIRECTANGULAR" {
            return None;
        }
        let first = if self.model.has_one_focal() { 1 } else { 2 };
        let value = |at: usize| self.params.get(at).copied();
        let focal = [value(0)?, value(first - 1)?];
        let principal = [value(first)?, value(first + 1)?];
        let all = [focal, principal].concat();
        let usable = all.iter().all(|x| x.is_finite()) && focal.iter().all(|&f| f > 0.0);
        usable.then_some((focal, principal))
    }
}

/// A registered image.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The id that tracks refer to. A database may use other ids for the same names.
    pub id: u32,
    /// The path below the image folder, as bytes of the file. It may not be UTF-8.
    pub name: Vec<u8>,
    /// The id of its camera.
    pub camera_id: u32,
    /// The camera center in the world, in units of the model. Not finite if the file has no pose.
    pub center: [f64; 3],
    /// The rotation from world to camera: a world point `x` is at `rotation (x - center)`. Camera
    /// axes point right, down and forward.
    pub rotation: [[f64; 3]; 3],
    /// The number of 2D points, triangulated or not.
    pub n_points2d: u64,
}

impl Image {
    /// Finds the camera of this image in `cameras`, which are sorted by id.
    pub fn camera<'a>(&self, cameras: &'a [Camera]) -> Option<&'a Camera> {
        cameras
            .binary_search_by_key(&self.camera_id, |camera| camera.id)
            .ok()
            .map(|at| &cameras[at])
    }

    /// The unit vector in the world that points up in the photo.
    pub fn up(&self) -> [f64; 3] {
        self.rotation[1].map(|x| -x)
    }
}

/// The points of a model, sorted by id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Ids `(n,)`, ascending and unique.
    pub ids: Vec<u64>,
    /// Coordinates `(n, 3)` in units of the model. Not finite if the file has no position.
    pub positions: Vec<[f64; 3]>,
    /// Colors `(n, 3)`: red, green, blue.
    pub colors: Vec<[u8; 3]>,
    /// The observations of each point, if requested.
    pub tracks: Option<Tracks>,
}

/// The 2D points that observe each point: row `i` is `observations[offsets[i]..offsets[i + 1]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks {
    /// Offsets `(n + 1,)`, ascending from 0.
    pub offsets: Vec<usize>,
    /// Image id and index of the 2D point in that image.
    pub observations: Vec<(u32, u32)>,
}

impl Tracks {
    pub(super) fn new() -> Self {
        Self { offsets: vec![0], observations: Vec::new() }
    }

    /// Returns the observations of the point in `row`.
    ///
    /// # Panics
    /// When there is no such row.
    pub fn row(&self, row: usize) -> &[(u32, u32)] {
        &self.observations[self.offsets[row]..self.offsets[row + 1]]
    }
}

/// Returns the center `-R^T t` and the rotation `R` of a camera with the pose `x_cam = R x + t`,
/// given as a quaternion (w, x, y, z) and `t`. Not finite for a zero quaternion.
pub(super) fn place(quaternion: [f64; 4], t: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    // Divides by the squared norm, because files contain norms such as 0.9999999.
    let (r, norm2) = scaled_rotation(quaternion);
    let c: [f64; 3] =
        std::array::from_fn(|j| -(r[0][j] * t[0] + r[1][j] * t[1] + r[2][j] * t[2]) / norm2);
    (c, r.map(|row| row.map(|x| x / norm2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn center_is_where_the_pose_maps_to_zero() {
        // A rotation by 90 degrees about z: x_cam = (-y, x, z) + t.
        let half = 0.5_f64.sqrt();
        let (c, rotation) = place([half, 0.0, 0.0, half], [1.0, 2.0, 3.0]);
        for (found, expected) in c.iter().zip([-2.0, 1.0, -3.0]) {
            assert!((found - expected).abs() < 1e-12, "{c:?}");
        }
        let turned = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        for (found, expected) in rotation.iter().flatten().zip(turned.iter().flatten()) {
            assert!((found - expected).abs() < 1e-12, "{rotation:?}");
        }
        assert!(place([0.0; 4], [1.0, 2.0, 3.0]).0.iter().all(|x| x.is_nan()));
        assert!(place([1.0, 0.0, 0.0, 0.0], [f64::NAN; 3]).0.iter().all(|x| x.is_nan()));
    }
}
