//! Output files: checked before anything is computed; only files that unlift wrote are replaced.

use std::path::{Path, PathBuf};

use unlift_io::atomic::{Access, Kind, OutputFile, OutputSet, Rules};

use crate::clouds;
use crate::{Error, Progress};

/// File name of the page of an audit.
pub const PAGE: &str = "report.html";
/// File name of the figures of an audit.
pub const FIGURES: &str = "audit.json";

/// Converts an error of a file to an error of the option `--out`.
pub fn refused(error: unlift_io::Error) -> Error {
    Error::request(format!("--out: {error}"))
}

/// Checks that the file `path` may be written, and returns its absolute place with links resolved.
/// Call it before and after the work.
///
/// Like [`open_audit`] for folders, it reports a place that cannot be written as an error of the
/// command line.
pub fn check_file(path: &Path, kind: Kind, rules: &Rules) -> Result<PathBuf, Error> {
    check_file_of("--out", path, kind, rules)
}

/// Checks the file that the option `option` names, as [`check_file`] does.
pub fn check_file_of(
    option: &str,
    path: &Path,
    kind: Kind,
    rules: &Rules,
) -> Result<PathBuf, Error> {
    let refused = |error: unlift_io::Error| Error::request(format!("{option}: {error}"));
    let place = rules.check(path, kind).map_err(refused)?;
    // Permissions alone do not show whether a file can be written.
    drop(OutputFile::create(path, Access::Private).map_err(refused)?);
    Ok(place)
}

/// The contents of an audit's output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Figures.
    Figures,
    /// Figures, and points in the page.
    Points,
    /// Figures, points in the page, and clouds.
    Clouds,
}

/// Opens the output folder of an audit.
pub fn open_audit(
    out: &Path,
    rules: Rules,
    shown: Shown,
    progress: &dyn Progress,
) -> Result<OutputSet, Error> {
    let access = if shown == Shown::Figures { Access::Usual } else { Access::Private };
    let earlier = clouds::earlier(out);
    let mut first = vec![(PAGE, Kind::Page), (FIGURES, Kind::AuditJson)];
    match shown {
        Shown::Clouds => first.extend(earlier.iter().map(|name| (name.as_str(), Kind::Cloud))),
        Shown::Figures if !earlier.is_empty() => {
            let folder = out.join(clouds::FOLDER);
            let what = "clouds of an earlier audit show points and are kept";
            progress.say(&format!("note: {}: {what}", folder.display()));
        }
        Shown::Figures | Shown::Points => {}
    }
    OutputSet::create(out, rules, access, &first).map_err(refused)
}

/// Stages a page and its figures under these names in `out`. They appear when `out` is committed.
pub fn stage_audit(
    out: &mut OutputSet,
    [page_name, figures_name]: [&str; 2],
    [page, figures]: [&str; 2],
    share_safe: bool,
) -> Result<(), unlift_io::Error> {
    let access = if share_safe { Access::Usual } else { Access::Private };
    let files = [(page_name, Kind::Page, page), (figures_name, Kind::AuditJson, figures)];
    for (name, kind, text) in files {
        let staged = out.stage(name, kind)?;
        unlift_io::atomic::write_file(&staged, access, |w| {
            std::io::Write::write_all(w, text.as_bytes())
        })?;
    }
    Ok(())
}
