//! NumPy archives: their arrays by name.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use zip::ZipArchive;
use zip::read::ZipFile;
use zip::result::ZipError;

use super::bytes::Bytes;
use crate::error::Error;
use crate::input::{self, Budget};
use unlift::guard::caught;

/// A reader of an array, which checks its checksum.
pub(crate) type ArrayBytes<'a> = Bytes<ZipFile<'a, BufReader<File>>>;

pub(crate) struct Archive {
    path: PathBuf,
    zip: ZipArchive<BufReader<File>>,
    budget: Budget,
}

impl Archive {
    /// Opens the archive `path`.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, len) = input::open(path)?;
        let mut file = BufReader::new(file);
        let head = file.fill_buf().map_err(|source| Error::read(path, source))?;
        let expected = "an archive of NumPy arrays (.npz)";
        if !head.starts_with(b"PK") {
            let found = if head.is_empty() { "an empty file" } else { "another file" };
            return Err(Error::new(path, "", expected, found));
        }
        let zip = caught(|| ZipArchive::new(file)).ok();
        let zip = zip.unwrap_or(Err(ZipError::InvalidArchive("a panic of its reader".into())));
        let zip = zip.map_err(|error| Error::new(path, "", expected, error))?;
        Ok(Self { path: path.to_owned(), zip, budget: Budget::new(path, len) })
    }

    /// Returns index and name of each array, in the order of the archive.
    pub fn arrays(&self) -> Vec<(usize, String)> {
        let array = |(at, name): (usize, &str)| Some((at, name.strip_suffix(".npy")?.to_owned()));
        self.zip.file_names().enumerate().filter_map(array).collect()
    }

    /// Starts reading the entry at index `at`, the array `name`.
    pub fn array(&mut self, at: usize, name: &str) -> Result<ArrayBytes<'_>, Error> {
        let place = format!("array {name}");
        let entry = self.zip.by_index(at).map_err(|error| {
            Error::new(&self.path, &place, "an array that is stored or deflated", error)
        })?;
        let size = entry.size();
        self.budget.admit(&place, size)?;
        Ok(Bytes::of_array(&self.path, entry, name, size, self.budget.clone()))
    }
}
