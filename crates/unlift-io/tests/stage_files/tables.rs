//! Parquet files of other programs, made of a few columns, and their error lines.

use arrow_array::types::{Float64Type, Int64Type};
use arrow_array::{ArrayRef, Float64Array, Int64Array, ListArray, RecordBatch, StringArray};
use parquet::arrow::ArrowWriter;
use parquet::file::metadata::KeyValue;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;
use unlift_io::Error;

pub type Columns = Vec<(&'static str, ArrayRef)>;

/// Writes a Parquet file with the metadata `meta` under the key `unlift`, if it is not empty.
pub fn write(path: &Path, meta: &str, columns: Columns) {
    let nullable = columns.into_iter().map(|(name, column)| (name, column, true));
    let batch = RecordBatch::try_from_iter_with_nullable(nullable).unwrap();
    let file = File::create(path).unwrap();
    let mut writer = ArrowWriter::try_new(file, batch.schema(), None).unwrap();
    if !meta.is_empty() {
        writer.append_key_value_metadata(KeyValue::new("unlift".into(), meta.to_owned()));
    }
    writer.write(&batch).unwrap();
    writer.close().unwrap();
}

pub fn floats<const N: usize>(values: [f64; N]) -> ArrayRef {
    Arc::new(Float64Array::from(values.to_vec()))
}

pub fn maybe<const N: usize>(values: [Option<f64>; N]) -> ArrayRef {
    Arc::new(Float64Array::from(values.to_vec()))
}

pub fn ints<const N: usize>(values: [i64; N]) -> ArrayRef {
    Arc::new(Int64Array::from(values.to_vec()))
}

pub fn maybe_ints<const N: usize>(values: [Option<i64>; N]) -> ArrayRef {
    Arc::new(Int64Array::from(values.to_vec()))
}

pub fn texts<const N: usize>(values: [Option<&str>; N]) -> ArrayRef {
    Arc::new(StringArray::from(values.to_vec()))
}

pub fn lists(rows: &[&[i64]]) -> ArrayRef {
    let rows = rows.iter().map(|row| Some(row.iter().map(|&x| Some(x))));
    Arc::new(ListArray::from_iter_primitive::<Int64Type, _, _>(rows))
}

pub fn maybe_lists<const N: usize>(rows: [Option<Vec<Option<i64>>>; N]) -> ArrayRef {
    Arc::new(ListArray::from_iter_primitive::<Int64Type, _, _>(rows))
}

pub fn float_lists(rows: &[&[f64]]) -> ArrayRef {
    let rows = rows.iter().map(|row| Some(row.iter().map(|&x| Some(x))));
    Arc::new(ListArray::from_iter_primitive::<Float64Type, _, _>(rows))
}

pub fn with(columns: Columns, name: &'static str, column: Option<ArrayRef>) -> Columns {
    let mut columns: Columns = columns.into_iter().filter(|(other, _)| *other != name).collect();
    columns.extend(column.map(|column| (name, column)));
    columns
}

/// Returns the error without the path at its start. It must be one line.
pub fn message<T>(path: &Path, result: Result<T, Error>) -> String {
    let text = result.err().expect("a malformed file was read").to_string();
    assert!(!text.contains('\n'), "{text}");
    let prefix = format!("{}: ", path.display());
    text.strip_prefix(&prefix).expect("the file comes first").to_owned()
}

pub fn check(table: Vec<(String, &str)>) {
    let wrong: Vec<String> = table
        .into_iter()
        .filter(|(found, expected)| found != expected)
        .map(|(found, expected)| format!("  {found}\n  ({expected})"))
        .collect();
    assert!(wrong.is_empty(), "found (and expected):\n{}", wrong.join("\n"));
}

/// Checks the errors of `read` when a column is replaced by another of the same name. A line that
/// begins with a comma or a colon follows the name of the column.
pub fn check_columns<const N: usize>(
    good: Columns,
    read: impl Fn(Columns) -> String,
    rows: [(&'static str, ArrayRef, &str); N],
) {
    let lines = rows.map(|(name, column, line)| {
        let is_of_column = line.starts_with([',', ':']);
        let line = if is_of_column { format!("column {name}{line}") } else { line.to_owned() };
        (read(with(good.clone(), name, Some(column))), line)
    });
    check(lines.iter().map(|(found, line)| (found.clone(), line.as_str())).collect());
}
