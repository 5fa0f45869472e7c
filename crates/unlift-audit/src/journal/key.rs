//! The key of a recovery in a journal.

use unlift::audit::Recovery;
use unlift::recover::Delta;
use unlift_io::hash::Hasher;

pub(super) fn key(program: &str, recovery: &Recovery<'_, 3>) -> String {
    let Recovery { released, lists, solver, options } = recovery;
    let mut hasher = Hasher::default();
    hasher.add(program.as_bytes());
    hasher.add(&[0]);
    hasher.add(&released.fingerprint().0);
    let about = lists.about();
    hasher.add(format!("{:?} {:?} {}\n", about.order, about.lists_by, lists.n_slots()).as_bytes());
    for offset in lists.offsets() {
        hasher.add(&offset.to_le_bytes());
    }
    for record in lists.records() {
        hasher.add(&record.0.to_le_bytes());
    }
    for score in lists.scores().unwrap_or_default() {
        hasher.add(&score.to_le_bytes());
    }
    let delta = if let Delta::Fixed(delta) = options.delta { delta } else { 0.0 };
    hasher.add(solver.name().as_bytes());
    hasher.add(&[0, u8::from(options.confidence)]);
    hasher.add(&delta.to_le_bytes());
    hasher.add(&options.seed.to_le_bytes());
    hasher.hex()
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::neighbors::Neighborhoods;
    use unlift::recover::{Builtin, RecoverOptions};
    use unlift::released::{AxisPlanes, Obfuscation, Released};
    use unlift::{RecordId, Unit};

    const N: usize = 9;

    /// Each record lists the next two; the first one lists `first`.
    fn records(first: u32) -> Vec<RecordId> {
        let after = |slot: usize| [1, 2].map(|more| RecordId(((slot + more) % N) as u32));
        let mut records: Vec<RecordId> = (0..N).flat_map(after).collect();
        records[0] = RecordId(first);
        records
    }

    fn lists(first: u32, scores: Option<f32>) -> Neighborhoods {
        let offsets = (0..=N as u64).map(|slot| 2 * slot).collect();
        let scores = scores
            .map(|last| (0..2 * N).map(|at| if at == 2 * N - 1 { last } else { 1.0 }).collect());
        Neighborhoods::try_new(offsets, records(first), scores, N, 1).unwrap()
    }

    #[test]
    fn a_key_tells_every_entry() {
        let planes = AxisPlanes::<3>::try_new(vec![0; N], &[0.5; N]).unwrap();
        let obfuscation = Obfuscation::AxisPlanes(planes);
        let released = Released::try_new(obfuscation, 1, [0.0; 3], Unit::Meter, None).unwrap();
        let usual = RecoverOptions::default();
        let of = |lists: &Neighborhoods, options: &RecoverOptions| {
            key(
                "program",
                &Recovery { released: &released, lists, solver: &Builtin::Joint, options },
            )
        };
        let mut keys = Vec::new();
        for (first, scores) in [(1, None), (3, None), (1, Some(1.0)), (1, Some(2.0))] {
            keys.push(of(&lists(first, scores), &usual));
        }
        let lists = lists(1, None);
        keys.push(of(&lists, &RecoverOptions { seed: 1, ..usual }));
        keys.push(of(&lists, &RecoverOptions { delta: Delta::Fixed(0.5), ..usual }));
        keys.push(of(&lists, &RecoverOptions { confidence: false, ..usual }));
        let n = keys.len();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), n, "two recoveries have one key");
    }
}
