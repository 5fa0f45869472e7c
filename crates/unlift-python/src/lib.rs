//! The native part of the Python package `unlift`.
//!
//! ```text
//! arrays, paths ──> Map ──> obfuscate ──> Hidden { Released, Truth }
//!                    │          Released ──> neighbors ──> Neighborhoods ──> recover ──> Recovered ──> evaluate
//!                    └──> audit (schemes and sources may be functions) ──> Report
//! arrays by name, paths ──> audit_images (as above) ────────────────────────┘
//! ```
//!
//! Work runs on threads of its own, without the interpreter's lock. KeyboardInterrupt ends the wait
//! at once, and Python functions run on the thread that waits.

mod arrays;
mod audit;
mod hidden;
mod images;
mod lists;
mod map;
mod own;
mod records;
mod recovered;
mod report;
mod threads;

use std::ffi::OsString;

use pyo3::prelude::*;
use unlift::recover::Builtin;

/// Runs the command line `words` and returns the exit code.
#[pyfunction]
fn command_line(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| unlift_cli::run(words))
}

/// The native module.
#[pymodule]
mod _unlift {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::audit::{audit, audit_images};
    #[pymodule_export]
    use super::command_line;
    #[pymodule_export]
    use super::hidden::{Hidden, Released, Truth};
    #[pymodule_export]
    use super::lists::{Neighborhoods, find, oracle};
    #[pymodule_export]
    use super::map::{Map, obfuscate, read};
    #[pymodule_export]
    use super::own::{check_scheme, check_solver, check_source};
    #[pymodule_export]
    use super::records::{Records, candidates, lines, planes, rays};
    #[pymodule_export]
    use super::recovered::{Recovered, evaluate, recover};
    #[pymodule_export]
    use super::report::Report;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::names(module)
    }
}

/// Adds the version, and the names that arguments accept.
fn names(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let (schemes, sources) = (unlift::obfuscate::SCHEMES, unlift_audit::sources::all());
    let of_images = schemes.iter().filter(|entry| entry.dimensions() == 2);
    module.add("IMAGE_SCHEMES", of_images.map(|entry| entry.name).collect::<Vec<_>>())?;
    let of_images = sources.iter().filter(|entry| entry.in_2d.is_some());
    module.add("IMAGE_SOURCES", of_images.map(|entry| entry.name).collect::<Vec<_>>())?;
    module.add("IMAGE_SOLVERS", Builtin::FROM_LISTS.map(|solver| solver.name()).to_vec())?;
    let of_maps = schemes.iter().filter(|entry| entry.dimensions() == 3);
    module.add("SCHEMES", of_maps.map(|entry| entry.name).collect::<Vec<_>>())?;
    let of_maps = sources.iter().filter(|entry| entry.in_3d.is_some());
    module.add("SOURCES", of_maps.map(|entry| entry.name).collect::<Vec<_>>())?;
    module.add("UnliftError", module.py().get_type::<arrays::UnliftError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("SOLVERS", Builtin::ALL.map(|solver| solver.name()).to_vec())
}
