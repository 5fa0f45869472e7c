//! Descriptors of points: means over their observations in images.

use std::collections::HashMap;
use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;

use crate::database::{Database, Kind};
use crate::error::Error;
use crate::features::FeatureSource;
use crate::read::colmap::{self, Image};
use crate::read::lines::quoted;
use crate::read::map_input::Input;

/// L2 norm of the descriptors that COLMAP stores as bytes.
const BYTE_NORM: f64 = 512.0;

/// Row-major descriptors and their dimension.
type Stored = (Values, usize);

/// Reads descriptors for every point of `input`, a COLMAP model, from the database at `path`.
///
/// Source: COLMAP's documentation, "Database Format".
pub fn of_database(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let database = Database::open(path)?;
    mean(path, input, |image| {
        let rows = database.descriptors(&image.name)?;
        Ok(match rows.kind {
            Kind::Bytes => (Values::U8(rows.data), rows.row_bytes),
            Kind::Floats => {
                let floats =
                    rows.data.as_chunks::<4>().0.iter().map(|&four| f32::from_le_bytes(four));
                (Values::F32(floats.collect()), rows.row_bytes / 4)
            }
        })
    })
}

/// Reads descriptors for every point of `input`, a COLMAP model, from hloc's features at `path`.
/// Keypoints must have the indices of the model's 2D points.
pub fn of_features(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let features = FeatureSource::open(path)?;
    mean(path, input, |image| {
        let wrong = |expected: String, found: String| {
            Error::new(path, format!("image {}", quoted(&image.name)), expected, found)
        };
        let at = features.names().binary_search_by(|name| name.as_bytes().cmp(&image.name));
        let at = at.map_err(|_| wrong("this image of the model".into(), "no such image".into()))?;
        let found = features.get(at)?;
        if found.keypoints.len() as u64 != image.n_points2d {
            let expected = format!("{} keypoints, as the model has", image.n_points2d);
            return Err(wrong(expected, found.keypoints.len().to_string()));
        }
        let descriptors = found.described(path)?;
        Ok((descriptors.values().clone(), descriptors.dim()))
    })
}

/// Returns the mean over the observations of each point. `stored` reads the descriptors of an
/// image.
fn mean(
    path: &Path,
    input: &Input,
    stored: impl Fn(&Image) -> Result<Stored, Error>,
) -> Result<Descriptors, Error> {
    let of_model = |file: &&std::path::PathBuf| {
        let is = |name: &str| file.file_name().is_some_and(|its| its == name);
        is("points3D.bin") || is("points3D.txt")
    };
    let Some(points_path) = input.files.iter().find(of_model) else {
        let expected = "a COLMAP model, whose tracks lead to images";
        return Err(Error::new(path, "", expected, format!("{} points", input.format)));
    };
    let points = colmap::read_points(points_path, true)?;
    let tracks = points.tracks.expect("asked for");
    let extension = points_path.extension().unwrap_or_default();
    let images = points_path.with_file_name("images").with_extension(extension);
    let images = colmap::read_images(&images)?;
    let row_of_id: HashMap<u64, usize> = points.ids.iter().copied().zip(0..).collect();
    // Sorted by image, so that one image is in memory at a time, and by id, so that sums of floats
    // are deterministic.
    let mut observations = Vec::new();
    for (out, id) in input.ids.iter().enumerate() {
        let place = || format!("point {id}");
        let Some(&row) = row_of_id.get(id) else {
            return Err(Error::new(points_path, place(), "its track", "no such point"));
        };
        let track = tracks.row(row);
        if track.is_empty() {
            return Err(Error::new(path, place(), "an observation in its track", "none"));
        }
        observations.extend(track.iter().map(|&(image, index)| (image, index, out)));
    }
    observations.sort_unstable();

    let mut layout = None;
    let mut sums: Vec<f64> = Vec::new();
    for seen in observations.chunk_by(|a, b| a.0 == b.0) {
        let id = seen[0].0;
        let Ok(image) = images.binary_search_by_key(&id, |image| image.id) else {
            let place = format!("point {}", input.ids[seen[0].2]);
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
        let (usual_kind, usual_dim) = *layout.get_or_insert((kind, dim));
        if (kind, dim) != (usual_kind, usual_dim) {
            let expected = format!("{usual_dim} {usual_kind} each, as in other images");
            return wrong(expected, format!("{dim} {kind}"));
        }
        sums.resize(input.ids.len() * dim, 0.0);
        for &(_, index, out) in seen {
            let index = index as usize;
            if index >= n {
                let expected = format!("a descriptor for keypoint {index}");
                return wrong(expected, format!("{n} descriptors"));
            }
            let row = index * dim..(index + 1) * dim;
            let sums = &mut sums[out * dim..(out + 1) * dim];
            match &values {
                Values::U8(values) => add(sums, &values[row]),
                Values::F32(values) => add(sums, &values[row]),
            }
        }
    }
    let (kind, dim) = layout.unwrap_or(("bytes", 1));
    let values = if kind == "bytes" {
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

fn add<T: Copy + Into<f64>>(sums: &mut [f64], values: &[T]) {
    sums.iter_mut().zip(values).for_each(|(sum, &value)| *sum += value.into());
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
