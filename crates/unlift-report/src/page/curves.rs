//! The charts of the page: their titles, which state the result that a chart shows, their menus, and the data of the script.

use serde_json::{Value, json};

use crate::attack::{self, Basis};
use crate::document::{ByThreshold, Row};
use crate::results::{Results, distinct};
use crate::words;

/// Returns what the titles of the charts state.
pub(crate) fn findings(results: &Results<'_>) -> Value {
    json!({
        "wrong_neighbors": wrong_neighbors(results),
        "errors": errors(results),
        "certainty": certainty(results),
    })
}

/// Ratio of the recovery with the fewest right neighbors to that with the most, from which on wrong
/// neighbors hardly matter; below [`STEEP`] they matter much.
const FLAT: f64 = 0.9;
const STEEP: f64 = 0.5;

/// Returns how much wrong neighbors reduce the recovery: the best oracle rows at the lowest and highest tested ratio, of given records
/// if there are any.
fn wrong_neighbors(results: &Results<'_>) -> Option<Value> {
    let given = results.given_records();
    let oracle = results.rows.iter().filter(|row| {
        attack::basis(row) == Basis::Oracle && given.is_none_or(|given| row.scheme == given)
    });
    let best =
        |ratio: f64| results.largest(oracle.clone().filter(move |row| row.inlier_ratio == ratio));
    let ratios = oracle.clone().map(|row| row.inlier_ratio);
    let (low, high) = (ratios.clone().fold(f64::INFINITY, f64::min), ratios.fold(0.0, f64::max));
    // Mostly right neighbors show nothing about wrong ones.
    if low >= high || low > 0.2 {
        return None;
    }
    let (worst, best) = (best(low)?, best(high)?);
    let kept = results.share(worst) / results.share(best).max(f64::MIN_POSITIVE);
    Some(json!({
        "scheme": worst.scheme,
        "wrong": words::ratio_percent(1.0 - low),
        "recovered": words::percent(results.share(worst)),
        "matter": if kept >= FLAT { "hardly" } else if kept >= STEEP { "little" } else { "much" },
    }))
}

/// Returns how precisely half of the points come back by the strongest attack.
fn errors(results: &Results<'_>) -> Option<Value> {
    let row = strongest(results)?;
    let median = row.median_error?;
    let smallest = results.thresholds.first().and_then(|typed| typed.parse::<f64>().ok());
    // Swapped coordinates that are restored leave only an error of rounding.
    let is_exact = smallest.is_some_and(|smallest| median < 0.001 * smallest);
    let within = (!is_exact).then(|| words::length(median, row.unit));
    Some(json!({ "scheme": row.scheme, "within": within }))
}

/// Returns of how many points the strongest attack is sure, and how often rightly.
fn certainty(results: &Results<'_>) -> Option<Value> {
    let row = strongest(results)?;
    Some(json!({
        "scheme": row.scheme,
        "sure": words::percent(row.sure_percent?),
        "right": words::percent(row.sure_correct_percent?),
    }))
}

/// Returns the strongest row from released data; without one from given, else from known neighbors.
fn strongest<'a>(results: &Results<'a>) -> Option<&'a Row> {
    Basis::ALL.into_iter().find_map(|basis| {
        let schemes = results.schemes.iter();
        results.largest(schemes.filter_map(|scheme| results.strongest(scheme, basis)))
    })
}

/// Bins with at least this share of the released points are drawn; smaller ones scatter.
const LEAST_DRAWN: f64 = 0.005;

/// Returns (stated probability, share that was right), in percent, ascending; without bins of few points.
pub(crate) fn judged(row: &Row) -> Vec<(f64, f64)> {
    let least = LEAST_DRAWN * row.n_points as f64;
    let bins = row.reliability.iter().flatten().filter(|bin| bin.n as f64 >= least);
    bins.filter_map(|bin| Some((100.0 * bin.predicted?, 100.0 * bin.observed?))).collect()
}

/// Returns the data of the script, without those of the 3D view and the pictures.
pub(crate) fn page_data(results: &Results<'_>) -> Value {
    let givens = givens(results);
    let solvers = distinct(results.rows.iter().map(|row| row.solver.as_str()));
    let by_threshold = |map: &ByThreshold| {
        results.thresholds.iter().map(|typed| map.get(*typed).copied()).collect::<Vec<_>>()
    };
    let rows = results.rows.iter().map(|row| {
        let strongest = results.thresholds.iter().map(|typed| {
            let strongest = results.strongest_given(&row.scheme, row, typed);
            strongest.is_some_and(|best| std::ptr::eq(best, row))
        });
        json!({
            // Places in the lists of the choices.
            "scheme": results.schemes.iter().position(|scheme| *scheme == row.scheme),
            "given": place(&givens, row),
            "solver": solvers.iter().position(|solver| *solver == row.solver),
            "label": attack::label(row),
            "ratio": row.inlier_ratio,
            "strongest": strongest.collect::<Vec<bool>>(),
            "recovered": by_threshold(&row.recovered_percent),
            "errors": error_curve(row),
            "reliability": judged(row),
            "unknown": row.sure_unknown,
        })
    });
    let labels = results.thresholds.iter().map(
        |typed| json!({ "label": results.threshold(typed), "value": typed.parse::<f64>().ok() }),
    );
    let headline = results.thresholds.iter().position(|typed| *typed == results.headline);
    json!({
        "rows": rows.collect::<Vec<_>>(),
        "thresholds": labels.collect::<Vec<_>>(),
        "unit": words::sign(results.unit),
        "headline": headline.unwrap_or(0),
        "schemes": results.schemes.iter().map(|name| scheme(results, name)).collect::<Vec<_>>(),
        "givens": givens.iter().map(|given| choice(results, given)).collect::<Vec<_>>(),
        "solvers": solvers,
        "first_given": first_given(results, &givens).unwrap_or(0),
    })
}

/// Returns the curve of errors: (error in the unit of the row, percent of the released points within it), ascending.
fn error_curve(row: &Row) -> Vec<(f64, f64)> {
    let points = row.error_percentiles.iter();
    let mut points: Vec<(f64, f64)> =
        points.filter_map(|(percent, error)| Some(((*error)?, percent.parse().ok()?))).collect();
    // Shares within thresholds lie on the same curve.
    let shares = row.recovered_percent.iter();
    let shares = shares.filter_map(|(typed, &percent)| Some((typed.parse().ok()?, percent)));
    let shares: Vec<(f64, f64)> = shares.collect();
    // Smaller errors are no different.
    let least = 0.01 * shares.iter().fold(0.0, |largest: f64, share| largest.max(share.0));
    points.extend(shares);
    points.iter_mut().for_each(|point| point.0 = point.0.max(least));
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points
}

/// Returns the first row of each kind of neighborhoods of an audit, by falling ratio within a source.
pub(crate) fn givens<'a>(results: &Results<'a>) -> Vec<&'a Row> {
    let mut givens: Vec<&Row> = Vec::new();
    for row in results.rows {
        if place(&givens, row).is_none() {
            givens.push(row);
        }
    }
    let sources: Vec<String> = givens.iter().map(|row| attack::source(row)).collect();
    let turn = |row: &Row| sources.iter().position(|source| *source == attack::source(row));
    givens.sort_by(|a, b| turn(a).cmp(&turn(b)).then(b.inlier_ratio.total_cmp(&a.inlier_ratio)));
    givens
}

fn place(givens: &[&Row], row: &Row) -> Option<usize> {
    givens.iter().position(|known| attack::same_lists(known, row))
}

fn choice(results: &Results<'_>, given: &Row) -> Value {
    let same = results.rows.iter().filter(|row| attack::same_lists(row, given));
    let ratios = same.map(|row| row.inlier_ratio);
    let ends = [ratios.clone().fold(f64::INFINITY, f64::min), ratios.fold(0.0, f64::max)];
    let [low, high] = ends.map(words::ratio_percent);
    let name = attack::lists(given);
    let label = match low == high {
        true => attack::label(given),
        false => format!("{name}, {low} to {high} % right"),
    };
    json!({ "label": label, "group": group(&given.neighbors), "source": attack::source(given), "name": name })
}

fn group(neighbors: &str) -> &'static str {
    match neighbors {
        "oracle" => "oracle",
        "file" => "given",
        _ => "released",
    }
}

/// Returns the place of the neighborhoods that are shown first: of the attacker's own sources the one that
/// recovers most; without one, the oracle whose ratio is nearest to half.
fn first_given(results: &Results<'_>, givens: &[&Row]) -> Option<usize> {
    let own = results.rows.iter().filter(|row| group(&row.neighbors) == "released");
    let oracle = || results.strongest(results.schemes.first()?, Basis::Oracle);
    place(givens, results.largest(own).or_else(oracle)?)
}

fn scheme(results: &Results<'_>, name: &str) -> Value {
    let thresholds = || results.thresholds.iter();
    let alone = |typed: &&str| results.records_alone(name, typed);
    let floor = |typed: &&str| results.max(name, |row| row.baseline_percent(typed));
    json!({
        "name": name,
        "title": words::scheme_title(name),
        "slot": slot(results, name),
        "blind": thresholds().map(|typed| results.blind(name, typed)).collect::<Vec<_>>(),
        // `None` where that was not tried.
        "alone": thresholds().map(|typed| Some(alone(typed)?.0)).collect::<Vec<_>>(),
        "alone_by": attack::records_alone(alone(&results.headline).and_then(|alone| alone.1)),
        // Neighborhoods add what exceeds the larger of the two baselines.
        "floor": thresholds().map(floor).collect::<Vec<_>>(),
    })
}

const SLOTS: usize = 8;

/// Returns the number of the color and mark of `scheme`; unknown schemes are numbered from the last one as they appear.
fn slot(results: &Results<'_>, scheme: &str) -> usize {
    let known = |name: &str| words::facts(name).map(|facts| facts.color);
    let mut others = results.schemes.iter().filter(|name| known(name).is_none());
    let mut number = || others.position(|name| *name == scheme).unwrap_or(0);
    known(scheme).unwrap_or_else(|| (SLOTS - 1 + number()) % SLOTS)
}
