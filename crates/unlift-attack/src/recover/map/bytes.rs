//! Numbers as bytes and back, little-endian.

use crate::Error;

/// Appends numbers.
#[derive(Debug, Default)]
pub(crate) struct Writer(Vec<u8>);

impl Writer {
    /// Appends bytes as they are.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// Appends a whole number.
    pub(crate) fn u64(&mut self, x: u64) {
        self.bytes(&x.to_le_bytes());
    }

    /// Appends every bit of a number.
    pub(crate) fn f64(&mut self, x: f64) {
        self.u64(x.to_bits());
    }

    /// Appends every bit of numbers, but not how many there are.
    pub(crate) fn f32s(&mut self, numbers: &[f32]) {
        numbers.iter().for_each(|x| self.bytes(&x.to_bits().to_le_bytes()));
    }

    /// All that was appended.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.0
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
