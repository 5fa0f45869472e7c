//! Rows as an Arrow table, which pandas, polars, DuckDB and pyarrow read without a copy.

use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, RecordBatchIterator, StringArray,
};
use arrow_schema::{DataType, Field, Schema};
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use serde_json::Value;

use crate::errors::raised;
use crate::json::as_python;

/// The rows of an audit, one column per number. Names are those in the CSV of `unlift table`
/// (`recovered_percent_within_0.10`); columns that the CSV lacks have their names of `audit.json`,
/// with a dot between the levels (`lost.no_neighbors`).
#[pyclass(frozen, module = "unlift")]
pub struct Rows {
    columns: Vec<(String, Vec<Value>)>,
    n: usize,
}

impl Rows {
    pub fn of(rows: &[Value]) -> Self {
        let mut columns: Vec<(String, Vec<Value>)> = Vec::new();
        for (at, row) in rows.iter().enumerate() {
            let mut put = |name: String, value: &Value| {
                let found = columns.iter().position(|(other, _)| *other == name);
                let column = found.unwrap_or_else(|| {
                    columns.push((name, Vec::new()));
                    columns.len() - 1
                });
                columns[column].1.resize(at, Value::Null);
                columns[column].1.push(value.clone());
            };
            for (name, value) in row.as_object().into_iter().flatten() {
                match (&**name, value) {
                    ("std", Value::Object(spreads)) => {
                        for (name, value) in spreads {
                            let name = format!("{}_std", name.trim_end_matches("_percent"));
                            put_each(&name, value, &mut put);
                        }
                    }
                    ("dropped", Value::Object(reasons)) => {
                        let n: u64 = reasons.values().filter_map(Value::as_u64).sum();
                        put_each(name, value, &mut put);
                        put("n_dropped".to_owned(), &n.into());
                    }
                    _ => put_each(name, value, &mut put),
                }
            }
        }
        columns.iter_mut().for_each(|(_, values)| values.resize(rows.len(), Value::Null));
        Self { columns, n: rows.len() }
    }

    fn batch(&self) -> Result<RecordBatch, arrow_schema::ArrowError> {
        let columns: Vec<ArrayRef> = self.columns.iter().map(|(_, values)| array(values)).collect();
        let fields = self.columns.iter().zip(&columns);
        let fields =
            fields.map(|((name, _), array)| Field::new(name, array.data_type().clone(), true));
        let schema = Schema::new(fields.collect::<Vec<_>>());
        RecordBatch::try_new(Arc::new(schema), columns)
    }
}

/// Passes a value, or each value within it, to `put` with its name in the CSV.
fn put_each(name: &str, value: &Value, put: &mut impl FnMut(String, &Value)) {
    let Value::Object(within) = value else { return put(name.to_owned(), value) };
    for (key, value) in within {
        let column = match name {
            "recovered_percent"
            | "recovered_std"
            | "blind_percent"
            | "blind_std"
            | "records_alone_percent"
            | "records_alone_by" => format!("{name}_within_{key}"),
            "error_percentiles" => format!("error_percentile_{key}"),
            "metrics" => format!("metric_{key}"),
            _ => format!("{name}.{key}"),
        };
        put(column, value);
    }
}

/// Builds a column of the common type of all values; mixed types become strings.
fn array(values: &[Value]) -> ArrayRef {
    let all = |is: fn(&Value) -> bool| {
        values.iter().any(|value| !value.is_null()) && values.iter().all(|v| v.is_null() || is(v))
    };
    if all(Value::is_i64) {
        Arc::new(values.iter().map(Value::as_i64).collect::<Int64Array>())
    } else if all(Value::is_number) {
        Arc::new(values.iter().map(Value::as_f64).collect::<Float64Array>())
    } else if all(Value::is_boolean) {
        Arc::new(values.iter().map(Value::as_bool).collect::<BooleanArray>())
    } else if values.iter().all(Value::is_null) {
        arrow_array::new_null_array(&DataType::Null, values.len())
    } else {
        let text = |value: &Value| match value {
            Value::Null => None,
            Value::String(text) => Some(text.clone()),
            other => Some(other.to_string()),
        };
        Arc::new(values.iter().map(text).collect::<StringArray>())
    }
}

#[pymethods]
impl Rows {
    fn __len__(&self) -> usize {
        self.n
    }

    fn __repr__(&self) -> String {
        format!("<unlift.Rows: {} rows of {} columns>", self.n, self.columns.len())
    }

    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.columns.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Returns a column as a list.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        match self.columns.iter().find(|(other, _)| other == name) {
            Some((_, values)) => as_python(py, &Value::Array(values.clone())),
            None => Err(pyo3::exceptions::PyKeyError::new_err(name.to_owned())),
        }
    }

    /// Exports the table through Arrow's C interface; `requested_schema` is ignored.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let batch = self.batch().map_err(raised)?;
        let schema = batch.schema();
        let reader = RecordBatchIterator::new([Ok(batch)], schema);
        let stream = FFI_ArrowArrayStream::new(Box::new(reader));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}
