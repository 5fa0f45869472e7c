//! The short table for a terminal.

use unlift::Unit;

use crate::attack::{self, Basis};
use crate::document::{Bound, Document, NotAudited, Row, STRONGEST};
use crate::page::cost;
use crate::page::tables::{SPREAD_THAT_COUNTS, percent_cell};
use crate::page::verdict::{self, Card, Verdict};
use crate::results::Results;
use crate::table::{Column, Table, figure, label};
use crate::words::{self, percent_or_dash};

/// Returns the verdict in two lines, then a table with a few lines per scheme, the worst first: every source tried, the
/// records alone, and the oracle at the headline inlier ratio. Columns are the percentages within each threshold, a
/// blind guess and the break-even ratio.
///
/// The text has at most about 100 columns and ends with a line break.
pub fn text_table(document: &Document) -> String {
    let results = &Results::of(document);
    let Verdict { banner, cards, .. } = verdict::verdict(results);
    let extent = document.input.extent().map(|extent| format!(" ({extent}, without outliers)"));
    let extent = extent.unwrap_or_default();
    let lines = |sentences: Vec<String>| {
        let lines =
            sentences.into_iter().chain(results.doubts()).chain(verdict::not_tried(results));
        lines.collect::<Vec<_>>().join("\n")
    };
    let (reasons, figures) = if results.is_sequence() {
        (lines(verdict::sequence_sentences(results)), sequence(results))
    } else if results.is_again() {
        (lines(verdict::again_sentences(results)), again(results))
    } else {
        (banner.sentence, by_scheme(results, &cards))
    };
    format!("{}{extent}\n{reasons}\n\n{figures}", banner.headline)
}

fn by_scheme(results: &Results<'_>, cards: &[Card]) -> String {
    let (headline, unit) = (results.headline, unit(results));
    let mut heads = ["scheme", "neighbors by", "true", "solver"].map(str::to_owned).to_vec();
    heads.extend(results.thresholds.iter().map(|typed| format!("{typed} {unit}")));
    heads.extend(["blind", "break-even"].map(str::to_owned));
    let mut table = vec![heads];
    let mut shown = 0;
    for card in cards {
        let rows = results.by_source(&card.scheme);
        let from = table.len();
        table.extend(rows.iter().map(|row| of_attack(results, row)));
        shown += rows.len();
        if let (Some(first), Some((alone, by))) =
            (rows.first(), results.records_alone(&card.scheme, headline))
        {
            let is_less =
                |row: &&Row| attack::basis(row) == Basis::Oracle || alone > results.share(row);
            let at = rows.iter().position(is_less).unwrap_or(rows.len());
            table.insert(from + at, of_records_alone(results, first, by));
        }
    }
    let mut text = words::align(&table, &[0, 1, 3]);
    if results.thresholds.len() > 1 {
        text.push_str(&format!("blind, break-even: within {headline} {unit}\n"));
    }
    text.push_str("true: share of the listed neighbors that are among the nearest\n");
    if results.unit == Unit::KthNeighbor {
        text.push_str(&format!("x: times {} (K = {})\n", words::USUAL_DISTANCE, results.k()));
    }
    let more = results.rows.len() - shown;
    if more > 0 {
        text.push_str(&format!(
            "not shown, but in the report: {more} of other inlier ratios or solvers\n"
        ));
    }
    if results.rows.iter().any(|row| row.std.is_some()) {
        text += &format!("±: standard deviation over seeds, shown above {SPREAD_THAT_COUNTS}\n");
    }
    text.push_str(&cost::text(results));
    for NotAudited { scheme, neighbors, reason, .. } in &results.document.not_audited {
        // The reason of a source may begin with the source's name.
        text.push_str(&match neighbors {
            None => format!("not audited: {scheme}: {reason}\n"),
            Some(by) => {
                let reason = reason.strip_prefix(&format!("{by}: ")).unwrap_or(reason);
                format!("not audited: {scheme} by {by}: {reason}\n")
            }
        });
    }
    text
}

fn unit(results: &Results<'_>) -> &'static str {
    if results.unit == Unit::KthNeighbor { "x" } else { words::sign(results.unit) }
}

fn of_attack(results: &Results<'_>, row: &Row) -> Vec<String> {
    let share = |typed: &&str| match row.recovered_percent.get(*typed) {
        None => "-".to_owned(),
        share => {
            let spread = row.std.as_ref().and_then(|std| std.recovered_percent.get(*typed));
            format!("{} %", percent_cell(share, spread))
        }
    };
    let mut cells = vec![row.scheme.clone(), attack::source(row), right(row), row.solver.clone()];
    cells.extend(results.thresholds.iter().map(share));
    cells.extend([blind(results, row), break_even(results, row)]);
    cells
}

/// Returns the cells of the best attack on the records alone; `row` is any of the scheme.
fn of_records_alone(results: &Results<'_>, row: &Row, by: Option<&str>) -> Vec<String> {
    let share = |typed: &&str| {
        percent_or_dash(results.records_alone(&row.scheme, typed).map(|alone| alone.0))
    };
    let (name, by) = (attack::records_alone(None), by.unwrap_or_default().to_owned());
    let mut cells = vec![row.scheme.clone(), name, "-".to_owned(), by];
    cells.extend(results.thresholds.iter().map(share));
    cells.extend([blind(results, row), "-".to_owned()]);
    cells
}

fn right(row: &Row) -> String {
    format!("{} %", words::ratio_percent(row.inlier_ratio))
}

fn blind(results: &Results<'_>, row: &Row) -> String {
    percent_or_dash(row.blind_percent.get(results.headline).copied())
}

/// Returns the break-even ratio of the curve with this row; a dash for rows that are not the oracle's, or without a curve.
fn break_even(results: &Results<'_>, row: &Row) -> String {
    let noise = attack::noise(&row.oracle_noise);
    let mut points = results.document.break_even.iter().filter(|point| {
        attack::basis(row) == Basis::Oracle
            && point.scheme == row.scheme
            && (point.solver == row.solver || point.solver == STRONGEST)
            && attack::noise(&point.oracle_noise) == noise
            && point.threshold == results.headline
    });
    let is_other =
        |other: &Row| other.oracle_noise.is_some() && other.inlier_ratio != row.inlier_ratio;
    let has_curve = results.of_scheme(&row.scheme).any(is_other);
    let Some(point) = points.next().filter(|_| has_curve) else { return "-".to_owned() };
    let bound = match point.bound {
        Bound::Interpolated => "",
        Bound::BelowTested => "<= ",
        Bound::AboveTested => "> ",
    };
    format!("{bound}{} %", words::ratio_percent(point.inlier_ratio))
}

/// Returns a column per threshold: what a row recovers.
fn shares<'a>(results: &'a Results<'_>) -> impl Iterator<Item = Column<'a, Row>> {
    results.thresholds.iter().map(move |typed| {
        let share = |row: &Row| percent_or_dash(row.recovered_percent.get(*typed).copied());
        figure(format!("{typed} {}", unit(results)), share)
    })
}

fn metric<'a>(head: impl Into<String>, name: String) -> Column<'a, Row> {
    figure(head, move |row: &Row| percent_or_dash(row.metrics.get(&name).copied()))
}

/// Returns the table of a sequence: rows by scheme and number of queries.
fn sequence(results: &Results<'_>) -> String {
    let links = |row: &Row| match attack::queries(&row.neighbors) {
        _ if attack::basis(row) == Basis::Oracle => "tracks".to_owned(),
        Some((attack::SEQUENCE_AND_LISTS, _)) => "descriptors, lists".to_owned(),
        _ => "descriptors".to_owned(),
    };
    let headline = results.headline;
    let mut columns = vec![
        label("scheme", |row: &Row| row.scheme.clone()),
        figure("queries", |row: &Row| row.k.to_string()),
        label("links by", links),
        figure("right", right),
    ];
    columns.extend(shares(results));
    columns.push(figure("blind", |row: &Row| blind(results, row)));
    for of in ["linked", "tracked", "new"] {
        columns.push(metric(of, format!("{of}_percent")));
        columns.push(metric(format!("of {of}"), format!("{of}_within_{headline}_percent")));
    }
    Table::of("", "", results.rows, columns).text()
        + &format!(
            "right: share of the links that the model confirms, where it knows both keypoints\n\
             linked: keypoints linked in three or more views; tracked: by the model's tracks\n\
             lists: neighbors within each query, made from its descriptors\n\
             new: keypoints that show no point of the service's map\n\
             blind, of linked, of tracked, of new: within {headline} px\n"
        )
}

fn again(results: &Results<'_>) -> String {
    let links = |row: &Row| match row.neighbors.as_str() {
        attack::AGAIN => "descriptors".to_owned(),
        _ => "geometry".to_owned(),
    };
    let (headline, unit) = (results.headline, unit(results));
    let alone = |row: &Row| row.records_alone_percent.as_ref()?.get(headline).copied();
    let mut columns =
        vec![label("schemes", |row: &Row| row.scheme.clone()), label("links by", links)];
    columns.extend(shares(results));
    columns.extend([
        metric("linked", "linked_percent".to_owned()),
        figure("right", |row: &Row| percent_or_dash(Some(100.0 * row.inlier_ratio))),
        metric("of linked", format!("linked_within_{headline}_percent")),
        figure("sure", |row: &Row| percent_or_dash(row.sure_percent)),
        figure("right", |row: &Row| percent_or_dash(row.sure_correct_percent)),
        figure("blind", |row: &Row| blind(results, row)),
        figure("alone", move |row: &Row| percent_or_dash(alone(row))),
    ]);
    let refused = results.document.not_audited.iter().map(|missing| {
        let by = missing.neighbors.as_deref().unwrap_or_default();
        format!("not audited: {}, {by}: {}\n", missing.scheme, missing.reason)
    });
    let table = Table::of("", "", results.rows, columns).text();
    let refused: String = refused.collect();
    format!(
        "{table}linked, right: points with a record in both releases, and the share of right ones\n\
         sure, right: points that should be within {headline} {unit} at 90 % and more, and how many are\n\
         of linked, blind, alone: within {headline} {unit}; alone: the first release without descriptors\n{refused}"
    )
}
