//! Property tests for schemes, sources of neighborhoods and solvers of your own crate.
//!
//! ```
//! use unlift::obfuscate::olc;
//!
//! // In `#[test] fn laws() { .. }`, with your scheme:
//! unlift_testkit::scheme_laws::<3>(&olc::ENTRY);
//! ```
//!
//! A test that fails panics with one line: the property, the points and the values.

mod laws;
mod maps;

pub use laws::{scheme_laws, solver_laws, source_laws};
pub use maps::{described_map, hide, piles, room, uniform};

/// Runs `work` on `threads` threads.
///
/// # Panics
/// When the system gives no threads.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
}
