//! What recovery hands out: plain data that no step of recovery needs to know more about.

pub(crate) mod estimate;
pub(crate) mod probability;
pub(crate) mod recovered;
pub(crate) mod trials;
pub(crate) mod unknown;
