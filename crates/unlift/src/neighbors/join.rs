//! Several sources as one.

use super::Neighborhoods;
use super::best::Best;
use crate::{About, Error, RecordId, RowOrder};

/// The union of several sources' lists, cut to the `k` best records of each slot.
///
/// Scores of different sources have nothing in common but their order, so each becomes the surprise
/// of its rank over the whole map, `-ln(share of entries that score as high)`: it adds up like
/// evidence, and a record that a source does not list gets 0 from it. Without scores every entry of
/// a source counts alike.
///
/// Lists that `only_ranks` add to the scores of what others list, and name nothing themselves (unless
/// all do).
///
/// # Errors
/// When there are no lists, or they are of different maps.
pub fn join(
    lists: &[Neighborhoods],
    only_ranks: &[bool],
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
    let about = about(lists)?;
    let surprises: Vec<Vec<f32>> = lists.iter().map(surprises).collect();
    let (mut offsets, mut records, mut scores) = (vec![0u64], Vec::new(), Vec::new());
    let names = only_ranks.iter().any(|ranks| !ranks);
    let mut union: Vec<(u32, f32, bool)> = Vec::new();
    for slot in 0..n_slots {
        union.clear();
        for (source, (lists, surprises)) in lists.iter().zip(&surprises).enumerate() {
            let ranks = names && only_ranks.get(source).copied().unwrap_or(false);
            let start = lists.offsets()[slot] as usize;
            let entries = lists.of(slot).iter().enumerate();
            union.extend(entries.map(|(at, record)| (record.0, surprises[start + at], ranks)));
        }
        // Stable: scores of one record are added in the order of the sources.
        union.sort_by_key(|&(record, ..)| record);
        let mut best = Best::new(k);
        for same in union.chunk_by(|a, b| a.0 == b.0) {
            if same.iter().any(|&(_, _, ranks)| !ranks) {
                best.push(same.iter().map(|&(_, score, _)| score).sum(), same[0].0);
            }
        }
        for (score, record) in best.into_sorted() {
            records.push(RecordId(record));
            scores.push(score);
        }
        offsets.push(records.len() as u64);
    }
    let joined =
        Neighborhoods::try_new(offsets, records, Some(scores), n_records, slots_per_record)?;
    Ok(joined.with_about(about))
}

/// What the union of `lists` is about. Rows are counted as by those that know how: descriptors tell the two points
/// of a paired line apart, records alone do not.
fn about(lists: &[Neighborhoods]) -> Result<About, Error> {
    let mut union = lists[0].about();
    for lists in &lists[1..] {
        let About { map, order } = lists.about();
        if let Some(of) = union.map {
            of.expect(map)?;
        }
        union.map = union.map.or(map);
        if order != union.order {
            let knows = [union.order, order].contains(&RowOrder::DescriptorRows);
            union.order = if knows { RowOrder::DescriptorRows } else { RowOrder::Unstated };
        }
    }
    Ok(union)
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
        let joined = join(&[a, b], &[false; 2], 1, 4, 1).unwrap();
        assert_eq!(joined.of(0), &[RecordId(2)]);
        assert_eq!((joined.n_slots(), joined.of(2).len()), (4, 0));
    }

    #[test]
    fn a_source_that_only_ranks_names_nothing() {
        let names = lists(&[&[(1, 5.0), (2, 5.0)], &[], &[], &[]]);
        let ranks = lists(&[&[(2, 1.0), (3, 9.0)], &[(0, 1.0)], &[], &[]]);
        let joined = join(&[names.clone(), ranks.clone()], &[false, true], 9, 4, 1).unwrap();
        assert_eq!(joined.of(0), &[RecordId(1), RecordId(2)]);
        let scores = joined.scores_of(0).unwrap();
        assert!(scores[1] > scores[0] && joined.of(1).is_empty());
        // Alone it must name.
        assert_eq!(join(&[ranks], &[true], 9, 4, 1).unwrap().of(1), &[RecordId(0)]);
    }

    #[test]
    fn one_source_keeps_its_order() {
        let a = lists(&[&[(1, -5.0), (2, -4.0), (3, -9.0)], &[], &[], &[]]);
        assert_eq!(join(&[a], &[false], 2, 4, 1).unwrap().of(0), &[RecordId(1), RecordId(2)]);
    }

    #[test]
    fn lists_of_different_maps_are_refused() {
        let message = join(&[lists(&[&[], &[]]), lists(&[&[]])], &[false; 2], 1, 2, 1)
            .unwrap_err()
            .to_string();
        assert_eq!(message, "joined neighborhoods: expected lists of 2 slots, found 1");
    }
}
