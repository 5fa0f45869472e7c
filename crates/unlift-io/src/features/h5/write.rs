//! Writes HDF5 files.

use std::collections::BTreeMap;
use std::io::{self, Seek, SeekFrom, Write};

use super::Array;
use super::messages::{self, UNDEFINED};
use super::tree::{self, Entry};
use crate::atomic::FEATURES_MARK;

const SUPERBLOCK_BYTES: u64 = 96;

/// Returns the superblock of a file of `len` bytes with its root group at these addresses.
pub(super) fn superblock(len: u64, header: u64, group: [u64; 2]) -> Vec<u8> {
    let mut bytes = b"\x89HDF\r\n\x1a\n\0\0\0\0\0\x08\x08\0".to_vec();
    bytes.extend(tree::LEAF.to_le_bytes());
    bytes.extend(tree::NODE.to_le_bytes());
    bytes.extend([0; 4]);
    let addresses = [0, UNDEFINED, len, UNDEFINED];
    bytes.extend(addresses.iter().flat_map(|at| at.to_le_bytes()));
    bytes.extend(Entry { name: "", header, group: Some(group) }.bytes(0));
    bytes
}

enum Member {
    /// The address of its header.
    Dataset(u64),
    Group(BTreeMap<String, Member>),
}

/// Writes an HDF5 file as a stream: arrays, then the tree of their names, then the superblock.
///
/// Only names and addresses stay in memory. The same arrays in the same order give the same bytes.
pub(crate) struct Writer {
    at: u64,
    root: BTreeMap<String, Member>,
}

impl Writer {
    /// Starts a file. The signature is written last, so an unfinished file is not valid HDF5.
    pub fn start(out: &mut impl Write) -> io::Result<Self> {
        out.write_all(&[0; SUPERBLOCK_BYTES as usize])?;
        // HDF5 readers skip it, because nothing refers to it.
        out.write_all(FEATURES_MARK)?;
        let at = SUPERBLOCK_BYTES + FEATURES_MARK.len() as u64;
        Ok(Self { at, root: BTreeMap::new() })
    }

    /// Returns true if the group `path` does not exist and no array is in its way.
    pub fn is_free(&self, path: &str) -> bool {
        let mut members = &self.root;
        for name in path.split('/') {
            match members.get(name) {
                None => return true,
                Some(Member::Dataset(_)) => return false,
                Some(Member::Group(inside)) => members = inside,
            }
        }
        !members.values().any(|member| matches!(member, Member::Dataset(_)))
    }

    /// Writes `array` as the dataset `name` of the group `path`, with slashes.
    pub fn array(
        &mut self,
        out: &mut impl Write,
        path: &str,
        name: &str,
        array: &Array,
        attributes: &[(&str, f64)],
    ) -> io::Result<()> {
        let mut bytes = array.values.bytes();
        let (address, len) = (self.at, bytes.len() as u64);
        messages::pad(&mut bytes);
        let header = self.at + bytes.len() as u64;
        bytes.extend(messages::dataset(array, address, len, attributes));
        self.put(out, &bytes)?;
        let taken = || {
            let text = format!("{path}: {name} exists already");
            io::Error::new(io::ErrorKind::AlreadyExists, text)
        };
        let mut members = &mut self.root;
        for group in path.split('/') {
            let member = members.entry(group.to_owned());
            let member = member.or_insert_with(|| Member::Group(BTreeMap::new()));
            let Member::Group(inside) = member else { return Err(taken()) };
            members = inside;
        }
        match members.insert(name.to_owned(), Member::Dataset(header)) {
            None => Ok(()),
            Some(_) => Err(taken()),
        }
    }

    fn put(&mut self, out: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
        self.at += bytes.len() as u64;
        out.write_all(bytes)
    }

    pub fn finish(mut self, out: &mut (impl Write + Seek)) -> io::Result<()> {
        let root = std::mem::take(&mut self.root);
        let (header, group) = self.group(out, &root)?;
        out.seek(SeekFrom::Start(0))?;
        out.write_all(&superblock(self.at, header, group))
    }

    /// Writes the members of a group, then the group. Returns the addresses of its header, and of
    /// its tree and heap.
    fn group(
        &mut self,
        out: &mut impl Write,
        members: &BTreeMap<String, Member>,
    ) -> io::Result<(u64, [u64; 2])> {
        let mut entries = Vec::with_capacity(members.len());
        for (name, member) in members {
            let (header, group) = match member {
                Member::Dataset(header) => (*header, None),
                Member::Group(inside) => {
                    let (header, names) = self.group(out, inside)?;
                    (header, Some(names))
                }
            };
            entries.push(Entry { name, header, group });
        }
        let (bytes, names) = tree::names(&entries, self.at);
        self.put(out, &bytes)?;
        let header = self.at;
        self.put(out, &messages::group(names[0], names[1]))?;
        Ok((header, names))
    }
}
