//! Extracts features of any kind from a photo in a file, and works on many photos in parallel.

use std::path::Path;

use rayon::prelude::*;
use unlift::Error;
use unlift::descriptors::Values;
use unlift::neighbors::DescriptorKind;

use super::image::ColorImage;
use super::learned::{LearnedFeatures, aliked, superpoint};
use super::options::Extraction;
use super::photo::{self, Turn};
use super::sift::{Features, Sift};
use crate::network::Network;

/// Smallest side of an image that can have an extremum.
const LEAST_SIDE: u32 = 3;
/// Standard deviation of a keypoint in pixels of the processed image, as hloc states it.
const DETECTION_NOISE: f64 = 1.0;
/// Standard deviation of a SuperPoint keypoint, which is on a pixel.
const SUPERPOINT_NOISE: f64 = 2.0;

/// An extractor; threads can share it.
pub struct Extractor {
    options: Extraction,
    method: Method,
    turn: Turn,
}

enum Method {
    Sift(Sift),
    /// A network, what extracts features by it, and the standard deviation of its keypoints.
    Learned(Network, Extract, f64),
}

type Extract = fn(&Network, &Extraction, &ColorImage) -> Result<LearnedFeatures, Error>;

/// The features of a photo.
pub struct Photo {
    /// Width and height of the photo in pixels.
    pub size: [usize; 2],
    /// Standard deviation of a keypoint in pixels of the photo.
    pub noise_px: f64,
    /// Positions in pixels of the photo; the middle of the first pixel is `(0, 0)`, as in hloc.
    pub keypoints: Vec<[f32; 2]>,
    /// How repeatable each keypoint is: the score of a network, or the scale of SIFT.
    pub scores: Vec<f32>,
    /// Standard deviations of the smoothing of extrema, in pixels of the photo; of SIFT alone.
    pub scales: Option<Vec<f32>>,
    /// Main directions of gradients, in degrees; of SIFT alone.
    pub orientations_deg: Option<Vec<f32>>,
    /// Descriptors `(n, dim)`, row-major.
    pub descriptors: Values,
    /// Number of values of a descriptor.
    pub dim: usize,
}

impl Photo {
    /// Moves the middle of the first pixel from (0.5, 0.5) to (0, 0). No other function does this.
    fn of_sift(size: [usize; 2], noise_px: f64, features: Features) -> Self {
        let Features { keypoints, descriptors } = features;
        let scales: Vec<f32> = keypoints.iter().map(|keypoint| keypoint.scale).collect();
        Self {
            size,
            noise_px,
            keypoints: keypoints.iter().map(|at| [at.x - 0.5, at.y - 0.5]).collect(),
            // SIFT contrast is not kept; large features are more repeatable than small ones.
            scores: scales.clone(),
            scales: Some(scales),
            orientations_deg: Some(keypoints.iter().map(|k| k.orientation.to_degrees()).collect()),
            descriptors: Values::U8(descriptors.into_flattened()),
            dim: 128,
        }
    }

    fn of_network(size: [usize; 2], noise_px: f64, features: LearnedFeatures) -> Self {
        let LearnedFeatures { keypoints, scores, descriptors, dim } = features;
        let descriptors = Values::F32(descriptors);
        let (scales, orientations_deg) = (None, None);
        Self { size, noise_px, keypoints, scores, scales, orientations_deg, descriptors, dim }
    }
}

impl Extractor {
    /// Creates an extractor with these options.
    ///
    /// # Errors
    /// If an option is out of range or a model is missing; the error names it.
    pub fn try_new(options: &Extraction) -> Result<Self, Error> {
        options.check()?;
        let learned = |name, extract, noise_px| {
            Network::load(name).map(|network| Method::Learned(network, extract, noise_px))
        };
        let method = match options.kind {
            DescriptorKind::Sift => Method::Sift(Sift::try_new(*options)?),
            DescriptorKind::Aliked => learned("aliked-n16rot", aliked, DETECTION_NOISE)?,
            DescriptorKind::SuperPoint => learned("superpoint", superpoint, SUPERPOINT_NOISE)?,
        };
        Ok(Self { options: *options, method, turn: Turn::Upright })
    }

    /// Sets how photos are turned before extraction.
    #[must_use]
    pub fn with_turn(self, turn: Turn) -> Self {
        Self { turn, ..self }
    }

    /// Extracts the features of the photo at `path`.
    ///
    /// # Errors
    /// See [`photo::read`]; also if a side has fewer than 3 pixels.
    pub fn read(&self, path: &Path) -> Result<Photo, Error> {
        let photo = photo::open(path, self.turn)?;
        let (width, height) = (photo.width(), photo.height());
        if width.min(height) < LEAST_SIDE {
            let expected = format!("at least {LEAST_SIDE} pixels a side");
            let place = path.display().to_string();
            return Err(Error::new(place, expected, format!("{width} x {height}")));
        }
        let size = [width as usize, height as usize];
        let shrunk = f64::from(width.max(height)) / self.options.max_image_size as f64;
        let noise = |noise_px: f64| noise_px * shrunk.max(1.0);
        match &self.method {
            Method::Sift(sift) => {
                let features = sift.extract(&photo::gray(photo)?);
                Ok(Photo::of_sift(size, noise(DETECTION_NOISE), features))
            }
            Method::Learned(network, extract, noise_px) => {
                let features = extract(network, &self.options, &photo::color(photo)?)?;
                Ok(Photo::of_network(size, noise(*noise_px), features))
            }
        }
    }
}

/// Items per thread that are processed before results are passed on.
const PER_THREAD: usize = 8;

/// Calls `work` on all items in parallel, and `sink` on the results, one at a time and in order.
///
/// At most 8 items per thread are in memory. Ends with the first error of `sink`.
///
/// # Errors
/// When `sink` returns an error.
pub fn in_order<T: Sync, R: Send, E>(
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
    mut sink: impl FnMut(usize, R) -> Result<(), E>,
) -> Result<(), E> {
    let size = PER_THREAD * rayon::current_num_threads();
    for (chunk, items) in items.chunks(size).enumerate() {
        // One item per job, because photos differ in cost.
        let results: Vec<R> = items.par_iter().with_max_len(1).map(&work).collect();
        for (at, result) in results.into_iter().enumerate() {
            sink(chunk * size + at, result)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_and_a_failing_sink_ends_it() {
        let items: Vec<usize> = (0..1000).collect();
        let mut seen = Vec::new();
        let result = in_order(
            &items,
            |item| item * 2,
            |at, value| {
                assert_eq!(value, 2 * at);
                seen.push(at);
                if at == 500 { Err("full") } else { Ok(()) }
            },
        );
        assert_eq!(result, Err("full"));
        assert_eq!(seen, items[..501]);
    }
}
