//! Localization with the cameras of a map: what every scheme costs.

pub mod held_out;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use unlift::audit::Plan;
use unlift::geometry::camera::{Camera, Pose, PoseError};
use unlift::localization::{Localization, View, unprotected, with_map, with_queries};
use unlift::obfuscate::{Change, Changed, Protection, SCHEMES, Scheme, SchemeOptions, obfuscate};
use unlift::seed::Key;
use unlift::truth::Original;
use unlift_io::read::colmap;
use unlift_report::document::{self as report, UNPROTECTED};

use crate::prepare::Prepared;
use crate::{Error, Progress};

/// Localization in an audit.
#[derive(Clone, Debug)]
pub struct Localize<'a> {
    /// The cameras of the map.
    pub cameras: &'a Cameras,
    /// Photos or features of the images: also localizes held-out images. Every image with an
    /// index that is half of the number modulo the number is held out.
    pub held_out: Option<(PathBuf, usize)>,
    /// Protections of the descriptors of queries, each with every scheme on keypoints.
    pub protections: Vec<Protection>,
}

impl<'a> Localize<'a> {
    /// Returns the localization of one of `nth` images, with photos or features at `path`.
    pub fn held_out(
        prepared: &'a Prepared,
        path: &Path,
        nth: usize,
        protections: Vec<Protection>,
    ) -> Result<Self, Error> {
        if prepared.cameras.views.is_empty() {
            let expected = "--localize: expected a COLMAP model with cameras and tracks";
            return Err(Error::request(format!("{expected}, found none")));
        }
        let held_out = Some((path.to_owned(), nth));
        Ok(Self { cameras: &prepared.cameras, held_out, protections })
    }

    /// Returns all schemes on keypoints, and each under every protection.
    fn query_schemes(&self) -> Vec<Arc<dyn Scheme<2>>> {
        let options = SchemeOptions::usual(unlift::Unit::Pixel);
        let mut schemes: Vec<_> =
            SCHEMES.iter().filter_map(|entry| entry.of_dimension(&options)).collect();
        let changes = self.protections.iter().cloned().map(Change::Protection);
        schemes.extend(Changed::all(&schemes, &changes.collect::<Vec<_>>()));
        schemes
    }
}

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
    /// Reads the cameras and tracks of the COLMAP model in `model`. `rows` are the points of the
    /// audit among the points of the model; lengths are multiplied by `scale`. Returns no views if
    /// the points have no tracks.
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
        let mut found = Self { tracks: lengths.into(), ..Self::default() };
        for (image, observed) in images.iter().zip(observed).filter(|(_, rows)| !rows.is_empty()) {
            let camera = image.camera(&cameras);
            let pinhole = camera.and_then(|camera| Some((camera, camera.intrinsics()?)));
            let Some((camera, intrinsics)) = pinhole else {
                found.left_out += 1;
                continue;
            };
            found.images.push((image.name.clone(), camera.clone()));
            let size = [camera.width_px as f64, camera.height_px as f64];
            let center = image.pose.center.map(|x| x * scale);
            let camera = Camera { intrinsics, pose: Pose { center, ..image.pose } };
            found.views.push(View { camera, size, observed });
        }
        Ok(found)
    }

    /// Returns a note about images that are left out.
    pub(crate) fn note(&self) -> Option<String> {
        (self.left_out > 0).then(|| {
            let n = self.left_out;
            format!("localization: {n} images are left out: their cameras have no focal length")
        })
    }
}

/// What a scheme protects.
enum Protects<'a> {
    Nothing,
    Map(&'a dyn Scheme<3>),
    Queries(&'a dyn Scheme<2>),
}

/// Returns the accuracy under every scheme of `plan` and under every scheme on queries, after that
/// of the map itself, and notes. Empty without views.
pub(crate) fn of_schemes(
    localize: &Localize<'_>,
    original: &Original<3>,
    plan: &Plan<3>,
    progress: &dyn Progress,
) -> Result<(Vec<report::Localization>, Vec<String>), Error> {
    let views: &[View] = &localize.cameras.views;
    if views.is_empty() {
        return Ok(Default::default());
    }
    let positions = original.reveal().positions();
    let base = unprotected(views, positions);
    let row = |scheme: &str, errors: &[Option<PoseError>]| {
        let bound = Localization::of(errors, &base);
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        report::Localization {
            scheme: scheme.to_owned(),
            of_queries: false,
            multiple: finite(bound.multiple),
            center_error: finite(bound.center),
            rotation_error_degrees: finite(bound.rotation_degrees),
            failed_percent: bound.failed_percent,
            changes_descriptors: false,
            held_out: None,
        }
    };
    let key = Key::from_seed(plan.seed);
    let mut rows = vec![(Protects::Nothing, row(UNPROTECTED, &base))];
    for scheme in &plan.schemes {
        // A scheme that cannot hide the map is among those that were not audited.
        let Ok((released, secret)) = obfuscate(&**scheme, original, None, &key) else { continue };
        let row = row(scheme.name(), &with_map(views, positions, &released, &secret));
        let changes_descriptors = scheme.changes_descriptors();
        rows.push((Protects::Map(&**scheme), report::Localization { changes_descriptors, ..row }));
    }
    let queries = localize.query_schemes();
    for scheme in &queries {
        let row = row(scheme.name(), &with_queries(views, positions, &**scheme, &key)?);
        let changes_descriptors = scheme.changes_descriptors();
        let row = report::Localization { of_queries: true, changes_descriptors, ..row };
        rows.push((Protects::Queries(&**scheme), row));
    }
    let mut notes = Vec::new();
    if let Some((path, nth)) = &localize.held_out {
        let mut held = held_out::Held::open(path, *nth, localize.cameras, original, progress)?;
        notes.push(held.note());
        progress.say(&format!("note: {}", held.note()));
        let base = held_out::locate(&held.unprotected(), plan.seed);
        let limits: Vec<(String, f64, f64)> = match original.reveal().unit() {
            unlift::Unit::Meter => [(0.05, 5.0), (0.25, 2.0), (0.5, 5.0)]
                .map(|(m, angle)| (format!("{:.0} cm, {angle} deg", 100.0 * m), m, angle))
                .to_vec(),
            // Without a scale, multiples of the unprotected bound.
            _ => {
                let bound = rows[0].1.center_error.unwrap_or(0.0);
                [10.0, 30.0, 100.0]
                    .map(|times| (format!("{times} times the bound, 5 deg"), times * bound, 5.0))
                    .to_vec()
            }
        };
        let n_rows = rows.len();
        for (at, (protects, row)) in rows.iter_mut().enumerate() {
            progress.show(at, n_rows, &format!("localization, {}", row.scheme));
            let problems = match protects {
                Protects::Nothing => None,
                Protects::Map(scheme) => Some(held.with_map(*scheme, &key)?),
                Protects::Queries(scheme) => Some(held.with_queries(*scheme, &key)?),
            };
            let located = problems.map(|problems| held_out::locate(&problems, plan.seed));
            let located = located.as_ref().unwrap_or(&base);
            row.held_out = Some(held_out::summary(located, &base, &limits));
        }
    }
    Ok((rows.into_iter().map(|(_, row)| row).collect(), notes))
}
