//! Localization with the cameras of a map: what every scheme costs.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use unlift::Error as CoreError;
use unlift::audit::Plan;
use unlift::geometry::knn::Knn;
use unlift::localization::{Held, Localization, NEAR, Photo, View, of_schemes};
use unlift::obfuscate::Protection;
use unlift::truth::Original;
use unlift_io::read::{Cameras, colmap};
use unlift_vision::features::Extraction;
use unlift_vision::features::photo::Turn;
use unlift_vision::pictures::Lens;

use crate::images::{FeatureSource, other_size};
use crate::maps::Prepared;
use crate::{Error, Progress};

/// Localization in an audit.
#[derive(Clone, Debug, Default)]
pub struct Localize {
    /// Photos or features of the images: also localizes held-out images. Every image with an
    /// index that is half of the number modulo the number is held out.
    pub held_out: Option<(PathBuf, usize)>,
    /// Protections of the descriptors of queries, each with every scheme on keypoints.
    pub protections: Vec<Protection>,
}

/// Returns the accuracy under every scheme of `plan` and under every scheme on queries, after that
/// of the map itself, and notes. Empty without views.
pub(crate) fn localization(
    localize: &Localize,
    prepared: &Prepared,
    plan: &Plan<3>,
    progress: &dyn Progress,
) -> Result<(Vec<Localization>, Vec<String>), Error> {
    let Prepared { original, cameras, .. } = prepared;
    let views: &[View] = &cameras.views;
    if views.is_empty() {
        return Ok(Default::default());
    }
    let open = |(path, nth): &(PathBuf, usize)| open(path, *nth, cameras, original, progress);
    let mut held = localize.held_out.as_ref().map(open).transpose()?;
    let note = held.as_ref().map(Held::note);
    note.iter().for_each(|note| progress.note(note));
    let steps = |done: usize, total: usize, scheme: &str| {
        progress.show(done, total, &format!("localization, {scheme}"));
    };
    let (schemes, protections) = (&plan.schemes, &localize.protections);
    let rows =
        of_schemes((original, views), schemes, protections, held.as_mut(), plan.seed, steps)?;
    Ok((rows, note.into_iter().collect()))
}

/// Holds out every `nth` image of those with features in `path`, a folder of photos or a file.
///
/// # Errors
/// If `path` cannot be read, or too few images of the map have features.
pub fn open<'a>(
    path: &Path,
    nth: usize,
    cameras: &'a Cameras,
    original: &'a Original<3>,
    progress: &dyn Progress,
) -> Result<Held<'a>, Error> {
    let source = FeatureSource::open(path, &Extraction::default())?.with_turn(Turn::AsStored);
    let names = &source.names;
    let numbered = |(at, (name, _)): (usize, &(Vec<u8>, colmap::Camera))| {
        Some((at, names.binary_search_by(|other| other.as_bytes().cmp(name)).ok()?))
    };
    let images = cameras.images.iter().enumerate().filter_map(numbered).collect::<Vec<_>>();
    let positions = original.reveal().positions();
    let read = |&(at, number): &(usize, usize)| {
        let features = source.get(number)?;
        let view = &cameras.views[at];
        if let Some((expected, found)) = other_size(features.size, view.size) {
            let place = format!("image {}", features.name.escape_debug());
            return Ok(Err(unlift_io::Error::new(path, place, expected, found)));
        }
        let camera = &cameras.images[at].1;
        let lens = Lens::try_new(camera.model.name, &camera.params)?;
        let Some(descriptors) = features.descriptors else {
            return Err(CoreError::new("features", "descriptors", "none").into());
        };
        let nearby = Knn::new(&features.keypoints).ok();
        let of_point = |&row: &u32| {
            let place = lens.project(view.camera.pose.in_camera(&positions[row as usize]))?;
            Some((row as usize, nearby.as_ref()?.nearest_within(place, NEAR)?.1))
        };
        let of_points = view.observed.iter().filter_map(of_point).collect();
        // The keypoints as the view would have them without a lens.
        let flat = |(row, place): (usize, &[f64; 2])| {
            let place = lens.undistorted(&view.camera.intrinsics, *place)?;
            let is_inside = (0..2).all(|c| (0.0..=view.size[c]).contains(&place[c]));
            is_inside.then_some((place, row))
        };
        let places = features.keypoints.iter().enumerate().filter_map(flat).collect();
        Ok::<_, Error>(Ok(Photo { view: at, places, descriptors, of_points }))
    };
    let mut photos = Vec::new();
    for found in images.par_iter().map(read).collect::<Vec<_>>() {
        match found {
            Ok(photo) => photos.push(photo?),
            Err(error) => progress.note(&format!("not localized: {error}")),
        }
    }
    photos.sort_by(|a, b| cameras.images[a.view].0.cmp(&cameras.images[b.view].0));
    Ok(Held::new(original, &cameras.views, photos, nth)
        .map_err(|e| unlift_io::Error::core(path, e))?)
}
