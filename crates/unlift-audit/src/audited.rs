//! What an audit found, of a map or of images, before it is written and after.

use std::path::{Path, PathBuf};

use unlift::OneLine;
use unlift_io::atomic::OutputSet;
use unlift_report::scene::Scene3d;
use unlift_report::{
    Document, Opening, RenderOptions, Shares, gate_lines, render, shares, text_table,
};

use crate::Error;
use crate::outputs::{FIGURES, PAGE, stage_audit};

/// What an audit found, before it is written.
#[derive(Clone, Debug)]
pub struct Audited {
    /// The figures.
    pub document: Document,
    pub(crate) scene: Option<Scene3d>,
    /// What the page draws beside: curves and pictures.
    pub(crate) drawn: RenderOptions,
}

/// What an audit left behind.
pub struct Finished {
    /// The figures, as written.
    pub document: Document,
    /// Where the report is.
    pub report: PathBuf,
}

impl Audited {
    /// The page, self-contained.
    ///
    /// # Errors
    /// When it cannot be rendered.
    pub fn page(&self, share_safe: bool) -> Result<String, Error> {
        let options = RenderOptions { share_safe, ..self.drawn.clone() };
        Ok(render(&self.document, self.scene.as_ref(), &options)?)
    }

    /// What came back of every scheme, the worst first.
    pub fn shares(&self) -> Vec<Shares> {
        shares(&self.document, &self.drawn.inversions)
    }

    /// Puts the verdict and pictures of `other` before this audit's on its page, under `title`. `details` is a link to
    /// the page of `other`.
    #[must_use]
    pub fn opening_with(mut self, other: &Self, title: &str, details: &str) -> Self {
        let inversions = &other.drawn.inversions;
        self.drawn.opening = Some(Opening::titled(&other.document, inversions, title, details));
        self
    }

    /// Writes page and figures under these names into the folder that `out` was opened for; they appear when `out` is
    /// committed.
    ///
    /// # Errors
    /// When they cannot be written.
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

    /// Writes page and figures into the folder that `out` was opened for, both or none; `share_safe`: figures only.
    ///
    /// # Errors
    /// When they cannot be written.
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
    /// Whether every gate held.
    pub fn passed(&self) -> bool {
        self.document.gates.iter().all(|gate| gate.passed)
    }

    /// The short table, how gates ended, and where the report is.
    pub fn text(&self) -> String {
        let mut text = text_table(&self.document);
        text.push_str(&gate_lines(&self.document));
        text.push_str(&format!("\nreport: {}\n", OneLine(self.report.display())));
        text
    }
}
