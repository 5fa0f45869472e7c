use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use rayon::prelude::*;
use unlift::audit::{Cell, Measure, Row};
use unlift::{Descriptors, Error};
use unlift_report::inversions::Inversion as Sheet;
use unlift_vision::features::photo::{Turn, read_color};
use unlift_vision::network::DescriptorKind;
use unlift_vision::pictures::{Gallery, Painter, Picture, Points, Reference, needed, size};

use crate::images::{FeatureSource, evenly};

use super::sheet::{add_to, lock};

/// A photo and the picture of its true points: no attack on positions can be expected to do better.
type Truth = (Reference, Picture);

/// Number of photos kept for further cells; fewer images are processed at the same time.
const KEPT: usize = 64;

/// Makes pictures of images and compares them with the photos.
#[derive(Debug)]
pub struct Inversion {
    painter: Painter,
    /// Folder of the photos, which have the names of the images.
    photos: PathBuf,
    turn: Turn,
    gallery: Gallery,
    known: Mutex<BTreeMap<String, Arc<Truth>>>,
    failed: Mutex<BTreeMap<String, Error>>,
}

impl Inversion {
    /// Opens the measure for the images `chosen` of `source` at `path`. Photos are in the folder `photos`, or in `path`. `kind` is that
    /// of the descriptors.
    pub fn open(
        (source, chosen, path): (&FeatureSource, &[usize], &Path),
        kind: DescriptorKind,
        photos: Option<&Path>,
        network: Option<&Path>,
    ) -> Result<Self, crate::Error> {
        let photos = photos.or_else(|| Some(path).filter(|path| path.is_dir()));
        let none = "--invert: expected --photos, as PATH is no folder of photos";
        let photos = photos.ok_or_else(|| crate::Error::request(none))?;
        let (painter, photos) = (Painter::open(kind, network)?, photos.to_owned());
        let read = |at: usize| {
            let name = &source.names[chosen[at]];
            let photo = read_color(&photos.join(name), source.turn).ok()?;
            Some((name.clone(), Gallery::reduced(&photo)))
        };
        let in_gallery = evenly(chosen.len(), Some(Gallery::MAX));
        let gallery = Gallery::new(in_gallery.into_par_iter().filter_map(read).collect());
        let (known, failed) = Default::default();
        Ok(Self { painter, photos, turn: source.turn, gallery, known, failed })
    }

    /// Returns the SHA-256 of the painting network, in hexadecimal.
    pub fn sha256(&self) -> &str {
        self.painter.inverter.sha256()
    }

    /// Returns the reasons why images have no pictures, ordered by image name.
    pub fn failed(&self) -> Vec<Error> {
        lock(&self.failed).values().cloned().collect()
    }

    /// Adds the picture of `cell` to the sheet of its image.
    pub fn add(&self, cell: &Cell<'_, 2>, sheet: &mut Sheet) -> Result<(), Error> {
        let image = self.painter.image(cell.released, cell.recovered)?;
        let (photo, baseline) = &*self.truth(cell)?;
        add_to(sheet, (photo, baseline), &self.painter.compare(image, photo, None)?, cell.row)
    }

    /// Adds the picture of `recovered` keypoints to the sheet of the image `name`, whose photo has
    /// `size` pixels and shows the keypoints `original`.
    pub fn add_keypoints(
        &self,
        (name, size): (&str, [usize; 2]),
        original: (&[[f32; 2]], &Descriptors),
        recovered: &Points<'_>,
        row: &Row,
        sheet: &mut Sheet,
    ) -> Result<(), Error> {
        let (photo, baseline) = &*self.truth_of(name, size, original)?;
        let image = self.painter.inverter.invert(recovered, size)?;
        add_to(sheet, (photo, baseline), &self.painter.compare(image, photo, None)?, row)
    }

    fn truth(&self, cell: &Cell<'_, 2>) -> Result<Arc<Truth>, Error> {
        let points = cell.original.reveal().positions().iter();
        let places: Vec<[f32; 2]> = points.map(|place| place.map(|x| x as f32)).collect();
        let original = (&places[..], needed(cell.descriptors)?);
        self.truth_of(cell.name.unwrap_or_default(), size(cell.released)?, original)
    }

    fn truth_of(
        &self,
        name: &str,
        size: [usize; 2],
        (places, descriptors): (&[[f32; 2]], &Descriptors),
    ) -> Result<Arc<Truth>, Error> {
        if let Some(known) = lock(&self.known).get(name) {
            return Ok(Arc::clone(known));
        }
        let path = self.photos.join(name);
        let photo = read_color(&path, self.turn)?;
        let of_photo = [photo.width() as usize, photo.height() as usize];
        if of_photo != size {
            let [expected, found] =
                [size, of_photo].map(|[width, height]| format!("{width} x {height} pixels"));
            let path = path.display().to_string().escape_debug().to_string();
            return Err(Error::new(path, format!("a photo of {expected}"), found));
        }
        let photo = self.painter.reference(name, &photo)?;
        let image = self.painter.keypoints(places, descriptors, size)?;
        let baseline = self.painter.compare(image, &photo, Some(&self.gallery))?;
        let truth = Arc::new((photo, baseline));
        let mut known = lock(&self.known);
        if known.len() >= KEPT {
            known.clear();
        }
        known.insert(name.to_owned(), Arc::clone(&truth));
        Ok(truth)
    }
}

impl Measure<2> for Inversion {
    fn is_of_images(&self) -> bool {
        true
    }

    /// Returns no figures if the photo cannot be used; [`failed`](Inversion::failed) has the reason. Other images continue.
    fn measure(&self, cell: &Cell<'_, 2>) -> Result<Vec<(String, f64)>, Error> {
        let name = cell.name.unwrap_or_default();
        let truth = match self.truth(cell) {
            Ok(truth) => truth,
            Err(error) => {
                let error = error.within(&format!("image {}", name.escape_debug()));
                lock(&self.failed).entry(name.to_owned()).or_insert(error);
                return Ok(Vec::new());
            }
        };
        let image = self.painter.image(cell.released, cell.recovered)?;
        let (photo, baseline) = &*truth;
        let picture = self.painter.compare(image, photo, Some(&self.gallery))?;
        Ok(picture.figures(baseline, &self.gallery))
    }
}
