//! `cp2d`: random pairs of keypoints exchange one coordinate.
//!
//! The rule of `cp` in the plane, where an image is protected by itself: partners are keypoints of the
//! same image.

use super::Entry;
use super::cp::Cp;

/// The registry row.
pub const ENTRY: Entry = Entry {
    name: "cp2d",
    summary: "random pairs of keypoints exchange one random coordinate",
    source: "Pan et al., Privacy Preserving Localization via Coordinate Permutations, ICCV 2023",
    hidden: "which coordinate was exchanged, and its value",
    patents: "none found",
    in_2d: Some(&Cp),
    in_3d: None,
};
