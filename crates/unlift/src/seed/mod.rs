//! Randomness as a function, and the key of everything that hides a point.

mod key;

pub use key::{Cipher, Key};
pub use unlift_attack::seed::*;
