//! Gates: bounds on how much of a map may be recovered.
//!
//! ```text
//! SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT
//! ```
//!
//! `ppl@0.5:0.10<=20` fails if more than 20 % of the points are recovered within 0.10 under `ppl`
//! at inlier ratio 0.5. `SCHEME` may be `all`. Without `@RATIO`, a solver or a source, all of them
//! count. Every noise model and K counts. The strongest attack decides. Without a solver and a
//! source, attacks that need no neighborhoods count as well (the blind guess and records alone).
//! `:gain` bounds what neighborhoods add to the larger of these two baselines, in percentage
//! points. `SCHEME:localization<=MULTIPLE` fails if the error of localization exceeds the
//! unprotected one by more than this factor. Numbers are compared by value, so `0.1` matches the threshold `0.10`. No name of a
//! solver or a source is a number, so the first number after the scheme is the threshold.
//! `sequence@5`, `sequence+lists@5` and `tracks@5` are sources: `dcl2d:sequence@5:10<=20` bounds what comes back from
//! five queries, `olc:again:0.10<=20` what comes back from two releases of a map.

mod parse;
mod results;
#[cfg(test)]
mod tests;

use unlift::audit::{NotAudited, Plan};

pub(crate) use results::{check_gates, gate_results};

/// A bound on a figure of an audit.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    /// The gate as typed.
    pub typed: String,
    /// The scheme's name; `None` for all.
    pub scheme: Option<String>,
    /// The solver's name; `None` for all.
    pub solver: Option<&'static str>,
    /// The source of neighborhoods, as in the rows of an audit; `None` for all.
    pub source: Option<String>,
    /// The inlier ratio; `None` for all.
    pub inlier_ratio: Option<f64>,
    /// The threshold, in the unit of the audit; infinite for localization, which has none.
    pub threshold: f64,
    /// The bounded figure.
    pub figure: Figure,
    /// The largest allowed value, in percent, percentage points or multiples.
    pub bound_percent: f64,
}

/// A figure that a gate can bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// The percentage recovered.
    Recovered,
    /// The percentage recovered, minus that of an attacker without neighborhoods.
    Gain,
    /// The error of localization, as a multiple of the unprotected one.
    Localization,
}

/// The figures that a gate compares, of one row and one threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate<'a> {
    /// The row's scheme.
    pub scheme: &'a str,
    /// The row's solver.
    pub solver: &'a str,
    /// The row's source of neighborhoods.
    pub source: &'a str,
    /// The row's inlier ratio, as requested; `None` if it was measured.
    pub inlier_ratio: Option<f64>,
    /// The threshold's value.
    pub threshold: f64,
    /// Percentage recovered within the threshold.
    pub recovered_percent: f64,
    /// Percentage recovered by an attacker without neighborhoods.
    pub baseline_percent: f64,
}

fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

impl Gate {
    /// Returns true if the gate applies to this row and threshold.
    pub fn covers(&self, row: &Candidate<'_>) -> bool {
        self.scheme.as_deref().is_none_or(|name| name == row.scheme)
            && self.solver.is_none_or(|name| name == row.solver)
            && self.source.as_deref().is_none_or(|name| name == row.source)
            && self.inlier_ratio.is_none_or(|wanted| row.inlier_ratio == Some(wanted))
            && self.threshold == row.threshold
    }

    /// Returns true if the gate applies to something without a row. If a scheme could not be
    /// applied, every gate on it does.
    pub fn misses(&self, missing: &NotAudited) -> bool {
        let of_source = |name: &String| self.source.as_ref().is_none_or(|wanted| wanted == name);
        let of_ratio = self.inlier_ratio.is_none_or(|wanted| missing.inlier_ratio == Some(wanted));
        self.scheme.as_deref().is_none_or(|name| name == missing.scheme)
            && missing.neighbors.as_ref().is_none_or(|name| of_source(name) && of_ratio)
    }

    /// Returns a part of the gate for which `plan` has no row, as expected and found.
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
                false => "none, because measured ratios have no gates".to_owned(),
            };
            Some((format!("inlier ratio: {expected}"), wanted.to_string()))
        };
        let threshold = || {
            let labels = plan.thresholds.iter().map(|t| t.label.clone()).collect();
            let known = plan.thresholds.iter().any(|t| t.value == self.threshold);
            (!known).then(|| (format!("threshold: {}", listed(labels)), self.threshold.to_string()))
        };
        if self.figure == Figure::Localization {
            return scheme;
        }
        scheme.or_else(solver).or_else(source).or_else(ratio).or_else(threshold)
    }

    /// Returns the largest bounded figure among `candidates`. `None` if the gate covers none of
    /// them, which must never count as passing.
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
                // Not a figure of a row.
                Figure::Localization => f64::NAN,
            })
            .reduce(worse)
    }

    /// Returns true if a figure is within the bound. NaN is not.
    pub fn passes(&self, found_percent: f64) -> bool {
        found_percent <= self.bound_percent
    }
}
