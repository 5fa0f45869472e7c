//! What protection costs: the localization error beside the leak, for every scheme.

use serde::Serialize;
use serde_json::{Value, json};

use crate::attack::{self, Basis};
use crate::document::{FEWEST_HELD_OUT, HeldOut, Localization, UNPROTECTED};
use crate::page::verdict::is_decided;
use crate::results::Results;
use crate::table::{NONE, Table, figure, known, label};
use crate::words;

/// A scheme counts as protecting if the strongest attack tried recovers less than this, in percent.
const LEAK: f64 = 20.0;
/// The largest localization error that counts as small, as a multiple of the unprotected one.
const COST: f64 = 2.0;
/// If the chart has more dots than this, only dots on the Pareto front have a name beside them.
const MAX_NAMES: usize = 20;
/// Width of a letter and height of a line of a name, in units of the chart.
const LETTER: f64 = 6.5;
const LINE: f64 = 11.0;
/// Smallest error of the axis, as a multiple.
const LEAST: f64 = 0.05;
/// Room for names on the right of the plot.
const MARGIN: f64 = 50.0;
const SIZE: [f64; 2] = [560.0, 300.0];

#[derive(Debug, Clone, Serialize)]
struct Dot {
    scheme: String,
    /// The name beside the dot; empty if there are too many.
    name: String,
    leak: String,
    /// The multiple of the error; `None` if cameras do not localize.
    cost: Option<String>,
    at: [f64; 2],
    best: bool,
    /// Whether the name is left of the dot.
    is_left: bool,
    /// Vertical shift of the name, so that names of near dots do not overlap.
    shift: f64,
}

impl Dot {
    fn span(&self) -> [f64; 2] {
        let [x, width] = [self.at[0], LINE + LETTER * self.name.len() as f64];
        if self.is_left { [x - width, x] } else { [x, x + width] }
    }

    fn overlaps(&self, other: &Self) -> bool {
        let ([a, b], [c, d]) = (self.span(), other.span());
        let apart = (other.at[1] + other.shift - self.at[1] - self.shift).abs();
        !other.name.is_empty() && a < d && c < b && apart < LINE
    }
}

struct Point<'a> {
    of: &'a Localization,
    leak: f64,
    /// Infinite if cameras do not localize.
    cost: f64,
}

/// Returns the leak of a scheme in percent of the released points: the strongest attack from
/// released data, if such a source was tried on any scheme; else with the oracle at its headline
/// ratio. `None` if it was not tried on this scheme, or the scheme protects queries.
fn leak(results: &Results<'_>, of: &Localization) -> Option<f64> {
    let row = results.strongest(&of.scheme, basis(results)).filter(|_| !of.of_queries)?;
    let baseline = results.max(&of.scheme, |row| row.baseline_percent(results.headline));
    Some(results.share(row).max(baseline.unwrap_or(0.0)))
}

fn basis(results: &Results<'_>) -> Basis {
    let is_own = |row| attack::basis(row) == Basis::Released;
    if results.rows.iter().any(is_own) { Basis::Released } else { Basis::Oracle }
}

/// Returns the schemes that the chart shows, and those that it does not, with the reasons.
fn points<'a>(results: &Results<'a>) -> (Vec<Point<'a>>, Vec<String>) {
    let (mut points, mut changed, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    let of_map = |of: &&Localization| !of.of_queries && of.scheme != UNPROTECTED;
    for of in results.document.localization.iter().filter(of_map) {
        match leak(results, of) {
            _ if of.is_unknown() => changed.push(of.scheme.as_str()),
            None => missing.push(format!("{}: this attack was not tried on it", of.scheme)),
            Some(leak) => {
                points.push(Point { of, leak, cost: of.cost().unwrap_or(f64::INFINITY) });
            }
        }
    }
    if !changed.is_empty() {
        let names = words::list(&changed);
        missing.push(format!(
            "{names}, whose descriptors are changed, so that only {FEWEST_HELD_OUT} or more held-out images tell the cost"
        ));
    }
    (points, missing)
}

/// Returns the chart of leak against localization error; `None` without a scheme that has both figures.
pub(crate) fn chart(results: &Results<'_>) -> Option<Value> {
    let (points, missing) = points(results);
    if points.is_empty() {
        return None;
    }
    let finite = points.iter().map(|point| point.cost.max(LEAST)).filter(|cost| cost.is_finite());
    let (least, largest) = finite.fold((0.5, COST), |(a, b), cost| (cost.min(a), cost.max(b)));
    let (least, largest) = (least / 1.05, largest * 1.15);
    let fails = points.iter().any(|point| point.cost.is_infinite());
    let width = if fails { 0.86 * SIZE[0] } else { SIZE[0] };
    let x = |cost: f64| match cost.is_finite() {
        true => width * (cost.max(LEAST) / least).ln() / (largest / least).ln(),
        false => 0.93 * SIZE[0],
    };
    let y = |leak: f64| SIZE[1] * (1.0 - leak / 100.0);
    let is_best = |point: &&Point<'_>| {
        let beats = |other: &Point<'_>| {
            other.cost <= point.cost
                && other.leak <= point.leak
                && (other.cost < point.cost || other.leak < point.leak)
        };
        point.cost.is_finite() && !points.iter().any(beats)
    };
    let mut front: Vec<&Point<'_>> = points.iter().filter(is_best).collect();
    front.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    // The corners of the Pareto front, as stairs.
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for point in front {
        let (x, y) = (x(point.cost), y(point.leak));
        corners.extend(corners.last().map(|last| [x, last[1]]));
        corners.push([x, y]);
    }
    let corners: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    let mut dots: Vec<Dot> = Vec::new();
    for point in &points {
        let best = is_best(&point);
        let is_named = points.len() <= MAX_NAMES || best;
        let scheme = point.of.scheme.clone();
        let cost = point.cost.is_finite().then(|| words::significant(point.cost, 3));
        let at = [x(point.cost), y(point.leak)];
        let mut dot = Dot {
            name: if is_named { scheme.clone() } else { String::new() },
            leak: words::percent(point.leak),
            scheme,
            cost,
            at,
            best,
            is_left: false,
            shift: 0.0,
        };
        // Names that would leave the chart are left of their dots.
        dot.is_left = dot.span()[1] > SIZE[0] + MARGIN;
        // The nearest height at which the name overlaps no other one.
        let shifts = (0..=dots.len()).map(|lines| LINE * lines as f64);
        let shift = shifts.flat_map(|shift| [shift, -shift]).find(|&shift| {
            let moved = Dot { shift, ..dot.clone() };
            let inside = (0.0..=SIZE[1]).contains(&(at[1] + shift));
            inside && !dots.iter().any(|other| moved.overlaps(other))
        });
        dot.shift = shift.unwrap_or(0.0);
        dots.push(dot);
    }
    dots.iter_mut().for_each(|dot| dot.at = dot.at.map(|x| (10.0 * x).round() / 10.0));
    let steps = [0.05, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0];
    let ticks = steps.into_iter().filter(|cost| (least..=largest).contains(cost));
    let ticks = ticks.map(|cost| json!({ "at": x(cost), "text": format!("{cost}×") }));
    Some(json!({
        "sentence": sentence(results, &points, &missing),
        "by_known_neighbors": basis(results) == Basis::Oracle,
        "is_measured": points.iter().any(|point| point.of.measured().is_some()),
        "size": SIZE,
        "dots": dots,
        "front": corners.join(" "),
        "ticks": ticks.collect::<Vec<_>>(),
        // The right and the upper edge of the area of low leak and low error.
        "target": [x(COST), y(LEAK)],
        // Where images stop to localize, if a scheme's do.
        "edge": fails.then_some(width),
        "missing": missing,
    }))
}

/// Returns which schemes keep the attacks below [`LEAK`] at an error within [`COST`].
fn sentence(results: &Results<'_>, points: &[Point<'_>], missing: &[String]) -> String {
    let within = points.iter().filter(|point| point.leak < LEAK && point.cost <= COST);
    let names = within.map(|point| point.of.scheme.clone());
    let (names, open): (Vec<String>, Vec<String>) =
        names.partition(|scheme| is_decided(results, Some(scheme)));
    let open =
        (!open.is_empty()).then(|| format!("Nothing is decided about {}.", words::list(&open)));
    let limits = format!("below {LEAK} % at a localization error within twice the unprotected one");
    if names.is_empty() {
        let known = if missing.is_empty() { "tried here" } else { "with both figures" };
        return open.unwrap_or_else(|| format!("No scheme {known} keeps an attacker {limits}."));
    }
    let keep = if names.len() == 1 { "keeps" } else { "keep" };
    let names = words::list(&names);
    let kept = format!(
        "{names} {keep} the attacks tried here {limits}. A better attack may recover more."
    );
    [Some(kept), open].into_iter().flatten().collect::<Vec<_>>().join(" ")
}

/// Returns the table of localization errors beside the leak; `None` without any.
pub(crate) fn table(results: &Results<'_>) -> Option<Table> {
    let localization = &results.document.localization;
    if localization.is_empty() || results.rows.is_empty() {
        return None;
    }
    type Of = Localization;
    let number = |value: Option<f64>| known(value, |value| words::significant(value, 3));
    let percent = |value: Option<f64>| known(value, words::percent);
    let length = |value: Option<f64>| known(value, |value| words::length(value, results.unit));
    let protects = |of: &Of| match (of.scheme.as_str(), of.of_queries) {
        (UNPROTECTED, _) => "nothing".to_owned(),
        (_, true) => "the query".to_owned(),
        (_, false) => "the map".to_owned(),
    };
    let mut columns = vec![
        label("scheme", |of: &Of| of.scheme.clone()),
        label("protects", protects),
        figure("come back, % of released", move |of: &Of| percent(leak(results, of))),
        figure("% of all points", move |of: &Of| percent(leak_of_all(results, of))),
        figure("bound: times unprotected", move |of: &Of| number(bound(of, of.multiple))),
        figure("camera center", move |of: &Of| length(bound(of, of.center_error))),
        figure("rotation, degrees", move |of: &Of| number(bound(of, of.rotation_error_degrees))),
        figure("do not localize, %", move |of: &Of| percent(bound(of, Some(of.failed_percent)))),
    ];
    let held_out = localization.iter().find_map(|of| of.held_out.as_ref());
    if let Some(HeldOut { recall_percent, .. }) = held_out {
        fn of_held_out<'a>(cell: impl Fn(&HeldOut) -> String + 'a) -> impl Fn(&Of) -> String + 'a {
            move |of| of.held_out.as_ref().map_or(NONE.to_owned(), &cell)
        }
        let matches = |own: &HeldOut| format!("{} of {}", own.right_matches, own.matches);
        columns.extend([
            figure("held out: times unprotected", of_held_out(move |own| number(own.multiple))),
            figure("camera center", of_held_out(move |own| length(own.center_error))),
            figure("rotation, degrees", of_held_out(move |own| number(own.rotation_error_degrees))),
            figure("right matches", of_held_out(matches)),
        ]);
        columns.extend(recall_percent.keys().map(|limits| {
            let recall = move |own: &HeldOut| percent(own.recall_percent.get(limits).copied());
            figure(format!("within {limits}, %"), of_held_out(recall))
        }));
    }
    let caption = "What protection costs: what comes back, and how precisely a camera can be placed. The bound uses all true matches of \
                   an image, with noise of 1 px; medians over images.";
    Some(Table::of("cost", caption, localization, columns))
}

/// Returns the leak in percent of all points, of which a scheme may release a part.
fn leak_of_all(results: &Results<'_>, of: &Localization) -> Option<f64> {
    let (row, leak) = (results.of_scheme(&of.scheme).next()?, leak(results, of)?);
    let dropped: usize = row.dropped.values().sum();
    Some(leak * row.n_points as f64 / (row.n_points + dropped).max(1) as f64)
}

/// Returns a value of the bound, which says nothing about changed descriptors.
fn bound(of: &Localization, value: Option<f64>) -> Option<f64> {
    value.filter(|_| !of.changes_descriptors)
}

/// Returns lines for the terminal, or an empty text.
pub(crate) fn text(results: &Results<'_>) -> String {
    let localization = &results.document.localization;
    if localization.is_empty() {
        return String::new();
    }
    let percent = words::percent_or_dash;
    let leaks = if basis(results) == Basis::Oracle { "leak by oracle" } else { "leak today" };
    let mut columns = vec![
        label("scheme", |of: &Localization| of.scheme.clone()),
        figure(leaks, move |of: &Localization| percent(leak(results, of))),
        figure("localization error", |of: &Localization| match of.cost() {
            Some(cost) => format!("{}x", words::significant(cost, 3)),
            None if of.is_unknown() => "not known".to_owned(),
            None => "does not localize".to_owned(),
        }),
        label("by", |of: &Localization| match (of.measured(), &of.held_out) {
            (Some(held_out), _) => format!("{} held-out images", held_out.n_images),
            (None, Some(few)) if of.is_unknown() => {
                format!("{} held-out images, {FEWEST_HELD_OUT} are needed", few.n_images)
            }
            (None, _) => "bound".to_owned(),
        }),
        // This percentage is of the bound.
        figure("not localized", move |of: &Localization| {
            percent(bound(of, Some(of.failed_percent)).filter(|_| of.measured().is_none()))
        }),
    ];
    let of_all = |of: &Localization| leak_of_all(results, of);
    let leaves_out =
        localization.iter().any(|of| of_all(of) < leak(results, of).map(|of| 0.9 * of));
    if leaves_out {
        columns.insert(2, figure("of all points", move |of: &Localization| percent(of_all(of))));
    }
    let of_map = localization.iter().filter(|of| !of.of_queries);
    let table = Table::of("cost", "", of_map, columns).text();
    let (points, missing) = points(results);
    let sentence = match points.is_empty() {
        true => String::new(),
        false => sentence(results, &points, &missing),
    };
    let of_what = if leaves_out { "leak: percent of the released points\n" } else { "" };
    format!("\n{table}{of_what}{sentence}\n")
}
