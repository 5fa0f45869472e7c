//! What a page begins with.

use serde::Serialize;

use crate::document::{Document, LengthUnit};
use crate::exhibit::{Exhibit, exhibits};
use crate::inversions::Inversion;
use crate::verdict::{Verdict, verdict};

/// What a page begins with: the verdict on an audit, and its pictures if it has any.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Opening {
    /// Stands above the verdict where a page has several.
    title: Option<String>,
    /// A page with the details, as a link relative to this one.
    details: Option<String>,
    verdict: Verdict,
    exhibits: Vec<Exhibit>,
    notes: Vec<String>,
    /// Whether it is about images.
    images: bool,
}

impl Opening {
    pub(crate) fn of(document: &Document, inversions: &[Inversion]) -> Self {
        Self {
            title: None,
            details: None,
            verdict: verdict(document),
            exhibits: exhibits(document, inversions),
            notes: document.notes.clone(),
            images: document.results.first().is_some_and(|row| row.unit == LengthUnit::Pixel),
        }
    }

    /// The opening of another audit under this title, whose own page `details` is a link to.
    pub fn titled(
        document: &Document,
        inversions: &[Inversion],
        title: &str,
        details: &str,
    ) -> Self {
        let (title, details) = (Some(title.to_owned()), Some(details.to_owned()));
        Self { title, details, ..Self::of(document, inversions) }
    }
}
