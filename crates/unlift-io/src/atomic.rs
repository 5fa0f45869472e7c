//! Atomic outputs: a file is written completely or not at all, and no file of another program is lost.
//!
//! An output is written beside its place as `.NAME.unlift-partial`, and renamed when it is complete.
//! The next run of the same output replaces what a killed run left. A lock keeps two runs apart; the
//! system releases it when a process ends.

use std::ffi::OsString;
use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::Error;

const PARTIAL: &str = ".unlift-partial";

/// The permissions of outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The default permissions of a new file or folder.
    Usual,
    /// Only the owner can read it: ground truth, recovered points, pages that show them (Unix:
    /// 0600, folders 0700).
    Private,
}

/// Returns the absolute place of an output with links resolved.
pub(crate) fn place_of(path: &Path) -> Result<PathBuf, Error> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(Error::new(folder, "", "an existing folder", "none"));
    }
    let place = match path.file_name() {
        Some(name) if !path.is_symlink() => fs::canonicalize(folder).map(|at| at.join(name)),
        _ => fs::canonicalize(path),
    };
    let place = place.map_err(|source| Error::write(path, source))?;
    match fs::metadata(&place) {
        Ok(found) if found.is_dir() => Err(Error::new(path, "", "a file", "a folder")),
        // A rename would replace a device or a pipe.
        Ok(found) if !found.is_file() => Err(Error::new(path, "", "a file", "a device or a pipe")),
        _ => Ok(place),
    }
}

/// Creates `folder` and its missing parents.
pub fn make_folders(folder: &Path, access: Access) -> Result<(), Error> {
    let mut builder = DirBuilder::new();
    #[cfg(unix)]
    if access == Access::Private {
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    }
    builder.recursive(true).create(folder).map_err(|source| Error::write(folder, source))
}

/// Writes the file `path` with `fill` and keeps the old file until the new one is complete.
pub fn write_file(
    path: &Path,
    access: Access,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let mut output = OutputFile::create(path, access)?;
    fill(&mut output.writer).map_err(|source| Error::write(path, source))?;
    output.commit()
}

/// A file that is written beside its place and renamed by [`commit`](Self::commit). The target of a
/// symbolic link is replaced, not the link. Without a commit nothing is left.
#[derive(Debug)]
pub struct OutputFile {
    /// The path as the caller gave it, for errors.
    pub(crate) path: PathBuf,
    place: PathBuf,
    /// The path of the unfinished file, for writers that open it by themselves.
    pub(crate) partial: PathBuf,
    pub(crate) writer: BufWriter<File>,
}

impl OutputFile {
    /// Starts the output file `path`. Its folder must exist, and no other run may be writing it.
    pub fn create(path: &Path, access: Access) -> Result<Self, Error> {
        let place = place_of(path)?;
        let mut name = OsString::from(".");
        name.push(place.file_name().unwrap_or_default());
        name.push(PARTIAL);
        let partial = place.with_file_name(name);
        let file = locked(&partial, access).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => {
                Error::new(path, "", "no other run that writes it", "one in progress")
            }
            _ => Error::write(path, source),
        })?;
        let writer = BufWriter::with_capacity(1 << 17, file);
        Ok(Self { path: path.to_owned(), place, partial, writer })
    }

    /// Moves the file to its place. If that fails, an existing file is unchanged.
    pub fn commit(mut self) -> Result<(), Error> {
        let written = self.writer.flush().and_then(|()| self.writer.get_ref().sync_all());
        let renamed = written.and_then(|()| fs::rename(&self.partial, &self.place));
        renamed.map_err(|source| Error::write(&self.path, source))?;
        // Another run may already write under this name.
        self.partial.clear();
        Ok(())
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.partial);
    }
}

/// Creates and locks `partial`, in place of a file that a killed run left. The error is
/// `AlreadyExists` if another run holds the lock.
fn locked(partial: &Path, access: Access) -> io::Result<File> {
    let in_use = || Err(io::ErrorKind::AlreadyExists.into());
    let left = File::open(partial).ok();
    if let Some(left) = &left {
        if let Err(TryLockError::WouldBlock) = left.try_lock() {
            return in_use();
        }
        let _ = fs::remove_file(partial);
    }
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    if access == Access::Private {
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    }
    let file = options.write(true).create_new(true).open(partial)?;
    // Some file systems have no locks.
    let is_locked_by_other = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
    // Another run may have taken the file for one that was left, before it was locked here.
    #[cfg(unix)]
    let is_locked_by_other =
        is_locked_by_other || std::os::unix::fs::MetadataExt::nlink(&file.metadata()?) == 0;
    if is_locked_by_other { in_use() } else { Ok(file) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_a_leftover_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_file(&path, Access::Usual, |w| w.write_all(b"old")).unwrap();
        let broken = |w: &mut BufWriter<File>| {
            w.write_all(b"new")?;
            Err(io::Error::other("no power"))
        };
        let error = write_file(&path, Access::Usual, broken).unwrap_err().to_string();
        assert!(error.ends_with("a.bin: cannot write: no power"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        // A killed run left a longer file that others can read.
        fs::write(folder.path().join(".a.bin.unlift-partial"), "partial").unwrap();
        write_file(&path, Access::Private, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn two_runs_do_not_write_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let create = || OutputFile::create(&folder.path().join("a.bin"), Access::Usual);
        let first = create().unwrap();
        let error = create().unwrap_err().to_string();
        assert!(error.ends_with("expected no other run that writes it, found one in progress"));
        first.commit().unwrap();
        create().unwrap().commit().unwrap();
    }
}
