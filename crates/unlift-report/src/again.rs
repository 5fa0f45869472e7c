//! Results of a map that was released twice.

use crate::columns::align;
use crate::document::{Document, LengthUnit, Row};
use crate::{attack, tables, words};

/// Returns whether the document is of two releases.
pub(crate) fn is_again(document: &Document) -> bool {
    document.results.iter().any(|row| attack::is_again(&row.neighbors))
}

/// Returns one sentence per scheme: what came back from two releases, by the stronger links.
pub(crate) fn sentences(document: &Document) -> Vec<String> {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let sentence = |scheme: &str| {
        let rows = || document.results.iter().filter(|row| row.scheme == scheme);
        let share = |row: &Row| row.recovered_percent.get(&typed).copied().unwrap_or(0.0);
        let row = rows().max_by(|a, b| share(a).total_cmp(&share(b)))?;
        let mut text = format!(
            "From two releases under {}, {} % of the points came back {}.",
            scheme.to_uppercase(),
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
pub(crate) fn table(document: &Document) -> String {
    let thresholds = tables::thresholds(document);
    let headline = tables::headline_threshold(document).unwrap_or_default();
    let unit = match document.results.first().map(|row| row.unit) {
        Some(LengthUnit::Meter) => "m",
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
