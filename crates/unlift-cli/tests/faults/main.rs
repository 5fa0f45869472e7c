//! Tests of outputs under faults: kills, full disks, limits, closed streams, changing inputs, two
//! writers.
//!
//! ```text
//! cargo test -p unlift-cli --test faults                                  # a short version
//! UNLIFT_FAULTS=full cargo test -p unlift-cli --test faults -- --nocapture --test-threads 1
//! ```
//!
//! The full version makes hundreds of kills and tries every step of the limits. It prints a table
//! per file.

#![cfg(unix)]

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod commands;
mod kills;
mod limits;
mod tables;
mod tree;
mod vanishing;
mod verdict;
mod writers;

/// Returns true for the full version.
fn full() -> bool {
    std::env::var("UNLIFT_FAULTS").is_ok_and(|value| value == "full")
}
