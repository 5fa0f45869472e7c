//! The owner's side of each query: its keypoints, its camera, and the points of the model that they show.

use std::path::Path;

use rayon::prelude::*;
use unlift::geometry::camera::{Camera, Intrinsics, PoseError};
use unlift::geometry::frame::Bounds;
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::distance;
use unlift::seed::{Draws, Stage};
use unlift::truth::Original;
use unlift::{Descriptors, PointSet, Unit};
use unlift_io::Error;
use unlift_io::features::ImageFeatures;
use unlift_io::read::colmap::{self, Image};
use unlift_vision::pictures::Lens;

use crate::images::{FeatureSource, other_size};

/// A keypoint shows a point of the model if it is the nearest one to the point's projection and at most this far away, in pixels.
const SHOWS_PX: f64 = 2.0;
/// Places on each side of an image whose undistorted places bound the undistorted image.
const PER_SIDE: usize = 32;

/// A query before it is protected.
pub struct View {
    pub name: String,
    /// The keypoints where a pinhole camera sees them.
    pub original: Original<2>,
    pub descriptors: Descriptors,
    /// The camera, with the pose that the service has.
    pub camera: Camera,
    pub lens: Lens,
    pub size: [usize; 2],
    /// The row of the model's point that each keypoint shows, if any.
    pub shows: Vec<Option<u32>>,
    /// Keypoints without a place in a pinhole camera, which are left out.
    pub n_left_out: usize,
}

impl View {
    /// Returns where the photo shows a place of the pinhole camera; NaN where it does not.
    pub fn in_photo(&self, place: [f64; 2]) -> [f32; 2] {
        let Intrinsics { focal, principal } = self.lens.intrinsics();
        let [x, y] = [0, 1].map(|c| (place[c] - principal[c]) / focal[c]);
        self.lens.project([x, y, 1.0]).map_or([f32::NAN; 2], |place| place.map(|x| x as f32))
    }
}

/// The model: cameras, images by name, and the points that each image shows.
pub struct Model {
    cameras: Vec<colmap::Camera>,
    images: Vec<Image>,
    pub positions: Vec<[f64; 3]>,
    shown: Vec<Vec<u32>>,
}

impl Model {
    /// Reads the COLMAP model in the folder `folder`.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let (cameras, mut images) = colmap::read_views(folder)?;
        images.sort_by(|a, b| a.name.cmp(&b.name));
        let extension = if folder.join("points3D.bin").is_file() { "bin" } else { "txt" };
        let points = colmap::read_points(&folder.join(format!("points3D.{extension}")), true)?;
        let rows: Vec<u32> = (0..points.ids.len() as u32).collect();
        let observed = points.tracks.as_ref().map(|tracks| tracks.observed(&images, &rows).0);
        let shown = observed.unwrap_or_else(|| vec![Vec::new(); images.len()]);
        Ok(Self { cameras, images, positions: points.positions, shown })
    }

    /// Returns the views of all images that are in the model and in `source`, in the order of [`in_time`], and an error for each that
    /// cannot be used. `path` names the source in errors.
    pub fn views(
        &self,
        (source, path): (&FeatureSource, &Path),
        pose_error: Option<(PoseError, u64)>,
    ) -> Vec<Result<View, crate::Error>> {
        let numbered = |(at, name): (usize, &String)| {
            let images = &self.images;
            let of = images.binary_search_by(|image| image.name.as_slice().cmp(name.as_bytes()));
            Some((at, of.ok()?))
        };
        let both: Vec<(usize, usize)> =
            source.names.iter().enumerate().filter_map(numbered).collect();
        let image = |&(at, of): &(usize, usize)| {
            let image = &self.images[of];
            (&*source.names[at], image.id, image.pose.center)
        };
        let order = in_time(&both.iter().map(image).collect::<Vec<_>>());
        let view = |at: usize| {
            let (at, of) = both[at];
            let features = source.get(at)?;
            let place = format!("image {}", features.name.escape_debug());
            self.view(features, of, pose_error).map_err(|error| {
                crate::Error::from(Error::new(path, place, error.expected(), error.found()))
            })
        };
        order.into_par_iter().with_max_len(1).map(view).collect()
    }

    fn view(
        &self,
        features: ImageFeatures,
        of: usize,
        pose_error: Option<(PoseError, u64)>,
    ) -> Result<View, unlift::Error> {
        let wrong = |expected: &str, found: &str| unlift::Error::new("image", expected, found);
        let image = &self.images[of];
        let camera = image.camera(&self.cameras).ok_or_else(|| wrong("a camera", "none"))?;
        let size = [camera.width_px as f64, camera.height_px as f64];
        let lens = Lens::try_new(camera.model.name, &camera.params)?;
        if let Some((expected, found)) = other_size(features.size, size) {
            return Err(wrong(&expected, &found));
        }
        let descriptors = features.descriptors.as_ref();
        let descriptors = descriptors.ok_or_else(|| wrong("descriptors", "none"))?;
        let bounds = bounds(&lens, size)
            .ok_or_else(|| wrong("a camera with less than 180 degrees", "a wider one"))?;
        let pinhole = lens.intrinsics();
        let place = |(row, &keypoint): (usize, &[f64; 2])| {
            let place = lens.undistorted(&pinhole, keypoint)?;
            bounds.contains(&place).then_some((row as u32, place))
        };
        let (kept, places): (Vec<u32>, Vec<[f64; 2]>) =
            features.keypoints.iter().enumerate().filter_map(place).unzip();
        let original = Original::within(PointSet::try_new(places, Unit::Pixel)?, bounds)?;
        let pose = pose_error.map_or(image.pose, |(error, seed)| {
            let mut draws = Draws::new(seed, Stage::Image, u64::from(image.id));
            image.pose.with_error(error, &mut draws)
        });
        Ok(View {
            shows: self.shows(&features, of, &lens, &kept),
            original,
            descriptors: descriptors.select(&kept),
            camera: Camera { intrinsics: pinhole, pose },
            lens,
            size: size.map(|side| side as usize),
            n_left_out: features.keypoints.len() - kept.len(),
            name: features.name,
        })
    }

    /// Returns the point that each of the `kept` keypoints shows.
    fn shows(
        &self,
        features: &ImageFeatures,
        of: usize,
        lens: &Lens,
        kept: &[u32],
    ) -> Vec<Option<u32>> {
        let keypoints: Vec<[f64; 2]> =
            kept.iter().map(|&at| features.keypoints[at as usize]).collect();
        let nearby = Knn::new(&keypoints).ok();
        let mut shows: Vec<Option<(f64, u32)>> = vec![None; kept.len()];
        for &row in &self.shown[of] {
            let x = self.images[of].pose.in_camera(&self.positions[row as usize]);
            let nearest =
                lens.project(x).and_then(|place| nearby.as_ref()?.nearest_within(place, SHOWS_PX));
            let Some((distance2, at)) = nearest else { continue };
            if shows[at].is_none_or(|(nearest2, _)| distance2 < nearest2) {
                shows[at] = Some((distance2, row));
            }
        }
        shows.into_iter().map(|shown| shown.map(|(_, row)| row)).collect()
    }
}

fn bounds(lens: &Lens, size: [f64; 2]) -> Option<Bounds<2>> {
    let (pinhole, [right, bottom]) = (lens.intrinsics(), size.map(|side| side - 0.5));
    let on_border = (0..=PER_SIDE).flat_map(|at| {
        let [x, y] = size.map(|side| side * (at as f64 / PER_SIDE as f64) - 0.5);
        [[x, -0.5], [x, bottom], [-0.5, y], [right, y]]
    });
    let places = on_border.map(|place| lens.undistorted(&pinhole, place));
    let Bounds { low, high } = Bounds::quantiles(&places.collect::<Option<Vec<_>>>()?, 0.0)?;
    Bounds::try_new(low, high).ok()
}

/// Orders images, each with its name, id and place, by their names as people count, or by their ids if the path of the camera is shorter
/// so: ids follow a list of images or the time at which they were added.
fn in_time(images: &[(&str, u32, [f64; 3])]) -> Vec<usize> {
    let mut by_name: Vec<usize> = (0..images.len()).collect();
    let mut by_id = by_name.clone();
    by_name.sort_by_cached_key(|&at| natural(images[at].0));
    by_id.sort_by_key(|&at| images[at].1);
    let length = |order: &[usize]| -> f64 {
        order.windows(2).map(|two| distance(&images[two[0]].2, &images[two[1]].2)).sum()
    };
    if length(&by_id) < length(&by_name) { by_id } else { by_name }
}

/// Returns a key that sorts names as people count: `2.jpg` before `10.jpg`.
///
/// A run of digits becomes its length without zeros in front, and itself. Names that differ in such zeros alone stay in their order.
fn natural(name: &str) -> Vec<(usize, &[u8])> {
    let runs = name.as_bytes().chunk_by(|a, b| a.is_ascii_digit() && b.is_ascii_digit());
    runs.map(|run| {
        let zeros = run.iter().take_while(|&&digit| digit == b'0').count();
        match run[0].is_ascii_digit() {
            true => (run.len() - zeros, &run[zeros..]),
            false => (usize::MAX, run),
        }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::in_time;

    #[test]
    fn images_are_ordered_as_people_count_unless_ids_make_a_shorter_path() {
        let ordered = ["a/2.jpg", "a/010.jpg", "a/11.jpg", "a/b1c9.png", "a/b1c10.png", "b/1.jpg"];
        let of = |place: fn(usize) -> usize| {
            let image =
                |at: usize| (ordered[at], (at * 5 % 6) as u32, [place(at) as f64, 0.0, 0.0]);
            let images: Vec<_> = [3, 0, 5, 1, 4, 2].map(image).to_vec();
            in_time(&images).into_iter().map(|at| images[at].0).collect::<Vec<_>>()
        };
        assert_eq!(of(|at| at), ordered);
        assert_eq!(of(|_| 0), ordered);
        assert_eq!(of(|at| at * 5 % 6), [0, 5, 4, 3, 2, 1].map(|at| ordered[at]));
    }
}
