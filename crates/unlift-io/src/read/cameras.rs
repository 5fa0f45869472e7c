//! The cameras of a COLMAP model.

use std::path::Path;
use std::sync::Arc;

use unlift::geometry::camera::{Camera, Pose};
use unlift::localization::View;

use super::colmap;
use crate::Error;

/// The cameras of a map in the unit of an audit.
#[derive(Clone, Debug, Default)]
pub struct Cameras {
    /// The images that observe points of the map.
    pub views: Vec<View>,
    /// Name and camera of each view, as in the model.
    pub images: Vec<(Vec<u8>, colmap::Camera)>,
    /// Number of images that observe each point.
    pub tracks: Arc<[u32]>,
    /// Number of images that are left out: their camera is a panorama, or has no focal length.
    pub left_out: usize,
}

impl Cameras {
    /// Reads the cameras and tracks of the COLMAP model in `model`. `rows` are the points of the audit among the points of the
    /// model; lengths are multiplied by `scale`. Returns no views if the points have no tracks.
    ///
    /// # Errors
    /// If a file of the model is broken.
    pub fn read(model: &Path, rows: &[u32], scale: f64) -> Result<Self, Error> {
        let named = |name: &str| {
            let files = ["bin", "txt"].map(|end| model.join(format!("{name}.{end}")));
            files.into_iter().find(|file| file.is_file())
        };
        let (Some(file), Some(_), Some(_)) = (named("points3D"), named("images"), named("cameras"))
        else {
            return Ok(Self::default());
        };
        let (cameras, images) = colmap::read_views(model)?;
        let points = colmap::read_points(&file, true)?;
        let Some(tracks) = points.tracks else { return Ok(Self::default()) };
        let (observed, lengths) = tracks.observed(&images, rows);
        let mut read = Self { tracks: lengths.into(), ..Self::default() };
        for (image, observed) in images.iter().zip(observed).filter(|(_, rows)| !rows.is_empty()) {
            let camera = image.camera(&cameras);
            let pinhole = camera.and_then(|camera| Some((camera, camera.intrinsics()?)));
            let Some((camera, intrinsics)) = pinhole else {
                read.left_out += 1;
                continue;
            };
            read.images.push((image.name.clone(), camera.clone()));
            let size = [camera.width_px as f64, camera.height_px as f64];
            let center = image.pose.center.map(|x| x * scale);
            let camera = Camera { intrinsics, pose: Pose { center, ..image.pose } };
            read.views.push(View { camera, size, observed });
        }
        Ok(read)
    }

    /// Returns a note about the images that are left out.
    pub fn note(&self) -> Option<String> {
        let what = "images are left out: their cameras have no focal length";
        (self.left_out > 0).then(|| format!("localization: {} {what}", self.left_out))
    }
}
