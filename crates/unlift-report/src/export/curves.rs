//! The recovered share over the inlier ratio as an SVG file, one curve per scheme.

use crate::attack;
use crate::document::Document;
use crate::export::escaped;
use crate::page::curves::{givens, slot};
use crate::results::{Results, distinct};

/// Width and height of the drawing; the constants below are the sides of the plot in it.
const SIZE: (f64, f64) = (640.0, 400.0);
const LEFT: f64 = 58.0;
const RIGHT: f64 = 470.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 346.0;
/// The colors of schemes on the page in light mode (`--s0` to `--s7` of its style).
const COLORS: [&str; 8] =
    ["#0072b2", "#d55e00", "#a87800", "#008a63", "#66707c", "#c0468f", "#6a4fb3", "#8a4b2a"];
/// Dashes of the oracle's sources; the first is solid.
const DASHES: [&str; 3] = ["none", "7 4", "2 3"];

/// Returns the curves of the oracle's rows within the threshold `only` (as typed), or the headline threshold: the
/// strongest attack at every inlier ratio, as on the page. `None` without a row by the oracle.
pub fn curves(document: &Document, only: Option<&str>) -> Option<String> {
    let results = &Results::of(document);
    let typed = only.unwrap_or(results.headline);
    let givens = givens(results);
    let oracle: Vec<_> = givens.iter().filter(|given| given.group == "oracle").collect();
    let sources = distinct(oracle.iter().map(|given| given.source.as_str()));
    sources.first()?;
    let mut text = frame(results, typed);
    let mut entries = Vec::new();
    for scheme in &results.schemes {
        let slot = slot(results, scheme);
        for (at, source) in sources.iter().enumerate() {
            let of_source = oracle.iter().filter(|given| given.source == *source);
            let points = of_source.filter_map(|choice| {
                let row = results.strongest_given(scheme, &choice.given, typed)?;
                // A solver that uses only the records has no ratio.
                let has_ratio = attack::reads_lists(&row.solver);
                let share = row.recovered_percent.get(typed).filter(|_| has_ratio)?;
                Some((choice.given.inlier_ratio, *share))
            });
            let mut points: Vec<(f64, f64)> = points.collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            text.push_str(&curve(&points, slot, DASHES[at % DASHES.len()]));
        }
        entries.push((*scheme, slot, DASHES[0]));
    }
    if sources.len() > 1 {
        let dashed = sources.iter().enumerate();
        entries.extend(dashed.map(|(at, name)| (*name, 4, DASHES[at % DASHES.len()])));
    }
    for (at, (name, slot, dash)) in entries.into_iter().enumerate() {
        let (x, y) = (RIGHT + 22.0, TOP + 8.0 + 19.0 * at as f64);
        let color = COLORS[slot % COLORS.len()];
        text.push_str(&format!(
            "<line x1=\"{x}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\" stroke=\"{color}\" stroke-width=\"2\" \
             stroke-dasharray=\"{dash}\"/>\n<text x=\"{}\" y=\"{}\">{}</text>\n",
            x + 26.0,
            x + 33.0,
            y + 4.0,
            escaped(name)
        ));
    }
    Some(text + "</svg>\n")
}

fn place((ratio, percent): (f64, f64)) -> (f64, f64) {
    (LEFT + ratio * (RIGHT - LEFT), BOTTOM - percent / 100.0 * (BOTTOM - TOP))
}

fn frame(results: &Results<'_>, typed: &str) -> String {
    let (document, within) = (results.document, results.within(typed));
    let title = escaped(&format!("{} recovered {within}, %", results.points()));
    let (width, height) = SIZE;
    let version = escaped(&document.unlift).replace("--", "- -");
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><!-- unlift {version}, seed {} -->\n\
         <svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#1c2026\" role=\"img\">\n\
         <title>{title}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n\
         <text x=\"{LEFT}\" y=\"18\" font-size=\"13\">{title}</text>\n",
        document.seed
    );
    for step in 0..=4 {
        let percent = 25.0 * f64::from(step);
        let (x, y) = place((percent / 100.0, percent));
        text.push_str(&format!(
            "<path d=\"M{LEFT} {y}H{RIGHT}M{x} {TOP}V{BOTTOM}\" stroke=\"#e2dfd8\" fill=\"none\"/>\n\
             <text x=\"{}\" y=\"{}\" text-anchor=\"end\">{percent}</text>\n\
             <text x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{percent}</text>\n",
            LEFT - 9.0,
            y + 4.0,
            BOTTOM + 18.0
        ));
    }
    text + &format!(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">neighbors that are right, %</text>\n",
        (LEFT + RIGHT) / 2.0,
        BOTTOM + 38.0
    )
}

fn curve(points: &[(f64, f64)], slot: usize, dash: &str) -> String {
    if points.is_empty() {
        return String::new();
    }
    let color = COLORS[slot % COLORS.len()];
    let places: Vec<(f64, f64)> = points.iter().map(|&point| place(point)).collect();
    let listed: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let mut text = format!(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"/>\n",
        listed.join(" ")
    );
    for (x, y) in places {
        text.push_str(&format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{color}\"/>\n"));
    }
    text
}
