//! Which blocks of rows are compared, in an order that holds few of them in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::best::Found;

/// Blocks held at a time where not all pairs are compared.
const HELD: usize = 256;

/// Pairs of blocks, tile by tile.
pub struct Pairs {
    tiles: Vec<Tile>,
}

/// Pairs with a range of blocks, which are held meanwhile.
pub struct Tile {
    /// The blocks that are held.
    pub held: Range<usize>,
    /// Who meets some of them.
    pub meetings: Vec<Meetings>,
}

/// One block and those held blocks that it meets.
pub struct Meetings {
    /// The number of the block.
    pub block: u32,
    /// Held blocks.
    pub with: Vec<u32>,
}

impl Pairs {
    /// Every pair of `n` blocks.
    pub fn all(n: usize) -> Self {
        // From itself downward: threads that take blocks in turn meet different ones at a time.
        let with = |block: u32| (0..=block).rev().collect();
        let meetings = (0..n as u32).rev().map(|block| Meetings { block, with: with(block) });
        Self { tiles: vec![Tile { held: 0..n, meetings: meetings.collect() }] }
    }

    /// The tiles, one after the other.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }
}

/// Every block with itself and with the blocks that it found most alike.
pub fn chosen(alike: &[Found]) -> Pairs {
    let n = alike.len();
    // Per pair, the lower number first.
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
