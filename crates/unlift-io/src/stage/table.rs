//! A Parquet file: opened, checked, and read batch by batch.

use super::column::{Batch, Type};
use super::guard::without_panic;
use super::header::{KEY, Kind, Meta};
use crate::Error;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Rows decoded at a time: with 128-byte descriptors a megabyte, with 4096 floats 128.
const BATCH_ROWS: usize = 1 << 13;

/// More rows than this per byte of the file are a declared count that nothing stands behind: even
/// equal rows, run-length encoded in pages of 20,000, take more room.
const ROWS_PER_BYTE: u64 = 1000;

/// An open Parquet file.
#[derive(Debug)]
pub(super) struct Table<'a> {
    path: &'a Path,
    file: File,
    parquet: ArrowReaderMetadata,
    meta: Meta<'a>,
    n_rows: u64,
}

impl<'a> Table<'a> {
    /// Opens `path` and reads its footer.
    pub(super) fn open(path: &'a Path) -> Result<Self, Error> {
        let failed = |source| Error::read(path, source);
        let mut file = File::open(path).map_err(failed)?;
        let found = file.metadata().map_err(failed)?;
        if found.is_dir() {
            return Err(failed(io::ErrorKind::IsADirectory.into()));
        }
        check_magic(path, &mut file, found.len())?;
        // The Arrow schema that Arrow writers embed is left aside: the Parquet schema says all that
        // counts, and then large, fixed-size and dictionary columns need no code of their own.
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let parquet = guarded(path, || ArrowReaderMetadata::load(&file, options))?;
        let footer = parquet.metadata().file_metadata();
        let most = (i32::MAX as u64).min(found.len().saturating_mul(ROWS_PER_BYTE));
        let n_rows = match u64::try_from(footer.num_rows()) {
            Ok(n_rows) if n_rows <= most => n_rows,
            _ => {
                let expected = format!("at most {most} rows in {} bytes", found.len());
                return Err(Error::new(path, "", expected, footer.num_rows().to_string()));
            }
        };
        let entries = footer.key_value_metadata();
        let entry = entries.and_then(|all| all.iter().find(|entry| entry.key == KEY));
        let meta = Meta::parse(path, entry.and_then(|entry| entry.value.as_deref()))?;
        Ok(Self { path, file, parquet, meta, n_rows })
    }

    /// Opens `path`, which should hold `kind`.
    pub(super) fn open_kind(path: &'a Path, kind: Kind) -> Result<Self, Error> {
        let table = Self::open(path)?;
        let found = match table.meta.kind()? {
            None if !kind.needs_metadata() => table.kind().unwrap_or(kind),
            None => return Err(Error::new(path, "", kind.to_string(), NO_METADATA)),
            Some(found) => found,
        };
        if found == kind {
            Ok(table)
        } else {
            Err(Error::new(path, "", kind.to_string(), found.to_string()))
        }
    }

    /// What the file holds: by its metadata or, for neighborhoods without, by its columns.
    pub(super) fn kind(&self) -> Result<Kind, Error> {
        if let Some(kind) = self.meta.kind()? {
            return Ok(kind);
        }
        if self.has("point") && self.has("neighbors") {
            return Ok(Kind::PointNeighborhoods);
        }
        if self.has("records") {
            return Ok(Kind::Neighborhoods);
        }
        Err(Error::new(self.path, "", "a stage file of unlift", NO_METADATA))
    }

    /// The metadata object.
    pub(super) fn meta(&self) -> &Meta<'a> {
        &self.meta
    }

    /// Number of rows, as the footer declares it.
    pub(super) fn n_rows(&self) -> u64 {
        self.n_rows
    }

    /// Whether there is a column called `name`.
    pub(super) fn has(&self, name: &str) -> bool {
        self.parquet.schema().column_with_name(name).is_some()
    }

    /// Whether the column `name` is there and of type `class`.
    pub(super) fn is(&self, name: &str, class: Type) -> bool {
        let field = self.parquet.schema().column_with_name(name);
        field.is_some_and(|(_, field)| class.admits(field.data_type()))
    }

    /// Decodes `columns`, a few thousand rows at a time, and hands them to `each` in row order.
    pub(super) fn read(
        &self,
        columns: &[(&str, Type)],
        mut each: impl FnMut(&Batch<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut roots = Vec::with_capacity(columns.len());
        for &(name, class) in columns {
            roots.push(self.find(name, class)?);
        }
        let file = self.file.try_clone();
        let file = file.map_err(|source| Error::read(self.path, source))?;
        let mut reader = guarded(self.path, || {
            let builder =
                ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.parquet.clone());
            let mask = ProjectionMask::roots(builder.parquet_schema(), roots);
            builder.with_projection(mask).with_batch_size(BATCH_ROWS).build()
        })?;
        let mut first_row = 0;
        while let Some(batch) = guarded(self.path, || reader.next().transpose())? {
            each(&Batch::new(self.path, &batch, first_row))?;
            first_row += batch.num_rows() as u64;
        }
        if first_row != self.n_rows {
            let expected = format!("{} rows, as its footer says", self.n_rows);
            return Err(Error::new(self.path, "", expected, first_row.to_string()));
        }
        Ok(())
    }

    /// The index of the column `name`, which must be there once and be of type `class`.
    fn find(&self, name: &str, class: Type) -> Result<usize, Error> {
        let wrong = |found: String| {
            Error::new(self.path, format!("column {name}"), class.to_string(), found)
        };
        let fields = self.parquet.schema().fields().iter().enumerate();
        let mut named = fields.filter(|(_, field)| field.name() == name);
        let Some((at, field)) = named.next() else {
            return Err(wrong("no such column".into()));
        };
        if named.next().is_some() {
            return Err(wrong("two columns of this name".into()));
        }
        if !class.admits(field.data_type()) {
            return Err(wrong(format!("type {}", field.data_type())));
        }
        self.check_codec(name)?;
        Ok(at)
    }

    /// Refuses compression by code that this program was built without.
    fn check_codec(&self, name: &str) -> Result<(), Error> {
        let groups = self.parquet.metadata().row_groups().iter();
        let chunks = groups.flat_map(|group| group.columns());
        let mut of_column = chunks.filter(|chunk| chunk.column_path().parts()[0] == name);
        let known = [Compression::UNCOMPRESSED, Compression::SNAPPY];
        match of_column.find(|chunk| !known.contains(&chunk.compression())) {
            None => Ok(()),
            Some(chunk) => {
                // `ZSTD(ZstdLevel(1))`: the level does not matter here.
                let codec = chunk.compression().to_string();
                let found = codec.split('(').next().unwrap_or_default();
                let place = format!("column {name}");
                Err(Error::new(self.path, place, "no compression or Snappy", found))
            }
        }
    }
}

const NO_METADATA: &str = "a Parquet file without metadata of unlift";

/// Tells a file that never was Parquet from one that was cut short: the usual accidents.
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

/// Runs a step of the `parquet` crate on bytes nobody vouches for: its error, or a panic on damaged
/// data that it did not foresee, becomes an error about the file.
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
