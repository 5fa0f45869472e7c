//! Reads COLMAP's `database.db`.
//!
//! Source: COLMAP's documentation, "Database Format".

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::{Display, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};

use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, Row};

use unlift::Descriptors;
use unlift::descriptors::Values;

use super::ImageFeatures;
use crate::error::Error;
use crate::input::{self, Budget};
use crate::read::lines::quoted;

const TABLES: [&str; 4] = ["images", "cameras", "keypoints", "descriptors"];
/// SQLite steps between two checks of the limit.
const STEPS_AT_A_TIME: u64 = 1000;
/// The step limit of one query is `LEAST_STEPS`, plus `STEPS_PER_BYTE` for every byte of the file. A row takes about ten steps.
const LEAST_STEPS: u64 = 1_000_000;
const STEPS_PER_BYTE: u64 = 4;

pub(crate) struct Database {
    path: PathBuf,
    // A connection cannot be used by two threads at once.
    connection: Mutex<Connection>,
    /// Sorted by name, which may not be UTF-8.
    image_ids: Vec<(Vec<u8>, i64)>,
    pub names: Vec<String>,
    /// True if a column `type` states the extractor (COLMAP 4 and later).
    has_type: bool,
    steps: Arc<AtomicU64>,
}

impl Database {
    /// Opens `path` for reading.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
        let (_, len) = input::open(path)?;
        let budget = Budget::new(path, len);
        let mut connection =
            Connection::open_with_flags(uri(path), flags).map_err(|e| refuse(path, "", &e))?;
        let steps = Arc::new(AtomicU64::new(0));
        confine(&mut connection, &budget, len, &steps).map_err(|e| refuse(path, "", &e))?;
        for table in TABLES {
            check_table(&connection, path, table)?;
        }
        steps.store(0, Relaxed);
        let image_ids = image_ids(&connection, path, &budget)?;
        let name = |(name, _): &(Vec<u8>, i64)| String::from_utf8_lossy(name).into_owned();
        let names = image_ids.iter().map(name).collect();
        let has_type = connection.prepare("SELECT type FROM descriptors LIMIT 0").is_ok();
        let (path, connection) = (path.to_owned(), Mutex::new(connection));
        Ok(Self { path, connection, image_ids, names, has_type, steps })
    }

    fn error(&self, name: &[u8], expected: impl Display, found: impl Display) -> Error {
        Error::new(&self.path, format!("image {}", quoted(name)), expected, found)
    }

    fn image_id(&self, name: &[u8]) -> Result<i64, Error> {
        let at = self.image_ids.binary_search_by(|(known, _)| known[..].cmp(name));
        let at = at.map_err(|_| self.error(name, "this image of the model", "no such image"))?;
        Ok(self.image_ids[at].1)
    }

    pub fn descriptors(&self, name: &[u8]) -> Result<(Values, usize), Error> {
        self.matrix(name, "descriptors")?.ok_or_else(|| self.error(name, "descriptors", "none"))
    }

    /// Returns the rows of an image and their width; `None` if `table` has none. Keypoints are floats.
    fn matrix(&self, name: &[u8], table: &str) -> Result<Option<(Values, usize)>, Error> {
        let image_id = self.image_id(name)?;
        let of_keypoints = table == "keypoints";
        let kind = if self.has_type && !of_keypoints { "type" } else { "0" };
        let query = format!("SELECT rows, cols, data, {kind} FROM {table} WHERE image_id = ?");
        let found = self.row(&query, image_id, &format!("table {table}"), |row| {
            let data = row.get_ref(2)?.as_blob_or_null()?;
            let (n, cols, kind): (i64, i64, i64) = (row.get(0)?, row.get(1)?, row.get(3)?);
            Ok((n, cols, kind, data.unwrap_or_default().to_vec()))
        })?;
        let Some((n, cols, kind, data)) = found else { return Ok(None) };
        // -1 is a database without types, 0 is SIFT, others are learned descriptors.
        let are_bytes = kind <= 0 && !of_keypoints;
        // `cols` counts values of keypoints, but bytes of descriptors.
        let bytes_each = if of_keypoints { 4 } else { 1 };
        let row_bytes = usize::try_from(cols).ok().and_then(|cols| cols.checked_mul(bytes_each));
        let (Some(n), Some(mut row_bytes)) = (usize::try_from(n).ok(), row_bytes) else {
            return Err(self.error(name, format!("sizes of {table}"), format!("{n} x {cols}")));
        };
        if n == 0 && data.is_empty() {
            // Some exporters state no columns for an image without features.
            row_bytes = row_bytes.max(8);
        } else if n.checked_mul(row_bytes) != Some(data.len())
            || row_bytes == 0
            || !(are_bytes || row_bytes.is_multiple_of(4))
        {
            let expected = format!("{n} {table} of {row_bytes} bytes");
            return Err(self.error(name, expected, format!("{} bytes", data.len())));
        }
        if are_bytes {
            return Ok(Some((Values::U8(data), row_bytes)));
        }
        let floats = data.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
        Ok(Some((Values::F32(floats), row_bytes / 4)))
    }

    fn row<T>(
        &self,
        query: &str,
        image_id: i64,
        place: &str,
        read: impl FnOnce(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Option<T>, Error> {
        let connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
        self.steps.store(0, Relaxed);
        let found = connection.query_row(query, [image_id], read).optional();
        found.map_err(|error| refuse(&self.path, place, &error))
    }

    /// Returns width and height in pixels of an image, if its camera states them.
    fn size(&self, name: &[u8]) -> Result<Option<[u32; 2]>, Error> {
        let query = "SELECT cameras.width, cameras.height FROM images JOIN cameras \
                     ON images.camera_id = cameras.camera_id WHERE image_id = ?";
        let image_id = self.image_id(name)?;
        let found = self.row(query, image_id, "table cameras", |row| {
            Ok((row.get_ref(0)?.as_i64(), row.get_ref(1)?.as_i64()))
        })?;
        let side = |value: i64| u32::try_from(value).ok().filter(|&side| side > 0);
        Ok(found.and_then(|(width, height)| Some([side(width.ok()?)?, side(height.ok()?)?])))
    }

    /// Reads the features of image `at` of `names`.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        let name = &self.image_ids[at].0[..];
        let size = self.size(name)?;
        let Some((Values::F32(values), columns)) = self.matrix(name, "keypoints")? else {
            return Err(self.error(name, "keypoints", "none"));
        };
        let descriptors = self.matrix(name, "descriptors")?;
        if ![2, 4, 6].contains(&columns) {
            let found = format!("{columns} columns");
            return Err(self.error(name, "keypoints of 2, 4 or 6 columns", found));
        }
        if let Some(bad) = values.iter().position(|value| !value.is_finite()) {
            let expected = format!("a finite number in keypoint {}", bad / columns);
            return Err(self.error(name, expected, values[bad]));
        }
        let mut image = ImageFeatures { name: self.names[at].clone(), size, ..Default::default() };
        // COLMAP places the center of the first pixel at (0.5, 0.5).
        let place = |row: &[f32]| [f64::from(row[0]) - 0.5, f64::from(row[1]) - 0.5];
        image.keypoints = values.chunks(columns).map(place).collect();
        if columns > 2 {
            let (scales, turns) = values.chunks(columns).map(shape).unzip();
            (image.scales, image.orientations_deg) = (Some(scales), Some(turns));
        }
        if let Some((values, dim)) = descriptors {
            let wrong = |error: unlift::Error| self.error(name, error.expected(), error.found());
            let descriptors = Descriptors::try_new(values, dim).map_err(wrong)?;
            let (n, found) = (image.keypoints.len(), descriptors.len());
            if found != n {
                return Err(self.error(name, format!("{n} descriptors, one per keypoint"), found));
            }
            image.descriptors = Some(descriptors);
        }
        Ok(image)
    }
}

fn refuse(path: &Path, place: &str, error: &rusqlite::Error) -> Error {
    let found = match error.sqlite_error_code() {
        Some(ErrorCode::OperationInterrupted) => "a query that does not end".to_owned(),
        _ => error.to_string(),
    };
    Error::new(path, place, "a COLMAP database", found)
}

/// Limits what a database can do: no trusted views, triggers or computed columns, values within the
/// memory budget, and a step limit per query.
fn confine(
    connection: &mut Connection,
    budget: &Budget,
    len: u64,
    steps: &Arc<AtomicU64>,
) -> rusqlite::Result<()> {
    let settings = [
        (DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true),
        (DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false),
        (DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false),
        (DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false),
    ];
    for (setting, value) in settings {
        connection.set_db_config(setting, value)?;
    }
    let most = i32::try_from(budget.most).unwrap_or(i32::MAX);
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, most)?;
    connection.set_limit(Limit::SQLITE_LIMIT_ATTACHED, 0)?;
    let (steps, most) =
        (steps.clone(), LEAST_STEPS.saturating_add(len.saturating_mul(STEPS_PER_BYTE)));
    let is_over = move || steps.fetch_add(STEPS_AT_A_TIME, Relaxed) > most;
    connection.progress_handler(STEPS_AT_A_TIME as i32, Some(is_over))
}

fn check_table(connection: &Connection, path: &Path, table: &str) -> Result<(), Error> {
    let query = "SELECT type, rootpage FROM sqlite_master WHERE name = ? COLLATE NOCASE \
                 AND type IN ('table', 'view')";
    let place = format!("table {table}");
    let found: Option<(String, i64)> = connection
        .query_row(query, [table], |row| Ok((row.get(0)?, row.get(1)?)))
        .optional()
        .map_err(|e| refuse(path, &place, &e))?;
    match found {
        Some((kind, _)) if kind == "view" => Err(Error::new(path, place, "a table", "a view")),
        Some((_, 0)) => Err(Error::new(path, place, "a table", "a virtual table")),
        _ => Ok(()),
    }
}

fn image_ids(
    connection: &Connection,
    path: &Path,
    budget: &Budget,
) -> Result<Vec<(Vec<u8>, i64)>, Error> {
    let failed = |e: rusqlite::Error| refuse(path, "table images", &e);
    let mut statement = connection.prepare("SELECT image_id, name FROM images").map_err(failed)?;
    let read = |row: &Row<'_>| Ok((row.get_ref(1)?.as_bytes()?.to_vec(), row.get(0)?));
    let (mut image_ids, mut bytes) = (BTreeMap::new(), 0);
    for image in statement.query_map([], read).map_err(failed)? {
        let (name, id) = image.map_err(failed)?;
        // Names of a computed column are stored nowhere, so the file size does not limit them.
        bytes += 64 + name.len() as u64;
        budget.admit("table images", bytes)?;
        image_ids.insert(name, id);
    }
    Ok(image_ids.into_iter().collect())
}

/// Returns the URI of a database that is opened read-only, without writing a journal.
///
/// `immutable` opens a database in write-ahead mode in a folder without write permission. While a
/// journal exists, it would miss rows or read uncommitted ones.
fn uri(path: &Path) -> OsString {
    let mut uri = "file:".to_owned();
    let bytes = path.as_os_str().as_encoded_bytes();
    if bytes.starts_with(b"//") {
        // Otherwise SQLite would parse the next component as a host name.
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
    let waits = |ending: &str| {
        let mut journal = path.as_os_str().to_owned();
        journal.push(ending);
        std::fs::metadata(journal).is_ok_and(|found| found.len() > 0)
    };
    if !waits("-wal") && !waits("-journal") {
        uri.push_str("?immutable=1");
    }
    uri.into()
}

/// Returns scale in pixels and orientation in degrees of a keypoint with 4 columns (stored
/// directly) or 6 (an affine shape, whose columns are the rotated and scaled axes).
fn shape(row: &[f32]) -> (f32, f32) {
    match *row {
        [_, _, scale, turn] => (scale, turn.to_degrees()),
        [_, _, a11, a12, a21, a22] => {
            (0.5 * (a11.hypot(a21) + a12.hypot(a22)), a21.atan2(a11).to_degrees())
        }
        _ => (0.0, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_without_end_is_ended() {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
        let database = Database::open(&data.join("project/database.db")).unwrap();
        let count = |most: i64| {
            let query = format!(
                "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c LIMIT {most}) \
                 SELECT count(*) FROM c"
            );
            database.steps.store(0, Relaxed);
            let connection = database.connection.lock().unwrap();
            connection.query_row(&query, [], |row| row.get::<_, i64>(0))
        };
        assert_eq!(count(1000).unwrap(), 1000);
        let error = refuse(Path::new("f"), "", &count(i64::MAX).unwrap_err());
        let line = "f: expected a COLMAP database, found a query that does not end";
        assert_eq!(error.to_string(), line);
        assert!((0..300).all(|_| count(1000).is_ok()));
    }
}
