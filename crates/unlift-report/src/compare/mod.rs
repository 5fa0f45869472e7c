//! The comparison of two audits: what leaks more, what leaks less, and what only one of them has.

use unlift::Unit;

use minijinja::value::Serde;
use serde::Serialize;

use crate::document::{Document, Localization, Row};
use crate::page::{environment, tables};
use crate::{Error, attack, words};

/// The old and the new figure of one attack, scheme and threshold.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The attack: `oracle, 50 % true neighbors, K = 50, joint`, `blind guess` or `records alone`.
    pub attack: String,
    /// The threshold as typed in the new audit.
    pub threshold: String,
    /// Percent that came back in the old audit.
    pub old_percent: f64,
    /// Percent that comes back in the new one.
    pub new_percent: f64,
    /// The difference (new minus old) in percentage points.
    pub points: f64,
}

/// A row that only one audit has.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Unmatched {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The attack, as [`Change::attack`].
    pub attack: String,
}

/// A scheme or source of the old audit without figures in the new one, so it may leak more.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Lost {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The source of neighborhoods; `None` if the whole scheme is lost.
    pub neighbors: Option<String>,
    /// The reason.
    pub reason: String,
}

/// A scheme under which cameras are placed less precisely than before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CostsMore {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The localization error in the old audit, as a multiple of the unprotected one.
    pub old_multiple: f64,
    /// The error in the new audit; `None` if it is not known or cameras do not localize.
    pub new_multiple: Option<f64>,
}

/// The comparison of two audits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Largest difference, in percentage points, at which a figure counts as the same.
    pub tolerance_points: f64,
    /// The origin of the tolerance: `twice the spread of repeats` or `usual without repeats`.
    pub tolerance_is: &'static str,
    /// Whether nothing leaks more, nothing is lost, and both audits are of the same inputs.
    pub passed: bool,
    /// Inputs that differ, so that a smaller figure may say nothing.
    pub different: Vec<String>,
    /// Figures that leak more, the largest difference first.
    pub more: Vec<Change>,
    /// Figures that leak less, the largest difference first.
    pub less: Vec<Change>,
    /// Figures that are the same up to the tolerance, in the order of the new audit.
    pub same: Vec<Change>,
    /// Schemes whose localization error has grown by more than a tenth. Held-out images are compared
    /// with held-out images, bounds with bounds.
    pub costs_more: Vec<CostsMore>,
    /// Schemes and sources that cannot be compared any more.
    pub lost: Vec<Lost>,
    /// Rows of the old audit only.
    pub only_old: Vec<Unmatched>,
    /// Rows of the new audit only.
    pub only_new: Vec<Unmatched>,
}

/// The reason why two audits cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Incomparable {
    /// `unit`, `thresholds` or `results`.
    pub place: &'static str,
    /// The value of the old audit.
    pub expected: String,
    /// The value of the new audit.
    pub found: String,
}

/// Usual largest difference between seeds of one audit, in percentage points.
const USUAL_TOLERANCE: f64 = 2.0;
/// Growth of a localization error that counts as the same; random directions change it by some
/// percent.
const GROWTH: f64 = 1.1;
const RECORDS_ALONE: &str = "records alone";

/// Compares the figures of two audits. Rows match by scheme, source, noise, requested inlier ratio (a measured one is a result),
/// K and solver. Baselines are compared per scheme.
///
/// The tolerance is twice the largest standard deviation over repeats in both audits, or 2 points without repeats.
///
/// # Errors
/// Fails if units or thresholds differ, or if no row matches.
pub fn compare(old: &Document, new: &Document) -> Result<Comparison, Incomparable> {
    let within = common_thresholds(old, new)?;
    let mut changes = Vec::new();
    let mut only_new = Vec::new();
    let mut taken = vec![false; old.results.len()];
    for row in &new.results {
        let like =
            (0..old.results.len()).find(|&at| !taken[at] && same_attack(&old.results[at], row));
        let Some(at) = like else {
            only_new.push(unmatched(row));
            continue;
        };
        taken[at] = true;
        let shares = |row: &Row, typed: &str| row.recovered_percent.get(typed).copied();
        changes.extend(within.iter().filter_map(|(was, is)| {
            let shares = (shares(&old.results[at], was)?, shares(row, is)?);
            Some(change(&row.scheme, attack_of(row), is, shares))
        }));
    }
    if changes.is_empty() {
        return Err(Incomparable {
            place: "results",
            expected: "an attack of the same scheme, source, ratio, k and solver".to_owned(),
            found: format!("none among {}", new.results.len()),
        });
    }
    let schemes = tables::schemes(new);
    for scheme in &schemes {
        changes.extend(baselines(old, new, scheme, &within));
    }
    let unseen = old.results.iter().zip(&taken).filter(|(_, taken)| !**taken);
    let mut only_old: Vec<Unmatched> = unseen.map(|(row, _)| unmatched(row)).collect();
    for scheme in schemes {
        let alone = |document: &Document| {
            let mut rows = document.results.iter().filter(|row| row.scheme == scheme);
            rows.any(|row| row.records_alone_percent.is_some())
        };
        let one = || Unmatched { scheme: scheme.to_owned(), attack: RECORDS_ALONE.to_owned() };
        let there = old.results.iter().any(|row| row.scheme == scheme);
        match (alone(old), alone(new)) {
            (true, false) => only_old.push(one()),
            (false, true) if there => only_new.push(one()),
            _ => {}
        }
    }
    let lost = lost(old, new, &taken);
    let (tolerance_points, tolerance_is) = match spread(old, new) {
        Some(spread) => ((200.0 * spread).ceil() / 100.0, "twice the spread of repeats"),
        None => (USUAL_TOLERANCE, "usual without repeats"),
    };
    // Rounding errors in the last bit must not fail a build.
    let beyond = tolerance_points + 1e-9;
    let (mut more, rest): (Vec<_>, Vec<_>) =
        changes.into_iter().partition(|change| change.points > beyond);
    let (mut less, same): (Vec<_>, Vec<_>) =
        rest.into_iter().partition(|change| change.points < -beyond);
    more.sort_by(|a, b| b.points.total_cmp(&a.points));
    less.sort_by(|a, b| a.points.total_cmp(&b.points));
    let costs_more = costs_more(old, new);
    let different = different(old, new);
    let like = different.is_empty() && only_old.is_empty() && lost.is_empty();
    let passed = like && more.is_empty() && costs_more.is_empty();
    Ok(Comparison {
        tolerance_points,
        tolerance_is,
        passed,
        different,
        more,
        less,
        same,
        costs_more,
        lost,
        only_old,
        only_new,
    })
}

/// Returns the inputs that differ. Share-safe audits have no hashes.
fn different(old: &Document, new: &Document) -> Vec<String> {
    let (a, b) = (&old.input, &new.input);
    let mut found = Vec::new();
    let mut expect = |what: &str, was: String, is: String| {
        if was != is {
            found.push(format!("{what}: {was} in the old audit, {is} in the new one"));
        }
    };
    let scale = |scale: Option<f64>| scale.map_or("none".to_owned(), |scale| scale.to_string());
    expect("points", a.n_points.to_string(), b.n_points.to_string());
    expect("scale", scale(a.scale_m_per_unit), scale(b.scale_m_per_unit));
    if let (Some(was), Some(is)) = (a.size(), b.size()) {
        expect("size", was, is);
    }
    let both = a
        .other_sha256
        .iter()
        .filter_map(|(role, was)| Some((role, was, b.other_sha256.get(role)?)));
    for (role, was, is) in both.clone() {
        expect(&format!("hash of the file of {role}"), was.clone(), is.clone());
    }
    // A scheme may release one truth in any number of files.
    if let (Some(was), Some(is)) = (&a.sha256, &b.sha256)
        && both.clone().all(|(role, ..)| role != "truth")
    {
        expect("hash of the map or images", was.clone(), is.clone());
    }
    found
}

/// Returns the schemes of the old audit that localize less precisely in the new one, or whose
/// error is no longer known.
fn costs_more(old: &Document, new: &Document) -> Vec<CostsMore> {
    let held_out =
        |document: &Document| document.localization.iter().all(|o| o.measured().is_some());
    let both = held_out(old) && held_out(new);
    let multiple = |one: &Localization| match one.measured() {
        Some(held_out) if both => held_out.multiple,
        _ => one.multiple.filter(|_| !one.changes_descriptors),
    };
    let worse = |was: &Localization| {
        let is = new.localization.iter().find(|is| is.scheme == was.scheme);
        let (old_multiple, new_multiple) = (multiple(was)?, is.and_then(multiple));
        let is_worse = new_multiple.is_none_or(|new| new > GROWTH * old_multiple);
        is_worse.then(|| CostsMore { scheme: was.scheme.clone(), old_multiple, new_multiple })
    };
    old.localization.iter().filter_map(worse).collect()
}

/// Returns the largest standard deviation of a share over repeats, in percentage points; `None` without repeats.
fn spread(old: &Document, new: &Document) -> Option<f64> {
    let rows = old.results.iter().chain(&new.results);
    let spreads = rows.filter_map(|row| row.std.as_ref());
    let shares =
        spreads.flat_map(|std| std.recovered_percent.values().chain(std.blind_percent.values()));
    shares.copied().reduce(f64::max)
}

fn common_thresholds(
    old: &Document,
    new: &Document,
) -> Result<Vec<(String, String)>, Incomparable> {
    let unit = |document: &Document| document.results.first().map(|row| unit_name(row.unit));
    if let (Some(was), Some(is)) = (unit(old), unit(new))
        && was != is
    {
        return Err(Incomparable { place: "unit", expected: was.into(), found: is.into() });
    }
    let (was, is) = (tables::thresholds(old), tables::thresholds(new));
    let equal = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    let pairs: Vec<(String, String)> = was
        .iter()
        .filter_map(|a| Some((a.clone(), is.iter().find(|b| equal(a, b))?.clone())))
        .collect();
    if pairs.len() != was.len() || pairs.len() != is.len() {
        let said = |typed: &[String]| match typed {
            [] => "none".to_owned(),
            typed => typed.join(", "),
        };
        return Err(Incomparable { place: "thresholds", expected: said(&was), found: said(&is) });
    }
    Ok(pairs)
}

fn unit_name(unit: Unit) -> &'static str {
    match unit {
        Unit::Meter => "m",
        Unit::KthNeighbor => "kth_neighbor",
        Unit::Pixel => "px",
    }
}

fn same_attack(a: &Row, b: &Row) -> bool {
    let noise = |row: &Row| row.oracle_noise.clone().unwrap_or_else(|| "uniform".to_owned());
    a.scheme == b.scheme
        && a.neighbors == b.neighbors
        && (!attack::is_oracle(&a.neighbors)
            || (a.inlier_ratio == b.inlier_ratio && noise(a) == noise(b)))
        && a.k == b.k
        && a.solver == b.solver
}

/// Returns the name of a row's attack, without a measured ratio, which differs even between equal audits.
fn attack_of(row: &Row) -> String {
    let source = attack::source(&row.neighbors, row.oracle_noise.as_deref());
    let right = match attack::is_oracle(&row.neighbors) {
        true => format!(", {} % true neighbors", words::ratio_percent(row.inlier_ratio)),
        false => String::new(),
    };
    format!("{source}{right}, K = {}, {}", row.k, row.solver)
}

fn unmatched(row: &Row) -> Unmatched {
    Unmatched { scheme: row.scheme.clone(), attack: attack_of(row) }
}

fn change(scheme: &str, attack: String, typed: &str, (was, is): (f64, f64)) -> Change {
    Change {
        scheme: scheme.to_owned(),
        attack,
        threshold: typed.to_owned(),
        old_percent: was,
        new_percent: is,
        points: is - was,
    }
}

fn baselines(
    old: &Document,
    new: &Document,
    scheme: &str,
    within: &[(String, String)],
) -> Vec<Change> {
    type Figure = fn(&Row, &str) -> Option<f64>;
    let figures: [(&str, Figure); 2] = [
        ("blind guess", |row, typed| row.blind_percent.get(typed).copied()),
        (RECORDS_ALONE, |row, typed| row.records_alone_percent.as_ref()?.get(typed).copied()),
    ];
    let mut changes = Vec::new();
    for (name, figure) in figures {
        for (was, is) in within {
            let largest = |document: &Document, typed: &str| {
                let rows = document.results.iter().filter(|row| row.scheme == scheme);
                rows.filter_map(|row| figure(row, typed)).max_by(f64::total_cmp)
            };
            if let (Some(old), Some(new)) = (largest(old, was), largest(new, is)) {
                changes.push(change(scheme, name.to_owned(), is, (old, new)));
            }
        }
    }
    changes
}

/// Returns the schemes of the old audit without a matching row in the new one, and the sources that are no longer audited.
fn lost(old: &Document, new: &Document, taken: &[bool]) -> Vec<Lost> {
    let mut lost: Vec<Lost> = Vec::new();
    for row in &old.results {
        let (scheme, source) = (&row.scheme, &row.neighbors);
        let mut rows = old.results.iter().zip(taken).filter(|(other, _)| other.scheme == *scheme);
        let refused = |whole: bool| {
            new.not_audited.iter().find(|refused| {
                refused.scheme == *scheme
                    && match &refused.neighbors {
                        None => whole,
                        Some(by) => !whole && by == source,
                    }
            })
        };
        let (neighbors, reason) = if rows.all(|(_, taken)| !taken) {
            let there = new.results.iter().any(|other| other.scheme == *scheme);
            let reason = match refused(true) {
                Some(refused) => format!("not audited: {}", refused.reason),
                None if there => "no attack of the old audit is in the new one".to_owned(),
                None => "no row in the new audit".to_owned(),
            };
            (None, reason)
        } else if let Some(refused) = refused(false) {
            (Some(source.clone()), format!("not audited: {}", refused.reason))
        } else {
            continue;
        };
        let one = Lost { scheme: scheme.clone(), neighbors, reason };
        if !lost.contains(&one) {
            lost.push(one);
        }
    }
    lost
}

impl Comparison {
    /// Returns the comparison in one line.
    pub fn summary(&self) -> String {
        let count = self.more.len() + self.less.len() + self.same.len();
        let point = if self.tolerance_points == 1.0 { "point" } else { "points" };
        let not = if self.different.is_empty() && self.only_old.is_empty() {
            ""
        } else {
            "not compared: "
        };
        let mut text = format!(
            "{not}{count} figures compared, tolerance {} {point} ({}): {} leak more, {} less, {} as before",
            self.tolerance_points,
            self.tolerance_is,
            self.more.len(),
            self.less.len(),
            self.same.len()
        );
        if !self.costs_more.is_empty() {
            let n = self.costs_more.len();
            text.push_str(&format!("; {n} localize less precisely"));
        }
        if !self.lost.is_empty() {
            text.push_str(&format!("; {} cannot be compared any more", self.lost.len()));
        }
        text
    }
}

const STYLE: &str = include_str!("../../template/style.css");
const TEMPLATE: &str = include_str!("../../template/compare.html");

#[derive(Serialize)]
struct Page<'a> {
    style: &'static str,
    comparison: &'a Comparison,
    summary: String,
    share_safe: bool,
    audits: [Audit<'a>; 2],
    tables: Vec<Figures>,
}

#[derive(Serialize)]
struct Audit<'a> {
    which: &'static str,
    path: Option<&'a str>,
    sha256: Option<&'a str>,
    n_points: String,
    seed: u64,
    unlift: &'a str,
}

#[derive(Serialize)]
struct Figures {
    id: &'static str,
    title: &'static str,
    rows: Vec<[String; 6]>,
}

/// Draws `comparison` of `old` and `new` as one self-contained HTML page.
pub fn page(comparison: &Comparison, old: &Document, new: &Document) -> Result<String, Error> {
    let audits = [("old", old), ("new", new)].map(|(which, document)| Audit {
        which,
        path: document.input.path.as_deref(),
        sha256: document.input.sha256.as_deref(),
        n_points: words::thousands(document.input.n_points),
        seed: document.seed,
        unlift: &document.unlift,
    });
    let table = |id, title, changes: &[Change]| Figures {
        id,
        title,
        rows: changes.iter().map(|change| cells(new, change)).collect(),
    };
    let tables = vec![
        table("more", "Leaks more", &comparison.more),
        table("less", "Leaks less", &comparison.less),
        table("same", "As before", &comparison.same),
    ];
    let page = Page {
        style: STYLE,
        comparison,
        summary: comparison.summary(),
        share_safe: old.input.path.is_none() && new.input.path.is_none(),
        audits,
        tables: tables.into_iter().filter(|table| !table.rows.is_empty()).collect(),
    };
    let mut env = environment();
    env.add_template("compare.html", TEMPLATE)?;
    Ok(env.get_template("compare.html")?.render(Serde(&page))?)
}

fn cells(new: &Document, change: &Change) -> [String; 6] {
    [
        change.scheme.clone(),
        change.attack.clone(),
        tables::threshold_text(new, &change.threshold),
        words::percent(change.old_percent),
        words::percent(change.new_percent),
        format!("{:+.1}", change.points),
    ]
}
