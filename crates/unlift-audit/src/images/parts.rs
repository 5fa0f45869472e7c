//! Finished images of an extraction that may be interrupted, each in its own file.

use std::collections::HashMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use unlift_io::Error;
use unlift_io::atomic::{Access, sweep, write_file};
use unlift_io::features::{FeatureWriter, ImageFeatures, decode, encode};
use unlift_io::hash::{hash_bytes, hash_file};

use super::folder::Folder;

/// Changes when the same photo and options may give different features.
const VERSION: &str = concat!("unlift ", env!("CARGO_PKG_VERSION"), " features 1");
const ENDING: &str = ".part.h5";
const KEY: usize = 32;
const HASH: usize = 64;

/// The folder `FILE.parts` beside an output `FILE`.
///
/// The name of a part contains a key and the SHA-256 of its content. The key is a hash of
/// everything that the content depends on: the program's version, the options, and the photo's name
/// and content. So damaged or outdated parts are never used.
pub struct Parts {
    target: PathBuf,
    folder: PathBuf,
    options: String,
    /// Parts of earlier runs: hashes of their contents by key.
    earlier: HashMap<String, Vec<String>>,
    _locked: Option<File>,
}

/// The key of a photo.
pub struct Key(String);

impl Parts {
    /// Opens the parts of the output `target` with these features, and creates their folder if
    /// needed.
    ///
    /// # Errors
    /// If the folder cannot be created or read, or another run uses it: the first run to finish
    /// would remove the parts of the other.
    pub fn open(target: &Path, features: &Folder) -> Result<Self, Error> {
        let mut folder = target.as_os_str().to_owned();
        folder.push(".parts");
        let folder = PathBuf::from(folder);
        let locked = locked(&folder).map_err(|source| match source.kind() {
            io::ErrorKind::WouldBlock => {
                Error::new(target, "", "no other run with this output", "one in progress")
            }
            _ => Error::write(target, source),
        })?;
        sweep(&folder);
        let mut earlier: HashMap<String, Vec<String>> = HashMap::new();
        for entry in fs::read_dir(&folder).map_err(|source| Error::read(&folder, source))?.flatten()
        {
            if let Some((key, Some(hash))) = of_name(&entry.file_name().to_string_lossy()) {
                earlier.entry(key.to_owned()).or_default().push(hash.to_owned());
            }
        }
        let target = target.to_owned();
        Ok(Self { target, folder, options: features.settings(), earlier, _locked: locked })
    }

    /// Returns the key of the photo `name` at `photo`.
    ///
    /// # Errors
    /// If the photo cannot be read.
    pub fn key(&self, name: &str, photo: &Path) -> Result<Key, Error> {
        // Length and time of a file do not identify its content.
        let content = hash_file(photo)?;
        let key = format!("{VERSION}\n{}\n{content}\n{name}", self.options);
        let hash = hash_bytes(key.as_bytes());
        Ok(Key(hash[..KEY].to_owned()))
    }

    /// Returns the part of an earlier run if its content fits its name. Other parts are not used,
    /// and removed at the end.
    pub fn earlier(&self, key: &Key) -> Option<PathBuf> {
        let hashes = self.earlier.get(&key.0)?;
        let parts = hashes.iter().map(|hash| (self.path(key, hash), hash));
        let mut whole =
            parts.filter(|(path, hash)| hash_file(path).is_ok_and(|found| found == **hash));
        whole.next().map(|(path, _)| path)
    }

    /// Writes a part atomically and returns its path.
    ///
    /// # Errors
    /// If writing fails.
    pub fn write(&self, key: &Key, image: &ImageFeatures) -> Result<PathBuf, Error> {
        let bytes = encode(image, &self.target)?;
        let part = self.path(key, &hash_bytes(&bytes));
        write_file(&part, Access::Usual, |out| out.write_all(&bytes))
            .map_err(|error| error.at(&self.target))?;
        Ok(part)
    }

    fn path(&self, key: &Key, hash: &str) -> PathBuf {
        self.folder.join(format!("{}-{hash}{ENDING}", key.0))
    }

    /// Joins the parts of these images, in this order, to the output, which is written atomically.
    /// Then removes all parts.
    ///
    /// # Errors
    /// If a part or the output fails; then the parts stay.
    pub fn join(
        self,
        images: &[(&str, PathBuf)],
        mut joined: impl FnMut(usize, &ImageFeatures),
    ) -> Result<(), Error> {
        let mut writer = FeatureWriter::create(&self.target)?;
        for (at, (name, part)) in images.iter().enumerate() {
            let image = decode(part, name)?;
            writer.append(&image)?;
            joined(at, &image);
        }
        writer.finish()?;
        self.remove();
        Ok(())
    }

    /// Removes all parts, also of other options and versions, and the folder if it is empty then.
    pub fn remove(self) {
        // The output exists, so remaining parts are harmless.
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        for entry in entries.flatten() {
            if of_name(&entry.file_name().to_string_lossy()).is_some() {
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Creates the folder of parts if needed, and locks it if the system supports locks on folders. The
/// system releases the lock when the process ends.
fn locked(folder: &Path) -> io::Result<Option<File>> {
    loop {
        match fs::create_dir(folder) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists || !folder.is_dir() => {
                return Err(error);
            }
            _ => {}
        }
        let file = match File::open(folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(_) => return Ok(None),
            Ok(file) => file,
        };
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(io::ErrorKind::WouldBlock.into()),
            Err(TryLockError::Error(_)) => return Ok(None),
        }
        // Another run may have finished and removed the folder before it was locked.
        if is_at(&file, folder) {
            return Ok(Some(file));
        }
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |found: fs::Metadata| (found.dev(), found.ino());
    let found = [file.metadata(), fs::metadata(path)].map(|found| found.ok().map(identity));
    found[0] == found[1]
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.is_dir()
}

/// Parses the name of a part: its key and the hash of its content, which parts of the first version
/// lack.
fn of_name(name: &str) -> Option<(&str, Option<&str>)> {
    let is_hash =
        |text: &str, n| text.len() == n && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let name = name.strip_suffix(ENDING)?;
    let (key, hash) = name.split_once('-').map_or((name, None), |(key, hash)| (key, Some(hash)));
    let is_part = is_hash(key, KEY) && hash.is_none_or(|hash| is_hash(hash, HASH));
    is_part.then_some((key, hash))
}
