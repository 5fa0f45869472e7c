//! Tracks of keypoints that show the same place in several photos, and triangulation.

use unlift::descriptors::Values;
use unlift::synthetic::Sheet;
use unlift::{Descriptors, Error};
use unlift_vision::features::Features;

use crate::pinhole::Pinhole;
use crate::raster::{Facing, NONE, Seen};
use unlift::synthetic::vectors::{add, dot, norm, scale, sub, unit};

const COLUMNS: usize = 128;
const LENGTH: f64 = 512.0;
/// Maximum distance in pixels between a keypoint and the projected place.
const NEAR_PX: f64 = 2.5;
/// Maximum distance between the surface points of two keypoints, as a fraction of the camera
/// distance.
const NEAR: f64 = 0.01;
/// Maximum squared distance of descriptors of the same place; unrelated ones have about 2 x 512^2.
const ALIKE: u32 = 110_000;
/// Cosine of the minimum triangulation angle: 1.5 degrees, as in COLMAP.
const WIDEST_COSINE: f64 = 0.999_657;
/// Maximum reprojection error in pixels, as in COLMAP.
const MOST_PX: f64 = 4.0;
/// Side of a grid cell for keypoints, in pixels.
const CELL: f64 = 8.0;

pub(crate) struct Sighted {
    features: Features,
    /// Surface point of each keypoint, or NaN.
    hits: Vec<[f64; 3]>,
    /// Keypoints of each grid cell of the photo.
    cells: Vec<Vec<u32>>,
    columns: usize,
}

impl Sighted {
    /// Finds the surface points of the keypoints of a photo that `camera` took.
    pub(crate) fn new(camera: &Pinhole, sheets: &[Sheet], seen: &Seen, features: Features) -> Self {
        let hit = |place: [f64; 2]| {
            let (sheet, _) = seen.at(place);
            if sheet == NONE {
                return [f64::NAN; 3];
            }
            let ray = camera.ray(place);
            let (far, _) = Facing::new(camera, &sheets[sheet as usize]).hit(ray);
            add(camera.center, camera.in_world(scale(ray, far)))
        };
        let places = features.keypoints.iter().map(|point| [point.x, point.y].map(f64::from));
        let hits = places.clone().map(hit).collect();
        let [columns, rows] = camera.size.map(|side| (side as f64 / CELL) as usize + 1);
        let mut cells = vec![Vec::new(); columns * rows];
        for (at, place) in places.enumerate() {
            cells[cell(place, columns)].push(at as u32);
        }
        Self { features, hits, cells, columns }
    }

    fn place(&self, at: u32) -> [f64; 2] {
        let keypoint = &self.features.keypoints[at as usize];
        [keypoint.x, keypoint.y].map(f64::from)
    }

    fn around(&self, place: [f64; 2]) -> impl Iterator<Item = u32> {
        let (columns, rows) = (self.columns, self.cells.len() / self.columns);
        let [x, y] = place.map(|x| (x / CELL) as usize);
        let of = |x: usize, most: usize| x.saturating_sub(1)..(x + 2).min(most);
        of(y, rows)
            .flat_map(move |y| of(x, columns).map(move |x| y * columns + x))
            .flat_map(|cell| self.cells[cell].iter().copied())
    }
}

fn cell(place: [f64; 2], columns: usize) -> usize {
    (place[1] / CELL) as usize * columns + (place[0] / CELL) as usize
}

/// A keypoint: photo and index.
type Keypoint = (u32, u32);

/// Triangulates points that several photos show, with their descriptors.
pub(crate) fn triangulated(
    cameras: &[Pinhole],
    photos: &[Sighted],
) -> Result<(Vec<[f64; 3]>, Descriptors), Error> {
    let (mut points, mut bytes) = (Vec::new(), Vec::new());
    for track in tracks(cameras, photos) {
        if let Some(point) = seen_from(cameras, photos, &track) {
            points.push(point);
            bytes.extend(mean(photos, &track));
        }
    }
    Ok((points, Descriptors::try_new(Values::U8(bytes), COLUMNS)?))
}

/// Joins matching keypoints to tracks, at most one per photo, best matches first.
fn tracks(cameras: &[Pinhole], photos: &[Sighted]) -> Vec<Vec<Keypoint>> {
    let mut matches = Vec::new();
    for (a, photo) in photos.iter().enumerate() {
        for (at, &hit) in photo.hits.iter().enumerate() {
            for b in a + 1..photos.len() {
                let Some((place, depth)) = cameras[b].project(hit) else { continue };
                matches.extend(
                    best(&photos[b], place, hit, depth, &photo.features.descriptors[at])
                        .map(|(apart, other)| (apart, (a as u32, at as u32), (b as u32, other))),
                );
            }
        }
    }
    matches.sort_unstable();
    let mut firsts = Vec::with_capacity(photos.len());
    let mut n = 0;
    for photo in photos {
        firsts.push(n);
        n += photo.hits.len();
    }
    let index = |(photo, at): Keypoint| firsts[photo as usize] + at as usize;
    let mut track_of: Vec<Option<usize>> = vec![None; n];
    let mut tracks: Vec<Vec<Keypoint>> = Vec::new();
    for (_, a, b) in matches {
        match (track_of[index(a)], track_of[index(b)]) {
            (None, None) => {
                (track_of[index(a)], track_of[index(b)]) = (Some(tracks.len()), Some(tracks.len()));
                tracks.push(vec![a, b]);
            }
            (Some(track), None) | (None, Some(track)) => {
                let new = if track_of[index(a)].is_none() { a } else { b };
                if tracks[track].iter().all(|one| one.0 != new.0) {
                    track_of[index(new)] = Some(track);
                    tracks[track].push(new);
                }
            }
            (Some(one), Some(other)) => {
                let apart = |a: &Keypoint| tracks[other].iter().all(|b| a.0 != b.0);
                if one != other && tracks[one].iter().all(apart) {
                    let moved = std::mem::take(&mut tracks[other]);
                    for &keypoint in &moved {
                        track_of[index(keypoint)] = Some(one);
                    }
                    tracks[one].extend(moved);
                }
            }
        }
    }
    for track in &mut tracks {
        track.sort_unstable();
    }
    tracks.retain(|track| !track.is_empty());
    tracks
}

/// Returns the keypoint of `photo` that shows the place `hit`, and the distance of the descriptors.
fn best(
    photo: &Sighted,
    place: [f64; 2],
    hit: [f64; 3],
    depth: f64,
    descriptor: &[u8; COLUMNS],
) -> Option<(u32, u32)> {
    let near = photo.around(place).filter(|&other| {
        let [dx, dy] = [0, 1].map(|c| photo.place(other)[c] - place[c]);
        let apart = norm(sub(photo.hits[other as usize], hit));
        dx * dx + dy * dy <= NEAR_PX * NEAR_PX && apart <= NEAR * depth
    });
    let unlike = |other: u32| {
        let pairs = descriptor.iter().zip(&photo.features.descriptors[other as usize]);
        pairs.map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2)).sum::<u32>()
    };
    near.map(|other| (unlike(other), other)).min().filter(|(unlike, _)| *unlike <= ALIKE)
}

/// Triangulates a track; `None` if its rays do not meet.
fn seen_from(cameras: &[Pinhole], photos: &[Sighted], track: &[Keypoint]) -> Option<[f64; 3]> {
    let rays: Vec<([f64; 3], [f64; 3])> = track
        .iter()
        .map(|&(photo, at)| {
            let camera = &cameras[photo as usize];
            let ray = camera.ray(photos[photo as usize].place(at));
            (camera.center, unit(camera.in_world(ray)))
        })
        .collect();
    let cosine = |a: usize, b: usize| dot(rays[a].1, rays[b].1);
    let pairs = (0..rays.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    if pairs.map(|(a, b)| cosine(a, b)).fold(1.0, f64::min) > WIDEST_COSINE {
        return None;
    }
    // The sum of (I - d d') (x - c), weighted by one over the squared distance, is zero.
    let (first, hit) = (track[0], photos[track[0].0 as usize].hits[track[0].1 as usize]);
    debug_assert!(hit.iter().all(|x| x.is_finite()), "{first:?} has a match");
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for &(center, along) in &rays {
        let apart = sub(hit, center);
        let weight = 1.0 / dot(apart, apart);
        for row in 0..3 {
            for column in 0..3 {
                let one = f64::from(u8::from(row == column)) - along[row] * along[column];
                matrix[row][column] += weight * one;
                right[row] += weight * one * center[column];
            }
        }
    }
    let point = solved(matrix, right)?;
    let fits = track.iter().all(|&(photo, at)| {
        let place = photos[photo as usize].place(at);
        cameras[photo as usize].project(point).is_some_and(|(projected, _)| {
            let [dx, dy] = [0, 1].map(|c| projected[c] - place[c]);
            dx * dx + dy * dy <= MOST_PX * MOST_PX
        })
    });
    fits.then_some(point)
}

/// Solves a linear system by Cramer's rule.
fn solved(rows: [[f64; 3]; 3], right: [f64; 3]) -> Option<[f64; 3]> {
    let det =
        |rows: [[f64; 3]; 3]| dot(rows[0], unlift::synthetic::vectors::cross(rows[1], rows[2]));
    let whole = det(rows);
    (whole > 0.0).then(|| {
        std::array::from_fn(|c| {
            let mut changed = rows;
            (0..3).for_each(|row| changed[row][c] = right[row]);
            det(changed) / whole
        })
    })
}

/// Returns the mean of a track's descriptors, scaled to their norm.
fn mean(photos: &[Sighted], track: &[Keypoint]) -> [u8; COLUMNS] {
    let mut sums = [0.0; COLUMNS];
    for &(photo, at) in track {
        let descriptor = &photos[photo as usize].features.descriptors[at as usize];
        sums.iter_mut().zip(descriptor).for_each(|(sum, &value)| *sum += f64::from(value));
    }
    let length = sums.iter().map(|x| x * x).sum::<f64>().sqrt();
    sums.map(|x| (x * LENGTH / length).round().min(255.0) as u8)
}
