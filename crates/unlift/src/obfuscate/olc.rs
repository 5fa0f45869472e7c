//! Schemes of lines through single points: `olc`, a uniformly random line through every point of a map; `lines2d`, the same in images;
//! and `lines2d-gravity`.
//!
//! The size of an image is released, so a hidden keypoint lies on a chord. Scale and orientation of keypoints are not released.

use rayon::prelude::*;

use super::scheme::{Entry, Lift, Lifted, LocalPoints, SchemeOptions};
use crate::Error;
use crate::geometry::vector::sub;
use crate::released::{Lines, Obfuscation};
use crate::seed::{Key, Stage};

/// Registry entry.
pub const ENTRY: Entry = Entry {
    title: "Random lines",
    rule: "Each point becomes a line of random direction through it.",
    color: 0,
    source: "Speciale et al., Privacy Preserving Image-Based Localization, CVPR 2019",
    hidden: "the position along the line (1 of 3 coordinates)",
    patents: "EP 3818501 B1 / WO 2020/009829 \"3D line clouds\", Microsoft (US 16/025,120)",
    ..Entry::new("olc", Lift::In3d(lift))
};

/// Registry entry in images.
pub const LINES2D: Entry = Entry {
    title: "Random lines in the image",
    rule: "Each keypoint becomes a line of random direction through it.",
    color: 0,
    source: "Speciale et al., Privacy Preserving Image Queries for Camera Localization, ICCV 2019",
    hidden: "the position along the line (1 of 2 coordinates)",
    patents: "US 10,839,556, Microsoft",
    ..Entry::new("lines2d", Lift::In2d(lift))
};

/// Random lines ("oriented line clouds"); in images, `lines2d`.
fn lift<const D: usize>(
    points: &LocalPoints<'_, D>,
    key: &Key,
    _: &SchemeOptions,
) -> Result<Lifted<D>, Error> {
    let key = key.stage(Stage::Scheme);
    let direction = |row: usize| key.draws(row as u64).direction();
    let rows = (0..points.positions.len()).into_par_iter();
    let directions: Vec<[f64; D]> = rows.map(direction).collect();
    Ok(Lifted::one_each(Obfuscation::Lines(Lines::through(points.positions, &directions)?)))
}

/// Registry entry of the variant.
pub const GRAVITY: Entry = Entry {
    title: "Lines along gravity in the image",
    rule: "Each keypoint becomes the line through it and the image of the gravity direction.",
    color: 7,
    source: "Geppert et al., Privacy Preserving Structure-from-Motion, ECCV 2020",
    hidden: "the position along the line (1 of 2 coordinates)",
    patents: "none found",
    ..Entry::new("lines2d-gravity", Lift::In2d(along_gravity))
};

/// Focal length over the tangent of the assumed tilt, in longer sides of the image.
const BELOW: f64 = 1.2 / 0.267_949;

/// Lines through the image of the gravity direction, as proposed for structure from motion. Images have no gravity here, so the camera
/// is assumed to be upright and tilted down by 15 degrees, with a focal length of 1.2 times the longer side. All lines then meet in one
/// point below the image.
fn along_gravity(
    points: &LocalPoints<'_, 2>,
    _: &Key,
    _: &SchemeOptions,
) -> Result<Lifted<2>, Error> {
    let Some(image) = points.bounds else {
        return Err(Error::new("image size", "known: gravity points below it", "none"));
    };
    let [width, height] = sub(&image.high, &image.low);
    let [x, y] = image.center();
    let below = [x, y + BELOW * width.max(height)];
    let directions: Vec<[f64; 2]> = points.positions.iter().map(|p| sub(&below, p)).collect();
    Ok(Lifted::one_each(Obfuscation::Lines(Lines::through(points.positions, &directions)?)))
}
