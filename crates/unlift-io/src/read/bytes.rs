//! Reads binary files and their numbers.

use std::fmt::Display;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use half::f16;

use crate::error::Error;
use crate::input::{self, Budget};

/// A little-endian reader of binary files. It checks declared sizes against the remaining bytes,
/// and errors name the current part of the file and the byte.
pub(crate) struct Bytes<R = BufReader<File>> {
    path: PathBuf,
    reader: R,
    part: Part,
    value_at: u64,
    at: u64,
    len: u64,
    budget: Budget,
}

/// Formatted only for errors.
enum Part {
    Header,
    Record(u64),
    /// An array of an archive.
    Array(String),
}

impl Bytes {
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, len) = input::open(path)?;
        Ok(Self::continuing(path, BufReader::new(file), 0, len))
    }

    pub fn skip(&mut self, bytes: u64, what: &str) -> Result<(), Error> {
        self.check(bytes, what)?;
        let offset = i64::try_from(bytes).expect("bounded by the size of the file");
        self.reader.seek_relative(offset).map_err(|e| Error::read(&self.path, e))?;
        self.value_at = self.at;
        self.at += bytes;
        Ok(())
    }
}

impl<R: Read> Bytes<R> {
    /// Creates a reader of a file of `len` bytes of which `at` were already read.
    pub fn continuing(path: &Path, reader: R, at: u64, len: u64) -> Self {
        let (path, budget) = (path.to_owned(), Budget::new(path, len));
        Self { path, reader, part: Part::Header, value_at: at, at, len, budget }
    }

    /// Creates a reader of the array `name` of an archive, `len` bytes long when unpacked, with the
    /// `budget` of the archive.
    pub fn of_array(path: &Path, reader: R, name: &str, len: u64, budget: Budget) -> Self {
        let part = Part::Array(name.to_owned());
        Self { part, budget, ..Self::continuing(path, reader, 0, len) }
    }

    /// Makes later errors name record `number`, counted from 1.
    pub fn record(&mut self, number: u64) {
        self.part = Part::Record(number);
    }

    pub fn room<T>(&self, place: &str, n: u64) -> Result<Vec<T>, Error> {
        self.budget.room(place, n)
    }

    pub fn remaining(&self) -> u64 {
        self.len.saturating_sub(self.at)
    }

    /// Returns an error about the last value.
    pub fn error(&self, expected: impl Display, found: impl Display) -> Error {
        self.error_at(self.value_at, expected, found)
    }

    /// Returns an error about the next value.
    pub fn error_ahead(&self, expected: impl Display, found: impl Display) -> Error {
        self.error_at(self.at, expected, found)
    }

    fn error_at(&self, at: u64, expected: impl Display, found: impl Display) -> Error {
        let place = match &self.part {
            Part::Header => format!("header (byte {at})"),
            Part::Record(number) => format!("record {number} (byte {at})"),
            Part::Array(name) => format!("array {name}"),
        };
        Error::new(&self.path, place, expected, found)
    }

    /// Returns the size of `n` rows of `stride` bytes, or an error if the file has fewer bytes left.
    pub fn expect_rows(&self, n: u64, what: &str, stride: u64) -> Result<u64, Error> {
        let size = n.checked_mul(stride).filter(|&size| size <= self.remaining());
        size.ok_or_else(|| {
            let expected = format!("{n} {what}, {stride} bytes each");
            self.error_ahead(expected, format!("{} bytes", self.remaining()))
        })
    }

    fn check(&self, bytes: u64, what: &str) -> Result<(), Error> {
        let found = match self.remaining() {
            left if bytes <= left => return Ok(()),
            0 => "end of file".to_owned(),
            left => format!("{} before the end of the file", counted(left)),
        };
        Err(self.error_ahead(format!("{} of {what}", counted(bytes)), found))
    }

    pub fn fill(&mut self, buffer: &mut [u8], what: &str) -> Result<(), Error> {
        self.check(buffer.len() as u64, what)?;
        self.value_at = self.at;
        self.reader.read_exact(buffer).map_err(|source| self.unreadable(source))?;
        self.at += buffer.len() as u64;
        Ok(())
    }

    fn unreadable(&self, source: io::Error) -> Error {
        match &self.part {
            // An archive detects damage by checksums.
            Part::Array(name) => {
                Error::new(&self.path, format!("array {name}"), "undamaged data", source)
            }
            _ => Error::read(&self.path, source),
        }
    }

    /// Checks that an array ends here, where its checksum is compared.
    pub fn end_of_array(&mut self) -> Result<(), Error> {
        match self.reader.read(&mut [0]) {
            Ok(0) => Ok(()),
            Ok(_) => Err(self.error_ahead("the declared size", "a larger one")),
            Err(source) => Err(self.unreadable(source)),
        }
    }

    pub fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Error> {
        let mut buffer = [0; N];
        self.fill(&mut buffer, what)?;
        Ok(buffer)
    }

    pub fn u32(&mut self, what: &str) -> Result<u32, Error> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub fn u64(&mut self, what: &str) -> Result<u64, Error> {
        self.array(what).map(u64::from_le_bytes)
    }

    pub fn doubles<const N: usize>(&mut self, what: &str) -> Result<[f64; N], Error> {
        let mut values = [[0; 8]; N];
        self.fill(values.as_flattened_mut(), what)?;
        Ok(values.map(f64::from_le_bytes))
    }

    /// Reads bytes up to the next zero byte, which is not included.
    pub fn zero_terminated(&mut self, what: &str) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        loop {
            match self.array(what)? {
                [0] => return Ok(bytes),
                [byte] => bytes.push(byte),
            }
        }
    }

    /// Reads a `u64` count of `what`, each of at least `bytes_each` bytes.
    ///
    /// A count that the rest of the file cannot hold is an error, so that nothing is allocated for it.
    pub fn count(&mut self, what: &str, bytes_each: u64) -> Result<u64, Error> {
        if self.remaining() < 8 {
            self.check(8, &format!("the number of {what}"))?;
        }
        let count = self.u64(what)?;
        let left = self.remaining();
        let max = left / bytes_each;
        if count <= max {
            return Ok(count);
        }
        let is_text = |b: &u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
        if self.value_at == 0 && count.to_le_bytes().iter().all(is_text) {
            return Err(self.error(format!("binary data (the number of {what})"), "text"));
        }
        let expected = format!("at most {max} for the number of {what} ({left} bytes are left)");
        Err(self.error(expected, count.to_string()))
    }

    pub fn end(&self) -> Result<(), Error> {
        match self.remaining() {
            0 => Ok(()),
            n => Err(self.error_ahead("end of file", format!("{} more", counted(n)))),
        }
    }
}

fn counted(n: u64) -> String {
    if n == 1 { "1 byte".to_owned() } else { format!("{n} bytes") }
}

/// The type of a number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Scalar {
    /// `f`, `i` or `u`.
    kind: u8,
    pub size: usize,
}

impl Scalar {
    pub const U8: Self = Self { kind: b'u', size: 1 };
    pub const F16: Self = Self { kind: b'f', size: 2 };
    pub const F32: Self = Self { kind: b'f', size: 4 };
    pub const F64: Self = Self { kind: b'f', size: 8 };

    /// Returns a type by its size in bytes and kind: `f` float, `i` signed, `u` unsigned, in either case.
    pub fn of_kind(kind: u8, size: u64) -> Option<Self> {
        let kind = kind.to_ascii_lowercase();
        let sizes: &[u64] = match kind {
            b'i' | b'u' => &[1, 2, 4, 8],
            b'f' => &[2, 4, 8],
            _ => return None,
        };
        sizes.contains(&size).then_some(Self { kind, size: size as usize })
    }

    pub fn is_whole(self) -> bool {
        self.kind != b'f'
    }

    /// Reads a number from the first `size` `bytes`, big-endian if `big` is set.
    pub fn read(self, bytes: &[u8], big: bool) -> f64 {
        let mut little = [0; 8];
        little[..self.size].copy_from_slice(&bytes[..self.size]);
        if big {
            little[..self.size].reverse();
        }
        let [a, b, c, d, ..] = little;
        match (self.kind, self.size) {
            (b'u', _) => u64::from_le_bytes(little) as f64,
            (b'i', size) => {
                let unused = 64 - 8 * size;
                (i64::from_le_bytes(little) << unused >> unused) as f64
            }
            (_, 2) => f64::from(f16::from_le_bytes([a, b])),
            (_, 4) => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => f64::from_le_bytes(little),
        }
    }
}

/// A number in a row of bytes: its offset and type, and true if it is big-endian.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    pub at: usize,
    pub scalar: Scalar,
    pub big: bool,
}

impl Field {
    pub fn of(self, row: &[u8]) -> f64 {
        self.scalar.read(&row[self.at..], self.big)
    }
}
