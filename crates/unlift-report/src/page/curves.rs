//! The charts of the page: their titles, which state the result that a chart shows, their menus, and the data of the script.

use unlift::Unit;

use serde::Serialize;
use serde_json::{Value, json};

use crate::attack::{Basis, Given};
use crate::document::{ByThreshold, Document, Row};
use crate::page::{RenderOptions, tables, verdict};
use crate::{attack, words};

/// Returns the titles of the charts.
pub(crate) fn findings(document: &Document) -> Value {
    json!({
        "curves": curves(document),
        "errors": errors(document),
        "certainty": certainty(document),
    })
}

/// Ratio of the recovery with the fewest right neighbors to that with the most, from which on wrong
/// neighbors hardly matter; below [`STEEP`] they matter much.
const FLAT: f64 = 0.9;
const STEEP: f64 = 0.5;

/// Returns a title on how much wrong neighbors reduce the recovery: the best oracle rows at the lowest and
/// highest tested ratio.
fn curves(document: &Document) -> String {
    let points = document.results.first().map_or("points", |row| words::points(row.unit));
    let usual = format!("How many {points} come back, by the share of right neighbors");
    let Some(typed) = tables::headline_threshold(document) else { return usual };
    let oracle = || document.results.iter().filter(|row| attack::basis(row) == Basis::Oracle);
    let share = |row: &Row| verdict::share(row, &typed);
    let at = |ratio: f64| {
        let rows = oracle().filter(move |row| row.inlier_ratio == ratio);
        rows.map(share).fold(0.0, f64::max)
    };
    let ratios = || oracle().map(|row| row.inlier_ratio);
    let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    // Mostly right neighbors show nothing about wrong ones.
    if low >= high || low > 0.2 {
        return usual;
    }
    let (few, many) = (at(low), at(high));
    let wrong = words::ratio_percent(1.0 - low);
    let few_said = words::percent(few);
    match few / many.max(f64::MIN_POSITIVE) {
        FLAT.. => format!(
            "Wrong neighbors hardly stop the attack: with {wrong} % of them wrong, {few_said} % of the {points} still come back"
        ),
        STEEP.. => {
            format!(
                "With {wrong} % of the neighbors wrong, {few_said} % of the {points} still come back"
            )
        }
        _ => format!(
            "Wrong neighbors weaken the attack: with {wrong} % of them wrong, {few_said} % of the {points} come back"
        ),
    }
}

fn errors(document: &Document) -> String {
    let points = document.results.first().map_or("points", |row| words::points(row.unit));
    let strongest = speaking(document);
    match strongest.and_then(|row| Some((row, row.median_error?))) {
        Some((row, median)) => {
            let scheme = words::scheme_name(&row.scheme);
            let smallest = tables::thresholds(document).first().and_then(|t| t.parse::<f64>().ok());
            // Swapped coordinates that are restored leave only an error of rounding.
            match smallest.is_some_and(|smallest| median < 0.001 * smallest) {
                true => format!("Half of the {points} come back exactly ({scheme})"),
                false => {
                    let error = words::length(median, row.unit);
                    format!("Half of the {points} come back to within {error} ({scheme})")
                }
            }
        }
        None => format!("How far off the recovered {points} are"),
    }
}

fn certainty(document: &Document) -> String {
    let said = speaking(document).and_then(|row| {
        let (sure, right) = (row.sure_percent?, row.sure_correct_percent?);
        Some(format!(
            "The attacker is sure of {} % of the {}, and right about {} % of those ({})",
            words::percent(sure),
            words::points(row.unit),
            words::percent(right),
            words::scheme_name(&row.scheme)
        ))
    });
    said.unwrap_or_else(|| "How well the attacker can judge its own result".to_owned())
}

fn speaking(document: &Document) -> Option<&Row> {
    let typed = tables::headline_threshold(document)?;
    let share = |row: &Row| verdict::share(row, &typed);
    [Basis::Released, Basis::Given, Basis::Oracle].into_iter().find_map(|basis| {
        let rows = document.results.iter();
        let of_scheme = rows.filter_map(|row| verdict::strongest(document, &row.scheme, basis));
        of_scheme.reduce(|a, b| if share(b) > share(a) { b } else { a })
    })
}

fn is_strongest(document: &Document, row: &Row, typed: &str) -> bool {
    let best = verdict::strongest_given(document, &row.scheme, &Given::of(row), typed);
    best.is_some_and(|best| std::ptr::eq(best, row))
}

/// Bins with at least this share of the released points are drawn; smaller ones scatter.
const LEAST_DRAWN: f64 = 0.005;

/// Returns (stated probability, share that was right), in percent, ascending; without bins of few points.
pub(crate) fn judged(row: &Row) -> Vec<(f64, f64)> {
    let least = LEAST_DRAWN * row.n_points as f64;
    row.reliability
        .iter()
        .flatten()
        .filter(|bin| bin.n as f64 >= least)
        .filter_map(|bin| Some((100.0 * bin.predicted?, 100.0 * bin.observed?)))
        .collect()
}

/// Returns the data of the script, with `drawn`, those of the 3D view and the pictures.
pub(crate) fn page_data(
    document: &Document,
    options: &RenderOptions,
    drawn: impl IntoIterator<Item = (&'static str, Value)>,
) -> Value {
    let thresholds = tables::thresholds(document);
    let choices = Choices::of(document);
    let by_threshold = |map: &ByThreshold| {
        thresholds.iter().map(|typed| map.get(typed).copied()).collect::<Vec<_>>()
    };
    let rows = document.results.iter().enumerate().map(|(index, row)| {
        let cdf = options.error_cdf.iter().find(|cdf| cdf.row == index);
        let given = Given::of(row);
        let strongest = thresholds.iter().map(|typed| is_strongest(document, row, typed));
        json!({
            // Places in the lists of the choices.
            "scheme": choices.scheme(&row.scheme),
            "given": choices.given(&given),
            "solver": choices.solver(&row.solver),
            "label": given.label(),
            "ratio": row.inlier_ratio,
            "strongest": strongest.collect::<Vec<bool>>(),
            "recovered": by_threshold(&row.recovered_percent),
            "errors": cdf.map_or_else(|| percentile_points(row), |cdf| cdf.points.clone()),
            "reliability": judged(row),
            "unknown": row.sure_unknown,
        })
    });
    let labels = thresholds.iter().map(|typed| {
        let label = tables::threshold_text(document, typed);
        json!({ "label": label, "value": typed.parse::<f64>().ok() })
    });
    let headline = tables::headline_threshold(document);
    let headline = headline.and_then(|typed| thresholds.iter().position(|it| *it == typed));
    let mut data = json!({
        "rows": rows.collect::<Vec<_>>(),
        "thresholds": labels.collect::<Vec<_>>(),
        "unit": unit_sign(document.results.first().map(|row| row.unit)),
        "headline": headline.unwrap_or(0),
        "schemes": choices.schemes,
        "givens": choices.givens,
        "solvers": choices.solvers,
        "first_given": choices.first_given,
    });
    drawn.into_iter().for_each(|(name, value)| data[name] = value);
    data
}

fn percentile_points(row: &Row) -> Vec<(f64, f64)> {
    let points = row.error_percentiles.iter();
    let mut points: Vec<(f64, f64)> =
        points.filter_map(|(percent, error)| Some(((*error)?, percent.parse().ok()?))).collect();
    // Shares within thresholds lie on the same curve.
    for (typed, &percent) in &row.recovered_percent {
        points.extend(typed.parse().ok().map(|threshold: f64| (threshold, percent)));
    }
    // As in measured curves, smaller errors are no different.
    let thresholds = row.recovered_percent.keys().filter_map(|typed| typed.parse().ok());
    let least = 0.01 * thresholds.fold(0.0, f64::max);
    points.iter_mut().for_each(|point| point.0 = point.0.max(least));
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points
}

/// The lists of choices. The script finds a row only by its places in them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Choices {
    pub schemes: Vec<SchemeChoice>,
    pub givens: Vec<GivenChoice>,
    pub solvers: Vec<String>,
    /// The neighborhoods that are shown first: those of today's strongest attack, else known neighbors,
    /// half of them right.
    pub first_given: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SchemeChoice {
    pub name: String,
    pub title: String,
    pub slot: usize,
    pub blind: Vec<Option<f64>>,
    /// Percent by the records alone, per threshold; `None` where that was not tried.
    pub alone: Vec<Option<f64>>,
    pub alone_by: String,
    /// The larger of the two baselines, per threshold; neighborhoods add what exceeds it.
    pub floor: Vec<Option<f64>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct GivenChoice {
    /// `known neighbors, 50 % right`, `neighbors by descriptor overlap, 9 to 12 % right`.
    pub label: String,
    /// The group in a menu: `released`, `given` or `oracle`.
    pub group: &'static str,
    /// The source: one curve of the oracle's ratios, or one mark of another source.
    pub source: String,
    pub name: String,
    #[serde(skip)]
    pub given: Given,
}

impl Choices {
    pub(crate) fn of(document: &Document) -> Self {
        let mut choices = Self::default();
        let thresholds = tables::thresholds(document);
        for row in &document.results {
            if choices.schemes.iter().all(|scheme| scheme.name != row.scheme) {
                choices.schemes.push(scheme(document, &row.scheme, &thresholds));
            }
            if !choices.solvers.contains(&row.solver) {
                choices.solvers.push(row.solver.clone());
            }
            let given = Given::of(row);
            if choices.givens.iter().all(|known| !known.given.same_choice(&given)) {
                choices.givens.push(given_choice(document, row));
            }
        }
        // Sorts by falling ratio within a source and keeps the order of sources.
        let sources: Vec<String> =
            choices.givens.iter().map(|given| given.source.clone()).collect();
        let turn = |given: &GivenChoice| sources.iter().position(|source| *source == given.source);
        choices.givens.sort_by(|a, b| {
            turn(a).cmp(&turn(b)).then(b.given.inlier_ratio.total_cmp(&a.given.inlier_ratio))
        });
        choices.first_given = first_given(document, &choices.givens);
        choices
    }

    pub(crate) fn given(&self, given: &Given) -> Option<usize> {
        self.givens.iter().position(|known| known.given.same_choice(given))
    }

    pub(crate) fn scheme(&self, name: &str) -> Option<usize> {
        self.schemes.iter().position(|scheme| scheme.name == name)
    }

    pub(crate) fn solver(&self, name: &str) -> Option<usize> {
        self.solvers.iter().position(|solver| solver == name)
    }
}

fn scheme(document: &Document, name: &str, thresholds: &[String]) -> SchemeChoice {
    let rows = || document.results.iter().filter(|row| row.scheme == name);
    let blind = |typed: &String| {
        rows().filter_map(|row| row.blind_percent.get(typed).copied()).max_by(f64::total_cmp)
    };
    let alone = |typed: &str| verdict::records_alone(document, name, typed);
    let by = tables::headline_threshold(document).and_then(|typed| alone(&typed)?.1);
    let floor = |typed: &String| {
        rows().filter_map(|row| row.baseline_percent(typed)).max_by(f64::total_cmp)
    };
    SchemeChoice {
        name: name.to_owned(),
        title: words::scheme_title(name),
        slot: slot(document, name),
        blind: thresholds.iter().map(blind).collect(),
        alone: thresholds.iter().map(|typed| Some(alone(typed)?.0)).collect(),
        alone_by: attack::records_alone(by),
        floor: thresholds.iter().map(floor).collect(),
    }
}

fn group(row: &Row) -> &'static str {
    match row.neighbors.as_str() {
        "oracle" => "oracle",
        "file" => "given",
        _ => "released",
    }
}

/// Returns one entry for all rows with these neighborhoods; their measured ratios become a range.
fn given_choice(document: &Document, row: &Row) -> GivenChoice {
    let given = Given::of(row);
    let same = document.results.iter().filter(|other| Given::of(other).same_choice(&given));
    let ratios: Vec<f64> = same.map(|row| row.inlier_ratio).collect();
    let low = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let high = ratios.iter().copied().fold(0.0, f64::max);
    let source = attack::source(&row.neighbors, row.oracle_noise.as_deref());
    let name = attack::plain_source(&row.neighbors, row.oracle_noise.as_deref());
    let said = [low, high].map(words::ratio_percent);
    let label = match said[0] == said[1] {
        true => given.label(),
        false => format!("{name}, {} to {} % right", said[0], said[1]),
    };
    GivenChoice { label, group: group(row), source, name, given }
}

/// Returns the place of the neighborhoods that are shown first: of the attacker's own sources the one that
/// recovers most; without one, the oracle whose ratio is nearest to half.
fn first_given(document: &Document, givens: &[GivenChoice]) -> usize {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let share = |row: &Row| verdict::share(row, &typed);
    let own = document.results.iter().filter(|row| group(row) == "released");
    let strongest = own.max_by(|a, b| share(a).total_cmp(&share(b)));
    let oracle = || {
        let schemes = document.results.first().map(|row| row.scheme.as_str());
        verdict::strongest(document, schemes?, Basis::Oracle)
    };
    let row = strongest.or_else(oracle);
    let place = row
        .map(Given::of)
        .and_then(|given| givens.iter().position(|known| known.given.same_choice(&given)));
    place.unwrap_or(0)
}

pub(crate) fn unit_sign(unit: Option<Unit>) -> &'static str {
    match unit {
        Some(Unit::KthNeighbor) => "×",
        Some(Unit::Pixel) => "px",
        Some(Unit::Meter) | None => "m",
    }
}

/// Number of colors and marks.
const SLOTS: usize = 8;

/// Returns the number of the color and mark of `scheme`; unknown schemes are numbered from the last one as they appear.
fn slot(document: &Document, scheme: &str) -> usize {
    let known = |name: &str| words::facts(name).map(|facts| facts.color);
    let others = || tables::schemes(document).into_iter().filter(|name| known(name).is_none());
    let number = || others().position(|name| name == scheme).unwrap_or(0);
    known(scheme).unwrap_or_else(|| (SLOTS - 1 + number()) % SLOTS)
}
