//! COLMAP's `database.db`: what is stored per image.
//!
//! Source: COLMAP's documentation, "Database Format".

use std::collections::HashMap;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use rusqlite::{Connection, OpenFlags, OptionalExtension};

use crate::error::Error;
use crate::read::lines::quoted;

/// How one image's descriptors are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bytes,
    /// Little-endian `f32`, whose bytes the table counts as columns.
    Floats,
}

/// The matrix of one image: `n` rows of `row_bytes` each, `data` their bytes.
pub(crate) struct Rows {
    pub kind: Kind,
    pub n: usize,
    pub row_bytes: usize,
    pub data: Vec<u8>,
}

/// An open database: image ids by name, and whether descriptors have a type.
pub(crate) struct Database {
    path: PathBuf,
    connection: Connection,
    image_ids: HashMap<Vec<u8>, i64>,
    /// Since COLMAP 4 a column says which extractor wrote a row.
    has_type: bool,
}

impl Database {
    /// Opens `path` for reading.
    pub fn open(path: &Path) -> Result<Self, Error> {
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
        Ok(Self { path: path.to_owned(), connection, image_ids, has_type })
    }

    /// The file, for errors.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The names of all images, sorted by their bytes.
    pub fn names(&self) -> Vec<Vec<u8>> {
        let mut names: Vec<Vec<u8>> = self.image_ids.keys().cloned().collect();
        names.sort_unstable();
        names
    }

    /// An error about one image.
    pub fn error(
        &self,
        name: &[u8],
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Error {
        Error::new(&self.path, format!("image {}", quoted(name)), expected, found)
    }

    fn image_id(&self, name: &[u8]) -> Result<i64, Error> {
        let found = self.image_ids.get(name).copied();
        found.ok_or_else(|| self.error(name, "this image of the model", "no such image"))
    }

    /// The descriptors of the image called `name`.
    pub fn descriptors(&self, name: &[u8]) -> Result<Rows, Error> {
        let found = self.matrix(name, "descriptors")?;
        found.ok_or_else(|| self.error(name, "descriptors", "none"))
    }

    /// The same, or the keypoints (floats), as `table` says; `None` when the image has no row there.
    pub fn matrix(&self, name: &[u8], table: &str) -> Result<Option<Rows>, Error> {
        let image_id = self.image_id(name)?;
        let of_keypoints = table == "keypoints";
        let kind = if self.has_type && !of_keypoints { "type" } else { "0" };
        let query = format!("SELECT rows, cols, data, {kind} FROM {table} WHERE image_id = ?");
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
            .map_err(|e| refuse(&self.path, &format!("table {table}"), &e))?;
        let Some((n, cols, kind, data)) = found else { return Ok(None) };
        // -1 is a database from before there were types, 0 is SIFT; the others are learned, in floats.
        let kind = if kind <= 0 && !of_keypoints { Kind::Bytes } else { Kind::Floats };
        // Columns of keypoints are values, those of descriptors are bytes.
        let bytes_each = if of_keypoints { 4 } else { 1 };
        let row_bytes = usize::try_from(cols).ok().and_then(|cols| cols.checked_mul(bytes_each));
        let (Some(n), Some(row_bytes)) = (usize::try_from(n).ok(), row_bytes) else {
            return Err(self.error(name, format!("sizes of {table}"), format!("{n} x {cols}")));
        };
        if n == 0 && data.is_empty() {
            // An image without features; some exporters state no columns then.
            return Ok(Some(Rows { kind, n, row_bytes: row_bytes.max(8), data }));
        }
        if n.checked_mul(row_bytes) != Some(data.len())
            || row_bytes == 0
            || (kind == Kind::Floats && !row_bytes.is_multiple_of(4))
        {
            let expected = format!("{n} {table} of {row_bytes} bytes");
            return Err(self.error(name, expected, format!("{} bytes", data.len())));
        }
        Ok(Some(Rows { kind, n, row_bytes, data }))
    }

    /// Width and height in pixels of the image called `name`, if its camera states them.
    pub fn size(&self, name: &[u8]) -> Result<Option<[u32; 2]>, Error> {
        let query = "SELECT cameras.width, cameras.height FROM images JOIN cameras \
                     ON images.camera_id = cameras.camera_id WHERE image_id = ?";
        let image_id = self.image_id(name)?;
        let found = self
            .connection
            .prepare(query)
            .and_then(|mut statement| {
                statement
                    .query_row([image_id], |row| {
                        Ok((row.get_ref(0)?.as_i64(), row.get_ref(1)?.as_i64()))
                    })
                    .optional()
            })
            .map_err(|e| refuse(&self.path, "table cameras", &e))?;
        let side = |value: i64| u32::try_from(value).ok().filter(|&side| side > 0);
        Ok(found.and_then(|(width, height)| Some([side(width.ok()?)?, side(height.ok()?)?])))
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
