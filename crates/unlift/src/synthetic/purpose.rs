//! Streams of random numbers, a separate one for each purpose.

use crate::seed::{Draws, Stage};

#[derive(Clone, Copy)]
pub(super) enum Purpose {
    Layout = 0,
    Texture = 1,
    Walk = 2,
    Copies = 3,
    Order = 4,
    FirstPoint = 16,
}

pub(super) fn draws(seed: u64, purpose: Purpose, item: usize) -> Draws {
    Draws::new(seed, Stage::Synthetic, purpose as u64 + item as u64)
}
