//! Columns of numbers in files: where what does not fit into memory is put aside.

use std::borrow::Cow;
use std::fmt::Debug;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use crate::{Error, RecordId};

/// Where columns are put aside.
pub trait Shelf: Debug + Send + Sync {
    /// An empty file to read and write that nobody else sees, gone when it is closed.
    ///
    /// # Errors
    /// When there is none to be had.
    fn file(&self) -> io::Result<File>;

    /// Where that is, for errors: whose disk is full.
    fn place(&self) -> String;

    /// Bytes of one column that may be in memory at a time: what is read at once, hundreds of lists at least.
    fn window(&self) -> usize;
}

/// A number as a column holds it.
pub(crate) trait Number: Copy + Default + Send + Sync {
    /// Bytes that it takes.
    const BYTES: usize;

    /// Puts it at the beginning of `to`.
    fn put(self, to: &mut [u8]);

    /// The number at the beginning of `from`.
    fn get(from: &[u8]) -> Self;
}

macro_rules! numbers {
    ($($number:ty),*) => { $(
        impl Number for $number {
            const BYTES: usize = size_of::<Self>();

            #[inline(always)]
            fn put(self, to: &mut [u8]) {
                to[..Self::BYTES].copy_from_slice(&self.to_le_bytes());
            }

            #[inline(always)]
            fn get(from: &[u8]) -> Self {
                let mut bytes = [0; size_of::<Self>()];
                bytes.copy_from_slice(&from[..Self::BYTES]);
                Self::from_le_bytes(bytes)
            }
        }
    )* };
}

numbers!(u8, u32, u64, f32);

impl Number for RecordId {
    const BYTES: usize = u32::BYTES;

    #[inline(always)]
    fn put(self, to: &mut [u8]) {
        self.0.put(to);
    }

    #[inline(always)]
    fn get(from: &[u8]) -> Self {
        Self(u32::get(from))
    }
}

/// Bytes that are turned into numbers, or back, at a time.
const PIECE: usize = 1 << 20;

/// Numbers in a file, one after the other.
#[derive(Debug)]
pub(crate) struct Column<T> {
    file: Mutex<File>,
    place: String,
    len: u64,
    of: PhantomData<T>,
}

impl<T: Number> Column<T> {
    /// An empty column on `shelf`.
    ///
    /// # Errors
    /// When there is no file to be had.
    pub(crate) fn new(shelf: &dyn Shelf) -> Result<Self, Error> {
        let file = shelf.file().map_err(|source| failed(&shelf.place(), "made", &source))?;
        Ok(Self { file: Mutex::new(file), place: shelf.place(), len: 0, of: PhantomData })
    }

    /// How many numbers there are.
    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Appends `values`.
    ///
    /// # Errors
    /// When they cannot be written: a full disk.
    pub(crate) fn push_all(&mut self, values: &[T]) -> Result<(), Error> {
        self.put_at(self.len, values)
    }

    /// Puts `values` in the places from `at` on, which may lie beyond the end.
    ///
    /// # Errors
    /// When they cannot be written: a full disk.
    pub(crate) fn put_at(&mut self, at: u64, values: &[T]) -> Result<(), Error> {
        let file = self.file.get_mut().unwrap_or_else(PoisonError::into_inner);
        let mut write = || {
            file.seek(SeekFrom::Start(at * T::BYTES as u64))?;
            let mut bytes = vec![0; PIECE.min(values.len() * T::BYTES)];
            for piece in values.chunks(PIECE / T::BYTES) {
                let bytes = &mut bytes[..piece.len() * T::BYTES];
                for (to, value) in bytes.chunks_exact_mut(T::BYTES).zip(piece) {
                    value.put(to);
                }
                file.write_all(bytes)?;
            }
            Ok(())
        };
        write().map_err(|source| failed(&self.place, "written", &source))?;
        self.len = self.len.max(at + values.len() as u64);
        Ok(())
    }

    /// The numbers at places `range`.
    ///
    /// # Errors
    /// When they cannot be read.
    pub(crate) fn read(&self, range: Range<u64>) -> Result<Vec<T>, Error> {
        let n = (range.end - range.start) as usize;
        let mut values = Vec::with_capacity(n);
        let mut read = || {
            let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
            file.seek(SeekFrom::Start(range.start * T::BYTES as u64))?;
            let mut bytes = vec![0; PIECE.min(n * T::BYTES)];
            while values.len() < n {
                let piece = (PIECE / T::BYTES).min(n - values.len());
                let bytes = &mut bytes[..piece * T::BYTES];
                file.read_exact(bytes)?;
                values.extend(bytes.chunks_exact(T::BYTES).map(T::get));
            }
            Ok(())
        };
        read().map_err(|source| failed(&self.place, "read", &source))?;
        Ok(values)
    }
}

fn failed(place: &str, done: &str, source: &io::Error) -> Error {
    Error::new(
        format!("file in {place} for what does not fit into memory"),
        format!("one that can be {done}"),
        source.to_string(),
    )
}

/// A column in memory or on a shelf.
#[derive(Debug)]
pub(crate) enum Stored<T> {
    /// In memory.
    Here(Vec<T>),
    /// On a shelf.
    Away(Column<T>),
}

impl<T: Number> Stored<T> {
    /// How many numbers there are.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Here(values) => values.len(),
            Self::Away(column) => column.len() as usize,
        }
    }

    /// The numbers at places `range`.
    ///
    /// # Errors
    /// When they cannot be read.
    pub(crate) fn part(&self, range: Range<u64>) -> Result<Cow<'_, [T]>, Error> {
        match self {
            Self::Here(values) => {
                Ok(Cow::Borrowed(&values[range.start as usize..range.end as usize]))
            }
            Self::Away(column) => column.read(range).map(Cow::Owned),
        }
    }

    /// The number at place `at`.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(crate) fn one(&self, at: u64) -> Result<T, Error> {
        Ok(self.part(at..at + 1)?[0])
    }
}

/// Consecutive rows of at most `most` entries, where row `r` has the entries `offsets[r]..offsets[r + 1]`: each has `unit` rows or
/// a multiple of it, at least as many.
pub(crate) fn windows(offsets: &[u64], most: u64, unit: usize) -> Vec<Range<usize>> {
    let n = offsets.len() - 1;
    let (mut windows, mut start) = (Vec::new(), 0);
    while start < n {
        let limit = offsets[start].saturating_add(most);
        let fitting = offsets[start..].partition_point(|&offset| offset <= limit) - 1;
        let rows = (fitting / unit * unit).max(unit);
        let end = n.min(start + rows);
        windows.push(start..end);
        start = end;
    }
    windows
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Files among those of the system, with windows of so many bytes.
    #[derive(Debug)]
    pub(crate) struct Temporary(pub(crate) usize);

    impl Shelf for Temporary {
        fn file(&self) -> io::Result<File> {
            tempfile::tempfile()
        }

        fn place(&self) -> String {
            "tests".to_owned()
        }

        fn window(&self) -> usize {
            self.0
        }
    }

    #[test]
    fn what_is_put_is_there() {
        let mut column = Column::<u32>::new(&Temporary(0)).unwrap();
        let n = PIECE as u32;
        let values: Vec<u32> = (0..n).map(|i| i.wrapping_mul(2_654_435_761)).collect();
        column.put_at(5, &values).unwrap();
        column.put_at(0, &[1, 2, 3, 4, 5]).unwrap();
        column.push_all(&[9]).unwrap();
        assert_eq!(column.len(), u64::from(n) + 6);
        assert_eq!(column.read(0..6).unwrap(), [1, 2, 3, 4, 5, values[0]]);
        assert_eq!(column.read(5..5 + u64::from(n)).unwrap(), values);
        assert_eq!(Stored::Away(column).one(5 + u64::from(n)).unwrap(), 9);
    }

    #[test]
    fn what_is_not_there_is_an_error() {
        let column = Column::<f32>::new(&Temporary(0)).unwrap();
        let error = column.read(0..1).unwrap_err().to_string();
        assert!(error.starts_with(
            "file in tests for what does not fit into memory: expected one that can be read"
        ));
    }

    #[test]
    fn windows_hold_whole_units_and_no_more_than_fits() {
        let offsets = [0, 2, 4, 4, 9, 10, 10, 10, 11];
        assert_eq!(windows(&offsets, 4, 1), [0..3, 3..4, 4..8]);
        assert_eq!(windows(&offsets, 4, 2), [0..2, 2..4, 4..8]);
        assert_eq!(windows(&offsets, u64::MAX, 2), vec![Range { start: 0, end: 8 }]);
        assert_eq!(windows(&[0], 4, 2), []);
    }
}
