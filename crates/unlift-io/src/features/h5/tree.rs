//! Writes the names of a group: a heap, and a tree that finds them.
//!
//! Source: HDF5 File Format Specification 3.0, III.A, III.B and III.D. Every reader supports this
//! old form of groups.

use super::messages::{UNDEFINED, pad};

/// Half of the names in a leaf, and half of the children of a node, as in the HDF5 library.
pub(super) const LEAF: u16 = 4;
pub(super) const NODE: u16 = 16;

/// A name, the address of its object header, and for a group those of its tree and heap.
pub(super) struct Entry<'a> {
    pub name: &'a str,
    pub header: u64,
    pub group: Option<[u64; 2]>,
}

impl Entry<'_> {
    /// Returns the 40 bytes of an entry whose name is at `name_at` of the heap.
    pub fn bytes(&self, name_at: u64) -> Vec<u8> {
        let mut bytes = [name_at.to_le_bytes(), self.header.to_le_bytes()].concat();
        bytes.extend(u32::from(self.group.is_some()).to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend(self.group.unwrap_or_default().iter().flat_map(|at| at.to_le_bytes()));
        bytes
    }
}

/// Returns the bytes of heap and tree for sorted `entries`, to be written at `start`, and the
/// addresses of tree and heap.
pub(super) fn names(entries: &[Entry<'_>], start: u64) -> (Vec<u8>, [u64; 2]) {
    // The first name is empty: it is the lower bound of the first leaf.
    let mut heap = vec![0; 8];
    let mut offsets = Vec::with_capacity(entries.len());
    for entry in entries {
        offsets.push(heap.len() as u64);
        heap.extend(entry.name.as_bytes());
        heap.push(0);
        pad(&mut heap);
    }
    let mut bytes = b"HEAP\0\0\0\0".to_vec();
    bytes.extend((heap.len() as u64).to_le_bytes());
    // No free block.
    bytes.extend(1u64.to_le_bytes());
    bytes.extend((start + 32).to_le_bytes());
    bytes.extend(heap);

    // Leaves, then levels of nodes up to a single root. A child is its address and its last name.
    let mut children: Vec<(u64, u64)> = Vec::new();
    let leaves = entries.chunks(2 * usize::from(LEAF)).zip(offsets.chunks(2 * usize::from(LEAF)));
    for (entries, offsets) in leaves {
        children.push((start + bytes.len() as u64, offsets[offsets.len() - 1]));
        let mut leaf = b"SNOD\x01\0".to_vec();
        leaf.extend((entries.len() as u16).to_le_bytes());
        leaf.extend(entries.iter().zip(offsets).flat_map(|(entry, &at)| entry.bytes(at)));
        leaf.resize(8 + 2 * usize::from(LEAF) * 40, 0);
        bytes.extend(leaf);
    }
    let mut level = 0;
    loop {
        let first = start + bytes.len() as u64;
        let mut parents = Vec::new();
        let mut lower = 0;
        // A group without names still has one node.
        let groups: Vec<&[(u64, u64)]> = match children.len() {
            0 => vec![&[]],
            _ => children.chunks(2 * usize::from(NODE)).collect(),
        };
        for (at, group) in groups.iter().enumerate() {
            let address = |at: usize| first + (at * NODE_BYTES) as u64;
            let left = if at == 0 { UNDEFINED } else { address(at - 1) };
            let right = if at + 1 == groups.len() { UNDEFINED } else { address(at + 1) };
            bytes.extend(node(level, group, lower, [left, right]));
            lower = group.last().map_or(0, |&(_, last)| last);
            parents.push((address(at), lower));
        }
        if let [(root, _)] = parents[..] {
            return (bytes, [root, start]);
        }
        (children, level) = (parents, level + 1);
    }
}

const NODE_BYTES: usize = 24 + (4 * NODE as usize + 1) * 8;

pub(super) fn node(level: u8, children: &[(u64, u64)], lower: u64, siblings: [u64; 2]) -> Vec<u8> {
    let mut bytes = b"TREE\0".to_vec();
    bytes.push(level);
    bytes.extend((children.len() as u16).to_le_bytes());
    bytes.extend(siblings.iter().flat_map(|at| at.to_le_bytes()));
    bytes.extend(lower.to_le_bytes());
    for &(address, last) in children {
        bytes.extend(address.to_le_bytes());
        bytes.extend(last.to_le_bytes());
    }
    bytes.resize(NODE_BYTES, 0);
    bytes
}
