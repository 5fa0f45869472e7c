//! Translation of an owner's lists from points to the records of one obfuscation.

use super::nearness::record_of_originals;
use crate::neighbors::Neighborhoods;
use crate::truth::Secret;
use crate::{About, Error, RecordId, RowOrder};

/// Translates neighbors given by original row to the records of one obfuscation. Omits dropped
/// points, the slot's own record and repeats.
///
/// # Errors
/// When the lists do not have one row per original, or contain an original out of range.
pub fn from_points(
    offsets: &[u64],
    neighbors: &[u32],
    scores: Option<&[f32]>,
    secret: &Secret,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    let n = secret.n_originals();
    if offsets.len() != n + 1 {
        let found = offsets.len().saturating_sub(1).to_string();
        return Err(Error::new("neighbors by point", format!("{n} rows, one per point"), found));
    }
    if let Some(at) = neighbors.iter().position(|&id| id as usize >= n) {
        let what = format!("neighbor entry {at}");
        return Err(Error::new(what, format!("points below {n}"), neighbors[at].to_string()));
    }
    let ascending = offsets[0] == 0 && offsets.windows(2).all(|w| w[0] <= w[1]);
    if !ascending || offsets[n] != neighbors.len() as u64 {
        let expected = format!("ascending from 0 to {}", neighbors.len());
        return Err(Error::new("offsets of neighbors by point", expected, "another sequence"));
    }
    if let Some(scores) = scores
        && scores.len() != neighbors.len()
    {
        let expected = format!("{} rows", neighbors.len());
        return Err(Error::new("scores of neighbors by point", expected, scores.len().to_string()));
    }
    let record_of = record_of_originals(secret, slots_per_record);
    let mut rows = vec![0u64];
    let mut records = Vec::new();
    let mut kept_scores = scores.map(|_| Vec::new());
    for (slot, original) in secret.hidden().iter().enumerate() {
        let own = RecordId::from_index(slot / slots_per_record);
        let start = records.len();
        for at in offsets[original.index()] as usize..offsets[original.index() + 1] as usize {
            if let Some(record) = record_of[neighbors[at] as usize]
                && record != own
                && !records[start..].contains(&record)
            {
                records.push(record);
                if let (Some(kept), Some(scores)) = (&mut kept_scores, scores) {
                    kept.push(scores[at]);
                }
            }
        }
        rows.push(records.len() as u64);
    }
    let n_records = secret.n_slots() / slots_per_record;
    let lists = Neighborhoods::try_new(rows, records, kept_scores, n_records, slots_per_record)?;
    Ok(lists.with_about(About { map: secret.map(), order: RowOrder::Slots, ..About::default() }))
}
