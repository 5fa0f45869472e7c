//! Large maps in tiles: each tile is hidden and attacked as a map of its own.

use unlift::audit::{Item, Row};
use unlift::geometry::vector::sub;
use unlift::truth::Original;
use unlift::{Descriptors, Error, PointSet};
use unlift_report::document::TileFigures;

use crate::bail;

/// A part of a map: a box in plan view that overlaps no other tile.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tile {
    /// Its number, from 0.
    pub at: usize,
    /// Rows of the map's points, ascending.
    pub rows: Vec<u32>,
    /// The lowest and highest corner of its points in plan view, without the outer 2 % on every side, which may be outliers.
    pub bounds: [[f64; 2]; 2],
}

impl Tile {
    /// Returns the tile's points among those of the map.
    pub fn points(&self, all: &PointSet<3>) -> Result<PointSet<3>, Error> {
        let own = self.rows.iter().map(|&row| all.positions()[row as usize]).collect();
        PointSet::try_new(own, all.unit())
    }

    /// Returns the tile as an item of an audit. Its random seed depends on its number.
    pub fn item(
        &self,
        original: &Original<3>,
        descriptors: Option<&Descriptors>,
    ) -> Result<Item<3>, Error> {
        let original = Original::new(self.points(original.reveal())?);
        let descriptors = descriptors.map(|all| all.select(&self.rows));
        Ok(Item { name: format!("tile {}", self.at + 1), original, descriptors })
    }
}

/// The split of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tiles {
    /// Maximum number of points of a tile.
    pub max_points: usize,
    /// The number of the only tile to audit, as a task of a cluster; `None` for all.
    pub only: Option<usize>,
}

impl Tiles {
    /// Splits points into the fewest tiles of at most `max_points` points, of nearly equal size, by a k-d
    /// tree in plan view: across the longer side, never across the height.
    ///
    /// The height is the axis nearest to `up`; without `up`, the axis of the smallest extent.
    pub(super) fn of(
        self,
        positions: &[[f64; 3]],
        up: Option<[f64; 3]>,
    ) -> Result<Vec<Tile>, crate::Error> {
        let rows: Vec<u32> = (0..positions.len() as u32).collect();
        let [low, high] = bounds(positions, &rows);
        let size = sub(&high, &low);
        let longest = |by: [f64; 3]| (0..3).max_by(|&a, &b| by[a].total_cmp(&by[b])).unwrap_or(2);
        let height = longest(up.map_or(size.map(|x| -x), |up| up.map(f64::abs)));
        let plan = [[1, 2], [0, 2], [0, 1]][height];
        let n_tiles = positions.len().div_ceil(self.max_points.max(1)).max(1);
        if let Some(at) = self.only.filter(|&at| at >= n_tiles) {
            bail!("tile: expected below {n_tiles}, found {at}");
        }
        let mut tiles = Vec::with_capacity(n_tiles);
        split(positions, rows, n_tiles, plan, &mut tiles);
        tiles.retain(|tile| self.only.is_none_or(|at| at == tile.at));
        Ok(tiles)
    }
}

fn split(
    positions: &[[f64; 3]],
    mut rows: Vec<u32>,
    n_tiles: usize,
    plan: [usize; 2],
    tiles: &mut Vec<Tile>,
) {
    if n_tiles == 1 {
        rows.sort_unstable();
        let quantiles = plan.map(|axis| {
            let mut places: Vec<f64> =
                rows.iter().map(|&row| positions[row as usize][axis]).collect();
            places.sort_unstable_by(f64::total_cmp);
            let left_out = places.len() / 50;
            let at = |rank: usize| places.get(rank).copied().unwrap_or(0.0);
            [at(left_out), at((places.len() - left_out).saturating_sub(1))]
        });
        let bounds = [0, 1].map(|end| quantiles.map(|both| both[end]));
        tiles.push(Tile { at: tiles.len(), rows, bounds });
        return;
    }
    let ([low, high], [a, b]) = (bounds(positions, &rows), plan);
    let axis = if high[a] - low[a] >= high[b] - low[b] { a } else { b };
    let left_tiles = n_tiles / 2;
    let n_left = rows.len() * left_tiles / n_tiles;
    // Ties are broken by row, so the tiles do not depend on the order that the selection leaves.
    rows.select_nth_unstable_by(n_left, |&i, &j| {
        let [x, y] = [i, j].map(|row| positions[row as usize][axis]);
        x.total_cmp(&y).then(i.cmp(&j))
    });
    let right = rows.split_off(n_left);
    split(positions, rows, left_tiles, plan, tiles);
    split(positions, right, n_tiles - left_tiles, plan, tiles);
}

fn bounds(positions: &[[f64; 3]], rows: &[u32]) -> [[f64; 3]; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for &row in rows {
        let point = positions[row as usize];
        bounds[0] = std::array::from_fn(|c| bounds[0][c].min(point[c]));
        bounds[1] = std::array::from_fn(|c| bounds[1][c].max(point[c]));
    }
    bounds
}

/// Returns the figures of every tile: those of its `rows` that are in the pooled `results`.
pub(super) fn figures(tiles: &[Tile], rows: &[Vec<Row>], results: &[Row]) -> Vec<TileFigures> {
    let figures = |(tile, rows): (&Tile, &Vec<Row>)| {
        let percent = |result: &Row| {
            let row = rows.iter().find(|row| row.is_same_cell(result));
            row.map(|row| row.recovered_percent.clone()).unwrap_or_default()
        };
        TileFigures {
            bounds: Some(tile.bounds),
            n_points: tile.rows.len() as u64,
            recovered_percent: results.iter().map(percent).collect(),
        }
    };
    tiles.iter().zip(rows).map(figures).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::seed::{Draws, Stage};

    #[test]
    fn tiles_have_every_point_once_and_do_not_overlap() {
        let mut draws = Draws::new(3, Stage::Synthetic, 1);
        let points: Vec<[f64; 3]> = (0..1003)
            .map(|_| [draws.between(0.0, 9.0), draws.between(0.0, 4.0), draws.between(0.0, 1.0)])
            .collect();
        let cut = |max_points, up| Tiles { max_points, only: None }.of(&points, up).unwrap();
        let tiles = cut(100, None);
        assert_eq!(tiles.len(), 11);
        let mut rows: Vec<u32> = tiles.iter().flat_map(|tile| tile.rows.clone()).collect();
        rows.sort_unstable();
        assert_eq!(rows, (0..1003).collect::<Vec<u32>>());
        assert!(tiles.iter().all(|tile| (91..=92).contains(&tile.rows.len())));
        for (at, one) in tiles.iter().enumerate() {
            for other in &tiles[..at] {
                let apart = |c: usize| {
                    one.bounds[1][c] <= other.bounds[0][c] || other.bounds[1][c] <= one.bounds[0][c]
                };
                assert!(apart(0) || apart(1), "{one:?} and {other:?}");
            }
        }
        // If x is up, tiles are split across y and z.
        let upright = cut(600, Some([-1.0, 0.1, 0.0]));
        assert!(
            upright[0].bounds[1][0] <= upright[1].bounds[0][0] && upright[0].bounds[1][0] < 4.0
        );
        assert_eq!(cut(2000, None).len(), 1);
        let third = Tiles { max_points: 100, only: Some(2) }.of(&points, None).unwrap();
        assert_eq!(third, [tiles[2].clone()]);
        let error = Tiles { max_points: 100, only: Some(11) }.of(&points, None).unwrap_err();
        assert_eq!(error.to_string(), "tile: expected below 11, found 11");
    }
}
