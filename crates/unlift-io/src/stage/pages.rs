//! Checks the counts and sizes that columns declare, in the footer and in page headers, before they
//! are decoded.

use super::file::ParquetFile;
use super::thrift::{Walk, Wrong};
use crate::Error;
use crate::input::Budget;
use parquet::basic::Type;
use parquet::file::metadata::ColumnChunkMetaData;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

/// Bytes of a repetition and a definition level in memory.
const LEVELS: u64 = 4;
/// Encodings of text: plain, and by dictionary. Others declare counts inside compressed data, where
/// they cannot be checked.
const OF_TEXT: [i64; 3] = [0, 2, 8];

/// How long decoded data stays in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stay {
    /// Until the whole table is decoded.
    Whole,
    /// Until the next rows are decoded.
    Rows,
}

/// Checks the columns at `roots` of `files`, the parts of one table, against the files and the
/// budget. Returns the maximum size in bytes of one text.
pub(super) fn check(
    files: &[Arc<ParquetFile>],
    roots: &[Vec<usize>],
    (budget, stay): (&Budget, Stay),
) -> Result<u64, Error> {
    let mut longest = 0;
    // Lists have nested values.
    let leaves = |file: &ParquetFile, root: usize| -> Vec<usize> {
        let schema = file.metadata().file_metadata().schema_descr();
        let leaves = 0..schema.num_columns();
        leaves.filter(|&leaf| schema.get_column_root_idx(leaf) == root).collect()
    };
    for wanted in 0..roots.first().map_or(0, Vec::len) {
        for at in 0..leaves(&files[0], roots[0][wanted]).len() {
            let schema = files[0].schema();
            let place = format!("column {}", schema.field(roots[0][wanted]).name());
            let mut column = Column {
                path: files[0].path(),
                place,
                budget,
                n_values: 0,
                n_bytes: 0,
                longest: 0,
            };
            for (file, roots) in files.iter().zip(roots) {
                let Some(&leaf) = leaves(file, roots[wanted]).get(at) else { continue };
                column.path = file.path();
                let mut handle = file.handle()?;
                for group in file.metadata().row_groups() {
                    if stay == Stay::Rows {
                        (column.n_values, column.n_bytes) = (0, 0);
                    }
                    // The crate has checked that a row group has every column.
                    if let Some(chunk) = group.columns().get(leaf) {
                        column.chunk(&mut handle, file.n_bytes(), chunk)?;
                        if chunk.column_type() == Type::BYTE_ARRAY {
                            longest = longest.max(column.longest);
                        }
                    }
                }
            }
        }
    }
    Ok(longest)
}

struct Column<'a> {
    path: &'a Path,
    place: String,
    budget: &'a Budget,
    n_values: u64,
    /// The decompressed size of its pages.
    n_bytes: u64,
    /// The decompressed size of its largest page.
    longest: u64,
}

#[derive(Default)]
struct Header {
    is_dictionary: bool,
    /// The decompressed size in bytes.
    whole: i64,
    /// The size in the file in bytes.
    stored: i64,
    n_values: i64,
    encoding: i64,
}

impl Column<'_> {
    fn wrong(&self, expected: impl Into<String>, found: impl ToString) -> Error {
        Error::new(self.path, self.place.clone(), expected, found.to_string())
    }

    fn chunk(
        &mut self,
        file: &mut File,
        n_bytes: u64,
        chunk: &ColumnChunkMetaData,
    ) -> Result<(), Error> {
        let descriptor = chunk.column_descr();
        let width = match descriptor.physical_type() {
            Type::BOOLEAN => 1,
            Type::INT32 | Type::FLOAT | Type::BYTE_ARRAY => 4,
            Type::INT64 | Type::DOUBLE => 8,
            Type::INT96 => 12,
            Type::FIXED_LEN_BYTE_ARRAY => u64::try_from(descriptor.type_length()).unwrap_or(0),
        };
        let Ok(n_values) = u64::try_from(chunk.num_values()) else {
            return Err(self.wrong("a number of values", chunk.num_values()));
        };
        self.n_values = self.n_values.saturating_add(n_values);
        let memory = self.n_values.saturating_mul(width + LEVELS);
        self.budget.admit(self.place.as_str(), memory)?;

        let start = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
        let (Ok(mut at), Ok(length)) =
            (u64::try_from(start), u64::try_from(chunk.compressed_size()))
        else {
            let found = format!("{} bytes from byte {start}", chunk.compressed_size());
            return Err(self.wrong("a part of the file", found));
        };
        let end = at.saturating_add(length);
        if end > n_bytes {
            let expected = format!("values within the {n_bytes} bytes of the file");
            return Err(self.wrong(expected, format!("{length} bytes from byte {at}")));
        }
        let mut left = n_values;
        // Ends, because every page has a header.
        while at < end {
            let (header, length) = self.header(file, at, end)?;
            at += length;
            let (Ok(whole), Ok(stored), Ok(n)) = (
                u64::try_from(header.whole),
                u64::try_from(header.stored),
                u64::try_from(header.n_values),
            ) else {
                return Err(
                    self.wrong("pages with sizes", format!("one without sizes at byte {at}"))
                );
            };
            if stored > end - at {
                let expected = format!("a page of at most {} bytes at byte {at}", end - at);
                return Err(self.wrong(expected, stored));
            }
            self.longest = self.longest.max(whole);
            self.n_bytes = self.n_bytes.saturating_add(whole);
            self.budget.admit(self.place.as_str(), self.n_bytes)?;
            // Every value of a dictionary takes at least a byte.
            let most = if header.is_dictionary { whole } else { left };
            if n > most {
                let expected =
                    format!("at most {most} values in the page that ends at byte {}", at + stored);
                return Err(self.wrong(expected, n));
            }
            if !header.is_dictionary {
                left -= n;
            }
            if descriptor.physical_type() == Type::BYTE_ARRAY && !OF_TEXT.contains(&header.encoding)
            {
                let found = format!("encoding {} of Parquet", header.encoding);
                return Err(self.wrong("text in plain or dictionary encoding", found));
            }
            at += stored;
        }
        Ok(())
    }

    /// Returns the page header at byte `at` of a column that ends at `end`, and its length.
    fn header(&self, file: &mut File, at: u64, end: u64) -> Result<(Header, u64), Error> {
        // Most headers are shorter; some contain the minimum and maximum value.
        let mut length = 256;
        loop {
            let most = end - at;
            let mut bytes = vec![0; most.min(length) as usize];
            let read = file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut bytes));
            read.map_err(|source| Error::read(self.path, source))?;
            let mut walk = Walk::new(&bytes);
            match page(&mut walk) {
                Ok(header) => return Ok((header, (bytes.len() - walk.remaining()) as u64)),
                Err(Wrong::End) if length < most => length *= 16,
                Err(wrong) => {
                    let expected = format!("the header of a page at byte {at}");
                    return Err(self.wrong(expected, wrong.found()));
                }
            }
        }
    }
}

/// Parses `PageHeader` of the Parquet format.
fn page(walk: &mut Walk<'_>) -> Result<Header, Wrong> {
    let mut header = Header { whole: -1, stored: -1, ..Header::default() };
    walk.fields(|walk, (id, kind)| {
        match id {
            2 => header.whole = walk.integer(kind)?,
            3 => header.stored = walk.integer(kind)?,
            // A data page, a dictionary page, a data page of version 2.
            5 | 7 | 8 => {
                header.is_dictionary = id == 7;
                let encoding = if id == 8 { 4 } else { 2 };
                walk.structure(kind, |walk, (id, kind)| {
                    match id {
                        1 => header.n_values = walk.integer(kind)?,
                        id if id == encoding => header.encoding = walk.integer(kind)?,
                        _ => return Ok(false),
                    }
                    Ok(true)
                })?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    Ok(header)
}
