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
