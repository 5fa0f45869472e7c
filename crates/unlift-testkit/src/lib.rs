//! Laws that every scheme, every source of neighborhoods and every solver keeps: call them in the test of yours.
//!
//! ```
//! use unlift::obfuscate::olc::Olc;
//!
//! // In `#[test] fn laws() { .. }`, with your scheme in place of this one.
//! unlift_testkit::scheme_laws::<3>(&Olc);
//! ```
//!
//! A law that is broken panics with a line that says which, on which points, and what was found.

mod points;
mod schemes;
mod solvers;
mod sources;

pub use points::{distance_to_record, dot, norm, piles, room, uniform};
pub use schemes::scheme_laws;
pub use solvers::solver_laws;
pub use sources::{described_map, source_laws};
