//! The comparison of two audits: what leaks more, what leaks less, and what only one of them has.

use indexmap::IndexMap;
use jiff::civil::Date;
use jiff::{Timestamp, tz::TimeZone};
use serde::Serialize;
use serde_json::json;

use crate::attack::{self, Basis};
use crate::document::{ByThreshold, Document, Error, Input, Localization, Row, Spread};
use crate::page::verdict::not_tried;
use crate::results::{Results, distinct};
use crate::{templates, words};

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
    /// The largest difference at which this figure counts as the same.
    pub tolerance_points: f64,
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
    /// Largest difference, in percentage points, at which a figure counts as the same whose own spread is smaller.
    pub tolerance_points: f64,
    /// Whether nothing leaks more, nothing is lost, and both audits are of the same inputs, or of inputs whose difference is accepted.
    pub passed: bool,
    /// Inputs that differ, so that a smaller figure may say nothing.
    pub different: Vec<String>,
    /// Why inputs may differ, if the user said so.
    pub accepted: Option<Accepted>,
    /// Doubts about the new audit that the old one has not: smaller figures may say nothing, whatever is accepted.
    pub doubts: Vec<String>,
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

/// The user's statement that inputs may differ, until a day.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Accepted {
    /// The reason.
    pub reason: String,
    /// The last day on which it holds, as `2027-03-01`.
    pub until: String,
    /// Whether that day is past.
    pub past: bool,
}

impl Accepted {
    /// Parses "reason, until 2027-03-01".
    ///
    /// # Errors
    /// If there is no reason, or no such day: what was expected.
    pub fn parse(text: &str) -> Result<Self, &'static str> {
        Self::on(Timestamp::now().to_zoned(TimeZone::UTC).date(), text)
    }

    fn on(today: Date, text: &str) -> Result<Self, &'static str> {
        const EXPECTED: &str = "\"REASON, until YYYY-MM-DD\"";
        let (reason, until) = text.rsplit_once(", until ").ok_or(EXPECTED)?;
        let day: Date = until.trim().parse().map_err(|_| EXPECTED)?;
        // A time is a day, too, to the parser.
        let day = Some(day).filter(|day| day.to_string() == until.trim()).ok_or(EXPECTED)?;
        let reason = Some(reason.trim()).filter(|reason| !reason.is_empty()).ok_or(EXPECTED)?;
        Ok(Self { reason: reason.to_owned(), until: day.to_string(), past: day < today })
    }
}

/// A property in which two audits, or an audit and a release, differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Incomparable {
    /// `unit`, `thresholds`, `results`, or a property of the input.
    pub place: String,
    /// The value of the old audit, or of the release.
    pub expected: String,
    /// The value of the new audit, or of the audit of the release.
    pub found: String,
}

/// Usual largest difference between seeds of one audit, in percentage points.
const USUAL_TOLERANCE: f64 = 2.0;
/// Growth of a localization error that counts as the same; random directions change it by some percent.
const GROWTH: f64 = 1.1;

/// Compares the figures of two audits. Rows match by scheme, source, noise, requested inlier ratio (a measured one is a result),
/// K and solver. Baselines are compared per scheme.
///
/// `accepted` lets inputs differ. It lets nothing leak more.
///
/// The tolerance of a figure is twice its larger standard deviation over repeats in both audits. It is at least 2 points, or twice the
/// largest deviation of any figure if that is less, as few repeats may agree by chance.
///
/// # Errors
/// Fails if units or thresholds differ, or if no row matches.
pub fn compare(
    old: &Document,
    new: &Document,
    accepted: Option<Accepted>,
) -> Result<Comparison, Incomparable> {
    let [was, is] = &[old, new].map(Results::of);
    let within = &common_thresholds(was, is)?;
    // The largest standard deviation of a share over repeats.
    let deviations = was.rows.iter().chain(is.rows).filter_map(|row| row.std.as_ref());
    let deviations =
        deviations.flat_map(|std| std.recovered_percent.values().chain(std.blind_percent.values()));
    let twice = |spread: f64| (200.0 * spread).ceil() / 100.0;
    let most = deviations.copied().reduce(f64::max);
    let tolerance_points = most.map_or(USUAL_TOLERANCE, |most| twice(most).min(USUAL_TOLERANCE));
    let tolerance = |rows: &[&Row], of: fn(&Spread) -> &ByThreshold, typed: [&str; 2]| {
        let stds = rows.iter().filter_map(|row| row.std.as_ref());
        let own = stds.flat_map(|std| typed.map(|typed| of(std).get(typed))).flatten();
        own.map(|&own| twice(own)).fold(tolerance_points, f64::max)
    };
    let of_attack =
        |rows: &[&Row], typed: [&str; 2]| tolerance(rows, |std| &std.recovered_percent, typed);
    let mut all = Vec::new();
    // Attacks of the new audit alone, beside the strongest of the old one. They count if they recover more.
    let (mut only_new, mut new_attacks) = (Vec::new(), Vec::new());
    let mut taken = vec![false; was.rows.len()];
    for row in is.rows {
        let of = unmatched(row);
        let own = |typed: &str| row.recovered_percent.get(typed).copied();
        let is_like = |(before, taken): (&Row, &bool)| {
            !taken && attack::is_same(row, before) && before.k == row.k
        };
        if let Some(at) = was.rows.iter().zip(&taken).position(is_like) {
            taken[at] = true;
            let before = |typed: &str| was.rows[at].recovered_percent.get(typed).copied();
            let both = |typed: [&str; 2]| of_attack(&[&was.rows[at], row], typed);
            all.extend(changes(within, &of, before, own, both));
            continue;
        }
        if attack::basis(row) != Basis::Oracle {
            let strongest = |typed: &str| strongest(was, &row.scheme, typed);
            let tolerance = |typed: [&str; 2]| of_attack(&[row], typed);
            new_attacks.extend(changes(within, &of, strongest, own, tolerance));
        }
        only_new.push(of);
    }
    if all.is_empty() {
        return Err(Incomparable {
            place: "results".into(),
            expected: "an attack of the same scheme, source, ratio, k and solver".to_owned(),
            found: format!("none among {}", is.rows.len()),
        });
    }
    let missing = was.rows.iter().zip(&taken).filter(|(_, taken)| !**taken);
    let mut only_old: Vec<Unmatched> = missing.map(|(row, _)| unmatched(row)).collect();
    for &scheme in &is.schemes {
        let of = |attack: &str| Unmatched { scheme: scheme.to_owned(), attack: attack.to_owned() };
        let [before, now] = [was, is].map(|of| move |typed: &str| of.blind(scheme, typed));
        let rows: Vec<&Row> = was.of_scheme(scheme).chain(is.of_scheme(scheme)).collect();
        let of_blind = |typed: [&str; 2]| tolerance(&rows, |std| &std.blind_percent, typed);
        all.extend(changes(within, &of("blind guess"), before, now, of_blind));
        let alone = of("records alone");
        let [before, now] =
            [was, is].map(|of| move |typed: &str| Some(of.records_alone(scheme, typed)?.0));
        all.extend(changes(within, &alone, before, now, |_| tolerance_points));
        let has_alone =
            [was, is].map(|of| of.of_scheme(scheme).any(|row| row.records_alone_percent.is_some()));
        match has_alone {
            [true, false] => only_old.push(alone),
            [false, true] => {
                let strongest = |typed: &str| strongest(was, scheme, typed);
                new_attacks.extend(changes(within, &alone, strongest, now, |_| tolerance_points));
                only_new.push(alone);
            }
            _ => {}
        }
    }
    // Rounding errors in the last bit must not fail a build.
    let is_beyond = |change: &Change, points: f64| points > change.tolerance_points + 1e-9;
    let (mut more, rest): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|change| is_beyond(change, change.points));
    let (mut less, same): (Vec<_>, Vec<_>) =
        rest.into_iter().partition(|change| is_beyond(change, -change.points));
    more.extend(new_attacks.into_iter().filter(|change| is_beyond(change, change.points)));
    more.sort_by(|a, b| b.points.total_cmp(&a.points));
    less.sort_by(|a, b| a.points.total_cmp(&b.points));
    let differs = |of: Incomparable| {
        format!("{}: {} in the old audit, {} in the new one", of.place, of.expected, of.found)
    };
    // Doubts are alike up to their figures, which differ between seeds. Earlier versions had notes only.
    let kind = |doubt: &str| doubt.split(|c: char| c.is_ascii_digit()).next().map(str::to_owned);
    let old_kinds: Vec<_> = old.notes.iter().chain(&old.doubts).map(|of| kind(of)).collect();
    let doubts = new.doubts.iter().filter(|doubt| !old_kinds.contains(&kind(doubt)));
    let mut comparison = Comparison {
        tolerance_points,
        passed: false,
        different: different(&old.input, &new.input).into_iter().map(differs).collect(),
        accepted,
        doubts: doubts.cloned().collect(),
        more,
        less,
        same,
        costs_more: costs_more(old, new),
        lost: lost(was, is, &taken),
        only_old,
        only_new,
    };
    comparison.passed = comparison.is_like()
        && comparison.lost.is_empty()
        && comparison.more.is_empty()
        && comparison.costs_more.is_empty();
    Ok(comparison)
}

/// Returns the percentage that the strongest attack on the released data of a scheme recovers, a baseline included; of a scheme that
/// was not audited, that of any scheme.
fn strongest(results: &Results<'_>, scheme: &str, typed: &str) -> Option<f64> {
    let is_known = results.schemes.contains(&scheme);
    let schemes = results.schemes.iter().filter(|name| !is_known || **name == scheme);
    let of_scheme = |scheme: &&str| {
        let rows = results.of_scheme(scheme).filter(|row| attack::basis(row) != Basis::Oracle);
        let own = rows.filter_map(|row| row.recovered_percent.get(typed).copied());
        let alone = results.records_alone(scheme, typed).map(|(percent, _)| percent);
        own.chain(results.blind(scheme, typed)).chain(alone).reduce(f64::max)
    };
    schemes.filter_map(of_scheme).reduce(f64::max)
}

/// Returns the changes of the figure of an attack from the old to the new audit, by pairs of thresholds.
fn changes(
    within: &[[&str; 2]],
    of: &Unmatched,
    was: impl Fn(&str) -> Option<f64>,
    is: impl Fn(&str) -> Option<f64>,
    tolerance: impl Fn([&str; 2]) -> f64,
) -> Vec<Change> {
    let change = |&[before, after]: &[&str; 2]| {
        let (old_percent, new_percent) = (was(before)?, is(after)?);
        Some(Change {
            scheme: of.scheme.clone(),
            attack: of.attack.clone(),
            threshold: after.to_owned(),
            old_percent,
            new_percent,
            points: new_percent - old_percent,
            tolerance_points: tolerance([before, after]),
        })
    };
    within.iter().filter_map(change).collect()
}

/// Returns the properties in which two inputs differ, or may differ, as share-safe audits have no hashes.
pub(crate) fn different(a: &Input, b: &Input) -> Vec<Incomparable> {
    let mut different = Vec::new();
    let mut expect = |property: &str, was: &str, is: &str| {
        if was != is {
            let [place, expected, found] = [property, was, is].map(str::to_owned);
            different.push(Incomparable { place, expected, found });
        }
    };
    let scale = |scale: Option<f64>| scale.map_or("none".to_owned(), |scale| scale.to_string());
    expect("points", &a.n_points.to_string(), &b.n_points.to_string());
    expect("scale", &scale(a.scale_m_per_unit), &scale(b.scale_m_per_unit));
    // Without a scale, thresholds and parameters of schemes are multiples of a distance in the map.
    let unit = |of: &Input| of.unit_in_map_units.map(|unit| words::significant(unit, 6));
    if let (Some(was), Some(is)) = (unit(a), unit(b)) {
        expect("map units per unit of the thresholds", &was, &is);
    }
    if let (Some(was), Some(is)) = (a.size(), b.size()) {
        expect("size", &was, &is);
    }
    for (role, was) in &a.other_sha256 {
        let is = b.other_sha256.get(role).unwrap_or(was);
        expect(&format!("hash of {role}"), was, is);
    }
    // A scheme may release one truth in any number of files.
    let has_truth = [a, b].iter().all(|input| input.other_sha256.contains_key("truth"));
    let [was, is] = [a, b].map(|of| of.sha256.as_deref());
    if was.is_none() || (was != is && !(has_truth && is.is_some())) {
        let hash = |of: Option<&str>| of.unwrap_or("none (--share-safe)").to_owned();
        let (place, expected, found) = ("hash of the map or images".into(), hash(was), hash(is));
        different.push(Incomparable { place, expected, found });
    }
    different
}

/// Returns the schemes of the old audit that localize less precisely in the new one, or whose error is no longer known.
fn costs_more(old: &Document, new: &Document) -> Vec<CostsMore> {
    let mut all = old.localization.iter().chain(&new.localization);
    let is_measured = all.all(|of| of.measured().is_some());
    let multiple = |of: &Localization| match of.measured() {
        Some(held_out) if is_measured => held_out.multiple,
        _ => of.multiple.filter(|_| !of.changes_descriptors),
    };
    // A scheme that is not audited any more is missing elsewhere.
    let audits = |scheme: &str| new.results.iter().any(|row| row.scheme == scheme);
    let worse = |was: &Localization| {
        let is_of = |is: &&Localization| is.scheme == was.scheme && is.of_queries == was.of_queries;
        let is = new.localization.iter().find(is_of);
        let (old_multiple, new_multiple) = (multiple(was)?, is.and_then(multiple));
        let is_worse = new_multiple.is_none_or(|new| new > GROWTH * old_multiple);
        is_worse.then(|| CostsMore { scheme: was.scheme.clone(), old_multiple, new_multiple })
    };
    let compared = old.localization.iter().filter(|was| was.of_queries || audits(&was.scheme));
    compared.filter_map(worse).collect()
}

/// Returns the thresholds of both audits, as typed in the old and in the new one.
fn common_thresholds<'a>(
    old: &Results<'a>,
    new: &Results<'a>,
) -> Result<Vec<[&'a str; 2]>, Incomparable> {
    let [was, is] = [old, new].map(|of| of.unit.name());
    if was != is && !old.rows.is_empty() && !new.rows.is_empty() {
        return Err(Incomparable { place: "unit".into(), expected: was.into(), found: is.into() });
    }
    let equal = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    let (was, is) = (&old.thresholds, &new.thresholds);
    let like = |a: &&'a str| Some([*a, *is.iter().find(|b| equal(a, b))?]);
    let pairs: Vec<[&str; 2]> = was.iter().filter_map(like).collect();
    if pairs.len() != was.len() || pairs.len() != is.len() {
        let listed = |typed: &[&str]| match typed {
            [] => "none".to_owned(),
            typed => typed.join(", "),
        };
        let (expected, found) = (listed(was), listed(is));
        return Err(Incomparable { place: "thresholds".into(), expected, found });
    }
    Ok(pairs)
}

/// Returns the scheme and the attack of a row, without a measured ratio, which differs even between equal audits.
fn unmatched(row: &Row) -> Unmatched {
    let source = attack::source(row);
    let right = match attack::is_oracle(&row.neighbors) {
        true => format!(", {} % true neighbors", words::ratio_percent(row.inlier_ratio)),
        false => String::new(),
    };
    let attack = format!("{source}{right}, K = {}, {}", row.k, row.solver);
    Unmatched { scheme: row.scheme.clone(), attack }
}

/// Returns the schemes of the old audit without a matching row in the new one, and the sources that are no longer audited.
fn lost(old: &Results<'_>, new: &Results<'_>, taken: &[bool]) -> Vec<Lost> {
    let refused =
        |scheme: &str, by: Option<&str>| Some(format!("not audited: {}", new.refusal(scheme, by)?));
    let lost = old.rows.iter().filter_map(|Row { scheme, neighbors, .. }| {
        let mut rows = old.rows.iter().zip(taken).filter(|(row, _)| row.scheme == *scheme);
        let (neighbors, reason) = if rows.any(|(_, taken)| *taken) {
            (Some(neighbors.clone()), refused(scheme, Some(neighbors))?)
        } else {
            let otherwise = match new.schemes.contains(&scheme.as_str()) {
                true => "no attack of the old audit is in the new one",
                false if words::facts(scheme).is_none() => {
                    "no row in the new audit; to compare two versions of your scheme, give both audits the same --name"
                }
                false => "no row in the new audit",
            };
            (None, refused(scheme, None).unwrap_or_else(|| otherwise.to_owned()))
        };
        Some(Lost { scheme: scheme.clone(), neighbors, reason })
    });
    distinct(lost)
}

impl Comparison {
    /// Returns true if the new audit has all attacks of the old one without new doubts, on the same inputs or on inputs that may differ.
    fn is_like(&self) -> bool {
        let is_accepted = self.accepted.as_ref().is_some_and(|accepted| !accepted.past);
        let is_same = self.different.is_empty() || is_accepted;
        is_same && self.doubts.is_empty() && self.only_old.is_empty()
    }

    /// Returns the comparison in one line.
    pub fn summary(&self) -> String {
        let [more, less, same] = [&self.more, &self.less, &self.same].map(Vec::len);
        let points = self.tolerance_points;
        let not = if self.is_like() { "" } else { "not like for like: " };
        let mut text = format!(
            "{not}{} figures compared, tolerance {points} points or twice a figure's own spread: {more} leak more, {less} less, {same} as before",
            more + less + same
        );
        for (n, what) in [
            (self.costs_more.len(), "localize less precisely"),
            (self.lost.len(), "no longer audited"),
        ] {
            if n > 0 {
                text.push_str(&format!("; {n} {what}"));
            }
        }
        text
    }
}

/// Draws `comparison` of `old` and `new` as one self-contained HTML page.
pub fn page(comparison: &Comparison, old: &Document, new: &Document) -> Result<String, Error> {
    let audits = [("old", old), ("new", new)].map(|(which, document)| {
        json!({
            "which": which,
            "path": document.input.path,
            "sha256": document.input.sha256,
            "n_points": document.input.n_points,
            "seed": document.seed,
            "unlift": document.unlift,
        })
    });
    let results = Results::of(new);
    let thresholds = results.thresholds.iter().map(|typed| (typed, results.threshold(typed)));
    let page = json!({
        "style": include_str!("../template/style.css"),
        "comparison": comparison,
        "summary": comparison.summary(),
        "not_tried": not_tried(&results),
        "share_safe": old.input.path.is_none() && new.input.path.is_none(),
        "audits": audits,
        "thresholds": thresholds.collect::<IndexMap<_, _>>(),
    });
    templates::render(&[("compare.html", include_str!("../template/compare.html"))], &page)
}

#[cfg(test)]
mod tests {
    use super::Accepted;

    #[test]
    fn an_accepted_difference_holds_until_the_end_of_its_day() {
        let past = |text| {
            let today = "2026-11-29".parse().expect("a day");
            Accepted::on(today, text).map(|accepted| accepted.past)
        };
        assert_eq!(past("rooms, 2 of them, until 2026-11-29"), Ok(false));
        assert_eq!(past("rooms, until 2026-11-28"), Ok(true));
        for text in [
            "rooms",
            ", until 2026-11-29",
            "rooms, until 2026-13-01",
            "rooms, until soon",
            "rooms, until 2026-12-01T10:00",
        ] {
            assert!(past(text).is_err(), "{text}");
        }
    }
}
