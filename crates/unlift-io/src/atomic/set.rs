//! Several output files in one folder.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::unfinished::{MARK, Unfinished, live, sweep};
use super::{Access, Kind, Rules, alone_in, flush_names, parent_of, resolved};
use crate::Error;

/// Several output files of one folder that [`commit`](Self::commit) moves to their places together.
///
/// All checks precede the first rename. Dropping the value without a commit removes the temporary
/// files.
#[derive(Debug)]
pub struct OutputSet {
    /// The folder as the caller gave it, for errors.
    path: PathBuf,
    target: PathBuf,
    rules: Rules,
    access: Access,
    files: Vec<(PathBuf, Kind)>,
    // Removed on drop, before the folders that contain it.
    staging: Unfinished,
    made: Unfinished,
}

/// A place, and a second name of the file that was there before.
type Replaced = (PathBuf, Option<PathBuf>);

impl OutputSet {
    /// Starts outputs in the folder `path`, which is created if missing.
    ///
    /// `first` are files that will be written: they are checked now, before hours of work.
    ///
    /// # Errors
    /// When `path` is a file, cannot be written, or [`Rules::check`] refuses one of `first`.
    pub fn create(
        path: &Path,
        rules: Rules,
        access: Access,
        first: &[(&str, Kind)],
    ) -> Result<Self, Error> {
        let target = resolved(path)?;
        // Checked once: another program may create or remove the folder meanwhile.
        if fs::metadata(&target).is_ok_and(|found| !found.is_dir()) {
            return Err(Error::new(path, "", "a folder, or nothing", "a file"));
        }
        for (name, kind) in first {
            rules.check_in(&target, Path::new(name), *kind)?;
        }
        let mut tries = 0;
        let begun = loop {
            tries += 1;
            match begin(&target, access) {
                // Another run that is dropped removes the folder that it created, if it is still
                // empty.
                Err(error) if error.kind() == io::ErrorKind::NotFound && tries < 10 => {}
                begun => break begun,
            }
        };
        let (made, staging) = begun.map_err(|source| Error::write(path, source))?;
        let (path, files) = (path.to_owned(), Vec::new());
        Ok(Self { path, target, rules, access, files, staging, made })
    }

    /// Returns the temporary path for the output `name` of this kind. `name` may contain slashes.
    ///
    /// # Errors
    /// When [`Rules::check`] refuses the place, or a folder cannot be created.
    pub fn stage(&mut self, name: &str, kind: Kind) -> Result<PathBuf, Error> {
        let name = PathBuf::from(name);
        self.rules.check_in(&self.target, &name, kind)?;
        // Do not create the temporary folder itself again: an interrupt may just have removed it.
        let mut folder = self.staging.path().to_owned();
        for part in parent_of(&name).components() {
            folder.push(part);
            match fs::create_dir(&folder) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                made => made.map_err(|source| Error::write(&self.path, source))?,
            }
        }
        let staged = self.staging.path().join(&name);
        self.files.push((name, kind));
        Ok(staged)
    }

    /// Moves all files to their places, in the order of [`stage`](Self::stage).
    ///
    /// # Errors
    /// When another file has appeared at a place, or a rename fails. Replaced files are restored
    /// then.
    pub fn commit(mut self) -> Result<(), Error> {
        for (name, kind) in &self.files {
            self.rules.check_in(&self.target, name, *kind)?;
            let made = self.made.make_folders(parent_of(&self.target.join(name)), self.access);
            made.map_err(|source| Error::write(&self.path, source))?;
        }
        let alone = alone_in(&self.target);
        self.replace_all()?;
        drop((alone, self.staging));
        let mut folders: Vec<PathBuf> =
            self.files.iter().map(|(name, _)| parent_of(&self.target.join(name)).into()).collect();
        folders.dedup();
        folders.iter().for_each(|folder| flush_names(folder));
        self.made.keep();
        Ok(())
    }

    fn replace_all(&self) -> Result<(), Error> {
        let _undisturbed = live();
        let mut done = Vec::new();
        for at in 0..self.files.len() {
            if let Err(error) = self.replace(at, &mut done) {
                for (place, earlier) in done.into_iter().rev() {
                    // Best effort: the first error is the one to report.
                    let _ = match earlier {
                        Some(earlier) => fs::rename(earlier, place),
                        None => fs::remove_file(place),
                    };
                }
                return Err(error);
            }
        }
        Ok(())
    }

    /// Moves one file to its place. The old file gets a second name first, so that the place is
    /// never empty.
    fn replace(&self, at: usize, done: &mut Vec<Replaced>) -> Result<(), Error> {
        let (name, kind) = &self.files[at];
        let failed = |source| Error::write(self.path.join(name), source);
        let staged = self.staging.path().join(name);
        let place = resolved(&self.target.join(name))?;
        if !place.exists() {
            match fs::hard_link(&staged, &place) {
                // Another program has just created the file.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                    return Err(failed(error));
                }
                Err(_) => fs::rename(&staged, &place).map_err(failed)?,
                Ok(()) => {}
            }
            done.push((place, None));
            return Ok(());
        }
        let earlier = self.staging.path().join(format!("{MARK}-{at}"));
        // Some file systems have no hard links, and some forbid links to files of other users.
        let kept =
            fs::hard_link(&place, &earlier).or_else(|_| fs::copy(&place, &earlier).map(drop));
        kept.map_err(failed)?;
        // The file may have been exchanged after the first check.
        let checked = self.rules.check(&earlier, *kind);
        checked.map_err(|error| error.at(self.path.join(name)))?;
        fs::rename(&staged, &place).map_err(failed)?;
        done.push((place, Some(earlier)));
        Ok(())
    }
}

/// Creates the folder, sweeps it, and creates a temporary folder in it.
fn begin(target: &Path, access: Access) -> io::Result<(Unfinished, Unfinished)> {
    let mut made = Unfinished::default();
    made.make_folders(target, access)?;
    sweep(target);
    Ok((made, Unfinished::folder(target)?))
}

#[cfg(test)]
mod tests {
    use super::super::entries;
    use super::*;

    const AUDIT: &str = r#"{"unlift": "0.1.0", "schema": 1, "n": "#;
    const FIRST: [(&str, Kind); 1] = [("audit.json", Kind::AuditJson)];

    fn create(path: &Path) -> Result<OutputSet, Error> {
        OutputSet::create(path, Rules::default(), Access::Private, &FIRST)
    }

    fn write(set: &mut OutputSet, name: &str, text: &str) {
        fs::write(set.stage(name, Kind::AuditJson).unwrap(), format!("{AUDIT}{text}}}")).unwrap();
    }

    #[test]
    fn a_failed_commit_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a/out");
        let mut set = create(&target).unwrap();
        write(&mut set, "audit.json", "1");
        write(&mut set, "other.json", "1");
        fs::write(target.join("other.json"), "mine").unwrap();
        assert!(set.commit().is_err());
        assert_eq!(entries(&target), ["other.json"]);
        let error = create(&target.join("other.json")).unwrap_err().to_string();
        assert!(error.ends_with("expected a folder, or nothing, found a file"), "{error}");
        let mut set = create(&target).unwrap();
        write(&mut set, "audit.json", "1");
        set.commit().unwrap();
        // A file that appeared after the first checks, and one that was staged and never written.
        for last in ["other.json", "missing.json"] {
            let mut set = create(&target).unwrap();
            write(&mut set, "new.json", "2");
            write(&mut set, "audit.json", "2");
            set.files.push((last.into(), Kind::AuditJson));
            assert!(set.replace_all().is_err());
        }
        assert_eq!(fs::read_to_string(target.join("audit.json")).unwrap(), format!("{AUDIT}1}}"));
        assert_eq!(fs::read(target.join("other.json")).unwrap(), b"mine");
        assert_eq!(entries(&target), ["audit.json", "other.json"]);
    }

    #[test]
    fn without_commit_nothing_is_left_and_what_was_removed_does_not_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let mut set = create(&folder.path().join("a/b/out")).unwrap();
        write(&mut set, "audit.json", "1");
        write(&mut set, "x/y/audit.json", "1");
        fs::remove_dir_all(set.staging.path()).unwrap();
        assert!(set.stage("x/y/other.json", Kind::AuditJson).is_err());
        drop(set);
        assert_eq!(entries(folder.path()), [""; 0]);
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_was_there_stays_as_readable_as_it_was() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).unwrap();
        let mut set = create(folder.path()).unwrap();
        write(&mut set, "clouds/x.json", "1");
        set.commit().unwrap();
        assert_eq!(mode(folder.path()), 0o755);
        assert_eq!(mode(&folder.path().join("clouds")), 0o700);
    }
}
