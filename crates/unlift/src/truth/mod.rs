//! The owner's side: what recovery must never see.
//!
//! Only `obfuscate`, `neighbors::oracle`, `evaluate` and `audit` may import from here; a test
//! (`tests/architecture`) fails the build otherwise.

mod original;
mod secret;

pub use original::Original;
pub use secret::{DropReason, Dropped, Secret};
