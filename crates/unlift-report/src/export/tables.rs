//! Tables for papers and for other programs: every row as CSV (RFC 4180); in LaTeX a row per scheme, and a column per kind of
//! neighborhoods.

use crate::attack;
use crate::document::{ByThreshold, Document, Row};
use crate::page::curves::givens;
use crate::page::tables::percent_cell;
use crate::results::{Results, distinct};
use crate::table::{NONE, Table, figure, label};
use crate::words;

/// Returns all rows, with a column per figure, or per threshold of `within` (as typed) if a figure depends on it. Unknown cells are
/// empty. The text ends with a line break.
pub fn csv(document: &Document, within: &[&str]) -> String {
    let results = &Results::of(document);
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
    let line = |cells: &Vec<String>| {
        cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n"
    };
    [table.heads()].iter().chain(&table.rows).map(line).collect()
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

/// The cell of a figure that the audit could not measure; it must not look like a small one.
const NOT_AUDITED: &str = "not audited";

/// Returns the strongest attack per scheme and neighborhoods, and the two baselines; cells have a figure per threshold of
/// `within`.
fn grid(results: &Results<'_>, within: &[&str]) -> Table {
    let joined = |cell: &dyn Fn(&str) -> String| {
        within.iter().map(|typed| cell(typed)).collect::<Vec<_>>().join(" / ")
    };
    let by = |scheme: &str, given: &Row| {
        let row = |typed: &str| results.strongest_given(scheme, given, typed);
        if within.first().is_none_or(|typed| row(typed).is_none()) {
            let refusal = results.refusal(scheme, Some(&given.neighbors));
            return if refusal.is_some() { NOT_AUDITED } else { NONE }.to_owned();
        }
        joined(&|typed| {
            let row = row(typed);
            let spread = row.and_then(|row| row.std.as_ref()?.recovered_percent.get(typed));
            percent_cell(row.and_then(|row| row.recovered_percent.get(typed)), spread)
        })
    };
    let blind =
        |scheme: &&str| joined(&|typed| percent_cell(results.blind(scheme, typed).as_ref(), None));
    let alone = |scheme: &&str| {
        joined(&|typed| {
            let alone = results.records_alone(scheme, typed).map(|(percent, _)| percent);
            percent_cell(alone.as_ref(), None)
        })
    };
    let mut columns = vec![label("scheme", |scheme: &&str| (*scheme).to_owned())];
    let by = &by;
    columns.extend(
        givens(results)
            .into_iter()
            .map(|given| figure(head(given), move |scheme: &&str| by(scheme, given))),
    );
    columns.push(figure("blind", blind));
    if results.rows.iter().any(|row| row.records_alone_percent.is_some()) {
        columns.push(figure(attack::records_alone(None), alone));
    }
    let mut table = Table::of("", caption(results, within), &results.schemes, columns);
    for (scheme, _) in results.refused() {
        let mut cells = vec![NOT_AUDITED.to_owned(); table.columns.len()];
        cells[0] = scheme.to_owned();
        table.rows.push(cells);
    }
    table
}

/// Returns a `tabular` with the rules of booktabs: schemes by neighborhoods, by the strongest attack, with a figure per threshold
/// of `within` (as typed). The text ends with a line break.
pub fn latex(document: &Document, within: &[&str]) -> String {
    let results = &Results::of(document);
    let table = grid(results, within);
    let line = |cells: &Vec<String>| {
        let cells: Vec<String> = cells.iter().map(|cell| in_latex(cell)).collect();
        format!("{} \\\\\n", cells.join(" & "))
    };
    format!(
        "% unlift {}, seed {}; \\usepackage{{booktabs}}\n% {}\n\\begin{{tabular}}{{l{}}}\n\\toprule\n{}\\midrule\n{}\\bottomrule\n\\end{{tabular}}\n",
        on_one_line(&document.unlift),
        document.seed,
        on_one_line(&table.caption),
        "r".repeat(table.columns.len() - 1),
        line(&table.heads()),
        table.rows.iter().map(line).collect::<String>()
    )
}

fn caption(results: &Results<'_>, within: &[&str]) -> String {
    let points = results.points();
    let within: Vec<String> = within.iter().map(|typed| results.threshold(typed)).collect();
    let mut text = format!(
        "Percent of the {points} recovered within {}, by the strongest attack tried. Columns: the share of right \
         neighbors in the lists of an oracle, or another source of lists; blind is a guess without neighborhoods.",
        within.join(" / ")
    );
    let repeats = results.rows.iter().map(|row| row.repeats).max().unwrap_or(1);
    if repeats > 1 {
        text.push_str(&format!(" Means over {repeats} seeds."));
    }
    if within.iter().any(|text| text.ends_with('×')) {
        text.push_str(&format!(" × is times {}.", words::USUAL_DISTANCE));
    }
    text
}

/// Returns a short head: `0.5`, `0.5 (near)` or `overlap`.
fn head(given: &Row) -> String {
    match attack::noise(&given.oracle_noise) {
        _ if !attack::is_oracle(&given.neighbors) => attack::source(given),
        "uniform" => format!("{:?}", given.inlier_ratio),
        noise => format!("{:?} ({noise})", given.inlier_ratio),
    }
}

fn on_one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn in_latex(text: &str) -> String {
    let escape = |c: char| match c {
        '\\' => "\\textbackslash{}".to_owned(),
        '~' => "\\textasciitilde{}".to_owned(),
        '^' => "\\textasciicircum{}".to_owned(),
        '<' => "\\textless{}".to_owned(),
        '>' => "\\textgreater{}".to_owned(),
        '|' => "\\textbar{}".to_owned(),
        '&' | '%' | '$' | '#' | '_' | '{' | '}' => format!("\\{c}"),
        '±' => "$\\pm$".to_owned(),
        '×' => "$\\times$".to_owned(),
        '–' => "--".to_owned(),
        _ => c.to_string(),
    };
    on_one_line(text).chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_marks_of_the_format_are_quoted_and_none_is_a_formula() {
        for (cell, expected) in [
            ("a,b", "\"a,b\""),
            ("say \"c\"", "\"say \"\"c\"\"\""),
            ("plain", "plain"),
            ("=HYPERLINK(\"x\")", "\"'=HYPERLINK(\"\"x\"\")\""),
            ("+1+1", "'+1+1"),
            ("-x", "'-x"),
            ("@SUM(1)", "'@SUM(1)"),
            ("-1.5", "-1.5"),
            ("ppl+", "ppl+"),
        ] {
            assert_eq!(quoted(cell), expected);
        }
    }

    #[test]
    fn what_is_markup_is_escaped() {
        assert_eq!(in_latex("a_b & 5 % ± 0.7"), "a\\_b \\& 5 \\% $\\pm$ 0.7");
        assert_eq!(in_latex("\\input{x}\n"), "\\textbackslash{}input\\{x\\} ");
    }
}
