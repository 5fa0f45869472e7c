//! Attacks as published, for comparison: nothing of ours is built on them.

pub(crate) mod density;
pub(crate) mod ransac;
