//! Extracts features of any kind from a photo in a file.

use std::path::Path;

use unlift::Error;
use unlift::neighbors::DescriptorKind;

use crate::features::color::ColorImage;
use crate::features::learned::{
    Aliked, AlikedOptions, LearnedFeatures, SuperPoint, SuperPointOptions,
};
use crate::features::load::{self, Turn};
use crate::features::sift::SiftOptions;
use crate::features::sift::{Features, Sift};

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
    /// See [`load::read`]; also if a side has fewer than 3 pixels.
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
