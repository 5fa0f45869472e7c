//! Scheme `lines2d`: a random line through every keypoint of an image.
//!
//! It applies `olc` in the plane, with a uniform angle. The image size is released, so a hidden
//! point lies on a chord. Scale and orientation of keypoints are not released.

use std::sync::Arc;

use super::olc::Olc;
use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::Error;
use crate::geometry::frame::Bounds;
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

impl Scheme<2> for Lines2d {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn facts(&self) -> Facts {
        ENTRY.facts
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
