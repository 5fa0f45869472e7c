//! Doubts: reasons why figures may be too small, because data does not belong together or lengths are unusual. Low recovery would look
//! like protection.

use std::borrow::Borrow;

use nalgebra::{Matrix3, Vector3};

use super::row::EXCHANGED;
use super::{Row, Threshold};
use crate::evaluate::{OFF_RECORD, Truth, are_strangers, nearer_to_own, recovered_away};
use crate::geometry::knn::Knn;
use crate::geometry::vector::{distance, median};
use crate::neighbors::{DescriptorKind, has_usual_order};
use crate::recover::{Recovered, Status};
use crate::released::{Obfuscation, Released};
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error, PointSet, Unit};

/// Number of points or descriptors that are examined: enough for quartiles.
pub(super) const SAMPLE: usize = 2000;

/// Tolerated share of points that are farther from their own records than the smallest threshold.
const STRAY: f64 = 0.01;

/// Median distance to the K-th neighbor in its own unit, measured on a sample.
const UNIT: [f64; 2] = [0.8, 1.25];

/// Quartiles of the distance to the K-th neighbor.
#[derive(Clone, Copy, Debug)]
pub struct NeighborDistances {
    /// The lower quartile.
    pub low: f64,
    /// The median.
    pub middle: f64,
    /// The upper quartile.
    pub high: f64,
    /// Number of points of the map, or of its smallest part.
    pub n_points: usize,
}

impl NeighborDistances {
    /// Measures the parts of a map on a sample of their points. Neighbors are searched within a part.
    ///
    /// # Errors
    /// If a part has no points.
    pub fn of<P: Borrow<PointSet<3>>>(
        parts: impl ExactSizeIterator<Item = Result<P, Error>>,
        k: usize,
    ) -> Result<Self, Error> {
        let of_each = SAMPLE.div_ceil(parts.len().max(1));
        let (mut distances, mut nearest, mut n_points) = (Vec::new(), Vec::new(), usize::MAX);
        for part in parts {
            let part = part?;
            let points = part.borrow().positions();
            let knn = Knn::new(points)?;
            let kth = |row: usize| {
                knn.nearest(row, k, &mut nearest);
                nearest.last().map_or(0.0, |last| last.0.sqrt())
            };
            let every = points.len().div_ceil(of_each).max(1);
            distances.extend((0..points.len()).step_by(every).map(kth));
            n_points = n_points.min(points.len());
        }
        distances.sort_unstable_by(f64::total_cmp);
        let last = distances.len().saturating_sub(1);
        let at = |rank: usize| distances.get(rank).copied().unwrap_or(0.0);
        Ok(Self { low: at(last / 4), middle: at(last / 2), high: at(last - last / 4), n_points })
    }
}

/// Nothing is measured if the median distance of points from their own records is this many times that to the K-th neighbor.
const APART: f64 = 4.0;

/// Checks that the ground truth belongs to the records.
///
/// # Errors
/// If most points are far from their own records.
pub fn check_truth(
    original: &Original<3>,
    (released, secret): &(Released<3>, Secret),
    usual: &NeighborDistances,
) -> Result<(), Error> {
    let truth = Truth { original, released, secret };
    truth.belongs()?;
    let (mut away, unit) = (truth.away_from_own(), released.unit());
    let middle = if away.is_empty() { 0.0 } else { median(&mut away) };
    let limit = APART * usual.middle;
    if middle <= limit || truth.is_noise() {
        return Ok(());
    }
    let expected = format!("records within {} of their own points", in_unit(limit, unit));
    let found = format!("{}: not measured (another unit, scale or frame?)", in_unit(middle, unit));
    Err(Error::new("truth", expected, found))
}

/// Returns a doubt about a release that was not made here, whose usual distance to the K-th neighbor is `middle`.
pub fn of_release(
    truth: &Truth<'_, 3>,
    thresholds: &[Threshold],
    k: usize,
    middle: f64,
) -> Option<String> {
    let (least, unit) = (least(thresholds), truth.released.unit());
    // A scheme's noise has a doubt of its own, and decoys hide no points.
    let is_usual = truth.is_noise() || truth.released.obfuscation().is_bearings();
    let away = if is_usual { Vec::new() } else { truth.away_from_own() };
    rounded(truth.usual_rounding(), least, unit)
        .or_else(|| strays(false, &away, least, unit))
        .or_else(|| moved(away, least, unit))
        .or_else(|| mistaken_unit(unit, k, middle))
        .or_else(|| crossings(truth.through_others()))
        .or_else(|| of_directions(truth.released.obfuscation()))
}

/// Records are nearly parallel if the squares of their directions, or normals, have this share of their sum along one axis.
const PARALLEL: f64 = 0.98;

/// Returns a doubt if records start in one center or are nearly parallel: what they show of the scene needs no attack.
fn of_directions(records: &Obfuscation<3>) -> Option<String> {
    let axis = |&axis: &u8| std::array::from_fn(|c| f32::from(u8::from(c == usize::from(axis))));
    let directions: Vec<[f32; 3]> = match records {
        Obfuscation::Lines(lines) => lines.direction().to_vec(),
        Obfuscation::Rays(rays) => rays.direction().to_vec(),
        Obfuscation::AxisPlanes(planes) => planes.axis().iter().map(axis).collect(),
        Obfuscation::AxisCandidates(_) => return None,
    };
    let mut squares = Matrix3::<f64>::zeros();
    for direction in directions.iter().map(|d| Vector3::from(d.map(f64::from))) {
        squares += direction * direction.transpose();
    }
    let are_parallel = squares.symmetric_eigenvalues().max() > PARALLEL * squares.trace();
    let what = match records.is_bearings() {
        true => "start in one center: whoever stands there sees the scene",
        false if are_parallel => "are nearly parallel: coordinates across them are published",
        false => return None,
    };
    Some(format!("released: all records {what}"))
}

/// Returns a doubt if records pass through points of others.
fn crossings((n, of): (usize, usize)) -> Option<String> {
    let doubt = format!(
        "released: {n} of {of} records pass through the point of another record: where they meet they give points away, which no \
         attack here uses"
    );
    (n as f64 > STRAY * of as f64).then_some(doubt)
}

/// Returns the smallest threshold.
pub fn least(thresholds: &[Threshold]) -> f64 {
    thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min)
}

/// Returns a doubt if 32 bits round records by more than [`NOISE`] of the smallest threshold.
fn rounded(usual: f64, least: f64, unit: Unit) -> Option<String> {
    let by = in_unit(usual, unit);
    let doubt = format!(
        "released: coordinates are so large that 32 bits round them by about {by}: subtract a place in the map from \
         them, and write it as the array origin"
    );
    (usual > NOISE * least).then_some(doubt)
}

/// Returns a doubt about positions by their distances from their own records: the ground truth, or what was `recovered`.
fn strays(recovered: bool, away: &[f64], least: f64, unit: Unit) -> Option<String> {
    let (n, of) = (away.iter().filter(|&&away| away >= least).count(), away.len());
    let (what, where_, it_is) = match recovered {
        true => ("recovered", "where no hidden point is", "they are"),
        false => ("truth", "where no attack can find them", "it is"),
    };
    let least = in_unit(least, unit);
    let doubt = format!(
        "{what}: {n} of {of} points are {least} or more away from their own records, {where_}: check that {it_is} \
         of this map, in its frame, scale and order"
    );
    (n as f64 > STRAY * of as f64).then_some(doubt)
}

/// Returns a doubt if most points are off their own records, all of them by less than the smallest threshold.
fn moved(mut away: Vec<f64>, least: f64, unit: Unit) -> Option<String> {
    let middle = if away.is_empty() { 0.0 } else { median(&mut away) };
    let off = in_unit(middle, unit);
    let doubt = format!(
        "truth: half of the points are {off} or more away from their own records, so attacks miss by that much: check that it is \
         of this map, in its frame and scale"
    );
    (middle > NOISE * least).then_some(doubt)
}

/// Returns a doubt if lengths are not in the unit that a file states.
fn mistaken_unit(unit: Unit, k: usize, middle: f64) -> Option<String> {
    let (is_usual, found) = ((UNIT[0]..=UNIT[1]).contains(&middle), short(middle));
    let doubt = format!(
        "unit: expected a usual distance to the K-th neighbor (K = {k}) of about 1, because the file \
         states lengths in multiples of it, found {found}: thresholds do not have their stated meaning (divide lengths by it, or another --k?)"
    );
    (unit == Unit::KthNeighbor && !is_usual).then_some(doubt)
}

/// Number of other points with which a nearest point is compared.
const OTHERS: usize = 16;

/// Smallest number of points whose figures say something.
pub(super) const FEWEST: f64 = 30.0;

/// Lengths of SIFT descriptors as bytes and as floats, and the largest mean relative deviation from one of them.
const LENGTHS: [f32; 2] = [512.0, 1.0];
const NORMALIZED: f32 = 0.03;

/// Descriptors of fewer values are no features.
const SHORTEST: usize = 8;

/// Returns doubts about descriptors that are too short, or whose rows or columns seem to be in another order. Rows of zeros are left out.
///
/// # Errors
/// If there are no points.
pub fn of_descriptors(
    points: &PointSet<3>,
    descriptors: &Descriptors,
) -> Result<Vec<String>, Error> {
    let told = (0..descriptors.len()).filter(|&row| !descriptors.is_zero(row));
    let told: Vec<usize> = told.collect();
    let positions: Vec<_> = told.iter().map(|&row| points.positions()[row]).collect();
    let (n, mut doubts, mut nearest) = (told.len(), Vec::new(), Vec::new());
    if (n as f64) < FEWEST {
        return Ok(doubts);
    }
    let knn = Knn::new(&positions)?;
    let rows = || (0..n).step_by(n.div_ceil(SAMPLE));
    let n_rows = rows().len() as f64;
    // The share of descriptors, each `by` rows further on, that are more like that of the nearest point than like another one.
    let mut share = |by: usize| {
        let mut alike = 0.0;
        for row in rows() {
            knn.nearest(row, 1, &mut nearest);
            let moved = |row: usize| told[(row + by) % n];
            let like = |other: usize| descriptors.squared_distance(moved(row), moved(other));
            let near = nearest.first().map_or(f32::INFINITY, |near| like(near.1 as usize));
            let others = (1..=OTHERS).map(|at| like((row + 1 + at * (n - 1) / (OTHERS + 1)) % n));
            let more = |other: f32| if near == other { 0.5 } else { f64::from(near < other) };
            alike += others.map(more).sum::<f64>() / (OTHERS as f64 * n_rows);
        }
        alike
    };
    let (as_given, before, after) = (share(0), share(n - 1), share(1));
    // The share of a point deviates by 0.3, so this is three deviations.
    let chance = 0.9 / n_rows.sqrt();
    if as_given < 0.5 + chance || before.max(after) > as_given + 1.5 * chance {
        doubts.push(format!(
            "descriptors: {:.0} % are more like that of the nearest point than like another one, where 50 % are so by \
             chance, and {:.0} % if they move by one row: of another map, or in another order of rows?",
            100.0 * as_given,
            100.0 * before.max(after)
        ));
    }
    if descriptors.dim() < SHORTEST {
        let dim = descriptors.dim();
        doubts.push(format!("descriptors: of length {dim}, too short for features"));
    }
    let length = |row: Vec<f32>| row.iter().map(|x| x * x).sum::<f32>().sqrt();
    let lengths: Vec<f32> = descriptors.rows().map(length).filter(|&length| length > 0.0).collect();
    let mean_off = |to: f32| lengths.iter().map(|x| (x - to).abs()).sum::<f32>() / n as f32;
    let is_sift = DescriptorKind::of(descriptors, "") == Ok(DescriptorKind::Sift)
        && LENGTHS.iter().any(|&length| mean_off(length) < NORMALIZED * length);
    if is_sift && !has_usual_order(descriptors) {
        doubts.push(
            "descriptors: 128 values like SIFT's, but in another order of columns (or of another kind): the best attack, a \
             network for SIFT, finds little; write them as COLMAP does"
                .to_owned(),
        );
    }
    Ok(doubts)
}

/// Formats a length with three digits and its unit, if it has one.
pub fn in_unit(length: f64, unit: Unit) -> String {
    with_sign(&short(length), unit)
}

/// Adds the sign of the unit to a number, if it has one.
pub fn with_sign(text: &str, unit: Unit) -> String {
    match unit {
        Unit::Meter | Unit::Pixel => format!("{text} {}", unit.name()),
        Unit::KthNeighbor => text.to_owned(),
    }
}

/// Checks by geometry that compared data belongs together, whatever the files state. Of data of
/// another map hardly anything is recovered, which would look like protection.
#[derive(Debug, Default)]
pub struct Checked {
    /// The number of positions nearer to their own point than to another one, and the number compared.
    nearer: (usize, usize),
    /// Distances of hidden points from their own records, if the records are given.
    truth: Vec<f64>,
    /// Distances of recovered positions from their own records, if the records are given.
    recovered: Vec<f64>,
}

impl Checked {
    /// Adds a map or an image.
    ///
    /// # Errors
    /// If the truth does not belong to the released data.
    pub fn add<const D: usize>(
        &mut self,
        recovered: &Recovered<D>,
        original: &Original<D>,
        secret: &Secret,
        released: Option<&Released<D>>,
    ) -> Result<(), Error> {
        let (nearer, n) = nearer_to_own(recovered, original, secret, released);
        self.nearer = (self.nearer.0 + nearer, self.nearer.1 + n);
        if let Some(released) = released {
            let truth = Truth { original, released, secret };
            truth.belongs()?;
            self.truth.extend(truth.away_from_own());
            self.recovered.extend(recovered_away(released, recovered));
        }
        Ok(())
    }

    /// Returns the doubts about the figures.
    ///
    /// # Errors
    /// If positions are those of another map.
    pub fn notes(&self, thresholds: &[Threshold], unit: Unit) -> Result<Vec<String>, Error> {
        if are_strangers(self.nearer) {
            let expected = "nearer to their own records or points than to those of others";
            let (nearer, n) = self.nearer;
            let found = format!("{nearer} of {n} (of another map, or in another order of rows)");
            return Err(Error::new("positions", expected, found));
        }
        let least = least(thresholds);
        let truth = strays(false, &self.truth, least, unit);
        let recovered = strays(true, &self.recovered, least, unit);
        Ok(truth.into_iter().chain(recovered).collect())
    }
}

/// Returns twice the distance from the median point within which 90 % of the points lie, so that a few outliers do not count.
pub fn across(points: &[[f64; 3]]) -> f64 {
    if points.is_empty() {
        return 0.0;
    }
    let middle =
        [0, 1, 2].map(|axis| median(&mut points.iter().map(|p| p[axis]).collect::<Vec<_>>()));
    let mut distances: Vec<f64> = points.iter().map(|p| distance(p, &middle)).collect();
    let at = (distances.len() - 1) * 9 / 10;
    2.0 * *distances.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Share of a threshold that noise of records may take. Attacks stay on records, and others may average noise away.
const NOISE: f64 = 0.1;

/// Returns a line about a row whose points are off their records, if that matters within `threshold`; always if it is infinite.
pub fn noise(row: &Row, threshold: f64) -> Option<String> {
    let off = *row.metrics.get(OFF_RECORD)?;
    let (scheme, away) = (&row.scheme, in_unit(off, row.unit));
    let doubt = format!(
        "{scheme}: half of the points are {away} or more off their records, as by noise: attacks here stay on the records, \
         others may average the noise away"
    );
    (!threshold.is_finite() || off > NOISE * threshold).then_some(doubt)
}

/// Returns a doubt if many points of `row` were recovered at the other point of their line.
pub fn exchanged(row: &Row) -> Option<String> {
    let percent = row.metrics.get(EXCHANGED)?;
    Some(format!(
        "{}: {percent:.0} % of the points come back at the other point of their line: its two descriptors are alike, or \
         a given truth's descriptor_row is wrong",
        row.scheme
    ))
}

/// Returns a doubt if the attack of `row` could not use most of the records, as if all lines are parallel.
pub fn unused(row: &Row) -> Option<String> {
    let (n, of) = (row.lost.get(Status::Degenerate.name())?, row.n_points);
    let doubt = format!(
        "{}: {n} of {of} points are lost because their records and those of their neighbors meet nowhere, as parallel lines: another \
         attack may recover them",
        row.scheme
    );
    (2 * n > of).then_some(doubt)
}

/// Formats three digits, with an exponent where there would be many zeros.
pub fn short(length: f64) -> String {
    if (1e-3..1e6).contains(&length) || length == 0.0 {
        let digits = (2 - libm::log10(length.max(1e-3)).floor() as i32).clamp(0, 6) as usize;
        return format!("{length:.digits$}");
    }
    format!("{length:.1e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_three_digits() {
        let texts = [0.0154, 1.5, 85.23, 15_400.0, 3e-300, 7.2e9].map(short);
        assert_eq!(texts, ["0.0154", "1.50", "85.2", "15400", "3.0e-300", "7.2e9"]);
    }
}
