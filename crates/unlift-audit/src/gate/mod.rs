//! Gates: bounds on how much of a map may come back.
//!
//! ```text
//! SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT
//! ```
//!
//! `ppl@0.5:0.10<=20` fails when more than 20 % of the points come back within 0.10 under `ppl` at
//! inlier ratio 0.5. `SCHEME` may be `all`; without `@RATIO` every ratio counts, without a solver or a source
//! of neighborhoods every one; every noise model and K always counts: the largest figure decides, which is
//! that of the strongest attack. Without a solver and a source, attacks that need no neighborhoods count as well (a blind
//! guess, the records alone): they are in anybody's hands. `:gain` bounds what neighborhoods add to an attacker without them (the larger of
//! a blind guess and what the records alone give), in percentage points. Numbers are compared as
//! numbers, so `0.1` finds the threshold `0.10`. No name of a solver or a source is a number, so the first
//! number after the scheme is the threshold.

mod parse;
mod results;
#[cfg(test)]
mod tests;

use unlift::audit::{NotAudited, Plan};

pub(crate) use results::{check_gates, gate_results};

/// A bound on a figure of an audit.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    /// As typed.
    pub typed: String,
    /// The scheme's name; `None` for all.
    pub scheme: Option<String>,
    /// The solver's name; `None` for all.
    pub solver: Option<&'static str>,
    /// Where neighborhoods come from, as in the rows of an audit; `None` for all.
    pub source: Option<String>,
    /// The inlier ratio; `None` for all.
    pub inlier_ratio: Option<f64>,
    /// The threshold, in the unit of the audit.
    pub threshold: f64,
    /// Which figure is bounded.
    pub figure: Figure,
    /// The bound in percent or percentage points, itself allowed.
    pub bound_percent: f64,
}

/// A figure that a gate can bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// The percentage recovered.
    Recovered,
    /// The percentage recovered, less that of an attacker without neighborhoods.
    Gain,
}

/// What a gate compares, from one row and one threshold of an audit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate<'a> {
    /// The row's scheme.
    pub scheme: &'a str,
    /// The row's solver.
    pub solver: &'a str,
    /// Where its neighborhoods come from.
    pub source: &'a str,
    /// The row's inlier ratio, as requested; `None` when it was measured.
    pub inlier_ratio: Option<f64>,
    /// The threshold's value.
    pub threshold: f64,
    /// Percent recovered within the threshold.
    pub recovered_percent: f64,
    /// Percentage recovered by an attacker without neighborhoods.
    pub baseline_percent: f64,
}

/// The larger figure; what is not a number is worse than any.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

impl Gate {
    /// Whether the gate is about this row and threshold.
    pub fn covers(&self, row: &Candidate<'_>) -> bool {
        self.scheme.as_deref().is_none_or(|name| name == row.scheme)
            && self.solver.is_none_or(|name| name == row.solver)
            && self.source.as_deref().is_none_or(|name| name == row.source)
            && self.inlier_ratio.is_none_or(|wanted| row.inlier_ratio == Some(wanted))
            && self.threshold == row.threshold
    }

    /// Whether the gate is about something that has no row. Where the scheme itself could not be applied,
    /// every gate on it is.
    pub fn misses(&self, missing: &NotAudited) -> bool {
        let of_source = |name: &String| self.source.as_ref().is_none_or(|wanted| wanted == name);
        let of_ratio = self.inlier_ratio.is_none_or(|wanted| missing.inlier_ratio == Some(wanted));
        self.scheme.as_deref().is_none_or(|name| name == missing.scheme)
            && missing.neighbors.as_ref().is_none_or(|name| of_source(name) && of_ratio)
    }

    /// The part of the gate that `plan` has no row for, as expected and found.
    pub fn not_in<const D: usize>(&self, plan: &Plan<D>) -> Option<(String, String)> {
        let listed = |names: Vec<String>| format!("one of {}", names.join(", "));
        let lacks = |what: &str, wanted: &str, names: Vec<String>| {
            let found = (wanted.to_owned(), !names.iter().any(|name| name == wanted));
            found.1.then(|| (format!("{what}: {}", listed(names)), found.0))
        };
        let schemes = || plan.schemes.iter().map(|s| s.name().to_owned()).collect();
        let solvers = || plan.solvers.iter().map(|s| s.name().to_owned()).collect();
        let sources = || plan.neighbors.iter().map(|by| by.name().to_owned()).collect();
        let scheme = self.scheme.as_ref().and_then(|name| lacks("scheme", name, schemes()));
        let solver = || self.solver.and_then(|name| lacks("solver", name, solvers()));
        let source = || self.source.as_ref().and_then(|name| lacks("neighbors", name, sources()));
        let oracle = plan.asks_oracle();
        let ratios = if oracle { plan.inlier_ratios.as_slice() } else { &[] };
        let ratio = || {
            let wanted = self.inlier_ratio.filter(|wanted| !ratios.contains(wanted))?;
            let expected = match oracle {
                true => listed(ratios.iter().map(f64::to_string).collect()),
                false => "none, as measured ratios have no gates of their own".to_owned(),
            };
            Some((format!("inlier ratio: {expected}"), wanted.to_string()))
        };
        let threshold = || {
            let labels = plan.thresholds.iter().map(|t| t.label.clone()).collect();
            let known = plan.thresholds.iter().any(|t| t.value == self.threshold);
            (!known).then(|| (format!("threshold: {}", listed(labels)), self.threshold.to_string()))
        };
        scheme.or_else(solver).or_else(source).or_else(ratio).or_else(threshold)
    }

    /// The largest bounded figure among `candidates`; `None` when the gate covers none of them,
    /// which must never count as passing.
    pub fn worst<'a>(&self, candidates: impl IntoIterator<Item = Candidate<'a>>) -> Option<f64> {
        candidates
            .into_iter()
            .filter(|c| self.covers(c))
            .map(|c| match self.figure {
                Figure::Recovered if self.solver.is_none() && self.source.is_none() => {
                    worse(c.recovered_percent, c.baseline_percent)
                }
                Figure::Recovered => c.recovered_percent,
                Figure::Gain => c.recovered_percent - c.baseline_percent,
            })
            .reduce(worse)
    }

    /// Whether a figure keeps the bound. What is not a number does not.
    pub fn passes(&self, found_percent: f64) -> bool {
        found_percent <= self.bound_percent
    }
}
