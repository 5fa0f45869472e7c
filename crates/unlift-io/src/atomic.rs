//! Outputs that appear whole or not at all: built beside their place, then renamed.

use crate::Error;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Writes the file `path` through `fill`; whatever stood there stays until the new file is whole.
///
/// As [`OutputFile`], for what is written in one go.
///
/// # Errors
/// When the folder does not exist, `path` is a folder or a device, `fill` fails, or the disk does.
/// Nothing is left behind then.
pub fn write_file(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let mut output = OutputFile::create(path)?;
    fill(output.writer()).map_err(|source| Error::write(path, source))?;
    output.commit()
}

/// A file that is built in a temporary sibling and takes its place on [`commit`](Self::commit).
///
/// The bytes go to a temporary file in the same folder, which is flushed to disk and renamed. A
/// symbolic link is followed: the file it names is replaced, not the link. Dropped without a commit,
/// it leaves no trace.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    target: PathBuf,
    writer: BufWriter<File>,
    temporary: tempfile::TempPath,
}

impl OutputFile {
    /// Starts a file that will become `path`; what stands there stays as it is until the commit.
    ///
    /// # Errors
    /// When the folder does not exist, `path` is a folder or a device, or the disk fails.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::write(path, source);
        let target = Self::check(path)?;
        let mut builder = tempfile::Builder::new();
        let prefix = hidden_prefix(&target);
        builder.prefix(&prefix).suffix(".partial");
        // A temporary file is private by default; an output has the permissions of any new file.
        #[cfg(unix)]
        let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o666);
        #[cfg(unix)]
        builder.permissions(permissions);
        let (file, temporary) =
            builder.tempfile_in(parent_of(&target)).map_err(failed)?.into_parts();
        let writer = BufWriter::with_capacity(1 << 17, file);
        Ok(Self { path: path.to_owned(), target, writer, temporary })
    }

    /// Whether a file can be put at `path`, before hours of work go into it; where it will stand,
    /// links followed.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn check(path: &Path) -> Result<PathBuf, Error> {
        let target = resolved(path).map_err(|source| Error::write(path, source))?;
        match fs::metadata(&target) {
            Ok(found) if found.is_dir() => return Err(Error::new(path, "", "a file", "a folder")),
            // Renaming over a device or a pipe would replace it in the system.
            Ok(found) if !found.is_file() => {
                return Err(Error::new(path, "", "a regular file", "a device or a pipe"));
            }
            _ => {}
        }
        let folder = parent_of(&target);
        if !folder.is_dir() {
            return Err(Error::new(folder, "", "a folder to write in", "none"));
        }
        Ok(target)
    }

    /// The path as it was given, for errors.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where the bytes go.
    pub fn writer(&mut self) -> &mut BufWriter<File> {
        &mut self.writer
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// When the disk fails; what stood there is still there then.
    pub fn commit(mut self) -> Result<(), Error> {
        let failed = |source| Error::write(&self.path, source);
        self.writer.flush().map_err(failed)?;
        self.writer.get_ref().sync_all().map_err(failed)?;
        drop(self.writer);
        self.temporary.persist(&self.target).map_err(|refused| failed(refused.error))
    }
}

/// A folder that is built in a temporary sibling and takes its place on [`commit`](Self::commit).
///
/// Dropped without a commit, it leaves no trace.
#[derive(Debug)]
pub struct OutputDir {
    target: PathBuf,
    marker: String,
    // Removed on drop, before the parents below.
    staging: Option<TempDir>,
    created_parents: Vec<PathBuf>,
}

impl OutputDir {
    /// Starts a folder that will become `path`; missing parents are created.
    ///
    /// What may be replaced: nothing, an empty folder, or an earlier output, known by a regular file
    /// called `marker` directly in it. It stays as it is until the commit.
    ///
    /// # Errors
    /// When `path` is a file or any other non-empty folder, or the temporary folder cannot be made.
    pub fn create(path: impl Into<PathBuf>, marker: &str) -> Result<Self, Error> {
        let path = path.into();
        let failed = |source| Error::write(&path, source);
        let target = resolved(&path).map_err(failed)?;
        refuse_strangers(&target, marker)?;
        let parent = parent_of(&target).to_owned();
        let created_parents = create_parents(&parent).map_err(failed)?;
        let mut output = Self { target, marker: marker.to_owned(), staging: None, created_parents };
        let prefix = hidden_prefix(&output.target);
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).suffix(".partial");
        #[cfg(unix)]
        let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o777);
        #[cfg(unix)]
        builder.permissions(permissions);
        output.staging = Some(builder.tempdir_in(&parent).map_err(failed)?);
        Ok(output)
    }

    /// The temporary folder to write in.
    ///
    /// # Panics
    /// Never: the folder exists until `commit` takes the value.
    pub fn path(&self) -> &Path {
        let staging = self.staging.as_ref();
        staging.expect("the folder lives until commit").path()
    }

    /// Where the folder will stand.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Puts the folder in its place; an earlier output is removed whole.
    ///
    /// Replacing takes two renames, so for an instant there is nothing at the place.
    ///
    /// # Errors
    /// When something else has come to stand there since [`create`](Self::create), or a rename
    /// fails; the earlier output is put back then.
    pub fn commit(mut self) -> Result<(), Error> {
        refuse_strangers(&self.target, &self.marker)?;
        let target = self.target.clone();
        let failed = |source| Error::write(&target, source);
        let staging = self.staging.take().expect("the folder lives until commit");
        if !target.exists() {
            fs::rename(staging.path(), &target).map_err(failed)?;
        } else {
            let prefix = hidden_prefix(&target);
            let mut builder = tempfile::Builder::new();
            builder.prefix(&prefix).suffix(".replaced");
            let aside = builder.tempdir_in(parent_of(&target)).map_err(failed)?;
            let earlier = aside.path().join("earlier");
            fs::rename(&target, &earlier).map_err(failed)?;
            if let Err(source) = fs::rename(staging.path(), &target) {
                fs::rename(&earlier, &target).map_err(failed)?;
                return Err(failed(source));
            }
            aside.close().map_err(failed)?;
        }
        // It has moved: there is nothing left to clean up.
        let _ = staging.keep();
        self.created_parents.clear();
        Ok(())
    }
}

impl Drop for OutputDir {
    fn drop(&mut self) {
        drop(self.staging.take());
        for parent in self.created_parents.iter().rev() {
            // Only when empty: another program may have put something there meanwhile.
            let _ = fs::remove_dir(parent);
        }
    }
}

/// Refuses a target that is neither free, nor empty, nor an earlier output.
fn refuse_strangers(target: &Path, marker: &str) -> Result<(), Error> {
    let read = |source| Error::read(target, source);
    let expected = || format!("an empty folder or an earlier output (with {marker})");
    match fs::metadata(target) {
        Err(source) if source.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(read(source)),
        Ok(found) if !found.is_dir() => return Err(Error::new(target, "", expected(), "a file")),
        Ok(_) => {}
    }
    let empty = fs::read_dir(target).map_err(read)?.next().is_none();
    if empty || target.join(marker).is_file() {
        return Ok(());
    }
    Err(Error::new(target, "", expected(), "a folder of other files"))
}

/// Creates `folder` and its missing parents; returns what was created, outermost first.
fn create_parents(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let missing: Vec<PathBuf> = folder
        .ancestors()
        .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
        .map(Path::to_owned)
        .collect();
    fs::create_dir_all(folder)?;
    Ok(missing.into_iter().rev().collect())
}

/// Where a symbolic link points, or the path itself.
fn resolved(path: &Path) -> io::Result<PathBuf> {
    let named = path.file_name().is_some();
    if path.is_symlink() || (!named && path.exists()) {
        fs::canonicalize(path)
    } else {
        Ok(path.to_owned())
    }
}

fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn hidden_prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // File names end at 255 bytes, and the temporary one is longer.
    format!(".{}.", name.chars().take(40).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_failed_file_leaves_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_file(&path, |w| w.write_all(b"old")).unwrap();
        let broken = |w: &mut BufWriter<File>| {
            w.write_all(b"new")?;
            Err(io::Error::other("lost power"))
        };
        let error = write_file(&path, broken).unwrap_err().to_string();
        assert!(error.ends_with("a.bin: cannot write: lost power"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_folder_is_not_replaced_by_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let error = write_file(folder.path(), |_| Ok(())).unwrap_err();
        assert!(error.to_string().ends_with(": expected a file, found a folder"));
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_is_as_readable_as_any_other() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("a"), folder.path().join("b"));
        write_file(&ours, |w| w.write_all(b"1")).unwrap();
        fs::write(&plain, b"1").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[test]
    fn an_earlier_output_is_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out");
        for name in ["first", "second"] {
            let output = OutputDir::create(&target, "audit.json").unwrap();
            fs::write(output.path().join("audit.json"), name).unwrap();
            fs::write(output.path().join(name), name).unwrap();
            output.commit().unwrap();
        }
        assert_eq!(entries(&target), ["audit.json", "second"]);
        assert_eq!(entries(folder.path()), ["out"]);
    }

    #[test]
    fn an_empty_folder_is_taken_and_parents_are_made() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a/b/out");
        OutputDir::create(&target, "audit.json").unwrap().commit().unwrap();
        assert!(target.is_dir());
        OutputDir::create(&target, "audit.json").unwrap().commit().unwrap();
        assert_eq!(entries(&folder.path().join("a/b")), ["out"]);
    }

    #[test]
    fn without_commit_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let output = OutputDir::create(folder.path().join("a/out"), "audit.json").unwrap();
        fs::write(output.path().join("x"), "x").unwrap();
        drop(output);
        assert_eq!(entries(folder.path()), [""; 0]);
    }

    #[test]
    fn other_folders_and_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("notes.txt");
        fs::write(&file, "mine").unwrap();
        let refused = |path: &Path| {
            let error = OutputDir::create(path, "audit.json").unwrap_err();
            error.to_string().split_once(": ").unwrap().1.to_owned()
        };
        let rule = "expected an empty folder or an earlier output (with audit.json), found";
        assert_eq!(refused(folder.path()), format!("{rule} a folder of other files"));
        assert_eq!(refused(&file), format!("{rule} a file"));
        assert_eq!(entries(folder.path()), ["notes.txt"]);
    }
}
