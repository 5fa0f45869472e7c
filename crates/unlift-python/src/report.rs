//! Results of an audit.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use unlift_audit::{Audited, Output};
use unlift_io::outputs::Rules;

use crate::arrays::raised;
use crate::hidden::refused;

/// Results of an audit: numbers, and a page that shows them.
#[pyclass(frozen, subclass, module = "unlift")]
pub struct Report(pub Arc<Audited>);

#[pymethods]
impl Report {
    /// Adds to a report of the native module what Python adds.
    #[new]
    fn new(native: &Bound<'_, Self>) -> Self {
        Self(Arc::clone(&native.get().0))
    }

    /// True if every gate held and every image could be used.
    #[getter]
    fn passed(&self) -> bool {
        let document = &self.0.document;
        // Results over fewer images than requested decide no gate.
        let all_used = document.input.images.as_ref().is_none_or(|images| images.unusable == 0);
        all_used && document.gates.iter().all(|gate| gate.passed)
    }

    /// Returns the text of `audit.json`.
    #[pyo3(signature = (*, share_safe=false))]
    fn json(&self, share_safe: bool) -> PyResult<String> {
        let document = &self.0.document;
        let text = if share_safe { document.share_safe().to_json() } else { document.to_json() };
        text.map_err(raised)
    }

    /// Returns the page, one self-contained HTML file.
    #[pyo3(signature = (*, share_safe=false))]
    fn html(&self, py: Python<'_>, share_safe: bool) -> PyResult<String> {
        py.detach(|| self.0.page(share_safe)).map_err(raised)
    }

    /// Writes `report.html` and `audit.json` into the folder `out`, both or none; with
    /// `share_safe`, numbers only. Replaces files that are not of an audit only with `force`.
    #[pyo3(signature = (out, *, share_safe=false, force=false))]
    fn save(
        &self,
        py: Python<'_>,
        out: PathBuf,
        share_safe: bool,
        force: bool,
    ) -> PyResult<PathBuf> {
        py.detach(|| {
            let output = Output { share_safe, ..Output::new(&out) };
            let files = output.open(Rules::new([], force)).map_err(refused)?;
            Ok(self.0.write(files).map_err(raised)?.report)
        })
    }

    /// Returns the table that the command line prints, and the results of gates.
    fn __str__(&self) -> String {
        let document = &self.0.document;
        unlift_report::text_table(document) + &unlift_report::gate_lines(document)
    }

    fn __repr__(&self) -> String {
        format!("<unlift.Report: {} rows>", self.0.document.results.len())
    }
}
