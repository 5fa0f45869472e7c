//! Where results go: checked before anything is computed, and never over what is not ours.

use std::path::{Path, PathBuf};

use unlift_io::atomic::{Access, Kind, OutputFile, OutputSet, Rules, sweep};

use crate::clouds;
use crate::{Error, Progress};

/// The page of an audit.
pub const PAGE: &str = "report.html";
/// The figures of an audit.
pub const FIGURES: &str = "audit.json";

/// An error of `--out`: of the command line, not of an input.
pub fn refused(error: unlift_io::Error) -> Error {
    Error::request(format!("--out: {error}"))
}

/// Whether the one file `path` may and can be written, asked before the work and after it; where it will stand, links
/// followed. What dead runs left unfinished beside it is cleared away.
///
/// One rule for every command, as [`open_audit`] has it for folders: a place where nothing can be written is an error of
/// the command line, a disk that fails later is none.
pub fn check_file(path: &Path, kind: Kind, rules: &Rules) -> Result<PathBuf, Error> {
    check_file_of("--out", path, kind, rules)
}

/// The same of the file that another option names.
pub fn check_file_of(
    option: &str,
    path: &Path,
    kind: Kind,
    rules: &Rules,
) -> Result<PathBuf, Error> {
    let refused = |error: unlift_io::Error| Error::request(format!("{option}: {error}"));
    let target = rules.check(path, kind).map_err(refused)?;
    // Begun and given up: permissions alone do not say it.
    drop(OutputFile::create(path, Access::Private).map_err(refused)?);
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
    sweep(folder.unwrap_or(Path::new(".")));
    Ok(target)
}

/// What an audit shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Figures.
    Figures,
    /// Points in the page.
    Points,
    /// Also clouds.
    Clouds,
}

/// Opens the folder that an audit goes to.
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
            let what = "clouds of an earlier audit show points, and stay";
            progress.say(&format!("note: {}: {what}", folder.display()));
        }
        Shown::Figures | Shown::Points => {}
    }
    OutputSet::create(out, rules, access, &first).map_err(refused)
}

/// Writes a page and its figures under these names into the folder that `out` was opened for; neither is in its place
/// before `out` is committed.
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
