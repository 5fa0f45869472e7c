//! Several sources as one.

use super::Neighborhoods;
use super::best::Best;
use crate::{Error, RecordId};

/// The union of several sources' lists, cut to the `k` best records of each slot.
///
/// Scores of different sources have nothing in common but their order, so each becomes the surprise
/// of its rank over the whole map, `-ln(share of entries that score as high)`: it adds up like
/// evidence, and a record that a source does not list gets 0 from it. Without scores every entry of
/// a source counts alike.
///
/// # Errors
/// When there are no lists, or they are of different maps.
pub fn join(
    lists: &[Neighborhoods],
    k: usize,
    n_records: usize,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    let n_slots = n_records * slots_per_record;
    if let Some(other) = lists.iter().find(|lists| lists.n_slots() != n_slots) {
        let expected = format!("lists of {n_slots} slots");
        return Err(Error::new("joined neighborhoods", expected, other.n_slots().to_string()));
    }
    if lists.is_empty() {
        return Err(Error::new("joined neighborhoods", "at least one source", "none"));
    }
    let surprises: Vec<Vec<f32>> = lists.iter().map(surprises).collect();
    let (mut offsets, mut records, mut scores) = (vec![0u64], Vec::new(), Vec::new());
    let mut union: Vec<(u32, f32)> = Vec::new();
    for slot in 0..n_slots {
        union.clear();
        for (lists, surprises) in lists.iter().zip(&surprises) {
            let start = lists.offsets()[slot] as usize;
            let entries = lists.of(slot).iter().enumerate();
            union.extend(entries.map(|(at, record)| (record.0, surprises[start + at])));
        }
        // Stable: scores of one record are added in the order of the sources.
        union.sort_by_key(|&(record, _)| record);
        let mut best = Best::new(k);
        for same in union.chunk_by(|a, b| a.0 == b.0) {
            best.push(same.iter().map(|&(_, score)| score).sum(), same[0].0);
        }
        for (score, record) in best.into_sorted() {
            records.push(RecordId(record));
            scores.push(score);
        }
        offsets.push(records.len() as u64);
    }
    Neighborhoods::try_new(offsets, records, Some(scores), n_records, slots_per_record)
}

/// Per entry `-ln` of the share of all entries that score as high; equal scores share their ranks.
fn surprises(lists: &Neighborhoods) -> Vec<f32> {
    let n = lists.records().len();
    let Some(scores) = lists.scores() else {
        return vec![std::f32::consts::LN_2; n];
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_unstable_by(|&a, &b| scores[b].total_cmp(&scores[a]).then(a.cmp(&b)));
    let mut surprises = vec![0.0; n];
    let mut above = 0;
    for same in order.chunk_by(|&a, &b| scores[a] == scores[b]) {
        let middle = above as f64 + same.len() as f64 / 2.0;
        let surprise = -libm::log(middle / n as f64) as f32;
        same.iter().for_each(|&at| surprises[at] = surprise);
        above += same.len();
    }
    surprises
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lists(rows: &[&[(u32, f32)]]) -> Neighborhoods {
        let (mut offsets, mut records, mut scores) = (vec![0], Vec::new(), Vec::new());
        for row in rows {
            records.extend(row.iter().map(|&(record, _)| RecordId(record)));
            scores.extend(row.iter().map(|&(_, score)| score));
            offsets.push(records.len() as u64);
        }
        Neighborhoods::try_new(offsets, records, Some(scores), rows.len(), 1).unwrap()
    }

    #[test]
    fn what_two_sources_name_comes_first() {
        let a = lists(&[&[(1, 5.0), (2, 4.0)], &[(3, 1.0)], &[], &[]]);
        let b = lists(&[&[(2, 0.9), (3, 0.1)], &[(0, 0.2)], &[], &[]]);
        let joined = join(&[a, b], 1, 4, 1).unwrap();
        assert_eq!(joined.of(0), &[RecordId(2)]);
        assert_eq!((joined.n_slots(), joined.of(2).len()), (4, 0));
    }

    #[test]
    fn one_source_keeps_its_order() {
        let a = lists(&[&[(1, -5.0), (2, -4.0), (3, -9.0)], &[], &[], &[]]);
        assert_eq!(join(&[a], 2, 4, 1).unwrap().of(0), &[RecordId(1), RecordId(2)]);
    }

    #[test]
    fn lists_of_different_maps_are_refused() {
        let message = join(&[lists(&[&[], &[]]), lists(&[&[]])], 1, 2, 1).unwrap_err().to_string();
        assert_eq!(message, "joined neighborhoods: expected lists of 2 slots, found 1");
    }
}
