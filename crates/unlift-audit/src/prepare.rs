//! Selects and scales the points of a file for an audit.

use std::borrow::Cow;

use unlift::geometry::knn::Knn;
use unlift::seed::{Draws, Stage};
use unlift::truth::Original;
use unlift::{Descriptors, Error, ErrorKind, PointSet, Unit};

use crate::localization::Cameras;

/// Options for the points of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparation {
    /// Meters per unit of the file. Without it, the median distance to the K-th neighbor is the
    /// unit.
    pub scale: Option<f64>,
    /// The K of that unit.
    pub k: usize,
    /// Size of the random subset.
    pub max_points: Option<usize>,
    /// Seed of the subset.
    pub seed: u64,
    /// Also reads the colors of the points, which a COLMAP model has, for pictures.
    pub colors: bool,
}

/// All points, in the unit of the median distance to the 50th neighbor.
impl Default for Preparation {
    fn default() -> Self {
        Self { scale: None, k: 50, max_points: None, seed: 0, colors: false }
    }
}

/// Points ready for an audit.
#[derive(Debug)]
pub struct Prepared {
    /// The points in the unit of the audit.
    pub original: Original<3>,
    /// Descriptors, one row per point.
    pub descriptors: Option<Descriptors>,
    /// Length of the unit of the audit in units of the file.
    pub unit_in_map_units: f64,
    /// Rows of the file that were kept, ascending.
    pub rows: Vec<u32>,
    /// The cameras that observe the points, if the file has them.
    pub cameras: Cameras,
    /// Notes for readers of the figures. Share-safe documents omit those that contain a path.
    pub notes: Vec<String>,
    /// Doubts about all figures. No gate holds with one.
    pub doubts: Vec<String>,
}

impl Prepared {
    /// Takes points that are in the unit of the audit, without descriptors and cameras.
    pub fn of(original: Original<3>) -> Self {
        let rows = (0..original.len() as u32).collect();
        let (cameras, notes, doubts) = Default::default();
        let (descriptors, unit_in_map_units) = (None, 1.0);
        Self { original, descriptors, unit_in_map_units, rows, cameras, notes, doubts }
    }
}

/// Thins out and scales `positions` and `descriptors`. Owned positions that are all kept
/// are not copied, because large maps need the memory.
///
/// # Errors
/// If fewer than K + 1 points are left, they coincide, or a scaled coordinate is not finite.
pub fn prepare<'a>(
    positions: impl Into<Cow<'a, [[f64; 3]]>>,
    descriptors: Option<&Descriptors>,
    preparation: &Preparation,
) -> Result<Prepared, Error> {
    let positions = positions.into();
    let (n_read, mut notes) = (positions.len(), Vec::new());
    let mut rows: Vec<u32> = (0..n_read as u32).collect();
    if let Some(most) = preparation.max_points
        && rows.len() > most
    {
        notes.push(format!(
            "--max-points: {most} of {n_read} points are audited; the whole map is denser, so more of it is \
             recovered"
        ));
        Draws::new(preparation.seed, Stage::Subset, 0).shuffle(&mut rows);
        rows.truncate(most);
        rows.sort_unstable();
    }
    let k = preparation.k;
    if rows.len() <= k {
        let expected = format!("at least {} (K + 1)", k.saturating_add(1));
        let error = Error::new("points", expected, rows.len().to_string());
        return Err(error.of_kind(ErrorKind::TooFewPoints));
    }
    let kept: Vec<[f64; 3]> = match rows.len() == n_read {
        true => positions.into_owned(),
        false => rows.iter().map(|&row| positions[row as usize]).collect(),
    };
    let (unit_in_map_units, factor, unit) = match preparation.scale {
        Some(scale) => (1.0 / scale, scale, Unit::Meter),
        None => {
            let distance = median_kth_distance(&kept, k)?;
            (distance, 1.0 / distance, Unit::KthNeighbor)
        }
    };
    let points = PointSet::try_new(kept, unit)?;
    let points = if factor == 1.0 { points } else { points.scaled(factor, unit)? };
    let descriptors = descriptors.map(|all| all.select(&rows));
    let prepared = Prepared::of(Original::new(points));
    Ok(Prepared { descriptors, unit_in_map_units, rows, notes, ..prepared })
}

/// Returns the median over all points of the distance to the `k`-th nearest other point.
fn median_kth_distance(points: &[[f64; 3]], k: usize) -> Result<f64, Error> {
    let knn = Knn::new(points)?;
    let mut distances = knn.kth_distances(k);
    let median = unlift::geometry::vector::median(&mut distances);
    if median > 0.0 && (1.0 / median).is_finite() {
        return Ok(median);
    }
    let what = format!("median distance to neighbor {k}");
    Err(Error::new(what, "more than 0 (points that do not coincide)", median.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Preparation = Preparation {
        scale: None,
        k: 2,
        max_points: None,
        seed: 0,
        colors: false,
    };

    /// Points 0.5 apart on a line; the second neighbor is 0.5 away except at the ends.
    fn line(n: usize) -> Vec<[f64; 3]> {
        (0..n).map(|i| [0.5 * i as f64, 0.0, 0.0]).collect()
    }

    #[test]
    fn without_a_scale_the_unit_is_the_kth_neighbor() {
        let prepared = prepare(line(9), None, &PLAIN).unwrap();
        assert_eq!(prepared.unit_in_map_units, 0.5);
        let points = prepared.original.reveal();
        assert_eq!(points.unit(), Unit::KthNeighbor);
        assert_eq!(points.positions()[3], [3.0, 0.0, 0.0]);
    }

    #[test]
    fn a_scale_gives_meters() {
        let scaled = Preparation { scale: Some(4.0), ..PLAIN };
        let prepared = prepare(line(9), None, &scaled).unwrap();
        assert_eq!(prepared.unit_in_map_units, 0.25);
        assert_eq!(prepared.original.reveal().positions()[3], [6.0, 0.0, 0.0]);
        assert_eq!(prepared.original.reveal().unit(), Unit::Meter);
    }

    #[test]
    fn points_that_are_handed_over_are_not_copied() {
        let meters = Preparation { scale: Some(1.0), ..PLAIN };
        let points = line(9);
        let lent = prepare(&points, None, &meters).unwrap();
        let place = points.as_ptr();
        let given = prepare(points, None, &meters).unwrap();
        assert_eq!(given.original.reveal().positions().as_ptr(), place);
        assert_eq!(given.original.reveal(), lent.original.reveal());
    }

    #[test]
    fn too_few_points_are_told() {
        let error = prepare(line(2), None, &PLAIN).unwrap_err();
        assert_eq!(error.to_string(), "points: expected at least 3 (K + 1), found 2");
    }

    #[test]
    fn coincident_points_have_no_unit() {
        let error = prepare(&[[1.0; 3]; 5], None, &PLAIN).unwrap_err();
        assert_eq!(
            error.to_string(),
            "median distance to neighbor 2: \
             expected more than 0 (points that do not coincide), found 0"
        );
    }

    #[test]
    fn a_subset_keeps_the_order() {
        let some = Preparation { max_points: Some(10), ..PLAIN };
        let prepared = prepare(line(30), None, &some).unwrap();
        assert_eq!(prepared.rows.len(), 10);
        assert!(prepared.rows.is_sorted());
    }
}
