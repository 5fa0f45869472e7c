//! Results of several queries with known poses, by the number of queries.

use crate::attack;
use crate::columns::align;
use crate::document::{Document, Row};
use crate::tables;
use crate::words;

/// Returns whether the document is of a sequence.
pub(crate) fn is_sequence(document: &Document) -> bool {
    document.results.iter().any(|row| attack::queries(&row.neighbors).is_some())
}

/// Returns one sentence per scheme: what came back after each number of queries, from released data alone. Where lists of
/// neighbors are used, too, the larger share counts.
pub(crate) fn sentences(document: &Document) -> Vec<String> {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let sentence = |scheme: &str| {
        let rows = document.results.iter().filter(|row| row.scheme == scheme && !is_tracks(row));
        let mut best: Vec<(u32, f64)> = Vec::new();
        for row in rows {
            let Some(&share) = row.recovered_percent.get(&typed) else { continue };
            match best.iter_mut().find(|(k, _)| *k == row.k) {
                Some((_, known)) => *known = share.max(*known),
                None => best.push((row.k, share)),
            }
        }
        let said =
            |(k, share): &(u32, f64)| format!("after {k} queries {} %", words::percent(*share));
        let parts: Vec<String> = best.iter().map(said).collect();
        let shares = words::capital(&words::list(&parts));
        format!(
            "{shares} of the keypoints came back within {typed} px ({}).",
            scheme.to_uppercase()
        )
    };
    tables::schemes(document).into_iter().map(sentence).collect()
}

/// Returns the table for a terminal: rows by scheme and number of queries.
pub(crate) fn table(document: &Document) -> String {
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
    attack::basis(row) == Some(attack::Basis::Oracle)
}
