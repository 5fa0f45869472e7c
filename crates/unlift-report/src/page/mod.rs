//! The page: one file that loads nothing and shows all numbers without script.

mod blocks;
pub(crate) mod cost;
pub(crate) mod curves;
pub mod inversions;
mod next;
pub mod pictures;
pub mod scene;
pub(crate) mod tables;
mod tiles;
pub(crate) mod verdict;

use serde_json::{Value, json};
use unlift::Unit;

use crate::attack::{self, Basis};
use crate::document::{Document, Error};
use crate::gates::gates;
use crate::page::blocks::Blocks;
use crate::page::inversions::Inversion;
use crate::page::pictures::Picture;
use crate::page::scene::Scene3d;
use crate::page::verdict::{Card, verdict};
use crate::results::{Results, distinct};
use crate::{templates, words};

/// The templates, by the names under which they include each other.
const TEMPLATES: [(&str, &str); 12] = [
    ("report.html", include_str!("../../template/report.html")),
    ("terms.html", include_str!("../../template/terms.html")),
    ("gates.html", include_str!("../../template/gates.html")),
    ("verdict.html", include_str!("../../template/verdict.html")),
    ("next.html", include_str!("../../template/next.html")),
    ("figures.html", include_str!("../../template/figures.html")),
    ("inversions.html", include_str!("../../template/inversions.html")),
    ("pictures.html", include_str!("../../template/pictures.html")),
    ("cost.html", include_str!("../../template/cost.html")),
    ("tiles.html", include_str!("../../template/tiles.html")),
    ("tables.html", include_str!("../../template/tables.html")),
    ("notes.html", include_str!("../../template/notes.html")),
];
const STYLE: [&str; 2] =
    [include_str!("../../template/style.css"), include_str!("../../template/figures.css")];
const BUNDLE: &str = include_str!("../../web/vendor/bundle.min.js");
const SCRIPTS: [&str; 8] = [
    include_str!("../../web/choices.js"),
    include_str!("../../web/charts.js"),
    include_str!("../../web/figures.js"),
    include_str!("../../web/scene.js"),
    include_str!("../../web/pictures.js"),
    include_str!("../../web/sheets.js"),
    include_str!("../../web/tables.js"),
    include_str!("../../web/report.js"),
];

/// Draws `document` as one self-contained HTML page below 10 MB.
///
/// With [`RenderOptions::share_safe`] the scene and pictures are ignored and names are withheld, whatever the document holds.
///
/// # Errors
///
/// [`Error::Invalid`] or [`Error::Schema`] when the document breaks a rule of its format,
/// [`Error::Template`] when the page cannot be rendered (a bug of this crate).
pub fn render(document: &Document, options: &RenderOptions) -> Result<String, Error> {
    document.check()?;
    let safe = options.share_safe;
    let document = if safe { document.share_safe() } else { document.clone() };
    let results = &Results::of(&document);
    // A share-safe page draws nothing of the input.
    let nothing = RenderOptions::default();
    let private = if safe { &nothing } else { options };
    let RenderOptions { scene, pictures, inversions, opening, .. } = private;
    let mut blocks = Blocks::default();
    let error_unit = results.thresholds.first().and_then(|typed| typed.parse().ok());
    let error_unit = error_unit.unwrap_or(1.0);
    let scene = scene.as_ref();
    let scene = scene.and_then(|scene| scene::encode(scene, results.rows, error_unit, &mut blocks));
    let within = results.headline.parse().unwrap_or(10.0);
    let encoded = pictures::encode(pictures, within, &mut blocks);
    let mut data = curves::page_data(results);
    data["scene"] = scene.into();
    data["first_picture"] = pictures::first_choice(pictures, within).into();
    data["pictures"] = encoded.into();
    let tables = [
        Some(tables::recovered(results)),
        Some(tables::baselines(results)),
        cost::table(results),
        tables::distinct_places(results),
        tiles::table(results),
        tables::likeness(results),
        tables::objects(results),
        Some(tables::errors(results)),
        tables::break_even(results),
        Some(tables::losses(results)),
        tables::choices(results),
    ];
    let (sheets, sheets_left_out) = inversions::sheets(results, inversions);
    let first = opening.iter().map(|opening| opening.0.clone());
    let own = Opening::of(results, inversions, None);
    let oracle = results.rows.iter().filter(|row| attack::basis(row) == Basis::Oracle);
    let not_audited = document.not_audited.iter().map(|refused| {
        let source = refused.neighbors.as_deref().map(|by| attack::plain_source(by, None));
        (&refused.scheme, source, &refused.reason)
    });
    let plain = document.options.iter().map(|(name, value)| (name, plain(value)));
    let page = json!({
        "style": STYLE,
        "bundle": BUNDLE,
        "scripts": SCRIPTS,
        // JSON that can be inside a script element, because it contains no `<`.
        "data": data.to_string().replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026"),
        "blocks": blocks.0,
        "pictures": !pictures.is_empty(),
        "findings": curves::findings(results),
        // The verdict of this audit, after that of another audit if there is one.
        "parts": first.chain([own.0]).collect::<Vec<_>>(),
        "next": next::steps(results),
        "sheets": sheets,
        "sheets_left_out": sheets_left_out,
        "heat_maps": tiles::heat_maps(results),
        "cost": cost::chart(results),
        "scene": data["scene"],
        "share_safe": safe,
        "subject": subject(results),
        "gates": gates(&document),
        // Known neighbors were tried at several shares of right ones.
        "has_curves": distinct(oracle.map(|row| row.inlier_ratio)).len() > 1,
        // A row has estimated probabilities.
        "judged": results.rows.iter().any(|row| !curves::judged(row).is_empty()),
        "tables": tables.into_iter().flatten().collect::<Vec<_>>(),
        "times": tables::times(results),
        "options": plain.collect::<Vec<_>>(),
        "command": document.run.command,
        "sha256": document.input.sha256,
        "seconds": words::seconds(document.run.seconds.total),
        "memory": document.run.peak_memory_bytes.map(words::bytes),
        "not_audited": not_audited.collect::<Vec<_>>(),
        "other_sha256": document.input.other_sha256.iter().collect::<Vec<_>>(),
        "document": document,
    });
    Ok(templates::render(&TEMPLATES, &page)?.replace(turns, "\u{fffd}"))
}

/// Returns whether a character changes the direction of text; a name may contain one.
fn turns(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

fn subject(results: &Results<'_>) -> Value {
    let input = &results.document.input;
    json!({
        // The last telling part of the path; the whole path is in the last section.
        "name": input.path.as_deref().map(short_name),
        "n_points": input.n_points,
        "images": input.images,
        "metric": results.unit != Unit::KthNeighbor,
        "kind": if results.is_of_images() { "images" } else { "map" },
        "points": results.points(),
        "size": input.size(),
        "scale": input.scale_m_per_unit.map(|scale| scale.to_string()),
        "map_units": input.unit_in_map_units.map(|unit| words::significant(unit, 4)),
        "kth": words::ordinal(results.k()),
        "usual_distance": words::USUAL_DISTANCE,
    })
}

/// Returns the part of a path that names the map: `room` of `maps/room/sparse/0`.
fn short_name(path: &str) -> String {
    let says_little = |part: &&str| {
        matches!(*part, "" | "." | ".." | "sparse" | "model" | "dense" | "colmap")
            || part.bytes().all(|byte| byte.is_ascii_digit())
    };
    let mut parts = path.split(['/', '\\']).rev().filter(|part| !part.is_empty());
    let name = parts.clone().find(|part| !says_little(part)).or_else(|| parts.next());
    name.unwrap_or(path).to_owned()
}

fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(plain).collect::<Vec<_>>().join(", "),
        Value::Null => "none".to_owned(),
        Value::Bool(_) | Value::Number(_) | Value::Object(_) => value.to_string(),
    }
}

/// Options of the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RenderOptions {
    /// Leaves out everything but figures: no points, paths, names, command line.
    pub share_safe: bool,
    /// The 3D view of a map.
    pub scene: Option<Scene3d>,
    /// Images to draw, at most [`MOST_PICTURES`](crate::pictures::MOST_PICTURES); empty for maps.
    pub pictures: Vec<Picture>,
    /// Pictures that a network painted from recovered points.
    pub inversions: Vec<Inversion>,
    /// The verdict on another audit, at the top of the page.
    pub opening: Option<Opening>,
}

/// The opening of a page: the verdict on an audit, and its pictures if it has any.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening(Value);

impl Opening {
    /// Returns the opening of another audit under a title; `details` is a link to that audit's own page.
    pub fn titled(
        document: &Document,
        inversions: &[Inversion],
        title: &str,
        details: &str,
    ) -> Self {
        Self::of(&Results::of(document), inversions, Some((title, details)))
    }

    fn of(results: &Results<'_>, inversions: &[Inversion], titled: Option<(&str, &str)>) -> Self {
        Self(json!({
            "title": titled.map(|(title, _)| title),
            "details": titled.map(|(_, details)| details),
            "verdict": verdict(results),
            "exhibits": inversions::exhibits(results, inversions),
            "notes": results.document.notes,
        }))
    }
}

/// The share of one scheme recovered within the headline threshold by the strongest attacks tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The scheme's title.
    pub title: String,
    /// Percent from the released data alone; `None` if no such attack was tried.
    pub today: Option<f64>,
    /// Percent with known neighbors, at the tested inlier ratio nearest to one half; `None` without an oracle.
    pub known: Option<f64>,
    /// How many pictures can be rebuilt from the released data alone; `None` if no picture was painted.
    pub pictures: Option<String>,
}

/// Returns the shares of every scheme, the worst first, as at the top of the page.
pub fn shares(document: &Document, inversions: &[Inversion]) -> Vec<Shares> {
    let results = &Results::of(document);
    let of = |card: Card| {
        let share = |basis| card.finding(basis).map(|finding| finding.recovered);
        let (today, known) = (share(Basis::Released), share(Basis::Oracle));
        let pictures = inversions::count_rebuilt(results, inversions, &card.scheme);
        Shares { today, known, pictures, scheme: card.scheme, title: card.title }
    };
    verdict::cards(results).into_iter().map(of).collect()
}
