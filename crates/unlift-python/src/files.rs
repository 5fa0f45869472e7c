//! Writing of stage files, by the rules of the command line: foreign files stay.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use unlift_audit::check_file_of;
use unlift_io::atomic::{Kind, Rules};
use unlift_io::stage;

use crate::errors::raised;

/// Writes a stage file of `kind` to `path` by `write`; with `force`, also over foreign files.
pub fn save(
    py: Python<'_>,
    (path, force): (PathBuf, bool),
    kind: stage::Kind,
    write: impl FnOnce(&Path) -> Result<(), unlift_io::Error> + Send,
) -> PyResult<()> {
    py.detach(|| {
        let rules = Rules::new([], force);
        check_file_of("path", &path, Kind::Stage(kind), &rules).map_err(refused)?;
        write(&path).map_err(raised)
    })
}

/// Renames the option that an error advises to its Python name.
pub fn refused(error: unlift_audit::Error) -> PyErr {
    raised(error.to_string().replace("--force", "force=True").replace("--out", "out"))
}
