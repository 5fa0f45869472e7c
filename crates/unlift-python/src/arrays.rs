//! NumPy arrays in and out, and errors about them. Shapes and types are checked. Input is copied, because the work may
//! outlive the call; output is not.

use std::fmt::Display;
use std::ops::RangeInclusive;

use numpy::{Element, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
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

/// Returns the values of `array`, converted to `T`, and its shape.
fn values<T: Element + Clone>(array: &Bound<'_, PyAny>) -> PyResult<(Vec<T>, Vec<usize>)> {
    let (py, dtype) = (array.py(), T::get_dtype(array.py()));
    let made = py.import("numpy")?.call_method1("ascontiguousarray", (array, dtype))?;
    let made = made.cast_into::<PyArrayDyn<T>>().map_err(raised)?;
    Ok((made.readonly().as_slice()?.to_vec(), made.shape().to_vec()))
}

/// Returns the rows of an array `(n, D)`.
pub fn rows<const D: usize>(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; D]>> {
    let (values, shape) = numbers(name, given)?;
    match shape[..] {
        [_, columns] if columns == D => Ok(values.as_chunks::<D>().0.to_vec()),
        _ => Err(wrong(name, format!("an array of shape (n, {D})"), shape_text(&shape))),
    }
}

/// Returns true for an array of rows of two numbers.
pub fn is_of_pairs(name: &str, given: &Bound<'_, PyAny>) -> PyResult<bool> {
    let shape: Vec<usize> = array(name, given, NUMBERS)?.getattr("shape")?.extract()?;
    Ok(matches!(shape[..], [_, 2]))
}

/// Returns the values of an array, and its shape.
pub fn numbers(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    values(&array(name, given, NUMBERS)?)
}

/// Returns the values of an array `(n,)`.
pub fn column(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    match numbers(name, given)? {
        (values, shape) if shape.len() == 1 => Ok(values),
        (_, shape) => Err(wrong(name, "an array of shape (n,)", shape_text(&shape))),
    }
}

/// Returns whole numbers in `range`, which `T` can hold, from an array with one of `dims` axes, and its shape.
pub fn whole<T: Element + Clone>(
    name: &str,
    given: &Bound<'_, PyAny>,
    dims: &[usize],
    range: RangeInclusive<i64>,
) -> PyResult<(Vec<T>, Vec<usize>)> {
    let array = array(name, given, WHOLE)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if !dims.contains(&shape.len()) {
        let axes: Vec<String> = dims.iter().map(usize::to_string).collect();
        let expected = format!("an array of {} axes", axes.join(" or "));
        return Err(wrong(name, expected, shape_text(&shape)));
    }
    // Values outside of `range` would wrap in `T`.
    let bounds: &[&str] = if shape.contains(&0) { &[] } else { &["min", "max"] };
    for bound in bounds {
        let value: i128 = array.call_method0(*bound)?.call_method0("item")?.extract()?;
        if !i64::try_from(value).is_ok_and(|value| range.contains(&value)) {
            let expected = format!("numbers from {} to {}", range.start(), range.end());
            return Err(wrong(name, expected, value));
        }
    }
    Ok((values(&array)?.0, shape))
}

/// Returns descriptors `(n, dim)`: bytes, or floats.
pub fn descriptors(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Descriptors> {
    let array = array(name, given, DESCRIPTORS)?;
    let dtype: String = array.getattr("dtype")?.getattr("name")?.extract()?;
    let (values, shape) = if dtype == "uint8" {
        values(&array).map(|(bytes, shape)| (Values::U8(bytes), shape))?
    } else if dtype.starts_with("float") {
        values(&array).map(|(floats, shape)| (Values::F32(floats), shape))?
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
