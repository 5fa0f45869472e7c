//! Turns panics of third-party code into errors.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs `step` without printing its panic. Other panics are reported as usual.
///
/// # Errors
/// The message of the panic.
pub fn caught<T>(step: impl FnOnce() -> T) -> Result<T, String> {
    static QUIET: Once = Once::new();
    // The hook is global: setting and restoring it for each call would affect other threads.
    QUIET.call_once(|| {
        let report = take_hook();
        set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                report(panic);
            }
        }));
    });
    let outer = GUARDED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(step));
    GUARDED.set(outer);
    result.map_err(|panic| told(&*panic))
}

/// Returns the message of a panic.
pub fn told(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()))
        .unwrap_or_else(|| "a panic".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_what_it_says_and_guards_nest() {
        assert_eq!(caught(|| 1), Ok(1));
        let nested = caught(|| {
            assert_eq!(caught(|| panic!("decoder")), Err::<(), _>("decoder".to_owned()));
            assert!(GUARDED.get());
        });
        assert_eq!(nested, Ok(()));
        assert!(!GUARDED.get());
    }
}
