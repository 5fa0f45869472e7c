//! Parses gates.

use unlift::recover::Builtin;

use super::{Figure, Gate};
use crate::sources;

impl Gate {
    /// Parses the form that the module describes.
    ///
    /// # Errors
    /// If a part is wrong; the error names it.
    pub fn parse(text: &str) -> Result<Self, String> {
        const FORM: &str = "SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT";
        let form =
            |what: &str| format!("expected {FORM} (for example ppl@0.5:0.10<=20), found {what}");
        let typed = text.trim();
        let (left, bound) = typed.split_once("<=").ok_or_else(|| form("no <="))?;
        if let Some((scheme, "localization")) = left.rsplit_once(':') {
            return localization(typed, scheme.trim(), bound);
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
            // Names are checked against the plan later.
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
}

fn localization(typed: &str, scheme: &str, bound: &str) -> Result<Gate, String> {
    let bound_percent = match bound.trim().trim_end_matches('x').parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => value,
        _ => return Err(format!("bound: expected a multiple above 0, found {bound}")),
    };
    if scheme.is_empty() || scheme.contains([':', '@']) {
        return Err(format!("expected SCHEME:localization<=MULTIPLE, found {typed}"));
    }
    Ok(Gate {
        typed: typed.to_owned(),
        scheme: (scheme != "all").then(|| scheme.to_owned()),
        solver: None,
        source: None,
        inlier_ratio: None,
        threshold: f64::INFINITY,
        figure: Figure::Localization,
        bound_percent,
    })
}

const ORACLE: &str = "oracle";
/// Sources of `audit sequence`, with the number of queries behind an `@`.
const SEQUENCES: [&str; 3] = ["sequence", "sequence+lists", "tracks"];

/// Counts the names left of `<=`: all parts before the first number. Without a number, all known
/// names, so that the next part is reported as a wrong threshold.
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
    Builtin::from_name(text.trim()).ok().map(|solver| solver.name())
}

fn source_name(text: &str) -> Option<String> {
    match text.trim() {
        name @ (ORACLE | "file" | "again" | "again-geometry") => Some(name.to_owned()),
        name if name.split_once('@').is_some_and(|(name, _)| SEQUENCES.contains(&name)) => {
            Some(name.to_owned())
        }
        name => sources::named(name).ok().map(|named| named.name().to_owned()),
    }
}

/// Finds a solver and a source among the names after a scheme, each at most once, in any order.
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
                let solvers = Builtin::ALL.map(|solver| solver.name()).join(", ");
                let sources: Vec<&str> = sources::all().iter().map(|entry| entry.name).collect();
                return Err(format!(
                    "expected a solver ({solvers}) or a source of neighborhoods ({ORACLE}, file, {}), \
                     found {name}",
                    sources.join(", ")
                ));
            }
        }
    }
    Ok((solver, source))
}

fn positive(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(format!("expected a number above 0, found {text}")),
    }
}

fn ratio(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err(format!("expected a number from 0 to 1, found {text}")),
    }
}
