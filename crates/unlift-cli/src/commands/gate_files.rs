//! `--junit`: writes the results of gates for CI services.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use unlift_audit::{FIGURES, Finished, PAGE, check_file_of};
use unlift_io::Error;
use unlift_io::atomic::{Access, Kind, Rules, alone_in, make_folders, place_of, write_file};
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
        let target = place_of(&check_file_of(OPTION, path, Kind::Junit, rules)?);
        if [PAGE, FIGURES].iter().any(|name| place_of(&result.out.join(name)) == target) {
            let path = path.display();
            return Err(usage(format!(
                "{OPTION}: {path}: expected a file of its own, found one of --out"
            )));
        }
        Ok(file)
    }

    /// Writes the file atomically, readable by all users. Returns an error if another run has
    /// replaced the results of `finished` in the meantime, because the file would not match.
    pub fn write(&self, finished: &Finished) -> anyhow::Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        let document = &finished.document;
        let figures = finished.report.with_file_name(FIGURES);
        let _alone = alone_in(finished.report.parent().unwrap_or(Path::new(".")));
        let there = fs::read(&figures).map_err(|source| Error::read(&figures, source))?;
        if there != document.to_json()?.as_bytes() {
            let found = "those of another run that ended in the meantime; gates are not written";
            return Err(Error::new(&figures, "", "the figures of this run", found).into());
        }
        check_file_of(OPTION, path, Kind::Junit, &self.rules)?;
        let text = junit(document);
        write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?;
        Ok(())
    }
}
