//! NumPy archives: their arrays by name, and positions of a map.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use zip::ZipArchive;
use zip::read::ZipFile;
use zip::result::ZipError;

use super::bytes::Bytes;
use super::lines::quoted;
use super::npy::{Header, Layout, PLACES, of_points};
use crate::error::Error;
use crate::input::{self, Budget};
use crate::read::map_input::Input;
use crate::stage;
use unlift::guard::caught;

/// A reader of an array, which checks its checksum.
pub(crate) type ArrayBytes<'a> = Bytes<ZipFile<'a, BufReader<File>>>;

/// An open NumPy archive.
#[derive(Debug)]
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
        let found = match head.get(..4).unwrap_or(head) {
            b"" => "an empty file",
            b"PAR1" => "a Parquet file, as earlier versions wrote",
            head if head.starts_with(b"PK") => "",
            _ => "another file",
        };
        let wrong =
            |found: String| Error::new(path, "", "an archive of NumPy arrays (.npz)", found);
        if !found.is_empty() {
            return Err(wrong(found.to_owned()));
        }
        let zip = caught(|| ZipArchive::new(file)).ok();
        let zip = zip.unwrap_or(Err(ZipError::InvalidArchive("a damaged one".into())));
        let zip = zip.map_err(|error| wrong(cause(error)))?;
        Ok(Self { path: path.to_owned(), zip, budget: Budget::new(path, len) })
    }

    /// The memory that decoding may use.
    pub fn budget(&self) -> &Budget {
        &self.budget
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
            Error::new(&self.path, &*place, "an array that is stored or deflated", cause(error))
        })?;
        let size = entry.size();
        self.budget.admit(place, size)?;
        Ok(Bytes::of_array(&self.path, entry, name, size))
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

/// Reads positions from the array of points in a NumPy archive. Several or none are an error.
pub fn positions(path: &Path) -> Result<Input, Error> {
    let mut archive = Archive::open(path)?;
    let all = archive.arrays()?;
    if all.iter().any(|(_, name)| name.rsplit('/').next() == Some("unlift")) {
        let kind = stage::declared_kind(path).map(|kind| kind.to_string());
        let found = kind.unwrap_or_else(|| "a stage file of unlift".to_owned());
        return Err(Error::new(path, "", "points of a map", found));
    }
    let (mut fit, mut has_points) = (Vec::new(), false);
    for (at, name) in &all {
        let header = archive.array(*at, name).and_then(|mut bytes| Header::read(&mut bytes));
        if let Some((_, layout)) = header.ok().and_then(|header| header.points()) {
            fit.push((*at, &**name));
            has_points |= !matches!(layout, Layout::Matrix { columns: 4.. });
        }
    }
    let has = |start: &str| all.iter().any(|(_, name)| name.starts_with(start));
    // Some programs store position, size and angle of keypoints in one array, beside descriptors.
    let beside_descriptors = has("descriptors") && !has_points;
    if has("keypoints") || has("OPENSFM_FEATURES") || beside_descriptors {
        return Err(Error::new(path, "", "points of a map", "features of an image"));
    }
    let is_known = |name: &str| PLACES.iter().any(|known| name.eq_ignore_ascii_case(known));
    if fit.iter().filter(|(_, name)| is_known(name)).count() == 1 {
        fit.retain(|(_, name)| is_known(name));
    }
    let [(at, name)] = fit[..] else {
        if fit.is_empty() {
            fit = all.iter().map(|(at, name)| (*at, &**name)).collect();
        }
        let names: Vec<String> =
            fit.iter().take(5).map(|(_, name)| quoted(name.as_bytes())).collect();
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let expected = "one array of points, (n, 3), or one that is called points or xyz";
        return Err(Error::new(path, "", expected, found));
    };
    let mut input = of_points(&mut archive.array(at, name)?, "npz")?;
    if all.len() > 1 {
        input.notes.push(format!("read, the array {} of {}", quoted(name.as_bytes()), all.len()));
    }
    Ok(input)
}
