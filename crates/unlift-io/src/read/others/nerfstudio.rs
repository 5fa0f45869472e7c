//! nerfstudio's `transforms.json`: camera poses, and a point cloud beside it.

use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use super::found::Found;
use super::json;
use crate::error::Error;
use crate::read::ply;

#[derive(Deserialize)]
struct Transforms {
    ply_file_path: Option<PathBuf>,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    /// From the camera, whose y is up, to the world.
    transform_matrix: Vec<[f64; 4]>,
}

/// Reads the cameras, and the points of the cloud that the file names.
///
/// # Errors
/// When it names none, the cloud cannot be read, or a pose is not finite.
pub fn read(path: &Path) -> Result<Found, Error> {
    let transforms: Transforms = json::read(path, std::marker::PhantomData)?;
    let Some(cloud) = transforms.ply_file_path else {
        let expected = "ply_file_path, a point cloud beside the cameras";
        return Err(Error::new(path, "", expected, "none"));
    };
    // Whoever sends a file does not say which files of the reader's are opened.
    if !cloud.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        let found = cloud.display().to_string();
        return Err(Error::new(path, "ply_file_path", "a path within the folder", found));
    }
    let cloud = path.with_file_name("").join(cloud);
    let mut found = Found { positions: ply::read(&cloud)?.0, ..Found::default() };
    for (at, Frame { transform_matrix: rows }) in transforms.frames.iter().enumerate() {
        let column = |c: usize| -> Option<[f64; 3]> {
            let rows = rows.get(..3)?;
            let column = [rows[0][c], rows[1][c], rows[2][c]];
            column.iter().all(|x| x.is_finite()).then_some(column)
        };
        let (Some(up), Some(center)) = (column(1), column(3)) else {
            let found = format!("{} rows", rows.len());
            let expected = "a finite transform_matrix of 4 rows";
            return Err(Error::new(path, format!("frame {at}"), expected, found));
        };
        found.cameras.push(center);
        found.up.push(up);
    }
    found.more.push(cloud);
    Ok(found)
}
