//! COLMAP's `database.db`: descriptors of points as the mean over their observations.

use std::collections::HashMap;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::Path;

use rusqlite::{Connection, OpenFlags, OptionalExtension};
use unlift::Descriptors;
use unlift::descriptors::Values;

use crate::error::Error;
use crate::read::Input;
use crate::read::colmap::{self, Tracks};
use crate::read::lines::quoted;

/// L2 norm of the descriptors COLMAP stores as bytes.
const BYTE_NORM: f64 = 512.0;

/// How one image's descriptors are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Bytes,
    /// Little-endian `f32`, whose bytes the table counts as columns.
    Floats,
}

/// The blob of one image.
struct Rows {
    kind: Kind,
    n: usize,
    row_bytes: usize,
    data: Vec<u8>,
}

/// Descriptors for every point of `input`, which must be a COLMAP model.
///
/// Source: COLMAP's documentation, "Database Format".
pub fn descriptors(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let Some(points_path) = input.files.iter().find(|file| is_points(file)) else {
        let expected = "a COLMAP model, whose tracks lead to a database";
        return Err(Error::new(path, "", expected, format!("{} points", input.format)));
    };
    let points = colmap::read_points(points_path, true)?;
    let tracks = points.tracks.expect("asked for");
    let images = images_of(points_path)?;
    let row_of_id: HashMap<u64, usize> = points.ids.iter().copied().zip(0..).collect();
    let rows = input
        .ids
        .iter()
        .map(|id| {
            row_of_id.get(id).copied().ok_or_else(|| {
                Error::new(points_path, format!("point {id}"), "its track", "no such point")
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    mean_over_tracks(&Database::open(path)?, &tracks, &images, &rows, &input.ids)
}

fn is_points(file: &Path) -> bool {
    file.file_stem().is_some_and(|stem| stem == "points3D")
}

/// Names of the model's images by their id in the model, read beside the points.
fn images_of(points_path: &Path) -> Result<HashMap<u32, Vec<u8>>, Error> {
    let extension = points_path.extension().unwrap_or_default();
    let path = points_path.with_file_name("images").with_extension(extension);
    let images = colmap::read_images(&path)?;
    Ok(images.into_iter().map(|i| (i.id, i.name)).collect())
}

/// The mean over the observations of each of `rows` (of `tracks`), which have these `ids`.
fn mean_over_tracks(
    database: &Database,
    tracks: &Tracks,
    names: &HashMap<u32, Vec<u8>>,
    rows: &[usize],
    ids: &[u64],
) -> Result<Descriptors, Error> {
    // By image, so that one image's descriptors are in memory at a time; by id, so that sums of floats
    // do not depend on a hash.
    let mut observations = Vec::new();
    for (out, &row) in rows.iter().enumerate() {
        if tracks.row(row).is_empty() {
            let place = format!("point {}", ids[out]);
            let expected = "an observation in its track";
            return Err(Error::new(database.path, place, expected, "none"));
        }
        let track = tracks.row(row).iter();
        observations.extend(track.map(|&(image, index)| (image, index, out)));
    }
    observations.sort_unstable();

    let mut layout = None;
    let mut sums: Vec<f64> = Vec::new();
    for seen in observations.chunk_by(|a, b| a.0 == b.0) {
        let image = seen[0].0;
        let Some(name) = names.get(&image) else {
            let place = format!("point {}", ids[seen[0].2]);
            let expected = "images of the model in its track";
            return Err(Error::new(database.path, place, expected, format!("image {image}")));
        };
        let stored = database.rows(name)?;
        let this = (stored.kind, stored.row_bytes);
        let (kind, row_bytes) = *layout.get_or_insert(this);
        let dim = match kind {
            Kind::Bytes => row_bytes,
            Kind::Floats => row_bytes / 4,
        };
        if this != (kind, row_bytes) {
            let expected = format!("{row_bytes} columns of {kind:?} as in other images");
            let found = format!("{} of {:?}", stored.row_bytes, stored.kind);
            return Err(database.error(name, expected, found));
        }
        sums.resize(rows.len() * dim, 0.0);
        for &(_, index, out) in seen {
            let index = index as usize;
            if index >= stored.n {
                let expected = format!("a descriptor for keypoint {index}");
                return Err(database.error(name, expected, format!("{} descriptors", stored.n)));
            }
            let row = &stored.data[index * row_bytes..(index + 1) * row_bytes];
            let sums = &mut sums[out * dim..(out + 1) * dim];
            match kind {
                Kind::Bytes => {
                    for (sum, &byte) in sums.iter_mut().zip(row) {
                        *sum += f64::from(byte);
                    }
                }
                Kind::Floats => {
                    for (sum, bits) in sums.iter_mut().zip(row.as_chunks::<4>().0) {
                        *sum += f64::from(f32::from_le_bytes(*bits));
                    }
                }
            }
        }
    }
    let (kind, row_bytes) = layout.unwrap_or((Kind::Bytes, 1));
    let (values, dim) = match kind {
        Kind::Bytes => {
            normalize(&mut sums, row_bytes, BYTE_NORM);
            // Ties to even, as NumPy rounds.
            let byte = |x: &f64| x.round_ties_even().clamp(0.0, 255.0) as u8;
            (Values::U8(sums.iter().map(byte).collect()), row_bytes)
        }
        Kind::Floats => {
            normalize(&mut sums, row_bytes / 4, 1.0);
            let floats = sums.iter().map(|&x| x as f32).collect();
            (Values::F32(floats), row_bytes / 4)
        }
    };
    Descriptors::try_new(values, dim).map_err(|e| Error::core(database.path, e))
}

/// Brings every row to an L2 norm (so that a sum is as good as a mean); rows of zeros stay.
fn normalize(rows: &mut [f64], dim: usize, norm: f64) {
    for row in rows.chunks_mut(dim) {
        let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 {
            row.iter_mut().for_each(|x| *x *= norm / length);
        }
    }
}

/// An open database: image ids by name, and whether descriptors have a type.
struct Database<'a> {
    path: &'a Path,
    connection: Connection,
    image_ids: HashMap<Vec<u8>, i64>,
    /// Since COLMAP 4 a column says which extractor wrote a row.
    has_type: bool,
}

impl<'a> Database<'a> {
    fn open(path: &'a Path) -> Result<Self, Error> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
        let connection =
            Connection::open_with_flags(uri(path), flags).map_err(|e| refuse(path, "", &e))?;
        let image_ids = (|| {
            let mut statement = connection.prepare("SELECT image_id, name FROM images")?;
            let rows = statement
                .query_map([], |row| Ok((row.get_ref(1)?.as_bytes()?.to_vec(), row.get(0)?)))?;
            rows.collect::<rusqlite::Result<HashMap<_, _>>>()
        })()
        .map_err(|e| refuse(path, "table images", &e))?;
        let has_type = connection.prepare("SELECT type FROM descriptors LIMIT 0").is_ok();
        Ok(Self { path, connection, image_ids, has_type })
    }

    fn error(&self, name: &[u8], expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::new(self.path, format!("image {}", quoted(name)), expected, found)
    }

    /// The descriptors of the image called `name`.
    fn rows(&self, name: &[u8]) -> Result<Rows, Error> {
        let Some(image_id) = self.image_ids.get(name) else {
            return Err(self.error(name, "this image of the model", "no such image"));
        };
        let kind = if self.has_type { "type" } else { "0" };
        let query = format!("SELECT rows, cols, data, {kind} FROM descriptors WHERE image_id = ?");
        let found = self
            .connection
            .prepare(&query)
            .and_then(|mut statement| {
                statement
                    .query_row([image_id], |row| {
                        let data = row.get_ref(2)?.as_blob_or_null()?;
                        let data = data.unwrap_or_default().to_vec();
                        let (n, cols, kind): (i64, i64, i64) =
                            (row.get(0)?, row.get(1)?, row.get(3)?);
                        Ok((n, cols, kind, data))
                    })
                    .optional()
            })
            .map_err(|e| refuse(self.path, "table descriptors", &e))?;
        let Some((n, cols, kind, data)) = found else {
            return Err(self.error(name, "descriptors", "none"));
        };
        // -1 is a database from before there were types, 0 is SIFT; the others are learned, in floats.
        let kind = if kind <= 0 { Kind::Bytes } else { Kind::Floats };
        let sizes = (usize::try_from(n).ok(), usize::try_from(cols).ok());
        let (Some(n), Some(row_bytes)) = sizes else {
            return Err(self.error(name, "sizes of descriptors", format!("{n} x {cols}")));
        };
        if n.checked_mul(row_bytes) != Some(data.len())
            || row_bytes == 0
            || (kind == Kind::Floats && !row_bytes.is_multiple_of(4))
        {
            let expected = format!("{n} descriptors of {row_bytes} bytes");
            return Err(self.error(name, expected, format!("{} bytes", data.len())));
        }
        Ok(Rows { kind, n, row_bytes, data })
    }
}

fn refuse(path: &Path, place: &str, error: &rusqlite::Error) -> Error {
    Error::new(path, place, "a COLMAP database", error.to_string())
}

/// The URI of a database that is read and never written, not even its journal.
///
/// `immutable` lets a database in a folder without write permission open although COLMAP left it in
/// write-ahead mode. It must not be used while a journal waits beside the file: its rows would be missed.
fn uri(path: &Path) -> OsString {
    let mut uri = "file:".to_owned();
    let bytes = path.as_os_str().as_encoded_bytes();
    if bytes.starts_with(b"//") {
        // Else what follows would be taken for the name of a host.
        uri.push_str("//");
    }
    if cfg!(windows) && bytes.get(1) == Some(&b':') {
        uri.push('/');
    }
    for &byte in bytes {
        match byte {
            b'\\' if cfg!(windows) => uri.push('/'),
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' => {
                uri.push(char::from(byte));
            }
            _ => write!(uri, "%{byte:02X}").expect("strings take everything"),
        }
    }
    let mut journal = path.as_os_str().to_owned();
    journal.push("-wal");
    if std::fs::metadata(journal).map_or(0, |m| m.len()) == 0 {
        uri.push_str("?immutable=1");
    }
    uri.into()
}
