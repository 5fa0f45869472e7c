//! What may be written: kinds of files, which are recognized by their content, and the outputs of a
//! run, which replace neither its inputs nor files of other kinds.

use std::fs;
use std::path::{Path, PathBuf};

use crate::atomic::{Access, OutputFile, make_folders, place_of};
use crate::{Error, features, input, stage};

/// A PNG chunk: length, the text "Software: unlift", checksum.
const PICTURE_MARK: &[u8; 27] = b"\0\0\0\x0ftEXtSoftware\0unlift\xfe\xc8\xcb\xd5";

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
}

impl Kind {
    /// Returns the name of the kind, and the marks of its files, of which one begins after at most this number of bytes.
    fn marks(self) -> (&'static str, usize, &'static [&'static [u8]]) {
        match self {
            Self::AuditJson => ("an audit.json", 0, &[b"{\n  \"unlift\": \""]),
            Self::Page => ("a report", 1024, &[b"<meta name=\"generator\" content=\"unlift\">"]),
            Self::Stage(_) => ("a stage file of this kind", 0, &[]),
            Self::Cloud => ("a cloud", 40, &[b"\ncomment unlift\n"]),
            Self::Model => ("a model", 0, &[b"# unlift model"]),
            Self::Features => ("features", 0, &[]),
            Self::Picture => ("a picture", 33, &[PICTURE_MARK]),
            Self::Junit => ("gates as JUnit XML", 40, &[b"<testsuites name=\"unlift\""]),
            Self::Table => ("a table", 0, &[b"scheme,neighbors,", b"% unlift "]),
        }
    }

    /// Returns true if the file at `path` is of this kind, and false if it cannot be read.
    pub fn is_at(self, path: &Path) -> bool {
        match self {
            Self::Stage(kind) => return stage::declared_kind(path) == Some(kind),
            Self::Features => return features::is_ours(path),
            _ => {}
        }
        let (_, max_offset, marks) = self.marks();
        let Ok((head, _)) = input::head(path, 2048) else { return false };
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

    /// Moves all files to their places, in the order of [`stage`](Self::stage), unless another file has appeared at one.
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
        assert_eq!(fs::read_dir(&out).unwrap().count(), 1);
        fs::remove_file(out.join("audit.json")).unwrap();
        for _ in 0..2 {
            set("{\n  \"unlift\": \"1\"}").unwrap().commit().unwrap();
        }
        assert_eq!(fs::read_to_string(out.join("model.txt")).unwrap(), "# unlift model");
    }
}
