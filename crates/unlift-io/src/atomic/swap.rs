//! One file to its place, with a way back.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A file that was put in its place.
#[derive(Debug)]
pub(super) struct Swapped {
    place: PathBuf,
    /// Where what stood there is now.
    earlier: Option<PathBuf>,
}

impl Swapped {
    /// Puts `staged` at `place`; what stands there goes to where `staged` was or gets the second name `kept`, as the
    /// system can, and at no time is there nothing.
    ///
    /// # Errors
    /// When the disk fails, or what stands there cannot be kept. Nothing is changed then.
    pub fn put(staged: &Path, place: PathBuf, kept: &Path) -> io::Result<Self> {
        if fs::symlink_metadata(&place).is_err() {
            system::place(staged, &place)?;
            return Ok(Self { place, earlier: None });
        }
        let earlier = if system::exchange(staged, &place)? {
            staged.to_owned()
        } else {
            // Links are not known to every disk, nor allowed for every file of others.
            fs::hard_link(&place, kept).or_else(|_| fs::copy(&place, kept).map(drop))?;
            fs::rename(staged, &place)?;
            kept.to_owned()
        };
        Ok(Self { place, earlier: Some(earlier) })
    }

    /// Where what stood there is now.
    pub fn earlier(&self) -> Option<&Path> {
        self.earlier.as_deref()
    }

    /// Puts back what stood there.
    pub fn undo(self) {
        // Best effort: the error that is told is the one that led here.
        let _ = match self.earlier {
            Some(earlier) => fs::rename(earlier, self.place),
            None => fs::remove_file(self.place),
        };
    }
}

#[cfg(target_os = "linux")]
mod system {
    use std::fs;
    use std::io;
    use std::path::Path;

    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;

    /// Renames where nothing stands: what has come there meanwhile is an error, not lost.
    pub fn place(from: &Path, to: &Path) -> io::Result<()> {
        match renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE) {
            Err(error) if is_unknown(error) => fs::rename(from, to),
            result => Ok(result?),
        }
    }

    /// Gives two files each other's names at once; false where that cannot be done.
    pub fn exchange(a: &Path, b: &Path) -> io::Result<bool> {
        match renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE) {
            Err(error) if is_unknown(error) => Ok(false),
            result => Ok(result.map(|()| true)?),
        }
    }

    /// Of the kernel, or of the disk.
    fn is_unknown(error: Errno) -> bool {
        [Errno::NOSYS, Errno::INVAL, Errno::NOTSUP].contains(&error)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::fs;
    use std::io;
    use std::path::Path;

    pub fn place(from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    pub fn exchange(_: &Path, _: &Path) -> io::Result<bool> {
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stood_there_comes_back_where_no_link_can_be_made() {
        let folder = tempfile::tempdir().unwrap();
        let [staged, place] = ["staged", "place"].map(|name| folder.path().join(name));
        let read = |path: &Path| fs::read_to_string(path).unwrap();
        fs::write(&place, "old").unwrap();
        fs::write(&staged, "new").unwrap();
        let kept = if cfg!(target_os = "linux") { "missing/kept" } else { "kept" };
        let swapped = Swapped::put(&staged, place.clone(), &folder.path().join(kept)).unwrap();
        assert_eq!((read(&place), read(swapped.earlier().unwrap())), ("new".into(), "old".into()));
        swapped.undo();
        assert_eq!(read(&place), "old");
        fs::write(&staged, "new").unwrap();
        fs::remove_file(&place).unwrap();
        Swapped::put(&staged, place.clone(), &folder.path().join(kept)).unwrap().undo();
        assert!(!place.exists() && !staged.exists());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_has_come_meanwhile_is_not_lost() {
        let folder = tempfile::tempdir().unwrap();
        let [staged, place] = ["staged", "place"].map(|name| folder.path().join(name));
        fs::write(&staged, "new").unwrap();
        fs::write(&place, "mine").unwrap();
        assert!(system::place(&staged, &place).is_err());
        assert_eq!(fs::read_to_string(place).unwrap(), "mine");
    }
}
