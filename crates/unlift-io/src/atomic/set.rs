//! Several outputs in one folder that may hold anything else.

use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use super::partial::{MadeFolders, Partial, sweep, undisturbed};
use super::swap::Swapped;
use super::{Access, Kind, Rules, flush_names, parent_of, resolved};
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
    // Removed on drop, before the folders below.
    staging: Partial,
    made: Vec<MadeFolders>,
}

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
        let failed = |source| Error::write(path, source);
        let target = resolved(path)?;
        if target.exists() && !target.is_dir() {
            return Err(Error::new(path, "", "a folder, or nothing", "a file"));
        }
        for (name, kind) in first {
            let place = target.join(name);
            if place.exists() || place.is_symlink() {
                rules.check(&place, *kind)?;
            }
        }
        let (made, staging) = begin(&target, access).map_err(failed)?;
        let path = path.to_owned();
        Ok(Self { path, target, rules, access, files: Vec::new(), staging, made: vec![made] })
    }

    /// Where to write the file that will be `name` (with slashes, in folders below), of this kind.
    ///
    /// # Errors
    /// When [`Rules::check`] refuses the place, or a folder for it cannot be made.
    pub fn stage(&mut self, name: &str, kind: Kind) -> Result<PathBuf, Error> {
        self.check(Path::new(name), kind)?;
        let staged = self.staging.path().join(name);
        self.staging.make_within(Path::new(name)).map_err(|e| Error::write(&self.path, e))?;
        self.files.push((PathBuf::from(name), kind));
        Ok(staged)
    }

    fn check(&self, name: &Path, kind: Kind) -> Result<(), Error> {
        let place = self.target.join(name);
        if place.exists() || place.is_symlink() {
            self.rules.check(&place, kind)?;
        }
        Ok(())
    }

    /// Puts every file in its place, in the order in which they were asked for.
    ///
    /// # Errors
    /// When something else has come to stand at a place meanwhile, or a rename fails: the earlier files are put
    /// back then, where the disk knows links.
    pub fn commit(mut self) -> Result<(), Error> {
        let path = self.path.clone();
        let failed = |source| Error::write(&path, source);
        for (name, kind) in &self.files {
            self.check(name, *kind)?;
            if let Some(folder) = self.target.join(name).parent() {
                self.made.push(MadeFolders::make(folder, self.access).map_err(failed)?);
            }
        }
        let earlier = self.staging.path().join("earlier");
        fs::create_dir(&earlier).map_err(failed)?;
        // Files of two runs are not mixed.
        let alone = Alone::wait_in(&self.target);
        undisturbed(|| self.exchange(&earlier))?;
        drop(alone);
        let folders: BTreeSet<PathBuf> = self
            .files
            .iter()
            .map(|(name, _)| parent_of(&self.target.join(name)).to_owned())
            .collect();
        folders.iter().for_each(|folder| flush_names(folder));
        for made in self.made.drain(..) {
            made.keep();
        }
        Ok(())
    }

    /// Puts all files in their places, or none of them; the earlier ones are kept meanwhile, some in `earlier`.
    fn exchange(&self, earlier: &Path) -> Result<(), Error> {
        let mut done = Vec::new();
        for at in 0..self.files.len() {
            if let Err(error) = self.put(at, &earlier.join(at.to_string()), &mut done) {
                done.into_iter().rev().for_each(Swapped::undo);
                return Err(error);
            }
        }
        Ok(())
    }

    fn put(&self, at: usize, kept: &Path, done: &mut Vec<Swapped>) -> Result<(), Error> {
        let (name, kind) = &self.files[at];
        let place = resolved(&self.target.join(name))?;
        let swapped = Swapped::put(&self.staging.path().join(name), place, kept);
        let swapped = swapped.map_err(|source| Error::write(self.path.join(name), source))?;
        // What was checked may have been another file.
        let checked = swapped.earlier().map(|earlier| self.rules.check(earlier, *kind));
        done.push(swapped);
        match checked {
            Some(Err(error)) => Err(error.at(self.path.join(name))),
            _ => Ok(()),
        }
    }
}

/// The folder, made where it is missing and swept, and one in it to build in.
fn begin(target: &Path, access: Access) -> io::Result<(MadeFolders, Partial)> {
    let mut tries = 0;
    loop {
        let begun = MadeFolders::make(target, access).and_then(|made| {
            sweep(target);
            Ok((made, Partial::folder(target)?))
        });
        tries += 1;
        match begun {
            // Another run that gives up removes the folder that it had made, if it is still empty.
            Err(error) if error.kind() == io::ErrorKind::NotFound && tries < 10 => {}
            begun => return begun,
        }
    }
}

/// Holds a lock (`flock`) on a folder, for the moment in which files take their places there, or others that are about them do.
#[derive(Debug)]
pub struct Alone(#[expect(dead_code, reason = "held")] Option<File>);

impl Alone {
    /// Waits for other runs that are at it, which takes no time that anybody notices. Where folders cannot be locked,
    /// or a lock is held for seconds, as by `flock(1)` around a command, it goes on without.
    pub fn wait_in(folder: &Path) -> Self {
        const PATIENCE: Duration = Duration::from_secs(5);
        let started = Instant::now();
        let Ok(file) = File::open(folder) else { return Self(None) };
        loop {
            match file.try_lock() {
                Ok(()) => return Self(Some(file)),
                Err(TryLockError::WouldBlock) if started.elapsed() < PATIENCE => {
                    thread::sleep(Duration::from_millis(1));
                }
                Err(_) => return Self(None),
            }
        }
    }
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
    fn only_its_own_files_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out");
        fs::create_dir_all(target.join("src")).unwrap();
        fs::write(target.join("src/app.ts"), "mine").unwrap();
        for text in ["1", "2"] {
            let mut set = create(&target).unwrap();
            write(&mut set, "audit.json", text);
            write(&mut set, &format!("below/{text}.json"), text);
            set.commit().unwrap();
        }
        assert_eq!(entries(&target), ["audit.json", "below", "src"]);
        assert_eq!(entries(&target.join("below")), ["1.json", "2.json"]);
        assert_eq!(fs::read(target.join("src/app.ts")).unwrap(), b"mine");
        assert_eq!(fs::read_to_string(target.join("audit.json")).unwrap(), format!("{AUDIT}2}}"));
    }

    #[test]
    fn a_strangers_audit_json_is_refused_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        for text in ["", "{}", "{\"auditReportVersion\": 2}"] {
            fs::write(folder.path().join("audit.json"), text).unwrap();
            assert!(create(folder.path()).is_err());
            assert_eq!(fs::read_to_string(folder.path().join("audit.json")).unwrap(), text);
        }
        assert_eq!(entries(folder.path()), ["audit.json"]);
    }

    #[test]
    fn what_came_to_stand_there_meanwhile_stops_all_files() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a/out");
        let mut set = create(&target).unwrap();
        write(&mut set, "audit.json", "1");
        write(&mut set, "other.json", "1");
        fs::write(target.join("other.json"), "mine").unwrap();
        assert!(set.commit().is_err());
        assert_eq!(entries(&target), ["other.json"]);
    }

    #[test]
    fn a_failed_rename_puts_the_earlier_files_back() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out");
        let mut set = create(&target).unwrap();
        write(&mut set, "audit.json", "1");
        set.commit().unwrap();
        let mut set = create(&target).unwrap();
        write(&mut set, "audit.json", "2");
        // Asked for and never written.
        set.stage("other.json", Kind::AuditJson).unwrap();
        assert!(set.commit().is_err());
        assert_eq!(fs::read_to_string(target.join("audit.json")).unwrap(), format!("{AUDIT}1}}"));
        assert_eq!(entries(&target), ["audit.json"]);
    }

    #[test]
    fn without_commit_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let mut set = create(&folder.path().join("a/b/out")).unwrap();
        write(&mut set, "audit.json", "1");
        drop(set);
        assert_eq!(entries(folder.path()), [""; 0]);
    }

    #[test]
    fn a_file_is_no_folder() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("notes.txt");
        fs::write(&file, "mine").unwrap();
        let error = create(&file).unwrap_err().to_string();
        assert!(error.ends_with("expected a folder, or nothing, found a file"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn folders_that_are_made_are_private_and_others_stay_as_they_are() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let target = folder.path().join("a/out");
        let mut set = create(&target).unwrap();
        write(&mut set, "clouds/x.json", "1");
        set.commit().unwrap();
        for made in ["a", "a/out", "a/out/clouds"] {
            assert_eq!(mode(&folder.path().join(made)), 0o700, "{made}");
        }
        fs::set_permissions(&target, fs::Permissions::from_mode(0o755)).unwrap();
        let mut set = create(&target).unwrap();
        write(&mut set, "audit.json", "1");
        set.commit().unwrap();
        assert_eq!(mode(&target), 0o755);
    }
}
