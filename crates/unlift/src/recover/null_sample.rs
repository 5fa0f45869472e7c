//! Random records that measure chance.

use super::chunks::CHUNK;
use super::lists::Lists;
use crate::RecordId;
use crate::seed::{Draws, Stage};

/// Null records per sample, shared by the slots of a chunk. More lower the noise of the estimated
/// chance at a proportional cost.
pub(crate) const NULL_RECORDS: usize = 256;

/// The null sample of the chunk that starts at slot `first`, from the marginal of who is listed (an
/// attacker's neighborhoods may list some records far more often than others). `admit` keeps the
/// records that may vote; fewer than [`NULL_RECORDS`] come back only if hardly any is admitted.
pub(crate) fn draw(
    lists: Lists<'_>,
    first: usize,
    seed: u64,
    admit: impl Fn(RecordId) -> bool,
) -> Vec<RecordId> {
    let mut sample = Vec::with_capacity(NULL_RECORDS);
    let listed = lists.entries();
    if listed.is_empty() {
        return sample;
    }
    let mut draws = Draws::new(seed, Stage::NullSample, (first / CHUNK) as u64);
    for _ in 0..NULL_RECORDS * 64 {
        let record = listed[draws.below(listed.len() as u64) as usize];
        if admit(record) {
            sample.push(record);
            if sample.len() == NULL_RECORDS {
                break;
            }
        }
    }
    sample
}
