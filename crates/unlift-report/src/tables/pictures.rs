//! How alike pictures of what came back are to the photos, and what can be found in them.

use super::{Class, NONE, Table, column, key_cells, key_columns};
use crate::document::{Document, LengthUnit, Row};
use crate::paper::{self, PublishedPictures};
use crate::words;

/// The metrics of [`likeness`] and how they are told.
const LIKENESS: [(&str, &str, usize); 3] =
    [("ssim", "SSIM", 3), ("psnr", "PSNR, dB", 1), ("lpips", "LPIPS", 3)];

/// Whether a table of this file shows the metric `name`.
pub(super) fn shown(name: &str) -> bool {
    let of = name.strip_suffix(BASELINE).unwrap_or(name);
    name.starts_with(OF_CLASS) || LIKENESS.iter().any(|(metric, _, _)| *metric == of)
}

/// How alike pictures are to the photos, beside what was published on other places; `None` when no row has any.
pub(crate) fn likeness(document: &Document) -> Option<Table> {
    let first = document.results.iter().find(|row| row.metrics.contains_key("ssim"))?;
    let dim = if first.unit == LengthUnit::Pixel { 2 } else { 3 };
    let figures = |row: &Row, end: &str| {
        LIKENESS.map(|(metric, _, digits)| {
            let value = row.metrics.get(&format!("{metric}{end}"));
            value.map_or(NONE.into(), |value| format!("{value:.digits$}"))
        })
    };
    let lost = |row: &Row| {
        let of = |name: &str| row.metrics.get(name);
        let lost = of("ssim_baseline").zip(of("ssim")).map(|(baseline, ssim)| baseline - ssim);
        lost.map_or(NONE.into(), |lost| format!("{lost:.3}"))
    };
    let baselines = paper::published_pictures(dim, "none", None);
    let published = |found: &[PublishedPictures]| -> Vec<String> {
        let of = |baseline: &PublishedPictures| {
            let same = found.iter().find(|found| found.dataset == baseline.dataset);
            same.map_or(NONE.into(), |found| format!("{:.2}", found.ssim))
        };
        baselines.iter().map(of).collect()
    };
    let mut rows =
        vec![vec!["without protection".to_owned(), NONE.into(), NONE.into(), NONE.into()]];
    rows[0].extend(figures(first, BASELINE));
    rows[0].push(NONE.into());
    rows[0].extend(published(&baselines));
    rows.extend(document.results.iter().map(|row| {
        let found = match row.neighbors.as_str() {
            "oracle" => paper::published_pictures(dim, &row.scheme, Some(row.inlier_ratio)),
            _ => Vec::new(),
        };
        let mut cells = key_cells(row);
        cells.extend(figures(row, ""));
        cells.push(lost(row));
        cells.extend(published(&found));
        cells
    }));
    let mut columns = key_columns();
    let ours = LIKENESS.iter().map(|(_, name, _)| (*name).to_owned());
    let names = ours.chain(["SSIM lost".to_owned()]);
    let paper = baselines.iter().map(|found| format!("paper, {}: SSIM", found.dataset));
    columns.extend(names.chain(paper).map(|name| column(name, Class::Figure)));
    let caption = "How alike pictures of what came back are to the photos, means over photos: SSIM and PSNR are larger, LPIPS smaller the \
                   more alike. The paper’s figures are of other places, another network and full size: compare what is lost.";
    let table = Table { id: "likeness", caption: caption.into(), columns, rows, notes: Vec::new() };
    Some(table.without_empty_columns())
}

/// What the names of metrics begin with that are about a class of objects.
const OF_CLASS: &str = "objects_found_of_";
/// What they end with when they are about pictures of the true points.
const BASELINE: &str = "_baseline";

/// The share of the photos' objects that is found again in the pictures, a column per class; `None` when no row has any.
pub(crate) fn objects(document: &Document) -> Option<Table> {
    let mut classes: Vec<&str> = Vec::new();
    for name in document.results.iter().flat_map(|row| row.metrics.keys()) {
        let class = name.strip_prefix(OF_CLASS).filter(|class| !class.ends_with(BASELINE));
        classes.extend(class.filter(|class| !classes.contains(class)));
    }
    classes.sort_unstable();
    let share = |row: &Row, class: &str, end: &str| {
        let value = row.metrics.get(&format!("{OF_CLASS}{class}{end}"));
        value.map_or(NONE.into(), |value| words::percent(100.0 * value))
    };
    let first = document.results.iter().find(|row| row.metrics.contains_key("objects_found"))?;
    let mut rows =
        vec![vec!["without protection".to_owned(), NONE.into(), NONE.into(), NONE.into()]];
    rows[0].extend(classes.iter().map(|class| share(first, class, BASELINE)));
    rows.extend(document.results.iter().map(|row| {
        let shares = classes.iter().map(|class| share(row, class, ""));
        key_cells(row).into_iter().chain(shares).collect()
    }));
    let mut columns = key_columns();
    let names = classes.iter().map(|class| format!("{}, %", class.replace('_', " ")));
    columns.extend(names.map(|name| column(name, Class::Figure)));
    let caption = "Everyday objects that a detector finds again, in the same place, of those that it finds in the photos; means over \
                   the photos that show one.";
    let table = Table { id: "objects", caption: caption.into(), columns, rows, notes: Vec::new() };
    (!classes.is_empty()).then_some(table)
}
