//! Scheme `dcl2d`: lines through one of two anchors, chosen by the half of the image that contains
//! the keypoint.
//!
//! The authors have published no code. This implementation follows the paper, with these
//! assumptions:
//!
//! - The split is vertical, at half of the width. The anchors are the two ends of the split: the
//!   upper one for the left half, the lower one for the right half. Their distance, the image
//!   height, is the one recommended.
//! - A keypoint on the split belongs to the right half.
//! - A keypoint on its anchor has no line and is dropped.
//! - The variants split the image at half of the height, or put the anchors at half or at twice the
//!   distance, around the center of the image.
//! - The line reveals its anchor, and so the half with its keypoint. It is therefore released as a
//!   ray from the anchor.

use std::sync::Arc;

use super::ray::rays_from;
use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::Error;
use crate::geometry::frame::Bounds;
use crate::released::Obfuscation;
use crate::seed::Key;

/// Dual convergent lines.
#[derive(Clone, Copy, Debug)]
pub struct Dcl2d {
    name: &'static str,
    /// Axis along which the image is halved: 0 for left and right halves.
    across: usize,
    /// Distance of the anchors, as a multiple of the length of the split.
    distance: f64,
}

/// The recommended anchors.
pub const ENTRY: Entry = Entry {
    name: "dcl2d",
    facts: Facts {
        summary: "a line from every keypoint to the anchor of its half of the image",
        source: "Kim et al., Dual Convergent Lines, CVPR 2026",
        hidden: "the range from the anchor (1 of 2 coordinates)",
        patents: "none found",
    },
    in_2d: Some(|_| Arc::new(Dcl2d { name: "dcl2d", across: 0, distance: 1.0 })),
    in_3d: None,
};

/// Upper and lower halves.
pub const HORIZONTAL: Entry = Entry {
    name: "dcl2d-horizontal",
    facts: Facts {
        summary: "as dcl2d, with an upper and a lower half and anchors at the sides",
        ..ENTRY.facts
    },
    in_2d: Some(|_| Arc::new(Dcl2d { name: "dcl2d-horizontal", across: 1, distance: 1.0 })),
    in_3d: None,
};

/// Anchors within the image.
pub const NEAR: Entry = Entry {
    name: "dcl2d-near",
    facts: Facts { summary: "as dcl2d, with anchors at half the distance", ..ENTRY.facts },
    in_2d: Some(|_| Arc::new(Dcl2d { name: "dcl2d-near", across: 0, distance: 0.5 })),
    in_3d: None,
};

/// Anchors outside the image.
pub const FAR: Entry = Entry {
    name: "dcl2d-far",
    facts: Facts { summary: "as dcl2d, with anchors at twice the distance", ..ENTRY.facts },
    in_2d: Some(|_| Arc::new(Dcl2d { name: "dcl2d-far", across: 0, distance: 2.0 })),
    in_3d: None,
};

impl Scheme<2> for Dcl2d {
    fn name(&self) -> &str {
        self.name
    }

    fn lift(
        &self,
        points: &[[f64; 2]],
        bounds: Option<&Bounds<2>>,
        _: &Key,
    ) -> Result<Lifted<2>, Error> {
        let Some(image) = bounds else {
            return Err(Error::new("image size", "known: anchors lie on its border", "none"));
        };
        let (across, along) = (self.across, 1 - self.across);
        let (center, half) = (image.center(), (image.high[along] - image.low[along]) / 2.0);
        let split = center[across];
        let anchor = |side: f64| {
            let mut anchor = center;
            anchor[along] += side * self.distance * half;
            anchor
        };
        let anchors = [anchor(-1.0), anchor(1.0)];
        let chosen = |_, point: &[f64; 2]| usize::from(point[across] >= split);
        let mut lifted = rays_from(&anchors, points, chosen)?;
        if let Obfuscation::Rays(rays) = lifted.obfuscation {
            let (mut first, mut second) = (*image, *image);
            (first.high[across], second.low[across]) = (split, split);
            lifted.obfuscation = Obfuscation::Rays(rays.with_regions(vec![first, second])?);
        }
        Ok(lifted)
    }
}
