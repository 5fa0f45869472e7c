//! The opening of a page.

use serde::Serialize;

use crate::document::{Document, LengthUnit};
use crate::exhibit::{Exhibit, exhibits};
use crate::inversions::Inversion;
use crate::verdict::{Verdict, verdict};

/// The opening of a page: the verdict on an audit, and its pictures if it has any.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Opening {
    title: Option<String>,
    details: Option<String>,
    verdict: Verdict,
    exhibits: Vec<Exhibit>,
    notes: Vec<String>,
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

    /// Returns the opening of another audit under a title; `details` is a link to that audit's own
    /// page.
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
