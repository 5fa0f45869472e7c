//! Reads descriptors of the points of a map: a file with a row per point, or means over the observations of points in images.

use std::collections::HashMap;
use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::neighbors::are_bits;

use super::bytes::{Bytes, Scalar};
use super::colmap::{self, Image};
use super::lines::quoted;
use super::map_input::Input;
use super::npy::{self, Numbers};
use crate::error::Error;
use crate::features::database::Database;
use crate::features::{FeatureSource, HDF5, SQLITE};
use crate::input;

pub(super) const MAGIC: &[u8; 8] = b"P3DESC01";

/// Reads the descriptors of the points of `input`, one row each in the same order.
///
/// `path` is one of
///
/// - a file of the format `P3DESC01` (joined by point id), with bytes or floats;
/// - an `.npy` array `(n, dim)` with a row per point: by ascending point id for a COLMAP model,
///   else in the order of the file;
/// - a COLMAP `database.db`, or hloc's `features.h5`: a row is the mean of the descriptors in the
///   point's track, with images joined by name. Bytes are scaled to L2 norm 512, rounded and
///   clipped to 0..=255; floats are scaled to norm 1. Of bit strings, a bit is that of most observations.
///
/// # Errors
/// When the file cannot be read, is malformed or of another format, lacks a point or an observation
/// (the error names the first), or contains placeholders (all zero, or every row the same).
pub fn descriptors(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let (head, len) = input::head(path, 8)?;
    match head.first_chunk() {
        Some(MAGIC) => binary(path, input),
        Some(SQLITE) => {
            let database = Database::open(path)?;
            mean(path, input, &tracks(path, input)?, |image| database.descriptors(&image.name))
        }
        Some(HDF5) => of_features(path, input),
        Some(magic) if magic.starts_with(npy::MAGIC) => {
            // Rows either exclude or include points without finite coordinates.
            let (values, dim) = npy::descriptors(path, [input.ids.len(), input.n_rows()])?;
            let all = Descriptors::try_new(values, dim).map_err(|e| Error::core(path, e))?;
            if all.len() == input.ids.len() {
                return Ok(all);
            }
            let is_kept = |row: &u32| input.left_out.binary_search(&u64::from(*row)).is_err();
            Ok(all.select(&(0..all.len() as u32).filter(is_kept).collect::<Vec<_>>()))
        }
        _ => {
            let expected = "a file that begins with P3DESC01, a NumPy array (.npy), a COLMAP database (SQLite) or hloc's features (HDF5)";
            let found = match len {
                0 => "an empty file".to_owned(),
                _ => quoted(&head),
            };
            Err(Error::new(path, "", expected, found))
        }
    }
}

fn binary(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let mut bytes = Bytes::open(path)?;
    bytes.skip(8, "magic")?;
    let n = bytes.count("descriptors", 8)?;
    let dim = bytes.u32("dimension")?;
    let scalar = match bytes.u32("type")? {
        1 => Scalar::U8,
        2 => Scalar::F16,
        3 => Scalar::F32,
        other => {
            return Err(bytes.error("type 1 (u8), 2 (float16) or 3 (float32)", other));
        }
    };
    let row_bytes = u64::from(dim) * scalar.size as u64;
    if dim == 0 || n.checked_mul(8 + row_bytes) != Some(bytes.remaining()) {
        let expected = format!("{n} ids and rows of {row_bytes} bytes");
        return Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())));
    }
    let mut row_of_id = HashMap::with_capacity(n as usize);
    for row in 0..n as u32 {
        let id = bytes.u64("point id")?;
        if row_of_id.insert(id, row).is_some() {
            return Err(bytes.error("each id once", format!("id {id} again")));
        }
    }
    let numbers = Numbers { scalar, shape: vec![n, dim.into()], big: false, fortran: false };
    let all = Descriptors::try_new(numbers.descriptors(&mut bytes)?, dim as usize);
    let all = all.map_err(|error| Error::core(path, error))?;
    let row = |id: &u64| {
        let missing = || {
            let found = format!("none among {n}");
            Error::new(path, format!("point {id}"), "a descriptor", found)
        };
        row_of_id.get(id).copied().ok_or_else(missing)
    };
    Ok(all.select(&input.ids.iter().map(row).collect::<Result<Vec<_>, _>>()?))
}

/// L2 norm of the descriptors that COLMAP stores as bytes.
const BYTE_NORM: f64 = 512.0;

/// Reads descriptors for every point of `input`, a COLMAP model, from hloc's features at `path`.
/// Keypoints must have the indices of the model's 2D points.
fn of_features(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let features = FeatureSource::open(path)?;
    mean(path, input, &tracks(path, input)?, |image| {
        let place = format!("image {}", quoted(&image.name));
        let at = features.names().binary_search_by(|name| name.as_bytes().cmp(&image.name));
        let Ok(at) = at else {
            let found = format!("no such image among {}", features.names().len());
            return Err(Error::new(path, place, "this image of the model", found));
        };
        let found = features.get(at)?;
        if found.keypoints.len() as u64 != image.n_points2d {
            let expected = format!("{} keypoints, as the model has", image.n_points2d);
            return Err(Error::new(path, place, expected, found.keypoints.len()));
        }
        let descriptors = found.described(path)?;
        Ok((descriptors.values().clone(), descriptors.dim()))
    })
}

/// An image id, the index of a 2D point in it, and the row of the point in the input.
type Observation = (u32, u32, usize);

/// Returns the images of the model of `input` and the observations of its points by image.
fn tracks(path: &Path, input: &Input) -> Result<(Vec<Image>, Vec<Observation>), Error> {
    let of_model = |file: &&std::path::PathBuf| {
        file.file_name().is_some_and(|name| name == "points3D.bin" || name == "points3D.txt")
    };
    let Some(points_path) = input.files.iter().find(of_model) else {
        let expected = "a COLMAP model, whose tracks lead to images";
        return Err(Error::new(path, "", expected, format!("{} points", input.format)));
    };
    let points = colmap::read_points(points_path, true)?;
    let tracks = points.tracks.expect("requested");
    let extension = points_path.extension().unwrap_or_default();
    let images = points_path.with_file_name("images").with_extension(extension);
    let images = colmap::read_images(&images)?;
    // Sorted by image, so that one image is in memory at a time, and by id, so that sums of floats are deterministic.
    let mut observations = Vec::new();
    for (out, id) in input.ids.iter().enumerate() {
        let place = || format!("point {id}");
        let Ok(row) = points.ids.binary_search(id) else {
            return Err(Error::new(points_path, place(), "its track", "no such point"));
        };
        let track = tracks.row(row);
        if track.is_empty() {
            return Err(Error::new(path, place(), "an observation in its track", "none"));
        }
        observations.extend(track.iter().map(|&(image, index)| (image, index, out)));
    }
    observations.sort_unstable();
    Ok((images, observations))
}

/// Returns the mean over the observations of each point. `stored` reads the descriptors of an image,
/// row by row, and their dimension.
///
/// # Errors
/// Also when descriptors of one point are no more alike than those of others.
fn mean(
    path: &Path,
    input: &Input,
    (images, observations): &(Vec<Image>, Vec<Observation>),
    stored: impl Fn(&Image) -> Result<(Values, usize), Error>,
) -> Result<Descriptors, Error> {
    let (mut layout, mut alike, mut has_bits) = (None, Alike::default(), false);
    let bits = |&byte: &u8| (0..8).map(move |bit| f64::from(byte >> bit & 1) * 2.0 - 1.0);
    for of_image in observations.chunk_by(|a, b| a.0 == b.0) {
        let (id, _, point) = of_image[0];
        let Ok(image) = images.binary_search_by_key(&id, |image| image.id) else {
            let place = format!("point {}", input.ids[point]);
            let expected = "images of the model in its track";
            return Err(Error::new(path, place, expected, format!("image {id}")));
        };
        let image = &images[image];
        let wrong = |expected: String, found: String| {
            Err(Error::new(path, format!("image {}", quoted(&image.name)), expected, found))
        };
        let (values, dim) = stored(image)?;
        let (kind, n) = match &values {
            Values::U8(values) => ("bytes", values.len() / dim),
            Values::F32(values) => ("floats", values.len() / dim),
        };
        let (usual_kind, usual_dim) = *layout.get_or_insert_with(|| {
            has_bits = matches!(&values, Values::U8(bytes) if are_bits(bytes, dim));
            alike = Alike::new(input.ids.len(), if has_bits { 8 * dim } else { dim });
            (kind, dim)
        });
        if (kind, dim) != (usual_kind, usual_dim) {
            let expected = format!("{usual_dim} {usual_kind} each, as in other images");
            return wrong(expected, format!("{dim} {kind}"));
        }
        let mut rows: Vec<f64> = Vec::with_capacity(of_image.len() * dim);
        for &(_, index, _) in of_image {
            let index = index as usize;
            if index >= n {
                let expected = format!("a descriptor for keypoint {index}");
                return wrong(expected, format!("{n} descriptors"));
            }
            let row = index * dim..(index + 1) * dim;
            match &values {
                Values::U8(values) if has_bits => rows.extend(values[row].iter().flat_map(bits)),
                Values::U8(values) => rows.extend(values[row].iter().map(|&x| f64::from(x))),
                Values::F32(values) => rows.extend(values[row].iter().map(|&x| f64::from(x))),
            }
        }
        let points: Vec<usize> = of_image.iter().map(|&(.., out)| out).collect();
        if let Err((expected, found)) = alike.add(&points, &rows) {
            return wrong(expected, found);
        }
    }
    alike.check().map_err(|(expected, found)| Error::new(path, "", expected, found))?;
    let mut sums = alike.sums;
    let (kind, dim) = layout.unwrap_or(("bytes", 1));
    let values = if has_bits {
        let byte =
            |bits: &[f64]| bits.iter().rev().fold(0, |byte, &x| byte << 1 | u8::from(x > 0.0));
        Values::U8(sums.chunks_exact(8).map(byte).collect())
    } else if kind == "bytes" {
        normalize(&mut sums, dim, BYTE_NORM);
        // Ties to even, like NumPy.
        let byte = |x: &f64| x.round_ties_even().clamp(0.0, 255.0) as u8;
        Values::U8(sums.iter().map(byte).collect())
    } else {
        normalize(&mut sums, dim, 1.0);
        Values::F32(sums.iter().map(|&x| x as f32).collect())
    };
    Descriptors::try_new(values, dim).map_err(|e| Error::core(path, e))
}

/// Counts how often a descriptor is more like its own point in earlier images than like another point.
#[derive(Default)]
pub struct Alike {
    dim: usize,
    /// Sum of the descriptors of each point.
    sums: Vec<f64>,
    n_alike: f64,
    n: usize,
}

/// Least share of descriptors, of all images and of one, that are more like their own point.
/// Features of the model have 0.99 or more, those of another run or order 0.5 to 0.65 (measured on Castle and RedKitchen).
const LEAST_ALIKE: f64 = 0.8;
const LEAST_ALIKE_IN_IMAGE: f64 = 0.7;
/// Fewer comparisons say nothing.
const FEWEST: usize = 30;

impl Alike {
    /// Creates the count of `n` points with descriptors of `dim` values.
    pub fn new(n: usize, dim: usize) -> Self {
        Self { dim, sums: vec![0.0; n * dim], ..Self::default() }
    }

    fn sum(&self, point: usize) -> &[f64] {
        &self.sums[point * self.dim..][..self.dim]
    }

    /// Adds the descriptors `rows` of an image, which show `points`.
    ///
    /// # Errors
    /// When too few are told apart from those of other points of the image: what was expected and found.
    pub fn add(&mut self, points: &[usize], rows: &[f64]) -> Result<(), (String, String)> {
        let known = |at: &usize| self.sum(points[*at]).iter().any(|&x| x != 0.0);
        let known: Vec<usize> = (0..points.len()).filter(known).collect();
        let like = |at: usize, point: usize| {
            let sum = self.sum(point);
            let dot: f64 = sum.iter().zip(&rows[at * self.dim..]).map(|(a, b)| a * b).sum();
            dot / sum.iter().map(|x| x * x).sum::<f64>().sqrt()
        };
        let (mut n_alike, mut n) = (0.0, 0);
        for (rank, &at) in known.iter().enumerate() {
            let other = points[known[(rank + known.len() / 2) % known.len()]];
            if other != points[at] {
                let (of_own, of_other) = (like(at, points[at]), like(at, other));
                n_alike += if of_own == of_other { 0.5 } else { f64::from(of_own > of_other) };
                n += 1;
            }
        }
        check(n_alike, n, LEAST_ALIKE_IN_IMAGE)?;
        (self.n_alike, self.n) = (self.n_alike + n_alike, self.n + n);
        for (&point, row) in points.iter().zip(rows.chunks(self.dim)) {
            let sum = &mut self.sums[point * self.dim..][..self.dim];
            sum.iter_mut().zip(row).for_each(|(sum, x)| *sum += x);
        }
        Ok(())
    }

    /// Checks the share of all images.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn check(&self) -> Result<(), (String, String)> {
        check(self.n_alike, self.n, LEAST_ALIKE)
    }
}

/// Returns an error if the share is smaller than `least`, beyond chance.
fn check(n_alike: f64, n: usize, least: f64) -> Result<(), (String, String)> {
    let root = (n.max(1) as f64).sqrt();
    if n < FEWEST || n_alike / n as f64 + 1.5 / root >= least {
        return Ok(());
    }
    let expected = "descriptors of the model's keypoints, more like their own point in other images than like another one";
    Err((expected.to_owned(), format!("{n_alike} of {n} that are")))
}

/// Scales every row to an L2 norm, so that a sum equals a mean.
fn normalize(rows: &mut [f64], dim: usize, norm: f64) {
    for row in rows.chunks_mut(dim) {
        let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 {
            row.iter_mut().for_each(|x| *x *= norm / length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No image, every image or every other one has its rows shifted by one.
    #[test]
    fn descriptors_of_real_maps_look_alike_within_tracks_unless_they_are_shifted() {
        let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
        for name in [
            "castle/features-sift.h5",
            "redkitchen/features-sift.h5",
            "redkitchen-aliked/features-aliked.h5",
        ] {
            let path = shared.join(name);
            let Ok(source) = FeatureSource::open(&path) else {
                println!("skipped: shared/data/{name} is not beside the repository");
                continue;
            };
            let input = crate::read::open(path.parent().unwrap()).unwrap();
            let at = |image: &Image| {
                source.names().iter().position(|name| name.as_bytes() == image.name)
            };
            let (images, mut observations) = tracks(&path, &input).unwrap();
            let is_there = |id| images.iter().any(|image| image.id == id && at(image).is_some());
            observations.retain(|&(id, ..)| is_there(id));
            let model = (images, observations);
            for every in [usize::MAX, 1, 2] {
                let result = mean(&path, &input, &model, |image| {
                    let at = at(image).unwrap();
                    let stored = source.get(at)?.descriptors.unwrap();
                    let mut rows: Vec<u32> = (0..stored.len() as u32).collect();
                    rows.rotate_left(usize::from((at + 1).is_multiple_of(every)));
                    let changed = stored.select(&rows);
                    Ok((changed.values().clone(), changed.dim()))
                });
                let error = result.err().map_or(String::new(), |error| error.to_string());
                let is_refused = error.contains("more like their own point in other images");
                assert_eq!(is_refused, every <= 2, "{name}, every {every}: {error}");
            }
        }
    }
}
