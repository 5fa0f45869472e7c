//! The charts of the page: their titles, which state the result that a chart shows, their menus, and the data of the script.

use serde_json::{Value, json};

use crate::attack::{self, Basis, Given};
use crate::document::{ByThreshold, Row};
use crate::page::RenderOptions;
use crate::results::{Results, distinct};
use crate::words;

/// Returns the titles of the charts.
pub(crate) fn titles(results: &Results<'_>) -> Value {
    json!({
        "curves": curves(results),
        "errors": errors(results),
        "certainty": certainty(results),
    })
}

/// Ratio of the recovery with the fewest right neighbors to that with the most, from which on wrong
/// neighbors hardly matter; below [`STEEP`] they matter much.
const FLAT: f64 = 0.9;
const STEEP: f64 = 0.5;

/// Returns a title on how much wrong neighbors reduce the recovery: the best oracle rows at the lowest and
/// highest tested ratio.
fn curves(results: &Results<'_>) -> String {
    let points = results.points();
    let oracle = results.rows.iter().filter(|row| attack::basis(row) == Basis::Oracle);
    let share = |ratio: f64| {
        let rows = oracle.clone().filter(move |row| row.inlier_ratio == ratio);
        rows.map(|row| results.share(row)).fold(0.0, f64::max)
    };
    let ratios = oracle.clone().map(|row| row.inlier_ratio);
    let (low, high) = (ratios.clone().fold(f64::INFINITY, f64::min), ratios.fold(0.0, f64::max));
    // Mostly right neighbors show nothing about wrong ones.
    if low >= high || low > 0.2 {
        return format!("How many {points} come back, by the share of right neighbors");
    }
    let (few, many) = (share(low), share(high));
    let wrong = words::ratio_percent(1.0 - low);
    let back = format!("{} % of the {points}", words::percent(few));
    match few / many.max(f64::MIN_POSITIVE) {
        FLAT.. => format!(
            "Wrong neighbors hardly stop the attack: with {wrong} % of them wrong, {back} still come back"
        ),
        STEEP.. => format!("With {wrong} % of the neighbors wrong, {back} still come back"),
        _ => format!(
            "Wrong neighbors weaken the attack: with {wrong} % of them wrong, {back} come back"
        ),
    }
}

fn errors(results: &Results<'_>) -> String {
    let points = results.points();
    let Some((row, median)) = strongest(results).and_then(|row| Some((row, row.median_error?)))
    else {
        return format!("How far off the recovered {points} are");
    };
    let scheme = &row.scheme;
    let smallest = results.thresholds.first().and_then(|typed| typed.parse::<f64>().ok());
    // Swapped coordinates that are restored leave only an error of rounding.
    let how = match smallest.is_some_and(|smallest| median < 0.001 * smallest) {
        true => "exactly".to_owned(),
        false => format!("to within {}", words::length(median, row.unit)),
    };
    format!("Half of the {points} come back {how} ({scheme})")
}

fn certainty(results: &Results<'_>) -> String {
    let sure = strongest(results).and_then(|row| {
        Some(format!(
            "The attacker is sure of {} % of the {}, and right about {} % of those ({})",
            words::percent(row.sure_percent?),
            results.points(),
            words::percent(row.sure_correct_percent?),
            row.scheme
        ))
    });
    sure.unwrap_or_else(|| "How well the attacker can judge its own result".to_owned())
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
pub(crate) fn page_data(results: &Results<'_>, options: &RenderOptions) -> Value {
    let givens = givens(results);
    let solvers = distinct(results.rows.iter().map(|row| row.solver.as_str()));
    let by_threshold = |map: &ByThreshold| {
        results.thresholds.iter().map(|typed| map.get(*typed).copied()).collect::<Vec<_>>()
    };
    let rows = results.rows.iter().enumerate().map(|(index, row)| {
        let cdf = options.error_cdf.iter().find(|cdf| cdf.row == index);
        let given = Given::of(row);
        let strongest = results.thresholds.iter().map(|typed| {
            let strongest = results.strongest_given(&row.scheme, &given, typed);
            strongest.is_some_and(|best| std::ptr::eq(best, row))
        });
        json!({
            // Places in the lists of the choices.
            "scheme": results.schemes.iter().position(|scheme| *scheme == row.scheme),
            "given": place(&givens, &given),
            "solver": solvers.iter().position(|solver| *solver == row.solver),
            "label": given.label(),
            "ratio": row.inlier_ratio,
            "strongest": strongest.collect::<Vec<bool>>(),
            "recovered": by_threshold(&row.recovered_percent),
            "errors": cdf.map_or_else(|| percentile_points(row), |cdf| cdf.points.clone()),
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
        "givens": givens.iter().map(GivenChoice::json).collect::<Vec<_>>(),
        "solvers": solvers,
        "first_given": first_given(results, &givens).unwrap_or(0),
    })
}

fn percentile_points(row: &Row) -> Vec<(f64, f64)> {
    let points = row.error_percentiles.iter();
    let mut points: Vec<(f64, f64)> =
        points.filter_map(|(percent, error)| Some(((*error)?, percent.parse().ok()?))).collect();
    // Shares within thresholds lie on the same curve.
    let shares = row.recovered_percent.iter();
    let shares = shares.filter_map(|(typed, &percent)| Some((typed.parse().ok()?, percent)));
    let shares: Vec<(f64, f64)> = shares.collect();
    // As in measured curves, smaller errors are no different.
    let least = 0.01 * shares.iter().fold(0.0, |largest: f64, share| largest.max(share.0));
    points.extend(shares);
    points.iter_mut().for_each(|point| point.0 = point.0.max(least));
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points
}

/// A kind of neighborhoods, as menus have it.
pub(crate) struct GivenChoice {
    /// `known neighbors, 50 % right`, `neighbors by descriptor overlap, 9 to 12 % right`.
    label: String,
    /// The group in a menu: `released`, `given` or `oracle`.
    pub group: &'static str,
    /// The source: one curve of the oracle's ratios, or one mark of another source.
    pub source: String,
    pub given: Given,
}

impl GivenChoice {
    fn json(&self) -> Value {
        let name = attack::plain_source(&self.given.neighbors, self.given.oracle_noise.as_deref());
        json!({ "label": self.label, "group": self.group, "source": self.source, "name": name })
    }
}

/// Returns the kinds of neighborhoods of an audit, by falling ratio within a source.
pub(crate) fn givens(results: &Results<'_>) -> Vec<GivenChoice> {
    let mut givens: Vec<GivenChoice> = Vec::new();
    for row in results.rows {
        if place(&givens, &Given::of(row)).is_none() {
            givens.push(given_choice(results, row));
        }
    }
    let sources: Vec<String> = givens.iter().map(|given| given.source.clone()).collect();
    let turn = |given: &GivenChoice| sources.iter().position(|source| *source == given.source);
    givens.sort_by(|a, b| {
        turn(a).cmp(&turn(b)).then(b.given.inlier_ratio.total_cmp(&a.given.inlier_ratio))
    });
    givens
}

fn place(givens: &[GivenChoice], given: &Given) -> Option<usize> {
    givens.iter().position(|known| known.given.same_choice(given))
}

/// Returns the place of the neighborhoods that are shown first: of the attacker's own sources the one that
/// recovers most; without one, the oracle whose ratio is nearest to half.
fn first_given(results: &Results<'_>, givens: &[GivenChoice]) -> Option<usize> {
    let own = results.rows.iter().filter(|row| group(row) == "released");
    let oracle = || results.strongest(results.schemes.first()?, Basis::Oracle);
    place(givens, &Given::of(results.largest(own).or_else(oracle)?))
}

fn scheme(results: &Results<'_>, name: &str) -> Value {
    let thresholds = || results.thresholds.iter();
    let alone = |typed: &&str| results.records_alone(name, typed);
    let max = |of: fn(&Row, &str) -> Option<f64>| -> Vec<Option<f64>> {
        thresholds().map(|typed| results.max(name, |row| of(row, typed))).collect()
    };
    json!({
        "name": name,
        "title": words::scheme_title(name),
        "slot": slot(results, name),
        "blind": max(|row, typed| row.blind_percent.get(typed).copied()),
        // `None` where that was not tried.
        "alone": thresholds().map(|typed| Some(alone(typed)?.0)).collect::<Vec<_>>(),
        "alone_by": attack::records_alone(alone(&results.headline).and_then(|alone| alone.1)),
        // Neighborhoods add what exceeds the larger of the two baselines.
        "floor": max(|row, typed| row.baseline_percent(typed)),
    })
}

fn group(row: &Row) -> &'static str {
    match row.neighbors.as_str() {
        "oracle" => "oracle",
        "file" => "given",
        _ => "released",
    }
}

/// Returns one entry for all rows with these neighborhoods; their measured ratios become a range.
fn given_choice(results: &Results<'_>, row: &Row) -> GivenChoice {
    let given = Given::of(row);
    let same = results.rows.iter().filter(|other| Given::of(other).same_choice(&given));
    let ratios = same.map(|row| row.inlier_ratio);
    let ends = [ratios.clone().fold(f64::INFINITY, f64::min), ratios.fold(0.0, f64::max)];
    let [low, high] = ends.map(words::ratio_percent);
    let noise = row.oracle_noise.as_deref();
    let label = match low == high {
        true => given.label(),
        false => {
            let name = attack::plain_source(&row.neighbors, noise);
            format!("{name}, {low} to {high} % right")
        }
    };
    let source = attack::source(&row.neighbors, noise);
    GivenChoice { label, group: group(row), source, given }
}

/// Number of colors and marks.
const SLOTS: usize = 8;

/// Returns the number of the color and mark of `scheme`; unknown schemes are numbered from the last one as they appear.
pub(crate) fn slot(results: &Results<'_>, scheme: &str) -> usize {
    let known = |name: &str| words::facts(name).map(|facts| facts.color);
    let mut others = results.schemes.iter().filter(|name| known(name).is_none());
    let mut number = || others.position(|name| *name == scheme).unwrap_or(0);
    known(scheme).unwrap_or_else(|| (SLOTS - 1 + number()) % SLOTS)
}
