//! Maps as other programs write them: what they say of points and cameras, as COLMAP's would be read.

mod bundler;
mod json;
mod nerfstudio;
mod nvm;
mod opensfm;

use std::path::{Path, PathBuf};

use super::{Input, mean_direction};
use crate::error::Error;

/// Points and cameras of a file.
#[derive(Debug, Default)]
struct Found {
    positions: Vec<[f64; 3]>,
    cameras: Vec<[f64; 3]>,
    /// What is up in each photo, in the world.
    up: Vec<[f64; 3]>,
    notes: Vec<String>,
    /// Read beside the file itself.
    more: Vec<PathBuf>,
}

/// A format of another program.
struct Format {
    /// For people.
    name: &'static str,
    /// How its files are called: the name itself, or `.` and an extension.
    files: &'static [&'static str],
    read: fn(&Path) -> Result<Found, Error>,
}

/// By the name first, then by the extension.
const FORMATS: [Format; 4] = [
    Format { name: "nerfstudio", files: &["transforms.json"], read: nerfstudio::read },
    Format { name: "OpenSfM", files: &["reconstruction.json", ".json"], read: opensfm::read },
    Format { name: "Bundler", files: &[".out"], read: bundler::read },
    Format { name: "NVM", files: &[".nvm"], read: nvm::read },
];

/// Files that are looked for in a folder without a COLMAP model, in this order.
const IN_FOLDERS: [&str; 5] = [
    "reconstruction.json",
    "opensfm/reconstruction.json",
    "transforms.json",
    "bundle.out",
    "bundle/bundle.out",
];

/// The file of another program's map in the folder `path`.
pub(super) fn in_folder(path: &Path) -> Option<PathBuf> {
    IN_FOLDERS.map(|name| path.join(name)).into_iter().find(|file| file.is_file())
}

/// The map in `path`, if another program writes files of that name.
///
/// # Errors
/// When it cannot be read.
pub(super) fn file(path: &Path) -> Option<Result<Input, Error>> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let named = |format: &&Format| format.files.contains(&&*name);
    let ends = |format: &&Format| {
        format.files.iter().any(|file| file.starts_with('.') && name.ends_with(file))
    };
    let format = FORMATS.iter().find(named).or_else(|| FORMATS.iter().find(ends))?;
    Some((format.read)(path).map(|found| input(path, format.name, found)))
}

fn input(path: &Path, format: &'static str, found: Found) -> Input {
    Input {
        ids: (0..found.positions.len() as u64).collect(),
        positions: found.positions,
        cameras: found.cameras,
        up: mean_direction(found.up.into_iter()),
        files: std::iter::once(path.to_owned()).chain(found.more).collect(),
        format,
        skipped: found.notes,
        ..Input::default()
    }
}

/// The center `-R^T t` of a camera whose pose is `x_cam = R x + t`, and the direction that `up_cam` of its own frame has in the
/// world; `None` when a number is not finite.
fn camera(
    rotation: &[[f64; 3]; 3],
    translation: &[f64; 3],
    up_cam: [f64; 3],
) -> Option<([f64; 3], [f64; 3])> {
    let transposed = |v: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| (0..3).map(|row| rotation[row][c] * v[row]).sum())
    };
    let (center, up) = (transposed(translation).map(|x| -x), transposed(&up_cam));
    (center.iter().chain(&up).all(|x| x.is_finite())).then_some((center, up))
}

/// What is up in a photo whose y grows downward.
const DOWNWARD: [f64; 3] = [0.0, -1.0, 0.0];
/// The same where y grows upward.
const UPWARD: [f64; 3] = [0.0, 1.0, 0.0];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_center_is_where_the_pose_maps_to_zero() {
        let quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let (center, up) = camera(&quarter, &[1.0, 2.0, 3.0], DOWNWARD).unwrap();
        assert_eq!((center, up), ([-2.0, 1.0, -3.0], [-1.0, 0.0, 0.0]));
        assert!(camera(&quarter, &[f64::NAN, 0.0, 0.0], UPWARD).is_none());
    }
}
