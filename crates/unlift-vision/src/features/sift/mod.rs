//! The SIFT extractor, octave by octave and level by level.

mod descriptor;
mod extrema;
mod gradient;
mod orientation;
mod scale_space;

use std::sync::{Mutex, PoisonError};

use unlift::Error;

use crate::features::GrayImage;
use descriptor::{Desk, quantize};
use extrema::{Differences, refine};
use gradient::Gradients;
use orientation::Place;
use scale_space::{Ladder, Octave};

/// Maximum number of octaves, with the doubled one.
const OCTAVES: usize = 4;
/// Levels of scale in an octave.
const LEVELS: usize = 3;
/// Minimum contrast of a keypoint, as a difference of gray values in `0..1`.
const MIN_CONTRAST: f64 = 0.02 / 3.0;
/// Maximum ratio of principal curvatures; keypoints above it are on edges.
const MAX_EDGE_RATIO: f64 = 10.0;

/// Options of SIFT. The defaults are COLMAP's.
#[derive(Clone, Debug, PartialEq)]
pub struct SiftOptions {
    /// Number of requested features, default 8192. Whole levels are kept, from the coarsest to the
    /// one that exceeds this number, so more may be returned.
    pub max_features: usize,
    /// Longest side in pixels, default 3200. Larger images are downsized; keypoints are in pixels
    /// of the original image.
    pub max_image_size: usize,
}

impl Default for SiftOptions {
    fn default() -> Self {
        Self { max_features: 8192, max_image_size: 3200 }
    }
}

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

/// SIFT as COLMAP extracts it on a CPU: from the same pixels, keypoints agree within a thousandth
/// of a pixel, and some bytes differ by one.
///
/// Threads can share it: each call takes a set of buffers, which is reused. A set needs 24 bytes
/// per pixel of the doubled image: 30 MB for 640 x 480, 740 MB for 3200 x 2400 (larger images are
/// downsized). The same pixels give the same bytes on any machine, unless they are downsized.
///
/// Source: D. Lowe, Distinctive image features from scale-invariant keypoints, IJCV 2004; details
/// that it leaves open follow the documentation of VLFeat (vlfeat.org) and COLMAP
/// (colmap.github.io).
pub struct Sift {
    options: SiftOptions,
    ladder: Ladder,
    idle: Mutex<Vec<Workspace>>,
}

impl Default for Sift {
    /// Uses COLMAP's defaults.
    fn default() -> Self {
        Self::unchecked(SiftOptions::default())
    }
}

#[derive(Default)]
struct Workspace {
    octave: Octave,
    gradients: Gradients,
    desk: Desk,
    extrema: Vec<(u32, u32)>,
    places: Vec<Place>,
}

/// The results of one level of scale.
struct Level {
    places: usize,
    /// `None` if the description is deferred.
    features: Option<Features>,
}

impl Sift {
    /// Creates an extractor with `options`.
    ///
    /// # Errors
    /// If a field is out of range; the error names the first one.
    pub fn try_new(options: SiftOptions) -> Result<Self, Error> {
        let SiftOptions { max_features, max_image_size } = options;
        if max_features == 0 {
            return Err(Error::new("max_features", "at least 1", "0"));
        }
        if !(1..=1 << 16).contains(&max_image_size) {
            return Err(Error::new("max_image_size", "1 to 65536", max_image_size.to_string()));
        }
        Ok(Self::unchecked(options))
    }

    fn unchecked(options: SiftOptions) -> Self {
        Self { ladder: Ladder::new(), options, idle: Mutex::default() }
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

    fn run(&self, image: &GrayImage, workspace: &mut Workspace) -> Features {
        // Describing is the most expensive step, and a level with most of the requested features is
        // often dropped for coarser ones. Such levels are described only if they are kept.
        let put_off = self.options.max_features / 2;
        let mut levels = self.scan(image, workspace, |_, places| places <= put_off);
        let first = self.first_kept(&levels);
        if levels[first..].iter().any(|level| level.features.is_none()) {
            let missing: Vec<bool> = levels
                .iter()
                .enumerate()
                .map(|(at, level)| at >= first && level.features.is_none())
                .collect();
            let late = self.scan(image, workspace, |at, _| missing[at]);
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

    /// Returns the finest kept level: levels are added from the coarsest on until they exceed the
    /// number of requested features.
    fn first_kept(&self, levels: &[Level]) -> usize {
        let mut places = 0;
        for (at, level) in levels.iter().enumerate().rev() {
            places += level.places;
            if places > self.options.max_features {
                return at;
            }
        }
        0
    }

    /// Scans all levels, from the finest; describes those for which `wanted(level, places)` is
    /// true.
    fn scan(
        &self,
        image: &GrayImage,
        workspace: &mut Workspace,
        wanted: impl Fn(usize, usize) -> bool,
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
                self.find(level, workspace);
                let places = workspace.places.len();
                let features =
                    wanted(levels.len(), places).then(|| self.describe(pixel, workspace));
                levels.push(Level { places, features });
            }
            // This octave has no interior pixels, and later ones have none either.
            let (width, height) = workspace.octave.size();
            if width.min(height) < 6 {
                break;
            }
        }
        levels
    }

    /// Fills `places` with the refined extrema of the current level.
    fn find(&self, level: usize, workspace: &mut Workspace) {
        let Workspace { octave, extrema, places, .. } = workspace;
        let differences = Differences(octave.levels());
        differences.extrema(MIN_CONTRAST, extrema);
        places.clear();
        places.extend(extrema.iter().filter_map(|&(x, y)| {
            let range = (level, LEVELS + 2);
            let at = (x as usize, y as usize);
            let peak = refine(differences, at, range, MIN_CONTRAST, MAX_EDGE_RATIO)?;
            let sigma = self.ladder.sigma(level as f64 + peak.level);
            Some(Place { x: peak.x, y: peak.y, sigma })
        }));
    }

    /// Computes orientations and descriptors of `places`; a pixel of the octave is `pixel` pixels
    /// of the image.
    fn describe(&self, pixel: f64, workspace: &mut Workspace) -> Features {
        let Workspace { octave, gradients, desk, places, .. } = workspace;
        let level = &octave.levels()[1];
        gradients.reset(level);
        let mut features = Features::default();
        for &place in places.iter() {
            let (angles, n_peaks) =
                orientation::orientations(gradients, level, place, &mut desk.weights);
            for &angle in &angles[..n_peaks] {
                features.keypoints.push(keypoint(place, angle, pixel));
                let histograms = descriptor::describe(gradients, level, place, angle, desk);
                features.descriptors.push(quantize(histograms));
            }
        }
        features
    }
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
