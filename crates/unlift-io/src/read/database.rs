//! Descriptors of points as the mean over their observations, from COLMAP's `database.db`.

use std::collections::HashMap;
use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;

use crate::database::{Database, Kind};
use crate::error::Error;
use crate::read::Input;
use crate::read::colmap::{self, Tracks};

/// L2 norm of the descriptors COLMAP stores as bytes.
const BYTE_NORM: f64 = 512.0;

/// Descriptors for every point of `input`, which must be a COLMAP model.
///
/// Source: COLMAP's documentation, "Database Format".
pub fn descriptors(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let Some(points_path) = input.files.iter().find(|file| is_points(file)) else {
        let expected = "a COLMAP model, whose tracks lead to a database";
        return Err(Error::new(path, "", expected, format!("{} points", input.format)));
    };
    let points = colmap::read_points(points_path, true)?;
    let tracks = points.tracks.expect("asked for");
    let images = images_of(points_path)?;
    let row_of_id: HashMap<u64, usize> = points.ids.iter().copied().zip(0..).collect();
    let rows = input
        .ids
        .iter()
        .map(|id| {
            row_of_id.get(id).copied().ok_or_else(|| {
                Error::new(points_path, format!("point {id}"), "its track", "no such point")
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    mean_over_tracks(&Database::open(path)?, &tracks, &images, &rows, &input.ids)
}

fn is_points(file: &Path) -> bool {
    file.file_stem().is_some_and(|stem| stem == "points3D")
}

/// Names of the model's images by their id in the model, read beside the points.
fn images_of(points_path: &Path) -> Result<HashMap<u32, Vec<u8>>, Error> {
    let extension = points_path.extension().unwrap_or_default();
    let path = points_path.with_file_name("images").with_extension(extension);
    let images = colmap::read_images(&path)?;
    Ok(images.into_iter().map(|i| (i.id, i.name)).collect())
}

/// The mean over the observations of each of `rows` (of `tracks`), which have these `ids`.
fn mean_over_tracks(
    database: &Database,
    tracks: &Tracks,
    names: &HashMap<u32, Vec<u8>>,
    rows: &[usize],
    ids: &[u64],
) -> Result<Descriptors, Error> {
    // By image, so that one image's descriptors are in memory at a time; by id, so that sums of floats
    // do not depend on a hash.
    let mut observations = Vec::new();
    for (out, &row) in rows.iter().enumerate() {
        if tracks.row(row).is_empty() {
            let place = format!("point {}", ids[out]);
            let expected = "an observation in its track";
            return Err(Error::new(database.path(), place, expected, "none"));
        }
        let track = tracks.row(row).iter();
        observations.extend(track.map(|&(image, index)| (image, index, out)));
    }
    observations.sort_unstable();

    let mut layout = None;
    let mut sums: Vec<f64> = Vec::new();
    for seen in observations.chunk_by(|a, b| a.0 == b.0) {
        let image = seen[0].0;
        let Some(name) = names.get(&image) else {
            let place = format!("point {}", ids[seen[0].2]);
            let expected = "images of the model in its track";
            return Err(Error::new(database.path(), place, expected, format!("image {image}")));
        };
        let stored = database.descriptors(name)?;
        let this = (stored.kind, stored.row_bytes);
        let (kind, row_bytes) = *layout.get_or_insert(this);
        let dim = match kind {
            Kind::Bytes => row_bytes,
            Kind::Floats => row_bytes / 4,
        };
        if this != (kind, row_bytes) {
            let expected = format!("{row_bytes} columns of {kind:?} as in other images");
            let found = format!("{} of {:?}", stored.row_bytes, stored.kind);
            return Err(database.error(name, expected, found));
        }
        sums.resize(rows.len() * dim, 0.0);
        for &(_, index, out) in seen {
            let index = index as usize;
            if index >= stored.n {
                let expected = format!("a descriptor for keypoint {index}");
                return Err(database.error(name, expected, format!("{} descriptors", stored.n)));
            }
            let row = &stored.data[index * row_bytes..(index + 1) * row_bytes];
            let sums = &mut sums[out * dim..(out + 1) * dim];
            match kind {
                Kind::Bytes => {
                    for (sum, &byte) in sums.iter_mut().zip(row) {
                        *sum += f64::from(byte);
                    }
                }
                Kind::Floats => {
                    for (sum, bits) in sums.iter_mut().zip(row.as_chunks::<4>().0) {
                        *sum += f64::from(f32::from_le_bytes(*bits));
                    }
                }
            }
        }
    }
    let (kind, row_bytes) = layout.unwrap_or((Kind::Bytes, 1));
    let (values, dim) = match kind {
        Kind::Bytes => {
            normalize(&mut sums, row_bytes, BYTE_NORM);
            // Ties to even, as NumPy rounds.
            let byte = |x: &f64| x.round_ties_even().clamp(0.0, 255.0) as u8;
            (Values::U8(sums.iter().map(byte).collect()), row_bytes)
        }
        Kind::Floats => {
            normalize(&mut sums, row_bytes / 4, 1.0);
            let floats = sums.iter().map(|&x| x as f32).collect();
            (Values::F32(floats), row_bytes / 4)
        }
    };
    Descriptors::try_new(values, dim).map_err(|e| Error::core(database.path(), e))
}

/// Brings every row to an L2 norm (so that a sum is as good as a mean); rows of zeros stay.
fn normalize(rows: &mut [f64], dim: usize, norm: f64) {
    for row in rows.chunks_mut(dim) {
        let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 {
            row.iter_mut().for_each(|x| *x *= norm / length);
        }
    }
}
