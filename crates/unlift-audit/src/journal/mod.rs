//! What was recovered, kept in a folder until all is done: an interrupted run goes on from there.
//!
//! A file is named by a key, a hash of everything that its content follows from (program, released map, lists, options), and by a
//! hash of that key and the content together. So nothing is taken that another audit, another version or a damaged disk left, nor
//! a file that was given the name of another. What was taken is said in the notes of the audit.

mod key;

use std::collections::BTreeSet;
use std::fmt::Display;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use unlift::OneLine;
use unlift::audit::Recovery;
use unlift::recover::{Builtin, Recovered};
use unlift_io::atomic::sweep;
use unlift_io::hash::{Hasher, hash_file};
use unlift_io::stage::{read_recovered, write_recovered};

use crate::{Error, Progress};
use key::key;

/// How names of recoveries end.
const ENDING: &str = ".recovered.parquet";

/// A folder of recovered points.
pub struct Journal<'a> {
    folder: PathBuf,
    /// The same for the same program only.
    program: String,
    progress: &'a dyn Progress,
    /// Of what was asked for or kept: their files are removed when all is done.
    keys: BTreeSet<String>,
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
        Ok(Self { folder, program, progress, keys: BTreeSet::new(), n_recalled: 0, is_full: false })
    }

    /// What was recovered before, where that is so.
    pub(crate) fn recall(&mut self, recovery: &Recovery<'_, 3>) -> Option<Recovered<3>> {
        if !can_keep(recovery) {
            return None;
        }
        let key = self.key(recovery);
        let path = self.whole(&key)?;
        match read_recovered::<3>(&path) {
            Ok(recovered) => {
                self.n_recalled += 1;
                Some(recovered)
            }
            Err(error) => {
                self.pass_over(&path, &error);
                None
            }
        }
    }

    /// Keeps what was recovered now.
    pub(crate) fn keep(&mut self, recovery: &Recovery<'_, 3>, recovered: &Recovered<3>) {
        if self.is_full || !can_keep(recovery) {
            return;
        }
        let key = self.key(recovery);
        if let Err(error) = self.write(&key, recovered) {
            self.give_up(&error);
        }
    }

    /// What to say of recoveries that were not done now, if there are any.
    pub(crate) fn note(&self) -> Option<String> {
        let n = self.n_recalled;
        (n > 0).then(|| {
            format!(
                "{n} recoveries were taken from a journal, as a run that was interrupted left them"
            )
        })
    }

    /// Removes all files of what this run asked for or kept, and the folder if nothing else is in it.
    pub fn finish(self) {
        for path in self.files(|name| self.keys.iter().any(|key| name.starts_with(key.as_str()))) {
            // What stays is found by its name, and is as right then as now.
            let _ = fs::remove_file(path);
        }
    }

    fn write(&self, key: &str, recovered: &Recovered<3>) -> Result<(), unlift_io::Error> {
        // Before the content is known: another name for every process.
        let unnamed = self.folder.join(format!("{key}.{}{ENDING}", std::process::id()));
        write_recovered(&unnamed, recovered)?;
        let path = self.folder.join(named(key, &hash_file(&unnamed)?));
        fs::rename(&unnamed, &path).map_err(|source| unlift_io::Error::write(&path, source))
    }

    /// Files of the folder whose names are such, in order.
    fn files(&self, is: impl Fn(&str) -> bool) -> Vec<PathBuf> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let entries = entries.filter_map(Result::ok);
        let named = entries.filter(|entry| entry.file_name().to_str().is_some_and(&is));
        let mut paths: Vec<PathBuf> = named.map(|entry| entry.path()).collect();
        paths.sort();
        paths
    }

    /// The first file of `key` that is named as its content asks for. Others are removed; what cannot be read stays.
    fn whole(&self, key: &str) -> Option<PathBuf> {
        let of_key = format!("{key}-");
        for path in self.files(|name| name.starts_with(&of_key) && name.ends_with(ENDING)) {
            match hash_file(&path) {
                Ok(hash) if path.ends_with(named(key, &hash)) => return Some(path),
                Ok(_) => self.drop_damaged(&path),
                Err(error) => self.pass_over(&path, &error),
            }
        }
        None
    }

    /// A hash of all that `recovery` follows from.
    fn key(&mut self, recovery: &Recovery<'_, 3>) -> String {
        let key = key(&self.program, recovery);
        self.keys.insert(key.clone());
        key
    }

    fn give_up(&mut self, error: &dyn Display) {
        self.is_full = true;
        self.progress.say(&format!("note: --journal: {error}; nothing more is kept"));
    }

    /// Says that a file cannot be used, which may be as right as it was.
    fn pass_over(&self, path: &Path, error: &dyn Display) {
        let shown = OneLine(path.display());
        self.progress.say(&format!("note: --journal: {shown}: {error}: recovered again"));
    }

    /// Removes a file whose content is not the one that it is named by.
    fn drop_damaged(&self, path: &Path) {
        let shown = OneLine(path.display());
        self.progress.say(&format!("note: --journal: {shown} is damaged: recovered again"));
        // Its name is one that only we give.
        let _ = fs::remove_file(path);
    }
}

/// The name of a file of `key` whose content has the hash `content`.
fn named(key: &str, content: &str) -> String {
    let mut both = Hasher::default();
    both.add(key.as_bytes());
    both.add(content.as_bytes());
    format!("{key}-{}{ENDING}", both.hex())
}

impl Drop for Journal<'_> {
    fn drop(&mut self) {
        // Only if it is empty, as after a run that ended before anything was kept.
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Whether a journal may answer for the solver. The sampling loop's counts are in no file, and a solver of somebody's own may have
/// changed since.
fn can_keep(recovery: &Recovery<'_, 3>) -> bool {
    Builtin::of(recovery.solver).is_some_and(|builtin| builtin != Builtin::Ransac)
}
