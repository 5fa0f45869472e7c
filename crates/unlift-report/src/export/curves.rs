//! The recovered share over the inlier ratio as an SVG file, one curve per scheme.

use serde_json::{Value, json};

use crate::attack::{self, Given};
use crate::document::{Document, Error};
use crate::page::curves::{givens, slot};
use crate::results::{Results, distinct};
use crate::templates;

/// The colors of schemes on the page in light mode (`--s0` to `--s7` of its style).
const COLORS: [&str; 8] =
    ["#0072b2", "#d55e00", "#a87800", "#008a63", "#66707c", "#c0468f", "#6a4fb3", "#8a4b2a"];
/// Dashes of the oracle's sources; the first is solid.
const DASHES: [&str; 3] = ["none", "7 4", "2 3"];

/// Returns the curves of the oracle's rows within the threshold `only` (as typed), or the headline threshold: the
/// strongest attack at every inlier ratio, as on the page. `None` without a row by the oracle.
///
/// # Errors
/// [`Error::Template`] if the file cannot be rendered (a bug of this crate).
pub fn curves(document: &Document, only: Option<&str>) -> Result<Option<String>, Error> {
    let results = &Results::of(document);
    let typed = only.unwrap_or(results.headline);
    let mut oracle = givens(results);
    oracle.retain(|given| attack::is_oracle(&given.neighbors));
    let sources = distinct(oracle.iter().map(Given::source));
    if sources.is_empty() {
        return Ok(None);
    }
    let (mut curves, mut legend) = (Vec::new(), Vec::new());
    for scheme in &results.schemes {
        let color = COLORS[slot(results, scheme) % COLORS.len()];
        for (at, source) in sources.iter().enumerate() {
            let of_source = oracle.iter().filter(|given| given.source() == *source);
            let points = points(results, scheme, of_source, typed);
            let dash = DASHES[at % DASHES.len()];
            curves.push(json!({ "color": color, "dash": dash, "points": points }));
        }
        legend.push(json!({ "name": scheme, "color": color, "dash": DASHES[0] }));
    }
    if sources.len() > 1 {
        legend.extend(sources.iter().enumerate().map(|(at, name)| {
            json!({ "name": name, "color": COLORS[4], "dash": DASHES[at % DASHES.len()] })
        }));
    }
    let values = json!({
        "version": document.unlift,
        "seed": document.seed,
        "title": format!("{} recovered {}, %", results.points(), results.within(typed)),
        "curves": curves,
        "legend": legend,
    });
    let source = include_str!("../../template/curves.svg");
    Ok(Some(templates::render(&[("curves.svg", source)], &values)? + "\n"))
}

/// Returns the places of a curve's points in the drawing, by rising inlier ratio.
fn points<'a>(
    results: &Results<'_>,
    scheme: &str,
    givens: impl Iterator<Item = &'a Given>,
    typed: &str,
) -> Vec<Value> {
    let shares = givens.filter_map(|given| {
        let row = results.strongest_given(scheme, given, typed)?;
        // A solver that uses only the records has no ratio.
        let has_ratio = attack::reads_lists(&row.solver);
        let share = row.recovered_percent.get(typed).filter(|_| has_ratio)?;
        Some((given.inlier_ratio, *share))
    });
    let mut shares: Vec<(f64, f64)> = shares.collect();
    shares.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The plot has its corners at (58, 346) and (470, 34).
    let place = |(ratio, percent): (f64, f64)| {
        json!([
            format!("{:.1}", 58.0 + ratio * 412.0),
            format!("{:.1}", 346.0 - percent / 100.0 * 312.0)
        ])
    };
    shares.into_iter().map(place).collect()
}
