//! Files for what does not fit into memory.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use unlift::Shelf;

/// Files of a folder that have no name: gone with the process, however it ends.
#[derive(Clone, Debug)]
pub struct Files {
    folder: PathBuf,
    window: usize,
}

/// The window is this part of what all may take, as a divisor: a dozen of them are in memory at the worst moment,
const PART: u64 = 32;
/// and has so many bytes at least and at most: lists are read hundreds at a time, and more tells nothing.
const WINDOW: (u64, u64) = (1 << 20, 128 << 20);

impl Files {
    /// Files in `folder`, of which windows are read that go with `limit` bytes of memory in all.
    pub fn new(folder: impl Into<PathBuf>, limit: u64) -> Self {
        let window = (limit / PART).clamp(WINDOW.0, WINDOW.1) as usize;
        Self { folder: folder.into(), window }
    }

    /// The same in the folder that an output goes to.
    pub fn beside(out: &Path, limit: u64) -> Self {
        let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty());
        Self::new(folder.unwrap_or(Path::new(".")), limit)
    }
}

impl Shelf for Files {
    fn file(&self) -> io::Result<File> {
        tempfile::tempfile_in(&self.folder)
    }

    fn place(&self) -> String {
        self.folder.display().to_string()
    }

    fn window(&self) -> usize {
        self.window
    }
}
