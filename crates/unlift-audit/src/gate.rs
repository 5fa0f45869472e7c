//! Gates: bounds on how much of a map may be recovered.
//!
//! ```text
//! SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT
//! ```
//!
//! `ppl@0.5:0.10<=20` fails if more than 20 % of the points are recovered within 0.10 under `ppl` at inlier ratio 0.5. `SCHEME` may
//! be `all`. Without `@RATIO`, a solver or a source, all of them count. Every noise model and K counts. The upper end of the 95 %
//! interval of the strongest attack decides. Attacks that need no neighborhoods (the blind guess and records alone) count as well,
//! unless a solver or the oracle is named. `:gain` bounds what neighborhoods add to the larger of these two baselines, in
//! percentage points. `SCHEME:localization<=MULTIPLE` fails if the error of localization exceeds the unprotected one by more than
//! this factor. Numbers are compared by value, so `0.1` matches the threshold `0.10`. No name of a solver or a source is a number,
//! so the first number after the scheme is the threshold. `sequence@5`, `sequence+lists@5` and `tracks@5` are sources:
//! `dcl2d:sequence@5:10<=20` bounds what comes back from five queries, with their lists if these are used, `olc:again:0.10<=20` what comes back from two releases of a
//! map.

use std::str::FromStr;

use unlift::audit::doubts::{noise, short};
use unlift::audit::{NotAudited, Row, WithInterval};
use unlift::neighbors::oracle::Noise;
use unlift::recover::Builtin;
use unlift::{PointSet, Unit};
use unlift_report::attack::{AGAIN, AGAIN_GEOMETRY, SEQUENCES, queries};
use unlift_report::document::{FEWEST_HELD_OUT, GateResult, HeldOut, Localization, UNPROTECTED};

use crate::document::{Attacked, Tried};
use crate::doubts::{HOPELESS, nearest};
use crate::{Error, bail, sources};

/// A bound on a figure of an audit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gate {
    typed: String,
    /// The scheme's name; `None` for all. So for solver, source and inlier ratio.
    scheme: Option<String>,
    solver: Option<&'static str>,
    source: Option<String>,
    inlier_ratio: Option<f64>,
    /// The threshold, in the unit of the audit; infinite for localization, which has none.
    threshold: f64,
    figure: Figure,
    /// The largest allowed value, in percent, percentage points or multiples.
    bound_percent: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Figure {
    #[default]
    Recovered,
    /// The percentage recovered, minus that of an attacker without neighborhoods.
    Gain,
    /// The error of localization, as a multiple of the unprotected one.
    Localization,
}

impl Gate {
    fn covers_scheme(&self, scheme: &str) -> bool {
        self.scheme.as_deref().is_none_or(|name| name == scheme)
    }

    fn covers(&self, row: &Row) -> bool {
        let is_requested = |ratio| row.oracle_noise.is_some() && row.inlier_ratio == ratio;
        self.covers_scheme(&row.scheme)
            && self.solver.is_none_or(|name| name == row.solver)
            // Who has several queries also has the lists within each.
            && self.source.as_deref().is_none_or(|name| {
                name == row.neighbors || name == row.neighbors.replacen("+lists", "", 1)
            })
            && self.inlier_ratio.is_none_or(is_requested)
    }

    /// Returns true if the gate applies to something without a row. If a scheme could not be applied, every gate on it does.
    fn misses(&self, missing: &NotAudited) -> bool {
        let of_source = |name: &String| self.source.as_ref().is_none_or(|wanted| wanted == name);
        let of_ratio = self.inlier_ratio.is_none_or(|wanted| missing.inlier_ratio == Some(wanted));
        self.covers_scheme(&missing.scheme)
            && missing.neighbors.as_ref().is_none_or(|name| of_source(name) && of_ratio)
    }

    /// Returns the part of the gate for which the audit has no row: what was expected, and what was found.
    fn not_in(&self, tried: &Tried) -> Option<String> {
        let unknown = |known: &[String], named: Option<&str>| {
            named.filter(|name| known.iter().all(|known| known != name)).map(str::to_owned)
        };
        let ratio = self.inlier_ratio.filter(|ratio| !tried.inlier_ratios.contains(ratio));
        let has_threshold = self.figure == Figure::Localization || self.label_in(tried).is_some();
        let ratios: Vec<String> = tried.inlier_ratios.iter().map(f64::to_string).collect();
        let labels: Vec<String> = tried.thresholds.iter().map(|t| t.label.clone()).collect();
        let parts = [
            ("scheme", &tried.schemes, unknown(&tried.schemes, self.scheme.as_deref())),
            ("solver", &tried.solvers, unknown(&tried.solvers, self.solver)),
            ("neighbors", &tried.sources, unknown(&tried.sources, self.source.as_deref())),
            ("inlier ratio", &ratios, ratio.map(|ratio| ratio.to_string())),
            (THRESHOLD, &labels, (!has_threshold).then(|| self.threshold.to_string())),
        ];
        parts.into_iter().find_map(|(part, known, unknown)| {
            let expected = match known.is_empty() && part == "inlier ratio" {
                true => "none, because measured ratios have no gates".to_owned(),
                false => format!("one of {}", known.join(", ")),
            };
            Some(format!("{part}: expected {expected}, found {}", unknown?))
        })
    }

    /// Whether attacks that need no neighborhoods count.
    fn counts_baselines(&self) -> bool {
        self.solver.is_none() && self.source.as_deref() != Some(ORACLE)
    }

    fn label_in<'t>(&self, tried: &'t Tried) -> Option<&'t str> {
        let threshold = tried.thresholds.iter().find(|of| of.value == self.threshold);
        threshold.map(|threshold| &*threshold.label)
    }

    /// Returns the bounded figure of a row within the threshold `label`; NaN if it is not known. The upper end of its interval decides.
    fn bounded(&self, row: &Row, label: &str) -> WithInterval {
        let unknown = WithInterval { percent: f64::NAN, interval: [f64::NAN; 2] };
        let recovered = row.recovered(label).unwrap_or(unknown);
        let baseline = row.baseline(label).unwrap_or(unknown);
        match self.figure {
            Figure::Recovered if self.counts_baselines() && is_worse(&baseline, &recovered) => {
                baseline
            }
            Figure::Recovered => recovered,
            Figure::Gain => WithInterval {
                percent: recovered.percent - baseline.percent,
                interval: [f64::NAN, recovered.highest_gain(&baseline)],
            },
            // Not a figure of a row.
            Figure::Localization => unknown,
        }
    }

    /// Returns the row of `rows` with the largest bounded figure. `None` if the gate covers none of
    /// them, which must never count as passing.
    fn worst<'r>(&self, rows: &'r [Row], label: &str) -> Option<(WithInterval, &'r Row)> {
        let covered = rows.iter().filter(|row| self.covers(row));
        let figures = covered.map(|row| (self.bounded(row, label), row));
        figures.reduce(|a, b| if is_worse(&b.0, &a.0) { b } else { a })
    }

    /// Returns true if the upper end of a figure is within the bound. NaN is not.
    fn passes(&self, highest: f64) -> bool {
        highest <= self.bound_percent
    }

    /// Parses the form that the module describes.
    pub fn parse(text: &str) -> Result<Self, String> {
        const FORM: &str = "SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT";
        let form =
            |what: &str| format!("expected {FORM} (for example ppl@0.5:0.10<=20), found {what}");
        let typed = text.trim();
        let (left, bound) = typed.split_once("<=").ok_or_else(|| form("no <="))?;
        let bound = |sign: char, expected: &str, fits: fn(&f64) -> bool| {
            let bound = number(bound.trim().trim_end_matches(sign), expected, fits);
            bound.map_err(|error| format!("bound: {error}"))
        };
        let named = |scheme: &str| (scheme != "all").then(|| scheme.to_owned());
        if let Some((scheme, "localization")) = left.rsplit_once(':') {
            let scheme = scheme.trim();
            if scheme.is_empty() || scheme.contains([':', '@']) {
                return Err(format!("expected SCHEME:localization<=MULTIPLE, found {typed}"));
            }
            return Ok(Self {
                typed: typed.to_owned(),
                scheme: named(scheme),
                threshold: f64::INFINITY,
                figure: Figure::Localization,
                bound_percent: bound('x', "a multiple above 0", is_positive)?,
                ..Self::default()
            });
        }
        let (names, inlier_ratio, rest) = match left.split_once('@') {
            // `sequence@5` is the name of a source.
            Some((names, rest)) if !SEQUENCES.iter().any(|name| names.ends_with(name)) => {
                let (text, rest) = rest.split_once(':').ok_or_else(|| form("no threshold"))?;
                let value = ratio(text).map_err(|error| format!("inlier ratio: {error}"))?;
                (names.split(':').collect::<Vec<_>>(), Some(value), rest.split(':').collect())
            }
            _ => {
                let mut names: Vec<&str> = left.split(':').collect();
                let rest = names.split_off(n_names(&names));
                (names, None, rest)
            }
        };
        let (threshold, figure) = match rest.as_slice() {
            [] => return Err(form("no threshold")),
            [threshold] => (threshold, Figure::Recovered),
            [threshold, "gain"] => (threshold, Figure::Gain),
            [_, unknown, ..] => return Err(form(&format!(":{unknown} (only :gain is known)"))),
        };
        let (scheme, others) = names.split_first().ok_or_else(|| form("no scheme"))?;
        let (solver, source) = qualifiers(others)?;
        if let (Some(source), Some(ratio)) = (&source, inlier_ratio)
            && source != ORACLE
        {
            let expected = format!("none with neighbors by {source}, whose ratio is measured");
            return Err(format!("inlier ratio: expected {expected}, found @{ratio}"));
        }
        // Names are checked against the plan later.
        let scheme = match scheme.trim() {
            "" => return Err(form("no scheme")),
            name => named(name),
        };
        let threshold = positive(threshold).map_err(|error| format!("threshold: {error}"))?;
        let bound_percent = bound('%', "0 to 100 percent", |x| (0.0..=100.0).contains(x))?;
        let typed = typed.to_owned();
        Ok(Self { typed, scheme, solver, source, inlier_ratio, threshold, figure, bound_percent })
    }
}

/// Returns whether the upper end of `a` is larger; what is no number is largest.
fn is_worse(a: &WithInterval, b: &WithInterval) -> bool {
    let [a, b] = [a, b].map(|of| of.interval[1]);
    !(b.is_nan() || b >= a)
}

const ORACLE: &str = "oracle";
/// The part of a gate that further options change.
const THRESHOLD: &str = "threshold";

/// Counts the names left of `<=`: all parts before the first number. Without a number, all known
/// names, so that the next part is reported as a wrong threshold.
fn n_names(parts: &[&str]) -> usize {
    let is_number = |part: &&str| part.trim().parse::<f64>().is_ok();
    let is_unknown = |part: &&str| solver_name(part).is_none() && source_name(part).is_none();
    let mut after = parts.iter().skip(1);
    let end = after.clone().position(is_number).or_else(|| after.position(is_unknown));
    end.map_or(parts.len(), |at| at + 1)
}

fn solver_name(text: &str) -> Option<&'static str> {
    Builtin::from_name(text.trim()).ok().map(|solver| solver.name())
}

fn source_name(text: &str) -> Option<String> {
    match text.trim() {
        name @ (ORACLE | "file" | AGAIN | AGAIN_GEOMETRY) => Some(name.to_owned()),
        name if queries(name).is_some() => Some(name.to_owned()),
        name => sources::named(name).ok().map(|named| named.name().to_owned()),
    }
}

/// Finds a solver and a source among the names after a scheme, each at most once, in any order.
fn qualifiers(names: &[&str]) -> Result<(Option<&'static str>, Option<String>), String> {
    let (mut solver, mut source) = (None, None);
    for name in names {
        let (kind, earlier) = if let Some(name) = solver_name(name) {
            ("solver", solver.replace(name).map(str::to_owned))
        } else if let Some(name) = source_name(name) {
            ("source", source.replace(name))
        } else {
            let solvers = Builtin::ALL.map(|solver| solver.name()).join(", ");
            let sources: Vec<&str> = sources::all().iter().map(|entry| entry.name).collect();
            return Err(format!(
                "expected a solver ({solvers}) or a source of neighborhoods ({ORACLE}, file, {}), found {name}",
                sources.join(", ")
            ));
        };
        if let Some(earlier) = earlier {
            return Err(format!("expected one {kind}, found {earlier} and {}", name.trim()));
        }
    }
    Ok((solver, source))
}

/// Parses a number that `fits` what is expected.
pub fn number<T: FromStr>(
    text: &str,
    expected: &str,
    fits: impl Fn(&T) -> bool,
) -> Result<T, String> {
    let text = text.trim();
    text.parse().ok().filter(fits).ok_or_else(|| format!("expected {expected}, found {text}"))
}

/// Parses a number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    number(text, "a number above 0", is_positive)
}

fn is_positive(x: &f64) -> bool {
    x.is_finite() && *x > 0.0
}

/// Parses a number from 0 to 1.
pub fn ratio(text: &str) -> Result<f64, String> {
    number(text, "a number from 0 to 1", |x| (0.0..=1.0).contains(x))
}

fn in_words(gate: &Gate, figure: f64, row: &Row, label: &str) -> String {
    // If the row's own figure is smaller, a baseline without neighborhoods decides.
    let is_own = gate.figure == Figure::Gain || row.recovered_percent.get(label) == Some(&figure);
    let alone = row.records_alone_percent.as_ref().and_then(|by| by.get(label));
    let attack = match alone {
        _ if is_own => {
            let noise = row.oracle_noise.as_ref().filter(|noise| *noise != Noise::Uniform.name());
            let noise = noise.map_or_else(String::new, |noise| format!(" ({noise})"));
            format!("{}{noise} at {:.2}, {}", row.neighbors, row.inlier_ratio, row.solver)
        }
        Some(alone) if figure == *alone => {
            let by = row.records_alone_by.as_ref().and_then(|by| by.get(label));
            format!("records alone, {}", by.map_or("", String::as_str))
        }
        _ => "a blind guess".to_owned(),
    };
    let verb = if gate.figure == Figure::Gain { "gained" } else { "recovered" };
    let sign = if row.unit == Unit::KthNeighbor { "x" } else { row.unit.name() };
    format!("{}, {attack}, {verb} within {label} {sign}", row.scheme)
}

/// Reports a gate without rows before the audit runs, or one that no attack on the `points` of a map can break, which means nothing.
pub fn check_gates(
    gates: &[Gate],
    tried: &Tried,
    points: Option<&PointSet<3>>,
) -> Result<(), Error> {
    for gate in gates {
        let typed = &gate.typed;
        if gate.figure == Figure::Localization && !tried.localizes {
            bail!(
                "--gate {typed}: expected a COLMAP model with cameras and tracks, not in tiles, found none"
            );
        }
        let Some(wrong) = gate.not_in(tried) else { continue };
        let error = Error::request(format!("--gate {typed}: {wrong}"));
        let advice = "--thresholds, which changes them (for a map, --scale, too)";
        return Err(if wrong.starts_with(THRESHOLD) { error.advise(advice) } else { error });
    }
    let least = gates.iter().min_by(|a, b| a.threshold.total_cmp(&b.threshold));
    let Some((gate, points)) = least.zip(points) else { return Ok(()) };
    let nearest = nearest(points.positions())?;
    if nearest >= HOPELESS * gate.threshold {
        bail!(
            "--gate {}: expected points less than {HOPELESS} times its threshold from their nearest neighbors, found {} times: \
             no attack could come near",
            gate.typed,
            short(nearest / gate.threshold)
        );
    }
    Ok(())
}

/// Returns an attack that was not tried although the gate covers it.
fn untried(gate: &Gate, tried: &Tried) -> Option<String> {
    let counted = gate.counts_baselines() && gate.figure == Figure::Recovered;
    if counted && tried.lacks_records_alone {
        return Some("records alone were not tried, which this gate counts".to_owned());
    }
    let all = gate.solver.is_none() && gate.source.is_none();
    let joint = Builtin::Joint.name();
    if gate.counts_baselines() && tried.lacks_joint {
        return Some(format!("{joint}, the strongest solver, was not tried, and none is named"));
    }
    let best = sources::BY_DESCRIPTORS.name;
    let doubt =
        format!("neighbors by {best}, the best source, were not tried, and no attack is named");
    (all && gate.inlier_ratio.is_none() && tried.lacks_best_source).then_some(doubt)
}

/// Returns the result of a gate. It fails if something it applies to was not audited, or if a row it applies to has a doubt. A gate
/// that names no attack needs the best one of each kind.
pub fn gate_result(gate: &Gate, attacked: &Attacked) -> Result<GateResult, Error> {
    let Attacked { tried, document, not_audited, doubts, .. } = attacked;
    if gate.figure == Figure::Localization {
        return Ok(of_localization(gate, &document.localization, not_audited));
    }
    let rows = &document.results;
    let label = gate.label_in(tried);
    let worst = label.and_then(|label| gate.worst(rows, label));
    let highest = worst.map(|(worst, _)| worst.interval[1]);
    let is_kept = highest.is_some_and(|highest| gate.passes(highest));
    let missing = not_audited.iter().find(|missing| gate.misses(missing)).map(|missing| {
        let NotAudited { scheme, neighbors, reason, .. } = missing;
        let with = neighbors.as_ref().map(|name| format!(" with neighbors by {name}"));
        format!("{scheme}{} was not audited: {reason}", with.unwrap_or_default())
    });
    let doubt = || {
        let mut covered = rows.iter().enumerate().filter(|(_, row)| gate.covers(row));
        let doubt = covered.clone().find_map(|(at, _)| doubts.get(at)?.clone());
        let noise = || covered.find_map(|(_, row)| noise(row, gate.threshold));
        doubt.or_else(noise).or_else(|| untried(gate, tried))
    };
    let reason = missing.or_else(|| if is_kept { doubt() } else { None });
    // A gate without a row must never count as held.
    if worst.is_none() && reason.is_none() {
        bail!("--gate {}: expected a row, found none", gate.typed);
    }
    Ok(GateResult {
        gate: gate.typed.clone(),
        found_percent: worst.map(|(worst, _)| worst.percent),
        highest_percent: highest,
        of: worst.zip(label).map(|((worst, row), label)| {
            let counts = gate.counts_baselines() || gate.figure == Figure::Gain;
            let only = if counts { "" } else { " (baselines not counted)" };
            in_words(gate, worst.percent, row, label) + only
        }),
        bound_percent: gate.bound_percent,
        passed: reason.is_none() && is_kept,
        reason,
    })
}

/// Returns the localization error that a gate compares, as a multiple. Few held-out images may fail a gate that the bound passes,
/// because the bound assumes that all matches are found.
fn cost_of_gate(of: &Localization) -> Option<f64> {
    match (&of.held_out, of.measured()) {
        (Some(few), None) => Some(of.cost()?.max(few.multiple?)),
        _ => of.cost(),
    }
}

/// Returns the result of a gate on localization. A scheme without a finite error fails it.
fn of_localization(
    gate: &Gate,
    localization: &[Localization],
    not_audited: &[NotAudited],
) -> GateResult {
    let cost = |of: &Localization| cost_of_gate(of).unwrap_or(f64::INFINITY);
    let of_map = localization.iter().filter(|of| !of.of_queries && of.scheme != UNPROTECTED);
    let worst = of_map
        .filter(|of| gate.covers_scheme(&of.scheme))
        .max_by(|a, b| cost(a).total_cmp(&cost(b)));
    let missing =
        not_audited.iter().find(|of| of.neighbors.is_none() && gate.covers_scheme(&of.scheme));
    // Within the widest limits.
    let recall = |held: &HeldOut| held.recall_percent.values().copied().fold(0.0, f64::max);
    let is_lost = |of: &Localization| {
        of.scheme == UNPROTECTED && of.held_out.as_ref().is_some_and(|held| recall(held) < 50.0)
    };
    let reason = match (worst, missing) {
        (_, Some(NotAudited { scheme, reason, .. })) => {
            Some(format!("{scheme} was not audited: {reason}"))
        }
        (None, None) => Some("localization was not measured".to_owned()),
        (Some(worst), None) if worst.is_unknown() => Some(format!(
            "{} changes descriptors, so its cost is not known without {FEWEST_HELD_OUT} or more held-out images",
            worst.scheme
        )),
        (Some(_), None) if localization.iter().any(is_lost) => {
            Some("most held-out images do not localize even without protection".to_owned())
        }
        (Some(worst), None) if cost_of_gate(worst).is_none() => {
            Some(format!("{}: most images do not localize", worst.scheme))
        }
        (Some(_), None) => None,
    };
    let found_percent = worst.and_then(cost_of_gate);
    let by = |of: &Localization| match (&of.held_out, of.measured()) {
        (_, Some(_)) => "held-out images",
        (Some(_), None) => "the larger of the bound and few held-out images",
        (None, None) => "bound",
    };
    GateResult {
        gate: gate.typed.clone(),
        found_percent,
        highest_percent: None,
        of: worst.map(|worst| format!("{}, {}", worst.scheme, by(worst))),
        bound_percent: gate.bound_percent,
        passed: reason.is_none() && found_percent.is_some_and(|found| gate.passes(found)),
        reason,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::audit::{Intervals, Plan};

    fn row(scheme: &str, inlier_ratio: f64, recovered_percent: f64) -> Row {
        with_baseline(scheme, inlier_ratio, recovered_percent, 6.0)
    }

    fn with_baseline(scheme: &str, inlier_ratio: f64, recovered: f64, blind: f64) -> Row {
        let percents = |percent| [("0.1".to_owned(), percent)].into_iter().collect();
        let ends = |percent| [("0.1".to_owned(), [percent; 2])].into_iter().collect();
        let (recovered_percent, blind_percent) = (percents(recovered), percents(blind));
        let interval = Intervals {
            recovered_percent: ends(recovered),
            blind_percent: ends(blind),
            ..Intervals::default()
        };
        Row {
            scheme: scheme.into(),
            solver: "joint".into(),
            neighbors: "oracle".into(),
            oracle_noise: Some("uniform".into()),
            inlier_ratio,
            recovered_percent,
            blind_percent,
            interval: Some(interval),
            ..Row::default()
        }
    }

    #[test]
    #[rustfmt::skip] // One row per line.
    fn each_part_of_a_gate_is_read_in_any_order() {
        use Figure::{Gain, Recovered};
        for (text, names, figures) in [
            (" ppl+@0.5:0.10:gain<=15 ", [Some("ppl+"), None, None], (Some(0.5), 0.1, Gain, 15.0)),
            ("ppl:joint:oracle@0.5:0.10<=20", [Some("ppl"), Some("joint"), Some("oracle")], (Some(0.5), 0.1, Recovered, 20.0)),
            ("ppl:oracle:joint@0.5:0.10<=20", [Some("ppl"), Some("joint"), Some("oracle")], (Some(0.5), 0.1, Recovered, 20.0)),
            ("all:overlap:0.10:gain<=20%", [None, None, Some("overlap")], (None, 0.1, Gain, 20.0)),
            // A sequence is named with its number of queries.
            ("dcl2d:sequence+lists@5:10<=20", [Some("dcl2d"), None, Some("sequence+lists@5")], (None, 10.0, Recovered, 20.0)),
            ("all:tracks@20:5:gain<=1", [None, None, Some("tracks@20")], (None, 5.0, Gain, 1.0)),
        ] {
            let gate = Gate::parse(text).unwrap();
            assert_eq!(gate.typed, text.trim());
            assert_eq!([gate.scheme.as_deref(), gate.solver, gate.source.as_deref()], names, "{text}");
            assert_eq!((gate.inlier_ratio, gate.threshold, gate.figure, gate.bound_percent), figures, "{text}");
        }
    }

    #[test]
    #[rustfmt::skip] // One row per line.
    fn the_largest_figure_of_the_rows_of_a_gate_counts() {
        let weak = Row { solver: "ransac".into(), ..row("ppl", 0.5, 12.0) };
        let own = Row { neighbors: "overlap".into(), oracle_noise: None, ..row("ppl", 0.1, 15.0) };
        let sources = &[row("ppl", 0.5, 30.0), weak, own][..];
        // `olc` with `similarity` recovered 58.6 % but records alone 66.6 %, and a gate of 60 held.
        let alone = &[with_baseline("olc", 0.5, 58.6, 66.6)][..];
        let by_overlap = Row { neighbors: "overlap".into(), oracle_noise: None, ..alone[0].clone() };
        let by_overlap = &[by_overlap][..];
        let measured = &[Row { oracle_noise: None, ..row("ppl", 0.5, 18.0) }][..];
        let queries = ["sequence@5", "sequence+lists@5"].map(str::to_owned);
        let queries = queries.map(|neighbors| Row { neighbors, ..row("cp2d", 0.5, 30.0) });
        let others = &[row("ppl", 1.0, 99.0), row("olc", 0.5, 98.0), row("ppl", 0.5, 18.0)][..];
        for (text, rows, expected) in [
            ("all:0.1<=20", &[row("olc", 1.0, 19.0), row("ppl", 0.5, 21.0), row("cp", 0.1, 3.0)][..], Some(21.0)),
            ("ppl@0.5:0.10<=20", others, Some(18.0)),
            ("ppl:0.10:gain<=15", &others[2..], Some(12.0)),
            // A measured ratio is not a requested one.
            ("ppl@0.5:0.10<=20", measured, None),
            // The strongest attack decides unless one is named.
            ("ppl:0.10<=20", sources, Some(30.0)),
            ("ppl:ransac:0.10<=20", sources, Some(12.0)),
            ("ppl:overlap:0.10<=20", sources, Some(15.0)),
            ("ppl:ransac:overlap:0.10<=20", sources, None),
            ("cp2d:sequence@5:0.10<=20", &queries[1..], Some(30.0)),
            ("cp2d:sequence+lists@5:0.10<=20", &queries[..1], None),
            // What needs no neighborhoods counts unless a solver or the oracle is named.
            ("olc:0.10<=60", alone, Some(66.6)),
            ("olc:overlap:0.10<=60", by_overlap, Some(66.6)),
            ("olc:joint:0.10<=60", alone, Some(58.6)),
            ("olc:oracle:0.10<=60", alone, Some(58.6)),
        ] {
            let worst = Gate::parse(text).unwrap().worst(rows, "0.1");
            assert_eq!(worst.map(|(worst, _)| worst.percent), expected, "{text}");
        }
        // The upper end of an interval counts, and decides which row is the worst.
        let mut few = row("ppl", 0.5, 18.0);
        few.interval.as_mut().unwrap().recovered_percent[0] = [0.0, 22.0];
        let gate = Gate::parse("all:0.1<=20").unwrap();
        let rows = [few, row("olc", 0.5, 19.0)];
        let (worst, _) = gate.worst(&rows, "0.1").unwrap();
        assert_eq!((worst.percent, worst.interval), (18.0, [0.0, 22.0]));
        assert!(!gate.passes(21.0) && gate.passes(20.0));
        // A figure that is no number fails, whatever the other figures.
        let rows = [row("ppl", 1.0, 3.0), row("ppl", 0.5, f64::NAN), row("ppl", 0.3, 2.0)];
        let (worst, _) = gate.worst(&rows, "0.1").unwrap();
        assert!(!gate.passes(f64::NAN) && !gate.passes(worst.interval[1]));
    }

    #[test]
    fn what_the_plan_lacks_is_named() {
        let mut plan = Plan::<3>::new(unlift::Unit::Meter);
        plan.schemes.retain(|scheme| scheme.name() == "ppl");
        plan.inlier_ratios = vec![1.0, 0.5];
        let solvers: Vec<&str> = plan.solvers.iter().map(|solver| solver.name()).collect();
        let solvers = format!("solver: expected one of {}, found ransac", solvers.join(", "));
        for (text, expected) in [
            ("ppl@0.5:0.10<=20", ""),
            ("all:joint:oracle:0.25<=20", ""),
            // Schemes may come from other crates, so only the plan can check the name.
            ("olc:0.10<=20", "scheme: expected one of ppl, found olc"),
            ("ppl:ransac:0.10<=20", &solvers),
            ("ppl:overlap:0.10<=20", "neighbors: expected one of oracle, found overlap"),
            ("ppl@0.4:0.10<=20", "inlier ratio: expected one of 1, 0.5, found 0.4"),
            ("ppl:0.2<=20", "threshold: expected one of 0.10, 0.25, found 0.2"),
        ] {
            let lacks = Gate::parse(text).unwrap().not_in(&Tried::by(&plan, false));
            assert_eq!(lacks.unwrap_or_default(), expected, "{text}");
        }
    }

    #[test]
    fn what_was_not_audited_is_missed() {
        let scheme = NotAudited::new("ppl", None, "");
        let neighbors = Some("oracle".into());
        let lists = NotAudited { neighbors, inlier_ratio: Some(0.5), ..scheme.clone() };
        for (text, missing, is_missed) in [
            ("ppl:0.1<=20", &scheme, true),
            ("all@0.3:0.1<=20", &scheme, true),
            ("olc:0.1<=20", &scheme, false),
            ("all:0.1<=20", &lists, true),
            ("ppl:oracle@0.5:0.1<=20", &lists, true),
            ("ppl:overlap:0.1<=20", &lists, false),
            ("ppl@0.3:0.1<=20", &lists, false),
        ] {
            assert_eq!(Gate::parse(text).unwrap().misses(missing), is_missed, "{text}");
        }
    }

    #[test]
    #[rustfmt::skip] // One row per line.
    fn each_wrong_part_is_named() {
        let solvers = Builtin::ALL.map(|solver| solver.name()).join(", ");
        let form = "expected SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT (for example ppl@0.5:0.10<=20)";
        let names = format!("expected a solver ({solvers}) or a source of neighborhoods (oracle, file, similarity, \
                             overlap, geometric, learned, descriptors)");
        for (text, begin, found) in [
            ("ppl@0.5:0.10<20", form, "no <="),
            ("ppl<=20", form, "no threshold"),
            ("ppl:joint<=20", form, "no threshold"),
            ("ppl:0.1:loss<=20", form, ":loss (only :gain is known)"),
            (":0.1<=20", form, "no scheme"),
            ("ppl@2:0.1<=20", "inlier ratio: expected a number from 0 to 1", "2"),
            ("ppl:x<=20", "threshold: expected a number above 0", "x"),
            ("ppl:0.1<=120", "bound: expected 0 to 100 percent", "120"),
            ("ppl:jiont:0.1<=20", &names, "jiont"),
            ("ppl:joint:ransac:0.1<=20", "expected one solver", "joint and ransac"),
            ("ppl:oracle:file:0.1<=20", "expected one source", "oracle and file"),
            ("ppl:joint:overlap@0.5:0.1<=20", "inlier ratio: expected none with neighbors by overlap, whose ratio is measured", "@0.5"),
        ] {
            assert_eq!(Gate::parse(text).unwrap_err(), format!("{begin}, found {found}"), "{text}");
        }
    }

    #[test]
    fn few_held_out_images_fail_a_gate_but_never_pass_one() {
        let gate = Gate::parse("olc:localization<=2").unwrap();
        let of = |multiple: Option<f64>, n_images: u64, bound: f64, recall: f64| {
            let recall_percent = [("50 cm, 5 deg".to_owned(), recall)].into_iter().collect();
            let held_out = HeldOut { n_images, multiple, recall_percent, ..HeldOut::default() };
            Localization {
                scheme: "olc".to_owned(),
                multiple: Some(bound),
                held_out: Some(held_out),
                ..Localization::default()
            }
        };
        let passes = |multiple: Option<f64>, n_images: u64, bound: f64| {
            of_localization(&gate, &[of(multiple, n_images, bound, 100.0)], &[]).passed
        };
        for (recall, expected) in [(49.0, false), (51.0, true)] {
            let scheme = UNPROTECTED.to_owned();
            let base = Localization { scheme, ..of(Some(1.0), 10, 1.0, recall) };
            let both = [base, of(Some(1.0), 10, 1.5, 10.0)];
            assert_eq!(of_localization(&gate, &both, &[]).passed, expected, "{recall} %");
        }
        assert!(passes(Some(1.0), 3, 1.5));
        assert!(!passes(Some(3.0), 3, 1.5) && !passes(None, 3, 1.5));
        assert!(!passes(Some(1.0), 3, 2.5), "the bound holds, whatever few images say");
        assert!(passes(Some(1.0), 10, 2.5), "ten images count alone");
    }
}
