//! The figures of the tiles of a large map, as a table and as a heat map of the plan view.

use serde_json::{Value, json};

use crate::document::{Document, Row, TileFigures};
use crate::page::tables::{Class, Table, column};
use crate::page::{tables, verdict};
use crate::{attack, words};

/// The longer side of a heat map, in units of the drawing.
const SIDE: f64 = 480.0;
const MOST: usize = 4;

/// Returns, for every scheme, the row with the largest share and its index in the results; the worst scheme first.
fn strongest(document: &Document) -> Vec<(usize, &Row)> {
    verdict::verdict(document)
        .cards
        .iter()
        .filter_map(|card| {
            let row = *verdict::by_source(document, &card.scheme).first()?;
            let at = document.results.iter().position(|other| std::ptr::eq(other, row))?;
            Some((at, row))
        })
        .collect()
}

/// Returns heat maps of the schemes that leak most; none if the document has no tiles or not their bounds.
pub(crate) fn heat_maps(document: &Document) -> Vec<Value> {
    let Some(headline) = tables::headline_threshold(document) else { return Vec::new() };
    let placed: Option<Vec<[[f64; 2]; 2]>> =
        document.tiles.iter().map(|tile| tile.bounds).collect();
    let Some(bounds) = placed.filter(|bounds| !bounds.is_empty()) else { return Vec::new() };
    let corner = |end: usize, pick: fn(f64, f64) -> f64| -> [f64; 2] {
        let all = |c: usize| bounds.iter().map(|b| b[end][c]).reduce(pick).unwrap_or(0.0);
        [all(0), all(1)]
    };
    let (low, high) = (corner(0, f64::min), corner(1, f64::max));
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let scale = if extent > 0.0 { SIDE / extent } else { 1.0 };
    let drawn = |(at, row): &(usize, &Row)| {
        let heat = |(number, (tile, [first, last])): (usize, (&TileFigures, &[[f64; 2]; 2]))| {
            let percent = tile.recovered_percent.get(*at).and_then(|all| all.get(&headline));
            let percent = percent.copied().unwrap_or(0.0);
            let points = words::thousands(tile.n_points);
            json!({
                "x": scale * (first[0] - low[0]),
                // The y axis of SVG points down.
                "y": scale * (high[1] - last[1]),
                "width": (scale * (last[0] - first[0])).max(1.0),
                "height": (scale * (last[1] - first[1])).max(1.0),
                "share": percent / 100.0,
                // Drawn if there is room; the title appears under the pointer.
                "percent": format!("{percent:.0}"),
                "title": format!("Tile {}: {percent:.1} % of {points} points", number + 1),
            })
        };
        let size = [0, 1].map(|c| (scale * (high[c] - low[c])).max(1.0));
        let boxes = document.tiles.iter().zip(&bounds).enumerate().map(heat);
        json!({
            "title": format!("{}, {}", row.scheme, attack::briefly(row)),
            "size": size,
            "boxes": boxes.collect::<Vec<_>>(),
        })
    };
    strongest(document).iter().take(MOST).map(drawn).collect()
}

pub(crate) fn table(document: &Document) -> Option<Table> {
    if document.tiles.is_empty() {
        return None;
    }
    let headline = tables::headline_threshold(document)?;
    let strongest = strongest(document);
    let mut columns = vec![column("tile", Class::Label), column("points", Class::Figure)];
    let names = strongest.iter().map(|(_, row)| format!("{}, %", row.scheme));
    columns.extend(names.map(|name| column(name, Class::Figure)));
    let cells = |(number, tile): (usize, &TileFigures)| {
        let mut cells = vec![(number + 1).to_string(), words::thousands(tile.n_points)];
        cells.extend(strongest.iter().map(|(at, _)| {
            let percent = tile.recovered_percent.get(*at).and_then(|all| all.get(&headline));
            percent.map_or("–".to_owned(), |percent| format!("{percent:.1}"))
        }));
        cells
    };
    let caption = format!(
        "Points of every tile recovered within {}, in percent, by the strongest attack on the whole map.",
        tables::threshold_text(document, &headline)
    );
    let rows = document.tiles.iter().enumerate().map(cells).collect();
    Some(Table::new("tiles", caption, columns, rows))
}

/// Returns a line for the terminal about the tile that leaks most; `None` for a document without tiles.
pub(crate) fn line(document: &Document) -> Option<String> {
    let headline = tables::headline_threshold(document)?;
    let (at, row) = *strongest(document).first()?;
    let percent = |tile: &TileFigures| tile.recovered_percent.get(at)?.get(&headline).copied();
    let found = document.tiles.iter().enumerate();
    let mut found: Vec<(f64, usize)> = found.filter_map(|(i, t)| Some((percent(t)?, i))).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (least, most) = (found.first()?.0, found.last()?);
    let (scheme, n) = (&row.scheme, document.tiles.len());
    let least = words::percent(least);
    Some(format!(
        "tiles: of {n}, {scheme} gives back {least} to {} % each, most in tile {}\n",
        words::percent(most.0),
        most.1 + 1
    ))
}
