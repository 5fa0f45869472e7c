//! One output file.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::unfinished::{Unfinished, live};
use super::{Access, parent_of, resolved};
use crate::Error;

/// Writes the file `path` with `fill` and keeps the old file until the new one is complete.
///
/// # Errors
/// When the folder does not exist, `path` is a folder or a device, or writing fails. No temporary
/// file is left then.
pub fn write_file(
    path: &Path,
    access: Access,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let mut output = OutputFile::create(path, access)?;
    fill(output.writer()).map_err(|source| Error::write(path, source))?;
    output.commit()
}

/// A file that is written under a temporary name in its folder and renamed by
/// [`commit`](Self::commit).
///
/// The target of a symbolic link is replaced, not the link. Dropping the value without a commit
/// removes the temporary file.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    target: PathBuf,
    writer: BufWriter<File>,
    unfinished: Unfinished,
}

impl OutputFile {
    /// Starts the output file `path`.
    ///
    /// # Errors
    /// When the folder does not exist, `path` is a folder or a device, or the disk fails.
    pub fn create(path: &Path, access: Access) -> Result<Self, Error> {
        let target = Self::check(path)?;
        let made = Unfinished::file(&target, access).map_err(|source| Error::write(path, source));
        let (unfinished, file) = made?;
        let writer = BufWriter::with_capacity(1 << 17, file);
        Ok(Self { path: path.to_owned(), target, writer, unfinished })
    }

    /// Returns the place of an output file at `path`, with links resolved.
    pub(super) fn check(path: &Path) -> Result<PathBuf, Error> {
        let target = resolved(path)?;
        match fs::metadata(&target) {
            Ok(found) if found.is_dir() => return Err(Error::new(path, "", "a file", "a folder")),
            // A rename would replace a device or a pipe.
            Ok(found) if !found.is_file() => {
                return Err(Error::new(path, "", "a regular file", "a device or a pipe"));
            }
            _ => {}
        }
        let folder = parent_of(&target);
        if !folder.is_dir() {
            return Err(Error::new(folder, "", "an existing folder", "none"));
        }
        Ok(target)
    }

    /// The path as the caller gave it, for errors.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The buffered writer of the temporary file.
    pub fn writer(&mut self) -> &mut BufWriter<File> {
        &mut self.writer
    }

    /// Moves the file to its place.
    ///
    /// # Errors
    /// When the disk fails. An existing file is unchanged then.
    pub fn commit(mut self) -> Result<(), Error> {
        let failed = |source| Error::write(&self.path, source);
        self.writer.flush().map_err(failed)?;
        self.writer.get_ref().sync_all().map_err(failed)?;
        drop(self.writer);
        let undisturbed = live();
        let renamed = fs::rename(self.unfinished.path(), &self.target);
        drop(undisturbed);
        renamed.map_err(failed)?;
        self.unfinished.keep();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::entries;
    use super::*;

    #[test]
    fn a_failed_file_leaves_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_file(&path, Access::Usual, |w| w.write_all(b"old")).unwrap();
        let broken = |w: &mut BufWriter<File>| {
            w.write_all(b"new")?;
            Err(io::Error::other("lost power"))
        };
        let error = write_file(&path, Access::Usual, broken).unwrap_err().to_string();
        assert!(error.ends_with("a.bin: cannot write: lost power"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(folder.path()), ["a.bin"]);
        let error = write_file(folder.path(), Access::Usual, |_| Ok(())).unwrap_err();
        assert!(error.to_string().ends_with(": expected a file, found a folder"));
    }

    #[cfg(unix)]
    #[test]
    fn a_private_file_in_place_of_a_readable_one_is_private() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        fs::write(&path, b"1").unwrap();
        write_file(&path, Access::Private, |w| w.write_all(b"1")).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
