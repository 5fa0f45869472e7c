//! Gates: bounds on how much of a map may come back.
//!
//! ```text
//! SCHEME[@RATIO]:THRESHOLD[:gain]<=PERCENT
//! ```
//!
//! `ppl@0.5:0.10<=20` fails when more than 20 % of the points come back within 0.10 under `ppl` at
//! inlier ratio 0.5. `SCHEME` may be `all`; without `@RATIO` every ratio counts; every solver, noise model and K
//! always counts: the largest figure decides. `:gain` bounds what recovery adds to a blind attacker,
//! in percentage points. Numbers are compared as numbers, so `0.1` finds the threshold `0.10`.

use crate::values::{positive, ratio};

/// A bound on a figure of an audit.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    /// As typed.
    pub typed: String,
    /// The scheme's name; `None` for all.
    pub scheme: Option<String>,
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
    /// The percentage recovered, less that of a blind attacker.
    Gain,
}

/// What a gate compares, from one row and one threshold of an audit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate<'a> {
    /// The row's scheme.
    pub scheme: &'a str,
    /// The row's inlier ratio, as requested; `None` when it was measured.
    pub inlier_ratio: Option<f64>,
    /// The threshold's value.
    pub threshold: f64,
    /// Percent recovered within the threshold.
    pub recovered_percent: f64,
    /// The same for a blind attacker.
    pub blind_percent: f64,
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
        const FORM: &str = "SCHEME[@RATIO]:THRESHOLD[:gain]<=PERCENT";
        let form =
            |what: &str| format!("expected {FORM} (for example ppl@0.5:0.10<=20), found {what}");
        let typed = text.trim();
        let (left, bound) = typed.split_once("<=").ok_or_else(|| form("no <="))?;
        let (rows, rest) = left.split_once(':').ok_or_else(|| form("no threshold"))?;
        let (threshold, figure) = match rest.split_once(':') {
            None => (rest, Figure::Recovered),
            Some((threshold, "gain")) => (threshold, Figure::Gain),
            Some((_, other)) => return Err(form(&format!(":{other} (only :gain is known)"))),
        };
        let (scheme, inlier_ratio) = match rows.split_once('@') {
            None => (rows, None),
            Some((scheme, text)) => {
                let value = ratio(text).map_err(|error| format!("inlier ratio: {error}"))?;
                (scheme, Some(value))
            }
        };
        let scheme = match scheme.trim() {
            "all" => None,
            name => Some(crate::values::any_scheme(name)?.name.to_owned()),
        };
        let threshold = positive(threshold).map_err(|error| format!("threshold: {error}"))?;
        let bound_percent = match bound.trim().trim_end_matches('%').trim_end().parse::<f64>() {
            Ok(value) if (0.0..=100.0).contains(&value) => value,
            _ => return Err(format!("bound: expected 0 to 100 percent, found {bound}")),
        };
        let typed = typed.to_owned();
        Ok(Self { typed, scheme, inlier_ratio, threshold, figure, bound_percent })
    }

    /// Whether the gate is about rows of this scheme, inlier ratio and threshold.
    pub fn covers(&self, scheme: &str, inlier_ratio: Option<f64>, threshold: f64) -> bool {
        self.scheme.as_deref().is_none_or(|name| name == scheme)
            && self.inlier_ratio.is_none_or(|wanted| inlier_ratio == Some(wanted))
            && self.threshold == threshold
    }

    /// The largest bounded figure among `candidates`; `None` when the gate covers none of them,
    /// which must never count as passing.
    pub fn worst<'a>(&self, candidates: impl IntoIterator<Item = Candidate<'a>>) -> Option<f64> {
        candidates
            .into_iter()
            .filter(|c| self.covers(c.scheme, c.inlier_ratio, c.threshold))
            .map(|c| match self.figure {
                Figure::Recovered => c.recovered_percent,
                Figure::Gain => c.recovered_percent - c.blind_percent,
            })
            .reduce(worse)
    }

    /// Whether a figure keeps the bound. What is not a number does not.
    pub fn passes(&self, found_percent: f64) -> bool {
        found_percent <= self.bound_percent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scheme: &str, inlier_ratio: f64, recovered_percent: f64) -> Candidate<'_> {
        let inlier_ratio = Some(inlier_ratio);
        Candidate { scheme, inlier_ratio, threshold: 0.1, recovered_percent, blind_percent: 6.0 }
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
        let form =
            "expected SCHEME[@RATIO]:THRESHOLD[:gain]<=PERCENT (for example ppl@0.5:0.10<=20)";
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
        assert!(message("pl:0.1<=20").starts_with("expected one of olc"));
    }
}
