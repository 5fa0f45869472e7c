//! Published attacks, for comparison.

pub(super) mod density;
pub(super) mod ransac;
