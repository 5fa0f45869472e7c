//! Statistical tests of leaks over many keys: the order of records, slots and list entries, random
//! choices, and the last bits of rounded numbers must not correlate with ground truth.

use std::collections::BTreeMap;

use unlift::evaluate::correlation;

use crate::maps::*;

const KEYS: u64 = 60;
const POINTS: usize = 150;
/// Limit of the mean over all keys in standard deviations. Chance exceeds it in 6 of 10 million cases; there are some hundred statistics.
const MAX_DEVIATIONS: f64 = 5.0;

/// Correlations of released columns with ground truth, over many keys: their sum and number.
#[derive(Default)]
struct Correlations(BTreeMap<String, (f64, f64)>);

impl Correlations {
    /// Adds the correlation of `column` with `truth` in standard deviations.
    fn add(&mut self, what: String, column: &[f64], truth: &[f64]) {
        let deviations = correlation(column, truth) * (truth.len() as f64 - 1.0).sqrt();
        // It is 0 if a column is constant.
        if deviations != 0.0 {
            let (sum, n) = self.0.entry(what).or_default();
            (*sum, *n) = (*sum + deviations, *n + 1.0);
        }
    }

    /// Returns the columns that correlate more than by chance.
    fn leaking(&self) -> Vec<(&str, f64)> {
        let means = self.0.iter().map(|(name, (sum, n))| (&**name, sum / n.sqrt()));
        means.filter(|(_, mean)| mean.abs() > MAX_DEVIATIONS).collect()
    }
}

/// Returns the released values of a record that are random or result from rounding, by name.
fn random_values<const D: usize>(
    scheme: &str,
    records: &Obfuscation<D>,
    at: usize,
) -> Vec<(String, f64)> {
    let last_bit = |x: f32| f64::from(x.to_bits() & 1);
    let bits = |what: &'static str, row: &[f32; D]| -> Vec<(String, f64)> {
        (0..D).map(|c| (format!("last bit of {what} {c}"), last_bit(row[c]))).collect()
    };
    match records {
        Obfuscation::Lines(lines) => {
            [bits("foot", &lines.foot()[at]), bits("direction", &lines.direction()[at])].concat()
        }
        Obfuscation::Rays(rays) => {
            let mut values = bits("direction", &rays.direction()[at]);
            // In other schemes the position decides the center.
            if scheme == "ray" {
                values.push(("center".to_owned(), f64::from(rays.center()[at])));
            }
            values
        }
        Obfuscation::AxisPlanes(planes) => vec![
            ("axis".to_owned(), f64::from(planes.axis()[at])),
            ("last bit of offset".to_owned(), last_bit(planes.offset()[at])),
        ],
        Obfuscation::AxisCandidates(points) => bits("position", &points.position()[at]),
    }
}

fn columns_tell_nothing<const D: usize>(name: &str, scheme: &Entry) {
    let mut correlations = Correlations::default();
    for key in 0..KEYS {
        // Points differ for every key, because last bits depend on the points.
        let points = room::<D>(key, POINTS);
        let hidden = hide(scheme, &points, 1_000 + key);
        let per = hidden.released.slots_per_record();
        // Each record is compared with the original of its first slot.
        let slots: Vec<usize> = (0..hidden.released.n_slots()).step_by(per).collect();
        let original = |slot: usize| f64::from(hidden.secret.hidden()[slot].0);
        let of_slots = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            slots.iter().map(|&slot| of(slot)).collect()
        };
        let mut truths = vec![("row of the file".to_owned(), of_slots(&original))];
        for c in 0..D {
            truths.push((format!("coordinate {c}"), of_slots(&|slot| hidden.local(slot)[c])));
        }
        let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for record in 0..slots.len() {
            let order = ("order of records".to_owned(), record as f64);
            let values = random_values(name, hidden.released.obfuscation(), record);
            for (what, value) in values.into_iter().chain([order]) {
                columns.entry(what).or_default().push(value);
            }
        }
        for (what, column) in &columns {
            for (of, truth) in &truths {
                correlations.add(format!("{what}, {of}"), column, truth);
            }
        }
        if per == 2 {
            // The order of a record's two slots must not depend on the order of its points.
            let first = of_slots(&|slot| (original(slot + 1) - original(slot)).signum());
            let x = |slot: usize| hidden.local(slot)[0];
            let along = of_slots(&|slot| (x(slot) - x(slot + 1)).signum());
            let alternating: Vec<f64> = (0..slots.len()).map(|at| (at % 2) as f64).collect();
            for (what, signs) in [("row", &first), ("x", &along)] {
                let mean = signs.iter().sum::<f64>() / (signs.len() as f64).sqrt();
                correlations.0.insert(format!("order of slots by {what}, key {key}"), (mean, 1.0));
                correlations.add(format!("order of slots by {what}, record"), &alternating, signs);
            }
        }
        let (mut place, mut right, near) = (Vec::new(), Vec::new(), hidden.near(10));
        let lists = near.lists(0.5, &Outliers::Uniform, key).unwrap();
        let true_lists = near.lists(1.0, &Outliers::Uniform, key).unwrap();
        for slot in 0..lists.n_slots() {
            for (at, record) in lists.of(slot).iter().enumerate() {
                place.push(at as f64);
                right.push(f64::from(true_lists.of(slot).contains(record)));
            }
        }
        correlations.add("place in a list, right".to_owned(), &place, &right);
    }
    assert!(correlations.0.len() > 2 * D, "{name}");
    assert!(correlations.leaking().is_empty(), "{name} ({D}D) tells {:?}", correlations.leaking());
}

#[test]
fn released_columns_tell_nothing_of_the_truth() {
    over_schemes!(columns_tell_nothing);
}

/// Rows in the order of the file, and a bit of which one in four depends on the side of its point, must fail the test above.
#[test]
fn what_tells_is_found() {
    let x: Vec<f64> = room::<3>(8, POINTS).iter().map(|p| p[0]).collect();
    let rows: Vec<f64> = (0..POINTS).map(|at| at as f64).collect();
    let bit =
        |at: usize| if at.is_multiple_of(4) { f64::from(x[at] > 3.0) } else { (at / 4 % 2) as f64 };
    let bits: Vec<f64> = (0..POINTS).map(bit).collect();
    let mut correlations = Correlations::default();
    for _ in 0..KEYS {
        correlations.add("bit".to_owned(), &bits, &x);
        correlations.add("order".to_owned(), &rows, &rows);
    }
    assert_eq!(correlations.leaking().len(), 2, "{:?}", correlations.leaking());
}
