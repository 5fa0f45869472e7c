//! What protection costs: the localization error beside the leak, for every scheme.

use serde::Serialize;

use crate::attack::Basis;
use crate::document::{Document, FEWEST_HELD_OUT, Localization, UNPROTECTED};
use crate::page::tables::{Class, Table, column};
use crate::page::{tables, verdict};
use crate::words::align;
use crate::{attack, words};

/// A scheme counts as protecting if the strongest attack tried recovers less than this, in percent.
const LEAK: f64 = 20.0;
/// The largest localization error that counts as small, as a multiple of the unprotected one.
const COST: f64 = 2.0;
/// If the chart has more dots than this, only dots on the Pareto front have a name beside them.
const MOST_NAMES: usize = 20;
/// Width of a letter and height of a line of a name, in units of the chart.
const LETTER: f64 = 6.5;
const LINE: f64 = 11.0;
/// Smallest error of the axis, as a multiple.
const LEAST: f64 = 0.05;
/// Room for names on the right of the plot.
const MARGIN: f64 = 50.0;
/// Size of the chart's plot in its own units.
const SIZE: [f64; 2] = [560.0, 300.0];

/// The chart of leak against localization error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Chart {
    /// The result in a sentence.
    pub sentence: String,
    /// What the leak is: the attacks that count.
    pub leak: &'static str,
    /// What the error is.
    pub error: &'static str,
    pub size: [f64; 2],
    pub dots: Vec<Dot>,
    /// The corners of the Pareto front.
    pub front: String,
    pub ticks: Vec<Tick>,
    /// The right edge and the upper edge of the area of low leak and low error.
    pub target: [f64; 2],
    /// Where images stop to localize, if a scheme's do.
    pub edge: Option<f64>,
    /// Schemes that are not drawn, and why.
    pub missing: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Dot {
    pub name: String,
    pub title: String,
    pub at: [f64; 2],
    pub best: bool,
    /// Whether the name is left of the dot.
    pub is_left: bool,
    /// Vertical shift of the name, so that names of near dots do not overlap.
    pub shift: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Tick {
    pub at: f64,
    pub text: String,
}

/// A scheme's leak and localization error.
struct Point<'a> {
    one: &'a Localization,
    leak: f64,
    /// Infinite if cameras do not localize.
    cost: f64,
}

/// Returns the leak of a scheme in percent of the released points: the strongest attack from
/// released data, if such a source was tried on any scheme; else with the oracle at its headline
/// ratio. `None` if it was not tried on this scheme.
fn leak(document: &Document, scheme: &str, basis: Basis) -> Option<f64> {
    let typed = tables::headline_threshold(document)?;
    let row = verdict::strongest(document, scheme, basis)?;
    let rows = document.results.iter().filter(|row| row.scheme == scheme);
    let baselines = rows.filter_map(|row| row.baseline_percent(&typed));
    Some(baselines.fold(verdict::share(row, &typed), f64::max))
}

fn basis(document: &Document) -> Basis {
    let own = |row| attack::basis(row) == Basis::Released;
    if document.results.iter().any(own) { Basis::Released } else { Basis::Oracle }
}

fn points(document: &Document) -> (Vec<Point<'_>>, Vec<String>) {
    let (mut points, mut missing) = (Vec::new(), Vec::new());
    let basis = basis(document);
    let of_map = |one: &&Localization| !one.of_queries && one.scheme != UNPROTECTED;
    for one in document.localization.iter().filter(of_map) {
        match leak(document, &one.scheme, basis) {
            _ if one.is_unknown() => missing.push(format!(
                "{}: its descriptors are changed, so only {FEWEST_HELD_OUT} or more held-out images tell the cost",
                one.scheme
            )),
            None => missing.push(format!("{}: this attack was not tried on it", one.scheme)),
            Some(leak) => {
                points.push(Point { one, leak, cost: one.cost().unwrap_or(f64::INFINITY) });
            }
        }
    }
    (points, missing)
}

/// Returns the chart; `None` without a scheme that has both figures.
pub(crate) fn chart(document: &Document) -> Option<Chart> {
    let (points, missing) = points(document);
    if points.is_empty() {
        return None;
    }
    let finite = points.iter().map(|point| point.cost.max(LEAST)).filter(|cost| cost.is_finite());
    let (least, most) = finite.fold((0.5, COST), |(a, b), cost| (cost.min(a), cost.max(b)));
    let (least, most) = (least / 1.05, most * 1.15);
    let fails = points.iter().any(|point| point.cost.is_infinite());
    let width = if fails { 0.86 * SIZE[0] } else { SIZE[0] };
    let x = |cost: f64| match cost.is_finite() {
        true => width * (cost.max(LEAST) / least).ln() / (most / least).ln(),
        false => 0.93 * SIZE[0],
    };
    let y = |leak: f64| SIZE[1] * (1.0 - leak / 100.0);
    let best = |point: &Point<'_>| {
        point.cost.is_finite()
            && !points.iter().any(|other| {
                other.cost <= point.cost
                    && other.leak <= point.leak
                    && (other.cost < point.cost || other.leak < point.leak)
            })
    };
    let mut front: Vec<&Point<'_>> = points.iter().filter(|point| best(point)).collect();
    front.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut corners = Vec::new();
    for (at, point) in front.iter().enumerate() {
        let (x, y) = (x(point.cost), y(point.leak));
        if at > 0 {
            corners.push(format!("{x:.1},{:.1}", self::y_of(&corners)));
        }
        corners.push(format!("{x:.1},{y:.1}"));
    }
    let mut dots: Vec<Dot> = Vec::new();
    for point in &points {
        let at = [x(point.cost), y(point.leak)];
        // The titles name all dots.
        let is_named = points.len() <= MOST_NAMES || best(point);
        let name = if is_named { point.one.scheme.clone() } else { String::new() };
        // Names that would leave the chart are left of their dots.
        let is_left = at[0] + span(&name) > SIZE[0] + MARGIN;
        let side = |is_left: bool, x: f64, name: &str| match is_left {
            true => [x - span(name), x],
            false => [x, x + span(name)],
        };
        // The nearest height at which the name overlaps no other one.
        let overlaps = |shift: f64, dot: &Dot| {
            let [a, b] = side(is_left, at[0], &name);
            let [c, d] = side(dot.is_left, dot.at[0], &dot.name);
            let apart = (dot.at[1] + dot.shift - at[1] - shift).abs();
            !dot.name.is_empty() && a < d && c < b && apart < LINE
        };
        let fits = |shift: &f64| {
            let inside = (0.0..=SIZE[1]).contains(&(at[1] + shift));
            inside && !dots.iter().any(|dot| overlaps(*shift, dot))
        };
        let shifts = (0..=dots.len()).map(|lines| LINE * lines as f64);
        let shift = shifts.flat_map(|shift| [shift, -shift]).find(fits).unwrap_or(0.0);
        dots.push(Dot {
            name,
            title: title(point),
            at: at.map(|x| (10.0 * x).round() / 10.0),
            best: best(point),
            is_left,
            shift,
        });
    }
    let steps = [0.05, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0];
    let ticks = steps.into_iter().filter(|&cost| (least..=most).contains(&cost));
    let held_out = points.iter().any(|point| point.one.measured().is_some());
    Some(Chart {
        sentence: sentence(&points, &missing),
        leak: match basis(document) {
            Basis::Oracle => "the strongest attack tried with known neighbors",
            Basis::Released | Basis::Given => {
                "the strongest attack tried from the released data alone"
            }
        },
        error: match held_out {
            true => "the median error of the camera center of held-out images",
            false => "the information bound of the camera center: all true matches, noise of 1 px",
        },
        size: SIZE,
        dots,
        front: corners.join(" "),
        ticks: ticks.map(|cost| Tick { at: x(cost), text: format!("{cost}×") }).collect(),
        target: [x(COST), y(LEAK)],
        edge: fails.then_some(width),
        missing,
    })
}

/// Returns the width of a name and of its distance from the dot.
fn span(name: &str) -> f64 {
    LINE + LETTER * name.len() as f64
}

/// Returns the height of the last corner.
fn y_of(corners: &[String]) -> f64 {
    let last = corners.last().and_then(|corner| corner.split_once(','));
    last.and_then(|(_, y)| y.parse().ok()).unwrap_or(0.0)
}

fn title(point: &Point<'_>) -> String {
    let cost = match point.cost.is_finite() {
        true => format!("{} times the unprotected error", words::significant(point.cost, 3)),
        false => "most cameras do not localize".to_owned(),
    };
    format!("{}: {} % come back, {cost}", point.one.scheme, words::percent(point.leak))
}

/// Returns which schemes keep the attacks below [`LEAK`] at an error within [`COST`].
fn sentence(points: &[Point<'_>], missing: &[String]) -> String {
    let within = |point: &&Point<'_>| point.leak < LEAK && point.cost <= COST;
    let names: Vec<String> =
        points.iter().filter(within).map(|point| point.one.scheme.clone()).collect();
    let limits = format!("below {LEAK} % at a localization error within twice the unprotected one");
    let known = if missing.is_empty() { "tried here" } else { "with both figures" };
    match names.as_slice() {
        [] => format!("No scheme {known} keeps an attacker {limits}."),
        [one] => format!(
            "{one} keeps the attacks tried here {limits}. A better attack may recover more."
        ),
        names => format!(
            "{} keep the attacks tried here {limits}. A better attack may recover more.",
            words::list(names)
        ),
    }
}

/// Returns the table of localization errors beside the leak; `None` without any.
pub(crate) fn table(document: &Document) -> Option<Table> {
    let first = document.results.first()?;
    if document.localization.is_empty() {
        return None;
    }
    let (unit, basis) = (first.unit, basis(document));
    let held_out = document.localization.iter().find_map(|one| one.held_out.as_ref());
    let recalls: Vec<String> =
        held_out.map(|one| one.recall_percent.keys().cloned().collect()).unwrap_or_default();
    let mut columns = vec![column("scheme", Class::Label), column("protects", Class::Label)];
    let mut figures = vec![
        "come back, % of released".to_owned(),
        "% of all points".to_owned(),
        "bound: times unprotected".to_owned(),
        "camera center".to_owned(),
        "rotation, degrees".to_owned(),
        "do not localize, %".to_owned(),
    ];
    if held_out.is_some() {
        figures.extend(
            ["held out: times unprotected", "camera center", "rotation, degrees", "right matches"]
                .map(str::to_owned),
        );
        figures.extend(recalls.iter().map(|limits| format!("within {limits}, %")));
    }
    columns.extend(figures.into_iter().map(|name| column(name, Class::Figure)));
    let none = || "–".to_owned();
    let said = |value: Option<f64>, digits| {
        value.map_or_else(none, |value| words::significant(value, digits))
    };
    let length = |value: Option<f64>| value.map_or_else(none, |value| words::length(value, unit));
    let rows = document.localization.iter().map(|one| {
        let leak = leak(document, &one.scheme, basis).filter(|_| !one.of_queries);
        let of_scheme = document.results.iter().find(|row| row.scheme == one.scheme);
        let released = of_scheme.map_or(1.0, |row| {
            row.n_points as f64 / (row.n_points + row.dropped.values().sum::<usize>()).max(1) as f64
        });
        let protects = match (one.scheme.as_str(), one.of_queries) {
            (UNPROTECTED, _) => "nothing",
            (_, true) => "the query",
            (_, false) => "the map",
        };
        let mut cells = vec![
            one.scheme.clone(),
            protects.to_owned(),
            leak.map_or_else(none, words::percent),
            leak.map_or_else(none, |leak| words::percent(leak * released)),
            if one.changes_descriptors { none() } else { said(one.multiple, 3) },
            if one.changes_descriptors { none() } else { length(one.center_error) },
            if one.changes_descriptors { none() } else { said(one.rotation_error_degrees, 3) },
            if one.changes_descriptors { none() } else { words::percent(one.failed_percent) },
        ];
        if held_out.is_some() {
            let own = one.held_out.as_ref();
            cells.extend([
                said(own.and_then(|own| own.multiple), 3),
                length(own.and_then(|own| own.center_error)),
                said(own.and_then(|own| own.rotation_error_degrees), 3),
                own.map_or_else(none, |own| format!("{} of {}", own.right_matches, own.matches)),
            ]);
            cells.extend(recalls.iter().map(|limits| {
                let recall = own.and_then(|own| own.recall_percent.get(limits));
                recall.map_or_else(none, |recall| words::percent(*recall))
            }));
        }
        cells
    });
    let rows: Vec<Vec<String>> = rows.collect();
    let caption = "What protection costs: what comes back, and how precisely a camera can be placed. The bound uses all true matches of \
                   an image, with noise of 1 px; medians over images.";
    Some(Table::new("cost", caption, columns, rows))
}

/// Returns lines for the terminal, or an empty text.
pub(crate) fn text(document: &Document) -> String {
    let lines = |one: &Localization| {
        let held_out = match one.measured() {
            Some(found) => format!("{} held-out images", found.n_images),
            None => "bound".to_owned(),
        };
        let cost = match one.cost() {
            Some(cost) => format!("{}x", words::significant(cost, 3)),
            None if one.is_unknown() => "not known".to_owned(),
            None => "does not localize".to_owned(),
        };
        let leak = leak(document, &one.scheme, basis(document)).filter(|_| !one.of_queries);
        let leak = leak.map_or("-".to_owned(), |leak| format!("{} %", words::percent(leak)));
        // This percentage is of the bound.
        let failed = match one.measured() {
            Some(_) => "-".to_owned(),
            None => format!("{} %", words::percent(one.failed_percent)),
        };
        vec![one.scheme.clone(), leak, cost, held_out, failed]
    };
    if document.localization.is_empty() {
        return String::new();
    }
    let head = ["scheme", "leak", "localization error", "by", "not localized"].map(str::to_owned);
    let of_map = document.localization.iter().filter(|one| !one.of_queries);
    let rows: Vec<Vec<String>> = [head.to_vec()].into_iter().chain(of_map.map(lines)).collect();
    let said = chart(document).map(|chart| chart.sentence).unwrap_or_default();
    format!("\n{}{said}\n", align(&rows, &[0, 3]))
}
