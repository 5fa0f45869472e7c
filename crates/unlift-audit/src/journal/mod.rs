//! The journal: recovered points are kept in a folder until the audit is complete, so that an
//! interrupted audit can resume.
//!
//! A file name contains a key (hash of program, released map, lists and options) and a hash of key
//! and content. So files of another audit or version, damaged files and renamed files are not used.
//! The notes of the audit state how many recoveries were read.

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

const ENDING: &str = ".recovered.parquet";

/// A folder of recovered points.
pub struct Journal<'a> {
    folder: PathBuf,
    /// Identifies programs that recover identical bits.
    program: String,
    progress: &'a dyn Progress,
    /// Keys that this run used. Their files are removed at the end.
    keys: BTreeSet<String>,
    n_recalled: usize,
    /// True after a file could not be written; the audit continues without further writes.
    is_full: bool,
}

impl<'a> Journal<'a> {
    /// Opens the journal in `folder`, or creates the folder with access for the owner only.
    /// `program` must differ between programs that may recover different bits.
    ///
    /// # Errors
    /// If the folder does not exist and cannot be created.
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
        // Removes temporary files of a run that was killed.
        sweep(folder);
        let folder = folder.to_owned();
        Ok(Self { folder, program, progress, keys: BTreeSet::new(), n_recalled: 0, is_full: false })
    }

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

    pub(crate) fn keep(&mut self, recovery: &Recovery<'_, 3>, recovered: &Recovered<3>) {
        if self.is_full || !can_keep(recovery) {
            return;
        }
        let key = self.key(recovery);
        if let Err(error) = self.write(&key, recovered) {
            self.give_up(&error);
        }
    }

    /// Returns a note about recoveries that were read from the journal, if there are any.
    pub(crate) fn note(&self) -> Option<String> {
        let n = self.n_recalled;
        (n > 0).then(|| format!("{n} recoveries were read from the journal of an interrupted run"))
    }

    /// Removes all files of the keys that this run used, and the folder if it is empty then.
    pub fn finish(self) {
        for path in self.files(|name| self.keys.iter().any(|key| name.starts_with(key.as_str()))) {
            // A remaining file stays valid, so a failure is harmless.
            let _ = fs::remove_file(path);
        }
    }

    fn write(&self, key: &str, recovered: &Recovered<3>) -> Result<(), unlift_io::Error> {
        // The hash of the content is unknown until the file is written; the process id avoids
        // conflicts.
        let unnamed = self.folder.join(format!("{key}.{}{ENDING}", std::process::id()));
        write_recovered(&unnamed, recovered)?;
        let path = self.folder.join(named(key, &hash_file(&unnamed)?));
        fs::rename(&unnamed, &path).map_err(|source| unlift_io::Error::write(&path, source))
    }

    fn files(&self, is: impl Fn(&str) -> bool) -> Vec<PathBuf> {
        let Ok(entries) = fs::read_dir(&self.folder) else { return Vec::new() };
        let entries = entries.filter_map(Result::ok);
        let named = entries.filter(|entry| entry.file_name().to_str().is_some_and(&is));
        let mut paths: Vec<PathBuf> = named.map(|entry| entry.path()).collect();
        paths.sort();
        paths
    }

    /// Returns the first file of `key` whose name fits its content. Removes damaged files;
    /// unreadable files stay.
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

    fn key(&mut self, recovery: &Recovery<'_, 3>) -> String {
        let key = key(&self.program, recovery);
        self.keys.insert(key.clone());
        key
    }

    fn give_up(&mut self, error: &dyn Display) {
        self.is_full = true;
        self.progress.say(&format!("note: --journal: {error}; nothing more is kept"));
    }

    /// Reports that a file cannot be used. It may still be valid, so it stays.
    fn pass_over(&self, path: &Path, error: &dyn Display) {
        let shown = OneLine(path.display());
        self.progress.say(&format!("note: --journal: {shown}: {error}: recovered again"));
    }

    /// Removes a file whose content does not fit its name.
    fn drop_damaged(&self, path: &Path) {
        let shown = OneLine(path.display());
        self.progress.say(&format!("note: --journal: {shown} is damaged: recovered again"));
        // Only a journal creates such names.
        let _ = fs::remove_file(path);
    }
}

fn named(key: &str, content: &str) -> String {
    let mut both = Hasher::default();
    both.add(key.as_bytes());
    both.add(content.as_bytes());
    format!("{key}-{}{ENDING}", both.hex())
}

impl Drop for Journal<'_> {
    fn drop(&mut self) {
        // Fails unless the folder is empty, as after a run that kept nothing.
        let _ = fs::remove_dir(&self.folder);
    }
}

/// Returns true if the solver's results can be kept. The trial counts of RANSAC are not in the
/// files, and a third-party solver may have changed.
fn can_keep(recovery: &Recovery<'_, 3>) -> bool {
    Builtin::of(recovery.solver).is_some_and(|builtin| builtin != Builtin::Ransac)
}
