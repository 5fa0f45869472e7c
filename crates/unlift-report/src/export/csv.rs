//! Every row of `results` as CSV (RFC 4180), for scripts and spreadsheets.

use crate::document::{ByThreshold, Document, Row};
use crate::page::tables::distinct;

/// Returns all rows, with a column per figure, or per threshold of `within` if a figure depends on it. Unknown cells are empty.
pub(super) fn csv(document: &Document, within: &[String]) -> String {
    let rows = &document.results;
    let names = distinct(rows.iter().flat_map(|row| row.metrics.keys()));
    let percentiles = distinct(rows.iter().flat_map(|row| row.error_percentiles.keys()));
    // The command line recognizes its tables by the first four columns.
    let mut heads: Vec<String> = [
        "scheme",
        "neighbors",
        "oracle_noise",
        "inlier_ratio",
        "k",
        "solver",
        "delta",
        "unit",
        "n_points",
        "n_lost",
        "n_dropped",
    ]
    .map(str::to_owned)
    .to_vec();
    for figure in ["recovered_percent", "recovered_std", "blind_percent", "records_alone_percent"] {
        heads.extend(within.iter().map(|typed| format!("{figure}_within_{typed}")));
    }
    heads.extend(ALWAYS.map(|(name, _)| name.to_owned()));
    heads.extend(percentiles.iter().map(|percentile| format!("error_percentile_{percentile}")));
    heads.extend(names.iter().map(|name| format!("metric_{name}")));
    heads.push("repeats".to_owned());
    let mut text = line(&heads);
    for row in rows {
        text.push_str(&line(&cells(row, within, &percentiles, &names)));
    }
    text
}

type Figure = fn(&Row) -> Option<f64>;

const ALWAYS: [(&str, Figure); 7] = [
    ("axis_accuracy_percent", |row| row.axis_accuracy_percent),
    ("exact_percent", |row| row.exact_percent),
    ("assignment_accuracy_percent", |row| row.assignment_accuracy_percent),
    ("sure_percent", |row| row.sure_percent),
    ("sure_correct_percent", |row| row.sure_correct_percent),
    ("median_error", |row| row.median_error),
    ("blind_median_error", |row| row.blind_median_error),
];

fn cells(
    row: &Row,
    within: &[String],
    percentiles: &[&String],
    metrics: &[&String],
) -> Vec<String> {
    let number = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    let mut cells = vec![
        row.scheme.clone(),
        row.neighbors.clone(),
        row.oracle_noise.clone().unwrap_or_default(),
        row.inlier_ratio.to_string(),
        row.k.to_string(),
        row.solver.clone(),
        row.delta.to_string(),
        row.unit.name().to_owned(),
        row.n_points.to_string(),
        row.n_lost.to_string(),
        row.dropped.values().sum::<usize>().to_string(),
    ];
    let spread = row.std.as_ref().map(|std| &std.recovered_percent);
    let by_threshold: [Option<&ByThreshold>; 4] = [
        Some(&row.recovered_percent),
        spread,
        Some(&row.blind_percent),
        row.records_alone_percent.as_ref(),
    ];
    for shares in by_threshold {
        let share = |typed| number(shares.and_then(|shares| shares.get(typed).copied()));
        cells.extend(within.iter().map(share));
    }
    cells.extend(ALWAYS.map(|(_, figure)| number(figure(row))));
    let percentile = |key: &&String| number(row.error_percentiles.get(*key).copied().flatten());
    cells.extend(percentiles.iter().map(percentile));
    cells.extend(metrics.iter().map(|name| number(row.metrics.get(*name).copied())));
    cells.push(row.repeats.to_string());
    cells
}

fn line(cells: &[String]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| quoted(cell)).collect();
    cells.join(",") + "\n"
}

/// Quotes a cell. Text that a spreadsheet would take for a formula gets a leading `'`.
fn quoted(cell: &str) -> String {
    let is_formula =
        cell.starts_with(['=', '+', '-', '@', '\t', '\r']) && cell.parse::<f64>().is_err();
    let mark = if is_formula { "'" } else { "" };
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{mark}{}\"", cell.replace('"', "\"\"")),
        false => format!("{mark}{cell}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_marks_of_the_format_are_quoted() {
        let cells = ["a,b", "say \"c\"", "plain"].map(str::to_owned);
        assert_eq!(line(&cells), "\"a,b\",\"say \"\"c\"\"\",plain\n");
    }

    #[test]
    fn no_cell_is_a_formula() {
        let cells =
            ["=HYPERLINK(\"x\")", "+1+1", "-x", "@SUM(1)", "-1.5", "ppl+"].map(str::to_owned);
        assert_eq!(line(&cells), "\"'=HYPERLINK(\"\"x\"\")\",'+1+1,'-x,'@SUM(1),-1.5,ppl+\n");
    }
}
