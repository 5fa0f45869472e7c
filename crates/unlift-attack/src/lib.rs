//! The attacker of `unlift`: what is released goes in, positions come out.
//!
//! ```text
//! Released ──Source──> Neighborhoods
//! Released, Neighborhoods ──recover──> Recovered
//! ```
//!
//! The attacker never sees ground truth: this crate has no type that holds it, and depends on no crate that has. Originals,
//! schemes, the oracle, evaluation and audits are in the crate `unlift`, which re-exports all of this one.

mod about;
#[doc(hidden)]
pub mod compiled;
mod density;
pub mod descriptors;
mod error;
pub mod geometry;
mod ids;
mod line;
pub mod neighbors;
pub mod points;
pub mod recover;
pub mod released;
pub mod seed;
// Not part of the interface: the loops of `unlift-features` are compiled through it, so that `unsafe` stays here.
#[doc(hidden)]
pub mod simd;

pub use about::{About, Fingerprint, ListsBy, RowOrder};
pub use descriptors::Descriptors;
pub use error::{Error, ErrorKind};
pub use ids::RecordId;
pub use line::{OneLine, is_obeyed};
pub use points::{PointSet, Unit};
