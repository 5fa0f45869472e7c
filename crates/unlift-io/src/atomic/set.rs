//! Several outputs in one folder that may hold anything else.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::unfinished::{MARK, Unfinished, live, sweep};
use super::{Access, Kind, Rules, alone_in, flush_names, parent_of, resolved};
use crate::Error;

/// Files of a folder that are built apart and take their places together on [`commit`](Self::commit).
///
/// Only these files are written and replaced, by name; nothing is deleted. Every check comes before the first
/// rename, and each file is whole before that. Dropped without a commit, it leaves no trace.
#[derive(Debug)]
pub struct OutputSet {
    /// The folder as it was given, for errors.
    path: PathBuf,
    /// The same, links followed.
    target: PathBuf,
    rules: Rules,
    access: Access,
    files: Vec<(PathBuf, Kind)>,
    // Removed on drop, before the folders around it.
    staging: Unfinished,
    made: Unfinished,
}

/// A file that was replaced: its place, and what stood there before.
type Replaced = (PathBuf, Option<PathBuf>);

impl OutputSet {
    /// Starts outputs in the folder `path`, which is made if it is missing (with its parents, by `access`);
    /// `first` are files that will be among them: refused now, before hours of work, not then.
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
        // Asked once: another program may make or remove the folder meanwhile.
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
                // Another run that gives up removes the folder that it had made, if it is still empty.
                Err(error) if error.kind() == io::ErrorKind::NotFound && tries < 10 => {}
                begun => break begun,
            }
        };
        let (made, staging) = begun.map_err(|source| Error::write(path, source))?;
        let (path, files) = (path.to_owned(), Vec::new());
        Ok(Self { path, target, rules, access, files, staging, made })
    }

    /// Where to write the file that will be `name` (with slashes, in folders below), of this kind.
    ///
    /// # Errors
    /// When [`Rules::check`] refuses the place, or a folder for it cannot be made.
    pub fn stage(&mut self, name: &str, kind: Kind) -> Result<PathBuf, Error> {
        let name = PathBuf::from(name);
        self.rules.check_in(&self.target, &name, kind)?;
        // The partial folder itself is never made again: what an interrupt has just removed must not come back.
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

    /// Puts every file in its place, in the order in which they were asked for.
    ///
    /// # Errors
    /// When something else has come to stand at a place meanwhile, or a rename fails. The earlier files are put
    /// back then.
    pub fn commit(mut self) -> Result<(), Error> {
        for (name, kind) in &self.files {
            self.rules.check_in(&self.target, name, *kind)?;
            let made = self.made.make_folders(parent_of(&self.target.join(name)), self.access);
            made.map_err(|source| Error::write(&self.path, source))?;
        }
        // Files of two runs are not mixed.
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

    /// Puts all files in their places, or none of them.
    fn replace_all(&self) -> Result<(), Error> {
        let _undisturbed = live();
        let mut done = Vec::new();
        for at in 0..self.files.len() {
            if let Err(error) = self.replace(at, &mut done) {
                for (place, earlier) in done.into_iter().rev() {
                    // Best effort: the error that is told is the one that led here.
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

    /// Puts one file in its place. What stands there gets a second name first, so that at no time nothing stands there.
    fn replace(&self, at: usize, done: &mut Vec<Replaced>) -> Result<(), Error> {
        let (name, kind) = &self.files[at];
        let failed = |source| Error::write(self.path.join(name), source);
        let staged = self.staging.path().join(name);
        let place = resolved(&self.target.join(name))?;
        if !place.exists() {
            match fs::hard_link(&staged, &place) {
                // It has come there meanwhile.
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
        // Links are not known to every disk, nor allowed for every file of others.
        let kept =
            fs::hard_link(&place, &earlier).or_else(|_| fs::copy(&place, &earlier).map(drop));
        kept.map_err(failed)?;
        // What was checked may have been another file.
        let checked = self.rules.check(&earlier, *kind);
        checked.map_err(|error| error.at(self.path.join(name)))?;
        fs::rename(&staged, &place).map_err(failed)?;
        done.push((place, Some(earlier)));
        Ok(())
    }
}

/// Makes the folder where it is missing, sweeps it, and makes one in it to build in.
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
        // Somebody's file has come meanwhile.
        fs::write(target.join("other.json"), "mine").unwrap();
        assert!(set.commit().is_err());
        assert_eq!(entries(&target), ["other.json"]);
        let error = create(&target.join("other.json")).unwrap_err().to_string();
        assert!(error.ends_with("expected a folder, or nothing, found a file"), "{error}");
        let mut set = create(&target).unwrap();
        write(&mut set, "audit.json", "1");
        set.commit().unwrap();
        // A file that came after the first checks, and one that was asked for and never written.
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
