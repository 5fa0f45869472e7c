//! Damaged data must be an error, whatever the decoder makes of it.

use unlift::guard::caught;

/// Runs `step`; `None` when it panics, which is then silent.
///
/// The `parquet` crate checks what it reads, but not all of it: with single bytes of a page or the
/// footer changed, a handful of its assertions still fail (59.3). `hdf5-pure` is held to the same.
pub(crate) fn without_panic<T>(step: impl FnOnce() -> T) -> Option<T> {
    caught(step).ok()
}
