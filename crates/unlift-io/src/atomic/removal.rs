//! A folder of ours goes away: its mark last, so that what is killed on the way is known by a later run.

use std::io;
use std::path::Path;

/// A file in every partial folder, the first one and the last: what has it is ours, with all that is in it.
pub(super) const MARK: &str = ".unlift-unfinished";

/// Removes the folder `path` with all that is in it. Links are removed, not followed, whoever puts them there
/// meanwhile.
pub(super) fn remove_marked(path: &Path) -> io::Result<()> {
    system::remove_marked(path)
}

#[cfg(target_os = "linux")]
mod system {
    use std::ffi::CString;
    use std::fs;
    use std::io;
    use std::os::fd::BorrowedFd;
    use std::path::Path;

    use rustix::fs::{AtFlags, CWD, Dir, Mode, OFlags, openat, unlinkat};
    use rustix::io::Errno;

    use super::MARK;

    pub fn remove_marked(path: &Path) -> io::Result<()> {
        let mut folder = Dir::new(openat(CWD, path, FOLDER, Mode::empty())?)?;
        empty(&mut folder, MARK.as_bytes())?;
        match unlinkat(folder.fd()?, MARK, AtFlags::empty()) {
            // An earlier try came so far.
            Ok(()) | Err(Errno::NOENT) => fs::remove_dir(path),
            Err(error) => Err(error.into()),
        }
    }

    const FOLDER: OFlags =
        OFlags::DIRECTORY.union(OFlags::NOFOLLOW).union(OFlags::RDONLY).union(OFlags::CLOEXEC);

    /// Removes what is in a folder, but for `kept`. No more files are open than folders lie in each other: this may be
    /// what a run does that has come to its limit.
    fn empty(folder: &mut Dir, kept: &[u8]) -> Result<(), Errno> {
        let names = folder.by_ref().map(|entry| Ok(entry?.file_name().to_owned()));
        let names: Vec<CString> = names.collect::<Result<_, Errno>>()?;
        for name in names {
            if ![b".".as_slice(), b"..", kept].contains(&name.as_bytes()) {
                remove(folder.fd()?, &name)?;
            }
        }
        Ok(())
    }

    fn remove(folder: BorrowedFd<'_>, name: &CString) -> Result<(), Errno> {
        match unlinkat(folder, name, AtFlags::empty()) {
            Err(Errno::ISDIR | Errno::PERM) => {}
            done => return done,
        }
        match unlinkat(folder, name, AtFlags::REMOVEDIR) {
            Err(Errno::NOTEMPTY | Errno::EXIST) => {}
            done => return done,
        }
        empty(&mut Dir::new(openat(folder, name, FOLDER, Mode::empty())?)?, b"")?;
        unlinkat(folder, name, AtFlags::REMOVEDIR)
    }
}

/// Without the order: elsewhere nothing is removed so, by paths within an open folder.
#[cfg(not(target_os = "linux"))]
mod system {
    pub use std::fs::remove_dir_all as remove_marked;
}

#[cfg(test)]
mod tests {
    use super::super::entries;
    use super::*;
    use std::fs;

    #[test]
    fn all_that_is_in_it_goes_and_links_are_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("ours/a/b")).unwrap();
        for name in ["mine", "ours/.unlift-unfinished", "ours/x", "ours/a/b/y"] {
            fs::write(at(name), "").unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(folder.path(), at("ours/a/link")).unwrap();
        remove_marked(&at("ours")).unwrap();
        assert_eq!(entries(folder.path()), ["mine"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_cannot_be_removed_keeps_its_mark() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        // A link to a folder is none of ours.
        fs::create_dir(at("precious")).unwrap();
        fs::write(at("precious/.unlift-unfinished"), "").unwrap();
        symlink(at("precious"), at("link")).unwrap();
        assert!(remove_marked(&at("link")).is_err());
        assert_eq!(entries(&at("precious")), [".unlift-unfinished"]);
    }
}
