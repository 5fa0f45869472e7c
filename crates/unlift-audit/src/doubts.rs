//! Doubts: reasons why figures may be too small, because the attack was not at its best or the
//! ground truth is of another map. Low recovery would look like protection, so each doubt is shown
//! beside the verdict, and no gate holds with one.

use unlift::Unit;
use unlift::audit::{Plan, Row, Threshold};
use unlift::evaluate::away_from_own;
use unlift::geometry::knn::Knn;
use unlift::released::Released;
use unlift::truth::{Original, Secret};

use crate::lengths::short;
use crate::tiles::Tile;

/// Limits of delta, in multiples of the quartiles of the distance to the K-th neighbor; beyond them
/// the attack did not learn the distance of neighbors. On RedKitchen and Castle delta is 0.1
/// (`density`) to 4.8 times (`consensus`, noise `near`) the median distance, for all schemes,
/// solvers, sources and noise models.
const NARROW: f64 = 0.05;
const WIDE: f64 = 8.0;
/// Number of points whose neighbors are searched: enough for quartiles.
const SAMPLE: usize = 2000;
/// Tolerated share of points that are farther from their own records than the smallest threshold.
const STRAY: f64 = 0.01;
/// Usual median distance to the K-th neighbor in its own unit, whatever K the unit was made with.
const UNIT: [f64; 2] = [0.2, 5.0];
/// Lists are long if they name a larger share of the map than this (`tests/doubts.rs` states the
/// cost).
const LONG: f64 = 0.05;
/// Lists of at most this length are never long.
const SHORT: usize = 5;

/// The doubts about an audit of a map.
#[derive(Debug, Default)]
pub(crate) struct Doubts {
    pub(crate) of_rows: Vec<Option<String>>,
    /// Notes of the whole audit.
    pub(crate) notes: Vec<String>,
}

/// Finds the doubts about the figures of a map.
///
/// `spread` holds the distances of its points, `hidden` the given release, if it was not made here,
/// and `of_file` the doubts about the points. Deltas of tiles are checked one by one, because their
/// mean would hide a tile whose delta collapsed.
pub(crate) fn doubts(
    (original, spread): (&Original<3>, Spread),
    hidden: Option<&(Released<3>, Secret)>,
    (plan, rows, tile_rows): (&Plan<3>, &[Row], &[Vec<Row>]),
    of_file: &[String],
) -> Doubts {
    let Spread { low, middle, high, n_points } = spread;
    let unit = original.reveal().unit();
    let strangers = hidden.and_then(|hidden| not_its_own(original, hidden, plan));
    let mistaken = hidden.and_then(|_| mistaken_unit(unit, plan.k, middle));
    let of_map = strangers.or(mistaken);
    let mut found = Doubts::default();
    found.notes.extend(of_map.iter().chain(of_file).cloned());
    let of_map = of_map.or_else(|| of_file.first().cloned());
    let share = plan.k as f64 / n_points.max(1) as f64;
    if plan.asks_oracle() && plan.k > SHORT && share > LONG {
        found.notes.push(format!(
            "K = {} is {:.0} % of the map's points: such long lists lower recovery (try a smaller --k)",
            plan.k,
            100.0 * share
        ));
    }
    for row in rows {
        let of_tiles = tile_rows.iter().flatten().filter(|of_tile| of_tile.is_same_cell(row));
        let mut deltas = std::iter::once(row).chain(of_tiles).map(|row| row.delta);
        let unusual =
            deltas.find(|&delta| delta > 0.0 && !(NARROW * low..=WIDE * high).contains(&delta));
        let of_delta = unusual.map(|delta| {
            format!(
                "{}: delta, {}, is far from the usual distance to the K-th neighbor, {} to {}: recovery may be too low \
                 (try --delta, or separate parts of the map)",
                row.scheme,
                in_unit(delta, unit),
                short(low),
                in_unit(high, unit)
            )
        });
        // One line per scheme is enough.
        let start = format!("{}: delta", row.scheme);
        if let Some(doubt) = &of_delta
            && !found.notes.iter().any(|note| note.starts_with(&start))
        {
            found.notes.push(doubt.clone());
        }
        found.of_rows.push(of_map.clone().or(of_delta));
    }
    found
}

/// Quartiles of the distance to the K-th neighbor.
pub(crate) struct Spread {
    low: f64,
    middle: f64,
    high: f64,
    /// Number of points of the map, or of its smallest tile.
    n_points: usize,
}

impl Spread {
    /// Measures the spread of a map on a sample of its points.
    pub(crate) fn of(points: &[[f64; 3]], k: usize) -> Result<Self, unlift::Error> {
        Ok(Self::of_distances(distances(points, k, SAMPLE)?, points.len()))
    }

    /// Measures the spread of a map in tiles. Neighbors are searched within a tile.
    pub(crate) fn of_tiles(
        original: &Original<3>,
        tiles: &[Tile],
        k: usize,
    ) -> Result<Self, unlift::Error> {
        let (mut found, of_each) = (Vec::new(), SAMPLE.div_ceil(tiles.len().max(1)));
        for tile in tiles {
            let item = tile.item(original, None)?;
            found.extend(distances(item.original.reveal().positions(), k, of_each)?);
        }
        let least = tiles.iter().map(|tile| tile.rows.len()).min();
        Ok(Self::of_distances(found, least.unwrap_or(0)))
    }

    fn of_distances(mut distances: Vec<f64>, n_points: usize) -> Self {
        distances.sort_unstable_by(f64::total_cmp);
        let last = distances.len().saturating_sub(1);
        let at = |rank: usize| distances.get(rank).copied().unwrap_or(0.0);
        Self { low: at(last / 4), middle: at(last / 2), high: at(last - last / 4), n_points }
    }
}

fn distances(points: &[[f64; 3]], k: usize, sample: usize) -> Result<Vec<f64>, unlift::Error> {
    let knn = Knn::new(points)?;
    let mut found = Vec::new();
    let kth = |row: usize| {
        knn.nearest(row, k, &mut found);
        found.last().map_or(0.0, |last| last.0.sqrt())
    };
    let every = points.len().div_ceil(sample).max(1);
    Ok((0..points.len()).step_by(every).map(kth).collect())
}

/// Returns a doubt if points of the ground truth are far from their released records.
fn not_its_own(
    original: &Original<3>,
    (released, secret): &(Released<3>, Secret),
    plan: &Plan<3>,
) -> Option<String> {
    let away = away_from_own(released, original, secret);
    stray_truth(&away, &plan.thresholds, released.unit())
}

/// Returns a doubt about the ground truth, given the distances of points from their own records.
pub(crate) fn stray_truth(away: &[f64], thresholds: &[Threshold], unit: Unit) -> Option<String> {
    let strays = strays(away, thresholds, unit)?;
    Some(format!(
        "truth: {strays} away from their own records, where no attack can find them: check that it is of this map, in its \
         frame, scale and order"
    ))
}

/// Returns a doubt about recovered positions, given their distances from their own records.
pub(crate) fn stray_positions(
    away: &[f64],
    thresholds: &[Threshold],
    unit: Unit,
) -> Option<String> {
    let strays = strays(away, thresholds, unit)?;
    Some(format!(
        "recovered: {strays} away from their own records, where no hidden point is: check that they are of this map, in its \
         frame, scale and order"
    ))
}

/// Counts the distances of at least the smallest threshold; `None` up to a share of [`STRAY`].
fn strays(away: &[f64], thresholds: &[Threshold], unit: Unit) -> Option<String> {
    let least = thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min);
    let (n, of) = (away.iter().filter(|&&away| away >= least).count(), away.len());
    let are_many = n as f64 > STRAY * of as f64;
    are_many.then(|| format!("{n} of {of} points are {} or more", in_unit(least, unit)))
}

/// Returns a doubt if lengths are not in the unit that a file states.
fn mistaken_unit(unit: Unit, k: usize, middle: f64) -> Option<String> {
    let is_usual = (UNIT[0]..=UNIT[1]).contains(&middle);
    (unit == Unit::KthNeighbor && !is_usual).then(|| {
        format!(
            "unit: expected a usual distance to the K-th neighbor (K = {k}) of about 1, because the file \
             states lengths in multiples of it, found {}: thresholds do not have their stated meaning",
            short(middle)
        )
    })
}

fn in_unit(length: f64, unit: Unit) -> String {
    match unit {
        Unit::Meter => format!("{} m", short(length)),
        Unit::Pixel => format!("{} px", short(length)),
        Unit::KthNeighbor => short(length),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::audit::{Silent, run};
    use unlift::recover::Builtin;
    use unlift::{PointSet, synthetic};

    #[test]
    fn a_tile_whose_delta_collapsed_is_a_doubt_though_the_mean_is_usual() {
        let set = PointSet::try_new(synthetic::room(4, 600).points, Unit::Meter).unwrap();
        let original = Original::new(set);
        let mut plan = Plan::<3>::new(Unit::Meter);
        plan.schemes.truncate(1);
        (plan.k, plan.inlier_ratios, plan.records_alone) = (10, vec![1.0], false);
        plan.solvers = Builtin::list(&[Builtin::Consensus]);
        let rows = run(&original, None, &plan, &mut Silent).unwrap().rows;
        let of = |tile_rows: &[Vec<Row>]| {
            let spread = Spread::of(original.reveal().positions(), plan.k).unwrap();
            doubts((&original, spread), None, (&plan, &rows, tile_rows), &[]).of_rows
        };
        assert_eq!(of(std::slice::from_ref(&rows)), [None]);
        let collapsed = vec![Row { delta: 1e-6, ..rows[0].clone() }];
        assert!(of(&[rows.clone(), collapsed])[0].is_some());
    }
}
