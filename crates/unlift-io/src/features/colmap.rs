//! Features of the images of a COLMAP database.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use unlift::Descriptors;
use unlift::descriptors::Values;

use super::image::ImageFeatures;
use crate::database::{Database, Kind, Rows};
use crate::error::Error;

pub(super) struct Colmap {
    // A connection cannot be used by two threads at once.
    database: Mutex<Database>,
    raw: Vec<Vec<u8>>,
    names: Vec<String>,
}

impl Colmap {
    pub fn open(path: &Path) -> Result<Self, Error> {
        let database = Database::open(path)?;
        let raw = database.names();
        let names = raw.iter().map(|name| String::from_utf8_lossy(name).into_owned()).collect();
        Ok(Self { database: Mutex::new(database), raw, names })
    }

    pub fn names(&self) -> &[String] {
        &self.names
    }

    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        let name = &self.raw[at][..];
        let database = self.database.lock().unwrap_or_else(PoisonError::into_inner);
        let size = database.size(name)?;
        let Some(rows) = database.matrix(name, "keypoints")? else {
            return Err(database.error(name, "keypoints", "none"));
        };
        let descriptors = database.matrix(name, "descriptors")?;
        let columns = rows.row_bytes / 4;
        if ![2, 4, 6].contains(&columns) {
            let found = format!("{columns} columns");
            return Err(database.error(name, "keypoints of 2, 4 or 6 columns", found));
        }
        let values = floats(&rows.data);
        if let Some(bad) = values.iter().position(|value| !value.is_finite()) {
            let (row, found) = (bad / columns, values[bad].to_string());
            let expected = format!("a finite number in keypoint {row}");
            return Err(database.error(name, expected, found));
        }
        let mut image = ImageFeatures { name: self.names[at].clone(), size, ..Default::default() };
        // COLMAP places the center of the first pixel at (0.5, 0.5).
        let place = |row: &[f32]| [f64::from(row[0]) - 0.5, f64::from(row[1]) - 0.5];
        image.keypoints = values.chunks(columns).map(place).collect();
        if columns > 2 {
            let (scales, turns) = values.chunks(columns).map(shape).unzip();
            (image.scales, image.orientations_deg) = (Some(scales), Some(turns));
        }
        if let Some(stored) = descriptors {
            if stored.n != rows.n {
                let expected = format!("{} descriptors, one per keypoint", rows.n);
                return Err(database.error(name, expected, stored.n.to_string()));
            }
            let matrix = matrix(stored).map_err(|error| {
                database.error(name, error.expected().to_owned(), error.found().to_owned())
            })?;
            image.descriptors = Some(matrix);
        }
        Ok(image)
    }
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|&four| f32::from_le_bytes(four)).collect()
}

/// Returns scale in pixels and orientation in degrees of a keypoint with 4 columns (stored
/// directly) or 6 (an affine shape, whose columns are the rotated and scaled axes).
fn shape(row: &[f32]) -> (f32, f32) {
    match *row {
        [_, _, scale, turn] => (scale, turn.to_degrees()),
        [_, _, a11, a12, a21, a22] => {
            (0.5 * (a11.hypot(a21) + a12.hypot(a22)), a21.atan2(a11).to_degrees())
        }
        _ => (0.0, 0.0),
    }
}

fn matrix(rows: Rows) -> Result<Descriptors, unlift::Error> {
    match rows.kind {
        Kind::Bytes => Descriptors::try_new(Values::U8(rows.data), rows.row_bytes),
        Kind::Floats => Descriptors::try_new(Values::F32(floats(&rows.data)), rows.row_bytes / 4),
    }
}
