//! What a COLMAP model holds, as far as an audit needs it.

use super::camera_models::CameraModel;
use crate::read::pose::scaled_rotation;

/// One camera: a lens and a sensor, shared by any number of images.
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
    /// Parameters, `model.n_params` of them, in the order COLMAP documents.
    pub params: Vec<f64>,
}

/// One registered image: what an audit needs of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The id that tracks refer to. A database may use other ids for the same names.
    pub id: u32,
    /// The name, a path below the image folder, as the bytes in the file (UTF-8 or not).
    pub name: Vec<u8>,
    /// The id of its camera.
    pub camera_id: u32,
    /// Position of the camera's center in the world, in units of the model; not finite where the file gives no pose.
    pub center: [f64; 3],
    /// How the camera is turned: a point `x` of the world is at `rotation (x - center)` from the camera, whose axes
    /// point to the right, down and ahead.
    pub rotation: [[f64; 3]; 3],
    /// Number of 2D points, triangulated or not.
    pub n_points2d: u64,
}

impl Image {
    /// Its camera among `cameras`, which are by ascending id.
    pub fn camera<'a>(&self, cameras: &'a [Camera]) -> Option<&'a Camera> {
        cameras
            .binary_search_by_key(&self.camera_id, |camera| camera.id)
            .ok()
            .map(|at| &cameras[at])
    }

    /// The direction in the world that is up in the photo, of unit length.
    pub fn up(&self) -> [f64; 3] {
        self.rotation[1].map(|x| -x)
    }
}

/// The points of a model, by ascending id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Ids, `(n,)`, ascending, each once.
    pub ids: Vec<u64>,
    /// Coordinates, `(n, 3)`, in units of the model, not finite where the file gives no place.
    pub positions: Vec<[f64; 3]>,
    /// Observations of each point, when they were asked for.
    pub tracks: Option<Tracks>,
}

/// Which 2D points see each point: row `i` is `observations[offsets[i]..offsets[i + 1]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks {
    /// `(n + 1,)`, from 0, ascending.
    pub offsets: Vec<usize>,
    /// Image id and index of the 2D point in that image.
    pub observations: Vec<(u32, u32)>,
}

impl Tracks {
    pub(super) fn new() -> Self {
        Self { offsets: vec![0], observations: Vec::new() }
    }

    /// Observations of the point in `row`.
    ///
    /// # Panics
    /// When there is no such row.
    pub fn row(&self, row: usize) -> &[(u32, u32)] {
        &self.observations[self.offsets[row]..self.offsets[row + 1]]
    }
}

/// The center `-R^T t` of a camera whose pose `x_cam = R x + t` is a quaternion (w, x, y, z) and `t`,
/// and `R`; not finite when a number is not or the quaternion is zero.
pub(super) fn place(quaternion: [f64; 4], t: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    // Rotating by the conjugate, with the norm divided out once: files hold norms like 0.9999999.
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
        // A quarter turn about z: x_cam = (-y, x, z) + t.
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
