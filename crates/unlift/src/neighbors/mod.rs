//! Neighborhoods: for each slot, records that probably hide points near its point.
//!
//! [`oracle`] makes them from ground truth; sources are those of `unlift_attack`.

pub mod oracle;

pub use unlift_attack::neighbors::*;
