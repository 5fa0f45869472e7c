//! How much of a privacy-preserving ("obfuscated") map comes back?
//!
//! The pipeline, one module per stage, a type per arrow:
//!
//! ```text
//! read ──> obfuscate ──> neighbors ──> recover ──> evaluate ──> report
//! ```

mod about;
pub mod audit;
mod density;
pub mod descriptors;
mod error;
pub mod evaluate;
pub mod geometry;
mod ids;
pub mod neighbors;
pub mod obfuscate;
pub mod points;
pub mod recover;
pub mod released;
pub mod seed;
// Not part of the interface: the loops of `unlift-features` are compiled through it, so that `unsafe` stays here.
#[doc(hidden)]
pub mod simd;
pub mod synthetic;
pub mod truth;

pub use about::{About, Fingerprint, RowOrder};
pub use descriptors::Descriptors;
pub use error::Error;
pub use ids::{OriginalId, RecordId};
pub use points::{PointSet, Unit};
