//! Scheme `cp2d`: random pairs of keypoints of an image exchange one coordinate.
//!
//! It applies `cp` to each image separately.

use std::sync::Arc;

use super::cp::Cp;
use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::Error;
use crate::geometry::frame::Bounds;
use crate::seed::Key;

/// Coordinate permutations of keypoints.
#[derive(Clone, Copy, Debug)]
pub struct Cp2d;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    name: "cp2d",
    facts: Facts {
        summary: "random pairs of keypoints exchange one random coordinate",
        source: "Pan et al., Privacy Preserving Localization via Coordinate Permutations, ICCV 2023",
        hidden: "which coordinate was exchanged, and its value",
        patents: "none found",
    },
    in_2d: Some(|_| Arc::new(Cp2d)),
    in_3d: None,
};

impl Scheme<2> for Cp2d {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn lift(
        &self,
        points: &[[f64; 2]],
        bounds: Option<&Bounds<2>>,
        key: &Key,
    ) -> Result<Lifted<2>, Error> {
        Cp.lift(points, bounds, key)
    }
}
