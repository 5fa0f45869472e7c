//! Ground truth: originals and secrets, for the owner only. The attacker's crate, `unlift-attack`,
//! does not depend on this one.

mod id;
mod original;
mod secret;

pub use id::OriginalId;
pub use original::Original;
pub use secret::{DropReason, Dropped, Secret};
