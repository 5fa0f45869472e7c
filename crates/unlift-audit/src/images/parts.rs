//! Finished images of a run that may be interrupted, each in a file of its own.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use unlift_io::Error;
use unlift_io::atomic::{Access, sweep, write_file};
use unlift_io::features::{FeatureWriter, ImageFeatures, decode, encode};
use unlift_io::hash::hash_bytes;

use super::folder::Folder;

/// Changes when the same photo and options may give other features.
const VERSION: &str = concat!("unlift ", env!("CARGO_PKG_VERSION"), " features 1");
const ENDING: &str = ".part.h5";
/// Letters of a part's name.
const HASH: usize = 32;
const JOINED: &str = "joined.h5";

/// Writes a part, whole or not at all.
///
/// # Errors
/// When the disk fails.
pub fn write_part(part: &Path, image: &ImageFeatures) -> Result<(), Error> {
    let bytes = encode(image, part)?;
    write_file(part, Access::Usual, |out| out.write_all(&bytes))
}

/// The folder `FILE.parts` beside an output `FILE`.
///
/// A part's name is a hash of all that its content depends on: the program's version, the options, and the
/// photo's name, length and time of change. So a part is either right or not found.
pub struct Parts {
    folder: PathBuf,
    options: String,
}

impl Parts {
    /// The parts of the output `target` with these features; the folder of parts is made if it is not there.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn open(target: &Path, features: &Folder) -> Result<Self, Error> {
        let mut folder = target.as_os_str().to_owned();
        folder.push(".parts");
        let folder = PathBuf::from(folder);
        if !folder.is_dir() {
            fs::create_dir(&folder).map_err(|source| Error::write(&folder, source))?;
        }
        sweep(&folder);
        Ok(Self { folder, options: features.settings() })
    }

    /// Where the part of the photo `name` at `photo` is, or will be.
    ///
    /// # Errors
    /// When the photo is gone.
    pub fn path(&self, name: &str, photo: &Path) -> Result<PathBuf, Error> {
        let metadata = fs::metadata(photo).map_err(|source| Error::read(photo, source))?;
        let changed =
            metadata.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let changed = changed.map_or(0, |since| since.as_nanos());
        let length = metadata.len();
        let key = format!("{VERSION}\n{}\n{length} {changed}\n{name}", self.options);
        let hash = hash_bytes(key.as_bytes());
        Ok(self.folder.join(format!("{}{ENDING}", &hash[..HASH])))
    }

    /// Joins the parts of these images, in this order, to the file `target`, which appears whole; then
    /// removes all parts.
    ///
    /// # Errors
    /// When a part or the target fails; the parts stay then.
    pub fn join(
        self,
        images: &[(&str, PathBuf)],
        target: &Path,
        mut joined: impl FnMut(usize, &ImageFeatures),
    ) -> Result<(), Error> {
        // Among the parts, so that what a killed run leaves is cleared away with them.
        let whole = self.folder.join(JOINED);
        let mut writer = FeatureWriter::create(&whole)?;
        for (at, (name, part)) in images.iter().enumerate() {
            let image = decode(part, name)?;
            writer.append(&image)?;
            joined(at, &image);
        }
        writer.finish()?;
        fs::rename(&whole, target).map_err(|source| Error::write(target, source))?;
        self.remove();
        Ok(())
    }

    /// Removes all parts, those of earlier options too, and the folder if nothing else is in it.
    pub fn remove(self) {
        // What cannot be removed is in nobody's way: the output is there.
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let is_part = name.strip_suffix(ENDING).is_some_and(|hash| {
                hash.len() == HASH && hash.bytes().all(|byte| byte.is_ascii_hexdigit())
            });
            if is_part || name == JOINED {
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(&self.folder);
    }
}
