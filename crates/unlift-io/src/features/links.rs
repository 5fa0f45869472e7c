//! Links in the groups of HDF5 files, which the library skips or fails on.

use hdf5_pure::Source;

/// The maximum depth of groups, because links may form cycles.
pub(super) const MAX_DEPTH: usize = 64;

/// Where a link of a group leads.
pub(super) enum Target {
    /// The address of an object.
    Object(u64),
    /// A path in the file.
    Path(String),
    /// A path in the file, in a group of the old form, which the library cannot list.
    Unlistable(String),
    Elsewhere,
}

/// Returns names and targets of the links of the group whose object header is at `address`. The
/// library skips links by path, or fails on them. Large groups, which list their links in a separate heap, have none here.
///
/// Source: HDF5 File Format Specification 3.0, IV.A (object headers), IV.A.2.g (the link message),
/// and III.A to III.D (groups of the old form).
pub(super) fn links(file: &impl Source, address: u64) -> Option<Vec<(String, Target)>> {
    const LINK: u64 = 0x06;
    const CONTINUATION: u64 = 0x10;
    const SYMBOL_TABLE: u64 = 0x11;
    let read = |at: u64, n: u64| file.read_exact_at(at, usize::try_from(n).ok()?).ok();
    let start = read(address, 16)?;
    let is_new = start.starts_with(b"OHDR");
    // The first block, and bytes of the type of a message and of all before its body.
    let (first, kind, head) = if is_new {
        let flags = start[5];
        let times = if flags & 0x20 != 0 { 16 } else { 0 };
        let before = 6 + times + if flags & 0x10 != 0 { 4 } else { 0 };
        let width = 1 << (flags & 3);
        let first = (address + before + width, number(&read(address + before, width)?));
        // A flag states that messages have numbers.
        (first, 1, if flags & 4 != 0 { 6 } else { 4 })
    } else {
        ((address + 16, number(&start[8..12])), 2, 8)
    };
    let (mut blocks, mut at, mut links) = (vec![first], 0, Vec::new());
    while let Some(&(start, size)) = blocks.get(at) {
        let block = read(start, size)?;
        let mut rest = &block[..];
        while let Some((message, behind)) = rest.split_at_checked(head) {
            let size = number(&message[kind..kind + 2]) as usize;
            let Some((body, next)) = behind.split_at_checked(size) else { break };
            rest = next;
            match number(&message[..kind]) {
                LINK => links.extend(link(body)),
                SYMBOL_TABLE if body.len() >= 16 => {
                    links.extend(old_links(read, number(&body[..8]), number(&body[8..16]))?);
                }
                CONTINUATION if body.len() >= 16 && blocks.len() < MAX_DEPTH => {
                    let (at, size) = (number(&body[..8]), number(&body[8..16]));
                    // New blocks are between a signature and a checksum.
                    let extra = if is_new { 4 } else { 0 };
                    blocks.push((at.checked_add(extra)?, size.checked_sub(2 * extra)?));
                }
                _ => {}
            }
        }
        at += 1;
    }
    Some(links)
}

/// Returns the links of a group of the old form with its tree and heap at these addresses.
fn old_links(
    read: impl Fn(u64, u64) -> Option<Vec<u8>>,
    tree: u64,
    heap: u64,
) -> Option<Vec<(String, Target)>> {
    let head = read(heap.checked_add(8)?, 24)?;
    let texts = read(number(&head[16..]), number(&head[..8]))?;
    let text = |at: &[u8]| {
        let text = texts.get(number(at) as usize..)?.split(|&byte| byte == 0).next()?;
        Some(String::from_utf8_lossy(text).into_owned())
    };
    let (mut waiting, mut links) = (vec![(tree, 0)], Vec::new());
    while let Some((at, depth)) = waiting.pop() {
        let head = read(at, 8)?;
        for child in 0..number(&head[6..]) {
            if head.starts_with(b"TREE") && depth < MAX_DEPTH {
                let child = number(&read(at.checked_add(32 + 16 * child)?, 8)?);
                waiting.push((child, depth + 1));
            } else if head.starts_with(b"SNOD") {
                let entry = read(at.checked_add(8 + 40 * child)?, 40)?;
                let target = match number(&entry[16..20]) {
                    2 => Target::Unlistable(text(&entry[24..28])?),
                    _ => Target::Object(number(&entry[8..16])),
                };
                links.push((text(&entry[..8])?, target));
            }
        }
    }
    Some(links)
}

fn link(body: &[u8]) -> Option<(String, Target)> {
    let flags = *body.get(1)?;
    let mut rest = &body[2..];
    let mut take = |n: usize| {
        let (part, behind) = rest.split_at_checked(n)?;
        rest = behind;
        Some(part)
    };
    let kind = if flags & 8 != 0 { take(1)?[0] } else { 0 };
    // The order of creation, and the character set.
    take(if flags & 4 != 0 { 8 } else { 0 } + usize::from(flags & 0x10 != 0))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let n = number(take(1 << (flags & 3))?) as usize;
    let name = text(take(n)?);
    let target = match kind {
        0 => Target::Object(number(take(8)?)),
        1 => {
            let n = number(take(2)?) as usize;
            Target::Path(text(take(n)?))
        }
        _ => Target::Elsewhere,
    };
    Some((name, target))
}

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}
