//! What tells a recovery from all others.

use unlift::audit::Recovery;
use unlift::recover::Delta;
use unlift_io::hash::Hasher;

/// A hash of all that `recovery` by `program` follows from: the same whether its lists are in memory or not.
///
/// # Errors
/// When lists cannot be read, which are not in memory.
pub(super) fn key(program: &str, recovery: &Recovery<'_, 3>) -> Result<String, unlift::Error> {
    let Recovery { released, lists, options } = recovery;
    let mut hasher = Hasher::default();
    hasher.add(program.as_bytes());
    hasher.add(&[0]);
    hasher.add(&released.fingerprint().0);
    let about = lists.about();
    hasher.add(format!("{:?} {:?} {}\n", about.order, about.lists_by, lists.n_slots()).as_bytes());
    for offset in lists.offsets() {
        hasher.add(&offset.to_le_bytes());
    }
    let windows = lists.windows();
    for window in &windows {
        for record in &*lists.records(window)? {
            hasher.add(&record.0.to_le_bytes());
        }
    }
    for window in &windows {
        for score in lists.scores(window)?.as_deref().unwrap_or_default() {
            hasher.add(&score.to_le_bytes());
        }
    }
    let delta = if let Delta::Fixed(delta) = options.delta { delta } else { 0.0 };
    hasher.add(options.solver.name().as_bytes());
    hasher.add(&[0, u8::from(options.exact_constraints), u8::from(options.confidence)]);
    hasher.add(&delta.to_le_bytes());
    hasher.add(&options.seed.to_le_bytes());
    Ok(hasher.hex())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;
    use std::io;
    use unlift::neighbors::{Listing, Neighborhoods, ShelvedLists};
    use unlift::recover::RecoverOptions;
    use unlift::released::{AxisPlanes, Obfuscation, Released};
    use unlift::{RecordId, Shelf, Unit};

    /// Windows of some lists.
    #[derive(Debug)]
    struct Small;

    impl Shelf for Small {
        fn file(&self) -> io::Result<File> {
            tempfile::tempfile()
        }

        fn place(&self) -> String {
            "tests".to_owned()
        }

        fn window(&self) -> usize {
            20
        }
    }

    const N: usize = 9;

    /// Each lists the two after it, the first one `first`.
    fn records(first: u32) -> Vec<RecordId> {
        let after = |slot: usize| [1, 2].map(|more| RecordId(((slot + more) % N) as u32));
        let mut records: Vec<RecordId> = (0..N).flat_map(after).collect();
        records[0] = RecordId(first);
        records
    }

    fn here(first: u32, scores: Option<f32>) -> Listing {
        let offsets = (0..=N as u64).map(|slot| 2 * slot).collect();
        let scores = scores
            .map(|last| (0..2 * N).map(|at| if at == 2 * N - 1 { last } else { 1.0 }).collect());
        Listing::Here(Neighborhoods::try_new(offsets, records(first), scores, N, 1).unwrap())
    }

    fn away(first: u32, scores: Option<f32>) -> Listing {
        let mut lists = ShelvedLists::new((N, 1), scores.is_some(), &Small).unwrap();
        let Listing::Here(all) = here(first, scores) else { unreachable!() };
        let scores = all.scores().map(<[f32]>::to_vec);
        lists.push(vec![2; N], all.records().to_vec(), scores).unwrap();
        Listing::Away(lists.finish(all.about()).unwrap())
    }

    #[test]
    fn a_key_tells_every_entry_wherever_lists_are() {
        let planes = AxisPlanes::<3>::try_new(vec![0; N], &[0.5; N]).unwrap();
        let obfuscation = Obfuscation::AxisPlanes(planes);
        let released = Released::try_new(obfuscation, 1, [0.0; 3], Unit::Meter, None).unwrap();
        let usual = RecoverOptions::default();
        let of = |lists: &Listing, options: &RecoverOptions| {
            key("program", &Recovery { released: &released, lists, options }).unwrap()
        };
        assert!(away(1, None).windows().len() > 2, "more than one window");
        let mut keys = Vec::new();
        for (first, scores) in [(1, None), (3, None), (1, Some(1.0)), (1, Some(2.0))] {
            let found = of(&here(first, scores), &usual);
            assert_eq!(of(&away(first, scores), &usual), found, "{first}, {scores:?}");
            keys.push(found);
        }
        let lists = here(1, None);
        keys.push(of(&lists, &RecoverOptions { seed: 1, ..usual }));
        keys.push(of(&lists, &RecoverOptions { delta: Delta::Fixed(0.5), ..usual }));
        keys.push(of(&lists, &RecoverOptions { exact_constraints: false, ..usual }));
        keys.push(of(&lists, &RecoverOptions { confidence: false, ..usual }));
        let n = keys.len();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), n, "two recoveries have one key");
    }
}
