//! Outputs that appear whole or not at all, and that never cost anybody a file.
//!
//! Everything is built under a temporary name (`unfinished`) beside its place and renamed when it is whole. What
//! stands at the place is replaced only if it is of the kind that is written there ([`Kind`], by content), and never
//! if it is an input of the same run ([`Rules`]). Nothing else is touched: a folder that is written to may hold
//! anything.

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

/// Who may read what is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// As any new file or folder.
    Usual,
    /// Its owner alone: truth, recovered points, pages that show them. Unix: files 0600, folders 0700.
    Private,
}

/// Makes `folder` and its missing parents, to stay.
///
/// # Errors
/// When one cannot be made.
pub fn make_folders(folder: &Path, access: Access) -> Result<(), Error> {
    let mut made = unfinished::Unfinished::default();
    made.make_folders(folder, access).map_err(|source| Error::write(folder, source))?;
    made.keep();
    Ok(())
}

/// Waits until no other run puts files in their places in `folder`, and keeps others out until the result is dropped.
///
/// `None` where folders cannot be locked, or where the lock (`flock`) is held for seconds, as by `flock(1)` around a
/// command: the work goes on without.
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

/// Where a symbolic link points, or the path itself.
fn resolved(path: &Path) -> Result<PathBuf, Error> {
    let named = path.file_name().is_some();
    if !path.is_symlink() && (named || !path.exists()) {
        return Ok(path.to_owned());
    }
    fs::canonicalize(path).map_err(|source| match fs::read_link(path) {
        Ok(to) if source.kind() == io::ErrorKind::NotFound => {
            let found = format!("a link to {}, which is not there", to.display());
            Error::new(path, "", "a file, a folder, or nothing", found)
        }
        _ => Error::write(path, source),
    })
}

/// Makes the names in `folder` outlast a loss of power, where folders can be flushed.
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

/// The names in a folder, sorted.
#[cfg(test)]
fn entries(folder: &Path) -> Vec<String> {
    let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
}
