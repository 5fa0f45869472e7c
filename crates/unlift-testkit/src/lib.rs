//! Property tests for schemes, sources of neighborhoods and solvers. Call them in the tests of your
//! crate.
//!
//! ```
//! use unlift::obfuscate::olc::Olc;
//!
//! // In `#[test] fn laws() { .. }`, with your scheme:
//! unlift_testkit::scheme_laws::<3>(&Olc);
//! ```
//!
//! A test that fails panics with one line: the property, the points and the values.

mod points;
mod schemes;
mod solvers;
mod sources;

pub use points::{distance_to_record, dot, norm, piles, room, uniform};
pub use schemes::scheme_laws;
pub use solvers::solver_laws;
pub use sources::{described_map, source_laws};
