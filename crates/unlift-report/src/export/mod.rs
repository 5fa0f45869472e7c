//! Figures for papers and for other programs: tables as CSV, LaTeX and Markdown, curves as SVG, and the table of the terminal.

mod curves;
mod tables;
mod terminal;

use crate::document::Document;
use crate::results::Results;

pub use curves::curves;
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
        TableFormat::Latex => tables::Grid::of(results, &within).latex(),
        TableFormat::Markdown => tables::Grid::of(results, &within).markdown(),
    }
}

/// Escapes `text` for content and quoted attributes. Characters that XML 1.0 does not allow become U+FFFD.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // Unescaped, they would become spaces in attributes.
            '\t' | '\n' | '\r' => out.push_str(&format!("&#{};", u32::from(c))),
            '\0'..='\x1f' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_would_read_as_its_own_is_escaped() {
        assert_eq!(escaped("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
        assert_eq!(escaped("ü\n\x1b"), "ü&#10;\u{fffd}");
    }
}
