//! Errors of all crates as one Python exception.

use std::fmt::Display;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

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
