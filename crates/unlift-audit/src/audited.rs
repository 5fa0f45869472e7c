use std::path::{Path, PathBuf};

use unlift::OneLine;
use unlift_io::atomic::OutputSet;
use unlift_report::scene::Scene3d;
use unlift_report::{
    Document, Opening, RenderOptions, Shares, gate_lines, render, shares, text_table,
};

use crate::Error;
use crate::outputs::{FIGURES, PAGE, stage_audit};

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
    ///
    /// # Errors
    /// If rendering fails.
    pub fn page(&self, share_safe: bool) -> Result<String, Error> {
        let options = RenderOptions { share_safe, ..self.drawn.clone() };
        Ok(render(&self.document, self.scene.as_ref(), &options)?)
    }

    /// Returns the recovered shares of every scheme, the largest first.
    pub fn shares(&self) -> Vec<Shares> {
        shares(&self.document, &self.drawn.inversions)
    }

    /// Puts the verdict and pictures of `other` at the top of this audit's page, under `title`.
    /// `details` is a link to the page of `other`.
    #[must_use]
    pub fn opening_with(mut self, other: &Self, title: &str, details: &str) -> Self {
        let inversions = &other.drawn.inversions;
        self.drawn.opening = Some(Opening::titled(&other.document, inversions, title, details));
        self
    }

    /// Stages page and figures under `names` in `out`. They appear when `out` is committed.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn stage(
        &self,
        out: &mut OutputSet,
        names: [&str; 2],
        share_safe: bool,
    ) -> Result<Document, Error> {
        let page = self.page(share_safe)?;
        let document = if share_safe { self.document.share_safe() } else { self.document.clone() };
        stage_audit(out, names, [&page, &document.to_json()?], share_safe)?;
        Ok(document)
    }

    /// Writes page and figures to `folder`, for which `out` was opened: both or none. With
    /// `share_safe` they contain figures only.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(
        &self,
        mut out: OutputSet,
        folder: &Path,
        share_safe: bool,
    ) -> Result<Finished, Error> {
        let document = self.stage(&mut out, [PAGE, FIGURES], share_safe)?;
        out.commit()?;
        Ok(Finished { document, report: folder.join(PAGE) })
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
