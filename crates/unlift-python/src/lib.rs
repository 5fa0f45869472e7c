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
//! at once.

mod arrays;
mod audit;
mod audit_images;
mod calls;
mod command_line;
mod either;
mod errors;
mod files;
mod heard;
mod hidden;
mod images;
mod laws;
mod lists;
mod map;
mod obfuscate;
mod own;
mod plan;
mod records;
mod recovered;
mod report;
mod work;

use pyo3::prelude::*;
use unlift::recover::Builtin;

/// The native module.
#[pymodule]
mod _unlift {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::audit::audit;
    #[pymodule_export]
    use super::audit_images::audit_images;
    #[pymodule_export]
    use super::command_line::command_line;
    #[pymodule_export]
    use super::hidden::{Hidden, Released, Truth};
    #[pymodule_export]
    use super::laws::{check_scheme, check_solver, check_source};
    #[pymodule_export]
    use super::lists::{Neighborhoods, find, oracle};
    #[pymodule_export]
    use super::map::{Map, read};
    #[pymodule_export]
    use super::obfuscate::obfuscate;
    #[pymodule_export]
    use super::records::{Candidates, Lines, Planes, Rays, Records};
    #[pymodule_export]
    use super::recovered::{Recovered, evaluate, recover};
    #[pymodule_export]
    use super::report::Report;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::calls::register(module)?;
        super::names(module)
    }
}

/// Adds the version, and the names that arguments accept.
fn names(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let (all_schemes, all_sources) = (unlift::obfuscate::SCHEMES, unlift_audit::sources::all());
    let schemes = all_schemes.iter().filter(|entry| entry.in_2d.is_some());
    module.add("IMAGE_SCHEMES", schemes.map(|entry| entry.name).collect::<Vec<_>>())?;
    let sources = all_sources.iter().filter(|entry| entry.in_2d.is_some());
    module.add("IMAGE_SOURCES", sources.map(|entry| entry.name).collect::<Vec<_>>())?;
    let solvers = Builtin::FROM_LISTS.map(|solver| solver.name()).to_vec();
    module.add("IMAGE_SOLVERS", solvers)?;
    let schemes = all_schemes.iter().filter(|entry| entry.in_3d.is_some());
    let sources = all_sources.iter().filter(|entry| entry.in_3d.is_some());
    module.add("UnliftError", module.py().get_type::<errors::UnliftError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("SCHEMES", schemes.map(|entry| entry.name).collect::<Vec<_>>())?;
    module.add("SOURCES", sources.map(|entry| entry.name).collect::<Vec<_>>())?;
    module.add("SOLVERS", Builtin::ALL.map(|solver| solver.name()).to_vec())
}
