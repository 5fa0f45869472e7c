//! Reads COLMAP models: `cameras`, `images` and `points3D`, as `.bin` or `.txt`.
//!
//! Models of COLMAP 3.12 and later also have `rigs` and `frames`, which repeat the poses of
//! `images`. They are checked ([`check_rigs`], [`check_frames`]) but not used.
//!
//! Source: COLMAP's documentation, "Output Format".

mod binary;
mod camera_models;
mod model;
mod text;

use std::path::Path;

pub use camera_models::{CAMERA_MODELS, CameraModel};
pub use model::{Camera, Image, Points, Tracks};

use crate::error::Error;

fn is_text(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("txt"))
}

/// Reads `cameras.bin` or `cameras.txt`, sorted by id.
///
/// # Errors
/// When the file cannot be read, is malformed, names an unknown camera model or repeats an id.
pub fn read_cameras(path: &Path) -> Result<Vec<Camera>, Error> {
    let mut cameras = if is_text(path) { text::cameras(path)? } else { binary::cameras(path)? };
    cameras.sort_by_key(|c| c.id);
    refuse_repeated(path, "camera", cameras.iter().map(|c| u64::from(c.id)))?;
    Ok(cameras)
}

/// Reads `images.bin` or `images.txt`, sorted by id.
///
/// # Errors
/// When the file cannot be read, is malformed or repeats an id.
pub fn read_images(path: &Path) -> Result<Vec<Image>, Error> {
    let mut images = if is_text(path) { text::images(path)? } else { binary::images(path)? };
    images.sort_by_key(|i| i.id);
    refuse_repeated(path, "image", images.iter().map(|i| u64::from(i.id)))?;
    Ok(images)
}

/// Reads the cameras and images of the model in the folder `model`, in the form that
/// [`super::open`] reads.
///
/// # Errors
/// When [`read_cameras`] or [`read_images`] fails, or an image names a missing camera or has no
/// pose.
pub fn read_views(model: &Path) -> Result<(Vec<Camera>, Vec<Image>), Error> {
    let extension = if model.join("images.bin").is_file() { "bin" } else { "txt" };
    let cameras = read_cameras(&model.join(format!("cameras.{extension}")))?;
    let path = model.join(format!("images.{extension}"));
    let images = read_images(&path)?;
    for image in &images {
        let wrong = |expected: String, found| {
            Err(Error::new(&path, format!("image {}", image.id), expected, found))
        };
        if image.camera(&cameras).is_none() {
            let expected = format!("the id of a camera in cameras.{extension}");
            return wrong(expected, image.camera_id.to_string());
        }
        if image.center.iter().any(|x| !x.is_finite()) {
            return wrong("a finite pose".to_owned(), "none".to_owned());
        }
    }
    Ok((cameras, images))
}

/// Reads `points3D.bin` or `points3D.txt`, sorted by id. Tracks are read only if `with_tracks` is
/// set.
///
/// # Errors
/// When the file cannot be read, is malformed or repeats an id.
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

/// Checks `rigs.bin` or `rigs.txt` and returns the number of rigs.
///
/// # Errors
/// When the file cannot be read or is malformed.
pub fn check_rigs(path: &Path) -> Result<u64, Error> {
    if is_text(path) { text::rigs(path) } else { binary::rigs(path) }
}

/// Checks `frames.bin` or `frames.txt` and returns the number of frames.
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

/// Older COLMAP versions write points in the order of a hash map.
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
        colors: order.iter().map(|&row| points.colors[row]).collect(),
        tracks,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsorted_points_are_sorted_with_their_tracks() {
        let points = Points {
            ids: vec![7, 2],
            positions: vec![[7.0; 3], [2.0; 3]],
            colors: vec![[7; 3], [2; 3]],
            tracks: Some(Tracks {
                offsets: vec![0, 2, 3],
                observations: vec![(7, 0), (7, 1), (2, 0)],
            }),
        };
        let sorted = sorted(points);
        assert_eq!(sorted.ids, [2, 7]);
        assert_eq!(sorted.positions, [[2.0; 3], [7.0; 3]]);
        assert_eq!(sorted.colors, [[2; 3], [7; 3]]);
        let tracks = sorted.tracks.unwrap();
        assert_eq!(tracks.row(0), [(2, 0)]);
        assert_eq!(tracks.row(1), [(7, 0), (7, 1)]);
    }
}
