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
//! - The line reveals its anchor, and so the half with its keypoint. It is therefore released as a
//!   ray from the anchor.

use super::ray::rays_from;
use super::scheme::{Entry, Facts, Lift, Lifted, LocalPoints, SchemeOptions};
use crate::Error;
use crate::released::Obfuscation;
use crate::seed::Key;

/// Registry entry.
pub const ENTRY: Entry = Entry::new(
    "dcl2d",
    Facts {
        title: "Dual convergent lines",
        rule: "Each keypoint becomes a ray from the anchor of its half of the image.",
        color: 3,
        source: "Kim et al., Dual Convergent Lines, CVPR 2026",
        hidden: "the range from the anchor (1 of 2 coordinates)",
        patents: "none found",
    },
    Lift::In2d(lift),
);

/// Dual convergent lines.
fn lift(points: &LocalPoints<'_, 2>, _: &Key, _: &SchemeOptions) -> Result<Lifted<2>, Error> {
    let Some(image) = points.bounds else {
        return Err(Error::new("image size", "known: anchors lie on its border", "none"));
    };
    let center = image.center();
    let half = (image.high[1] - image.low[1]) / 2.0;
    let anchors = [-1.0, 1.0].map(|side| [center[0], center[1] + side * half]);
    let chosen = |_, point: &[f64; 2]| usize::from(point[0] >= center[0]);
    let mut lifted = rays_from(&anchors, points.positions, chosen)?;
    if let Obfuscation::Rays(rays) = lifted.obfuscation {
        let (mut first, mut second) = (image, image);
        (first.high[0], second.low[0]) = (center[0], center[0]);
        lifted.obfuscation = Obfuscation::Rays(rays.with_regions(vec![first, second])?);
    }
    Ok(lifted)
}
