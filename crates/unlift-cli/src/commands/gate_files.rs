//! `--junit` and `--sarif`: writes the results of gates for CI services.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use unlift_audit::{FIGURES, Finished, PAGE, check_file_of};
use unlift_io::Error;
use unlift_io::atomic::{Access, Kind, Rules, alone_in, make_folders, place_of, write_file};
use unlift_report::document::Document;
use unlift_report::{junit, sarif};

use crate::args::ResultArgs;
use crate::exit::usage;

struct GateFile {
    option: &'static str,
    path: PathBuf,
    kind: Kind,
    text: Text,
}

/// Formats a file of gate results, with the place that it points to.
type Text = fn(&Document, Option<(&str, usize)>) -> String;

/// The requested files of gate results: checked before the work, written after it.
pub struct GateFiles {
    files: Vec<GateFile>,
    rules: Rules,
    asked_at: Option<(String, usize)>,
}

impl GateFiles {
    /// Checks that all requested files can be written, and that no file is written twice.
    pub fn check(result: &ResultArgs, rules: &Rules) -> anyhow::Result<Self> {
        let asked = [
            ("--junit", &result.junit, Kind::Junit, (|document, _| junit(document)) as Text),
            ("--sarif", &result.sarif, Kind::Sarif, sarif),
        ];
        let mut taken: Vec<(&str, PathBuf)> =
            [PAGE, FIGURES].map(|name| ("--out", place_of(&result.out.join(name)))).to_vec();
        let mut files = Vec::new();
        for (option, path, kind, text) in asked {
            let Some(path) = path else { continue };
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            if let Some(folder) = folder.filter(|folder| !folder.exists()) {
                // As for the folder of the report, which may be the same folder.
                let access = if result.share_safe { Access::Usual } else { Access::Private };
                make_folders(folder, access)
                    .map_err(|error| usage(format!("{option}: {error}")))?;
            }
            let target = place_of(&check_file_of(option, path, kind, rules)?);
            if let Some((other, _)) = taken.iter().find(|(_, other)| *other == target) {
                let path = path.display();
                return Err(usage(format!(
                    "{option}: {path}: expected a file of its own, found one of {other}"
                )));
            }
            taken.push((option, target));
            files.push(GateFile { option, path: path.clone(), kind, text });
        }
        Ok(Self { files, rules: rules.clone(), asked_at: result.asked_at.clone() })
    }

    /// Writes each file atomically, readable by all users. Returns an error if another run has
    /// replaced the results of `finished` in the meantime, because the files would not match.
    pub fn write(&self, finished: &Finished) -> anyhow::Result<()> {
        if self.files.is_empty() {
            return Ok(());
        }
        let document = &finished.document;
        let figures = finished.report.with_file_name(FIGURES);
        let _alone = alone_in(finished.report.parent().unwrap_or(Path::new(".")));
        let there = fs::read(&figures).map_err(|source| Error::read(&figures, source))?;
        if there != document.to_json()?.as_bytes() {
            let found = "those of another run that ended in the meantime; gates are not written";
            return Err(Error::new(&figures, "", "the figures of this run", found).into());
        }
        for GateFile { option, path, kind, text } in &self.files {
            check_file_of(option, path, *kind, &self.rules)?;
            let text =
                text(document, self.asked_at.as_ref().map(|(file, line)| (file.as_str(), *line)));
            write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?;
        }
        Ok(())
    }
}
