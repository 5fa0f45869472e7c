//! Figures for papers and for other programs: tables as CSV, LaTeX and Markdown, curves as SVG.

mod csv;
mod curves;
mod grid;
mod typeset;

use crate::document::Document;
use crate::tables;

pub use curves::curves;

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
pub fn thresholds(document: &Document) -> Vec<String> {
    tables::thresholds(document)
}

/// Returns the figures of `document` as a table, for the threshold `only` (as typed) or for all. The text ends
/// with a line break.
pub fn table(document: &Document, format: TableFormat, only: Option<&str>) -> String {
    let within: Vec<String> = match only {
        Some(typed) => vec![typed.to_owned()],
        None => tables::thresholds(document),
    };
    match format {
        TableFormat::Csv => csv::csv(document, &within),
        TableFormat::Latex => typeset::latex(document, &grid::grid(document, &within)),
        TableFormat::Markdown => typeset::markdown(document, &grid::grid(document, &within)),
    }
}
