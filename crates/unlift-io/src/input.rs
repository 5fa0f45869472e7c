//! Opens regular files only, and limits the memory for their content by their size.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::Error;

/// Opens `path` for reading and returns it with its length in bytes.
///
/// # Errors
/// When it is missing, cannot be read, or is a folder, a pipe, a socket or a device, which may never end.
pub fn open(path: &Path) -> Result<(File, u64), Error> {
    let failed = |source| Error::read(path, source);
    // Checked before opening, because opening a pipe without a writer blocks forever.
    regular(path, &fs::metadata(path).map_err(failed)?)?;
    let file = File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    regular(path, &metadata)?;
    Ok((file, metadata.len()))
}

/// Returns the first bytes of `path`, at most `n`, and the length of the file.
pub(crate) fn head(path: &Path, n: u64) -> Result<(Vec<u8>, u64), Error> {
    let (file, len) = open(path)?;
    let mut head = Vec::new();
    file.take(n).read_to_end(&mut head).map_err(|source| Error::read(path, source))?;
    Ok((head, len))
}

fn regular(path: &Path, metadata: &fs::Metadata) -> Result<(), Error> {
    if metadata.is_file() {
        return Ok(());
    }
    let found = if metadata.is_dir() { "a folder" } else { "a pipe, a socket or a device" };
    Err(Error::new(path, "", "a file", found))
}

/// The least budget, because small files may repeat or compress data.
const LEAST: u64 = 256 << 20;
/// Bytes of memory per byte of the file. Decoding widens values by up to eight times, and real features hardly compress.
const MULTIPLE: u64 = 64;

/// The memory that decoding one file may use: 64 times its size, at least 256 MiB.
#[derive(Clone, Debug)]
pub struct Budget {
    path: PathBuf,
    len: u64,
    /// The budget in bytes.
    pub(crate) most: u64,
}

impl Budget {
    /// Creates the budget of the file `path` of `len` bytes.
    pub fn new(path: &Path, len: u64) -> Self {
        let most = len.saturating_mul(MULTIPLE).max(LEAST);
        Self { path: path.to_owned(), len, most }
    }

    /// Returns an empty vector with capacity for `n` entries of `place`.
    ///
    /// # Errors
    /// When they exceed the budget or the memory of the machine. A sparse file may have any length.
    pub fn room<T>(&self, place: &str, n: u64) -> Result<Vec<T>, Error> {
        let bytes = n.saturating_mul(std::mem::size_of::<T>() as u64);
        self.admit(place, bytes)?;
        let mut room = Vec::new();
        let there = usize::try_from(n).is_ok_and(|n| room.try_reserve_exact(n).is_ok());
        let expected = "data that fits into memory";
        there.then_some(room).ok_or_else(|| Error::new(&self.path, place, expected, size(bytes)))
    }

    /// Checks that `bytes` for `place` are within the budget.
    pub fn admit(&self, place: &str, bytes: u64) -> Result<(), Error> {
        if bytes <= self.most {
            return Ok(());
        }
        let expected =
            format!("at most {} in memory of a file of {}", size(self.most), size(self.len));
        Err(Error::new(&self.path, place, expected, size(bytes)))
    }
}

/// Formats a number of bytes: `1.5 GiB`, `300 KiB`, `17 bytes`.
pub fn size(bytes: u64) -> String {
    let units = [("GiB", 1u64 << 30), ("MiB", 1 << 20), ("KiB", 1 << 10)];
    match units.iter().find(|(_, unit)| bytes >= *unit) {
        Some((name, unit)) => {
            let tenths = (bytes as f64 / *unit as f64 * 10.0).round() / 10.0;
            format!("{tenths} {name}")
        }
        None => format!("{bytes} bytes"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_files_have_a_least_budget_and_large_ones_a_multiple() {
        let path = Path::new("a.h5");
        assert_eq!(Budget::new(path, 266_000).most, LEAST);
        assert_eq!(Budget::new(path, 1 << 30).most, 64 << 30);
    }
}
