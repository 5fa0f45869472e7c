//! The attacker's side of `unlift`: from a released map to recovered positions.
//!
//! ```text
//! Released ──Source──> Neighborhoods
//! Released, Neighborhoods ──recover──> Recovered
//! ```
//!
//! This crate has no type for ground truth and depends on no crate that has one. Originals, schemes, the oracle, evaluation and
//! audits are in the crate `unlift`, which re-exports this one.

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
// Not part of the interface: `unlift-features` compiles its loops through it, so that all `unsafe` stays here.
#[doc(hidden)]
pub mod simd;

pub use about::{About, Fingerprint, ListsBy, RowOrder};
pub use descriptors::Descriptors;
pub use error::{Error, ErrorKind};
pub use ids::RecordId;
pub use line::{OneLine, is_obeyed};
pub use points::{PointSet, Unit};
