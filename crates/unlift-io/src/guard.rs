//! Turns panics of decoders into errors.

use unlift::guard::caught;

/// Runs `step` and returns `None` if it panics, without a message.
///
/// `hdf5-pure` panics for some damaged files.
pub(crate) fn without_panic<T>(step: impl FnOnce() -> T) -> Option<T> {
    caught(step).ok()
}
