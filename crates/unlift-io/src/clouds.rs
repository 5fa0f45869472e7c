//! Exports of points for other programs: PLY, and COLMAP models in text without observations.
//!
//! Source: COLMAP's documentation, "Output Format".

use std::io::Write;
use std::path::Path;

use crate::Error;
use crate::atomic::{self, Access};
use crate::read::colmap::{Camera, Image};

/// The comment of clouds, by which their outputs are recognized.
const CLOUD_COMMENT: &str = "unlift";
/// The first line of each file of a COLMAP model, by which it is recognized.
const MODEL_MARK: &str = "# unlift model";

/// Returns an error if a coordinate of one of the `points` is not finite.
fn finite(path: &Path, points: impl IntoIterator<Item = [f64; 3]>) -> Result<(), Error> {
    for (at, point) in points.into_iter().enumerate() {
        if !point.iter().all(|x| x.is_finite()) {
            let place = format!("point {at}");
            return Err(Error::new(path, place, "finite coordinates", format!("{point:?}")));
        }
    }
    Ok(())
}

/// Writes `points` `(n, 3)` as binary little-endian PLY with columns `double x, y, z`.
///
/// # Errors
/// When a coordinate is not finite.
pub fn write_points(path: &Path, points: &[[f64; 3]]) -> Result<(), Error> {
    finite(path, points.iter().copied())?;
    atomic::write_file(path, Access::Private, |w| {
        writeln!(w, "ply\nformat binary_little_endian 1.0\ncomment {CLOUD_COMMENT}")?;
        writeln!(w, "element vertex {}", points.len())?;
        writeln!(w, "property double x\nproperty double y\nproperty double z\nend_header")?;
        points.as_flattened().iter().try_for_each(|value| w.write_all(&value.to_le_bytes()))
    })
}

/// Writes `cameras.txt`.
pub fn write_cameras(path: &Path, cameras: &[Camera]) -> Result<(), Error> {
    atomic::write_file(path, Access::Private, |w| {
        writeln!(w, "{MODEL_MARK}\n# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]")?;
        for camera in cameras {
            let Camera { id, model, width_px, height_px, params } = camera;
            write!(w, "{id} {} {width_px} {height_px}", model.name)?;
            for value in params {
                write!(w, " {value}")?;
            }
            writeln!(w)?;
        }
        Ok(())
    })
}

/// Writes `images.txt`: poses and names, without 2D points.
///
/// # Errors
/// When a name is empty or contains spaces or control characters.
pub fn write_images(path: &Path, images: &[Image]) -> Result<(), Error> {
    let is_one_word = |name: &[u8]| !name.is_empty() && name.iter().all(|&byte| byte > b' ');
    if let Some(image) = images.iter().find(|image| !is_one_word(&image.name)) {
        let found = String::from_utf8_lossy(&image.name).escape_debug().to_string();
        let place = format!("image {}", image.id);
        return Err(Error::new(path, place, "a name without spaces", format!("\"{found}\"")));
    }
    atomic::write_file(path, Access::Private, |w| {
        writeln!(w, "{MODEL_MARK}\n# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME")?;
        for image in images {
            let [qw, qx, qy, qz] = quaternion(&image.pose.rotation);
            let [tx, ty, tz] = image.pose.translation();
            write!(w, "{} {qw} {qx} {qy} {qz} {tx} {ty} {tz} {} ", image.id, image.camera_id)?;
            w.write_all(&image.name)?;
            // The line of 2D points is required, and empty.
            writeln!(w, "\n")?;
        }
        Ok(())
    })
}

/// Writes `points3D.txt`: the points `(n, 3)` that have a position, in gray. Ids are rows from 1.
///
/// # Errors
/// When a coordinate is not finite.
pub fn write_model_points(path: &Path, points: &[Option<[f64; 3]>]) -> Result<(), Error> {
    finite(path, points.iter().map(|point| point.unwrap_or_default()))?;
    atomic::write_file(path, Access::Private, |w| {
        writeln!(w, "{MODEL_MARK}\n# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]")?;
        for (row, point) in points.iter().enumerate() {
            if let Some([x, y, z]) = point {
                writeln!(w, "{} {x} {y} {z} 128 128 128 0", row + 1)?;
            }
        }
        Ok(())
    })
}

/// Returns the unit quaternion (w, x, y, z) of a rotation, with `w >= 0`.
fn quaternion(r: &[[f64; 3]; 3]) -> [f64; 4] {
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = *r;
    // Four times the products of components.
    let products = [
        [1.0 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, 1.0 + xx - yy - zz, yx + xy, xz + zx],
        [xz - zx, yx + xy, 1.0 - xx + yy - zz, zy + yz],
        [yx - xy, xz + zx, zy + yz, 1.0 - xx - yy + zz],
    ];
    let is_more = |i: usize, j: usize| products[i][i] > products[j][j];
    let largest = (0..4).fold(0, |best, i| if is_more(i, best) { i } else { best });
    let root = products[largest][largest].sqrt();
    let mut q = products[largest].map(|product| 0.5 * product / root);
    q[largest] = 0.5 * root;
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let sign = if q[0] < 0.0 { -1.0 } else { 1.0 };
    q.map(|x| sign * x / norm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::geometry::camera::Pose;

    use crate::read::colmap::{CAMERA_MODELS, read_points, read_views};

    #[test]
    fn a_model_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let (model, params) = (&CAMERA_MODELS[2], vec![525.25, 320.0, 240.0, -0.01]);
        let cameras = vec![Camera { id: 3, model, width_px: 640, height_px: 480, params }];
        // Rotations about each axis and an oblique one, including half turns.
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, -0.48, 0.64]];
        let angles = [0.0, 0.3, 1.9, std::f64::consts::PI, 4.5];
        let turns = axes.iter().flat_map(|axis| angles.map(|angle| axis.map(|x| angle * x)));
        let image = |(at, [x, y, z]): (usize, [f64; 3])| Image {
            id: at as u32 + 1,
            name: format!("seq/{at}.png").into_bytes(),
            camera_id: 3,
            pose: Pose::IDENTITY.moved(&[x, y, z, 1.5 * at as f64, -2.0, 0.25]),
            n_points2d: 0,
        };
        let images: Vec<Image> = turns.enumerate().map(image).collect();
        let points = [Some([1.0, 2.5, -1e-7]), None, Some([1e6, 0.1, 3.0])];
        write_cameras(&at("cameras.txt"), &cameras).unwrap();
        write_images(&at("images.txt"), &images).unwrap();
        write_model_points(&at("points3D.txt"), &points).unwrap();
        let (read_cameras, read_images) = read_views(folder.path()).unwrap();
        assert_eq!((read_cameras, read_images.len()), (cameras, images.len()));
        let numbers = |pose: &Pose| [pose.rotation.as_flattened(), &pose.center].concat();
        for (read, written) in read_images.iter().zip(&images) {
            assert_eq!((read.id, &read.name), (written.id, &written.name));
            let (a, b) = (numbers(&read.pose), numbers(&written.pose));
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9 * (1.0 + b.abs());
            assert!(a.iter().zip(&b).all(near), "{read:?} {written:?}");
        }
        let read = read_points(&at("points3D.txt"), false).unwrap();
        assert_eq!(read.ids, [1, 3]);
        assert_eq!(read.positions, points.into_iter().flatten().collect::<Vec<_>>());
    }

    #[test]
    fn names_that_a_line_cannot_hold_are_refused() {
        for name in ["a b.png", "", "a\n9 1 0 0 0 0 0 0 1 b"] {
            let (name, pose) = (name.into(), Pose::IDENTITY);
            let image = Image { id: 7, name, camera_id: 1, pose, n_points2d: 0 };
            let error = write_images(Path::new("images.txt"), &[image]).unwrap_err().to_string();
            assert!(error.contains("image 7: expected a name without spaces"), "{error}");
        }
    }
}
