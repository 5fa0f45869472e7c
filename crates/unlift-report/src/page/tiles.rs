//! The figures of the tiles of a large map, as a table and as a heat map of the plan view.

use serde_json::{Value, json};

use crate::attack;
use crate::document::{Row, TileFigures};
use crate::page::verdict;
use crate::results::Results;
use crate::table::{Table, figure, known, label};
use crate::words;

/// The longer side of a heat map, in units of the drawing.
const SIDE: f64 = 480.0;
const MAX_MAPS: usize = 4;

/// Returns, for every scheme, the row with the largest share and its index in the results; the worst scheme first.
fn strongest<'a>(results: &Results<'a>) -> Vec<(usize, &'a Row)> {
    let cards = verdict::cards(results);
    let strongest = cards.iter().filter_map(|card| {
        let row = *results.by_source(&card.scheme).first()?;
        Some((results.rows.iter().position(|other| std::ptr::eq(other, row))?, row))
    });
    strongest.collect()
}

/// Returns the percentage of a tile in the row at index `at` of the results.
fn percent(results: &Results<'_>, tile: &TileFigures, at: usize) -> Option<f64> {
    tile.recovered_percent.get(at)?.get(results.headline).copied()
}

/// Returns heat maps of the schemes that leak most; none if the document has no tiles or not their bounds.
pub(crate) fn heat_maps(results: &Results<'_>) -> Vec<Value> {
    let tiles = &results.document.tiles;
    let bounds: Option<Vec<[[f64; 2]; 2]>> = tiles.iter().map(|tile| tile.bounds).collect();
    let Some(bounds) = bounds.filter(|bounds| !bounds.is_empty()) else { return Vec::new() };
    let corner = |end: usize, pick: fn(f64, f64) -> f64| -> [f64; 2] {
        [0, 1].map(|c| bounds.iter().map(|b| b[end][c]).reduce(pick).unwrap_or(0.0))
    };
    let (low, high) = (corner(0, f64::min), corner(1, f64::max));
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let scale = if extent > 0.0 { SIDE / extent } else { 1.0 };
    let heat_map = |(at, row): (usize, &Row)| {
        let heat = |(tile, [first, last]): (&TileFigures, &[[f64; 2]; 2])| {
            let percent = percent(results, tile, at).unwrap_or(0.0);
            json!({
                "x": scale * (first[0] - low[0]),
                // The y axis of SVG points down.
                "y": scale * (high[1] - last[1]),
                "width": (scale * (last[0] - first[0])).max(1.0),
                "height": (scale * (last[1] - first[1])).max(1.0),
                "share": percent / 100.0,
                "percent": percent,
                "rounded": format!("{percent:.0}"),
                "n_points": tile.n_points,
            })
        };
        let size = [0, 1].map(|c| (scale * (high[c] - low[c])).max(1.0));
        json!({
            "title": format!("{}, {}", row.scheme, attack::briefly(row)),
            "size": size,
            "boxes": tiles.iter().zip(&bounds).map(heat).collect::<Vec<_>>(),
        })
    };
    strongest(results).into_iter().take(MAX_MAPS).map(heat_map).collect()
}

pub(crate) fn table(results: &Results<'_>) -> Option<Table> {
    type Tile<'a> = (usize, &'a TileFigures);
    let mut columns = vec![
        label("tile", |(number, _): &Tile<'_>| (number + 1).to_string()),
        figure("points", |(_, tile): &Tile<'_>| words::thousands(tile.n_points)),
    ];
    columns.extend(strongest(results).into_iter().map(|(at, row)| {
        figure(format!("{}, %", row.scheme), move |(_, tile): &Tile<'_>| {
            known(percent(results, tile, at), words::percent)
        })
    }));
    let caption = format!(
        "Points of every tile recovered within {}, in percent, by the strongest attack on the whole map.",
        results.threshold(results.headline)
    );
    let tiles: Vec<Tile<'_>> = results.document.tiles.iter().enumerate().collect();
    Table::of("tiles", caption, &tiles, columns).if_beyond(0)
}
