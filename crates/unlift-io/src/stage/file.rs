//! Opens and decodes a Parquet file.

use super::footer;
use super::header::KEY;
use crate::Error;
use crate::guard::without_panic;
use crate::input;
use arrow_array::RecordBatch;
use arrow_schema::SchemaRef;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader,
    ParquetRecordBatchReaderBuilder,
};
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Rows of a batch: 1 MiB for descriptors of 128 bytes, 128 MiB for 4096 floats.
const BATCH_ROWS: usize = 1 << 13;

/// The maximum number of rows per byte of a file. Even equal rows, run-length encoded in pages of
/// 20,000, take more space.
const ROWS_PER_BYTE: u64 = 1000;

#[derive(Debug)]
pub(super) struct ParquetFile {
    path: PathBuf,
    file: File,
    n_bytes: u64,
    parquet: ArrowReaderMetadata,
    n_rows: u64,
}

impl ParquetFile {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let (mut file, n_bytes) = input::open(path)?;
        check_magic(path, &mut file, n_bytes)?;
        footer::check(path, &mut file, n_bytes)?;
        // Without the embedded Arrow schema, large, fixed-size and dictionary columns need no
        // special code.
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let parquet = guarded(path, || ArrowReaderMetadata::load(&file, options))?;
        let footer = parquet.metadata().file_metadata();
        let most = (i32::MAX as u64).min(n_bytes.saturating_mul(ROWS_PER_BYTE));
        let mut groups = parquet.metadata().row_groups().iter().map(|group| group.num_rows());
        // Negative numbers could make the right sum.
        let in_groups = groups.try_fold(0_u64, |sum, n| sum.checked_add(u64::try_from(n).ok()?));
        let n_rows = match u64::try_from(footer.num_rows()) {
            Ok(n_rows) if n_rows <= most && in_groups == Some(n_rows) => n_rows,
            Ok(n_rows) if n_rows <= most => {
                let expected = format!("row groups of {n_rows} rows, as declared in its footer");
                let found = in_groups.map_or("others".to_owned(), |n| n.to_string());
                return Err(Error::new(path, "", expected, found));
            }
            _ => {
                let expected = format!("at most {most} rows in {} bytes", n_bytes);
                return Err(Error::new(path, "", expected, footer.num_rows().to_string()));
            }
        };
        Ok(Self { path: path.to_owned(), file, n_bytes, parquet, n_rows })
    }

    pub(super) fn n_rows(&self) -> u64 {
        self.n_rows
    }

    pub(super) fn schema(&self) -> &SchemaRef {
        self.parquet.schema()
    }

    /// The text under unlift's metadata key.
    pub(super) fn meta_text(&self) -> Option<&str> {
        let entries = self.parquet.metadata().file_metadata().key_value_metadata();
        let entry = entries.and_then(|all| all.iter().find(|entry| entry.key == KEY));
        entry.and_then(|entry| entry.value.as_deref())
    }

    /// Returns true if statistics in the file show that the column `name`, which is no list, has
    /// only nulls.
    pub(super) fn is_all_null(&self, name: &str) -> bool {
        let groups = self.parquet.metadata().row_groups();
        groups.iter().all(|group| {
            let mut chunks = group.columns().iter();
            let chunk = chunks.find(|chunk| chunk.column_path().parts() == [name]);
            let nulls = chunk.and_then(|chunk| chunk.statistics()?.null_count_opt());
            nulls.is_some_and(|nulls| nulls as i64 == group.num_rows())
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn n_bytes(&self) -> u64 {
        self.n_bytes
    }

    pub(super) fn metadata(&self) -> &ParquetMetaData {
        self.parquet.metadata()
    }

    pub(super) fn handle(&self) -> Result<File, Error> {
        self.file.try_clone().map_err(|source| Error::read(&self.path, source))
    }

    /// Starts decoding the columns at `roots`, at most `most_rows` at a time.
    /// [`pages::check`](super::pages::check) has checked their sizes.
    pub(super) fn batches(&self, roots: &[usize], most_rows: usize) -> Result<Batches, Error> {
        let file = self.handle()?;
        let reader = guarded(&self.path, || {
            let builder =
                ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.parquet.clone());
            let mask = ProjectionMask::roots(builder.parquet_schema(), roots.iter().copied());
            builder.with_projection(mask).with_batch_size(most_rows.clamp(1, BATCH_ROWS)).build()
        })?;
        Ok(Batches { path: self.path.clone(), reader, decoded: 0, n_rows: self.n_rows })
    }

    /// Returns an error if the column `name` uses an unsupported compression.
    pub(super) fn check_codec(&self, name: &str) -> Result<(), Error> {
        let groups = self.parquet.metadata().row_groups().iter();
        let chunks = groups.flat_map(|group| group.columns());
        let mut of_column = chunks.filter(|chunk| chunk.column_path().parts()[0] == name);
        let known = |codec| {
            matches!(codec, Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::ZSTD(_))
        };
        match of_column.find(|chunk| !known(chunk.compression())) {
            None => Ok(()),
            Some(chunk) => {
                // Removes the level, as in `GZIP(GzipLevel(6))`.
                let codec = chunk.compression().to_string();
                let found = codec.split('(').next().unwrap_or_default();
                let place = format!("column {name}");
                Err(Error::new(&self.path, place, "no compression, Snappy or zstd", found))
            }
        }
    }
}

pub(super) struct Batches {
    path: PathBuf,
    reader: ParquetRecordBatchReader,
    decoded: u64,
    n_rows: u64,
}

impl Batches {
    /// Returns the next rows, or `None` at the end. A wrong number of rows is an error.
    pub(super) fn next(&mut self) -> Result<Option<RecordBatch>, Error> {
        let batch = guarded(&self.path, || self.reader.next().transpose())?;
        match &batch {
            Some(batch) => self.decoded += batch.num_rows() as u64,
            None if self.decoded == self.n_rows => {}
            None => {
                let expected = format!("{} rows, as declared in its footer", self.n_rows);
                return Err(Error::new(&self.path, "", expected, self.decoded.to_string()));
            }
        }
        Ok(batch)
    }
}

/// Distinguishes files that are not Parquet from truncated ones.
fn check_magic(path: &Path, file: &mut File, n_bytes: u64) -> Result<(), Error> {
    let failed = |source| Error::read(path, source);
    let wrong = |found: String| Err(Error::new(path, "", "a Parquet file", found));
    if n_bytes == 0 {
        return wrong("an empty file".into());
    }
    let mut start = [0; 4];
    let n_start = n_bytes.min(4) as usize;
    file.read_exact(&mut start[..n_start]).map_err(failed)?;
    if !b"PAR1".starts_with(&start[..n_start]) {
        return wrong("a file that does not begin with PAR1".into());
    }
    let mut end = [0; 4];
    if n_bytes >= 12 {
        file.seek(SeekFrom::End(-4)).map_err(failed)?;
        file.read_exact(&mut end).map_err(failed)?;
    }
    if end != *b"PAR1" {
        return wrong(format!("one cut short after {n_bytes} bytes"));
    }
    Ok(())
}

/// Runs a step of the `parquet` crate on untrusted bytes. A panic becomes an error about the file.
fn guarded<T, E: Into<ParquetError>>(
    path: &Path,
    step: impl FnOnce() -> Result<T, E>,
) -> Result<T, Error> {
    let found = match without_panic(step) {
        Some(Ok(value)) => return Ok(value),
        Some(Err(error)) => match error.into() {
            ParquetError::External(source) => source.to_string(),
            ParquetError::General(message)
            | ParquetError::NYI(message)
            | ParquetError::EOF(message)
            | ParquetError::ArrowError(message) => message,
            other => other.to_string(),
        },
        None => "damaged data".into(),
    };
    Err(Error::new(path, "", "readable Parquet data", found))
}
