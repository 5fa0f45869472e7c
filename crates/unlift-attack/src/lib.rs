//! The attacker's side of `unlift`: from a released map to recovered positions.
//!
//! ```text
//! Released ──Source──> Neighborhoods
//! Released, Neighborhoods ──recover──> Recovered
//! ```
//!
//! Six lines through one point, and an attacker who knows that they are neighbors:
//!
//! ```
//! use unlift_attack::neighbors::Neighborhoods;
//! use unlift_attack::recover::{Builtin, Delta, RecoverOptions, recover};
//! use unlift_attack::released::{Lines, Obfuscation, Released};
//! use unlift_attack::{Error, RecordId, Unit};
//!
//! let directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [0.0, 0.6, 0.8], [0.8, 0.0, 0.6]];
//! let lines = Lines::through(&[[1.0, 2.0, 3.0]; 6], &directions)?;
//! let released = Released::try_new(Obfuscation::Lines(lines), 1, [0.0; 3], Unit::Meter, None)?;
//!
//! // Every line lists all others.
//! let others = |own: usize| (0..6).filter(move |&line| line != own).map(RecordId::from_index);
//! let lists = Neighborhoods::try_new(vec![0, 5, 10, 15, 20, 25, 30], (0..6).flat_map(others).collect(), None, 6, 1)?;
//!
//! let options = RecoverOptions { delta: Delta::Fixed(0.01), ..RecoverOptions::default() };
//! let recovered = recover(&released, &lists, &Builtin::Consensus, &options)?;
//! let [x, y, z] = recovered.position(0).expect("a position");
//! assert!((x - 1.0).abs() < 1e-3 && (y - 2.0).abs() < 1e-3 && (z - 3.0).abs() < 1e-3);
//! # Ok::<(), Error>(())
//! ```
//!
//! This crate has no type for ground truth and depends on no crate that has one. Originals, schemes, the oracle, evaluation and
//! audits are in the crate `unlift`, which re-exports this one.

mod about;
pub mod again;
#[doc(hidden)]
pub mod compiled;
mod density;
pub mod descriptors;
mod error;
pub mod geometry;
mod named;
pub mod neighbors;
// Not part of the interface: the other crates run their loops through it.
#[doc(hidden)]
pub mod parallel;
pub mod points;
pub mod protected;
pub mod recover;
pub mod released;
pub mod seed;
pub mod sequence;
// Not part of the interface: `unlift-vision` compiles its loops through it, so that all `unsafe` stays here.
#[doc(hidden)]
pub mod simd;

pub use about::{About, Fingerprint, RowOrder};
pub use descriptors::Descriptors;
pub use error::{Error, ErrorKind, OneLine, is_obeyed};
pub use points::{PointSet, RecordId, Unit};
pub use protected::ProtectedDescriptors;
