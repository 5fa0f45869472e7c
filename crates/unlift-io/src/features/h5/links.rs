//! Finds links by path in a group, which the HDF5 library skips, or fails on.
//!
//! Source: HDF5 File Format Specification 3.0, IV.A (object headers), IV.A.2.g (the link message),
//! and III.A to III.D (groups of the old form). Links of large groups, in a separate heap, are not
//! searched.

#[derive(Debug, PartialEq)]
pub(super) enum Target {
    /// A path in the file.
    Path(String),
    /// A path in the file. The link is in a group of the old form, which the library cannot list.
    Old(String),
    Elsewhere,
}

const LINK: u16 = 0x06;
const SYMBOL_TABLE: u16 = 0x11;
const CONTINUATION: u16 = 0x10;
/// The maximum number of header bytes that are searched.
const MOST: u64 = 1 << 20;

/// Returns names and targets of the links by path in the object header at `address`. `read(offset,
/// length)` returns bytes of the file.
pub(super) fn links(
    read: impl Fn(u64, u64) -> Option<Vec<u8>>,
    address: u64,
) -> Option<Vec<(String, Target)>> {
    let start = read(address, 16)?;
    let is_new = start.starts_with(b"OHDR");
    // A flag states that messages have numbers.
    let (first, numbers) = if is_new {
        let flags = start[5];
        let before =
            6 + if flags & 0x20 != 0 { 16 } else { 0 } + if flags & 0x10 != 0 { 4 } else { 0 };
        let width = 1u64 << (flags & 3);
        let size = number(&read(address + before, width)?);
        ((address + before + width, size), flags & 4 != 0)
    } else {
        ((address + 16, number(&start[8..12])), false)
    };
    let (mut blocks, mut left, mut found) = (vec![first], MOST, Vec::new());
    while let Some((at, size)) = blocks.pop() {
        left = left.checked_sub(size)?;
        let block = read(at, size)?;
        let mut rest = &block[..];
        let head = if is_new { 4 + if numbers { 2 } else { 0 } } else { 8 };
        while let Some((start, behind)) = rest.split_at_checked(head) {
            let kind = if is_new { u16::from(start[0]) } else { number(&start[..2]) as u16 };
            let size = number(if is_new { &start[1..3] } else { &start[2..4] });
            let Some((body, next)) = behind.split_at_checked(size as usize) else { break };
            rest = next;
            match kind {
                LINK => found.extend(link(body)),
                SYMBOL_TABLE if body.len() >= 16 => {
                    found.extend(old_links(&read, number(&body[..8]), number(&body[8..16]))?);
                }
                CONTINUATION if body.len() >= 16 => {
                    let (at, size) = (number(&body[..8]), number(&body[8..16]));
                    // The block is between a signature and a checksum.
                    blocks.push(if is_new { (at + 4, size.checked_sub(8)?) } else { (at, size) });
                }
                _ => {}
            }
        }
    }
    Some(found)
}

/// Parses a link message, if it is a path.
fn link(body: &[u8]) -> Option<(String, Target)> {
    let flags = *body.get(1)?;
    let kind = if flags & 8 != 0 { *body.get(2)? } else { 0 };
    let mut at = 2 + usize::from(flags & 8 != 0);
    at += if flags & 4 != 0 { 8 } else { 0 } + usize::from(flags & 0x10 != 0);
    let mut take = |n: usize| {
        let part = body.get(at..at.checked_add(n)?)?;
        at += n;
        Some(part)
    };
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let n = number(take(1 << (flags & 3))?) as usize;
    let name = text(take(n)?);
    match kind {
        1 => {
            let n = number(take(2)?) as usize;
            Some((name, Target::Path(text(take(n)?))))
        }
        64 => Some((name, Target::Elsewhere)),
        _ => None,
    }
}

/// Returns the links of a group of the old form with its tree and heap at these addresses.
fn old_links(
    read: &impl Fn(u64, u64) -> Option<Vec<u8>>,
    tree: u64,
    heap: u64,
) -> Option<Vec<(String, Target)>> {
    let names = number(&read(heap.checked_add(24)?, 8)?);
    let text = |at: u64| {
        let (mut at, mut text) = (names.checked_add(at)?, Vec::new());
        // Names are padded to multiples of eight bytes.
        while !text.contains(&0) && text.len() as u64 <= MOST {
            text.extend(read(at, 8)?);
            at = at.checked_add(8)?;
        }
        let name = text.split(|&byte| byte == 0).next()?;
        Some(String::from_utf8_lossy(name).into_owned())
    };
    let (mut waiting, mut found) = (vec![tree], Vec::new());
    while let Some(at) = waiting.pop() {
        let head = read(at, 8)?;
        let n = number(&head[6..]);
        for child in 0..n {
            if head.starts_with(b"TREE") {
                waiting.push(number(&read(at.checked_add(32 + 16 * child)?, 8)?));
            } else if head.starts_with(b"SNOD") {
                let entry = read(at.checked_add(8 + 40 * child)?, 40)?;
                // An entry of this kind has no object: its target is a text in the heap.
                if number(&entry[16..20]) == 2 {
                    let target = text(number(&entry[24..28]))?;
                    found.push((text(number(&entry[..8]))?, Target::Old(target)));
                }
            }
        }
    }
    Some(found)
}

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}
