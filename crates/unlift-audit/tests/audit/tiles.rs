//! A map in tiles: each tile is audited as a map of its own, and the page shows which one leaks most.

use std::sync::Arc;

use unlift::audit::{NeighborsBy, Plan};
use unlift::neighbors::Geometric;
use unlift::synthetic;
use unlift_audit::{Input, Map, Tiles};

use crate::{audited, plan, prepared};

fn audit(only: Option<usize>, threads: usize) -> unlift_audit::Audited {
    let prepared = prepared(&synthetic::room(4, 2_000).points);
    let plan = Plan {
        neighbors: vec![NeighborsBy::Oracle, NeighborsBy::Source(Arc::new(Geometric))],
        records_alone: true,
        ..plan(&["ppl", "plane"])
    };
    let map = Map { plan, ..Map::new(&prepared) };
    let input = Input::Tiles(map, Tiles { max_points: 600, only });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| audited(&prepared, &input, &[])).unwrap()
}

#[test]
fn a_tile_is_the_same_alone_and_among_all() {
    let whole = audit(None, 2);
    let document = &whole.document;
    assert_eq!(document.results, audit(None, 1).document.results);
    let sources: Vec<[&str; 2]> =
        document.results.iter().map(|row| [&*row.scheme, &*row.neighbors]).collect();
    // Planes have no geometric neighbors, so only these rows are missing.
    assert_eq!(sources, [["ppl", "oracle"], ["ppl", "geometric"], ["plane", "oracle"]]);
    assert_eq!(document.not_audited.len(), 1);
    assert_eq!(document.tiles.len(), 4);
    let n: u64 = document.tiles.iter().map(|tile| tile.n_points).sum();
    assert_eq!((n, document.results[0].n_points), (2_000, 2_000));
    for (at, row) in document.results.iter().enumerate() {
        for (threshold, &pooled) in &row.recovered_percent {
            let of = |tile: &unlift_report::document::TileFigures| {
                tile.n_points as f64 * tile.recovered_percent[at][threshold]
            };
            let sum: f64 = document.tiles.iter().map(of).sum();
            assert!((sum / 2_000.0 - pooled).abs() < 1e-9);
        }
        // There is no attack on planes from records alone.
        assert_eq!(row.records_alone_percent.is_some(), row.scheme == "ppl");
    }
    let third = audit(Some(2), 1).document;
    assert_eq!(third.tiles, [document.tiles[2].clone()]);
    for (row, percent) in third.results.iter().zip(&document.tiles[2].recovered_percent) {
        assert_eq!(&row.recovered_percent, percent);
    }
}

#[test]
fn the_page_shows_which_tile_leaks_most_unless_it_may_be_shared() {
    let found = audit(None, 2);
    let page = found.page(false).unwrap();
    assert!(page.contains("Where the map leaks most") && page.contains("<title>Tile 4: "));
    let safe = found.page(true).unwrap();
    assert!(!safe.contains("Where the map leaks most"), "a table alone");
    assert!(safe.contains("id=\"table-tiles\""), "a table alone");
    assert!(found.document.share_safe().tiles.iter().all(|tile| tile.bounds.is_none()));
}
