//! Random numbers as a function of a seed, and keys for the randomness that hides points: 256 bits, and streams of a cipher.
//!
//! **Why a cipher.** Part of a scheme's draws is released with the map: a line of `olc` is three
//! draws, axis and partners of `cp` are two. A generator whose state follows from its output would
//! reveal the order of the records, and with it neighbors, which are often adjacent in the file. No
//! attack on ChaCha20 distinguishes its output from random bits with less than 2^256 trials.
//!
//! **Why separate streams.** A stage's key is output of the cipher under the main key, and an
//! item's stream is numbered by the item. So published draws (`Scheme`) do not reveal the order of
//! records (`Shuffle`), slots or descriptors.
//!
//! **Limits.** A key from an integer is only as safe as the integer is hard to guess: each guess
//! can be checked with one block. Use [`Key::from_seed`] for experiments and [`Key::fresh`] for a map that is released.

use chacha20::ChaCha20Rng;
use chacha20::rand_core::{Rng, SeedableRng};

use crate::Error;

pub use unlift_attack::seed::*;

/// A 256-bit key for all random numbers that hide a map. It is secret and not printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; 32]);

/// Prefix of keys made from an integer. A fresh key has it with probability 2^-192.
const FROM_SEED: &[u8; 24] = b"unlift: an integer seed.";

impl Key {
    /// Creates a key from the randomness of the operating system, for maps that are released.
    ///
    /// # Errors
    /// When the system provides no random bytes.
    pub fn fresh() -> Result<Self, Error> {
        let mut key = [0; 32];
        getrandom::fill(&mut key).map_err(|error| {
            Error::new("key", "256 random bits from the operating system", error.to_string())
        })?;
        Ok(Self(key))
    }

    /// Creates the key of a repeatable experiment. It is as easy to guess as the integer.
    pub fn from_seed(seed: u64) -> Self {
        let mut key = [0; 32];
        key[..24].copy_from_slice(FROM_SEED);
        key[24..].copy_from_slice(&seed.to_le_bytes());
        Self(key)
    }

    /// Returns the key of one `item` of `stage`, such as one image. It reveals no other key.
    pub fn of_item(&self, stage: Stage, item: u64) -> Self {
        Self(first_bytes(&self.stage(stage).0, item))
    }

    /// Returns the random stream of `item` in `stage`; [`stage`](Self::stage) is faster for many.
    pub fn draws(&self, stage: Stage, item: u64) -> Draws<Cipher> {
        self.stage(stage).draws(item)
    }

    /// Returns the key of a stage, for the streams of its items.
    pub fn stage(&self, stage: Stage) -> StageKey {
        StageKey(first_bytes(&self.0, stage as u64))
    }
}

/// Hides the key, so that it is not logged.
impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Key(..)")
    }
}

/// The key of one stage. Streams of items are computed on demand.
pub struct StageKey([u8; 32]);

impl StageKey {
    /// Returns the random stream of `item`.
    pub fn draws(&self, item: u64) -> Draws<Cipher> {
        Draws::of(Cipher(stream(&self.0, item)))
    }
}

/// Random bits from ChaCha20.
#[derive(Debug)]
pub struct Cipher(ChaCha20Rng);

impl Bits for Cipher {
    #[inline]
    fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }
}

fn stream(key: &[u8; 32], number: u64) -> ChaCha20Rng {
    let mut stream = ChaCha20Rng::from_seed(*key);
    stream.set_stream(number);
    stream
}

fn first_bytes(key: &[u8; 32], number: u64) -> [u8; 32] {
    let mut bytes = [0; 32];
    stream(key, number).fill_bytes(&mut bytes);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[rustfmt::skip] // One row per line.
    fn bits_are_pinned() {
        // A change here changes every published figure. The values come from an independent
        // ChaCha20 in Python after the RFC: stage key = first half block of (key, stage), then (stage key, item).
        let [zero, seven] = [0, 7].map(Key::from_seed);
        let image = seven.of_item(Stage::Image, 1 << 40);
        for (key, stage, item, [first, second, below, unit]) in [
            (&zero, Stage::Scheme, 0, [0xc449d82d52b1ee6d, 0xef6b294ef0e03d7a, 277, 0x3fe86b613406ebe6]),
            (&seven, Stage::SlotOrder, 42, [0x01c54f6c3e1024ac, 0x3d757401d663bba4, 910, 0x3fd95d0a8f48ff4e]),
            (&image, Stage::Scheme, 3, [0x32fbce5d3c631358, 0x870945d5248d60d9, 724, 0x3fe20ea632582814]),
        ] {
            let mut draws = key.draws(stage, item);
            assert_eq!([draws.bits(), draws.bits()], [first, second]);
            assert_eq!([draws.below(1000), draws.unit().to_bits()], [below, unit]);
        }
        assert_eq!(zero.draws(Stage::Shuffle, 0).permutation(8), [5, 1, 6, 2, 3, 0, 7, 4]);
    }

    #[test]
    fn keys_stages_and_items_have_streams_of_their_own() {
        let mut seen = std::collections::BTreeSet::new();
        let keys = [Key::from_seed(0), Key::from_seed(1), Key::from_seed(1 << 63)];
        for key in keys.iter().flat_map(|key| [key.clone(), key.of_item(Stage::Image, 0)]) {
            for stage in [Stage::Scheme, Stage::Shuffle, Stage::SlotOrder, Stage::DescriptorOrder] {
                for item in [0, 1, u64::MAX] {
                    assert!(seen.insert(key.draws(stage, item).bits()));
                }
            }
        }
    }

    #[test]
    fn fresh_keys_differ_and_are_not_printed() {
        let [a, b] = [(); 2].map(|()| Key::fresh().unwrap());
        assert!(a != b && a.0 != [0; 32]);
        assert_eq!(format!("{a:?}"), "Key(..)");
    }
}
