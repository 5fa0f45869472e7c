//! Figures for papers and for other programs: tables as CSV, LaTeX and Markdown, curves as SVG, and the table of the terminal.

mod curves;
mod junit;
mod tables;
mod terminal;

use crate::document::Document;
use crate::results::Results;

pub use curves::curves;
pub use junit::junit;
pub use terminal::text_table;

/// The format of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Every row of `results`, a column per figure.
    Csv,
    /// Rows of schemes, columns of neighborhoods, by the strongest attack; for the package booktabs.
    Latex,
    /// The table of [`TableFormat::Latex`] in GitHub's Markdown.
    Markdown,
}

/// Returns the thresholds of a document, as typed, in their order.
pub fn thresholds(document: &Document) -> Vec<&str> {
    Results::of(document).thresholds
}

/// Returns the figures of `document` as a table, for the threshold `only` (as typed) or for all. The text ends
/// with a line break.
pub fn table(document: &Document, format: TableFormat, only: Option<&str>) -> String {
    let results = &Results::of(document);
    let within = only.map_or_else(|| results.thresholds.clone(), |typed| vec![typed]);
    match format {
        TableFormat::Csv => tables::csv(results, &within),
        TableFormat::Latex => tables::latex(results, &within),
        TableFormat::Markdown => tables::markdown(results, &within),
    }
}
