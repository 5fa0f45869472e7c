//! Writes columns to a Parquet file.

use super::header::to_text;
use crate::Error;
use crate::atomic::{self, Access};
use arrow_array::types::ArrowPrimitiveType;
use arrow_array::{ArrayRef, ListArray, PrimitiveArray, RecordBatch};
use arrow_buffer::OffsetBuffer;
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::ColumnPath;
use serde_json::{Map, Value};
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Rows that are converted at a time.
const CHUNK_ROWS: usize = 1 << 14;

/// The maximum number of rows of a row group, so that an engine can distribute groups to machines.
pub(super) const GROUP_ROWS: usize = 1 << 20;

/// The maximum size of a row group in bytes, because a group is in memory until it is complete.
const GROUP_BYTES: usize = 256 << 20;

/// A table to write. Equal values make equal bytes.
pub(super) struct Written<'a> {
    pub(super) meta: Map<String, Value>,
    pub(super) n_rows: usize,
    fields: Vec<Field>,
    columns: Vec<Column<'a>>,
}

/// A function that returns some rows of a column.
type Column<'a> = Box<dyn Fn(Range<usize>) -> ArrayRef + 'a>;

impl<'a> Written<'a> {
    pub(super) fn new(meta: Map<String, Value>, n_rows: usize) -> Self {
        Self { meta, n_rows, fields: Vec::new(), columns: Vec::new() }
    }

    pub(super) fn column(&mut self, field: Field, rows: impl Fn(Range<usize>) -> ArrayRef + 'a) {
        self.fields.push(field);
        self.columns.push(Box::new(rows));
    }

    pub(super) fn numbers<T: ArrowPrimitiveType>(
        &mut self,
        name: impl Into<String>,
        number: impl Fn(usize) -> T::Native + 'a,
    ) {
        self.column(Field::new(name, T::DATA_TYPE, false), move |rows| {
            Arc::new(PrimitiveArray::<T>::from_iter_values(rows.map(&number)))
        });
    }

    pub(super) fn optional_numbers<T: ArrowPrimitiveType>(
        &mut self,
        name: impl Into<String>,
        number: impl Fn(usize) -> Option<T::Native> + 'a,
    ) {
        self.column(Field::new(name, T::DATA_TYPE, true), move |rows| {
            Arc::new(rows.map(&number).collect::<PrimitiveArray<T>>())
        });
    }

    /// Adds a column of lists. `lists` returns the values of some rows, concatenated, and the
    /// length of each list.
    pub(super) fn lists<T: ArrowPrimitiveType>(
        &mut self,
        name: impl Into<String>,
        lists: impl Fn(Range<usize>) -> (Vec<T::Native>, Vec<usize>) + 'a,
    ) {
        let of = Field::new("element", T::DATA_TYPE, false);
        self.column(Field::new_list(name, of.clone(), false), move |rows| {
            let (values, lengths) = lists(rows);
            let values = Arc::new(PrimitiveArray::<T>::from_iter_values(values));
            let offsets = OffsetBuffer::from_lengths(lengths);
            Arc::new(ListArray::new(Arc::new(of.clone()), offsets, values, None))
        });
    }

    pub(super) fn fields(&self) -> &[Field] {
        &self.fields
    }

    pub(super) fn rows(&self, rows: &Range<usize>) -> Vec<ArrayRef> {
        self.columns.iter().map(|column| column(rows.clone())).collect()
    }
}

pub(super) fn write_table(to: (&Path, Access), written: &Written<'_>) -> Result<(), Error> {
    let properties = properties(to_text(written.meta.clone()), &written.fields, GROUP_ROWS);
    let schema = Arc::new(Schema::new(written.fields.clone()));
    let mut starts = (0..written.n_rows).step_by(CHUNK_ROWS);
    write_batches(to, schema.clone(), properties, || {
        let Some(start) = starts.next() else { return Ok(None) };
        let rows = start..written.n_rows.min(start + CHUNK_ROWS);
        let batch = RecordBatch::try_new(schema.clone(), written.rows(&rows));
        batch.map(Some).map_err(|error| Error::write(to.0, io::Error::other(error)))
    })
}

/// Writes rows from `next` until it returns `None`.
pub(super) fn write_batches(
    (path, access): (&Path, Access),
    schema: SchemaRef,
    properties: WriterProperties,
    mut next: impl FnMut() -> Result<Option<RecordBatch>, Error>,
) -> Result<(), Error> {
    // An error of reading is returned as it is.
    let mut unread = None;
    let done = atomic::write_file(path, access, |file| {
        let mut writer = writer(file, schema, properties).map_err(to_io)?;
        loop {
            match next() {
                Ok(Some(batch)) => writer.write(&batch).map_err(to_io)?,
                Ok(None) => break,
                Err(error) => {
                    unread = Some(error);
                    return Err(io::Error::other("unread"));
                }
            }
        }
        writer.close().map(drop).map_err(to_io)
    });
    unread.map_or(done, Err)
}

pub(super) fn writer<W: io::Write + Send>(
    file: W,
    schema: SchemaRef,
    properties: WriterProperties,
) -> Result<ArrowWriter<W>, ParquetError> {
    let options = ArrowWriterOptions::new()
        .with_properties(properties)
        .with_schema_root("schema".into())
        .with_skip_arrow_metadata(true);
    ArrowWriter::try_new_with_options(file, schema, options)
}

pub(super) fn properties(meta: String, fields: &[Field], group_rows: usize) -> WriterProperties {
    let mut properties = WriterProperties::builder()
        // A new version of the crate must not change bytes.
        .set_created_by("unlift version 1".into())
        .set_compression(Compression::SNAPPY)
        .set_max_row_group_row_count(Some(group_rows))
        .set_max_row_group_bytes(Some(GROUP_BYTES))
        .set_statistics_enabled(EnabledStatistics::None)
        .set_offset_index_disabled(true)
        .set_dictionary_enabled(false)
        .set_key_value_metadata(Some(vec![KeyValue::new(super::header::KEY.into(), meta)]));
    for field in fields {
        let name = field.name().clone();
        // Parquet has no 8-bit type. A dictionary reduces bytes and names to a quarter.
        let path = match field.data_type() {
            DataType::UInt8 | DataType::Utf8 => vec![name],
            DataType::List(of) if *of.data_type() == DataType::UInt8 => {
                vec![name, "list".into(), "element".into()]
            }
            _ => continue,
        };
        properties = properties.set_column_dictionary_enabled(ColumnPath::new(path), true);
    }
    properties.build()
}

/// Extracts the I/O error, so that a full disk is reported as one.
pub(super) fn to_io(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(source) => *source,
            Err(source) => io::Error::other(source),
        },
        other => io::Error::other(other),
    }
}
