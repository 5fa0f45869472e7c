//! The command line of unlift inside the Python package.

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;

/// Runs the command line `words` and returns the exit code. `program` is the file of this module.
#[pyfunction]
pub fn command_line(py: Python<'_>, program: PathBuf, words: Vec<OsString>) -> u8 {
    py.detach(|| unlift_cli::run(program, words))
}
