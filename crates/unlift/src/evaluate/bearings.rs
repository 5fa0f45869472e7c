//! How many decoys among bearings an attacker tells from real ones.

use super::{away_from_own, farthest_for_rounding};
use crate::neighbors::{Neighborhoods, REAL, support};
use crate::released::Released;
use crate::truth::{Original, Secret};

/// Returns figures on bearings from one center, by name; empty for other records.
///
/// `real_bearings_percent` is the share of records that point to their own point. Decoys are told
/// by the support of their lists: records with little support are called decoys. Precision, recall
/// and the area under the curve are those of decoys; the area is 0.5 by chance.
pub fn bearings<const D: usize>(
    released: &Released<D>,
    original: &Original<D>,
    secret: &Secret,
    lists: &Neighborhoods,
) -> Vec<(String, f64)> {
    let Some(support) = support(released, lists) else { return Vec::new() };
    let most = farthest_for_rounding(released, original, secret);
    let decoy: Vec<bool> =
        away_from_own(released, original, secret).into_iter().map(|away| away > most).collect();
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

/// Returns the probability that a random decoy has less support than a random real record; equal
/// ones count half.
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
    use crate::RecordId;
    use crate::obfuscate::{SchemeOptions, obfuscate, olc::Olc, sphere};
    use crate::seed::Key;
    use crate::{PointSet, Unit, synthetic};

    #[test]
    fn areas_count_ties_half() {
        let decoy = [true, true, false, false];
        assert_eq!(area(&[1.0, 2.0, 3.0, 4.0], &decoy), 1.0);
        assert_eq!(area(&[1.0, 1.0, 1.0, 1.0], &decoy), 0.5);
        assert_eq!(area(&[3.0, 4.0, 1.0, 2.0], &decoy), 0.0);
    }

    #[test]
    fn true_neighbors_tell_decoys() {
        let points = PointSet::try_new(synthetic::room(1, 600).points, Unit::Meter).unwrap();
        let original = Original::new(points);
        let lists = |secret: &Secret| {
            let positions = original.reveal().positions();
            let place = |slot: usize| positions[secret.hidden()[slot].index()];
            let n = secret.n_slots();
            let of = |slot: usize| {
                let mut others: Vec<usize> = (0..n).filter(|&other| other != slot).collect();
                let away =
                    |other: usize| crate::geometry::vector::distance(&place(slot), &place(other));
                others.sort_by(|&a, &b| away(a).total_cmp(&away(b)));
                others.into_iter().take(12).map(RecordId::from_index).collect::<Vec<_>>()
            };
            let offsets = (0..=n as u64).map(|slot| 12 * slot).collect();
            Neighborhoods::try_new(offsets, (0..n).flat_map(of).collect(), None, n, 1).unwrap()
        };
        let scheme = (sphere::ENTRY.in_3d.unwrap())(&SchemeOptions::usual(Unit::Meter));
        let (released, secret) = obfuscate(&*scheme, &original, None, &Key::from_seed(0)).unwrap();
        let found = bearings(&released, &original, &secret, &lists(&secret));
        let of = |name: &str| found.iter().find(|(known, _)| known == name).unwrap().1;
        assert!((of("real_bearings_percent") - 100.0 / 3.0).abs() < 0.2);
        // Twelve neighbors among 600 points cover a wider angle than the attack expects.
        assert!(of("decoys_area") > 0.75, "{found:?}");
        assert!(of("decoys_precision_percent") > 80.0, "{found:?}");
        assert!(of("decoys_recall_percent") > 60.0, "{found:?}");
        // Lines are no bearings.
        let (released, secret) = obfuscate(&Olc, &original, None, &Key::from_seed(0)).unwrap();
        assert_eq!(bearings::<3>(&released, &original, &secret, &lists(&secret)), []);
    }
}
