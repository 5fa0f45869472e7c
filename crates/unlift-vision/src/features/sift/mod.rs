//! The SIFT extractor, octave by octave and level by level.

mod descriptor;
mod extrema;
mod gradient;
mod orientation;
mod scale_space;

use std::sync::{Mutex, PoisonError};

use unlift::Error;

use crate::features::{Extraction, GrayImage};
use descriptor::quantize;
use extrema::{Differences, refine};
use gradient::Gradients;
use orientation::Place;
use scale_space::{Ladder, Octave};

/// Maximum number of octaves, with the doubled one.
const OCTAVES: usize = 4;
/// Levels of scale in an octave.
const LEVELS: usize = 3;

/// A position in an image with a scale and an orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Column in pixels; the middle of the first pixel is at 0.5 (COLMAP's convention).
    pub x: f32,
    /// Row in pixels; the middle of the first pixel is at 0.5.
    pub y: f32,
    /// Standard deviation of the smoothing of the extremum, in pixels.
    pub scale: f32,
    /// Main direction of the gradient, in radians within `-PI..=PI`, from x to y.
    pub orientation: f32,
}

/// Keypoints and descriptors of an image, the finest scales first.
///
/// A position with two orientations appears twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// `n` keypoints.
    pub keypoints: Vec<Keypoint>,
    /// RootSIFT descriptors `(n, 128)`, scaled to length 512.
    pub descriptors: Vec<[u8; descriptor::LENGTH]>,
}

/// SIFT as COLMAP extracts it on a CPU: from the same pixels, keypoints agree within a thousandth of a pixel, and some bytes differ by one.
///
/// Threads can share it: each call takes a set of buffers, which is reused. A set needs 24 bytes
/// per pixel of the doubled image: 30 MB for 640 x 480, 740 MB for 3200 x 2400 (larger images are
/// downsized). The same pixels give the same bytes on any machine, unless they are downsized.
///
/// The default has COLMAP's options.
///
/// Source: D. Lowe, Distinctive image features from scale-invariant keypoints, IJCV 2004; details
/// that it leaves open follow the documentation of VLFeat and COLMAP.
#[derive(Default)]
pub struct Sift {
    options: Extraction,
    ladder: Ladder,
    idle: Mutex<Vec<Workspace>>,
}

#[derive(Default)]
struct Workspace {
    octave: Octave,
    gradients: Gradients,
    /// Weights of the columns and rows around a keypoint.
    weights: [Vec<f32>; 2],
}

/// The results of one level of scale.
struct Level {
    n_places: usize,
    /// `None` if the description is deferred.
    features: Option<Features>,
}

impl Sift {
    /// Creates an extractor with `options`, of which SIFT has no `min_score`.
    ///
    /// # Errors
    /// If a field is out of range; the error names the first one.
    pub fn try_new(options: Extraction) -> Result<Self, Error> {
        options.check()?;
        Ok(Self { options, ..Self::default() })
    }

    /// Extracts the features of `image`, in its pixels even if it is downsized.
    ///
    /// An image without structure, or with a side of less than 3 pixels, has none.
    pub fn extract(&self, image: &GrayImage) -> Features {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut workspace = idle.unwrap_or_default();
        let small = image.fitted(self.options.max_image_size);
        let mut features = self.run(small.as_ref().unwrap_or(image), &mut workspace);
        if let Some(small) = small {
            let x = image.width() as f32 / small.width() as f32;
            let y = image.height() as f32 / small.height() as f32;
            for keypoint in &mut features.keypoints {
                keypoint.x *= x;
                keypoint.y *= y;
                keypoint.scale *= 0.5 * (x + y);
            }
        }
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(workspace);
        features
    }

    /// Extracts whole levels, from the coarsest until they exceed the requested number.
    fn run(&self, image: &GrayImage, workspace: &mut Workspace) -> Features {
        let max_features = self.options.max_features;
        // Describing is the most expensive step, and a level with most of the requested features is
        // often dropped for coarser ones. Such levels are described only if they are kept.
        let mut levels = self.scan(image, workspace, |_, n_places| n_places <= max_features / 2);
        let mut n_places = 0;
        let exceeds = |level: &Level| {
            n_places += level.n_places;
            n_places > max_features
        };
        let first = levels.iter().rposition(exceeds).unwrap_or(0);
        let is_missing = |at: usize| at >= first && levels[at].features.is_none();
        if (0..levels.len()).any(is_missing) {
            let late = self.scan(image, workspace, |at, _| is_missing(at));
            for (level, late) in levels.iter_mut().zip(late) {
                level.features = level.features.take().or(late.features);
            }
        }
        let mut all = Features::default();
        for features in levels.into_iter().skip(first).filter_map(|level| level.features) {
            all.keypoints.extend(features.keypoints);
            all.descriptors.extend(features.descriptors);
        }
        all
    }

    /// Scans all levels, from the finest; describes those that `is_wanted(level, n_places)`.
    fn scan(
        &self,
        image: &GrayImage,
        workspace: &mut Workspace,
        is_wanted: impl Fn(usize, usize) -> bool,
    ) -> Vec<Level> {
        let mut levels = Vec::new();
        workspace.octave.start(image, &self.ladder);
        // The first octave is the doubled image (COLMAP: first octave -1), which has the finest features.
        let mut pixel = 0.5;
        for octave in 0..OCTAVES {
            if octave > 0 {
                workspace.octave.next(&self.ladder);
                pixel *= 2.0;
            }
            for level in 1..=LEVELS {
                if level > 1 {
                    workspace.octave.step(level - 1, &self.ladder);
                }
                let differences = Differences(&workspace.octave.levels);
                let extrema = differences.extrema().into_iter();
                let places: Vec<Place> =
                    extrema.filter_map(|at| refine(differences, at, level)).collect();
                let features = is_wanted(levels.len(), places.len())
                    .then(|| describe(&places, pixel, workspace));
                levels.push(Level { n_places: places.len(), features });
            }
            // This octave has no interior pixels, and later ones have none either.
            let level = &workspace.octave.levels[0];
            if level.width.min(level.height) < 6 {
                break;
            }
        }
        levels
    }
}

/// Computes orientations and descriptors; a pixel of the octave is `pixel` of the image.
fn describe(places: &[Place], pixel: f64, workspace: &mut Workspace) -> Features {
    let Workspace { octave, gradients, weights } = workspace;
    let level = &octave.levels[1];
    gradients.reset(level);
    let mut features = Features::default();
    for &place in places {
        for angle in orientation::orientations(gradients, level, place, weights) {
            features.keypoints.push(keypoint(place, angle, pixel));
            let histograms = descriptor::describe(gradients, level, place, angle, weights);
            features.descriptors.push(quantize(histograms));
        }
    }
    features
}

fn keypoint(place: Place, angle: f64, pixel: f64) -> Keypoint {
    use std::f64::consts::{PI, TAU};
    Keypoint {
        x: (place.x * pixel + 0.5) as f32,
        y: (place.y * pixel + 0.5) as f32,
        scale: (place.sigma * pixel) as f32,
        orientation: if angle > PI { angle - TAU } else { angle } as f32,
    }
}
