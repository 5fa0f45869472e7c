//! Neighborhoods: which records are said to hide points near the point of a slot.
//!
//! `oracle` makes them from the originals, for experiments. What an attacker makes from a released map alone is in `unlift_attack::neighbors`
//! and re-exported here.

pub mod oracle;

pub use unlift_attack::neighbors::*;
