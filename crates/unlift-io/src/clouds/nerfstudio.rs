//! Cameras as nerfstudio's `transforms.json`.
//!
//! Source: nerfstudio's documentation, "Data conventions". Its cameras look along -z with y up.
//! Poses map from camera to world.

use std::io::Write;
use std::path::Path;

use serde_json::{Map, Value, json};

use crate::Error;
use crate::atomic::{self, Access};
use crate::read::colmap::{Camera, Image};

/// The name of the point cloud beside the cameras, as in nerfstudio's own programs.
pub const NERFSTUDIO_CLOUD: &str = "sparse_pc.ply";

/// Writes `transforms.json` for these images and their `cameras`. The point cloud is a separate
/// file.
///
/// # Errors
/// When there is no image, a name is not UTF-8, nerfstudio does not support a camera model, the
/// images need two camera models, or the file cannot be written.
pub fn write_transforms(path: &Path, cameras: &[Camera], images: &[Image]) -> Result<(), Error> {
    let mut model = None;
    let mut frames = Vec::with_capacity(images.len());
    for image in images {
        let wrong = |expected: &str, found: String| {
            Error::new(path, format!("image {}", image.id), expected, found)
        };
        let name = std::str::from_utf8(&image.name);
        let name = name.map_err(|_| wrong("a name that is text", "other bytes".to_owned()))?;
        let camera = cameras.iter().find(|camera| camera.id == image.camera_id);
        let camera =
            camera.ok_or_else(|| wrong("a camera", format!("no camera {}", image.camera_id)))?;
        let (kind, mut frame) = lens(camera)
            .ok_or_else(|| wrong("a camera model of nerfstudio", camera.model.name.to_owned()))?;
        let known = *model.get_or_insert(kind);
        if known != kind {
            return Err(wrong(&format!("one camera model, {known}"), kind.to_owned()));
        }
        let row = |c: usize| {
            let r = &image.rotation;
            [r[0][c], -r[1][c], -r[2][c], image.center[c]]
        };
        let matrix = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
        frame.insert("file_path".into(), json!(name));
        frame.insert("transform_matrix".into(), json!(matrix));
        frames.push(Value::Object(frame));
    }
    let Some(model) = model else {
        return Err(Error::new(path, "", "at least one image", "none"));
    };
    let document = json!({
        "unlift": env!("CARGO_PKG_VERSION"),
        "camera_model": model,
        "ply_file_path": NERFSTUDIO_CLOUD,
        "frames": frames,
    });
    let text = serde_json::to_string_pretty(&document)
        .map_err(|error| Error::write(path, error.into()))?;
    atomic::write_file(path, Access::Private, |w| writeln!(w, "{text}"))
}

/// Returns nerfstudio's camera model and its parameters by name, if it has such a model.
fn lens(camera: &Camera) -> Option<(&'static str, Map<String, Value>)> {
    let p = &camera.params;
    // Focal lengths and principal point, then k1, k2, p1, p2, or k1 to k4 of a fisheye.
    let (kind, four, rest) = match camera.model.name {
        "SIMPLE_PINHOLE" => ("OPENCV", [p[0], p[0], p[1], p[2]], &[][..]),
        "PINHOLE" => ("OPENCV", [p[0], p[1], p[2], p[3]], &[][..]),
        "SIMPLE_RADIAL" | "RADIAL" => ("OPENCV", [p[0], p[0], p[1], p[2]], &p[3..]),
        "OPENCV" => ("OPENCV", [p[0], p[1], p[2], p[3]], &p[4..]),
        "OPENCV_FISHEYE" => ("OPENCV_FISHEYE", [p[0], p[1], p[2], p[3]], &p[4..]),
        _ => return None,
    };
    let distortion = match kind {
        "OPENCV" => ["k1", "k2", "p1", "p2"],
        _ => ["k1", "k2", "k3", "k4"],
    };
    let mut numbers = Map::new();
    numbers.insert("w".into(), json!(camera.width_px));
    numbers.insert("h".into(), json!(camera.height_px));
    let names = ["fl_x", "fl_y", "cx", "cy"].into_iter().zip(four);
    let rest = rest.iter().copied().chain(std::iter::repeat(0.0));
    for (name, value) in names.chain(distortion.into_iter().zip(rest)) {
        numbers.insert(name.into(), json!(value));
    }
    Some((kind, numbers))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clouds::write_points;
    use crate::read::{self, colmap::CameraModel};

    fn camera(id: u32, name: &[u8], params: &[f64]) -> Camera {
        let model = CameraModel::from_name(name).unwrap();
        Camera { id, model, width_px: 640, height_px: 480, params: params.to_vec() }
    }

    /// An image rotated by 90 degrees about its viewing direction.
    fn image(id: u32, camera_id: u32) -> Image {
        let rotation = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let center = [f64::from(id), 2.0, -5.0];
        Image {
            id,
            name: format!("{id}.png").into_bytes(),
            camera_id,
            center,
            rotation,
            n_points2d: 0,
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("transforms.json");
        let cameras = [
            camera(1, b"SIMPLE_RADIAL", &[500.0, 320.0, 240.0, 0.1]),
            camera(2, b"OPENCV", &[500.0, 501.0, 320.0, 240.0, 0.1, 0.2, 0.3, 0.4]),
        ];
        write_transforms(&path, &cameras, &[image(1, 1), image(2, 2)]).unwrap();
        let points = [[1.0, 2.0, 3.0], [-1.0, 0.5, 1e6]];
        write_points(&folder.path().join(NERFSTUDIO_CLOUD), &points, None).unwrap();
        let map = read::open(&path).unwrap();
        assert_eq!((map.format, &map.positions[..]), ("nerfstudio", &points[..]));
        assert_eq!(map.cameras, [[1.0, 2.0, -5.0], [2.0, 2.0, -5.0]]);
        assert_eq!(map.up, Some([-1.0, 0.0, 0.0]));
        let text = std::fs::read_to_string(&path).unwrap();
        let document: Value = serde_json::from_str(&text).unwrap();
        let of = |frame: usize, name: &str| document["frames"][frame][name].as_f64();
        assert_eq!([of(0, "fl_y"), of(0, "k1"), of(0, "k2")], [Some(500.0), Some(0.1), Some(0.0)]);
        assert_eq!([of(1, "fl_y"), of(1, "p2"), of(1, "w")], [Some(501.0), Some(0.4), Some(640.0)]);
    }

    #[test]
    fn lenses_that_nerfstudio_lacks_are_refused() {
        let line = |cameras: &[Camera], images: &[Image]| {
            write_transforms(Path::new("t.json"), cameras, images).unwrap_err().to_string()
        };
        let fov = camera(1, b"FOV", &[1.0; 5]);
        assert_eq!(
            line(&[fov], &[image(7, 1)]),
            "t.json: image 7: expected a camera model of nerfstudio, found FOV"
        );
        let two = [camera(1, b"PINHOLE", &[1.0; 4]), camera(2, b"OPENCV_FISHEYE", &[1.0; 8])];
        assert_eq!(
            line(&two, &[image(1, 1), image(2, 2)]),
            "t.json: image 2: expected one camera model, OPENCV, found OPENCV_FISHEYE"
        );
        assert_eq!(
            line(&two, &[image(1, 3)]),
            "t.json: image 1: expected a camera, found no camera 3"
        );
        assert_eq!(line(&two, &[]), "t.json: expected at least one image, found none");
    }
}
