//! What a released file gives away beyond its records: values that are the points, the order of its rows, and columns of
//! descriptors.

use unlift::Descriptors;
use unlift::audit::{Alone, Share, Threshold};
use unlift::evaluate::correlation;
use unlift::geometry::vector::distance;
use unlift::released::Released;
use unlift::truth::{Original, Secret};

/// Number of rows of descriptors to check.
const SAMPLE: usize = 2000;
/// A column of descriptors follows the places if its correlation with a coordinate is this large. Real maps have 0.36 or less.
const FOLLOWS: f64 = 0.6;

/// Measures the attack that takes published values for the points: each of `published` has a position per record. Of a pair, the
/// values are those of its two points in any order.
pub fn read_from_file(
    published: &[Vec<[f64; 3]>],
    original: &Original<3>,
    secret: &Secret,
    thresholds: &[Threshold],
) -> Option<Alone> {
    let slots = secret.slots_per_record();
    let point = |slot: usize| &original.reveal().positions()[secret.hidden()[slot].index()];
    let columns: Vec<&[Vec<[f64; 3]>]> =
        if slots == 1 { published.chunks(1).collect() } else { vec![published] };
    let within = |columns: &[Vec<[f64; 3]>], threshold: f64| {
        let is_near = |&slot: &usize| {
            columns.iter().any(|rows| distance(&rows[slot / slots], point(slot)) <= threshold)
        };
        (0..secret.n_slots()).filter(is_near).count()
    };
    let best = |t: &Threshold| {
        let n = columns.iter().map(|of| within(of, t.value)).max().unwrap_or(0);
        (t.label.clone(), Share::of(n as f64, secret.n_slots() as f64))
    };
    let shares = thresholds.iter().map(best).collect();
    (!published.is_empty()).then_some(Alone { name: "read from the file", shares })
}

/// Returns doubts about released data whose rows or columns follow the places of the points, which no attack uses.
pub(crate) fn follows_places(
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
    let order = is_ordered.then(|| {
        format!(
            "order of records: after {n_nearer} of {n} comes one nearer by than another, where half are so by chance: the order \
             gives places away, and no attack uses it (release records in random order)"
        )
    });
    let columns = released.descriptors().into_iter().flat_map(|rows| columns(rows, secret, points));
    order.into_iter().chain(columns).collect()
}

/// Returns a doubt about each column of descriptors that follows a coordinate.
fn columns(rows: &Descriptors, secret: &Secret, points: &[[f64; 3]]) -> Vec<String> {
    let slots = (0..secret.n_slots()).step_by(secret.n_slots().div_ceil(SAMPLE).max(1));
    let (mut values, mut row) = (vec![Vec::new(); rows.dim()], vec![0.0; rows.dim()]);
    for slot in slots.clone() {
        rows.read_row(secret.descriptor_row()[slot] as usize, &mut row);
        values.iter_mut().zip(&row).for_each(|(column, &value)| column.push(f64::from(value)));
    }
    let places: [Vec<f64>; 3] =
        [0, 1, 2].map(|c| slots.clone().map(|s| points[secret.hidden()[s].index()][c]).collect());
    let follows =
        |column: &Vec<f64>| places.iter().any(|axis| correlation(column, axis).abs() > FOLLOWS);
    let doubt = |at: usize| {
        format!(
            "descriptors: column {at} follows a coordinate, and no attack uses it: leave it out"
        )
    };
    (0..values.len()).filter(|&at| follows(&values[at])).map(doubt).collect()
}
