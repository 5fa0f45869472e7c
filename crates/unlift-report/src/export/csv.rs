//! Every row of `results` as CSV (RFC 4180), for scripts and spreadsheets.

use crate::document::{ByThreshold, Row};
use crate::results::{Results, distinct};
use crate::table::{Table, figure};

/// Returns all rows, with a column per figure, or per threshold of `within` if a figure depends on it. Unknown cells are empty.
pub(super) fn csv(results: &Results<'_>, within: &[&str]) -> String {
    let number = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    // The command line recognizes its tables by the first four columns.
    let mut columns = vec![
        figure("scheme", |row: &Row| row.scheme.clone()),
        figure("neighbors", |row: &Row| row.neighbors.clone()),
        figure("oracle_noise", |row: &Row| row.oracle_noise.clone().unwrap_or_default()),
        figure("inlier_ratio", |row: &Row| row.inlier_ratio.to_string()),
        figure("k", |row: &Row| row.k.to_string()),
        figure("solver", |row: &Row| row.solver.clone()),
        figure("delta", |row: &Row| row.delta.to_string()),
        figure("unit", |row: &Row| row.unit.name().to_owned()),
        figure("n_points", |row: &Row| row.n_points.to_string()),
        figure("n_lost", |row: &Row| row.n_lost.to_string()),
        figure("n_dropped", |row: &Row| row.dropped.values().sum::<usize>().to_string()),
    ];
    for (name, shares) in BY_THRESHOLD {
        columns.extend(within.iter().map(|typed| {
            let share = move |row: &Row| number(shares(row).and_then(|of| of.get(*typed).copied()));
            figure(format!("{name}_within_{typed}"), share)
        }));
    }
    columns.extend(ALWAYS.map(|(name, value)| figure(name, move |row| number(value(row)))));
    for key in distinct(results.rows.iter().flat_map(|row| row.error_percentiles.keys())) {
        let error = move |row: &Row| number(row.error_percentiles.get(key).copied().flatten());
        columns.push(figure(format!("error_percentile_{key}"), error));
    }
    for name in distinct(results.rows.iter().flat_map(|row| row.metrics.keys())) {
        let metric = move |row: &Row| number(row.metrics.get(name).copied());
        columns.push(figure(format!("metric_{name}"), metric));
    }
    columns.push(figure("repeats", |row: &Row| row.repeats.to_string()));
    let table = Table::of("", "", results.rows, columns);
    let heads = table.columns.into_iter().map(|head| head.name).collect();
    [heads].iter().chain(&table.rows).map(|cells| line(cells)).collect()
}

type Shares = fn(&Row) -> Option<&ByThreshold>;

const BY_THRESHOLD: [(&str, Shares); 4] = [
    ("recovered_percent", |row| Some(&row.recovered_percent)),
    ("recovered_std", |row| Some(&row.std.as_ref()?.recovered_percent)),
    ("blind_percent", |row| Some(&row.blind_percent)),
    ("records_alone_percent", |row| row.records_alone_percent.as_ref()),
];

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
