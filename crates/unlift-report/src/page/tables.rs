//! The figures as tables of text, which the page shows without script.

use indexmap::IndexMap;
use serde::Serialize;
use unlift::Unit;
use unlift::audit::Interval;

use crate::document::{Bound, ByReason, ByThreshold, Document, Row};
use crate::{attack, words};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Table {
    pub id: &'static str,
    pub caption: String,
    pub columns: Vec<Column>,
    /// Cells by row, one per column.
    pub rows: Vec<Vec<String>>,
    /// Explanations below the table.
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Column {
    pub name: String,
    pub class: Class,
}

/// The layout of a column's cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Class {
    /// Names, flush left, on one line.
    Label,
    /// Figures, flush right.
    Figure,
    /// Text that may be long: flush left, on several lines.
    Prose,
}

const NONE: &str = "–";

impl Table {
    pub(crate) fn new(
        id: &'static str,
        caption: impl Into<String>,
        columns: Vec<Column>,
        rows: Vec<Vec<String>>,
    ) -> Self {
        Self { id, caption: caption.into(), columns, rows, notes: Vec::new() }
    }

    /// Returns a table with a row per row of the results: its key cells, then those of `cells` under the heads `more`.
    fn of_results(
        document: &Document,
        (id, caption): (&'static str, impl Into<String>),
        more: Vec<Column>,
        mut cells: impl FnMut(&Row) -> Option<Vec<String>>,
    ) -> Self {
        let rows = document.results.iter();
        let rows = rows.filter_map(|row| Some([key_cells(row), cells(row)?].concat()));
        Self::new(id, caption, [key_columns(), more].concat(), rows.collect())
    }

    fn without_empty_columns(mut self) -> Self {
        let kept: Vec<bool> = (0..self.columns.len())
            .map(|at| self.rows.is_empty() || self.rows.iter().any(|row| row[at] != NONE))
            .collect();
        let mut keep = kept.iter();
        self.columns.retain(|_| *keep.next().unwrap_or(&true));
        for row in &mut self.rows {
            let mut keep = kept.iter();
            row.retain(|_| *keep.next().unwrap_or(&true));
        }
        self
    }

    /// Returns the table if it has rows, and columns besides the key columns.
    fn if_any(self) -> Option<Self> {
        (self.columns.len() > key_columns().len() && !self.rows.is_empty()).then_some(self)
    }
}

pub(crate) fn column(name: impl Into<String>, class: Class) -> Column {
    Column { name: name.into(), class }
}

fn figures<T: Into<String>>(names: impl IntoIterator<Item = T>) -> Vec<Column> {
    names.into_iter().map(|name| column(name, Class::Figure)).collect()
}

fn labels<const N: usize>(names: [&str; N]) -> Vec<Column> {
    names.map(|name| column(name, Class::Label)).into()
}

fn key_columns() -> Vec<Column> {
    [labels(["scheme", "solver", "neighbors"]), figures(["of them right"])].concat()
}

fn key_cells(row: &Row) -> Vec<String> {
    let source = attack::plain_source(&row.neighbors, row.oracle_noise.as_deref());
    let right = format!("{} %", words::ratio_percent(row.inlier_ratio));
    vec![row.scheme.clone(), row.solver.clone(), source, right]
}

fn within_columns(document: &Document, who: &str) -> Vec<Column> {
    let names = thresholds(document).into_iter().map(|typed| threshold_text(document, &typed));
    figures(names.map(|name| format!("{who}within {name}, %")))
}

fn known<T>(value: Option<T>, said: impl FnOnce(T) -> String) -> String {
    value.map_or(NONE.into(), said)
}

/// Returns a cell per threshold: the percentage with its interval, "67.0 (66.4 to 67.6)", or with its spread over seeds.
fn shares(
    document: &Document,
    shares: &ByThreshold,
    intervals: Option<&IndexMap<String, Interval>>,
    spread: Option<&ByThreshold>,
) -> Vec<String> {
    let cell = |typed: &String| match intervals.and_then(|all| all.get(typed)) {
        Some(interval) => {
            let percent = percent_cell(shares.get(typed), None);
            format!("{percent} ({})", words::interval(*interval))
        }
        None => percent_cell(shares.get(typed), spread.and_then(|s| s.get(typed))),
    };
    thresholds(document).iter().map(cell).collect()
}

/// Returns `items` without repetitions, in their order.
pub(crate) fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut kept = Vec::new();
    for item in items {
        if !kept.contains(&item) {
            kept.push(item);
        }
    }
    kept
}

pub(crate) fn schemes(document: &Document) -> Vec<&str> {
    distinct(document.results.iter().map(|row| row.scheme.as_str()))
}

fn points(document: &Document) -> &'static str {
    document.results.first().map_or("points", |row| words::points(row.unit))
}

/// Returns the table of main figures: percent recovered, a column per threshold.
pub(crate) fn recovered(document: &Document) -> Table {
    let points = points(document);
    let heads = [figures(["K", "delta"]), within_columns(document, ""), figures([points])].concat();
    let repeats = document.results.iter().map(|row| row.repeats).max().unwrap_or(1);
    let spread = match repeats > 1 {
        _ if document.results.iter().any(|row| row.interval.is_some()) => {
            " In brackets: the 95 % interval, by the sampling error.".to_owned()
        }
        true => format!(
            " Mean ± standard deviation (where above {SPREAD_THAT_COUNTS}) over {repeats} seeds."
        ),
        false => String::new(),
    };
    let caption = format!("Recovered {points}, in percent of the released {points}.{spread}");
    let table = Table::of_results(document, ("recovered", caption), heads, |row| {
        let mut cells = vec![row.k.to_string(), words::length(row.delta, row.unit)];
        let spread = row.std.as_ref().map(|std| &std.recovered_percent);
        let of = row.interval.as_ref().map(|of| &of.recovered_percent);
        cells.extend(shares(document, &row.recovered_percent, of, spread));
        cells.push(words::thousands(row.n_points));
        Some(cells)
    });
    table.without_empty_columns()
}

pub(crate) fn baselines(document: &Document) -> Table {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for scheme in schemes(document) {
        let of = || document.results.iter().filter(|row| row.scheme == scheme);
        let line = |who: String, shares| [vec![scheme.to_owned(), who], shares].concat();
        rows.extend(of().map(|row| {
            let spread = row.std.as_ref().map(|std| &std.blind_percent);
            let of = row.interval.as_ref().map(|of| &of.blind_percent);
            line("blind guess".to_owned(), shares(document, &row.blind_percent, of, spread))
        }));
        rows.extend(of().filter_map(|row| {
            let alone = row.records_alone_percent.as_ref()?;
            // The best attack may differ between thresholds.
            let by = row.records_alone_by.iter().flat_map(|by| by.values());
            let by = distinct(by.map(String::as_str)).join("; ");
            let who = attack::records_alone(Some(by.as_str()).filter(|by| !by.is_empty()));
            let of = row.interval.as_ref().map(|of| &of.records_alone_percent);
            Some(line(who, shares(document, alone, of, None)))
        }));
    }
    let caption = "Baselines: what an attacker recovers without lists of neighbors. Lists add what exceeds the larger baseline.";
    let columns = [labels(["scheme", "attacker"]), within_columns(document, "")].concat();
    Table::new("baselines", caption, columns, distinct(rows))
}

pub(crate) fn distinct_places(document: &Document) -> Option<Table> {
    let blind = within_columns(document, "blind guess, ");
    let heads = [within_columns(document, ""), blind, figures(["places"])].concat();
    let caption = "Recovered places, in percent: keypoints at the same place count once.";
    let table = Table::of_results(document, ("distinct", caption), heads, |row| {
        let distinct = row.distinct.as_ref()?;
        let mut cells = shares(document, &distinct.recovered_percent, None, None);
        cells.extend(shares(document, &distinct.blind_percent, None, None));
        cells.push(words::thousands(distinct.n_places));
        Some(cells)
    });
    table.if_any()
}

pub(crate) fn errors(document: &Document) -> Table {
    let keys = document.results.iter().flat_map(|row| row.error_percentiles.keys());
    // Percentile 50 is the median, which has its own column.
    let percentiles = distinct(keys.filter(|key| *key != "50"));
    let mut heads = figures(["median", "median of a blind guess"]);
    heads.extend(figures(percentiles.iter().map(|key| format!("{key} % within"))));
    let caption = "Errors: distances from recovered to true points. Lost points count as infinitely far; a percentile among them is a dash.";
    let table = Table::of_results(document, ("errors", caption), heads, |row| {
        let of = |key: &&String| row.error_percentiles.get(*key).copied().flatten();
        let errors = [row.median_error, row.blind_median_error].into_iter();
        let errors = errors.chain(percentiles.iter().map(of));
        Some(errors.map(|error| known(error, |error| words::length(error, row.unit))).collect())
    });
    table.without_empty_columns()
}

pub(crate) fn break_even(document: &Document) -> Option<Table> {
    let rows = document.break_even.iter().map(|point| {
        let bound = match point.bound {
            Bound::Interpolated => "",
            Bound::BelowTested => "at most ",
            Bound::AboveTested => "more than ",
        };
        let ratio = format!("{bound}{} %", words::ratio_percent(point.inlier_ratio));
        let within = threshold_text(document, &point.threshold);
        let source = attack::plain_source("oracle", point.oracle_noise.as_deref());
        vec![point.scheme.clone(), point.solver.clone(), source, within, ratio]
    });
    let columns = [labels(["scheme", "solver", "neighbors"]), figures(["within", "of them right"])];
    let caption =
        "Break-even: the smallest share of right neighbors at which half of the points come back.";
    let table = Table::new("break-even", caption, columns.concat(), rows.collect());
    (!table.rows.is_empty()).then_some(table)
}

pub(crate) fn losses(document: &Document) -> Table {
    let points = points(document);
    let capital = words::capital(points);
    let caption = format!(
        "{capital} that the scheme did not release, and {points} that were lost in recovery, by reason."
    );
    let heads = vec![
        column(format!("{points} released"), Class::Figure),
        column("not released", Class::Prose),
        column("lost", Class::Figure),
        column("lost by reason", Class::Prose),
    ];
    let table = Table::of_results(document, ("losses", caption), heads, |row| {
        let [released, lost] = [row.n_points, row.n_lost].map(words::thousands);
        Some(vec![released, reasons(&row.dropped), lost, reasons(&row.lost)])
    });
    table.without_empty_columns()
}

fn reasons(map: &ByReason) -> String {
    let parts: Vec<String> = map
        .iter()
        .filter(|(_, count)| **count > 0)
        .map(|(name, count)| format!("{} {}", words::thousands(*count), words::reason(name)))
        .collect();
    if parts.is_empty() { NONE.to_owned() } else { parts.join(", ") }
}

const UNKNOWN: &str = "not known here";

/// Returns the table of correct choices and of points that the attacker is sure of; `None` if no row has any.
pub(crate) fn choices(document: &Document) -> Option<Table> {
    let percent = |value: Option<f64>| known(value, words::percent);
    let mut notes: Vec<String> = Vec::new();
    let heads = figures([
        "swapped axis found, %",
        "recovered exactly, %",
        "descriptor assigned right, %",
        "attacker sure, %",
        "right of these, %",
    ]);
    let caption = "Correct choices of the attack, and points that the attacker is sure of.";
    let mut table = Table::of_results(document, ("choices", caption), heads, |row| {
        let sure = match (&row.sure_unknown, row.sure_percent) {
            (Some(reason), None) => {
                notes.push(format!("{}: {reason}", words::capital(UNKNOWN)));
                UNKNOWN.to_owned()
            }
            (_, sure) => percent(sure),
        };
        Some(vec![
            percent(row.axis_accuracy_percent),
            percent(row.exact_percent),
            percent(row.assignment_accuracy_percent),
            sure,
            percent(row.sure_correct_percent),
        ])
    });
    table.notes = distinct(notes);
    table.without_empty_columns().if_any()
}

pub(crate) fn trials(document: &Document) -> Option<Table> {
    let points = points(document);
    let heads = vec![column(format!("{points} by trials"), Class::Prose)];
    let caption = format!("RANSAC: number of {points} by the number of random trials needed.");
    let table = Table::of_results(document, ("trials", caption), heads, |row| {
        let bins = row.ransac_trials.as_ref()?.iter().map(|&(bound, count)| {
            format!("≤ {}: {}", words::thousands(bound), words::thousands(count))
        });
        Some(vec![bins.collect::<Vec<_>>().join(" · ")])
    });
    table.if_any()
}

pub(crate) fn times(document: &Document) -> Option<Table> {
    let seconds = &document.run.seconds;
    let stages = distinct(seconds.rows.iter().flat_map(|row| row.keys()));
    let heads = figures(stages.iter().map(|stage| format!("{stage}, s")));
    let mut rows = seconds.rows.iter();
    let table = Table::of_results(document, ("times", "Seconds by stage."), heads, |_| {
        let times = rows.next()?;
        let text = |stage: &&String| known(times.get(*stage), |s| words::significant(*s, 3));
        Some(stages.iter().map(text).collect())
    });
    table.if_any()
}

/// The metrics of [`likeness`]: name in a document, head of a column, decimals.
const LIKENESS: [(&str, &str, usize); 3] =
    [("ssim", "SSIM", 3), ("psnr", "PSNR, dB", 1), ("lpips", "LPIPS", 3)];
const OF_CLASS: &str = "objects_found_of_";
const BASELINE: &str = "_baseline";

fn with_unprotected(mut table: Table, cells: Vec<String>) -> Table {
    let keys = ["without protection", NONE, NONE, NONE].map(str::to_owned);
    table.rows.insert(0, [keys.to_vec(), cells].concat());
    table
}

/// Returns the table of the similarity of pictures to the photos; `None` if no row has any.
pub(crate) fn likeness(document: &Document) -> Option<Table> {
    let first = document.results.iter().find(|row| row.metrics.contains_key("ssim"))?;
    let ours = |row: &Row, end: &str| {
        LIKENESS.map(|(metric, _, digits)| {
            let value = row.metrics.get(&format!("{metric}{end}"));
            known(value, |value| format!("{value:.digits$}"))
        })
    };
    let lost = |row: &Row| {
        let of = |name: &str| row.metrics.get(name);
        let lost = of("ssim_baseline").zip(of("ssim")).map(|(baseline, ssim)| baseline - ssim);
        known(lost, |lost| format!("{lost:.3}"))
    };
    let line = |ours: [String; 3], lost| [&ours[..], &[lost]].concat();
    let heads = figures(LIKENESS.map(|(_, name, _)| name).into_iter().chain(["SSIM lost"]));
    let caption = "Similarity of pictures, painted from recovered points, to the photos; means over photos. Higher SSIM and PSNR and lower \
                   LPIPS mean more similar.";
    let cells = |row: &Row| Some(line(ours(row, ""), lost(row)));
    let table = Table::of_results(document, ("likeness", caption), heads, cells);
    let unprotected = line(ours(first, BASELINE), NONE.into());
    Some(with_unprotected(table, unprotected).without_empty_columns())
}

/// Returns the table of the photos' objects that are found again in the pictures, a column per class; `None` if no row
/// has any.
pub(crate) fn objects(document: &Document) -> Option<Table> {
    let names = document.results.iter().flat_map(|row| row.metrics.keys());
    let classes = names.filter_map(|name| name.strip_prefix(OF_CLASS));
    let mut classes = distinct(classes.filter(|class| !class.ends_with(BASELINE)));
    classes.sort_unstable();
    let found = |row: &Row, end: &str| -> Vec<String> {
        let share = |class: &&str| {
            let value = row.metrics.get(&format!("{OF_CLASS}{class}{end}"));
            known(value, |value| words::percent(100.0 * value))
        };
        classes.iter().map(share).collect()
    };
    let first = document.results.iter().find(|row| row.metrics.contains_key("objects_found"))?;
    let heads = figures(classes.iter().map(|class| format!("{}, %", class.replace('_', " "))));
    let caption = "Everyday objects that a detector finds in the photos, and the share that it finds again in the same place of the \
                   pictures; means over the photos that show one.";
    let cells = |row: &Row| Some(found(row, ""));
    let table = Table::of_results(document, ("objects", caption), heads, cells);
    with_unprotected(table, found(first, BASELINE)).if_any()
}

pub(crate) fn thresholds(document: &Document) -> Vec<String> {
    let typed = document.results.iter().flat_map(|row| row.recovered_percent.keys());
    distinct(typed).into_iter().cloned().collect()
}

const HEADLINE_PX: f64 = 10.0;

/// Returns the threshold of verdicts: the first; for images the one nearest to 10 px.
pub(crate) fn headline_threshold(document: &Document) -> Option<String> {
    let all = thresholds(document);
    if document.results.first().is_none_or(|row| row.unit != Unit::Pixel) {
        return all.into_iter().next();
    }
    let away = |typed: &String| {
        typed.parse::<f64>().map_or(f64::INFINITY, |value| (value / HEADLINE_PX).ln().abs())
    };
    all.into_iter().min_by(|a, b| away(a).total_cmp(&away(b)))
}

pub(crate) fn threshold_text(document: &Document, typed: &str) -> String {
    match document.results.first() {
        Some(row) => words::threshold(typed, row.unit),
        None => typed.to_owned(),
    }
}

/// Standard deviations over seeds up to this many percentage points are not shown.
const SPREAD_THAT_COUNTS: f64 = 0.5;

/// Returns the cell of a percentage, with its standard deviation over seeds if that is above [`SPREAD_THAT_COUNTS`].
pub(crate) fn percent_cell(value: Option<&f64>, spread: Option<&f64>) -> String {
    match (value, spread.filter(|spread| **spread > SPREAD_THAT_COUNTS)) {
        (None, _) => NONE.to_owned(),
        (Some(value), None) => words::percent(*value),
        (Some(value), Some(spread)) => {
            format!("{} ± {}", words::percent(*value), words::percent(*spread))
        }
    }
}
