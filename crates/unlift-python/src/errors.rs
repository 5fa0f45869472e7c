//! Errors of every crate as one exception, in one line.

use std::fmt::Display;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pyo3::create_exception!(
    unlift,
    UnliftError,
    PyValueError,
    "What is wrong with an argument, a file or a map, in one line: what, what was expected, what was found."
);

/// The exception that says `error`.
pub fn raised(error: impl Display) -> PyErr {
    PyErr::new::<UnliftError, _>(error.to_string())
}

/// The exception about an argument.
pub fn wrong(name: &str, expected: impl Display, found: impl Display) -> PyErr {
    raised(format!("{name}: expected {expected}, found {found}"))
}
