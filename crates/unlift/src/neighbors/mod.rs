//! Neighborhoods: which records are said to hide points near the point of a slot.
//!
//! `oracle` makes them from the originals, for experiments. All others take what an attacker has, a
//! released map, and stand in [`sources::SOURCES`].

mod alike;
mod best;
mod compare;
mod geometric;
mod join;
mod neighborhoods;
pub mod oracle;
mod overlap;
mod rows;
mod similarity;
pub mod sources;
mod tiles;
mod walk;

pub use geometric::geometric;
pub(crate) use geometric::geometric_by;
pub use join::join;
pub use neighborhoods::Neighborhoods;
pub use overlap::overlap;
pub use similarity::similarity;
