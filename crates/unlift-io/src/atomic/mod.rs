//! Atomic outputs: a file is written completely or not at all, and no file of another program is
//! lost.
//!
//! An output is built under a temporary name (`unfinished`) and renamed when it is complete. It
//! replaces an existing file only if that is of the same kind ([`Kind`]) and no input of the run
//! ([`Rules`]).

mod file;
mod kind;
mod rules;
mod set;
mod unfinished;

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use crate::Error;

pub use file::{OutputFile, write_file};
pub(crate) use kind::{CLOUD_COMMENT, FEATURES_MARK, MODEL_MARK};
pub use kind::{Kind, marked_picture};
pub use rules::{Rules, place_of};
pub use set::OutputSet;
pub(crate) use unfinished::final_place;
pub use unfinished::{abandon, sweep};

/// The permissions of outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The default permissions of a new file or folder.
    Usual,
    /// Only the owner can read it: ground truth, recovered points, pages that show them (Unix:
    /// 0600, folders 0700).
    Private,
}

/// Creates `folder` and its missing parents.
///
/// # Errors
/// When a folder cannot be created.
pub fn make_folders(folder: &Path, access: Access) -> Result<(), Error> {
    let mut made = unfinished::Unfinished::default();
    made.make_folders(folder, access).map_err(|source| Error::write(folder, source))?;
    made.keep();
    Ok(())
}

/// Locks `folder` against other runs that replace files in it, until the result is dropped.
///
/// Returns `None` if folders cannot be locked, or another process holds the lock (`flock`) for 5
/// seconds. Work then continues without the lock.
#[must_use]
pub fn alone_in(folder: &Path) -> Option<File> {
    const PATIENCE: Duration = Duration::from_secs(5);
    let started = Instant::now();
    let file = File::open(folder).ok()?;
    loop {
        match file.try_lock() {
            Ok(()) => return Some(file),
            Err(TryLockError::WouldBlock) if started.elapsed() < PATIENCE => {
                thread::sleep(Duration::from_millis(1));
            }
            Err(_) => return None,
        }
    }
}

/// Resolves a symbolic link. Other paths are returned unchanged.
fn resolved(path: &Path) -> Result<PathBuf, Error> {
    let named = path.file_name().is_some();
    if !path.is_symlink() && (named || !path.exists()) {
        return Ok(path.to_owned());
    }
    fs::canonicalize(path).map_err(|source| match fs::read_link(path) {
        Ok(to) if source.kind() == io::ErrorKind::NotFound => {
            let found = format!("a link to {}, which does not exist", to.display());
            Error::new(path, "", "a file, a folder, or nothing", found)
        }
        _ => Error::write(path, source),
    })
}

fn flush_names(folder: &Path) {
    if cfg!(unix) {
        let _ = File::open(folder).and_then(|folder| folder.sync_all());
    }
}

fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

#[cfg(test)]
fn entries(folder: &Path) -> Vec<String> {
    let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
}
