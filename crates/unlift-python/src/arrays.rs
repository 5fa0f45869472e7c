//! NumPy arrays in and out: shapes and kinds checked, and no copy where the layout allows it.

use numpy::{Element, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use unlift::Descriptors;
use unlift::descriptors::Values;

use crate::errors::{raised, wrong};

/// What `given` is as an array of `T`, contiguous; its own memory where it is one already. `kinds` are NumPy's letters of what is
/// taken, `what` their name.
fn contiguous<'py, T: Element>(
    name: &str,
    given: &Bound<'py, PyAny>,
    (kinds, what): (&str, &str),
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let py = given.py();
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (given,))?;
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !kinds.contains(&kind) {
        return Err(wrong(name, format!("an array of {what}"), format!("one of {dtype}")));
    }
    let options = PyDict::new(py);
    options.set_item("dtype", T::get_dtype(py))?;
    let array = numpy.call_method("ascontiguousarray", (array,), Some(&options))?;
    array.cast_into().map_err(|error| raised(error.to_string()))
}

/// Numbers of any kind.
const NUMBERS: (&str, &str) = ("fiu", "numbers");
/// Whole numbers.
const WHOLE: (&str, &str) = ("iu", "whole numbers");

/// Calls `then` with the rows of an array `(n, 3)`.
pub fn with_rows<T>(
    name: &str,
    given: &Bound<'_, PyAny>,
    then: impl FnOnce(&[[f64; 3]]) -> PyResult<T>,
) -> PyResult<T> {
    let array = contiguous::<f64>(name, given, NUMBERS)?;
    match array.shape() {
        [_, 3] => {}
        shape => return Err(wrong(name, "an array of shape (n, 3)", told(shape))),
    }
    let array = array.readonly();
    let values = array.as_slice()?;
    then(values.as_chunks::<3>().0)
}

/// The rows of an array `(n, 3)`.
pub fn rows(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
    with_rows(name, given, |rows| Ok(rows.to_vec()))
}

/// The numbers of an array `(n,)`.
pub fn numbers(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let array = contiguous::<f64>(name, given, NUMBERS)?;
    match array.shape() {
        [_] => Ok(array.readonly().as_slice()?.to_vec()),
        shape => Err(wrong(name, "an array of shape (n,)", told(shape))),
    }
}

/// Whole numbers from 0 below `most`, of an array with one of `dims` axes, and its shape.
pub fn indices(
    name: &str,
    given: &Bound<'_, PyAny>,
    dims: &[usize],
    most: u64,
) -> PyResult<(Vec<u32>, Vec<usize>)> {
    let array = contiguous::<i64>(name, given, WHOLE)?;
    let shape = array.shape().to_vec();
    if !dims.contains(&shape.len()) {
        let axes: Vec<String> = dims.iter().map(usize::to_string).collect();
        let expected = format!("an array of {} axes", axes.join(" or "));
        return Err(wrong(name, expected, told(&shape)));
    }
    let one = |&value: &i64| match u64::try_from(value) {
        Ok(index) if index < most => Ok(index as u32),
        _ => Err(wrong(name, format!("numbers from 0 to {}", most.saturating_sub(1)), value)),
    };
    let values = array.readonly().as_slice()?.iter().map(one).collect::<PyResult<_>>()?;
    Ok((values, shape))
}

/// Descriptors `(n, dim)`: bytes, or floats.
pub fn descriptors(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Descriptors> {
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given,))?;
    let dtype: String = array.getattr("dtype")?.getattr("name")?.extract()?;
    let bytes = dtype == "uint8";
    if !bytes && !dtype.starts_with("float") {
        return Err(wrong(name, "an array of uint8 or floats", format!("one of {dtype}")));
    }
    let (values, shape) = if bytes {
        let array = contiguous::<u8>(name, &array, WHOLE)?;
        (Values::U8(array.readonly().as_slice()?.to_vec()), array.shape().to_vec())
    } else {
        let array = contiguous::<f32>(name, &array, NUMBERS)?;
        (Values::F32(array.readonly().as_slice()?.to_vec()), array.shape().to_vec())
    };
    let [_, dim] = shape[..] else {
        return Err(wrong(name, "an array of shape (n, dim)", told(&shape)));
    };
    Descriptors::try_new(values, dim).map_err(raised)
}

/// `(3, 4)`, as NumPy writes it.
pub fn told(shape: &[usize]) -> String {
    let sides: Vec<String> = shape.iter().map(usize::to_string).collect();
    match sides.as_slice() {
        [side] => format!("({side},)"),
        sides => format!("({})", sides.join(", ")),
    }
}

/// An array `(n, D)` of rows, in their memory.
pub fn to_rows<T: Element, const D: usize>(
    py: Python<'_>,
    rows: Vec<[T; D]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let n = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([n, D])
}

/// An array `(n,)`.
pub fn to_array<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, values)
}

/// Descriptors as an array `(n, dim)`.
pub fn to_descriptors<'py>(
    py: Python<'py>,
    descriptors: &Descriptors,
) -> PyResult<Bound<'py, PyAny>> {
    let shape = [descriptors.len(), descriptors.dim()];
    Ok(match descriptors.values() {
        Values::U8(values) => to_array(py, values.clone()).reshape(shape)?.into_any(),
        Values::F32(values) => to_array(py, values.clone()).reshape(shape)?.into_any(),
    })
}
