//! Plausibility checks: does data without a fingerprint belong to this map?

use crate::Error;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{along, distance, dot, median, sub, widen};
use crate::neighbors::{Neighborhoods, REAL, support};
use crate::recover::Recovered;
use crate::released::{Obfuscation, Released};
use crate::truth::{Original, Secret};
use unlift_attack::parallel;

/// Counts the recovered positions that are nearer to their own record than to another one, half a
/// map away. Returns this count and the number of compared positions. Without the released map,
/// distances to the records' true points are compared.
///
/// About half of the positions pass if they are of another map or in another order; of an attack, even on records alone, clearly more do.
pub fn nearer_to_own<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
    released: Option<&Released<D>>,
) -> (usize, usize) {
    let n = recovered.n_slots().min(secret.n_slots());
    let positions = (0..n).map(|slot| recovered.position(slot));
    if let Some(released) = released {
        return nearer_to_own_record(released, by_record(released, positions));
    }
    let points = original.reveal().positions();
    let slots = secret.slots_per_record();
    let n_records = secret.n_slots() / slots;
    let away = |record: usize, position: &[f64; D]| {
        let hidden = &secret.hidden()[record * slots..(record + 1) * slots];
        let away = hidden.iter().map(|id| distance(position, &points[id.index()]));
        away.fold(f64::INFINITY, f64::min)
    };
    let positions = positions.enumerate();
    let positions = positions.filter_map(|(slot, position)| Some((slot / slots, position?)));
    count_nearer(positions, n_records, away, |_, _| 0.0)
}

/// Minimum number of slots for a decision.
const FEW: usize = 30;

/// Returns true if the share of nearer ones is not above chance.
pub fn are_strangers((nearer, n): (usize, usize)) -> bool {
    // Chance is one half; the margin is two standard deviations.
    n >= FEW && nearer as f64 <= 0.5 * n as f64 + (n as f64).sqrt()
}

/// Counts the places that are nearer to their own record than to one half a map away, and all places.
/// `away` is the distance of a record from a place. Points at the same place have equal distances up to `rounding`.
fn count_nearer<const D: usize>(
    places: impl Iterator<Item = (usize, [f64; D])>,
    n_records: usize,
    away: impl Fn(usize, &[f64; D]) -> f64,
    rounding: impl Fn(usize, &[f64; D]) -> f64,
) -> (usize, usize) {
    places.fold((0, 0), |(nearer, n), (own, place)| {
        let far = (own + n_records.div_ceil(2)) % n_records;
        let is_nearer = away(own, &place) <= away(far, &place) + rounding(own, &place);
        (nearer + usize::from(is_nearer), n + 1)
    })
}

/// Returns the record and the place of each slot with a position, relative to the released origin.
fn by_record<const D: usize>(
    released: &Released<D>,
    positions: impl Iterator<Item = Option<[f64; D]>>,
) -> impl Iterator<Item = (usize, [f64; D])> {
    let (slots, origin) = (released.slots_per_record(), released.origin());
    let positions = positions.take(released.n_slots()).enumerate();
    positions.filter_map(move |(slot, position)| Some((slot / slots, sub(&position?, &origin))))
}

fn nearer_to_own_record<const D: usize>(
    released: &Released<D>,
    places: impl Iterator<Item = (usize, [f64; D])>,
) -> (usize, usize) {
    let records = released.obfuscation();
    let away = |record: usize, place: &[f64; D]| distance_to_record(records, record, place);
    count_nearer(places, records.len(), away, |own, place| rounding(records, own, place))
}

/// Returns the distances of recovered positions to their own records, almost 0 in the right order.
pub fn recovered_away<const D: usize>(
    released: &Released<D>,
    recovered: &Recovered<D>,
) -> Vec<f64> {
    let positions = (0..recovered.n_slots()).map(|slot| recovered.position(slot));
    let places = by_record(released, positions);
    places.map(|(own, place)| distance_to_record(released.obfuscation(), own, &place)).collect()
}

/// Bounds are rounded by this share of their sides, and this share of the points may be outside, as at the border of an image.
const BOUNDS_SLACK: f64 = 1e-3;
const MAX_OUTSIDE: f64 = 0.01;
/// Share of points nearer to their own records than to others, so that records clearly belong to the points.
const CLEARLY: f64 = 0.75;
/// The metric of rows whose points are off their records as by [`Truth::is_noise`]: their median distance, in the unit of the map.
pub const OFF_RECORD: &str = "off_record";

/// A released map with its ground truth.
#[derive(Clone, Copy, Debug)]
pub struct Truth<'a, const D: usize> {
    /// True points.
    pub original: &'a Original<D>,
    /// Released map.
    pub released: &'a Released<D>,
    /// Secret of the released map.
    pub secret: &'a Secret,
}

impl<const D: usize> Truth<'_, D> {
    /// Checks that ground truth and released map belong together: unit, number of points, fingerprint,
    /// and positions of the points. With the wrong ground truth, a map would wrongly look safe.
    ///
    /// # Errors
    /// When the three do not belong together.
    pub fn belongs(&self) -> Result<(), Error> {
        let Self { original, released, secret } = self;
        let (unit, released_unit) = (original.reveal().unit(), released.unit());
        if unit != released_unit {
            let expected = format!("{}, the unit of the originals", unit.name());
            return Err(Error::new("unit of the released map", expected, released_unit.name()));
        }
        for (what, expected, number) in [
            ("originals", secret.n_originals(), original.len()),
            ("hidden points", secret.n_slots(), released.n_slots()),
            ("hidden points per record", secret.slots_per_record(), released.slots_per_record()),
        ] {
            Error::check_len(what, number, expected, ", as in the secret")?;
        }
        released.fingerprint().expect(secret.map())?;
        let (nearer, n) = nearer_to_own_record(released, self.places());
        if are_strangers((nearer, n)) {
            let expected = "points nearer to their own records than to others";
            let causes = "the truth of another map, unit, frame or order of slots";
            return Err(Error::new("truth", expected, format!("{nearer} of {n} ({causes})")));
        }
        if let Some(Bounds { low, high }) = released.bounds() {
            let slack = sub(&high, &low).map(|side| BOUNDS_SLACK * side);
            let bounds = Bounds { low: sub(&low, &slack), high: along(&high, 1.0, &slack) };
            let outside = self.points().filter(|point| !bounds.contains(point)).count();
            if outside as f64 > MAX_OUTSIDE * n as f64 {
                let count = format!("{outside} of {n} outside");
                return Err(Error::new("bounds", "a box of all hidden points", count));
            }
        }
        Ok(())
    }

    /// Returns the hidden point of each slot.
    fn points(&self) -> impl Iterator<Item = [f64; D]> {
        let points = self.original.reveal().positions();
        self.secret.hidden().iter().map(|id| points[id.index()])
    }

    fn places(&self) -> impl Iterator<Item = (usize, [f64; D])> {
        by_record(self.released, self.points().map(Some))
    }

    /// Returns the distance of every hidden point to its own record: almost 0, up to the noise of a
    /// scheme. A point farther away than a threshold cannot be recovered within it.
    pub fn away_from_own(&self) -> Vec<f64> {
        let records = self.released.obfuscation();
        self.places().map(|(own, place)| distance_to_record(records, own, &place)).collect()
    }

    /// Returns the largest distance of a hidden point to its own record that `f32` explains.
    pub fn farthest_for_rounding(&self) -> f64 {
        let records = self.released.obfuscation();
        self.places().map(|(own, place)| rounding(records, own, &place)).fold(0.0, f64::max)
    }

    /// Returns the median rounding of records by `f32`, large if coordinates are.
    pub fn usual_rounding(&self) -> f64 {
        let records = self.released.obfuscation();
        let own = self.places().map(|(own, place)| rounding(records, own, &place) / ROUNDINGS);
        median_or_zero(own.collect())
    }

    /// Returns how many lines or rays pass exactly through the point of another record, and how many were examined. Where such records
    /// meet, they give points away. Other families meet other points by chance, and decoys meet all in one.
    pub fn through_others(&self) -> (usize, usize) {
        let (records, slots) = (self.released.obfuscation(), self.released.slots_per_record());
        let is_line = matches!(records, Obfuscation::Lines(_) | Obfuscation::Rays(_));
        if !is_line || records.is_bearings() {
            return (0, 0);
        }
        let places: Vec<_> = self.places().collect();
        let every = records.len().div_ceil(EXAMINED).max(1);
        let examined: Vec<usize> = (0..records.len()).step_by(every).collect();
        let meets = |at: usize| {
            let own = examined[at];
            let mut taken: Vec<[f64; D]> =
                places[own * slots..][..slots].iter().map(|of| of.1).collect();
            let of_own = taken.iter().map(|x| rounding(records, own, x)).fold(0.0, f64::max);
            // A point may lie on the center of all rays.
            if let Obfuscation::Rays(rays) = records {
                taken.push(widen(&rays.centers()[usize::from(rays.center()[own])]));
            }
            places.iter().any(|&(other, point)| {
                let limit = rounding(records, own, &point).max(of_own);
                let is_on = other != own && distance_to_record(records, own, &point) <= limit;
                is_on && taken.iter().all(|x| distance(&point, x) > APART * limit)
            })
        };
        let met = parallel::map(examined.len(), meets);
        (met.into_iter().filter(|&meets| meets).count(), examined.len())
    }

    /// Returns whether most hidden points are off their records as by a scheme's noise: in directions
    /// that do not depend on the place, as those of a wrong scale, frame or order do.
    pub fn is_noise(&self) -> bool {
        if median_or_zero(self.away_from_own()) <= ROUNDINGS * self.usual_rounding() {
            return false;
        }
        let records = self.released.obfuscation();
        let (nearer, n) = nearer_to_own_record(self.released, self.places());
        let off = |(own, place)| (place, sub(&place, &on_record(records, own, &place)));
        let (points, off): (Vec<[f64; D]>, Vec<[f64; D]>) = self.places().map(off).unzip();
        let column = |of: &[[f64; D]], c: usize| -> Vec<f64> { of.iter().map(|x| x[c]).collect() };
        // Five deviations of a correlation by chance; of few points less.
        let limit = (5.0 / (n.max(1) as f64).sqrt()).min(0.3);
        let is_free = |c: usize| {
            let own = column(&off, c);
            let (sum, squares) = own.iter().fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
            let are_alike = sum * sum > limit * limit * squares * n as f64;
            let is_unrelated = |axis| correlation(&own, &column(&points, axis)).abs() <= limit;
            !are_alike && (0..D).all(is_unrelated)
        };
        nearer as f64 >= CLEARLY * n as f64 && (0..D).all(is_free)
    }

    /// Returns the metric [`OFF_RECORD`] of a row, if rounding does not explain it.
    pub(crate) fn off_record(&self) -> Option<(String, f64)> {
        let is_noise = !self.released.obfuscation().is_bearings() && self.is_noise();
        is_noise.then(|| (OFF_RECORD.to_owned(), median_or_zero(self.away_from_own())))
    }

    /// Returns figures on bearings from one center, by name; empty for other records.
    ///
    /// `real_bearings_percent` is the share of records that point to their own point. Decoys are told
    /// by the support of their lists: records with little support are called decoys. Precision, recall
    /// and the area under the curve are those of decoys; the area is 0.5 by chance.
    pub fn bearings(&self, lists: &Neighborhoods) -> Vec<(String, f64)> {
        let Some(support) = support(self.released, lists) else { return Vec::new() };
        let limit = self.farthest_for_rounding();
        let decoy: Vec<bool> = self.away_from_own().into_iter().map(|away| away > limit).collect();
        let n_decoys = decoy.iter().filter(|decoy| **decoy).count();
        let n_real = decoy.len() - n_decoys;
        let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
        let mut figures = vec![("real_bearings_percent", percent(n_real, decoy.len()))];
        if n_decoys > 0 && n_real > 0 {
            let called = || support.iter().zip(&decoy).filter(|(support, _)| **support < REAL);
            let right = called().filter(|(_, decoy)| **decoy).count();
            figures.push(("decoys_precision_percent", percent(right, called().count())));
            figures.push(("decoys_recall_percent", percent(right, n_decoys)));
            figures.push(("decoys_area", area(&support, &decoy)));
        }
        figures.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

fn median_or_zero(mut values: Vec<f64>) -> f64 {
    if values.is_empty() { 0.0 } else { median(&mut values) }
}

/// Number of records of which [`Truth::through_others`] examines whether they meet other points.
const EXAMINED: usize = 500;

/// Points nearer to each other than this many roundings are at one place.
const APART: f64 = 100.0;

/// Distances up to this many roundings are explained by rounding.
const ROUNDINGS: f64 = 8.0;

/// Returns the distance between a point and its record that rounding to `f32` explains.
fn rounding<const D: usize>(records: &Obfuscation<D>, record: usize, point: &[f64; D]) -> f64 {
    let held = match records {
        Obfuscation::Lines(_) | Obfuscation::AxisPlanes(_) => [0.0; D],
        Obfuscation::Rays(rays) => rays.centers()[usize::from(rays.center()[record])],
        Obfuscation::AxisCandidates(candidates) => candidates.position()[record],
    };
    let size = |v: &[f64; D]| dot(v, v).sqrt();
    ROUNDINGS * f64::from(f32::EPSILON) * (size(point) + size(&widen(&held)))
}

/// Returns the place of a record that is nearest to `point`, relative to the released origin.
pub(super) fn on_record<const D: usize>(
    records: &Obfuscation<D>,
    record: usize,
    point: &[f64; D],
) -> [f64; D] {
    let on_line = |from: &[f32; D], direction: &[f32; D], least: f64| {
        let (from, direction) = (widen(from), widen(direction));
        along(&from, dot(&sub(point, &from), &direction).max(least), &direction)
    };
    match records {
        Obfuscation::Lines(lines) => {
            on_line(&lines.foot()[record], &lines.direction()[record], f64::NEG_INFINITY)
        }
        Obfuscation::Rays(rays) => {
            let center = &rays.centers()[usize::from(rays.center()[record])];
            on_line(center, &rays.direction()[record], 0.0)
        }
        Obfuscation::AxisPlanes(planes) => {
            let (axis, mut place) = (usize::from(planes.axis()[record]), *point);
            place[axis] = f64::from(planes.offset()[record]);
            place
        }
        Obfuscation::AxisCandidates(candidates) => {
            let of_axis = |axis: usize| {
                let mut place = widen(&candidates.position()[record]);
                place[axis] = point[axis];
                place
            };
            let nearer =
                |a: &[f64; D], b: &[f64; D]| distance(point, a).total_cmp(&distance(point, b));
            (0..D).map(of_axis).min_by(nearer).expect("an axis")
        }
    }
}

/// Returns the distance of `point`, relative to the released origin, to the feasible set of `record`.
pub fn distance_to_record<const D: usize>(
    records: &Obfuscation<D>,
    record: usize,
    point: &[f64; D],
) -> f64 {
    distance(point, &on_record(records, record, point))
}

/// Returns Pearson's correlation of two columns; 0 if one is constant.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
    let off = |of: &[f64], mean: f64| -> Vec<f64> { of.iter().map(|x| x - mean).collect() };
    let sum = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let (a, b) = (off(a, mean(a)), off(b, mean(b)));
    let spread = (sum(&a, &a) * sum(&b, &b)).sqrt();
    if spread > 0.0 { sum(&a, &b) / spread } else { 0.0 }
}

/// Returns the probability that a decoy has less support than a real record; equals count half.
fn area(support: &[f64], decoy: &[bool]) -> f64 {
    let mut order: Vec<usize> = (0..support.len()).collect();
    order.sort_by(|&a, &b| support[a].total_cmp(&support[b]));
    let (mut below, mut sum, mut n) = (0.0, 0.0, [0.0; 2]);
    for tied in order.chunk_by(|&a, &b| support[a] == support[b]) {
        let decoys = tied.iter().filter(|&&at| decoy[at]).count() as f64;
        let real = tied.len() as f64 - decoys;
        sum += real * (below + decoys / 2.0);
        below += decoys;
        n = [n[0] + decoys, n[1] + real];
    }
    sum / (n[0] * n[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_count_ties_half() {
        for (scores, expected) in [([1, 2, 3, 4], 1.0), ([1, 1, 1, 1], 0.5), ([3, 4, 1, 2], 0.0)] {
            assert_eq!(area(&scores.map(f64::from), &[true, true, false, false]), expected);
        }
    }
}
