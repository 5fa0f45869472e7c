//! Neighborhoods: for each slot, records that probably hide points near its point.
//!
//! `oracle` makes them from ground truth, for experiments. An attacker's sources are re-exported
//! from `unlift_attack::neighbors`.

pub mod oracle;

pub use unlift_attack::neighbors::*;
