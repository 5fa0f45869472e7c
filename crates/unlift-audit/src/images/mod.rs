//! Features of images from a folder of photos, an HDF5 file of hloc, a COLMAP database, or memory.

pub mod stream;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use unlift::Descriptors;
use unlift::audit::Plan;
use unlift::descriptors::Values;
use unlift::neighbors::Needs;
use unlift_io::features::{self, ImageFeatures, Photos, round_to_half};
use unlift_io::hash::{hash_file, hash_files};
use unlift_report::document::{ImageCounts, Input};
use unlift_vision::features::photo::Turn;
use unlift_vision::features::{Extraction, Extractor, Photo};
use unlift_vision::network::DescriptorKind;

use crate::sources::check_fit;
use crate::{Error, bail, sources};

type Get = Box<dyn Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync>;

/// Images by name, read one at a time. Threads can share it; it holds the names only.
///
/// To read all images in parallel, in order and in constant memory, call `in_order` of
/// `unlift-vision` over the indices of `names`, with `get` as its work.
pub struct FeatureSource {
    /// The names of all images, sorted by their bytes.
    pub names: Vec<String>,
    /// A line for each entry that cannot be used.
    pub refused: Vec<String>,
    /// Skipped entries in one line.
    pub passed_over: Option<String>,
    /// The orientation of photos in which keypoints are pixels.
    pub turn: Turn,
    from: Origin,
}

/// The origin of features.
enum Origin {
    /// Photos, whose features are extracted on request.
    Photos { paths: Vec<PathBuf>, extractor: Extractor, kind: DescriptorKind },
    /// A file of features.
    File(features::FeatureSource),
    /// Images of the caller.
    Memory(Get),
}

impl FeatureSource {
    /// Opens a folder of photos, or a file of features.
    pub fn open(path: &Path, extraction: &Extraction) -> Result<Self, Error> {
        let metadata = std::fs::metadata(path).map_err(|e| unlift_io::Error::read(path, e))?;
        if metadata.is_dir() {
            return Self::open_folder(path, extraction);
        }
        let file = features::FeatureSource::open(path)?;
        Ok(Self {
            names: file.names().to_vec(),
            refused: file.refused().iter().map(ToString::to_string).collect(),
            passed_over: None,
            turn: if file.is_upright() { Turn::Upright } else { Turn::AsStored },
            from: Origin::File(file),
        })
    }

    /// Opens the photos in `root` and its subfolders.
    fn open_folder(root: &Path, extraction: &Extraction) -> Result<Self, Error> {
        let extractor = Extractor::try_new(extraction)?;
        let mut listing = Photos::list(root);
        // "12 .heic, 1 .tiff".
        let others = listing.others.iter().map(|(ending, n)| format!("{n} .{ending}"));
        let others = others.collect::<Vec<_>>().join(", ");
        if listing.photos.is_empty() {
            let found = if others.is_empty() { "none" } else { &format!("only {others}") };
            let none = || unlift_io::Error::new(root, "", "JPEG, PNG or WebP photos", found);
            return Err(listing.refused.pop().unwrap_or_else(none).into());
        }
        let root = root.display();
        let passed_over = format!("{root}: passed over {others}: only JPEG, PNG and WebP are read");
        let passed_over = (!others.is_empty()).then_some(passed_over);
        let (names, paths) = listing.photos.into_iter().unzip();
        let from = Origin::Photos { paths, extractor, kind: extraction.kind };
        let refused = listing.refused.iter().map(ToString::to_string).collect();
        Ok(Self { names, refused, passed_over, turn: Turn::Upright, from })
    }

    /// Creates a source of the images `names` in memory. `get` returns the features of the image with an index in `names`, from any
    /// thread. An audit requests a few at a time, and the drawn ones again.
    ///
    /// # Errors
    /// If `names` is empty, or not sorted by bytes without repetition: the order decides the last bits of sums.
    pub fn in_memory(
        names: Vec<String>,
        get: impl Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        if names.is_empty() {
            bail!("images: expected at least one, found none");
        }
        if let Some(pair) = names.windows(2).find(|pair| pair[0].as_bytes() >= pair[1].as_bytes()) {
            let [a, b] = [&pair[0], &pair[1]];
            bail!("images: expected each name once, sorted by bytes, found {a:?} before {b:?}");
        }
        let (refused, from) = (Vec::new(), Origin::Memory(Box::new(get)));
        Ok(Self { names, refused, passed_over: None, turn: Turn::Upright, from })
    }

    /// Sets how photos of a folder are turned. No effect for files, which state it themselves.
    #[must_use]
    pub fn with_turn(self, turn: Turn) -> Self {
        let Origin::Photos { paths, extractor, kind } = self.from else { return self };
        let from = Origin::Photos { paths, extractor: extractor.with_turn(turn), kind };
        Self { turn, from, ..self }
    }

    /// Returns true for images of the caller, who can correct them.
    pub fn is_in_memory(&self) -> bool {
        matches!(self.from, Origin::Memory(_))
    }

    /// Returns true for a file of features.
    pub fn is_file(&self) -> bool {
        matches!(self.from, Origin::File(_))
    }

    /// Returns the photo of image `at`, if images are photos.
    pub fn photo(&self, at: usize) -> Option<&Path> {
        if let Origin::Photos { paths, .. } = &self.from { Some(&paths[at]) } else { None }
    }

    /// Returns the hash of the photos `used`, or of the file of features at `path`.
    pub fn hash(&self, path: &Path, used: &[usize]) -> Result<String, Error> {
        let photos: Option<Vec<&Path>> = used.iter().map(|&at| self.photo(at)).collect();
        Ok(photos.map_or_else(|| hash_file(path), |photos| hash_files(&photos))?)
    }

    /// Reads the features of image `at` of `names`.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        let name = self.names[at].clone();
        Ok(match &self.from {
            Origin::Photos { paths, extractor, .. } => ImageFeatures {
                name,
                upright: self.turn == Turn::Upright,
                photo: Some(paths[at].clone()),
                ..features_of(extractor.read(&paths[at])?)
            },
            Origin::File(file) => file.get(at)?,
            Origin::Memory(get) => ImageFeatures { name, ..get(at)? },
        })
    }

    /// Returns the first of `chosen` that can be read and has keypoints, to check its contents
    /// before the audit. The audit reports the unusable ones.
    fn first(&self, chosen: &[usize]) -> Option<ImageFeatures> {
        let mut read = chosen.iter().filter_map(|&at| self.get(at).ok());
        read.find(|image| !image.keypoints.is_empty())
    }

    /// Returns the kind of the descriptors: of those that are extracted, or of the first image of `chosen` with keypoints. Without any,
    /// the error is about `option`.
    pub fn kind(&self, option: &str, chosen: &[usize]) -> Result<DescriptorKind, Error> {
        match &self.from {
            Origin::Photos { kind, .. } => Ok(*kind),
            _ => kind_of(option, self.first(chosen).and_then(|first| first.descriptors).as_ref()),
        }
    }
}

/// Converts extracted features to those of files.
fn features_of(mut photo: Photo) -> ImageFeatures {
    if let Values::F32(values) = &mut photo.descriptors {
        round_to_half(values);
    }
    ImageFeatures {
        keypoints: photo.keypoints.into_iter().map(|place| place.map(f64::from)).collect(),
        orientations_deg: photo.orientations_deg,
        scores: Some(photo.scores),
        scales: photo.scales,
        // Descriptors that are all equal are rejected; such an image has none.
        descriptors: Descriptors::try_new(photo.descriptors, photo.dim).ok(),
        size: Some(photo.size.map(|side| side as u32)),
        uncertainty_px: Some(photo.noise_px),
        ..ImageFeatures::default()
    }
}

/// Returns the kind of `descriptors`; an error about `option` if there are none.
pub fn kind_of(option: &str, descriptors: Option<&Descriptors>) -> Result<DescriptorKind, Error> {
    let Some(descriptors) = descriptors else {
        bail!("{option}: expected descriptors, found none");
    };
    DescriptorKind::of(descriptors, option).map_err(|error| Error::request(error.to_string()))
}

/// Returns what was expected and found if the size of an image is known, and is not that of its camera.
pub(crate) fn other_size(found: Option<[u32; 2]>, camera: [f64; 2]) -> Option<(String, String)> {
    let [width, height] = found?.map(f64::from);
    let expected = format!("{} x {} pixels, as its camera in the model", camera[0], camera[1]);
    ([width, height] != camera).then(|| (expected, format!("{width} x {height}")))
}

/// What a user requests of the extraction from photos; `None` is the default.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted {
    /// The option that chooses the features.
    pub option: &'static str,
    /// The chosen features.
    pub kind: Option<DescriptorKind>,
    /// `--max-features`.
    pub max_features: Option<NonZeroUsize>,
    /// `--min-score`.
    pub min_score: Option<f32>,
    /// `--max-image-size`.
    pub max_image_size: Option<u32>,
}

impl Wanted {
    /// Returns the options of the extractor for the photos at `path`.
    ///
    /// # Errors
    /// If `path` is a file and an option is given, or an option belongs to other features.
    pub fn extraction(self, path: &Path) -> Result<Extraction, Error> {
        if path.is_file() {
            self.check_unused("a file")?;
        }
        let usual = match self.kind {
            Some(DescriptorKind::Aliked) => Extraction::ALIKED,
            Some(DescriptorKind::SuperPoint) => Extraction::SUPERPOINT,
            None | Some(DescriptorKind::Sift) => Extraction::SIFT,
        };
        if self.min_score.is_some() && usual.kind == DescriptorKind::Sift {
            let (option, aliked) = (self.option, DescriptorKind::Aliked.name());
            let kind = self.kind.map(|kind| format!("{option} {}", kind.name()));
            let given = kind.unwrap_or("none".to_owned());
            bail!("--min-score: expected with {option} {aliked}, found {given}");
        }
        Ok(Extraction {
            max_features: self.max_features.map_or(usual.max_features, NonZeroUsize::get),
            min_score: self.min_score.unwrap_or(usual.min_score),
            max_image_size: self.max_image_size.map_or(usual.max_image_size, |side| side as usize),
            ..usual
        })
    }

    /// Rejects all options if features exist already, in `found`.
    pub fn check_unused(&self, found: &str) -> Result<(), Error> {
        let given = [
            (self.option, self.kind.is_some()),
            ("--max-features", self.max_features.is_some()),
            ("--min-score", self.min_score.is_some()),
            ("--max-image-size", self.max_image_size.is_some()),
        ];
        if let Some((option, _)) = given.iter().find(|(_, given)| *given) {
            bail!("{option}: expected with a folder of photos, found {found}");
        }
        Ok(())
    }
}

/// Options of opening images for an audit.
#[derive(Clone, Debug, Default)]
pub struct Opening<'a> {
    /// Options of the extraction from photos.
    pub wanted: Wanted,
    /// Maximum number of images, evenly spaced.
    pub max_images: Option<usize>,
    /// The folder of photos of a file of features.
    pub photos: Option<&'a Path>,
    /// Whether pictures are painted.
    pub paints: bool,
    /// Whether descriptors are used beside those that sources use.
    pub uses_descriptors: bool,
    /// Whether the sources of the plan are the usual ones, which do without descriptors if there are none.
    pub is_usual: bool,
}

/// Images that were opened and checked for an audit.
pub struct Opened {
    /// The images.
    pub source: FeatureSource,
    /// Their path; for images in memory, their name in errors.
    pub path: PathBuf,
    /// Numbers of the images to use, ascending.
    pub chosen: Vec<usize>,
}

impl Opened {
    /// Opens the folder of photos or the file of features at `path` for `plan`. Checks the first image with keypoints for what sources
    /// need, to get one error instead of one per image.
    ///
    /// # Errors
    /// If `path` cannot be read, or images lack what is requested.
    pub fn open(path: &Path, opening: &Opening<'_>, plan: &mut Plan<2>) -> Result<Self, Error> {
        if opening.photos.is_some() && path.is_dir() {
            bail!("--photos: expected with a file of features, found a folder of photos");
        }
        let extraction = opening.wanted.extraction(path)?;
        let kind = extraction.kind;
        // Every source accepts SIFT.
        if path.is_dir() && kind != DescriptorKind::Sift {
            // Two samples, which differ because equal rows are rejected.
            let values = [vec![0.1; kind.dim()], vec![-0.1; kind.dim()]].concat();
            let samples = Descriptors::try_new(Values::F32(values), kind.dim())?;
            check_fit(plan, Some(&samples), "")?;
        }
        let source = FeatureSource::open(path, &extraction).map_err(|error| {
            let map = unlift_io::read::is_project(path);
            if map { error.advise("unlift audit map, as this is a map") } else { error }
        })?;
        let opened = Self::of(source, path, opening.max_images);
        let has_photo = |photos: &Path| {
            opened.chosen.iter().any(|&at| photos.join(&opened.source.names[at]).is_file())
        };
        if let Some(photos) = opening.photos.filter(|photos| opening.paints && !has_photo(photos)) {
            let expected = format!("photos of the images in {}", path.display());
            return Err(unlift_io::Error::new(photos, "", expected, "none").into());
        }
        // Extracted features always have descriptors.
        let uses =
            opening.uses_descriptors || plan.own_sources().any(|by| by.needs() != Needs::Nothing);
        if uses
            && opened.source.is_file()
            && let Some(first) = opened.source.first(&opened.chosen)
        {
            if opening.is_usual && first.descriptors.is_none() {
                plan.neighbors = sources::usual(false);
            }
            if opening.paints {
                kind_of("--invert", first.descriptors.as_ref())?;
            }
            check_fit(plan, first.descriptors.as_ref(), "")?;
        }
        Ok(opened)
    }

    /// Returns what a report says of the images; those in memory have no path and no hash. `used` are the images whose photos count.
    pub(crate) fn about(
        &self,
        used: &[usize],
        n_points: usize,
        counts: ImageCounts,
    ) -> Result<Input, Error> {
        let Self { source, path, .. } = self;
        let found = (source.names.len() + source.refused.len()) as u64;
        let about = Input {
            n_points: n_points as u64,
            images: Some(ImageCounts { found, ..counts }),
            ..Input::default()
        };
        if source.is_in_memory() {
            return Ok(about);
        }
        let (path, sha256) = (Some(path.display().to_string()), source.hash(path, used)?);
        Ok(Input { path, sha256: Some(sha256), ..about })
    }

    /// Takes images that were opened already.
    pub fn of(source: FeatureSource, path: &Path, max_images: Option<usize>) -> Self {
        let chosen = evenly(source.names.len(), max_images);
        Self { source, path: path.to_owned(), chosen }
    }
}

/// Returns the numbers of at most `max_images` of `n` images, evenly spaced: the middles of equal parts.
pub fn evenly(n: usize, max_images: Option<usize>) -> Vec<usize> {
    let max_images = max_images.unwrap_or(n).min(n);
    (0..max_images).map(|at| ((2 * at + 1) * n) / (2 * max_images)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_once_and_in_order() {
        let of = |names: &[&str]| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            FeatureSource::in_memory(names, |_| Ok(ImageFeatures::default()))
        };
        let images = of(&["B", "a"]).unwrap();
        assert_eq!(images.get(1).unwrap().name, "a");
        let line = |names: &[&str]| of(names).err().map(|error| error.to_string());
        let expected = "images: expected each name once, sorted by bytes, found \"a\" before \"a\"";
        assert_eq!(line(&["a", "a"]).as_deref(), Some(expected));
        assert!(line(&["a", "B"]).is_some());
        assert_eq!(line(&[]).as_deref(), Some("images: expected at least one, found none"));
    }

    #[test]
    fn images_are_evenly_spaced_and_all_without_a_limit() {
        assert_eq!(evenly(4, None), [0, 1, 2, 3]);
        assert_eq!(evenly(10, Some(3)), [1, 5, 8]);
        assert_eq!(evenly(3, Some(9)), [0, 1, 2]);
        assert_eq!(evenly(0, Some(2)), [0; 0]);
    }
}
