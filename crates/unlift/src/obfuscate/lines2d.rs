//! Scheme `lines2d`: a random line through every keypoint of an image.
//!
//! It applies `olc` in the plane, with a uniform angle. The image size is released, so a hidden
//! point lies on a chord. Scale and orientation of keypoints are not released.
//!
//! The variant `lines2d-gravity` uses the line through the image of the gravity direction, as
//! proposed for structure from motion. Images have no gravity here, so the camera is assumed to be
//! upright and tilted down by 15 degrees, with a focal length of 1.2 times the longer side. All
//! lines then meet in one point below the image.

use std::sync::Arc;

use super::olc::Olc;
use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::Error;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::sub;
use crate::released::{Lines, Obfuscation};
use crate::seed::Key;

/// Random lines through keypoints.
#[derive(Clone, Copy, Debug)]
pub struct Lines2d;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    name: "lines2d",
    facts: Facts {
        summary: "a random line through every keypoint",
        source: "Speciale et al., Privacy Preserving Image Queries for Camera Localization, ICCV 2019",
        hidden: "the position along the line (1 of 2 coordinates)",
        patents: "US 10,839,556, Microsoft",
    },
    in_2d: Some(|_| Arc::new(Lines2d)),
    in_3d: None,
};

/// Lines through the image of the gravity direction.
#[derive(Clone, Copy, Debug)]
pub struct Gravity;

/// Registry entry of the variant.
pub const GRAVITY: Entry = Entry {
    name: "lines2d-gravity",
    facts: Facts {
        summary: "the line through a keypoint and the image of the gravity direction",
        source: "Geppert et al., Privacy Preserving Structure-from-Motion, ECCV 2020",
        hidden: "the position along the line (1 of 2 coordinates)",
        patents: "none found",
    },
    in_2d: Some(|_| Arc::new(Gravity)),
    in_3d: None,
};

/// Focal length over the tangent of the assumed tilt, in longer sides of the image.
const BELOW: f64 = 1.2 / 0.267_949;

impl Scheme<2> for Gravity {
    fn name(&self) -> &str {
        GRAVITY.name
    }

    fn lift(
        &self,
        points: &[[f64; 2]],
        bounds: Option<&Bounds<2>>,
        _: &Key,
    ) -> Result<Lifted<2>, Error> {
        let Some(image) = bounds else {
            return Err(Error::new("image size", "known: gravity points below it", "none"));
        };
        let [width, height] = sub(&image.high, &image.low);
        let [x, y] = image.center();
        let below = [x, y + BELOW * width.max(height)];
        let directions: Vec<[f64; 2]> = points.iter().map(|p| sub(&below, p)).collect();
        Ok(Lifted::one_each(Obfuscation::Lines(Lines::through(points, &directions)?)))
    }
}

impl Scheme<2> for Lines2d {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn lift(
        &self,
        points: &[[f64; 2]],
        bounds: Option<&Bounds<2>>,
        key: &Key,
    ) -> Result<Lifted<2>, Error> {
        Olc.lift(points, bounds, key)
    }
}
