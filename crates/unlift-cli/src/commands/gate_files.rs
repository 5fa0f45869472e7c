//! `--junit`: writes the results of gates for CI services.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use unlift_audit::{FIGURES, Finished, PAGE, check_file_of};
use unlift_io::atomic::{Access, Kind, Rules, make_folders, write_file};
use unlift_report::junit;

use crate::args::ResultArgs;
use crate::exit::usage;

const OPTION: &str = "--junit";

/// The requested file of gate results: checked before the work, written after it.
pub struct GateFile {
    path: Option<PathBuf>,
    rules: Rules,
}

impl GateFile {
    /// Checks that the file can be written, and that it is not a file of the report.
    pub fn check(result: &ResultArgs, rules: &Rules) -> anyhow::Result<Self> {
        let file = Self { path: result.junit.clone(), rules: rules.clone() };
        let Some(path) = &file.path else { return Ok(file) };
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.exists()) {
            // As for the folder of the report, which may be the same folder.
            let access = if result.share_safe { Access::Usual } else { Access::Private };
            make_folders(folder, access).map_err(|error| usage(format!("{OPTION}: {error}")))?;
        }
        let target = check_file_of(OPTION, path, Kind::Junit, rules)?;
        let out = fs::canonicalize(&result.out).unwrap_or_default();
        if [PAGE, FIGURES].iter().any(|name| out.join(name) == target) {
            let path = path.display();
            return Err(usage(format!(
                "{OPTION}: {path}: expected a file of its own, found one of --out"
            )));
        }
        Ok(file)
    }

    /// Writes the file atomically, readable by all users.
    pub fn write(&self, finished: &Finished) -> anyhow::Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        check_file_of(OPTION, path, Kind::Junit, &self.rules)?;
        let text = junit(&finished.document);
        write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }
}
