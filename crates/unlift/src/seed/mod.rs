//! Random numbers as a function of a seed, and keys for the randomness that hides points.

mod key;

pub use key::{Cipher, Key};
pub use unlift_attack::seed::*;
