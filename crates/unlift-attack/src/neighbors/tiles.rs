//! The pairs of blocks that are compared, in an order that keeps few blocks in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::best::Found;

/// Blocks in memory at a time if only some pairs are compared.
const HELD: usize = 256;

/// Pairs of blocks, grouped in tiles.
pub struct Pairs {
    tiles: Vec<Tile>,
}

/// Pairs with a range of blocks, which stay in memory meanwhile.
pub struct Tile {
    /// The blocks in memory.
    pub held: Range<usize>,
    /// The blocks that are compared with them.
    pub meetings: Vec<Meetings>,
}

/// One block and the held blocks that it is compared with.
pub struct Meetings {
    /// Index of the block.
    pub block: u32,
    /// Held blocks.
    pub with: Vec<u32>,
}

impl Pairs {
    /// Returns all pairs of `n` blocks.
    pub fn all(n: usize) -> Self {
        // Each list starts with the block itself and descends, so that parallel threads work on different blocks.
        let with = |block: u32| (0..=block).rev().collect();
        let meetings = (0..n as u32).rev().map(|block| Meetings { block, with: with(block) });
        Self { tiles: vec![Tile { held: 0..n, meetings: meetings.collect() }] }
    }

    /// The tiles, in order.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }
}

/// Returns the pairs of every block with itself and with the most similar blocks.
pub fn chosen(alike: &[Found]) -> Pairs {
    let n = alike.len();
    // Each pair is stored under its lower index.
    let mut pairs: Vec<BTreeSet<u32>> =
        (0..n as u32).map(|block| BTreeSet::from([block])).collect();
    for (block, found) in alike.iter().enumerate() {
        for &(_, other) in &found.best {
            let other = other as usize;
            pairs[block.min(other)].insert(block.max(other) as u32);
        }
    }
    let tiles = (0..n).step_by(HELD).map(|first| {
        let held = first..(first + HELD).min(n);
        let mut meetings: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for a in held.clone() {
            for &b in &pairs[a] {
                meetings.entry(b).or_default().push(a as u32);
            }
        }
        let meetings = meetings.into_iter().map(|(block, with)| Meetings { block, with }).collect();
        Tile { held, meetings }
    });
    Pairs { tiles: tiles.collect() }
}
