//! Schemes of lines through single points: `olc`, a uniformly random line through every point of a map; and `lines2d`, the same in images.
//!
//! The size of an image is released, so a hidden keypoint lies on a chord. Scale and orientation of keypoints are not released.

use super::scheme::{Entry, Lift, Lifted};
use crate::Error;
use crate::released::{Lines, Obfuscation};
use crate::seed::{Key, Stage};
use unlift_attack::parallel;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    title: "Random lines",
    rule: "Each point becomes a line of random direction through it.",
    color: 0,
    source: "Speciale et al., Privacy Preserving Image-Based Localization, CVPR 2019",
    hidden: "the position along the line (1 of 3 coordinates)",
    patents: "EP 3818501 B1 / WO 2020/009829 \"3D line clouds\", Microsoft (US 16/025,120)",
    ..Entry::new("olc", Lift::In3d(|points, key, _| lift(points.positions, key)))
};

/// Registry entry in images.
pub const LINES2D: Entry = Entry {
    title: "Random lines in the image",
    rule: "Each keypoint becomes a line of random direction through it.",
    color: 0,
    source: "Speciale et al., Privacy Preserving Image Queries for Camera Localization, ICCV 2019",
    hidden: "the position along the line (1 of 2 coordinates)",
    patents: "US 10,839,556, Microsoft",
    ..Entry::new("lines2d", Lift::In2d(|points, key, _| lift(points.positions, key)))
};

/// Random lines ("oriented line clouds"); in images, `lines2d`.
fn lift<const D: usize>(points: &[[f64; D]], key: &Key) -> Result<Lifted<D>, Error> {
    let key = key.stage(Stage::Scheme);
    let direction = |row: usize| key.draws(row as u64).direction();
    let directions: Vec<[f64; D]> = parallel::map(points.len(), direction);
    Ok(Lifted::one_each(Obfuscation::Lines(Lines::through(points, &directions)?)))
}
