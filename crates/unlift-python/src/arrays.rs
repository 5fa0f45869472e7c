//! NumPy arrays in and out, and errors about them. Shapes and types are checked. Input is copied, because the work may
//! outlive the call; output is not.

use std::fmt::Display;
use std::ops::RangeInclusive;

use numpy::{Element, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use unlift::descriptors::Values;
use unlift::{Descriptors, OneLine};

pyo3::create_exception!(
    unlift,
    UnliftError,
    PyValueError,
    "An error in an argument, a file or a map: one line that names it, what was expected and what was found."
);

/// Returns an exception with the message `error`.
pub fn raised(error: impl Display) -> PyErr {
    PyErr::new::<UnliftError, _>(error.to_string())
}

/// Returns an exception about an argument.
pub fn wrong(name: &str, expected: impl Display, found: impl Display) -> PyErr {
    raised(format!("{name}: expected {expected}, found {found}"))
}

/// Numbers: NumPy's kinds, and their name in errors.
const NUMBERS: (&str, &str) = ("fiu", "numbers");
const WHOLE: (&str, &str) = ("iu", "whole numbers");
const DESCRIPTORS: (&str, &str) = ("fiu", "uint8 or floats");

/// Converts `given` to an array of one of `kinds`, without a copy if it is one already.
fn array<'py>(
    name: &str,
    given: &Bound<'py, PyAny>,
    (kinds, what): (&str, &str),
) -> PyResult<Bound<'py, PyAny>> {
    let numpy = given.py().import("numpy")?;
    // Masked values would otherwise pass as valid.
    if given.is_instance(&numpy.getattr("ma")?.getattr("MaskedArray")?)? {
        let expected = format!("an array of {what} without a mask (`.filled(..)` makes one)");
        return Err(wrong(name, expected, "a masked array"));
    }
    let array = numpy.call_method1("asarray", (given,)).map_err(|error| {
        let py = given.py();
        // NumPy's errors about uneven rows are of these types; interrupts and lack of memory are not.
        match error.is_instance_of::<PyValueError>(py) || error.is_instance_of::<PyTypeError>(py) {
            true => wrong(name, format!("an array of {what}"), OneLine(error.value(py))),
            false => error,
        }
    })?;
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !kinds.contains(&kind) {
        return Err(wrong(name, format!("an array of {what}"), format!("one of {dtype}")));
    }
    Ok(array)
}

/// Converts `array` to a contiguous array of `T`, without a copy if it is one already.
fn contiguous<'py, T: Element>(array: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let py = array.py();
    let options = PyDict::new(py);
    options.set_item("dtype", T::get_dtype(py))?;
    let made = py.import("numpy")?.call_method("ascontiguousarray", (array,), Some(&options))?;
    made.cast_into().map_err(|error| raised(error.to_string()))
}

/// Returns the rows of an array `(n, D)`.
pub fn rows<const D: usize>(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; D]>> {
    let array = contiguous::<f64>(&array(name, given, NUMBERS)?)?;
    match array.shape() {
        [_, columns] if *columns == D => {
            Ok(array.readonly().as_slice()?.as_chunks::<D>().0.to_vec())
        }
        shape => Err(wrong(name, format!("an array of shape (n, {D})"), shape_text(shape))),
    }
}

/// Returns true for an array of rows of two numbers.
pub fn is_of_pairs(name: &str, given: &Bound<'_, PyAny>) -> PyResult<bool> {
    let shape: Vec<usize> = array(name, given, NUMBERS)?.getattr("shape")?.extract()?;
    Ok(matches!(shape[..], [_, 2]))
}

/// Returns the values of an array, and its shape.
pub fn numbers(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let array = contiguous::<f64>(&array(name, given, NUMBERS)?)?;
    Ok((array.readonly().as_slice()?.to_vec(), array.shape().to_vec()))
}

/// Returns the values of an array `(n,)`.
pub fn column(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    match numbers(name, given)? {
        (values, shape) if shape.len() == 1 => Ok(values),
        (_, shape) => Err(wrong(name, "an array of shape (n,)", shape_text(&shape))),
    }
}

/// Returns whole numbers in `range`, from an array with one of `dims` axes, and its shape.
pub fn whole(
    name: &str,
    given: &Bound<'_, PyAny>,
    dims: &[usize],
    range: RangeInclusive<i64>,
) -> PyResult<(Vec<i64>, Vec<usize>)> {
    let array = array(name, given, WHOLE)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if !dims.contains(&shape.len()) {
        let axes: Vec<String> = dims.iter().map(usize::to_string).collect();
        let expected = format!("an array of {} axes", axes.join(" or "));
        return Err(wrong(name, expected, shape_text(&shape)));
    }
    // Large values of uint64 would wrap in int64.
    let bounds: &[&str] = if shape.contains(&0) { &[] } else { &["min", "max"] };
    for bound in bounds {
        let value: i128 = array.call_method0(*bound)?.call_method0("item")?.extract()?;
        if !i64::try_from(value).is_ok_and(|value| range.contains(&value)) {
            let expected = format!("numbers from {} to {}", range.start(), range.end());
            return Err(wrong(name, expected, value));
        }
    }
    Ok((contiguous::<i64>(&array)?.readonly().as_slice()?.to_vec(), shape))
}

/// Returns whole numbers from 0 below `end`, from an array with one of `dims` axes, and its shape.
pub fn indices(
    name: &str,
    given: &Bound<'_, PyAny>,
    dims: &[usize],
    end: u32,
) -> PyResult<(Vec<u32>, Vec<usize>)> {
    let (values, shape) = whole(name, given, dims, 0..=i64::from(end) - 1)?;
    Ok((values.into_iter().map(|value| value as u32).collect(), shape))
}

/// Returns descriptors `(n, dim)`: bytes, or floats.
pub fn descriptors(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Descriptors> {
    let array = array(name, given, DESCRIPTORS)?;
    let dtype: String = array.getattr("dtype")?.getattr("name")?.extract()?;
    let (values, shape) = if dtype == "uint8" {
        let array = contiguous::<u8>(&array)?;
        (Values::U8(array.readonly().as_slice()?.to_vec()), array.shape().to_vec())
    } else if dtype.starts_with("float") {
        let array = contiguous::<f32>(&array)?;
        (Values::F32(array.readonly().as_slice()?.to_vec()), array.shape().to_vec())
    } else {
        let (_, what) = DESCRIPTORS;
        return Err(wrong(name, format!("an array of {what}"), format!("one of {dtype}")));
    };
    let [_, dim] = shape[..] else {
        return Err(wrong(name, "an array of shape (n, dim)", shape_text(&shape)));
    };
    Descriptors::try_new(values, dim).map_err(|error| match error.what() {
        "descriptors" => wrong(name, error.expected(), error.found()),
        // The error names the row.
        _ => raised(error.within(name)),
    })
}

/// Formats a shape as NumPy does: `(3, 4)`.
pub fn shape_text(shape: &[usize]) -> String {
    let sides: Vec<String> = shape.iter().map(usize::to_string).collect();
    match sides.as_slice() {
        [side] => format!("({side},)"),
        sides => format!("({})", sides.join(", ")),
    }
}

/// Returns an array `(n, D)` that uses the memory of `rows`.
pub fn to_rows<T: Element, const D: usize>(
    py: Python<'_>,
    rows: Vec<[T; D]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let n = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([n, D])
}

/// Returns an array `(n,)`.
pub fn to_array<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, values)
}

/// Returns descriptors as an array `(n, dim)`.
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
