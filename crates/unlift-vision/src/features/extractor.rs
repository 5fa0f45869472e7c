//! Extracts features of any kind from a photo in a file, and works on many photos in parallel.

use std::path::Path;

use rayon::prelude::*;
use unlift::Error;
use unlift::neighbors::DescriptorKind;

use super::image::ColorImage;
use super::learned::{Aliked, LearnedFeatures, LearnedOptions, SuperPoint};
use super::photo::{self, Turn};
use super::sift::{Features, Sift, SiftOptions};

/// Smallest side of an image that can have an extremum.
const LEAST_SIDE: usize = 3;
/// Standard deviation of a keypoint in pixels of the processed image, as hloc states it.
const DETECTION_NOISE: f64 = 1.0;
/// Standard deviation of a SuperPoint keypoint, which is on a pixel.
const SUPERPOINT_NOISE: f64 = 2.0;

/// Kind and options of the extraction.
#[derive(Clone, Debug, PartialEq)]
pub enum Extraction {
    /// SIFT.
    Sift(SiftOptions),
    /// ALIKED.
    Aliked(LearnedOptions),
    /// SuperPoint.
    SuperPoint(LearnedOptions),
}

impl Default for Extraction {
    fn default() -> Self {
        Self::Sift(SiftOptions::default())
    }
}

impl Extraction {
    /// Returns the kind of the descriptors.
    pub fn kind(&self) -> DescriptorKind {
        match self {
            Self::Sift(_) => DescriptorKind::Sift,
            Self::Aliked(_) => DescriptorKind::Aliked,
            Self::SuperPoint(_) => DescriptorKind::SuperPoint,
        }
    }

    fn max_image_size(&self) -> usize {
        match self {
            Self::Sift(options) => options.max_image_size,
            Self::Aliked(options) => options.max_image_size,
            Self::SuperPoint(options) => options.max_image_size,
        }
    }
}

/// An extractor; threads can share it.
pub struct Extractor {
    of: Of,
    max_image_size: usize,
    turn: Turn,
}

enum Of {
    Sift(Sift),
    Aliked(Aliked),
    SuperPoint(SuperPoint),
}

/// The features of a photo.
pub struct Photo {
    /// Width and height of the photo in pixels.
    pub size: [usize; 2],
    /// Standard deviation of a keypoint in pixels of the photo.
    pub noise_px: f64,
    /// The features.
    pub found: Found,
}

/// Features of SIFT or of a network.
pub enum Found {
    /// Features of SIFT.
    Sift(Features),
    /// Features of a network.
    Learned(LearnedFeatures),
}

impl Extractor {
    /// Creates an extractor with these options.
    ///
    /// # Errors
    /// If an option is out of range or a model is missing; the error names it.
    pub fn try_new(extraction: &Extraction) -> Result<Self, Error> {
        let of = match extraction {
            Extraction::Sift(options) => Of::Sift(Sift::try_new(options.clone())?),
            Extraction::Aliked(options) => Of::Aliked(Aliked::try_new(options.clone())?),
            Extraction::SuperPoint(options) => {
                Of::SuperPoint(SuperPoint::try_new(options.clone())?)
            }
        };
        Ok(Self { of, max_image_size: extraction.max_image_size(), turn: Turn::Upright })
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
        let (size, noise_px, found) = match &self.of {
            Of::Sift(sift) => {
                let image = photo::read_with(path, self.turn)?;
                let size = large_enough(path, [image.width(), image.height()])?;
                (size, DETECTION_NOISE, Found::Sift(sift.extract(&image)))
            }
            Of::Aliked(aliked) => {
                let (image, size) = color(path, self.turn)?;
                (size, DETECTION_NOISE, Found::Learned(aliked.extract(&image)?))
            }
            Of::SuperPoint(superpoint) => {
                let (image, size) = color(path, self.turn)?;
                (size, SUPERPOINT_NOISE, Found::Learned(superpoint.extract(&image)?))
            }
        };
        let shrunk = size[0].max(size[1]) as f64 / self.max_image_size as f64;
        Ok(Photo { size, noise_px: noise_px * shrunk.max(1.0), found })
    }

    /// Returns the hash of the network's file if the user supplies it; such a file may change
    /// between runs.
    pub fn sha256(&self) -> Option<&str> {
        match &self.of {
            Of::Sift(_) | Of::Aliked(_) => None,
            Of::SuperPoint(superpoint) => Some(superpoint.sha256()),
        }
    }
}

fn color(path: &Path, turn: Turn) -> Result<(ColorImage, [usize; 2]), Error> {
    let image = photo::read_color_with(path, turn)?;
    let size = large_enough(path, [image.width(), image.height()])?;
    Ok((image, size))
}

fn large_enough(path: &Path, size: [usize; 2]) -> Result<[usize; 2], Error> {
    if size.iter().any(|&side| side < LEAST_SIDE) {
        let expected = format!("at least {LEAST_SIDE} pixels a side");
        let found = format!("{} x {}", size[0], size[1]);
        let name = path.display().to_string();
        return Err(Error::new(name.escape_debug().to_string(), expected, found));
    }
    Ok(size)
}

/// Items per thread that are processed before results are passed on.
const PER_THREAD: usize = 8;

/// Calls `work` on all items in parallel, and `sink` on the results, one at a time and in order.
///
/// At most 8 items per thread are in memory at once. Runs on rayon's current pool. Ends with the
/// first error of `sink`.
///
/// # Errors
/// When `sink` returns an error.
///
/// ```
/// use unlift_vision::features::in_order;
///
/// let mut squares = Vec::new();
/// in_order(&[1, 2, 3], |n| n * n, |at, square| {
///     squares.push((at, square));
///     Ok::<(), std::convert::Infallible>(())
/// })?;
/// assert_eq!(squares, [(0, 1), (1, 4), (2, 9)]);
/// # Ok::<(), std::convert::Infallible>(())
/// ```
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
