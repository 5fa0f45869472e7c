//! Several outputs in one folder that may hold anything else.

use std::fs;
use std::path::{Path, PathBuf};

use super::partial::{MadeFolders, Partial, sweep, undisturbed};
use super::{Access, Kind, Rules, resolved};
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
        let target = resolved(path).map_err(failed)?;
        if target.exists() && !target.is_dir() {
            return Err(Error::new(path, "", "a folder, or nothing", "a file"));
        }
        for (name, kind) in first {
            let place = target.join(name);
            if place.exists() || place.is_symlink() {
                rules.check(&place, *kind)?;
            }
        }
        let made = MadeFolders::make(&target, access).map_err(failed)?;
        sweep(&target);
        let staging = Partial::folder(&target).map_err(failed)?;
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
        if let Some(folder) = staged.parent() {
            fs::create_dir_all(folder).map_err(|source| Error::write(&self.path, source))?;
        }
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
        undisturbed(|| self.exchange(&earlier)).map_err(failed)?;
        for made in self.made.drain(..) {
            made.keep();
        }
        Ok(())
    }

    /// Renames all files; the earlier ones get second names in `earlier` meanwhile.
    fn exchange(&self, earlier: &Path) -> std::io::Result<()> {
        let kept = |at: usize| earlier.join(at.to_string());
        let mut done: Vec<(PathBuf, bool)> = Vec::new();
        for (at, (name, _)) in self.files.iter().enumerate() {
            let place = resolved(&self.target.join(name))?;
            let is_new = !place.exists();
            // A second name, not a move: at no time is there nothing at the place.
            let _ = fs::hard_link(&place, kept(at));
            let Err(error) = fs::rename(self.staging.path().join(name), &place) else {
                done.push((place, is_new));
                continue;
            };
            for (before, (place, is_new)) in done.iter().enumerate() {
                // Best effort: the error that is told is the first one.
                let _ = match is_new {
                    true => fs::remove_file(place),
                    false => fs::rename(kept(before), place),
                };
            }
            return Err(error);
        }
        Ok(())
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
