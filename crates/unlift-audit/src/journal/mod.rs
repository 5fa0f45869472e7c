//! What was recovered, kept in a folder until all is done: an interrupted run goes on from there.
//!
//! A file is named by everything that its content follows from (program, released map, lists, options) and by the hash of that
//! content. So nothing is taken that another audit, another version or a damaged disk left, whatever the folder is called.
//! An audit keeps every recovery that is done; of one alone [`KeptRounds`] keeps where its rounds stand.

mod key;
mod rounds;

use std::fmt::Display;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use unlift::OneLine;
use unlift::audit::Recovery;
use unlift::recover::{Recovered, Solver};
use unlift_io::atomic::sweep;
use unlift_io::hash::hash_file;
use unlift_io::stage::{read_recovered, write_recovered};

use crate::{Error, Progress};
use key::key;
pub use rounds::KeptRounds;

/// How names of recoveries end.
const ENDING: &str = ".recovered.parquet";

/// A folder of recovered points.
pub struct Journal<'a> {
    folder: PathBuf,
    /// The same for the same program only.
    program: String,
    progress: &'a dyn Progress,
    /// Files that were taken or written, to be removed when all is done.
    used: Vec<PathBuf>,
    n_recalled: usize,
    /// Whether a file could not be written: the audit goes on without.
    is_full: bool,
}

impl<'a> Journal<'a> {
    /// The journal in `folder`, which is made if it is not there, for its owner alone. `program` is what tells programs apart
    /// that may recover different bits.
    ///
    /// # Errors
    /// When there is no such folder and none can be made.
    pub fn open(folder: &Path, program: String, progress: &'a dyn Progress) -> Result<Self, Error> {
        let mut builder = fs::DirBuilder::new();
        #[cfg(unix)]
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
        match builder.create(folder) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists || !folder.is_dir() => {
                let found = if folder.exists() { "a file".into() } else { error.to_string() };
                let folder = OneLine(folder.display());
                return Err(Error::request(format!(
                    "--journal: {folder}: expected a folder, found {found}"
                )));
            }
            _ => {}
        }
        // What was being written when a run was killed.
        sweep(folder);
        let folder = folder.to_owned();
        Ok(Self { folder, program, progress, used: Vec::new(), n_recalled: 0, is_full: false })
    }

    /// What was recovered before, where that is so. The sampling loop's counts are in no file: it is run again.
    pub(crate) fn recall(&mut self, recovery: &Recovery<'_, 3>) -> Option<Recovered<3>> {
        if recovery.options.solver == Solver::Ransac {
            return None;
        }
        let key = self.key(recovery)?;
        let path = self.find(&key, ENDING)?;
        let is_whole =
            |path: &Path| hash_file(path).is_ok_and(|hash| path == self.named(&key, &hash, ENDING));
        match read_recovered::<3>(&path) {
            Ok(recovered) if is_whole(&path) => {
                self.used.push(path);
                self.n_recalled += 1;
                Some(recovered)
            }
            _ => {
                self.drop_damaged(&path);
                None
            }
        }
    }

    /// Keeps what was recovered now.
    pub(crate) fn keep(&mut self, recovery: &Recovery<'_, 3>, recovered: &Recovered<3>) {
        if self.is_full || recovery.options.solver == Solver::Ransac {
            return;
        }
        let Some(key) = self.key(recovery) else { return };
        match self.write(&key, recovered) {
            Ok(path) => self.used.push(path),
            Err(error) => self.give_up(&error),
        }
    }

    /// Where the rounds of `recovery` stand, which this journal keeps.
    pub fn rounds(&mut self, recovery: &Recovery<'_, 3>) -> KeptRounds<'_, 'a> {
        let key = if self.is_full { None } else { self.key(recovery) };
        KeptRounds::new(self, key)
    }

    /// Removes what this run took or wrote, and the folder if nothing else is in it.
    pub fn finish(self) {
        if self.n_recalled > 0 {
            let (n, folder) = (self.n_recalled, OneLine(self.folder.display()));
            self.progress.say(&format!("note: {n} recoveries were taken from {folder}"));
        }
        for path in &self.used {
            // What stays is found by its name, and is as right then as now.
            let _ = fs::remove_file(path);
        }
        let _ = fs::remove_dir(&self.folder);
    }

    fn write(&self, key: &str, recovered: &Recovered<3>) -> Result<PathBuf, unlift_io::Error> {
        let unnamed = self.folder.join(format!("{key}{ENDING}"));
        write_recovered(&unnamed, recovered)?;
        let path = self.named(key, &hash_file(&unnamed)?, ENDING);
        fs::rename(&unnamed, &path).map_err(|source| unlift_io::Error::write(&path, source))?;
        Ok(path)
    }

    fn named(&self, key: &str, hash: &str, ending: &str) -> PathBuf {
        self.folder.join(format!("{key}-{hash}{ending}"))
    }

    /// The file of `key` with such an ending, whatever its content.
    fn find(&self, key: &str, ending: &str) -> Option<PathBuf> {
        let names = fs::read_dir(&self.folder).ok()?.filter_map(Result::ok);
        let is_of_key = |name: &str| {
            let rest = name.strip_prefix(key).and_then(|name| name.strip_prefix('-'));
            rest.is_some_and(|rest| rest.ends_with(ending))
        };
        let mut found: Vec<PathBuf> = names
            .filter(|entry| entry.file_name().to_str().is_some_and(is_of_key))
            .map(|entry| entry.path())
            .collect();
        found.sort();
        found.into_iter().next()
    }

    /// A hash of all that `recovery` follows from; `None` where its lists cannot be read, and nothing more is kept.
    fn key(&mut self, recovery: &Recovery<'_, 3>) -> Option<String> {
        match key(&self.program, recovery) {
            Ok(key) => Some(key),
            Err(error) => {
                self.give_up(&error);
                None
            }
        }
    }

    fn give_up(&mut self, error: &dyn Display) {
        self.is_full = true;
        self.progress.say(&format!("note: --journal: {error}; nothing more is kept"));
    }

    /// Removes a file whose content is not the one that it is named by.
    fn drop_damaged(&self, path: &Path) {
        let shown = OneLine(path.display());
        self.progress.say(&format!("note: --journal: {shown} is damaged: recovered again"));
        // Its name is one that only we give.
        let _ = fs::remove_file(path);
    }
}
