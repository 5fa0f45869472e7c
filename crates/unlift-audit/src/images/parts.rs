//! Finished images of a run that may be interrupted, each in a file of its own.

use std::collections::HashMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use unlift_io::Error;
use unlift_io::atomic::{Access, sweep, write_file};
use unlift_io::features::{FeatureWriter, ImageFeatures, decode, encode};
use unlift_io::hash::{hash_bytes, hash_file};

use super::folder::Folder;

/// Changes when the same photo and options may give other features.
const VERSION: &str = concat!("unlift ", env!("CARGO_PKG_VERSION"), " features 1");
const ENDING: &str = ".part.h5";
/// Letters of a key, and of a hash of content.
const KEY: usize = 32;
const HASH: usize = 64;

/// The folder `FILE.parts` beside an output `FILE`.
///
/// A part's name is a key and the SHA-256 of its content. The key is a hash of all that the content depends on: the
/// program's version, the options, and the photo's name and content. So a part is either right or none.
pub struct Parts {
    target: PathBuf,
    folder: PathBuf,
    options: String,
    /// What earlier runs left, by key: hashes of the content.
    earlier: HashMap<String, Vec<String>>,
    /// Holds the lock on the folder.
    _locked: Option<File>,
}

/// A photo's key.
pub struct Key(String);

impl Parts {
    /// The parts of the output `target` with these features; the folder of parts is made if it is not there.
    ///
    /// # Errors
    /// When it cannot be made or read, or another run is at work in it: the first to be done would remove the parts of
    /// the other.
    pub fn open(target: &Path, features: &Folder) -> Result<Self, Error> {
        let mut folder = target.as_os_str().to_owned();
        folder.push(".parts");
        let folder = PathBuf::from(folder);
        let locked = locked(&folder).map_err(|source| match source.kind() {
            io::ErrorKind::WouldBlock => {
                Error::new(target, "", "one run at a time", "another run at work")
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

    /// The key of the photo `name` at `photo`.
    ///
    /// # Errors
    /// When the photo cannot be read.
    pub fn key(&self, name: &str, photo: &Path) -> Result<Key, Error> {
        // Its length and time would not tell one that was put in its place.
        let content = hash_file(photo)?;
        let key = format!("{VERSION}\n{}\n{content}\n{name}", self.options);
        let hash = hash_bytes(key.as_bytes());
        Ok(Key(hash[..KEY].to_owned()))
    }

    /// The part that an earlier run made, if its content still is what its name says. One that has changed is not
    /// taken up, and goes away with the others.
    pub fn earlier(&self, key: &Key) -> Option<PathBuf> {
        let hashes = self.earlier.get(&key.0)?;
        let parts = hashes.iter().map(|hash| (self.path(key, hash), hash));
        let mut whole =
            parts.filter(|(path, hash)| hash_file(path).is_ok_and(|found| found == **hash));
        whole.next().map(|(path, _)| path)
    }

    /// Writes a part, whole or not at all; where it is.
    ///
    /// # Errors
    /// When the disk fails.
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

    /// Joins the parts of these images, in this order, to the output, which appears whole; then
    /// removes all parts.
    ///
    /// # Errors
    /// When a part or the output fails; the parts stay then.
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

    /// Removes all parts, those of earlier options and versions too, and the folder if nothing else is in it.
    pub fn remove(self) {
        // What cannot be removed is in nobody's way: the output is there.
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        for entry in entries.flatten() {
            if of_name(&entry.file_name().to_string_lossy()).is_some() {
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Makes the folder of parts if it is not there and locks it, where folders can be locked. The system takes the lock
/// back when the process ends in any way.
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
        // Another run may have removed it, being done, before it was locked here.
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

/// The key in the name of a part, and the hash of its content, which those of the first version lack.
fn of_name(name: &str) -> Option<(&str, Option<&str>)> {
    let is_hash =
        |text: &str, n| text.len() == n && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let name = name.strip_suffix(ENDING)?;
    let (key, hash) = name.split_once('-').map_or((name, None), |(key, hash)| (key, Some(hash)));
    let is_part = is_hash(key, KEY) && hash.is_none_or(|hash| is_hash(hash, HASH));
    is_part.then_some((key, hash))
}
