//! The owner's side: what recovery must never see.
//!
//! Only the owner opens it: the attacker's crate, `unlift-attack`, does not know this one.

mod id;
mod original;
mod secret;

pub use id::OriginalId;
pub use original::Original;
pub use secret::{DropReason, Dropped, Secret};
