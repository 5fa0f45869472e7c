//! How an unfinished output goes away: by its owner, on a signal, or by a later run.
//!
//! A partial file or folder is `.NAME.unlift-xxxxxx.partial` beside its place. The process that makes it keeps a
//! lock on it (`flock`), which the system takes back when that process ends in any way: so a later run can tell
//! what a dead one left from what a living one is at, on any machine that shares the disk and locks.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::removal::{MARK, remove_marked};
use super::{Access, flush_names, parent_of};
use crate::Error;
use crate::unfinished::{RANDOM, around, is_partial_name};

/// What this process is building, and the folders that it made for it, in order. Whoever makes, renames or removes
/// one holds the lock, so that [`abandon`] meets nothing half done.
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths is in order whatever panicked.
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes everything that this process has not finished, and lets nothing new begin: the process is about to end.
///
/// What was put in its place is whole and stays.
pub fn abandon() {
    let mut live = live();
    for path in live.drain(..).rev() {
        remove(&path);
    }
    // Kept for good: a thread that works on must not begin another file.
    std::mem::forget(live);
}

/// Files and folders of ours, or a folder that was made for an output: that one only when it is empty, and nothing that
/// has come to stand in its place.
fn remove(path: &Path) {
    let is_ours = is_partial_name(path);
    if is_ours && path.join(MARK).is_file() {
        // Another thread may be writing in it.
        for _ in 0..10 {
            if remove_marked(path).is_ok() {
                return;
            }
        }
    } else if path.is_dir() {
        let _ = fs::remove_dir(path);
    } else if is_ours {
        let _ = fs::remove_file(path);
    }
}

/// Removes what dead processes left unfinished in `folder`; what a living one works on stays.
///
/// By name and by lock, a folder that is not empty also by the mark in it: anything else is none of ours. What cannot be
/// removed is in nobody's way.
pub fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        // Neither links, which lead elsewhere, nor pipes, which would be waited for.
        let may_be = entry.file_type().is_ok_and(|kind| kind.is_file() || kind.is_dir());
        // The lock is held until it is gone: whoever has just made it, and not locked it yet, waits and begins
        // anew.
        if may_be
            && is_partial_name(&path)
            && let Some(_locked) = lock_of_dead(&path)
        {
            remove(&path);
        }
    }
}

#[cfg(unix)]
fn lock_of_dead(path: &Path) -> Option<File> {
    File::open(path).ok().filter(|file| file.try_lock().is_ok())
}

/// Folders cannot be locked everywhere: nothing is swept.
#[cfg(not(unix))]
fn lock_of_dead(_: &Path) -> Option<File> {
    None
}

/// A file or folder that is gone when dropped, unless it was put in its place.
#[derive(Debug)]
pub(super) struct Partial {
    path: PathBuf,
    /// Holds the lock.
    _locked: Option<File>,
}

impl Partial {
    /// A new file beside `target`, and the file to write to.
    pub fn file(target: &Path, access: Access) -> io::Result<(Self, File)> {
        make(parent_of(target), target, |path| {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create_new(true);
            #[cfg(unix)]
            if access == Access::Private {
                std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
            }
            let file = options.open(path)?;
            Ok((file.try_clone().ok(), file))
        })
    }

    /// A new folder in `folder`, of which only its owner may see what is built there.
    pub fn folder(folder: &Path) -> io::Result<Self> {
        let made = make(folder, Path::new("output"), |path| {
            make_folder(path, Access::Private)?;
            let locked = File::open(path).ok();
            match File::create_new(path.join(MARK)) {
                Err(error) if path.exists() => {
                    let _ = fs::remove_dir(path);
                    Err(error)
                }
                // Made; or another process swept the folder away at this moment, and `make` begins anew.
                _ => Ok((locked, ())),
            }
        });
        made.map(|(partial, ())| partial)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the folders that the file `name` within needs. Never the partial folder itself, nor those around it: what an
    /// interrupt has just removed must not come back.
    pub fn make_within(&self, name: &Path) -> io::Result<()> {
        let mut folder = self.path.clone();
        for part in name.parent().into_iter().flat_map(Path::components) {
            folder.push(part);
            match fs::create_dir(&folder) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                made => made?,
            }
        }
        Ok(())
    }

    /// Renames it to `target`.
    pub fn persist(mut self, target: &Path) -> io::Result<()> {
        let mut live = live();
        fs::rename(&self.path, target)?;
        live.retain(|path| *path != self.path);
        self.path.clear();
        drop(live);
        flush_names(parent_of(target));
        Ok(())
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if self.path.as_os_str().is_empty() {
            return;
        }
        let mut live = live();
        remove(&self.path);
        live.retain(|path| *path != self.path);
    }
}

fn make<T>(
    folder: &Path,
    target: &Path,
    mut new: impl FnMut(&Path) -> io::Result<(Option<File>, T)>,
) -> io::Result<(Partial, T)> {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let (prefix, suffix) = around(&name);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(suffix).rand_bytes(RANDOM);
    let mut live = live();
    loop {
        let ((file, made), path) = builder.make_in(folder, &mut new)?.into_parts();
        let path = path.keep().map_err(|refused| refused.error)?;
        // As the user wrote it, for errors; tempfile makes it absolute.
        let path = path.file_name().map_or(path.clone(), |name| folder.join(name));
        // Where there are no locks nothing is swept.
        let locked = file.filter(|file| file.lock().is_ok());
        // Between being made and being locked it looks dead, and may have been swept.
        if path.exists() {
            live.push(path.clone());
            return Ok((Partial { path, _locked: locked }, made));
        }
    }
}

/// Makes a folder.
fn make_folder(path: &Path, access: Access) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    #[cfg(unix)]
    if access == Access::Private {
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    }
    builder.create(path)
}

/// A folder that was made for an output, with its parents: those that are empty are gone when this is dropped.
#[derive(Debug)]
pub(super) struct MadeFolders(Vec<PathBuf>);

impl MadeFolders {
    /// Makes `folder` and its missing parents.
    pub fn make(folder: &Path, access: Access) -> io::Result<Self> {
        let missing: Vec<&Path> = folder
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
            .collect();
        let mut made = Self(Vec::new());
        for path in missing.into_iter().rev() {
            let mut live = live();
            match make_folder(path, access) {
                Ok(()) => {
                    live.push(path.to_owned());
                    made.0.push(path.to_owned());
                }
                // Another program made it meanwhile: it is not ours to remove.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => {
                    drop(live);
                    return Err(error);
                }
            }
        }
        Ok(made)
    }

    /// They stay.
    pub fn keep(mut self) {
        let kept = std::mem::take(&mut self.0);
        live().retain(|path| !kept.contains(path));
        kept.iter().for_each(|path| flush_names(parent_of(path)));
    }
}

impl Drop for MadeFolders {
    fn drop(&mut self) {
        let mut live = live();
        for path in self.0.iter().rev() {
            // Only when empty: somebody else may have put something there meanwhile.
            let _ = fs::remove_dir(path);
        }
        live.retain(|path| !self.0.contains(path));
    }
}

/// Makes `folder` and its missing parents for outputs of their own, to stay.
///
/// # Errors
/// When one cannot be made.
pub fn make_folders(folder: &Path, access: Access) -> Result<(), Error> {
    let made = MadeFolders::make(folder, access).map_err(|source| Error::write(folder, source))?;
    made.keep();
    Ok(())
}

/// Runs `step` so that [`abandon`] comes before or after it.
pub(super) fn undisturbed<T>(step: impl FnOnce() -> T) -> T {
    let _live = live();
    step()
}

#[cfg(test)]
mod tests {
    use super::super::entries;
    use super::*;

    #[test]
    fn only_our_names_of_dead_processes_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let (living, _file) = Partial::file(&at("a.bin"), Access::Usual).unwrap();
        let busy = Partial::folder(folder.path()).unwrap();
        let others = [
            ".a.bin.unlift-abcde.partial",
            ".a.bin.unlift-abc+ef.partial",
            ".a.bin.abcdef.partial",
            "a.bin.unlift-abcdef.partial",
            ".a.bin.unlift-abcdef.partial~",
        ];
        for name in others {
            fs::write(at(name), "mine").unwrap();
        }
        fs::write(at(".a.bin.unlift-abcdef.partial"), "of a dead process").unwrap();
        // Killed in the middle, and right after the first step.
        fs::create_dir(at(".output.unlift-ABC123.partial")).unwrap();
        fs::write(at(".output.unlift-ABC123.partial").join(MARK), "").unwrap();
        fs::write(at(".output.unlift-ABC123.partial/truth"), "of a dead process").unwrap();
        fs::create_dir(at(".output.unlift-ABC124.partial")).unwrap();
        sweep(folder.path());
        let name = |of: &Partial| of.path().file_name().unwrap().to_str().unwrap().to_owned();
        let mut kept: Vec<String> = others.map(str::to_owned).to_vec();
        kept.extend([name(&living), name(&busy)]);
        kept.sort();
        assert_eq!(entries(folder.path()), kept);
        drop((living, busy));
        assert_eq!(entries(folder.path()).len(), others.len());
    }

    #[test]
    fn what_was_removed_does_not_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let partial = Partial::folder(folder.path()).unwrap();
        partial.make_within(Path::new("a/b/file")).unwrap();
        partial.make_within(Path::new("a/b/other")).unwrap();
        assert_eq!(entries(&partial.path().join("a")), ["b"]);
        remove(partial.path());
        assert!(partial.make_within(Path::new("a/b/file")).is_err());
        assert_eq!(entries(folder.path()), [""; 0]);
    }

    #[test]
    fn a_folder_without_our_mark_is_somebodys() {
        let folder = tempfile::tempdir().unwrap();
        let planted = folder.path().join(".output.unlift-ABC123.partial");
        fs::create_dir(&planted).unwrap();
        fs::write(planted.join("thesis.txt"), "mine").unwrap();
        sweep(folder.path());
        assert_eq!(fs::read(planted.join("thesis.txt")).unwrap(), b"mine");
    }

    #[test]
    fn what_has_replaced_a_folder_of_ours_is_somebodys() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let made = MadeFolders::make(&out, Access::Usual).unwrap();
        fs::remove_dir(&out).unwrap();
        fs::write(&out, "mine").unwrap();
        remove(&out);
        drop(made);
        assert_eq!(fs::read(&out).unwrap(), b"mine");
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_of_our_name_is_neither_waited_for_nor_removed() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join(".a.bin.unlift-abcdef.partial");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        sweep(folder.path());
        assert!(fs::symlink_metadata(&pipe).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_to_folders_are_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let precious = folder.path().join("precious");
        fs::create_dir(&precious).unwrap();
        fs::write(precious.join("a"), "mine").unwrap();
        fs::write(precious.join(MARK), "").unwrap();
        let link = folder.path().join(".output.unlift-ABC123.partial");
        std::os::unix::fs::symlink(&precious, link).unwrap();
        sweep(folder.path());
        assert_eq!(fs::read(precious.join("a")).unwrap(), b"mine");
    }
}
