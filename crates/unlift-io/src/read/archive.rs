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
        let another = match head.get(..4).unwrap_or(head) {
            b"" => Some("an empty file"),
            b"PAR1" => Some("a Parquet file, as earlier versions wrote"),
            head if head.starts_with(b"PK") => None,
            _ => Some("another file"),
        };
        let expected = "an archive of NumPy arrays (.npz)";
        if let Some(found) = another {
            return Err(Error::new(path, "", expected, found));
        }
        let zip = caught(|| ZipArchive::new(file)).ok();
        let zip = zip.unwrap_or(Err(ZipError::InvalidArchive("a damaged one".into())));
        let zip = zip.map_err(|error| Error::new(path, "", expected, cause(error)))?;
        Ok(Self { path: path.to_owned(), zip, budget: Budget::new(path, len) })
    }

    /// Returns index and name of each array, in the order of the archive.
    pub fn arrays(&self) -> Result<Vec<(usize, String)>, Error> {
        let mut arrays = Vec::new();
        for (at, name) in self.zip.file_names().enumerate() {
            let name = name.map_err(|error| {
                Error::new(&self.path, format!("entry {at}"), "a name", cause(error))
            })?;
            arrays.extend(name.strip_suffix(".npy").map(|name| (at, name.to_owned())));
        }
        Ok(arrays)
    }

    /// Starts reading the entry at index `at`, the array `name`.
    pub fn array(&mut self, at: usize, name: &str) -> Result<ArrayBytes<'_>, Error> {
        let place = format!("array {name}");
        let entry = self.zip.by_index(at).map_err(|error| {
            Error::new(&self.path, &place, "an array that is stored or deflated", cause(error))
        })?;
        let size = entry.size();
        self.budget.admit(&place, size)?;
        Ok(Bytes::of_array(&self.path, entry, name, size, self.budget.clone()))
    }
}

/// Describes an error of the archive, without the words that repeat its type.
fn cause(error: ZipError) -> String {
    match error {
        ZipError::InvalidArchive(cause) => cause.into_owned(),
        ZipError::UnsupportedArchive(cause) => cause.to_owned(),
        other => other.to_string(),
    }
}
