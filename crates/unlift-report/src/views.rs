//! Results from several releases of the same points: queries with known poses, and a map that was released twice.

use unlift::Unit;

use crate::document::{Document, Row};
use crate::page::tables;
use crate::words::align;
use crate::{attack, words};

/// Returns whether the document is of a sequence.
pub(crate) fn is_sequence(document: &Document) -> bool {
    document.results.iter().any(|row| attack::queries(&row.neighbors).is_some())
}

/// Returns one sentence per scheme: what came back after each number of queries, from released data alone. Where lists of
/// neighbors are used, too, the larger share counts.
pub(crate) fn sequence_sentences(document: &Document) -> Vec<String> {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let sentence = |scheme: &str| {
        let rows = document.results.iter().filter(|row| row.scheme == scheme && !is_tracks(row));
        let mut best: Vec<(usize, f64)> = Vec::new();
        for row in rows {
            let Some(&share) = row.recovered_percent.get(&typed) else { continue };
            match best.iter_mut().find(|(k, _)| *k == row.k) {
                Some((_, known)) => *known = share.max(*known),
                None => best.push((row.k, share)),
            }
        }
        let said =
            |(k, share): &(usize, f64)| format!("after {k} queries {} %", words::percent(*share));
        let parts: Vec<String> = best.iter().map(said).collect();
        let shares = words::capital(&words::list(&parts));
        format!(
            "{shares} of the keypoints came back within {typed} px ({}).",
            words::scheme_name(scheme)
        )
    };
    tables::schemes(document).into_iter().map(sentence).collect()
}

/// Returns the table for a terminal: rows by scheme and number of queries.
pub(crate) fn sequence_table(document: &Document) -> String {
    let thresholds = tables::thresholds(document);
    let headline = tables::headline_threshold(document).unwrap_or_default();
    let mut head = ["scheme", "queries", "links by", "right"].map(str::to_owned).to_vec();
    head.extend(thresholds.iter().map(|typed| format!("{typed} px")));
    head.extend(
        ["blind", "linked", "of linked", "tracked", "of tracked", "new", "of new"]
            .map(str::to_owned),
    );
    let mut lines = vec![head];
    for row in &document.results {
        let percent = |value: Option<&f64>| match value {
            Some(value) => format!("{} %", words::percent(*value)),
            None => "-".to_owned(),
        };
        let by = match row {
            _ if is_tracks(row) => "tracks",
            _ if uses_lists(row) => "descriptors, lists",
            _ => "descriptors",
        };
        let right = format!("{} %", words::ratio_percent(row.inlier_ratio));
        let mut cells = vec![row.scheme.clone(), row.k.to_string(), by.to_owned(), right];
        cells.extend(thresholds.iter().map(|typed| percent(row.recovered_percent.get(typed))));
        cells.push(percent(row.blind_percent.get(&headline)));
        for of in ["linked", "tracked", "new"] {
            cells.push(percent(row.metrics.get(&format!("{of}_percent"))));
            cells.push(percent(row.metrics.get(&format!("{of}_within_{headline}_percent"))));
        }
        lines.push(cells);
    }
    let mut text = align(&lines, &[0, 2]);
    text.push_str(&format!(
        "right: share of the links that the model confirms, where it knows both keypoints\n\
         linked: keypoints linked in three or more views; tracked: by the model's tracks\n\
         lists: neighbors within each query, made from its descriptors\n\
         new: keypoints that show no point of the service's map\n\
         blind, of linked, of tracked, of new: within {headline} px\n"
    ));
    text
}

/// Returns whether a row also uses lists of neighbors within each query.
pub(crate) fn uses_lists(row: &Row) -> bool {
    row.neighbors.starts_with(attack::SEQUENCE_AND_LISTS)
}

fn is_tracks(row: &Row) -> bool {
    attack::basis(row) == attack::Basis::Oracle
}

/// Returns whether the document is of two releases.
pub(crate) fn is_again(document: &Document) -> bool {
    document.results.iter().any(|row| attack::is_again(&row.neighbors))
}

/// Returns one sentence per scheme: what came back from two releases, by the stronger links.
pub(crate) fn again_sentences(document: &Document) -> Vec<String> {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let sentence = |scheme: &str| {
        let rows = || document.results.iter().filter(|row| row.scheme == scheme);
        let share = |row: &Row| row.recovered_percent.get(&typed).copied().unwrap_or(0.0);
        let row = rows().max_by(|a, b| share(a).total_cmp(&share(b)))?;
        let mut text = format!(
            "From two releases under {}, {} % of the points came back {}.",
            words::scheme_name(scheme),
            words::percent(share(row)),
            words::within(&typed, row.unit)
        );
        let described = rows().find(|row| row.neighbors == attack::AGAIN).unwrap_or(row);
        let open = described.metrics.get("open_percent").copied().unwrap_or(0.0);
        if open >= 0.05 {
            text.push_str(&format!(
                " Of {} %, both records are known, but leave a line or more.",
                words::percent(open)
            ));
        }
        Some(text)
    };
    tables::schemes(document).into_iter().filter_map(sentence).collect()
}

/// Returns the table for a terminal.
pub(crate) fn again_table(document: &Document) -> String {
    let thresholds = tables::thresholds(document);
    let headline = tables::headline_threshold(document).unwrap_or_default();
    let unit = match document.results.first().map(|row| row.unit) {
        Some(Unit::Meter) => "m",
        _ => "x",
    };
    let mut head = ["schemes", "links by"].map(str::to_owned).to_vec();
    head.extend(thresholds.iter().map(|typed| format!("{typed} {unit}")));
    head.extend(
        ["linked", "right", "of linked", "sure", "right", "blind", "alone"].map(str::to_owned),
    );
    let mut lines = vec![head];
    for row in &document.results {
        let percent = |value: Option<f64>| match value {
            Some(value) => format!("{} %", words::percent(value)),
            None => "-".to_owned(),
        };
        let of = |name: &str| percent(row.metrics.get(name).copied());
        let by = if row.neighbors == attack::AGAIN { "descriptors" } else { "geometry" };
        let mut cells = vec![row.scheme.clone(), by.to_owned()];
        let shares = thresholds.iter().map(|typed| row.recovered_percent.get(typed).copied());
        cells.extend(shares.map(percent));
        cells.push(of("linked_percent"));
        cells.push(percent(Some(100.0 * row.inlier_ratio)));
        cells.push(of(&format!("linked_within_{headline}_percent")));
        cells.push(percent(row.sure_percent));
        cells.push(percent(row.sure_correct_percent));
        cells.push(percent(row.blind_percent.get(&headline).copied()));
        let alone = row.records_alone_percent.as_ref().and_then(|by| by.get(&headline).copied());
        cells.push(percent(alone));
        lines.push(cells);
    }
    let mut text = align(&lines, &[0, 1]);
    text.push_str(&format!(
        "linked, right: points with a record in both releases, and the share of right ones\n\
         sure, right: points that should be within {headline} {unit} at 90 % and more, and how many are\n\
         of linked, blind, alone: within {headline} {unit}; alone: the first release without descriptors\n"
    ));
    for missing in &document.not_audited {
        let by = missing.neighbors.as_deref().unwrap_or_default();
        text.push_str(&format!("not audited: {}, {by}: {}\n", missing.scheme, missing.reason));
    }
    text
}
