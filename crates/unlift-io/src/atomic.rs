//! Atomic outputs: a file is written completely or not at all, and no file of another program is
//! lost.
//!
//! An output is written beside its place as `.NAME.unlift-partial`, and renamed when it is complete.
//! The next run of the same output replaces what a killed run left. A lock keeps two runs apart; the
//! system releases it when a process ends.

use std::ffi::OsString;
use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use crate::{Error, features, stage};

const PARTIAL: &str = ".unlift-partial";
pub(crate) const CLOUD_COMMENT: &str = "unlift";
/// The first line of each file of a COLMAP model.
pub(crate) const MODEL_MARK: &str = "# unlift model";
const MODEL_MARKS: &[&[u8]] = &[MODEL_MARK.as_bytes()];
/// A PNG chunk: length, the text "Software: unlift", checksum.
const PICTURE_MARK: &[u8; 27] = b"\0\0\0\x0ftEXtSoftware\0unlift\xfe\xc8\xcb\xd5";

/// The permissions of outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The default permissions of a new file or folder.
    Usual,
    /// Only the owner can read it: ground truth, recovered points, pages that show them (Unix:
    /// 0600, folders 0700).
    Private,
}

/// A kind of file that unlift writes, recognized by the beginning of its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs)]
pub enum Kind {
    AuditJson,
    Page,
    Stage(stage::Kind),
    Cloud,
    Model,
    Features,
    Picture,
    Junit,
    Table,
    Curves,
}

impl Kind {
    /// Returns the name of the kind, and the marks of its files, of which one begins after at most
    /// this number of bytes.
    fn marks(self) -> (&'static str, usize, &'static [&'static [u8]]) {
        match self {
            Self::AuditJson => ("an audit.json", 0, &[b"{\n  \"unlift\": \""]),
            Self::Page => ("a report", 1024, &[b"<meta name=\"generator\" content=\"unlift\">"]),
            Self::Stage(_) => ("a stage file of this kind", 0, &[]),
            Self::Cloud => ("a cloud", 40, &[b"\ncomment unlift\n", b"# unlift\n"]),
            Self::Model => ("a model", 0, MODEL_MARKS),
            Self::Features => ("features", 0, &[]),
            Self::Picture => ("a picture", 33, &[PICTURE_MARK]),
            Self::Junit => ("gates as JUnit XML", 40, &[b"<testsuites name=\"unlift\""]),
            Self::Table => ("a table", 0, &[b"scheme,neighbors,", b"% unlift ", b"<!-- unlift "]),
            Self::Curves => ("curves", 40, &[b"<!-- unlift "]),
        }
    }

    /// Returns true if the file at `path` is of this kind, and false if it cannot be read.
    pub fn is_at(self, path: &Path) -> bool {
        match self {
            Self::Stage(kind) => return stage::declared_kind(path) == Some(kind),
            Self::Features => return features::is_ours(path),
            _ => {}
        }
        let (mut head, (_, max_offset, marks)) = (Vec::new(), self.marks());
        let _ = File::open(path).and_then(|file| file.take(2048).read_to_end(&mut head));
        let is_there = |mark: &&[u8]| {
            head.windows(mark.len()).take(max_offset + 1).any(|bytes| bytes == *mark)
        };
        marks.iter().any(is_there)
    }
}

/// Adds the mark of [`Kind::Picture`] to the bytes of a PNG, after its first chunk.
#[must_use]
pub fn marked_picture(png: &[u8]) -> Vec<u8> {
    let (head, rest) = png.split_at(33.min(png.len()));
    [head, PICTURE_MARK, rest].concat()
}

/// The inputs of a run, which no output replaces, and the permission to replace other files.
#[derive(Clone, Debug, Default)]
pub struct Rules {
    inputs: Vec<PathBuf>,
    force: bool,
}

impl Rules {
    /// Creates the rules of a run that reads `inputs`.
    pub fn new<'a>(inputs: impl IntoIterator<Item = &'a Path>, force: bool) -> Self {
        Self { inputs: inputs.into_iter().map(Path::to_owned).collect(), force }
    }

    /// Checks that a file of `kind` may be written at `path`, and returns its absolute place with
    /// links resolved. Refuses inputs, and without `force` files of another kind.
    pub fn check(&self, path: &Path, kind: Kind) -> Result<PathBuf, Error> {
        let place = place_of(path)?;
        let is_place = |input: &&PathBuf| fs::canonicalize(input).is_ok_and(|at| at == place);
        if let Some(input) = self.inputs.iter().find(is_place) {
            let found = format!("the input {}", input.display());
            return Err(Error::new(path, "", "a file that is not read", found));
        }
        if place.exists() && !self.force && !kind.is_at(&place) {
            let name = kind.marks().0;
            let expected = format!("nothing, or {name} of an earlier run");
            return Err(Error::new(path, "", expected, "another file"));
        }
        Ok(place)
    }
}

fn place_of(path: &Path) -> Result<PathBuf, Error> {
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
    fill(output.writer()).map_err(|source| Error::write(path, source))?;
    output.commit()
}

/// A file that is written beside its place and renamed by [`commit`](Self::commit). The target of a
/// symbolic link is replaced, not the link. Without a commit nothing is left.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    place: PathBuf,
    partial: PathBuf,
    writer: BufWriter<File>,
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

    /// The path as the caller gave it, for errors.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of the unfinished file, for writers that open it by themselves.
    pub(crate) fn partial(&self) -> &Path {
        &self.partial
    }

    /// The buffered writer of the unfinished file.
    pub fn writer(&mut self) -> &mut BufWriter<File> {
        &mut self.writer
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

/// Several output files of one folder, which [`commit`](Self::commit) moves to their places.
#[derive(Debug)]
pub struct OutputSet {
    path: PathBuf,
    rules: Rules,
    files: Vec<(OutputFile, Kind)>,
    is_new: bool,
}

impl OutputSet {
    /// Starts outputs in the folder `path`, which is created if missing. `first` are files that will
    /// be written: they are checked now, before hours of work.
    pub fn create(
        path: &Path,
        rules: Rules,
        access: Access,
        first: &[(&str, Kind)],
    ) -> Result<Self, Error> {
        let is_new = !path.exists();
        if !is_new && !path.is_dir() {
            return Err(Error::new(path, "", "a folder, or nothing", "a file"));
        }
        make_folders(path, access)?;
        let mut set = Self { path: path.to_owned(), rules, files: Vec::new(), is_new };
        for (name, kind) in first {
            set.stage(name, *kind)?;
        }
        set.files.clear();
        Ok(set)
    }

    /// Returns the path at which the output `name` of this kind is written.
    pub fn stage(&mut self, name: &str, kind: Kind) -> Result<PathBuf, Error> {
        let path = self.path.join(name);
        self.rules.check(&path, kind)?;
        let file = OutputFile::create(&path, Access::Private)?;
        let partial = file.partial.clone();
        self.files.push((file, kind));
        Ok(partial)
    }

    /// Moves all files to their places, in the order of [`stage`](Self::stage), unless another file
    /// has appeared at one.
    pub fn commit(mut self) -> Result<(), Error> {
        for (file, kind) in &self.files {
            self.rules.check(&file.path, *kind)?;
        }
        std::mem::take(&mut self.files).into_iter().try_for_each(|(file, _)| file.commit())
    }
}

impl Drop for OutputSet {
    fn drop(&mut self) {
        self.files.clear();
        // Fails unless the folder is empty.
        let _ = self.is_new && fs::remove_dir(&self.path).is_ok();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

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
        assert_eq!(entries(folder.path()), ["a.bin"]);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn two_runs_do_not_write_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        let first = OutputFile::create(&path, Access::Usual).unwrap();
        let error = OutputFile::create(&path, Access::Usual).unwrap_err().to_string();
        assert!(error.ends_with("expected no other run that writes it, found one in progress"));
        first.commit().unwrap();
        OutputFile::create(&path, Access::Usual).unwrap().commit().unwrap();
    }

    #[test]
    fn a_set_is_moved_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let first = [("audit.json", Kind::AuditJson)];
        let set = |text: &str| {
            let mut set = OutputSet::create(&out, Rules::default(), Access::Usual, &first)?;
            fs::write(set.stage("model.txt", Kind::Model)?, "# unlift model")?;
            fs::write(set.stage("audit.json", Kind::AuditJson)?, text)?;
            Ok::<_, Box<dyn std::error::Error>>(set)
        };
        drop(set("{}").unwrap());
        assert!(!out.exists());
        let other = set("{\n  \"unlift\": \"1\"}").unwrap();
        fs::write(out.join("audit.json"), "mine").unwrap();
        let error = other.commit().unwrap_err().to_string();
        let rule = "expected nothing, or an audit.json of an earlier run, found another file";
        assert!(error.ends_with(rule), "{error}");
        assert_eq!(entries(&out), ["audit.json"]);
        assert!(set("").is_err());
        fs::remove_file(out.join("audit.json")).unwrap();
        for _ in 0..2 {
            set("{\n  \"unlift\": \"1\"}").unwrap().commit().unwrap();
        }
        assert_eq!(entries(&out), ["audit.json", "model.txt"]);
    }
}
