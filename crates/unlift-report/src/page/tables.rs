//! The figures as tables of text, which the page shows without script.

use unlift::audit::Interval;

use indexmap::IndexMap;

use crate::attack;
use crate::document::{Bound, BreakEven, ByReason, ByThreshold, Row};
use crate::results::{Results, distinct};
use crate::table::{Class, Column, NONE, Table, column, figure, known, label};
use crate::words;

/// The number of columns that name a row.
const KEYS: usize = 4;

fn keys<'a>() -> Vec<Column<'a, Row>> {
    vec![
        label("scheme", |row: &Row| row.scheme.clone()),
        label("solver", |row: &Row| row.solver.clone()),
        label("neighbors", attack::lists),
        figure("of them right", |row: &Row| {
            format!("{} %", words::ratio_percent(row.inlier_ratio))
        }),
    ]
}

/// Returns a column per threshold, whose heads begin with `who`.
fn within<'a, T>(
    results: &'a Results<'_>,
    who: &str,
    cell: impl Fn(&T, &str) -> String + Copy + 'a,
) -> impl Iterator<Item = Column<'a, T>> {
    results.thresholds.iter().map(move |typed| {
        let head = format!("{who}within {}, %", results.threshold(typed));
        figure(head, move |item: &T| cell(item, typed))
    })
}

/// Returns the percentage within a threshold with its interval, "67.0 (66.4 to 67.6)", or with its spread over seeds.
fn share(
    typed: &str,
    shares: &ByThreshold,
    intervals: Option<&IndexMap<String, Interval>>,
    spread: Option<&ByThreshold>,
) -> String {
    match intervals.and_then(|all| all.get(typed)) {
        Some(interval) => {
            let percent = percent_cell(shares.get(typed), None);
            format!("{percent} ({})", words::interval(*interval))
        }
        None => percent_cell(shares.get(typed), spread.and_then(|spread| spread.get(typed))),
    }
}

pub(crate) fn recovered(results: &Results<'_>) -> Table {
    let points = results.points();
    let repeats = results.rows.iter().map(|row| row.repeats).max().unwrap_or(1);
    let spread = match repeats > 1 {
        _ if results.rows.iter().any(|row| row.interval.is_some()) => {
            " In brackets: the 95 % interval, by the sampling error.".to_owned()
        }
        true => format!(
            " Mean ± standard deviation (where above {SPREAD_THAT_COUNTS}) over {repeats} seeds."
        ),
        false => String::new(),
    };
    let caption = format!("Recovered {points}, in percent of the released {points}.{spread}");
    let mut columns = keys();
    columns.push(figure("K", |row: &Row| row.k.to_string()));
    columns.push(figure("delta", |row: &Row| words::length(row.delta, row.unit)));
    columns.extend(within(results, "", |row: &Row, typed| {
        let spread = row.std.as_ref().map(|std| &std.recovered_percent);
        let of = row.interval.as_ref().map(|of| &of.recovered_percent);
        share(typed, &row.recovered_percent, of, spread)
    }));
    columns.push(figure(points, |row: &Row| words::thousands(row.n_points)));
    Table::of("recovered", caption, results.rows, columns).without_empty_columns()
}

pub(crate) fn baselines(results: &Results<'_>) -> Table {
    // A row, and what its records alone give away, or `None` for the blind guess.
    type Baseline<'a> = (&'a Row, Option<&'a ByThreshold>);
    let attacker = |(row, alone): &Baseline<'_>| match alone {
        None => "blind guess".to_owned(),
        Some(_) => {
            // The best attack may differ between thresholds.
            let by = row.records_alone_by.iter().flat_map(|by| by.values());
            let by = distinct(by.map(String::as_str)).join("; ");
            attack::records_alone(Some(by.as_str()).filter(|by| !by.is_empty()))
        }
    };
    let cell = |(row, alone): &Baseline<'_>, typed: &str| match (alone, &row.interval) {
        (Some(alone), of) => {
            share(typed, alone, of.as_ref().map(|of| &of.records_alone_percent), None)
        }
        (None, of) => {
            let spread = row.std.as_ref().map(|std| &std.blind_percent);
            share(typed, &row.blind_percent, of.as_ref().map(|of| &of.blind_percent), spread)
        }
    };
    let lines = results.schemes.iter().flat_map(|scheme| {
        let rows = results.of_scheme(scheme);
        let alone =
            rows.clone().filter_map(|row| Some((row, Some(row.records_alone_percent.as_ref()?))));
        rows.map(|row| (row, None)).chain(alone)
    });
    let lines: Vec<Baseline<'_>> = lines.collect();
    let mut columns = vec![
        label("scheme", |(row, _): &Baseline<'_>| row.scheme.clone()),
        label("attacker", attacker),
    ];
    columns.extend(within(results, "", cell));
    let caption = "Baselines: what an attacker recovers without lists of neighbors. Lists add what exceeds the larger baseline.";
    let mut table = Table::of("baselines", caption, &lines, columns);
    table.rows = distinct(table.rows);
    table
}

pub(crate) fn distinct_places(results: &Results<'_>) -> Option<Table> {
    let places = |row: &Row| row.distinct.clone().unwrap_or_default();
    let mut columns = keys();
    columns.extend(within(results, "", move |row, typed| {
        percent_cell(places(row).recovered_percent.get(typed), None)
    }));
    columns.extend(within(results, "blind guess, ", move |row, typed| {
        percent_cell(places(row).blind_percent.get(typed), None)
    }));
    columns.push(figure("places", move |row| words::thousands(places(row).n_places)));
    let caption = "Recovered places, in percent: keypoints at the same place count once.";
    let rows = results.rows.iter().filter(|row| row.distinct.is_some());
    Table::of("distinct", caption, rows, columns).if_beyond(KEYS)
}

pub(crate) fn errors(results: &Results<'_>) -> Table {
    let error = |row: &Row, error: Option<f64>| known(error, |x| words::length(x, row.unit));
    let mut columns = keys();
    columns.push(figure("median", move |row| error(row, row.median_error)));
    columns.push(figure("median of a blind guess", move |row| error(row, row.blind_median_error)));
    let percentiles = results.rows.iter().flat_map(|row| row.error_percentiles.keys());
    // Percentile 50 is the median, which has its own column.
    let is_shown = |key: &&String| key.parse::<f64>().is_ok_and(|percent| percent > 50.0);
    for key in distinct(percentiles.filter(is_shown)) {
        let of = move |row: &Row| error(row, row.error_percentiles.get(key).copied().flatten());
        columns.push(figure(format!("{key} % within"), of));
    }
    let caption = "Errors: distances from recovered to true points. Lost points count as infinitely far; a percentile among them is a dash.";
    Table::of("errors", caption, results.rows, columns).without_empty_columns()
}

pub(crate) fn break_even(results: &Results<'_>) -> Option<Table> {
    let source = |point: &BreakEven| attack::plain_source("oracle", point.oracle_noise.as_deref());
    let right = |point: &BreakEven| {
        let bound = match point.bound {
            Bound::Interpolated => "",
            Bound::BelowTested => "at most ",
            Bound::AboveTested => "more than ",
        };
        format!("{bound}{} %", words::ratio_percent(point.inlier_ratio))
    };
    let columns = vec![
        label("scheme", |point: &BreakEven| point.scheme.clone()),
        label("solver", |point: &BreakEven| point.solver.clone()),
        label("neighbors", source),
        figure("within", |point: &BreakEven| results.threshold(&point.threshold)),
        figure("of them right", right),
    ];
    let caption =
        "Break-even: the smallest share of right neighbors at which half of the points come back.";
    Table::of("break-even", caption, &results.document.break_even, columns).if_beyond(0)
}

pub(crate) fn losses(results: &Results<'_>) -> Table {
    let points = results.points();
    let capital = words::capital(points);
    let caption = format!(
        "{capital} that the scheme did not release, and {points} that were lost in recovery, by reason."
    );
    let mut columns = keys();
    columns.extend([
        figure(format!("{points} released"), |row: &Row| words::thousands(row.n_points)),
        column(Class::Prose, "not released", |row: &Row| reasons(&row.dropped)),
        figure("lost", |row: &Row| words::thousands(row.n_lost)),
        column(Class::Prose, "lost by reason", |row: &Row| reasons(&row.lost)),
    ]);
    Table::of("losses", caption, results.rows, columns).without_empty_columns()
}

fn reasons(map: &ByReason) -> String {
    let parts = map.iter().filter(|(_, count)| **count > 0);
    let parts: Vec<String> = parts
        .map(|(name, count)| format!("{} {}", words::thousands(*count), name.replace('_', " ")))
        .collect();
    if parts.is_empty() { NONE.to_owned() } else { parts.join(", ") }
}

/// Returns the table of correct choices and of points that the attacker is sure of; `None` if no row has any.
pub(crate) fn choices(results: &Results<'_>) -> Option<Table> {
    const UNKNOWN: &str = "not known here";
    fn percent<'a>(head: &str, value: impl Fn(&Row) -> Option<f64> + 'a) -> Column<'a, Row> {
        figure(head, move |row| known(value(row), words::percent))
    }
    let mut columns = keys();
    columns.extend([
        percent("swapped axis found, %", |row| row.axis_accuracy_percent),
        percent("recovered exactly, %", |row| row.exact_percent),
        percent("descriptor assigned right, %", |row| row.assignment_accuracy_percent),
        figure("attacker sure, %", |row: &Row| match (&row.sure_unknown, row.sure_percent) {
            (Some(_), None) => UNKNOWN.to_owned(),
            (_, sure) => known(sure, words::percent),
        }),
        percent("right of these, %", |row| row.sure_correct_percent),
    ]);
    let caption = "Correct choices of the attack, and points that the attacker is sure of.";
    let mut table = Table::of("choices", caption, results.rows, columns);
    let unknown = results.rows.iter().filter(|row| row.sure_percent.is_none());
    let unknown = unknown.filter_map(|row| row.sure_unknown.as_ref());
    let notes = unknown.map(|reason| format!("{}: {reason}", words::capital(UNKNOWN)));
    table.notes = distinct(notes);
    table.without_empty_columns().if_beyond(KEYS)
}

pub(crate) fn times(results: &Results<'_>) -> Option<Table> {
    let times = &results.document.run.seconds.rows;
    let mut columns = keys();
    for stage in distinct(times.iter().flat_map(|row| row.keys())) {
        let seconds = move |row: &Row| {
            let at = results.rows.iter().position(|own| std::ptr::eq(own, row));
            let seconds = at.and_then(|at| times.get(at)?.get(stage));
            known(seconds, |s| words::significant(*s, 3))
        };
        columns.push(figure(format!("{stage}, s"), seconds));
    }
    Table::of("times", "Seconds by stage.", results.rows, columns).if_beyond(KEYS)
}

/// The metrics of [`likeness`]: name in a document, head of a column, decimals.
const LIKENESS: [(&str, &str, usize); 3] =
    [("ssim", "SSIM", 3), ("psnr", "PSNR, dB", 1), ("lpips", "LPIPS", 3)];
const OF_CLASS: &str = "objects_found_of_";
const BASELINE: &str = "_baseline";

fn with_unprotected(mut table: Table, cells: impl IntoIterator<Item = String>) -> Table {
    let keys = ["without protection", NONE, NONE, NONE].map(str::to_owned);
    table.rows.insert(0, keys.into_iter().chain(cells).collect());
    table
}

/// Returns the table of the similarity of pictures to the photos; `None` if no row has any.
pub(crate) fn likeness(results: &Results<'_>) -> Option<Table> {
    let first = results.rows.iter().find(|row| row.metrics.contains_key("ssim"))?;
    let cell = |row: &Row, metric: &str, digits: usize| {
        known(row.metrics.get(metric), |value| format!("{value:.digits$}"))
    };
    let mut columns = keys();
    columns
        .extend(LIKENESS.map(|(metric, head, digits)| {
            figure(head, move |row: &Row| cell(row, metric, digits))
        }));
    columns.push(figure("SSIM lost", |row: &Row| {
        let of = |name: &str| row.metrics.get(name);
        let lost = of("ssim_baseline").zip(of("ssim")).map(|(baseline, ssim)| baseline - ssim);
        known(lost, |lost| format!("{lost:.3}"))
    }));
    let percent = |row: &Row, metric: &str| {
        known(row.metrics.get(metric), |share| words::percent(100.0 * share))
    };
    columns.push(figure("assigned, %", move |row: &Row| percent(row, "reidentified")));
    let mut caption = "Similarity of pictures, painted from recovered points, to the photos; means over photos. Higher SSIM and PSNR and \
                       lower LPIPS mean more similar."
        .to_owned();
    if first.metrics.contains_key("reidentified") {
        caption += &format!(
            " Assigned: pictures with a smaller LPIPS distance to their own photo than to every other of at most 100 photos, all at \
             64 x 64 pixels; {} % would be by chance.",
            percent(first, "reidentified_by_chance")
        );
    }
    let table = Table::of("likeness", caption, results.rows, columns);
    let unprotected =
        LIKENESS.map(|(metric, _, digits)| cell(first, &format!("{metric}{BASELINE}"), digits));
    let assigned = percent(first, "reidentified_baseline");
    let unprotected = unprotected.into_iter().chain([NONE.to_owned(), assigned]);
    Some(with_unprotected(table, unprotected).without_empty_columns())
}

/// Returns the table of the photos' objects that are found again in the pictures, a column per class; `None` if no row has any.
pub(crate) fn objects(results: &Results<'_>) -> Option<Table> {
    let first = results.rows.iter().find(|row| row.metrics.contains_key("objects_found"))?;
    let names = results.rows.iter().flat_map(|row| row.metrics.keys());
    let classes = names.filter_map(|name| name.strip_prefix(OF_CLASS));
    let mut classes = distinct(classes.filter(|class| !class.ends_with(BASELINE)));
    classes.sort_unstable();
    let cell = |row: &Row, class: &str, end: &str| {
        let share = row.metrics.get(&format!("{OF_CLASS}{class}{end}"));
        known(share, |share| words::percent(100.0 * share))
    };
    let mut columns = keys();
    columns.extend(classes.iter().map(|class| {
        let head = format!("{}, %", class.replace('_', " "));
        figure(head, move |row: &Row| cell(row, class, ""))
    }));
    let caption = "Everyday objects that a detector finds in the photos, and the share that it finds again in the same place of the \
                   pictures; means over the photos that show one.";
    let table = Table::of("objects", caption, results.rows, columns);
    let unprotected = classes.iter().map(|class| cell(first, class, BASELINE));
    with_unprotected(table, unprotected).if_beyond(KEYS)
}

/// Standard deviations over seeds up to this many percentage points are not shown.
pub(crate) const SPREAD_THAT_COUNTS: f64 = 0.5;

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
