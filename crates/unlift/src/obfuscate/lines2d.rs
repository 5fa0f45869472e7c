//! `lines2d`: a random line through every keypoint of an image.
//!
//! The rule of `olc` in the plane: the angle is uniform. Scale and orientation of keypoints are not
//! released. The size of the image is, so that the hidden point lies on a chord.

use super::Entry;
use super::olc::Olc;

/// The registry row.
pub const ENTRY: Entry = Entry {
    name: "lines2d",
    summary: "a random line through every keypoint",
    source: "Speciale et al., Privacy Preserving Image Queries for Camera Localization, ICCV 2019",
    hidden: "the position along the line (1 of 2 coordinates)",
    patents: "US 10,839,556, Microsoft",
    in_2d: Some(&Olc),
    in_3d: None,
};
