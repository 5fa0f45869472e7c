//! Figures for papers and for other programs: tables as CSV and LaTeX, and the table of the terminal.

mod tables;
mod terminal;

use crate::document::Document;
use crate::results::Results;

pub use tables::{csv, latex};
pub use terminal::text_table;

/// Returns the thresholds of a document, as typed, in their order.
pub fn thresholds(document: &Document) -> Vec<&str> {
    Results::of(document).thresholds
}
