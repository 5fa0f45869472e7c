//! Reads positions from NumPy archives.

use std::io::{self, BufReader, Read, Seek};
use std::path::Path;

use zip::ZipArchive;
use zip::read::ZipFile;
use zip::result::ZipError;

use super::bytes::Bytes;
use super::lines::quoted;
use super::npy::{Header, Layout, PLACES, of_points};
use crate::error::Error;
use crate::guard::without_panic;
use crate::input::{self, Budget};
use crate::read::map_input::Input;

/// Reads positions from the array of points in a NumPy archive. Several or none are an error.
pub fn positions(path: &Path) -> Result<Input, Error> {
    let damaged = || Error::new(path, "", "an archive of NumPy arrays", "a damaged one");
    without_panic(|| in_archive(path)).unwrap_or_else(|| Err(damaged()))
}

fn in_archive(path: &Path) -> Result<Input, Error> {
    /// The maximum size of an array header.
    const HEADER: u64 = 1 << 16;
    let (file, len) = input::open(path)?;
    let wrong =
        |error: ZipError| Error::new(path, "", "an archive of NumPy arrays", error.to_string());
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(wrong)?;
    // Arrays are unpacked into an anonymous temporary file, so that only headers are in memory.
    let unpacked = |entry: ZipFile<'_, _>, most: u64| -> Result<Bytes, Error> {
        let mut file = tempfile::tempfile().map_err(|error| Error::read(path, error))?;
        let copied = io::copy(&mut entry.take(most), &mut file);
        let n =
            copied.and_then(|n| file.rewind().map(|()| n)).map_err(|error| wrong(error.into()))?;
        Ok(Bytes::continuing(path, BufReader::new(file), 0, n))
    };
    let (mut all, mut fit) = (Vec::new(), Vec::new());
    let mut n_columns = Vec::new();
    for at in 0..archive.len() {
        let entry = archive.by_index(at).map_err(wrong)?;
        let name = entry.name().map_err(wrong)?;
        let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else { continue };
        let header = unpacked(entry, HEADER).and_then(|mut bytes| Header::read(&mut bytes));
        if let Some((_, layout)) = header.ok().and_then(|header| header.points()) {
            n_columns.push(if let Layout::Matrix { columns } = layout { columns } else { 3 });
            fit.push((at, name.clone()));
        }
        all.push(name);
    }
    let has = |start: &str| all.iter().any(|name| name.starts_with(start));
    // Some programs store position, size and angle of keypoints in one array, beside descriptors.
    let beside_descriptors = has("descriptors") && n_columns.iter().all(|&n| n > 3);
    if has("keypoints") || has("OPENSFM_FEATURES") || beside_descriptors {
        return Err(Error::new(path, "", "points of a map", "features of an image"));
    }
    let is_known = |name: &str| PLACES.iter().any(|known| name.eq_ignore_ascii_case(known));
    if fit.iter().filter(|(_, name)| is_known(name)).count() == 1 {
        fit.retain(|(_, name)| is_known(name));
    }
    let [(at, name)] = &fit[..] else {
        let fit: Vec<String> = fit.into_iter().map(|(_, name)| name).collect();
        let names = if fit.is_empty() { &all } else { &fit };
        let names: Vec<String> = names.iter().take(5).map(|name| quoted(name.as_bytes())).collect();
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let expected = "one array of points, (n, 3), or one that is called points or xyz";
        return Err(Error::new(path, "", expected, found));
    };
    let entry = archive.by_index(*at).map_err(wrong)?;
    let size = entry.size();
    Budget::new(path, len).admit(&**name, size)?;
    let mut found = of_points(&mut unpacked(entry, size)?, "npz")?;
    if all.len() > 1 {
        found.notes.push(format!("read, the array {} of {}", quoted(name.as_bytes()), all.len()));
    }
    Ok(found)
}
