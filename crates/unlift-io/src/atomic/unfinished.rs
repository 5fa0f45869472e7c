//! Temporary files and folders: removed by their owner, on a signal, or by a later run.
//!
//! A temporary file is beside its place, as `.NAME.unlift-xxxxxx.partial`. Its process holds a lock
//! on it (`flock`), which the system releases when the process ends. So a later run can remove the
//! files of dead processes only, on all machines that share the disk and its locks.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::{Access, flush_names, parent_of};

const SIGN: &str = ".unlift-";
const ENDING: &str = ".partial";
const RANDOM: usize = 6;

/// A file in every temporary folder, created first and removed last, which proves that unlift made
/// the folder.
pub(super) const MARK: &str = ".unlift-unfinished";

/// The temporary files of this process, and the folders created for them, in order of creation.
///
/// Code that creates, renames or removes one holds the lock, so that [`abandon`] finds complete
/// steps only.
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

pub(super) fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    // A panic cannot leave a list of paths in a bad state.
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all temporary files of this process and blocks new ones. Call it when the process is
/// about to end.
pub fn abandon() {
    let mut live = live();
    for path in live.drain(..).rev() {
        remove(&path);
    }
    // Never unlocked: a thread that still runs must not start another file.
    std::mem::forget(live);
}

/// Removes the temporary files in `folder` that dead processes left.
///
/// A file is recognized by its name and the missing lock, a folder also by its mark.
pub fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        // Skips links, which lead elsewhere, and pipes, which block when they are opened.
        let may_be = entry.file_type().is_ok_and(|kind| kind.is_file() || kind.is_dir());
        if may_be && is_partial_name(&path) {
            // Only Unix can lock folders. Elsewhere nothing is swept.
            let file = File::open(&path).ok();
            let dead = file.filter(|file| cfg!(unix) && file.try_lock().is_ok());
            // The lock is held until the path is removed. A process that has just created it waits
            // for the lock and starts again.
            if let Some(_locked) = dead {
                remove(&path);
            }
        }
    }
}

/// Removes a temporary file, a temporary folder with its content, or an empty folder.
fn remove(path: &Path) {
    let is_ours = is_partial_name(path);
    let is_folder = fs::symlink_metadata(path).is_ok_and(|found| found.is_dir());
    if is_ours && is_folder && path.join(MARK).is_file() {
        // Another thread may still write to it.
        for _ in 0..10 {
            if remove_marked(path).is_ok() {
                return;
            }
        }
    } else if is_folder {
        let _ = fs::remove_dir(path);
    } else if is_ours {
        let _ = fs::remove_file(path);
    }
}

/// Removes the mark last, so that a later run can continue after a kill.
fn remove_marked(folder: &Path) -> io::Result<()> {
    let entries: Vec<_> = fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    for entry in entries.iter().filter(|entry| entry.file_name() != MARK) {
        match entry.file_type()?.is_dir() {
            true => fs::remove_dir_all(entry.path())?,
            false => fs::remove_file(entry.path())?,
        }
    }
    fs::remove_file(folder.join(MARK))?;
    fs::remove_dir(folder)
}

fn is_partial_name(path: &Path) -> bool {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return false };
    let random = name.strip_suffix(ENDING).and_then(|name| name.rsplit_once(SIGN));
    name.starts_with('.')
        && random.is_some_and(|(_, random)| {
            random.len() == RANDOM && random.bytes().all(|byte| byte.is_ascii_alphanumeric())
        })
}

/// Removes temporary folders from a path, for errors.
pub(crate) fn final_place(path: PathBuf) -> PathBuf {
    if !path.ancestors().any(is_partial_name) {
        return path;
    }
    path.components().filter(|part| !is_partial_name(part.as_ref())).collect()
}

/// Temporary paths that are removed on drop, unless they are [kept](Self::keep).
#[derive(Debug, Default)]
pub(super) struct Unfinished {
    paths: Vec<PathBuf>,
    _locked: Option<File>,
}

impl Unfinished {
    /// Creates a temporary file beside `target`.
    pub fn file(target: &Path, access: Access) -> io::Result<(Self, File)> {
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        make(parent_of(target), &name, |path| {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create_new(true);
            #[cfg(unix)]
            if access == Access::Private {
                std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
            }
            options.open(path)
        })
    }

    /// Creates a private temporary folder in `folder`.
    pub fn folder(folder: &Path) -> io::Result<Self> {
        let made = make(folder, "output", |path| {
            make_folder(path, Access::Private)?;
            let mark = File::create_new(path.join(MARK));
            if mark.is_err() {
                let _ = fs::remove_dir(path);
            }
            mark
        });
        made.map(|(folder, _)| folder)
    }

    pub fn path(&self) -> &Path {
        &self.paths[0]
    }

    /// Creates `folder` and its missing parents. Those that are empty are removed on drop.
    pub fn make_folders(&mut self, folder: &Path, access: Access) -> io::Result<()> {
        let is_missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        let missing: Vec<&Path> = folder.ancestors().take_while(is_missing).collect();
        for path in missing.into_iter().rev() {
            let mut live = live();
            match make_folder(path, access) {
                Ok(()) => {
                    live.push(path.to_owned());
                    self.paths.push(path.to_owned());
                }
                // Another program created it, so it must not be removed.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    pub fn keep(mut self) {
        let kept = std::mem::take(&mut self.paths);
        live().retain(|path| !kept.contains(path));
        kept.iter().for_each(|path| flush_names(parent_of(path)));
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.paths.is_empty() {
            let mut live = live();
            self.paths.iter().rev().for_each(|path| remove(path));
            live.retain(|path| !self.paths.contains(path));
        }
    }
}

/// Creates and locks a temporary file or folder for `name` in `folder`.
fn make(
    folder: &Path,
    name: &str,
    mut new: impl FnMut(&Path) -> io::Result<File>,
) -> io::Result<(Unfinished, File)> {
    // File names have at most 255 bytes.
    let prefix = format!(".{}{SIGN}", name.chars().take(40).collect::<String>());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(ENDING).rand_bytes(RANDOM);
    let mut live = live();
    loop {
        let (file, path) = builder.make_in(folder, &mut new)?.into_parts();
        let path = path.keep().map_err(|refused| refused.error)?;
        // Errors show the path as the user wrote it; tempfile makes it absolute.
        let path = path.file_name().map_or(path.clone(), |name| folder.join(name));
        let to_lock = if cfg!(unix) { File::open(&path).ok() } else { None };
        let _locked = to_lock.filter(|file| file.lock().is_ok());
        // Another run may have swept it before it was locked.
        if path.exists() {
            live.push(path.clone());
            return Ok((Unfinished { paths: vec![path], _locked }, file));
        }
    }
}

fn make_folder(path: &Path, access: Access) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    #[cfg(unix)]
    if access == Access::Private {
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    }
    builder.create(path)
}

#[cfg(test)]
mod tests {
    use super::super::entries;
    use super::*;

    #[test]
    fn only_what_dead_processes_left_is_swept() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let (living, _) = Unfinished::file(&at("a.bin"), Access::Usual).unwrap();
        let busy = Unfinished::folder(folder.path()).unwrap();
        let mut others = vec![
            ".a.bin.abcdef.partial",
            ".a.bin.unlift-abc+ef.partial",
            ".a.bin.unlift-abcde.partial",
            ".a.bin.unlift-abcdef.partial~",
            // A folder without the mark belongs to another program.
            ".output.unlift-ABC125.partial",
            "a.bin.unlift-abcdef.partial",
        ];
        for name in &others {
            fs::create_dir(at(name)).unwrap();
            fs::write(at(name).join("thesis.txt"), "mine").unwrap();
        }
        fs::write(at(".a.bin.unlift-abcdef.partial"), "of a dead process").unwrap();
        // Leftovers of a process killed in the middle, and right after the first step.
        let dead = at(".output.unlift-ABC123.partial");
        fs::create_dir_all(dead.join("a/b")).unwrap();
        for name in [MARK, "a/truth", "truth"] {
            fs::write(dead.join(name), "of a dead process").unwrap();
        }
        fs::create_dir(at(".output.unlift-ABC124.partial")).unwrap();
        #[cfg(unix)]
        {
            // Links are not followed, and pipes do not block.
            fs::create_dir(at("precious")).unwrap();
            fs::write(at("precious").join(MARK), "mine").unwrap();
            let link = |path| std::os::unix::fs::symlink(at("precious"), path).unwrap();
            link(dead.join("link"));
            link(at(".output.unlift-link00.partial"));
            let pipe = at(".output.unlift-pipe00.partial");
            assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
            others.extend([
                ".output.unlift-link00.partial",
                ".output.unlift-pipe00.partial",
                "precious",
            ]);
        }
        sweep(folder.path());
        assert!(living.path().is_file() && busy.path().join(MARK).is_file());
        drop((living, busy));
        others.sort_unstable();
        assert_eq!(entries(folder.path()), others);
        #[cfg(unix)]
        assert_eq!(entries(&at("precious")), [MARK]);
    }

    #[test]
    fn what_has_replaced_a_folder_of_ours_is_somebodys() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let mut made = Unfinished::default();
        made.make_folders(&out, Access::Usual).unwrap();
        fs::remove_dir(&out).unwrap();
        fs::write(&out, "mine").unwrap();
        drop(made);
        assert_eq!(fs::read(&out).unwrap(), b"mine");
    }

    #[test]
    fn errors_name_the_final_place() {
        let of = |path: &str| final_place(path.into()).to_string_lossy().into_owned();
        assert_eq!(of("out/.output.unlift-abC123.partial/a/truth.parquet"), "out/a/truth.parquet");
        for path in ["./out/a", "../a.partial/b", ".output.unlift-abc.partial/b"] {
            assert_eq!(of(path), path);
        }
    }
}
