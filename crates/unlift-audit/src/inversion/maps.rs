//! Pictures of a map: recovered points as the cameras of its photos see them.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, OnceLock};

use rayon::prelude::*;
use unlift::Error;
use unlift::audit::{Cell, Measure, Row};
use unlift::geometry::camera::Pose;
use unlift::geometry::frame::rounded_origin;
use unlift_io::read::colmap;
use unlift_report::inversions::Inversion as Sheet;
use unlift_report::pictures::{Marks, ReleasedView};
use unlift_report::scene::{SceneBox, Shapes};
use unlift_vision::features::photo::{Turn, read_color};
use unlift_vision::pictures::{Gallery, Lens, Painter, Picture, Reference, View, needed};

use super::sheet::{add_to, lock};
use crate::Progress;
use crate::images::{evenly, kind_of};
use crate::maps::Prepared;
use crate::maps::shapes::{near, shapes};

/// Smallest side of a picture for which the metrics are defined.
const LEAST_SIDE: usize = 16;

#[derive(Debug)]
struct PhotoView {
    view: View,
    photo: Reference,
    /// The picture of the true points.
    truth: OnceLock<Result<Picture, Error>>,
}

/// Makes pictures of a map and compares them with the photos.
#[derive(Debug)]
pub struct MapInversion {
    painter: Painter,
    views: Vec<PhotoView>,
    /// The photos of the first [`Gallery::MAX`] views.
    gallery: Gallery,
    /// The inlier ratio of the oracle whose recoveries are painted; `None`: all.
    ratio: Option<f64>,
    /// The cell that was measured last and its pictures, one per photo, so that the page does not paint them again.
    last: Mutex<Option<(Row, u32, Vec<Picture>)>>,
}

impl MapInversion {
    /// Opens the photos of a map, which must be a COLMAP model with descriptors. Uses at most `max_images` of its images that have a
    /// photo in `photos`, evenly spaced over their names. `network` is that of the user. With a `ratio`, paints the oracle's recoveries
    /// at this inlier ratio only.
    ///
    /// Cameras with an unknown lens and unusable photos are reported and skipped.
    ///
    /// # Errors
    /// If something is missing, no photo is left, or a file cannot be read.
    pub fn open(
        prepared: &Prepared,
        photos: Option<&Path>,
        network: Option<&Path>,
        max_images: usize,
        ratio: Option<f64>,
        progress: &dyn Progress,
    ) -> Result<Self, crate::Error> {
        let missing = |what: &str| crate::Error::request(format!("--invert: expected {what}"));
        let photos = photos.ok_or_else(|| missing("--photos, the folder of the map's photos"))?;
        let model = "a COLMAP model with cameras, found only points";
        let model = prepared.input.model.as_ref().ok_or_else(|| missing(model))?;
        let descriptors = "descriptors (--descriptors FILE), found none";
        let descriptors = prepared.descriptors.as_ref().ok_or_else(|| missing(descriptors))?;
        let painter = Painter::open(kind_of("--invert", Some(descriptors))?, network)?;
        let scale = 1.0 / prepared.unit_in_map_units;
        let (cameras, mut images) = colmap::read_views(model)?;
        images.sort_by(|a, b| a.name.cmp(&b.name));
        let with_photo = |image: &colmap::Image| {
            let path = photos.join(String::from_utf8_lossy(&image.name).as_ref());
            path.is_file().then_some(path)
        };
        let with_photo: Vec<_> =
            images.iter().filter_map(|image| Some((image, with_photo(image)?))).collect();
        let n = with_photo.len();
        if n < images.len() {
            let found = format!("{n} of {} images of the model have a photo", images.len());
            progress.note(&format!("{}: {found}", photos.display()));
        }
        let mut views = Vec::new();
        for (image, path) in evenly(n, Some(max_images)).into_iter().map(|at| &with_photo[at]) {
            match open_photo(&painter, (&cameras, image), path, scale) {
                Ok(view) => views.push(view),
                Err(error) => progress.note(&format!("not painted: {error}")),
            }
        }
        if views.is_empty() {
            let expected = format!("photos of the images in {}", model.display());
            return Err(unlift_io::Error::new(photos, "", expected, "none").into());
        }
        let small = |of: &PhotoView| (of.photo.name.clone(), Gallery::reduced(&of.photo.image));
        let gallery = Gallery::new(views.iter().take(Gallery::MAX).map(small).collect());
        Ok(Self { painter, views, gallery, ratio, last: Mutex::default() })
    }

    fn paints(&self, row: &Row) -> bool {
        let is_oracle = row.oracle_noise.is_some();
        !is_oracle || self.ratio.is_none_or(|ratio| ratio == row.inlier_ratio)
    }

    /// Returns the SHA-256 of the painting network, in hexadecimal.
    pub fn sha256(&self) -> &str {
        self.painter.inverter.sha256()
    }

    /// Returns the number of photos.
    pub fn n_photos(&self) -> usize {
        self.views.len()
    }

    /// Adds the pictures of `cell` by the first cameras, one per sheet.
    pub fn add(&self, cell: &Cell<'_>, sheets: &mut [Sheet]) -> Result<(), Error> {
        if !self.paints(cell.row) {
            return Ok(());
        }
        let is_of =
            |(row, repeat, _): &(Row, u32, _)| *repeat == cell.repeat && row.is_same_cell(cell.row);
        let last = lock(&self.last).take();
        let pictures = match last.filter(is_of) {
            Some((.., pictures)) => pictures,
            None => self.pictures(cell, sheets.len())?,
        };
        let is_new =
            |sheet: &Sheet| sheet.released.iter().all(|shown| shown.scheme != cell.row.scheme);
        let records = sheets.iter().any(is_new).then(|| records(cell));
        for ((of, sheet), picture) in self.views.iter().zip(sheets).zip(pictures) {
            sheet.name.clone_from(&of.photo.name);
            sheet.size = of.view.size.map(|side| side as u32);
            if let Some((shapes, middle)) = &records {
                let marks = marks(&of.view, shapes, middle)?;
                sheet.released.push(ReleasedView { scheme: cell.row.scheme.clone(), marks });
            }
            add_to(sheet, (&of.photo, self.truth(of, cell)?), &picture, cell.row)?;
        }
        Ok(())
    }

    fn pictures(&self, cell: &Cell<'_>, n: usize) -> Result<Vec<Picture>, Error> {
        let picture = |of: &PhotoView| {
            let image = self.painter.map(&of.view, cell.released, cell.recovered)?;
            self.painter.compare(image, &of.photo, Some(&self.gallery))
        };
        self.views.par_iter().take(n).map(picture).collect()
    }

    fn truth<'a>(&'a self, of: &'a PhotoView, cell: &Cell<'_>) -> Result<&'a Picture, Error> {
        let make = || {
            let originals = cell.original.reveal().positions();
            let positions: Vec<Option<[f64; 3]>> = originals.iter().copied().map(Some).collect();
            let descriptors = needed(cell.descriptors)?;
            let image = self.painter.points(&of.view, &positions, descriptors, |_, _| 1.0)?;
            self.painter.compare(image, &of.photo, Some(&self.gallery))
        };
        of.truth.get_or_init(make).as_ref().map_err(Error::clone)
    }
}

impl Measure<3> for MapInversion {
    /// Returns means over the photos that have the figure: not every photo has objects.
    fn measure(&self, cell: &Cell<'_>) -> Result<Vec<(String, f64)>, Error> {
        if !self.paints(cell.row) {
            return Ok(Vec::new());
        }
        let pictures = self.pictures(cell, self.views.len())?;
        let mut sums = BTreeMap::new();
        for (of, picture) in self.views.iter().zip(&pictures) {
            for (name, value) in picture.figures(self.truth(of, cell)?, &self.gallery) {
                let (sum, n) = sums.entry(name).or_insert((0.0, 0_u32));
                (*sum, *n) = (*sum + value, *n + 1);
            }
        }
        *lock(&self.last) = Some((cell.row.clone(), cell.repeat, pictures));
        Ok(sums.into_iter().map(|(name, (sum, n))| (name, sum / f64::from(n))).collect())
    }
}

/// Maximum number of drawn records; more cannot be distinguished.
const MOST_RECORDS: usize = 700;
/// Number of places along a line that are projected to find where it enters and leaves an image.
const STEPS: u32 = 64;

/// Returns some released records, clipped to the map, and the origin of their coordinates.
fn records(cell: &Cell<'_>) -> (Shapes, [f64; 3]) {
    let points = cell.original.reveal().positions();
    let middle = rounded_origin(points);
    let bounds = SceneBox::robust(&points.iter().map(|p| near(p, &middle)).collect::<Vec<_>>());
    let all = cell.released.obfuscation().len();
    let n = all.min(MOST_RECORDS);
    let chosen: Vec<usize> = (0..n).map(|at| at * all / n).collect();
    (shapes(&bounds, &middle, cell.released, &chosen), middle)
}

fn marks(view: &View, shapes: &Shapes, middle: &[f64; 3]) -> Result<Marks, Error> {
    let place = |p: [f32; 3]| Some([0, 1, 2].map(|c| f64::from(p[c]) + middle[c]));
    let line = |[a, b]: [[f32; 3]; 2]| -> Result<Option<[[f32; 2]; 2]>, Error> {
        let at = |step: u32| {
            let t = step as f32 / STEPS as f32;
            place([0, 1, 2].map(|c| a[c] + t * (b[c] - a[c])))
        };
        let projected = view.project(&(0..=STEPS).map(at).collect::<Vec<_>>())?.places;
        Ok(projected.first().zip(projected.last()).map(|(&from, &to)| [from, to]))
    };
    let segments = match shapes {
        Shapes::Segments(all) => all.clone(),
        Shapes::Patches(all) => {
            let edges =
                |p: &[[f32; 3]; 4]| [[p[0], p[1]], [p[1], p[2]], [p[2], p[3]], [p[3], p[0]]];
            all.iter().flat_map(edges).collect()
        }
        Shapes::Points(all) => {
            let points: Vec<_> = all.iter().map(|&p| place(p)).collect();
            let places = view.project(&points)?.places;
            return Ok(Marks::Points(places.into_iter().map(Some).collect()));
        }
    };
    Ok(Marks::Lines(segments.into_iter().map(line).collect::<Result<_, _>>()?))
}

fn open_photo(
    painter: &Painter,
    (cameras, image): (&[colmap::Camera], &colmap::Image),
    path: &Path,
    scale: f64,
) -> Result<PhotoView, Error> {
    let camera = image.camera(cameras).ok_or_else(|| {
        let id = image.camera_id.to_string();
        Error::new(path.display().to_string(), "a camera of the model", id)
    })?;
    // COLMAP ignores the orientation tag of photos.
    let photo = read_color(path, Turn::AsStored)?;
    let open = || {
        let view = view(camera, image, scale)?;
        let [width, height] = view.size;
        if [photo.width() as usize, photo.height() as usize] != view.size {
            let expected = format!("a photo of {width} x {height} pixels, as its camera");
            let found = format!("{} x {}", photo.width(), photo.height());
            return Err(Error::new("size", expected, found));
        }
        if width.min(height) < 2 * LEAST_SIDE {
            let expected = format!("at least {0} x {0} pixels", 2 * LEAST_SIDE);
            return Err(Error::new("size", expected, format!("{width} x {height} pixels")));
        }
        let name = String::from_utf8_lossy(&image.name);
        Ok(PhotoView { view, photo: painter.reference(&name, &photo)?, truth: OnceLock::new() })
    };
    open().map_err(|error| error.within(&path.display().to_string().escape_debug().to_string()))
}

/// Returns the view of an image of a COLMAP model; `scale` is the number of units per unit of the model.
pub fn view(camera: &colmap::Camera, image: &colmap::Image, scale: f64) -> Result<View, Error> {
    Ok(View {
        pose: Pose { center: image.pose.center.map(|x| x * scale), ..image.pose },
        lens: Lens::try_new(camera.model.name, &camera.params)?,
        size: [camera.width_px, camera.height_px].map(|side| side as usize),
    })
}
