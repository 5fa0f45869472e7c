//! Property tests for schemes, sources of neighborhoods and solvers. Call them in the tests of your
//! crate.
//!
//! ```
//! use unlift::obfuscate::olc;
//!
//! // In `#[test] fn laws() { .. }`, with your scheme:
//! unlift_testkit::scheme_laws::<3>(&olc::ENTRY);
//! ```
//!
//! A test that fails panics with one line: the property, the points and the values.

mod points;
mod schemes;
mod solvers;
mod sources;

pub use points::{piles, room, uniform};
pub use schemes::{hide, scheme_laws};
pub use solvers::solver_laws;
pub use sources::{described_map, source_laws};

/// Runs `work` on `threads` threads.
///
/// # Panics
/// When the system gives no threads.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
}

/// Panics if `name` is not one plain word.
fn check_name(name: &str) {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-+_.".contains(c);
    assert!(!name.is_empty() && name.chars().all(is_plain), "{name:?} is not a plain name");
}
