//! What a released file gives away besides its records: values that are the points, and orders and columns that follow places.

use super::doubts::{FEWEST, SAMPLE, across, least};
use super::{Alone, Share, Threshold};
use crate::Descriptors;
use crate::evaluate::correlation;
use crate::geometry::knn::Knn;
use crate::geometry::vector::{along, distance, dot, median, sub};
use crate::released::Released;
use crate::truth::{Original, Secret};

/// A column of descriptors follows the places if its correlation with a coordinate is this large. Real maps have 0.36 or less,
/// made-up descriptors that change smoothly up to 0.81.
const FOLLOWS: f64 = 0.9;

/// Rounding of published positions, as a part of the largest coordinate and of the size of the map: that of 32-bit floats.
const ROUNDING: f64 = f32::EPSILON as f64;

/// Points lie at a fixed distance along published vectors if this share does.
const MOST: f64 = 0.5;

/// Measures the attack that takes published values for the points: each of `published` has a position per record. Of a pair, the
/// values are those of its two points in any order. A value that is a point of the map counts, whichever record publishes it. Between
/// two positions that a record publishes, points may also lie at a distance that the scheme fixes.
pub fn read_from_file(
    published: &[Vec<[f64; 3]>],
    original: &Original<3>,
    secret: &Secret,
    thresholds: &[Threshold],
) -> Option<Alone> {
    let slots = secret.slots_per_record();
    let points = original.reveal().positions();
    let point = |slot: usize| &points[secret.hidden()[slot].index()];
    let fixed = match published {
        [from, to] if slots == 1 => at_fixed_distances(from, to, point).to_vec(),
        _ => Vec::new(),
    };
    let columns = published.chunks(if slots == 1 { 1 } else { published.len().max(1) });
    let largest = points.iter().flatten().fold(across(points), |most, x| most.max(x.abs()));
    let least = least(thresholds);
    let rounding = (ROUNDING * largest).min(least);
    let (all, values) = (Knn::new(points).ok(), published.iter().flatten().copied());
    let is_within = |at: [f64; 3], of: &Option<Knn<'_, 3>>, threshold: f64| {
        of.as_ref().and_then(|of| of.nearest_within(at, threshold)).is_some()
    };
    let open: Vec<[f64; 3]> = values.filter(|&value| is_within(value, &all, rounding)).collect();
    let open = Knn::new(&open).ok();
    let within = |columns: &[Vec<[f64; 3]>], threshold: f64| {
        let is_near = |&slot: &usize| {
            columns.iter().any(|rows| distance(&rows[slot / slots], point(slot)) <= threshold)
                || is_within(*point(slot), &open, threshold)
        };
        (0..secret.n_slots()).filter(is_near).count()
    };
    let is_rule = |of: &&[Vec<[f64; 3]>]| within(of, least) as f64 > MOST * secret.n_slots() as f64;
    let columns: Vec<_> = columns.chain(fixed.chunks(1).filter(is_rule)).collect();
    let best = |t: &Threshold| {
        let n = columns.iter().map(|of| within(of, t.value)).max().unwrap_or(0);
        (t.label.clone(), Share::of(n as f64, secret.n_slots() as f64))
    };
    let shares = thresholds.iter().map(best).collect();
    (!published.is_empty()).then_some(Alone { name: "read from the file", shares })
}

/// Returns the places at a fixed multiple of the vector from `from` to `to`, at a fixed distance along it, and at a fixed multiple of its
/// inverse: with the median of the values that lead to each record's point.
fn at_fixed_distances<'a>(
    from: &[[f64; 3]],
    to: &[[f64; 3]],
    point: impl Fn(usize) -> &'a [f64; 3],
) -> [Vec<[f64; 3]>; 3] {
    let vectors: Vec<[f64; 3]> = from.iter().zip(to).map(|(from, to)| sub(to, from)).collect();
    [0, -1, -2].map(|power| {
        let step = |row: usize| {
            let length2 = dot(&vectors[row], &vectors[row]);
            along(&[0.0; 3], libm::pow(length2, 0.5 * f64::from(power)), &vectors[row])
        };
        let multiple = |row: usize| {
            let step = step(row);
            dot(&sub(point(row), &from[row]), &step) / dot(&step, &step)
        };
        let mut multiples: Vec<f64> =
            (0..from.len()).map(multiple).filter(|x| x.is_finite()).collect();
        let usual = if multiples.is_empty() { 0.0 } else { median(&mut multiples) };
        (0..from.len()).map(|row| along(&from[row], usual, &step(row))).collect()
    })
}

/// Returns doubts about released data whose rows or columns follow the places of the points, which no attack uses.
pub fn follows_places(
    original: &Original<3>,
    (released, secret): &(Released<3>, Secret),
) -> Vec<String> {
    let points = original.reveal().positions();
    let point = |slot: usize| &points[secret.hidden()[slot].index()];
    let (n, slots) = (released.n_records(), secret.slots_per_record());
    let record = |at: usize| point(at % n * slots);
    let nearer = |at: &usize| {
        let away = |by: usize| distance(record(*at), record(at + by));
        away(1) < away(n / 2)
    };
    let n_nearer = (0..n).filter(nearer).count();
    // By chance a half; the margin is five standard deviations.
    let is_ordered = n_nearer as f64 > 0.5 * n as f64 + 2.5 * (n as f64).sqrt();
    let order = format!(
        "order of records: in {n_nearer} of {n} cases, the next record is nearer than another one (by chance, in half of \
         them): the order gives places away, and no attack uses it (release records in random order)"
    );
    let columns = released.descriptors().into_iter().flat_map(|rows| columns(rows, secret, points));
    is_ordered.then_some(order).into_iter().chain(columns).collect()
}

/// Returns a doubt about each column of descriptors that follows a coordinate.
fn columns(rows: &Descriptors, secret: &Secret, points: &[[f64; 3]]) -> Vec<String> {
    let slots = (0..secret.n_slots()).step_by(secret.n_slots().div_ceil(SAMPLE).max(1));
    // Few values correlate by chance.
    if (slots.len() as f64) < FEWEST {
        return Vec::new();
    }
    let sample: Vec<u32> = slots.clone().map(|slot| secret.descriptor_row()[slot]).collect();
    let sample: Vec<Vec<f32>> = rows.select(&sample).rows().collect();
    let places: [Vec<f64>; 3] =
        [0, 1, 2].map(|c| slots.clone().map(|s| points[secret.hidden()[s].index()][c]).collect());
    let doubt = |at: usize| {
        let values: Vec<f64> = sample.iter().map(|row| f64::from(row[at])).collect();
        let of = |axis: usize| (axis, correlation(&values, &places[axis]));
        let (axis, r) = (0..3).map(of).find(|(_, r)| r.abs() > FOLLOWS)?;
        Some(format!(
            "descriptors: column {at} (from 0) follows the coordinate {} (correlation {r:.2}), which no attack here reads: \
             leave it out",
            ["x", "y", "z"][axis]
        ))
    };
    (0..rows.dim()).filter_map(doubt).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic;

    #[test]
    fn points_at_a_fixed_distance_along_published_vectors_are_read() {
        let points = synthetic::room(0, 2000).points;
        let [from, towards] =
            [1.0, 0.3].map(|scale| points.iter().map(|p| p.map(|x| x * scale)).collect::<Vec<_>>());
        let to: Vec<[f64; 3]> = from.iter().zip(&towards).map(|(x, v)| along(x, 1.0, v)).collect();
        for (at, power) in [0.0, -1.0, -2.0].into_iter().enumerate() {
            let multiple = |v: &[f64; 3]| 7.0 * dot(v, v).powf(0.5 * power);
            let hidden = from.iter().zip(&towards).map(|(x, v)| along(x, multiple(v), v));
            let hidden: Vec<[f64; 3]> = hidden.collect();
            let read = &at_fixed_distances(&from, &to, |row| &hidden[row])[at];
            assert!(read.iter().zip(&hidden).all(|(a, b)| distance(a, b) < 1e-9), "{power}");
        }
    }
}
