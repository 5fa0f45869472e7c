//! What the randomness of one of many comes from: its name, so that its rows do not depend on the others.

use crate::seed::{Draws, Key, Stage};

/// The key that the image `name` is hidden under, of a set whose key is `key`.
pub fn key_of(key: &Key, name: &str) -> Key {
    key.of_item(Stage::Image, hash(name))
}

/// The integer that the oracle of the image `name` draws from, in a run with `seed`.
pub fn oracle_seed(seed: u64, name: &str) -> u64 {
    Draws::new(seed, Stage::Image, hash(name)).bits()
}

/// FNV-1a, 64 bits.
fn hash(name: &str) -> u64 {
    let step = |h: u64, byte: u8| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
    name.bytes().fold(0xCBF2_9CE4_8422_2325, step)
}
