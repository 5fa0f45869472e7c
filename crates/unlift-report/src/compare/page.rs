//! A comparison as a page of its own: no script, no network.

use minijinja::value::Serde;
use serde::Serialize;

use super::{Change, Comparison};
use crate::document::Document;
use crate::html::environment;
use crate::{Error, tables, words};

const STYLE: &str = include_str!("../../template/style.css");
const TEMPLATE: &str = include_str!("../../template/compare.html");

#[derive(Serialize)]
struct Page<'a> {
    style: &'static str,
    comparison: &'a Comparison,
    summary: String,
    share_safe: bool,
    audits: [Audit<'a>; 2],
    tables: Vec<Figures>,
}

#[derive(Serialize)]
struct Audit<'a> {
    which: &'static str,
    path: Option<&'a str>,
    sha256: Option<&'a str>,
    n_points: String,
    seed: u64,
    unlift: &'a str,
}

#[derive(Serialize)]
struct Figures {
    id: &'static str,
    title: &'static str,
    rows: Vec<[String; 6]>,
}

/// Draws `comparison` of `old` and `new` as one self-contained HTML page.
///
/// # Errors
/// [`Error::Template`] if it cannot be rendered (a bug of this crate).
pub fn page(comparison: &Comparison, old: &Document, new: &Document) -> Result<String, Error> {
    let audits = [("old", old), ("new", new)].map(|(which, document)| Audit {
        which,
        path: document.input.path.as_deref(),
        sha256: document.input.sha256.as_deref(),
        n_points: words::thousands(document.input.n_points),
        seed: document.seed,
        unlift: &document.unlift,
    });
    let table = |id, title, changes: &[Change]| Figures {
        id,
        title,
        rows: changes.iter().map(|change| cells(new, change)).collect(),
    };
    let tables = vec![
        table("more", "Leaks more", &comparison.more),
        table("less", "Leaks less", &comparison.less),
        table("same", "As before", &comparison.same),
    ];
    let page = Page {
        style: STYLE,
        comparison,
        summary: comparison.summary(),
        share_safe: old.input.path.is_none() && new.input.path.is_none(),
        audits,
        tables: tables.into_iter().filter(|table| !table.rows.is_empty()).collect(),
    };
    let mut env = environment();
    env.add_template("compare.html", TEMPLATE)?;
    Ok(env.get_template("compare.html")?.render(Serde(&page))?)
}

fn cells(new: &Document, change: &Change) -> [String; 6] {
    [
        change.scheme.clone(),
        change.attack.clone(),
        tables::threshold_text(new, &change.threshold),
        words::percent(change.old_percent),
        words::percent(change.new_percent),
        format!("{:+.1}", change.points),
    ]
}
