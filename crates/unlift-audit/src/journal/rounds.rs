//! Where the rounds of one recovery stand.

use std::fs;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use unlift::OneLine;
use unlift::recover::Kept;
use unlift_io::atomic::{Access, write_file};
use unlift_io::hash::Hasher;
use unlift_io::input::open;

use super::Journal;

/// How names end.
const ENDING: &str = ".rounds";
/// Rounds are kept when recovery took so many times as long since as it took to write them: a tenth of the time goes there at most.
const RARE: u32 = 10;
/// Bytes that are hashed and written at a time.
const PIECE: usize = 1 << 16;

/// The file in a journal where the rounds of a recovery stand.
pub struct KeptRounds<'b, 'a> {
    journal: &'b mut Journal<'a>,
    /// `None` where nothing can be kept.
    key: Option<String>,
    /// The file of this recovery.
    path: Option<PathBuf>,
    /// When they were kept last, and how long it took.
    last: Instant,
    took: Duration,
}

impl<'b, 'a> KeptRounds<'b, 'a> {
    /// In `journal`, by a key.
    pub(super) fn new(journal: &'b mut Journal<'a>, key: Option<String>) -> Self {
        Self { journal, key, path: None, last: Instant::now(), took: Duration::ZERO }
    }

    /// Writes what `write` does, under a name that tells its content.
    fn put(
        &self,
        key: &str,
        write: &dyn Fn(&mut dyn Write) -> io::Result<()>,
    ) -> Result<PathBuf, unlift_io::Error> {
        let unnamed = self.journal.unnamed(key, ENDING);
        let mut hasher = Hasher::default();
        write_file(&unnamed, Access::Private, |to| {
            // Numbers come one by one.
            let mut pieces = BufWriter::with_capacity(PIECE, Hashed { to, hasher: &mut hasher });
            write(&mut pieces)?;
            pieces.flush()
        })?;
        self.journal.name(&unnamed, (key, &hasher.hex(), ENDING))
    }
}

/// The bytes of a file, and their hash.
fn bytes_of(path: &Path) -> Result<(String, Vec<u8>), unlift_io::Error> {
    let (mut file, _) = open(path)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|source| unlift_io::Error::read(path, source))?;
    let mut hasher = Hasher::default();
    hasher.add(&bytes);
    Ok((hasher.hex(), bytes))
}

impl Kept for KeptRounds<'_, '_> {
    fn recall(&mut self) -> Option<Vec<u8>> {
        let key = self.key.as_ref()?;
        let (path, bytes) = self.journal.whole(key, ENDING, bytes_of)?;
        let folder = OneLine(self.journal.folder.display());
        self.journal.progress.say(&format!("note: goes on from the rounds in {folder}"));
        self.path = Some(path);
        Some(bytes)
    }

    fn keep(&mut self, write: &dyn Fn(&mut dyn Write) -> io::Result<()>) {
        let Some(key) = &self.key else { return };
        if self.journal.is_full || self.last.elapsed() < RARE * self.took {
            return;
        }
        let started = Instant::now();
        match self.put(key, write) {
            Ok(path) => {
                if let Some(before) = self.path.replace(path.clone()).filter(|old| *old != path) {
                    // Left behind, it is as right: only fewer rounds are done there.
                    let _ = fs::remove_file(before);
                }
            }
            Err(error) => self.journal.give_up(&error),
        }
        (self.last, self.took) = (Instant::now(), started.elapsed());
    }
}

/// Writes, and hashes what it writes.
struct Hashed<'a, W> {
    to: &'a mut W,
    hasher: &'a mut Hasher,
}

impl<W: Write> Write for Hashed<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.to.write(bytes)?;
        self.hasher.add(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}
