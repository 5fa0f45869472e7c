//! Reads the bytes of an HDF5 file, with a limit per step.
//!
//! Nodes of a tree may repeat, and a chunk may be listed a million times. Limiting the bytes that
//! the library reads also limits its time and memory.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use hdf5_pure::{FormatError, Source};

use crate::error::Error;
use crate::input;

/// The library reads a header in a dozen pieces, so pages are cached.
const PAGE: u64 = 8 << 10;
const PAGES: u64 = 64;
/// The cost of a read besides its bytes.
const READ: u64 = 64;
/// A step may read `LEAST` bytes, or `MULTIPLE` times the length of the file if that is more.
const LEAST: u64 = 256 << 20;
const MULTIPLE: u64 = 64;

thread_local! {
    // The library reads in the calling thread.
    static LEFT: Cell<u64> = const { Cell::new(0) };
    static FIRST: Cell<Option<u64>> = const { Cell::new(None) };
    static LONGEST_NAME: Cell<u64> = const { Cell::new(0) };
}

pub(super) struct Bounded {
    pages: Mutex<Pages>,
    len: u64,
}

struct Pages {
    file: File,
    /// Page numbers and bytes, at index number modulo [`PAGES`].
    held: Vec<(u64, Vec<u8>)>,
}

impl Bounded {
    pub fn open(path: &Path) -> Result<(Self, u64), Error> {
        let (file, len) = input::open(path)?;
        let held = (0..PAGES).map(|_| (u64::MAX, Vec::new())).collect();
        Ok((Self { pages: Mutex::new(Pages { file, held }), len }, len))
    }
}

pub(super) fn bounded<T>(len: u64, step: impl FnOnce() -> T) -> T {
    let outer = LEFT.replace(most(len));
    let result = step();
    LEFT.set(outer);
    result
}

pub(super) fn most(len: u64) -> u64 {
    len.saturating_mul(MULTIPLE).max(LEAST)
}

pub(super) fn is_spent() -> bool {
    LEFT.get() == 0
}

/// Returns the result of `step` and the offset of its first read.
pub(super) fn first_read<T>(step: impl FnOnce() -> T) -> (T, Option<u64>) {
    FIRST.set(None);
    let result = step();
    (result, FIRST.get())
}

#[cfg(test)]
thread_local! {
    pub(super) static READ_SO_FAR: Cell<u64> = const { Cell::new(0) };
}

fn charge(bytes: u64) -> Result<(), FormatError> {
    #[cfg(test)]
    READ_SO_FAR.set(READ_SO_FAR.get() + bytes);
    let left = LEFT.get().saturating_sub(bytes);
    LEFT.set(left);
    if left == 0 {
        return Err(FormatError::Source("too much is read".to_owned()));
    }
    Ok(())
}

impl Source for Bounded {
    fn len(&self) -> u64 {
        self.len
    }

    fn read_at(&self, offset: u64, buf: &mut [u8]) -> Result<(), FormatError> {
        charge(READ + buf.len() as u64)?;
        if FIRST.get().is_none() {
            FIRST.set(Some(offset));
        }
        let mut pages = self.pages.lock().unwrap_or_else(PoisonError::into_inner);
        pages.read(offset, buf).map_err(|error| FormatError::Source(error.to_string()))
    }

    fn read_metadata_at(&self, offset: u64, len: usize) -> Result<Vec<u8>, FormatError> {
        let bytes = self.read_exact_at(offset, len)?;
        // The library copies the name of each entry (40 bytes), and all entries may share one long
        // name. So each entry costs the longest name of the heap read before.
        if bytes.starts_with(b"SNOD") {
            charge(len as u64 / 40 * LONGEST_NAME.get())?;
        } else if !bytes.starts_with(b"TREE") {
            let names = bytes.split(|&byte| byte == 0).map(<[u8]>::len);
            LONGEST_NAME.set(names.max().unwrap_or(0) as u64);
        }
        Ok(bytes)
    }
}

impl Pages {
    fn read(&mut self, mut offset: u64, mut buf: &mut [u8]) -> io::Result<()> {
        if buf.len() as u64 > PAGE {
            self.file.seek(SeekFrom::Start(offset))?;
            return self.file.read_exact(buf);
        }
        while !buf.is_empty() {
            let bytes = self.page(offset / PAGE)?;
            let there = bytes.get((offset % PAGE) as usize..).unwrap_or_default();
            let n = there.len().min(buf.len());
            if n == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            let (now, later) = buf.split_at_mut(n);
            now.copy_from_slice(&there[..n]);
            (buf, offset) = (later, offset + n as u64);
        }
        Ok(())
    }

    fn page(&mut self, number: u64) -> io::Result<&[u8]> {
        let (held, bytes) = &mut self.held[(number % PAGES) as usize];
        if *held != number {
            *held = u64::MAX;
            bytes.clear();
            self.file.seek(SeekFrom::Start(number * PAGE))?;
            (&mut self.file).take(PAGE).read_to_end(bytes)?;
            *held = number;
        }
        Ok(bytes)
    }
}
