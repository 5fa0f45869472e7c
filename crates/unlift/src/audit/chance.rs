//! Random seeds of one item of an audit. They depend on its name, so its rows do not depend on
//! other items.

use crate::seed::{Draws, Key, Stage};

/// Returns the key of the image `name` in a set with the key `key`.
pub fn key_of(key: &Key, name: &str) -> Key {
    key.of_item(Stage::Image, hash(name))
}

/// Returns the oracle's seed for the image `name` in a run with `seed`.
pub fn oracle_seed(seed: u64, name: &str) -> u64 {
    Draws::new(seed, Stage::Image, hash(name)).bits()
}

/// Hashes `name` with 64-bit FNV-1a.
fn hash(name: &str) -> u64 {
    let step = |h: u64, byte: u8| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
    name.bytes().fold(0xCBF2_9CE4_8422_2325, step)
}
