//! Numbers as bytes and back, little-endian.

use std::io;

use crate::Error;

/// Appends numbers, in memory or where there may be no room.
#[derive(Debug, Default)]
pub(crate) struct Writer<W = Vec<u8>> {
    to: W,
    written: u64,
    failed: Option<io::Error>,
}

impl<W: io::Write> Writer<W> {
    /// Behind what is there.
    pub(crate) fn new(to: W) -> Self {
        Self { to, written: 0, failed: None }
    }

    /// Appends bytes as they are; nothing after some could not be written.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        if self.failed.is_none() {
            self.failed = self.to.write_all(bytes).err();
            self.written += bytes.len() as u64;
        }
    }

    /// Appends a whole number.
    pub(crate) fn u64(&mut self, x: u64) {
        self.bytes(&x.to_le_bytes());
    }

    /// Appends every bit of a number.
    pub(crate) fn f64(&mut self, x: f64) {
        self.u64(x.to_bits());
    }

    /// Appends a whole number.
    pub(crate) fn u32(&mut self, x: u32) {
        self.bytes(&x.to_le_bytes());
    }

    /// Appends whole numbers, and how many there are.
    pub(crate) fn u32s(&mut self, numbers: &[u32]) {
        self.u64(numbers.len() as u64);
        numbers.iter().for_each(|&x| self.u32(x));
    }

    /// Appends every bit of numbers, but not how many there are.
    pub(crate) fn f32s(&mut self, numbers: &[f32]) {
        numbers.iter().for_each(|x| self.bytes(&x.to_bits().to_le_bytes()));
    }

    /// How many bytes were appended.
    pub(crate) fn written(&self) -> u64 {
        self.written
    }

    /// Where all was written.
    ///
    /// # Errors
    /// When some of it could not be.
    pub(crate) fn finish(self) -> io::Result<W> {
        match self.failed {
            None => Ok(self.to),
            Some(failed) => Err(failed),
        }
    }
}

impl Writer {
    /// All that was appended.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.to
    }
}

/// Takes numbers off the front.
#[derive(Debug)]
pub(crate) struct Reader<'a> {
    what: &'static str,
    left: &'a [u8],
}

impl<'a> Reader<'a> {
    /// From the first byte on, of what errors call so.
    pub(crate) fn new(what: &'static str, bytes: &'a [u8]) -> Self {
        Self { what, left: bytes }
    }

    /// An error about these bytes.
    pub(crate) fn wrong(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::new(self.what, expected, found)
    }

    /// The next `n` bytes.
    pub(crate) fn bytes(&mut self, n: usize) -> Result<&'a [u8], Error> {
        if n > self.left.len() {
            return Err(self.wrong(format!("{n} more bytes"), format!("{} bytes", self.left.len())));
        }
        let (front, rest) = self.left.split_at(n);
        self.left = rest;
        Ok(front)
    }

    /// The next `N` bytes.
    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(N)?);
        Ok(array)
    }

    /// A whole number.
    pub(crate) fn u64(&mut self) -> Result<u64, Error> {
        self.array().map(u64::from_le_bytes)
    }

    /// A whole number.
    pub(crate) fn u32(&mut self) -> Result<u32, Error> {
        self.array().map(u32::from_le_bytes)
    }

    /// A whole number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> Result<u32, Error> {
        let x = self.u32()?;
        self.all_below(&[x], end).map(|()| x)
    }

    /// So many whole numbers at `most` as it says.
    pub(crate) fn u32s(&mut self, most: usize) -> Result<Vec<u32>, Error> {
        let n = self.count(most)?;
        let (rows, _) = self.bytes(n.saturating_mul(4))?.as_chunks::<4>();
        Ok(rows.iter().map(|&bytes| u32::from_le_bytes(bytes)).collect())
    }

    /// Refuses numbers that are not below `end`.
    pub(crate) fn all_below(&self, numbers: &[u32], end: usize) -> Result<(), Error> {
        match numbers.iter().find(|&&x| x as usize >= end) {
            None => Ok(()),
            Some(x) => Err(self.wrong(format!("numbers below {end}"), x.to_string())),
        }
    }

    /// A whole number that counts something, at most `most`.
    pub(crate) fn count(&mut self, most: usize) -> Result<usize, Error> {
        let n = self.u64()?;
        match usize::try_from(n) {
            Ok(n) if n <= most => Ok(n),
            _ => Err(self.wrong(format!("a count of at most {most}"), n.to_string())),
        }
    }

    /// A number.
    pub(crate) fn f64(&mut self) -> Result<f64, Error> {
        self.u64().map(f64::from_bits)
    }

    /// A number.
    pub(crate) fn f32(&mut self) -> Result<f32, Error> {
        self.array().map(f32::from_le_bytes)
    }

    /// So many numbers.
    pub(crate) fn f32s(&mut self, n: usize) -> Result<Vec<f32>, Error> {
        let (rows, _) = self.bytes(n.saturating_mul(4))?.as_chunks::<4>();
        Ok(rows.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect())
    }

    /// Nothing may be left.
    pub(crate) fn end(&self) -> Result<(), Error> {
        match self.left.len() {
            0 => Ok(()),
            n => Err(self.wrong("its end", format!("{n} more bytes"))),
        }
    }
}
