//! Beside the main figures: points lost, choices that recovery made, trials and times.

use super::{Class, NONE, Table, column, key_cells, key_columns, pictures, points};
use crate::document::{ByReason, Document};
use crate::words;

/// Points lost and not released, by reason.
pub(crate) fn losses(document: &Document) -> Table {
    let rows = document.results.iter().map(|row| {
        let mut cells = key_cells(row);
        cells.push(words::thousands(row.n_points));
        cells.push(reasons(&row.dropped));
        cells.push(words::thousands(row.n_lost));
        cells.push(reasons(&row.lost));
        cells
    });
    let points = points(document);
    let mut columns = key_columns();
    columns.push(column(format!("{points} released"), Class::Figure));
    columns.push(column("not released", Class::Prose));
    columns.push(column("lost", Class::Figure));
    columns.push(column("lost by reason", Class::Prose));
    let table = Table {
        id: "losses",
        caption: format!(
            "{} not released by the scheme, and {points} that recovery gave up.",
            words::capital(points)
        ),
        columns,
        rows: rows.collect(),
        notes: Vec::new(),
    };
    table.without_empty_columns()
}

/// What stands in place of a share of sure points that cannot be had.
const UNKNOWN: &str = "not known here";

/// Choices that recovery got right, and points it is sure of; `None` when no row has any.
pub(crate) fn choices(document: &Document) -> Option<Table> {
    let percent = |value: Option<f64>| value.map_or(NONE.into(), words::percent);
    let mut notes: Vec<String> = Vec::new();
    let rows = document.results.iter().map(|row| {
        let sure = match (&row.sure_unknown, row.sure_percent) {
            (Some(reason), None) => {
                let note = format!("{}: {reason}", words::capital(UNKNOWN));
                if !notes.contains(&note) {
                    notes.push(note);
                }
                UNKNOWN.to_owned()
            }
            (_, sure) => percent(sure),
        };
        let mut cells = key_cells(row);
        cells.extend([
            percent(row.axis_accuracy_percent),
            percent(row.exact_percent),
            percent(row.assignment_accuracy_percent),
            sure,
            percent(row.sure_correct_percent),
        ]);
        cells
    });
    let rows: Vec<Vec<String>> = rows.collect();
    let names =
        ["axis right, %", "exact, %", "descriptor right, %", "sure, %", "sure ones right, %"];
    let keys = key_columns();
    let n_keys = keys.len();
    let columns = keys.into_iter().chain(names.map(|name| column(name, Class::Figure)));
    let table = Table {
        id: "choices",
        caption: "Choices that recovery got right, and points that the attacker is sure of."
            .to_owned(),
        columns: columns.collect(),
        rows,
        notes,
    };
    let table = table.without_empty_columns();
    (table.columns.len() > n_keys).then_some(table)
}

/// Metrics, a column each; `None` when no row has any.
pub(crate) fn metrics(document: &Document) -> Option<Table> {
    let mut names: Vec<&String> = Vec::new();
    for name in document.results.iter().flat_map(|row| row.metrics.keys()) {
        if !pictures::shown(name) && !names.contains(&name) {
            names.push(name);
        }
    }
    let rows = document.results.iter().map(|row| {
        let text = |name: &&String| {
            row.metrics.get(*name).map_or(NONE.into(), |value| words::significant(*value, 3))
        };
        let mut cells = key_cells(row);
        cells.extend(names.iter().map(text));
        cells
    });
    let rows = rows.collect();
    let mut columns = key_columns();
    columns.extend(names.iter().map(|name| column(name.as_str(), Class::Figure)));
    let caption = "Further figures.".to_owned();
    (!names.is_empty()).then(|| Table { id: "metrics", caption, columns, rows, notes: Vec::new() })
}

/// RANSAC's trials per point; `None` when no row has them.
pub(crate) fn trials(document: &Document) -> Option<Table> {
    let mut rows = Vec::new();
    for row in &document.results {
        let Some(bins) = &row.ransac_trials else {
            continue;
        };
        let text: Vec<String> = bins
            .iter()
            .map(|(bound, count)| {
                format!("≤ {}: {}", words::thousands(*bound), words::thousands(*count))
            })
            .collect();
        let mut cells = key_cells(row);
        cells.push(text.join(" · "));
        rows.push(cells);
    }
    let mut columns = key_columns();
    columns.push(column(format!("{} by trials", points(document)), Class::Prose));
    (!rows.is_empty()).then(|| Table {
        id: "trials",
        caption: format!("RANSAC: number of {} by trials needed.", points(document)),
        columns,
        rows,
        notes: Vec::new(),
    })
}

/// Seconds per row and stage; `None` when the run has none.
pub(crate) fn times(document: &Document) -> Option<Table> {
    let seconds = &document.run.seconds;
    let mut stages: Vec<&String> = Vec::new();
    for stage in seconds.rows.iter().flat_map(|row| row.keys()) {
        if !stages.contains(&stage) {
            stages.push(stage);
        }
    }
    if stages.is_empty() {
        return None;
    }
    let rows = document.results.iter().zip(&seconds.rows).map(|(row, times)| {
        let mut cells = key_cells(row);
        let text =
            |stage: &&String| times.get(*stage).map_or(NONE.into(), |s| words::significant(*s, 3));
        cells.extend(stages.iter().map(text));
        cells
    });
    let rows = rows.collect();
    let mut columns = key_columns();
    columns.extend(stages.iter().map(|stage| column(format!("{stage}, s"), Class::Figure)));
    let caption = "Seconds by stage.".to_owned();
    Some(Table { id: "times", caption, columns, rows, notes: Vec::new() })
}

fn reasons(map: &ByReason) -> String {
    if map.values().all(|&count| count == 0) {
        return NONE.to_owned();
    }
    let parts = map.iter().filter(|(_, count)| **count > 0);
    let parts =
        parts.map(|(name, count)| format!("{} {}", words::thousands(*count), words::reason(name)));
    parts.collect::<Vec<_>>().join(", ")
}
