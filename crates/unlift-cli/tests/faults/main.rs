//! What becomes of outputs when the world fails: kills, full disks, limits, closed streams, inputs that go away, two
//! writers.
//!
//! ```text
//! cargo test -p unlift-cli --test faults                                  # a short version
//! UNLIFT_FAULTS=full cargo test -p unlift-cli --test faults -- --nocapture --test-threads 1
//! ```
//!
//! The second one takes hundreds of kills and every step of the limits, and prints a table for each file here.

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

/// Whether everything is wanted, not only what every run of the tests has time for.
fn full() -> bool {
    std::env::var("UNLIFT_FAULTS").is_ok_and(|value| value == "full")
}
