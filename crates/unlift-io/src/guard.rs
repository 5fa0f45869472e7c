//! Turns panics of decoders into errors.

use unlift::guard::caught;

/// Runs `step` and returns `None` if it panics, without a message.
///
/// `parquet` 59.3 still panics for some damaged pages and footers. `hdf5-pure` is guarded, too.
pub(crate) fn without_panic<T>(step: impl FnOnce() -> T) -> Option<T> {
    caught(step).ok()
}
