//! Maps as other programs write them: what they say of points and cameras, as COLMAP's would be read.

mod bundler;
mod found;
mod json;
mod nerfstudio;
mod nvm;
mod opensfm;

use std::path::{Path, PathBuf};

pub(super) use found::Found;

use crate::error::Error;

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

/// The map in `path`, if another program writes files of that name; with the format's name.
///
/// # Errors
/// When it cannot be read.
pub(super) fn file(path: &Path) -> Option<Result<(&'static str, Found), Error>> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let named = |format: &&Format| format.files.contains(&&*name);
    let ends = |format: &&Format| {
        format.files.iter().any(|file| file.starts_with('.') && name.ends_with(file))
    };
    let format = FORMATS.iter().find(named).or_else(|| FORMATS.iter().find(ends))?;
    Some((format.read)(path).map(|found| (format.name, found)))
}
