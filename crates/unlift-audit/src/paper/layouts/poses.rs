use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use unlift_io::Error;

use super::text::{lines, wrong};

/// Poses of photos.
#[derive(Clone, Debug, PartialEq)]
pub enum Poses {
    /// The folder with a file beside each photo: `frame-000000.pose.txt` of
    /// `frame-000000.color.png`, four rows of the matrix from the camera to the world, in meters.
    Beside(PathBuf),
    /// Camera centers by the photo's name.
    Listed(BTreeMap<String, [f64; 3]>),
}

impl Poses {
    /// Returns the camera center of `photo`, if it is known; the datasets lack some poses.
    ///
    /// # Errors
    /// If its file is malformed.
    pub fn center(&self, photo: &str) -> Result<Option<[f64; 3]>, Error> {
        match self {
            Self::Listed(poses) => Ok(poses.get(photo).copied()),
            Self::Beside(folder) => {
                let photo = Path::new(photo);
                let inside = |part| matches!(part, std::path::Component::Normal(_));
                if !photo.components().all(inside) {
                    return Ok(None);
                }
                let name = photo.to_string_lossy();
                let Some((frame, _)) = name.rsplit_once(".color.") else { return Ok(None) };
                let path = folder.join(format!("{frame}.pose.txt"));
                if path.is_file() { of_file(&path) } else { Ok(None) }
            }
        }
    }
}

/// Parses a number. Lost poses of 12-Scenes are rows of `-1.#INF`, as C prints them.
fn number_of(word: &str) -> Option<f64> {
    let is_lost = word.contains("#INF") || word.contains("#IND") || word.contains("#QNAN");
    if is_lost { Some(f64::NAN) } else { word.parse().ok() }
}

fn of_file(path: &Path) -> Result<Option<[f64; 3]>, Error> {
    let lines = lines(path)?;
    let mut center = [0.0; 3];
    for (row, value) in center.iter_mut().enumerate() {
        let (at, line) = lines.get(row).map_or((row as u64 + 1, ""), |(n, line)| (*n, line));
        let numbers: Option<Vec<f64>> = line.split_whitespace().map(number_of).collect();
        *value = match numbers.as_deref() {
            Some([_, _, _, last]) => *last,
            _ => return Err(wrong(path, at, "4 numbers of a row of a pose", line)),
        };
    }
    Ok(center.iter().all(|x| x.is_finite()).then_some(center))
}
