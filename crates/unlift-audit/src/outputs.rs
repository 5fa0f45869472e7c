//! Output files: checked before anything is computed; only files that unlift wrote are replaced.

use std::io::Write;
use std::path::{Path, PathBuf};

use unlift::OneLine;
use unlift_io::atomic::{Access, OutputFile, make_folders, write_file};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_report::scene::Scene3d;
use unlift_report::{
    Document, Opening, RenderOptions, Shares, gate_lines, render, shares, text_table,
};

use crate::Error;
use crate::audit::Output;

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
/// Like [`Output::open`] for folders, it reports a place that cannot be written as an error of the
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

/// The files of an audit, which were checked before the work.
pub struct Files {
    output: Output,
    set: OutputSet,
    rules: Rules,
}

const JUNIT: &str = "--junit";

impl Output {
    fn access(&self) -> Access {
        // If the results may be shared, others can read the folder.
        if self.share_safe { Access::Usual } else { Access::Private }
    }

    /// Opens the output folder of an audit, and checks the file for the results of gates, which is none of the report.
    pub fn open(&self, rules: Rules) -> Result<Files, Error> {
        let junit = self.junit.as_ref().map(|path| self.check_junit(path, &rules)).transpose()?;
        let first = [(PAGE, Kind::Page), (FIGURES, Kind::AuditJson)];
        let set = OutputSet::create(&self.folder, rules.clone(), self.access(), &first);
        let set = set.map_err(refused)?;
        let out = std::fs::canonicalize(&self.folder).unwrap_or_default();
        if let (Some(path), Some(target)) = (&self.junit, junit)
            && [PAGE, FIGURES].iter().any(|name| out.join(name) == target)
        {
            let path = path.display();
            let expected = "expected a file of its own, found one of --out";
            return Err(Error::request(format!("{JUNIT}: {path}: {expected}")));
        }
        Ok(Files { output: self.clone(), set, rules })
    }

    fn check_junit(&self, path: &Path, rules: &Rules) -> Result<PathBuf, Error> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.exists()) {
            // It may be the folder of the report.
            make_folders(folder, self.access())
                .map_err(|error| Error::request(format!("{JUNIT}: {error}")))?;
        }
        check_file_of(JUNIT, path, Kind::Junit, rules)
    }
}

/// The results of an audit, before they are written.
#[derive(Clone, Debug)]
pub struct Audited {
    /// The figures.
    pub document: Document,
    pub(crate) scene: Option<Scene3d>,
    pub(crate) drawn: RenderOptions,
}

/// A written audit.
pub struct Finished {
    /// The figures, as written.
    pub document: Document,
    /// The path of the report.
    pub report: PathBuf,
}

impl Audited {
    /// Renders the self-contained page.
    pub fn page(&self, share_safe: bool) -> Result<String, Error> {
        let options = RenderOptions { share_safe, ..self.drawn.clone() };
        Ok(render(&self.document, self.scene.as_ref(), &options)?)
    }

    /// Returns the recovered shares of every scheme, the largest first.
    pub fn shares(&self) -> Vec<Shares> {
        shares(&self.document, &self.drawn.inversions)
    }

    /// Puts the verdict and pictures of `first` at the top of this audit's page, under `title`.
    /// `details` is a link to the page of `first`.
    #[must_use]
    pub fn opening_with(mut self, first: &Self, title: &str, details: &str) -> Self {
        let inversions = &first.drawn.inversions;
        self.drawn.opening = Some(Opening::titled(&first.document, inversions, title, details));
        self
    }

    /// Stages page and figures under `names` in `out`. They appear when `out` is committed.
    pub fn stage(
        &self,
        out: &mut OutputSet,
        names: [&str; 2],
        share_safe: bool,
    ) -> Result<Document, Error> {
        let page = self.page(share_safe)?;
        let document = if share_safe { self.document.share_safe() } else { self.document.clone() };
        let access = if share_safe { Access::Usual } else { Access::Private };
        let texts = [(Kind::Page, page), (Kind::AuditJson, document.to_json()?)];
        for (name, (kind, text)) in names.into_iter().zip(texts) {
            write_file(&out.stage(name, kind)?, access, |w| w.write_all(text.as_bytes()))?;
        }
        Ok(document)
    }

    /// Writes page and figures, both or none, and the results of gates.
    pub fn write(&self, files: Files) -> Result<Finished, Error> {
        let Files { output, mut set, rules } = files;
        let document = self.stage(&mut set, [PAGE, FIGURES], output.share_safe)?;
        set.commit()?;
        if let Some(path) = &output.junit {
            check_file_of(JUNIT, path, Kind::Junit, &rules)?;
            let text = unlift_report::junit(&document);
            write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?;
        }
        Ok(Finished { document, report: output.folder.join(PAGE) })
    }
}

impl Finished {
    /// Returns true if every gate held.
    pub fn passed(&self) -> bool {
        self.document.gates.iter().all(|gate| gate.passed)
    }

    /// Returns the short table, the results of the gates and the path of the report.
    pub fn text(&self) -> String {
        let mut text = text_table(&self.document);
        text.push_str(&gate_lines(&self.document));
        text.push_str(&format!("\nreport: {}\n", OneLine(self.report.display())));
        text
    }
}
