//! Outputs that appear whole or not at all, and that never cost anybody a file.
//!
//! Everything is built under a temporary name (`partial`) beside its place and renamed when it is whole. What
//! stands at the place is replaced only if it is of the kind that is written there ([`Kind`], by content), and never
//! if it is an input of the same run ([`Rules`]). Nothing else is touched: a folder that is written to may hold
//! anything.

mod file;
mod kind;
mod partial;
mod removal;
mod rules;
mod set;
mod swap;

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use crate::Error;

pub use file::OutputFile;
pub(crate) use kind::{CLOUD_COMMENT, FEATURES_MARK, MODEL_MARK};
pub use kind::{Kind, marked_picture};
pub use partial::{abandon, make_folders, sweep};
pub use rules::{Rules, place_of};
pub use set::{Alone, OutputSet};

/// Who may read what is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// As any new file or folder.
    Usual,
    /// Its owner alone: truth, recovered points, pages that show them. Unix: files 0600, folders 0700.
    Private,
}

/// Writes the file `path` through `fill`; whatever stood there stays until the new file is whole.
///
/// As [`OutputFile`], for what is written in one go.
///
/// # Errors
/// When the folder does not exist, `path` is a folder or a device, `fill` fails, or the disk does.
/// Nothing is left behind then.
pub fn write_file(
    path: &Path,
    access: Access,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let mut output = OutputFile::create(path, access)?;
    fill(output.writer()).map_err(|source| Error::write(path, source))?;
    output.commit()
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

/// Makes the names in `folder` last through a loss of power, where folders can be flushed: the file is in its place
/// either way.
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
