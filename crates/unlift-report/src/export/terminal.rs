//! The short table for a terminal.

use unlift::Unit;

use crate::attack::{self, Basis};
use crate::document::{Bound, Document, Row, STRONGEST};
use crate::page::cost_text;
use crate::page::tables::percent_cell;
use crate::page::verdict::{self, Verdict};
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
    let extent = document.input.extent().map(|extent| format!(" ({extent})"));
    let first = banner.headline + &extent.unwrap_or_default();
    let lines = |sentences: Vec<String>| sentences.join("\n");
    if results.is_sequence() {
        let sentences = lines(verdict::sequence_sentences(results));
        return format!("{first}\n{sentences}\n\n{}", sequence(results));
    }
    if results.is_again() {
        let sentences = lines(verdict::again_sentences(results));
        return format!("{first}\n{sentences}\n\n{}", again(results));
    }
    let mut lines: Vec<Line<'_>> = Vec::new();
    for card in &cards {
        let scheme = card.scheme.as_str();
        let rows = results.by_source(scheme);
        let Some(strongest) = rows.first() else { continue };
        let alone = results.records_alone(scheme, results.headline);
        let mut alone = alone.map(|(share, by)| (share, Line::Alone(strongest, by)));
        for row in rows {
            let is_oracle = attack::basis(row) == Basis::Oracle;
            let share = results.share(row);
            let alone = alone.take_if(|(alone, _)| is_oracle || *alone > share);
            lines.extend(alone.map(|(_, line)| line).into_iter().chain([Line::Attack(row)]));
        }
        lines.extend(alone.map(|(_, line)| line));
    }
    let text = format!("{first}\n{}\n\n{}", banner.sentence, table(results, &lines));
    let (headline, unit) = (results.headline, unit(results));
    let several = (results.thresholds.len() > 1)
        .then(|| format!("blind, break-even: within {headline} {unit}\n"));
    let truth = "true: share of the listed neighbors that are among the nearest\n".to_owned();
    let shown = lines.iter().filter(|line| matches!(line, Line::Attack(_))).count();
    let more = results.rows.len() - shown;
    let more = (more > 0).then(|| {
        format!("{more} more attacks, of other inlier ratios or solvers, are in the report\n")
    });
    let times = (results.unit == Unit::KthNeighbor)
        .then(|| format!("x: times {}\n", words::USUAL_DISTANCE));
    let refused = document.not_audited.iter().map(|refused| {
        let by = refused.neighbors.as_deref().unwrap_or_default();
        // The reason of a source may begin with the source's name.
        let reason = refused.reason.strip_prefix(&format!("{by}: ")).unwrap_or(&refused.reason);
        let by = if by.is_empty() { String::new() } else { format!(" by {by}") };
        format!("not audited: {}{by}: {reason}\n", refused.scheme)
    });
    let notes = several.into_iter().chain([truth]).chain(times).chain(more);
    text + &notes.chain([cost_text(results)]).chain(refused).collect::<String>()
}

fn unit(results: &Results<'_>) -> &'static str {
    if results.unit == Unit::KthNeighbor { "x" } else { words::sign(results.unit) }
}

/// A line of the table of a map or of images.
enum Line<'a> {
    /// The figures of a row.
    Attack(&'a Row),
    /// The records alone of the row's scheme, and the attack's name.
    Alone(&'a Row, Option<&'a str>),
}

impl<'a> Line<'a> {
    fn row(&self) -> &'a Row {
        let (Self::Attack(row) | Self::Alone(row, _)) = self;
        row
    }

    /// Returns a cell that the records alone do not have.
    fn cell(&self, of: impl Fn(&Row) -> String) -> String {
        if let Self::Attack(row) = self { of(row) } else { "-".to_owned() }
    }
}

fn table(results: &Results<'_>, lines: &[Line<'_>]) -> String {
    let source = |line: &Line<'_>| match line {
        Line::Attack(row) => attack::source(&row.neighbors, row.oracle_noise.as_deref()),
        Line::Alone(..) => attack::records_alone(None),
    };
    let solver = |line: &Line<'_>| match line {
        Line::Attack(row) => row.solver.clone(),
        Line::Alone(_, by) => by.unwrap_or_default().to_owned(),
    };
    let share = |line: &Line<'_>, typed: &str| match line {
        Line::Attack(row) => {
            let spread = row.std.as_ref().and_then(|std| std.recovered_percent.get(typed));
            let share = row.recovered_percent.get(typed);
            share.map_or("-".to_owned(), |_| format!("{} %", percent_cell(share, spread)))
        }
        Line::Alone(row, _) => {
            percent_or_dash(results.records_alone(&row.scheme, typed).map(|alone| alone.0))
        }
    };
    let mut columns = vec![
        label("scheme", |line: &Line<'_>| line.row().scheme.clone()),
        label("neighbors by", source),
        figure("true", |line: &Line<'_>| line.cell(right)),
        label("solver", solver),
    ];
    columns.extend(results.thresholds.iter().map(|typed| {
        figure(format!("{typed} {}", unit(results)), move |line: &Line<'_>| share(line, typed))
    }));
    columns.push(figure("blind", |line: &Line<'_>| blind(results, line.row())));
    columns.push(figure("break-even", |line: &Line<'_>| line.cell(|row| break_even(results, row))));
    Table::of("", "", lines, columns).text()
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

/// Returns the table of two releases.
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
