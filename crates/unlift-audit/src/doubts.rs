//! Doubts: reasons why figures may be too small, because the attack was not at its best, the ground
//! truth is of another map, or a released file gives away more than its records. Low recovery would
//! look like protection, so each doubt is shown beside the verdict, and no gate holds with one.

use unlift::audit::doubts::{
    NeighborDistances, across, exchanged, in_unit, least, noise, of_release, short, unused,
    with_sign,
};
use unlift::audit::{Plan, Row, Threshold};
use unlift::evaluate::Truth;
use unlift::geometry::frame::Bounds;
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::{median, sub};
use unlift::released::Released;
use unlift::truth::{Original, Secret};
use unlift::{PointSet, Unit};
use unlift_report::document::Input;

use crate::Error;

/// Limits of delta, in multiples of the quartiles of the distance to the K-th neighbor; beyond them the attack did not learn the
/// distance of neighbors. On RedKitchen and Castle delta is 0.1 (`density`) to 4.8 times (`consensus`, noise `near`) the median
/// distance, for all schemes, solvers, sources and noise models.
const NARROW: f64 = 0.05;
const WIDE: f64 = 8.0;

/// Lists are long if they name a larger share of the map than this (`tests/audit/doubts.rs` states the cost).
const LONG: f64 = 0.05;

/// Lists of at most this length are never long.
const SHORT: usize = 5;

/// What there is to say of the input of an audit.
#[derive(Clone, Debug, Default)]
pub struct Remarks {
    /// Notes for readers of the figures; also reported as progress. Share-safe documents omit those that contain a path.
    pub notes: Vec<String>,
    /// Doubts about all figures: reported as notes, and no gate holds with one.
    pub doubts: Vec<String>,
}

pub(crate) struct Doubts {
    pub(crate) of_rows: Vec<Option<String>>,
    pub(crate) all: Vec<String>,
    /// Notes of the whole audit: its doubts and others.
    pub(crate) notes: Vec<String>,
}

/// Finds the doubts about the figures of a map.
///
/// `usual` holds the distances of its points, `hidden` the given release, if it was not made here, with the median distance to the K-th
/// neighbor among all points of its truth, and `of_file` the doubts about the points. Deltas of tiles are checked one by one, because their mean would hide a tile whose delta collapsed.
pub(crate) fn doubts(
    (original, usual): (&Original<3>, NeighborDistances),
    hidden: Option<(&(Released<3>, Secret), f64)>,
    (plan, rows, tile_rows): (&Plan<3>, &[Row], &[Vec<Row>]),
    of_file: &[String],
) -> Doubts {
    let NeighborDistances { low, high, n_points, .. } = usual;
    let unit = original.reveal().unit();
    let of_release = hidden.and_then(|((released, secret), middle)| {
        of_release(&Truth { original, released, secret }, &plan.thresholds, plan.k, middle)
    });
    let mut notes: Vec<String> = of_release.iter().chain(of_file).cloned().collect();
    let (of_map, mut of_rows, mut all) = (notes.first().cloned(), Vec::new(), notes.clone());
    let least = least(&plan.thresholds);
    let share = plan.k as f64 / n_points.max(1) as f64;
    if plan.asks_oracle() && plan.k > SHORT && share > LONG {
        notes.push(format!(
            "K = {} is {:.0} % of the map's points: such long lists may lower recovery (try a smaller --k)",
            plan.k,
            100.0 * share
        ));
    }
    let (shortest, longest, mut told) = (short(low), in_unit(high, unit), Vec::new());
    for row in rows {
        let of_tiles = tile_rows.iter().flatten().filter(|of_tile| of_tile.is_same_cell(row));
        let mut deltas = std::iter::once(row).chain(of_tiles).map(|row| row.delta);
        let unusual =
            deltas.find(|&delta| delta > 0.0 && !(NARROW * low..=WIDE * high).contains(&delta));
        let of_delta = unusual.map(|delta| in_unit(delta, unit)).map(|delta| {
            format!(
                "{}: delta, {delta}, is far from the usual distance to the K-th neighbor, {shortest} to {longest}: recovery may be \
                 too low (try to audit separate parts of the map)",
                row.scheme
            )
        });
        let of_row = of_delta.or_else(|| unused(row)).or_else(|| exchanged(row));
        // One line per scheme is enough.
        if of_row.is_some() && !told.contains(&&row.scheme) {
            told.push(&row.scheme);
            notes.extend(of_row.clone());
        }
        all.extend(of_row.iter().cloned().chain(noise(row, least)));
        of_rows.push(of_map.clone().or(of_row));
        notes.extend(noise(row, f64::INFINITY));
    }
    notes.dedup();
    Doubts { of_rows, all, notes }
}

/// Returns `input` with the sides of the box around all points but the outer 1 % of each axis.
pub fn with_sides(input: Input, points: &PointSet<3>) -> Input {
    let bounds = Bounds::quantiles(points.positions(), 0.01);
    let sides = bounds.map(|bounds| sub(&bounds.high, &bounds.low));
    let longest_side = sides.map(|sides| sides.into_iter().fold(0.0, f64::max));
    match points.unit() {
        Unit::Meter => Input { extent_m: sides, longest_side: None, ..input },
        _ => Input { extent_m: None, longest_side, ..input },
    }
}

/// Returns the median distance to the nearest other point.
pub(crate) fn nearest(points: &[[f64; 3]]) -> Result<f64, unlift::Error> {
    Ok(median(&mut Knn::new(points)?.kth_distances(1)))
}

/// Plausible sizes of a map in meters: from a grain of dust to beyond the orbit of the moon.
const ACROSS_M: [f64; 2] = [1e-6, 1e9];

/// If nearest neighbors are this many times the largest threshold apart, no attack can come near
/// ([`HOPELESS`]), or the lengths are doubtful ([`UNUSUAL`]).
pub(crate) const HOPELESS: f64 = 100.0;
const UNUSUAL: f64 = 3.0;

/// Checks a scale against the points as they were read.
///
/// # Errors
/// If it makes the map smaller than dust or larger than the orbit of the moon.
pub fn check_scale(points: &[[f64; 3]], scale: Option<f64>) -> Result<(), Error> {
    let Some(scale) = scale else { return Ok(()) };
    let across = across(points);
    let [min, max] = ACROSS_M;
    // Coincident points have their own error.
    if across == 0.0 || (min..=max).contains(&(across * scale)) {
        return Ok(());
    }
    let error = Error::request(format!(
        "--scale {scale:e}: expected {:.1e} to {:.1e} meters per unit, as the map is {} units across, found {scale:e}",
        min / across,
        max / across,
        short(across),
    ));
    Err(error.advise("--scale 1 for a map in meters, or no --scale for relative lengths"))
}

/// Checks thresholds against the points, in the unit of the audit. Adds a note to `remarks` if figures may be too large, and a doubt
/// if they may be too small. Default thresholds in a relative unit always fit.
///
/// # Errors
/// If any guess would count as recovered, or no attack could come near.
pub fn check_thresholds(
    remarks: &mut Remarks,
    points: &PointSet<3>,
    thresholds: &[Threshold],
    typed: bool,
) -> Result<(), Error> {
    let unit = points.unit();
    let by_size = |a: &&Threshold, b: &&Threshold| a.value.total_cmp(&b.value);
    let (Some(smallest), Some(largest), true) = (
        thresholds.iter().min_by(by_size),
        thresholds.iter().max_by(by_size),
        unit == Unit::Meter || typed,
    ) else {
        return Ok(());
    };
    let (nearest, across) = (nearest(points.positions())?, across(points.positions()));
    let option = if typed { "--thresholds" } else { "--scale" };
    let doubtful = if typed { option } else { "the scale" };
    let times = match unit {
        Unit::KthNeighbor => " times the usual distance to the K-th neighbor",
        Unit::Meter | Unit::Pixel => "",
    };
    let [across_text, nearest_text] = [across, nearest].map(|x| in_unit(x, unit) + times);
    let [smallest_text, largest_text] = [smallest, largest].map(|t| with_sign(&t.label, unit));
    let error = |text: String| {
        Error::request(format!("{option}: expected {text}")).advise(match unit {
            Unit::Meter => "another --scale (meters per unit; of a released map, the unit that it states), or other --thresholds",
            Unit::KthNeighbor | Unit::Pixel => "other --thresholds, or none for the usual ones",
        })
    };
    if across > 0.0 && smallest.value >= across {
        return Err(error(format!(
            "a map larger than the smallest threshold, {smallest_text}, found one {across_text} across: any guess \
             would count as recovered"
        )));
    }
    if nearest >= HOPELESS * largest.value {
        return Err(error(format!(
            "points less than {HOPELESS} times the largest threshold, {largest_text}, from their nearest neighbors, \
             found {nearest_text}: no attack could come near"
        )));
    }
    if across > 0.0 && largest.value >= across {
        remarks.notes.push(format!(
            "the map is {across_text} across, less than the threshold {largest_text}: within it any guess counts as recovered"
        ));
    } else if nearest >= UNUSUAL * largest.value {
        remarks.doubts.push(format!(
            "lengths are doubtful: points are {nearest_text} from their nearest neighbors, far more than the largest threshold, \
             {largest_text}: is {doubtful} right?"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::audit::{Silent, run};
    use unlift::recover::Builtin;
    use unlift::synthetic;

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
            let usual =
                NeighborDistances::of(std::iter::once(Ok(original.reveal())), plan.k).unwrap();
            doubts((&original, usual), None, (&plan, &rows, tile_rows), &[]).of_rows
        };
        assert_eq!(of(std::slice::from_ref(&rows)), [None]);
        let collapsed = vec![Row { delta: 1e-6, ..rows[0].clone() }];
        assert!(of(&[rows.clone(), collapsed])[0].is_some());
    }

    #[test]
    fn the_extent_of_a_map_is_that_of_most_points() {
        // Georeferenced coordinates are large although the map is not; an outlier does not count.
        let mut far: Vec<_> = room(1.0).iter().map(|p| p.map(|x| x + 5e6)).collect();
        far.push([1e15; 3]);
        check_scale(&far, Some(1.0)).unwrap();
    }

    #[test]
    fn thresholds_that_mean_nothing_for_a_map_are_refused_or_noted() {
        let usual = |scale| checked(scale, Unit::Meter, ["0.10", "0.25"], false);
        let nothing = || Ok([const { Vec::new() }; 2]);
        assert_eq!(usual(1.0), nothing());
        // The larger threshold alone gives a note.
        let [notes, doubts] = usual(0.03).unwrap();
        assert!(doubts.is_empty() && notes[0].contains("less than the threshold 0.25 m"));
        let [notes, doubts] = usual(100.0).unwrap();
        assert!(notes.is_empty() && doubts[0].ends_with("is the scale right?"), "{doubts:?}");
        // Thresholds as typed are checked in any unit.
        let of = |labels, typed| checked(20.0, Unit::KthNeighbor, labels, typed);
        for labels in [["1e300", "1e301"], ["1e-300", "1e-9"]] {
            assert!(of(labels, true).unwrap_err().starts_with("--thresholds: expected"));
            assert_eq!(of(labels, false), nothing());
        }
        assert_eq!(of(["1.0", "2.5"], true), nothing());
    }

    fn room(scale: f64) -> Vec<[f64; 3]> {
        synthetic::room(0, 2000).points.iter().map(|p| p.map(|x| x * scale)).collect()
    }

    /// Returns the notes and doubts, or the error.
    fn checked(
        scale: f64,
        unit: Unit,
        labels: [&str; 2],
        typed: bool,
    ) -> Result<[Vec<String>; 2], String> {
        let points = PointSet::try_new(room(scale), unit).unwrap();
        let thresholds = labels.map(|label| Threshold::parse(label).unwrap());
        let mut remarks = Remarks::default();
        check_thresholds(&mut remarks, &points, &thresholds, typed)
            .map(|()| [remarks.notes, remarks.doubts])
            .map_err(|error| error.to_string())
    }
}
