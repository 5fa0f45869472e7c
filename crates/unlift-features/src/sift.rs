//! The extractor: octave by octave, level by level.

use std::sync::{Mutex, PoisonError};

use unlift::Error;

use crate::descriptor::{self, Desk};
use crate::extrema::Differences;
use crate::gradient::Gradients;
use crate::image::GrayImage;
use crate::octave::{Ladder, Octave};
use crate::options::SiftOptions;
use crate::orientation::{self, Place};
use crate::quantize::quantize;
use crate::refine::refine;

/// A place in an image with a scale and an orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Column in pixels; the middle of the first pixel is at 0.5 (COLMAP's convention).
    pub x: f32,
    /// Row in pixels, likewise.
    pub y: f32,
    /// Standard deviation of the smoothing at which the keypoint stands out, in pixels.
    pub scale: f32,
    /// Main direction of the gradient, in radians within `-PI..=PI`, from x to y.
    pub orientation: f32,
}

/// Keypoints of an image and what they look like, the finest scales first.
///
/// A place with two orientations is there twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// `n` keypoints.
    pub keypoints: Vec<Keypoint>,
    /// `(n, 128)` RootSIFT descriptors, their Euclidean length scaled to 512.
    pub descriptors: Vec<[u8; descriptor::LENGTH]>,
}

/// Scale-invariant features as COLMAP extracts them on a CPU: of the same pixels the same keypoints
/// within a thousandth of a pixel, and bytes that differ by one here and there.
///
/// Shared by any number of threads: each call borrows a set of buffers, and buffers are kept for the
/// next. A set takes 24 bytes per pixel of the doubled image: 30 MB for 640 x 480, 740 MB for 3200 x
/// 2400 (larger images are shrunk). The same pixels give the same bytes on any machine, unless they are shrunk.
///
/// Source: D. Lowe, Distinctive image features from scale-invariant keypoints, IJCV 2004; where that
/// leaves a choice, the documentation of VLFeat (vlfeat.org) and COLMAP (colmap.github.io).
pub struct Sift {
    options: SiftOptions,
    ladder: Ladder,
    idle: Mutex<Vec<Workspace>>,
}

impl Default for Sift {
    /// COLMAP's defaults.
    fn default() -> Self {
        Self::unchecked(SiftOptions::default())
    }
}

/// Everything an extraction writes to, kept between images.
#[derive(Default)]
struct Workspace {
    octave: Octave,
    gradients: Gradients,
    desk: Desk,
    extrema: Vec<(u32, u32)>,
    places: Vec<Place>,
}

/// What one level of scale gave.
struct Level {
    /// Places found, before orientations.
    places: usize,
    /// `None` where describing was put off.
    features: Option<Features>,
}

impl Sift {
    /// An extractor with `options`.
    ///
    /// # Errors
    /// When [`SiftOptions::check`] refuses them.
    pub fn try_new(options: SiftOptions) -> Result<Self, Error> {
        options.check()?;
        Ok(Self::unchecked(options))
    }

    fn unchecked(options: SiftOptions) -> Self {
        Self { ladder: Ladder::new(&options), options, idle: Mutex::default() }
    }

    /// The features of `image`, in pixels of it even where it was shrunk.
    ///
    /// An image without structure, or of fewer than 3 pixels a side, has none.
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
        // A level with most of the features wanted is likely to be dropped in favor of coarser
        // ones, and describing is the dearest part: such levels are described when it is known.
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

    /// The finest level that is kept: levels from the coarsest on until they have more places than
    /// features are wanted.
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

    /// All levels, from the finest; `wanted(level, places)` are described.
    fn scan(
        &self,
        image: &GrayImage,
        workspace: &mut Workspace,
        wanted: impl Fn(usize, usize) -> bool,
    ) -> Vec<Level> {
        let mut levels = Vec::new();
        workspace.octave.start(image, self.options.doubled, &self.ladder);
        let mut pixel = if self.options.doubled { 0.5 } else { 1.0 };
        for octave in 0..self.options.octaves {
            if octave > 0 {
                workspace.octave.next(&self.ladder);
                pixel *= 2.0;
            }
            for level in 1..=self.options.levels {
                if level > 1 {
                    workspace.octave.step(level - 1, &self.ladder);
                }
                self.find(level, workspace);
                let places = workspace.places.len();
                let features =
                    wanted(levels.len(), places).then(|| self.describe(pixel, workspace));
                levels.push(Level { places, features });
            }
            // An octave without an inside has no extrema, and neither have those after it.
            let (width, height) = workspace.octave.size();
            if width.min(height) < 6 {
                break;
            }
        }
        levels
    }

    /// Fills `places` with the refined extrema of the present level.
    fn find(&self, level: usize, workspace: &mut Workspace) {
        let Workspace { octave, extrema, places, .. } = workspace;
        let differences = Differences(octave.levels());
        let SiftOptions { peak_threshold, edge_threshold, levels, .. } = self.options;
        differences.extrema(peak_threshold, extrema);
        places.clear();
        places.extend(extrema.iter().filter_map(|&(x, y)| {
            let range = (level, levels + 2);
            let at = (x as usize, y as usize);
            let peak = refine(differences, at, range, peak_threshold, edge_threshold)?;
            let sigma = self.ladder.sigma(level as f64 + peak.level);
            Some(Place { x: peak.x, y: peak.y, sigma })
        }));
    }

    /// Orientations and descriptors of `places`; a pixel of the octave has `pixel` of the image.
    fn describe(&self, pixel: f64, workspace: &mut Workspace) -> Features {
        let Workspace { octave, gradients, desk, places, .. } = workspace;
        let level = &octave.levels()[1];
        gradients.reset(level);
        let mut features = Features::default();
        for &place in places.iter() {
            let (angles, found) = match self.options.upright {
                true => ([0.0; orientation::MOST], 1),
                false => orientation::orientations(gradients, level, place, &mut desk.weights),
            };
            for &angle in &angles[..found.min(self.options.max_orientations)] {
                features.keypoints.push(keypoint(place, angle, pixel));
                let histograms = descriptor::describe(gradients, level, place, angle, desk);
                features.descriptors.push(quantize(histograms));
            }
        }
        features
    }
}

/// A place in pixels of the image.
fn keypoint(place: Place, angle: f64, pixel: f64) -> Keypoint {
    use std::f64::consts::{PI, TAU};
    Keypoint {
        x: (place.x * pixel + 0.5) as f32,
        y: (place.y * pixel + 0.5) as f32,
        scale: (place.sigma * pixel) as f32,
        orientation: if angle > PI { angle - TAU } else { angle } as f32,
    }
}
