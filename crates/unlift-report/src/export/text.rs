//! The short table for a terminal.

use unlift::Unit;

use crate::document::{Bound, Document, Row, STRONGEST};
use crate::page::verdict::Verdict;
use crate::page::{cost, tables, tiles, verdict};
use crate::words::align;
use crate::{attack, views, words};

/// Returns the verdict in two lines, then a table with a few lines per scheme, the worst first: every source tried, the
/// records alone, and the oracle at the headline inlier ratio. Columns are the percentages within each threshold, a
/// blind guess and the break-even ratio.
///
/// The text has at most about 100 columns and ends with a line break.
pub fn text_table(document: &Document) -> String {
    let thresholds = tables::thresholds(document);
    let headline = tables::headline_threshold(document).unwrap_or_default();
    let Verdict { banner, cards, .. } = verdict::verdict(document);
    let extent = document.input.extent().map(|extent| format!(" ({extent})"));
    let first = banner.headline + &extent.unwrap_or_default();

    if views::is_sequence(document) {
        let sentences = views::sequence_sentences(document).join("\n");
        return format!("{first}\n{sentences}\n\n{}", views::sequence_table(document));
    }
    if views::is_again(document) {
        let sentences = views::again_sentences(document).join("\n");
        return format!("{first}\n{sentences}\n\n{}", views::again_table(document));
    }
    let mut head = ["scheme", "neighbors by", "true", "solver"].map(str::to_owned).to_vec();
    head.extend(thresholds.iter().map(|typed| format!("{typed} {}", unit(document))));
    head.extend(["blind", "break-even"].map(str::to_owned));
    let mut lines = vec![head];
    for card in &cards {
        let rows = verdict::by_source(document, &card.scheme);
        let Some(first) = rows.first() else { continue };
        let blind = percent(first.blind_percent.get(&headline), None);
        let mut alone =
            records_alone(document, &card.scheme, &thresholds).map(|(share, mut cells)| {
                cells.extend([blind.clone(), "-".to_owned()]);
                (share, cells)
            });
        for row in rows {
            let share = verdict::share(row, &headline);
            let is_oracle = attack::basis(row) == attack::Basis::Oracle;
            if let Some((_, cells)) = alone.take_if(|(alone, _)| is_oracle || *alone > share) {
                lines.push(cells);
            }
            lines.push(cells(document, row, &thresholds, &headline));
        }
        lines.extend(alone.map(|(_, cells)| cells));
    }
    let mut text = format!("{first}\n{}\n\n", banner.sentence);
    text.push_str(&align(&lines, &[0, 1, 3]));
    if thresholds.len() > 1 {
        text.push_str(&format!("blind, break-even: within {headline} {}\n", unit(document)));
    }
    text.push_str("true: share of the listed neighbors that are among the nearest\n");
    if document.results.first().is_some_and(|row| row.unit == Unit::KthNeighbor) {
        text.push_str(&format!("x: times {}\n", words::USUAL_DISTANCE));
    }
    text.push_str(&tiles::line(document).unwrap_or_default());
    text.push_str(&cost::text(document));
    for refused in &document.not_audited {
        let by = refused.neighbors.as_ref().map(|source| format!(" by {source}"));
        let (scheme, by) = (&refused.scheme, by.unwrap_or_default());
        // The reason of a source may begin with the source's name.
        let own = refused.neighbors.as_ref().map(|source| format!("{source}: "));
        let reason = own.and_then(|own| refused.reason.strip_prefix(&own));
        let reason = reason.unwrap_or(&refused.reason);
        text.push_str(&format!("not audited: {scheme}{by}: {reason}\n"));
    }
    text
}

/// Returns the share by the records alone within the headline threshold, and its line without the last two cells.
fn records_alone(
    document: &Document,
    scheme: &str,
    thresholds: &[String],
) -> Option<(f64, Vec<String>)> {
    let headline = tables::headline_threshold(document)?;
    let (share, by) = verdict::records_alone(document, scheme, &headline)?;
    let by = by.unwrap_or_default().to_owned();
    let mut cells = vec![scheme.to_owned(), "records alone".to_owned(), "-".to_owned(), by];
    cells.extend(thresholds.iter().map(|typed| {
        let share = verdict::records_alone(document, scheme, typed).map(|(share, _)| share);
        percent(share.as_ref(), None)
    }));
    Some((share, cells))
}

fn cells(document: &Document, row: &Row, thresholds: &[String], headline: &str) -> Vec<String> {
    let right = format!("{} %", words::ratio_percent(row.inlier_ratio));
    let source = attack::source(&row.neighbors, row.oracle_noise.as_deref());
    let mut cells = vec![row.scheme.clone(), source, right, row.solver.clone()];
    cells.extend(thresholds.iter().map(|typed| {
        let spread = row.std.as_ref().and_then(|std| std.recovered_percent.get(typed));
        percent(row.recovered_percent.get(typed), spread)
    }));
    cells.push(percent(row.blind_percent.get(headline), None));
    cells.push(break_even(document, row, headline));
    cells
}

fn percent(value: Option<&f64>, spread: Option<&f64>) -> String {
    match value {
        Some(_) => format!("{} %", tables::percent_cell(value, spread)),
        None => "-".to_owned(),
    }
}

fn unit(document: &Document) -> &'static str {
    match document.results.first().map(|row| row.unit) {
        Some(Unit::KthNeighbor) => "x",
        Some(Unit::Pixel) => "px",
        Some(Unit::Meter) | None => "m",
    }
}

/// Returns the break-even ratio of the curve with this row; a dash for rows that are not the oracle's.
fn break_even(document: &Document, row: &Row, typed: &str) -> String {
    let noise = |noise: &Option<String>| noise.clone().unwrap_or_else(|| "uniform".to_owned());
    let mut points = document.break_even.iter().filter(|point| {
        attack::basis(row) == attack::Basis::Oracle
            && point.scheme == row.scheme
            && (point.solver == row.solver || point.solver == STRONGEST)
            && noise(&point.oracle_noise) == noise(&row.oracle_noise)
            && point.threshold == typed
    });
    let of_scheme = document.results.iter().filter(|other| other.scheme == row.scheme);
    let is_other =
        |other: &Row| other.oracle_noise.is_some() && other.inlier_ratio != row.inlier_ratio;
    if !of_scheme.into_iter().any(is_other) {
        return "-".to_owned();
    }
    match points.next().map(|p| (p.bound, words::ratio_percent(p.inlier_ratio))) {
        Some((Bound::Interpolated, ratio)) => format!("{ratio} %"),
        Some((Bound::BelowTested, ratio)) => format!("<= {ratio} %"),
        Some((Bound::AboveTested, ratio)) => format!("> {ratio} %"),
        None => "-".to_owned(),
    }
}
