//! Whichever features were asked for, from a photo in a file.

use std::path::Path;

use unlift::Error;
use unlift_nn::DescriptorKind;

use crate::color::ColorImage;
use crate::learned::{Aliked, AlikedOptions, LearnedFeatures, SuperPoint, SuperPointOptions};
use crate::load::{self, Turn};
use crate::options::SiftOptions;
use crate::sift::{Features, Sift};

/// Pixels a side below which nothing can be an extremum.
const LEAST_SIDE: usize = 3;
/// Standard deviation of a keypoint in pixels of the image it was found in, as hloc states it.
const DETECTION_NOISE: f64 = 1.0;
/// The same of SuperPoint's, which lie on pixels.
const SUPERPOINT_NOISE: f64 = 2.0;

/// Which features, and how.
#[derive(Clone, Debug, PartialEq)]
pub enum Extraction {
    /// SIFT.
    Sift(SiftOptions),
    /// ALIKED.
    Aliked(AlikedOptions),
    /// SuperPoint.
    SuperPoint(SuperPointOptions),
}

impl Default for Extraction {
    fn default() -> Self {
        Self::Sift(SiftOptions::default())
    }
}

impl Extraction {
    /// Of which kind the descriptors are.
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

/// What extracts them. Shared by threads.
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
    /// Width and height in pixels of the photo in which features were found.
    pub size: [usize; 2],
    /// Standard deviation of a keypoint in pixels of the photo.
    pub noise_px: f64,
    /// What was found.
    pub found: Found,
}

/// Features of either kind.
pub enum Found {
    /// SIFT's.
    Sift(Features),
    /// A network's.
    Learned(LearnedFeatures),
}

impl Extractor {
    /// An extractor with these options.
    ///
    /// # Errors
    /// Names the first option that is out of range; says which model is missing.
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

    /// Sets how photos are turned before features are extracted.
    #[must_use]
    pub fn with_turn(self, turn: Turn) -> Self {
        Self { turn, ..self }
    }

    /// The features of the photo at `path`.
    ///
    /// # Errors
    /// As [`load::read`], and when a side has fewer than 3 pixels.
    pub fn read(&self, path: &Path) -> Result<Photo, Error> {
        let (size, noise_px, found) = match &self.of {
            Of::Sift(sift) => {
                let image = load::read_with(path, self.turn)?;
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

    /// Hash of the network's file where it is the user's: what they supply may change between runs.
    pub fn sha256(&self) -> Option<&str> {
        match &self.of {
            Of::Sift(_) | Of::Aliked(_) => None,
            Of::SuperPoint(superpoint) => Some(superpoint.sha256()),
        }
    }
}

fn color(path: &Path, turn: Turn) -> Result<(ColorImage, [usize; 2]), Error> {
    let image = load::read_color_with(path, turn)?;
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
