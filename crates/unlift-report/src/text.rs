//! The short table for a terminal.

use crate::document::{Document, Row};
use crate::{tables, verdict, words};

/// One line per scheme, worst first: percent recovered within each threshold at the headline
/// inlier ratio, the blind attacker's percent, the break-even ratio.
///
/// Plain text, at most about 100 columns, ends with a line break.
pub fn text_table(document: &Document) -> String {
    let thresholds = tables::thresholds(document);
    let mut head = vec!["scheme".to_owned(), "solver".to_owned(), "right".to_owned()];
    head.extend(thresholds.iter().map(|typed| format!("{typed} {}", unit(document))));
    head.extend(["blind".to_owned(), "break-even".to_owned()]);
    let headline = tables::headline_threshold(document);
    let mut lines = vec![head];
    for card in verdict::verdict(document).cards {
        let Some(row) = verdict::headline(document, &card.scheme) else {
            continue;
        };
        for row in [row].into_iter().chain(verdict::other_sources(document, row)) {
            let mut cells = tables::key_cells(row);
            for typed in &thresholds {
                cells.push(percent(row.recovered_percent.get(typed)));
            }
            let blind = headline.as_ref().and_then(|typed| row.blind_percent.get(typed));
            cells.push(percent(blind));
            cells.push(break_even(document, row, headline.as_ref()));
            lines.push(cells);
        }
    }
    align(&lines)
}

fn percent(value: Option<&f64>) -> String {
    value.map_or("-".into(), |value| format!("{} %", words::percent(*value)))
}

fn unit(document: &Document) -> &'static str {
    match document.results.first().map(|row| row.unit) {
        Some(crate::document::LengthUnit::KthNeighbor) => "nd",
        Some(crate::document::LengthUnit::Pixel) => "px",
        _ => "m",
    }
}

fn break_even(document: &Document, row: &Row, typed: Option<&String>) -> String {
    use crate::document::Bound;
    let point = document.break_even.iter().find(|b| b.is_of(row) && Some(&b.threshold) == typed);
    match point.map(|p| (p.bound, p.inlier_ratio.map(words::ratio_percent))) {
        Some((Bound::Interpolated, Some(ratio))) => format!("{ratio} %"),
        Some((Bound::BelowTested, Some(ratio))) => format!("<= {ratio} %"),
        Some((Bound::AboveTested, Some(ratio))) => format!("> {ratio} %"),
        _ => "-".to_owned(),
    }
}

/// Columns two spaces apart; the first two flush left, numbers flush right.
fn align(lines: &[Vec<String>]) -> String {
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = lines.iter().filter_map(|line| line.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for line in lines {
        let mut row = String::new();
        for (column, cell) in line.iter().enumerate() {
            let width = widths[column];
            if column < 2 {
                row.push_str(&format!("{cell:<width$}  "));
            } else {
                row.push_str(&format!("{cell:>width$}  "));
            }
        }
        text.push_str(row.trim_end());
        text.push('\n');
    }
    text
}
