//! Gates: bounds on how much of a map may come back.
//!
//! ```text
//! SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT
//! ```
//!
//! `ppl@0.5:0.10<=20` fails when more than 20 % of the points come back within 0.10 under `ppl` at
//! inlier ratio 0.5. `SCHEME` may be `all`; without `@RATIO` every ratio counts, without a solver or a source
//! of neighborhoods every one; every noise model and K always counts: the largest figure decides, which is
//! that of the strongest attack. `:gain` bounds what neighborhoods add to an attacker without them (the larger of
//! a blind guess and what the records alone give), in percentage points. Numbers are compared as
//! numbers, so `0.1` finds the threshold `0.10`. No name of a solver or a source is a number, so the first
//! number after the scheme is the threshold.

use unlift::audit::{NotAudited, Plan, Source};
use unlift::neighbors::sources::{Joined, SOURCES};
use unlift::recover::Solver;

use crate::values::{positive, ratio};

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
    /// The same for an attacker without neighborhoods.
    pub baseline_percent: f64,
}

/// The larger figure; what is not a number is worse than any.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

impl Gate {
    /// Reads the form that the module describes.
    ///
    /// # Errors
    /// Says which part is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        const FORM: &str = "SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT";
        let form =
            |what: &str| format!("expected {FORM} (for example ppl@0.5:0.10<=20), found {what}");
        let typed = text.trim();
        let (left, bound) = typed.split_once("<=").ok_or_else(|| form("no <="))?;
        let (names, inlier_ratio, rest) = match left.split_once('@') {
            Some((names, rest)) => {
                let (text, rest) = rest.split_once(':').ok_or_else(|| form("no threshold"))?;
                let value = ratio(text).map_err(|error| format!("inlier ratio: {error}"))?;
                (names.split(':').collect::<Vec<_>>(), Some(value), rest.split(':').collect())
            }
            None => {
                let mut names: Vec<&str> = left.split(':').collect();
                let rest = names.split_off(n_names(&names));
                (names, None, rest)
            }
        };
        let (threshold, figure) = match rest.as_slice() {
            [] => return Err(form("no threshold")),
            [threshold] => (threshold, Figure::Recovered),
            [threshold, "gain"] => (threshold, Figure::Gain),
            [_, other, ..] => return Err(form(&format!(":{other} (only :gain is known)"))),
        };
        let (scheme, named) = names.split_first().ok_or_else(|| form("no scheme"))?;
        let (solver, source) = qualifiers(named)?;
        if let (Some(source), Some(ratio)) = (&source, inlier_ratio)
            && source != ORACLE
        {
            return Err(format!(
                "inlier ratio: expected none with neighbors by {source}, whose ratio is measured, \
                 found @{ratio}"
            ));
        }
        let scheme = match scheme.trim() {
            "all" => None,
            "" => return Err(form("no scheme")),
            // Somebody's own scheme may be audited: the plan knows which names there are.
            name => Some(name.to_owned()),
        };
        let threshold = positive(threshold).map_err(|error| format!("threshold: {error}"))?;
        let bound_percent = match bound.trim().trim_end_matches('%').trim_end().parse::<f64>() {
            Ok(value) if (0.0..=100.0).contains(&value) => value,
            _ => return Err(format!("bound: expected 0 to 100 percent, found {bound}")),
        };
        let typed = typed.to_owned();
        Ok(Self { typed, scheme, solver, source, inlier_ratio, threshold, figure, bound_percent })
    }

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
    pub fn not_in(&self, plan: &Plan) -> Option<(String, String)> {
        let listed = |names: Vec<String>| format!("one of {}", names.join(", "));
        let lacks = |what: &str, wanted: &str, names: Vec<String>| {
            let found = (wanted.to_owned(), !names.iter().any(|name| name == wanted));
            found.1.then(|| (format!("{what}: {}", listed(names)), found.0))
        };
        let schemes = || plan.schemes.iter().map(|s| s.name.to_owned()).collect();
        let solvers = || plan.solvers.iter().map(|s| s.name().to_owned()).collect();
        let sources = || plan.sources.iter().map(Source::name).collect();
        let scheme = self.scheme.as_ref().and_then(|name| lacks("scheme", name, schemes()));
        let solver = || self.solver.and_then(|name| lacks("solver", name, solvers()));
        let source = || self.source.as_ref().and_then(|name| lacks("neighbors", name, sources()));
        let oracle = plan.sources.contains(&Source::Oracle);
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

/// The source that is asked for a ratio.
const ORACLE: &str = "oracle";

/// How many of the parts left of `<=` are names: all before the first number; without one, all that are
/// known, so that what stands where the threshold belongs is told as such.
fn n_names(parts: &[&str]) -> usize {
    let is_number = |part: &&str| part.trim().parse::<f64>().is_ok();
    let known = |part: &&str| solver_name(part).is_some() || source_name(part).is_some();
    let of = |at: Option<usize>| at.map_or(parts.len(), |at| at + 1);
    match parts.iter().skip(1).position(is_number) {
        Some(at) => at + 1,
        None => of(parts.iter().skip(1).position(|part| !known(part))),
    }
}

fn solver_name(text: &str) -> Option<&'static str> {
    Solver::from_name(text.trim()).ok().map(Solver::name)
}

/// A source as rows name it.
fn source_name(text: &str) -> Option<String> {
    match text.trim() {
        name @ (ORACLE | "file") => Some(name.to_owned()),
        name => Joined::parse(name).ok().map(|joined| joined.name()),
    }
}

/// A solver and a source among the names after a scheme, each at most once, in any order.
fn qualifiers(names: &[&str]) -> Result<(Option<&'static str>, Option<String>), String> {
    let (mut solver, mut source) = (None, None);
    for name in names {
        match (solver_name(name), source_name(name)) {
            (Some(found), _) => {
                if let Some(earlier) = solver {
                    return Err(format!("expected one solver, found {earlier} and {found}"));
                }
                solver = Some(found);
            }
            (None, Some(found)) => {
                if let Some(earlier) = &source {
                    return Err(format!("expected one source, found {earlier} and {found}"));
                }
                source = Some(found);
            }
            (None, None) => {
                let solvers = Solver::ALL.map(Solver::name).join(", ");
                let sources: Vec<&str> = SOURCES.iter().map(|entry| entry.name).collect();
                return Err(format!(
                    "expected a solver ({solvers}) or a source of neighborhoods ({ORACLE}, file, {}, or \
                     several joined by +), found {name}",
                    sources.join(", ")
                ));
            }
        }
    }
    Ok((solver, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scheme: &str, inlier_ratio: f64, recovered_percent: f64) -> Candidate<'_> {
        let inlier_ratio = Some(inlier_ratio);
        let (solver, source) = ("joint", "oracle");
        let (threshold, baseline_percent) = (0.1, 6.0);
        Candidate {
            scheme,
            solver,
            source,
            inlier_ratio,
            threshold,
            recovered_percent,
            baseline_percent,
        }
    }

    #[test]
    fn the_full_form_is_read() {
        let gate = Gate::parse(" ppl+@0.5:0.10:gain<=15 ").unwrap();
        assert_eq!(gate.typed, "ppl+@0.5:0.10:gain<=15");
        assert_eq!(gate.scheme.as_deref(), Some("ppl+"));
        assert_eq!((gate.inlier_ratio, gate.threshold), (Some(0.5), 0.1));
        assert_eq!((gate.figure, gate.bound_percent), (Figure::Gain, 15.0));
    }

    #[test]
    fn the_short_form_covers_every_row() {
        let gate = Gate::parse("all:0.1<=20%").unwrap();
        let rows = [row("olc", 1.0, 19.0), row("ppl", 0.5, 21.0), row("cp", 0.1, 3.0)];
        assert_eq!(gate.worst(rows), Some(21.0));
        assert!(!gate.passes(21.0) && gate.passes(20.0));
    }

    #[test]
    fn other_rows_do_not_count_and_no_row_is_told() {
        let gate = Gate::parse("ppl@0.5:0.10<=20").unwrap();
        let rows = [row("ppl", 1.0, 99.0), row("olc", 0.5, 98.0), row("ppl", 0.5, 18.0)];
        assert_eq!(gate.worst(rows), Some(18.0));
        assert_eq!(gate.worst(rows[..2].iter().copied()), None);
    }

    #[test]
    fn gain_is_what_recovery_adds() {
        let gate = Gate::parse("ppl:0.10:gain<=15").unwrap();
        assert_eq!(gate.worst([row("ppl", 0.5, 18.0)]), Some(12.0));
    }

    #[test]
    fn a_measured_ratio_is_not_a_requested_one() {
        let candidate = Candidate { inlier_ratio: None, ..row("ppl", 0.5, 18.0) };
        assert_eq!(Gate::parse("ppl@0.5:0.10<=20").unwrap().worst([candidate]), None);
        assert_eq!(Gate::parse("ppl:0.10<=20").unwrap().worst([candidate]), Some(18.0));
    }

    #[test]
    fn a_solver_and_a_source_may_be_named_in_any_order() {
        for text in ["ppl:joint:oracle@0.5:0.10<=20", "ppl:oracle:joint@0.5:0.10<=20"] {
            let gate = Gate::parse(text).unwrap();
            assert_eq!((gate.solver, gate.source.as_deref()), (Some("joint"), Some("oracle")));
            assert_eq!((gate.inlier_ratio, gate.threshold), (Some(0.5), 0.1));
        }
        let gate = Gate::parse("all:overlap+geometric:0.10:gain<=20").unwrap();
        assert_eq!((gate.solver, gate.source.as_deref()), (None, Some("overlap+geometric")));
        assert_eq!((gate.threshold, gate.figure), (0.1, Figure::Gain));
        let gate = Gate::parse("ppl+:joint-start:0.10<=20").unwrap();
        assert_eq!((gate.solver, gate.source), (Some("joint-start"), None));
    }

    #[test]
    fn only_rows_of_the_named_solver_and_source_count() {
        let weak = Candidate { solver: "ransac", ..row("ppl", 0.5, 12.0) };
        let own = Candidate { source: "overlap", inlier_ratio: None, ..row("ppl", 0.1, 15.0) };
        let rows = [row("ppl", 0.5, 30.0), weak, own];
        let worst = |text: &str| Gate::parse(text).unwrap().worst(rows);
        assert_eq!(worst("ppl:0.10<=20"), Some(30.0), "the strongest attack decides");
        assert_eq!(worst("ppl:ransac:0.10<=20"), Some(12.0));
        assert_eq!(worst("ppl:overlap:0.10<=20"), Some(15.0));
        assert_eq!(worst("ppl:ransac:overlap:0.10<=20"), None);
    }

    #[test]
    fn what_the_plan_lacks_is_named() {
        let mut plan = Plan::new(unlift::Unit::Meter);
        plan.schemes.retain(|entry| entry.name == "ppl");
        plan.inlier_ratios = vec![1.0, 0.5];
        let lacking = |text: &str| {
            let part = Gate::parse(text).unwrap().not_in(&plan);
            part.map(|(expected, found)| format!("{expected}, found {found}"))
        };
        assert_eq!(lacking("ppl@0.5:0.10<=20"), None);
        assert_eq!(lacking("all:joint-start:oracle:0.25<=20"), None);
        let told = |text: &str| lacking(text).unwrap_or_default();
        assert_eq!(told("olc:0.10<=20"), "scheme: one of ppl, found olc");
        assert_eq!(told("ppl:ransac:0.10<=20"), "solver: one of joint, joint-start, found ransac");
        assert_eq!(told("ppl:overlap:0.10<=20"), "neighbors: one of oracle, found overlap");
        assert_eq!(told("ppl@0.4:0.10<=20"), "inlier ratio: one of 1, 0.5, found 0.4");
        assert_eq!(told("ppl:0.2<=20"), "threshold: one of 0.10, 0.25, found 0.2");
    }

    #[test]
    fn what_was_not_audited_is_missed() {
        let scheme = NotAudited {
            scheme: "ppl",
            neighbors: None,
            oracle_noise: None,
            inlier_ratio: None,
            reason: String::new(),
        };
        let lists = NotAudited {
            neighbors: Some("oracle".into()),
            inlier_ratio: Some(0.5),
            ..scheme.clone()
        };
        let misses = |text: &str, missing| Gate::parse(text).unwrap().misses(missing);
        assert!(misses("ppl:0.1<=20", &scheme) && misses("all@0.3:0.1<=20", &scheme));
        assert!(misses("ppl:overlap:0.1<=20", &scheme), "whatever the source");
        assert!(!misses("olc:0.1<=20", &scheme));
        assert!(misses("all:0.1<=20", &lists) && misses("ppl:oracle@0.5:0.1<=20", &lists));
        assert!(!misses("ppl:overlap:0.1<=20", &lists) && !misses("ppl@0.3:0.1<=20", &lists));
    }

    #[test]
    fn a_figure_that_is_no_number_fails() {
        let gate = Gate::parse("ppl:0.10<=100").unwrap();
        assert!(!gate.passes(f64::NAN));
        // Nor does it hide behind a figure that is one.
        let rows = [row("ppl", 1.0, 3.0), row("ppl", 0.5, f64::NAN), row("ppl", 0.3, 2.0)];
        assert!(!gate.passes(gate.worst(rows).unwrap()));
    }

    #[test]
    fn each_wrong_part_is_named() {
        let message = |text: &str| Gate::parse(text).unwrap_err();
        let form = "expected SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT (for example ppl@0.5:0.10<=20)";
        assert_eq!(message("ppl@0.5:0.10<20"), format!("{form}, found no <="));
        assert_eq!(message("ppl<=20"), format!("{form}, found no threshold"));
        assert_eq!(
            message("ppl:0.1:loss<=20"),
            format!("{form}, found :loss (only :gain is known)")
        );
        assert_eq!(
            message("ppl@2:0.1<=20"),
            "inlier ratio: expected a number from 0 to 1, found 2"
        );
        assert_eq!(message("ppl:x<=20"), "threshold: expected a number above 0, found x");
        assert_eq!(message("ppl:0.1<=120"), "bound: expected 0 to 100 percent, found 120");
        assert_eq!(message(":0.1<=20"), format!("{form}, found no scheme"));
        assert_eq!(message("ppl:joint<=20"), format!("{form}, found no threshold"));
        assert_eq!(message("ppl:joint@0.5<=20"), format!("{form}, found no threshold"));
        let names = "expected a solver (joint, joint-start, consensus, ransac, density, tomography) or \
                     a source of neighborhoods (oracle, file, similarity, overlap, geometric, or \
                     several joined by +)";
        assert_eq!(message("ppl:jiont:0.1<=20"), format!("{names}, found jiont"));
        assert_eq!(message("ppl:jiont@0.5:0.1<=20"), format!("{names}, found jiont"));
        assert_eq!(message("ppl:0.1@0.5:0.1<=20"), format!("{names}, found 0.1"));
        assert_eq!(
            message("ppl:joint:ransac:0.1<=20"),
            "expected one solver, found joint and ransac"
        );
        assert_eq!(
            message("ppl:oracle:file:0.1<=20"),
            "expected one source, found oracle and file"
        );
        assert_eq!(
            message("ppl:joint:overlap@0.5:0.1<=20"),
            "inlier ratio: expected none with neighbors by overlap, whose ratio is measured, found @0.5"
        );
        assert_eq!(message("ppl:joint:x<=20"), "threshold: expected a number above 0, found x");
    }
}
