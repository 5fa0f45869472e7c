//! COLMAP models: `cameras`, `images` and `points3D`, as `.bin` or `.txt`.
//!
//! Models written since COLMAP 3.12 have `rigs` and `frames` beside them. They repeat what `images`
//! says about poses, so they are checked ([`check_rigs`], [`check_frames`]) but not needed.
//!
//! Source: COLMAP's documentation, "Output Format".

mod binary;
mod camera_models;
mod text;

use std::path::Path;

pub use camera_models::{CAMERA_MODELS, CameraModel};

use crate::error::Error;

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
    /// Position of the camera's center in the world, in units of the model.
    pub center: [f64; 3],
    /// The direction in the world that is up in the photo, of unit length.
    pub up: [f64; 3],
    /// Number of 2D points, triangulated or not.
    pub n_points2d: u64,
}

/// The points of a model, by ascending id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Ids, `(n,)`, ascending, each once.
    pub ids: Vec<u64>,
    /// Coordinates, `(n, 3)`, in units of the model, all finite.
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
    fn new() -> Self {
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

/// Whether `path` is text, by its extension.
fn is_text(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("txt"))
}

/// Reads `cameras.bin` or `cameras.txt`, by ascending id.
///
/// # Errors
/// When the file cannot be read, is malformed, names an unknown model or repeats an id.
pub fn read_cameras(path: &Path) -> Result<Vec<Camera>, Error> {
    let mut cameras = if is_text(path) { text::cameras(path)? } else { binary::cameras(path)? };
    cameras.sort_by_key(|c| c.id);
    refuse_repeated(path, "camera", cameras.iter().map(|c| u64::from(c.id)))?;
    Ok(cameras)
}

/// Reads `images.bin` or `images.txt`, by ascending id.
///
/// # Errors
/// When the file cannot be read, is malformed, has a pose that is not finite or repeats an id.
pub fn read_images(path: &Path) -> Result<Vec<Image>, Error> {
    let mut images = if is_text(path) { text::images(path)? } else { binary::images(path)? };
    images.sort_by_key(|i| i.id);
    refuse_repeated(path, "image", images.iter().map(|i| u64::from(i.id)))?;
    Ok(images)
}

/// Reads `points3D.bin` or `points3D.txt`, by ascending id; the tracks only `with_tracks`.
///
/// # Errors
/// When the file cannot be read, is malformed, has a coordinate that is not finite (the error names
/// the point) or repeats an id.
pub fn read_points(path: &Path, with_tracks: bool) -> Result<Points, Error> {
    let points = if is_text(path) {
        text::points(path, with_tracks)?
    } else {
        binary::points(path, with_tracks)?
    };
    let points = sorted(points);
    refuse_repeated(path, "point", points.ids.iter().copied())?;
    Ok(points)
}

/// Reads through `rigs.bin` or `rigs.txt`; the number of rigs.
///
/// # Errors
/// When the file cannot be read or is malformed.
pub fn check_rigs(path: &Path) -> Result<u64, Error> {
    if is_text(path) { text::rigs(path) } else { binary::rigs(path) }
}

/// Reads through `frames.bin` or `frames.txt`; the number of frames.
///
/// # Errors
/// When the file cannot be read or is malformed.
pub fn check_frames(path: &Path) -> Result<u64, Error> {
    if is_text(path) { text::frames(path) } else { binary::frames(path) }
}

fn refuse_repeated(
    path: &Path,
    what: &str,
    ascending: impl Iterator<Item = u64>,
) -> Result<(), Error> {
    let mut last = None;
    for id in ascending {
        if last == Some(id) {
            let place = format!("{what} {id}");
            return Err(Error::new(path, place, "each id once", "it again"));
        }
        last = Some(id);
    }
    Ok(())
}

/// Points by ascending id: older COLMAP writes them in the order of a hash map.
fn sorted(points: Points) -> Points {
    if points.ids.is_sorted() {
        return points;
    }
    let mut order: Vec<usize> = (0..points.ids.len()).collect();
    order.sort_by_key(|&row| points.ids[row]);
    let tracks = points.tracks.map(|tracks| {
        let mut sorted = Tracks::new();
        for &row in &order {
            sorted.observations.extend_from_slice(tracks.row(row));
            sorted.offsets.push(sorted.observations.len());
        }
        sorted
    });
    Points {
        ids: order.iter().map(|&row| points.ids[row]).collect(),
        positions: order.iter().map(|&row| points.positions[row]).collect(),
        tracks,
    }
}

/// The center `-R^T t` of a camera whose pose `x_cam = R x + t` is a quaternion (w, x, y, z) and `t`,
/// and where its image's up (the camera's -y) points; `None` when the center is not finite or the
/// quaternion is zero.
fn place([w, x, y, z]: [f64; 4], t: [f64; 3]) -> Option<([f64; 3], [f64; 3])> {
    let norm2 = w * w + x * x + y * y + z * z;
    // Rotating by the conjugate, with the norm divided out once: files hold norms like 0.9999999.
    let r = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ];
    let c: [f64; 3] =
        std::array::from_fn(|j| -(r[0][j] * t[0] + r[1][j] * t[1] + r[2][j] * t[2]) / norm2);
    c.iter().all(|x| x.is_finite()).then(|| (c, r[1].map(|x| -x / norm2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn center_is_where_the_pose_maps_to_zero() {
        // A quarter turn about z: x_cam = (-y, x, z) + t.
        let half = 0.5_f64.sqrt();
        let (c, up) = place([half, 0.0, 0.0, half], [1.0, 2.0, 3.0]).unwrap();
        for (found, expected) in c.iter().zip([-2.0, 1.0, -3.0]) {
            assert!((found - expected).abs() < 1e-12, "{c:?}");
        }
        assert!((up[0] + 1.0).abs() < 1e-12, "{up:?}");
        assert_eq!(place([0.0; 4], [1.0, 2.0, 3.0]), None);
        assert_eq!(place([1.0, 0.0, 0.0, 0.0], [f64::NAN; 3]), None);
    }

    #[test]
    fn unsorted_points_are_sorted_with_their_tracks() {
        let points = Points {
            ids: vec![7, 2],
            positions: vec![[7.0; 3], [2.0; 3]],
            tracks: Some(Tracks {
                offsets: vec![0, 2, 3],
                observations: vec![(7, 0), (7, 1), (2, 0)],
            }),
        };
        let sorted = sorted(points);
        assert_eq!(sorted.ids, [2, 7]);
        assert_eq!(sorted.positions, [[2.0; 3], [7.0; 3]]);
        let tracks = sorted.tracks.unwrap();
        assert_eq!(tracks.row(0), [(2, 0)]);
        assert_eq!(tracks.row(1), [(7, 0), (7, 1)]);
    }
}
