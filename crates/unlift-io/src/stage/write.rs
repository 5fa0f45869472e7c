//! Writes arrays to a NumPy archive, one after the other.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use serde_json::{Map, Value};
use unlift::About;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, System, ZipWriter};

use super::kind::Kind;
use super::meta::{KEY, VERSION, to_text};
use crate::Error;
use crate::atomic::{self, Access};
use crate::read::npy::tuple;

/// Arrays with metadata. Equal values make equal bytes.
pub(super) struct Written<'a> {
    pub(super) meta: Map<String, Value>,
    pub(super) n_rows: usize,
    arrays: Vec<Array<'a>>,
}

type Fill<'a> = Box<dyn FnOnce(&mut dyn Write) -> io::Result<()> + 'a>;

struct Array<'a> {
    name: &'static str,
    descr: &'static str,
    shape: Vec<usize>,
    /// The size of all values in bytes.
    size: usize,
    fill: Fill<'a>,
}

pub(super) trait Number {
    const DESCR: &'static str;

    fn put(self, to: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($number:ty: $descr:literal),*) => {$(
        impl Number for $number {
            const DESCR: &'static str = $descr;

            fn put(self, to: &mut Vec<u8>) {
                to.extend(self.to_le_bytes());
            }
        }
    )*};
}

numbers!(u8: "|u1", i8: "|i1", u16: "<u2", i32: "<i4", f32: "<f4", f64: "<f8");

impl<'a> Written<'a> {
    pub(super) fn new(kind: Kind, n_rows: usize) -> Self {
        let mut written = Self { meta: Map::new(), n_rows, arrays: Vec::new() };
        written.state("kind", kind.name());
        written.state("version", VERSION);
        written
    }

    /// Adds a value to the metadata, unless it is `None`.
    pub(super) fn state(&mut self, key: &str, value: impl Into<Value>) {
        let value = value.into();
        if !value.is_null() {
            self.meta.insert(key.to_owned(), value);
        }
    }

    /// Adds the released map, the order of rows, and the author of lists, as far as known.
    pub(super) fn state_about(&mut self, about: About) {
        self.state("fingerprint", about.map.map(|map| map.to_string()));
        self.state("rows_by", about.order.name());
        self.state("lists_by", about.by_oracle.then_some("oracle"));
    }

    /// Adds an array of `shape` with `values` in the order of rows.
    pub(super) fn array<T: Number>(
        &mut self,
        name: &'static str,
        shape: &[usize],
        values: impl Iterator<Item = T> + 'a,
    ) {
        const CHUNK: usize = 1 << 16;
        let size = shape.iter().product::<usize>() * size_of::<T>();
        let fill = move |to: &mut dyn Write| {
            let mut chunk = Vec::with_capacity(CHUNK);
            for value in values {
                value.put(&mut chunk);
                if chunk.len() + size_of::<T>() > CHUNK {
                    to.write_all(&chunk)?;
                    chunk.clear();
                }
            }
            to.write_all(&chunk)
        };
        let (shape, fill) = (shape.to_vec(), Box::new(fill));
        self.arrays.push(Array { name, descr: T::DESCR, shape, size, fill });
    }

    pub(super) fn vectors<T: Number + Copy, const D: usize>(
        &mut self,
        name: &'static str,
        rows: &'a [[T; D]],
    ) {
        self.array(name, &[rows.len(), D], rows.as_flattened().iter().copied());
    }
}

pub(super) fn write_file(path: &Path, access: Access, written: Written<'_>) -> Result<(), Error> {
    atomic::write_file(path, access, |file| {
        let mut zip = Zip::new(file);
        zip.text(KEY, &to_text(&written.meta))?;
        zip.arrays("", written)?;
        zip.finish()
    })
}

pub(super) struct Zip<'a>(ZipWriter<Target<'a>>);

impl<'a> Zip<'a> {
    pub(super) fn new(file: &'a mut BufWriter<File>) -> Self {
        let error = RefCell::default();
        Self(ZipWriter::new(Target { file, at: 0, end: 0, failed: false, error }))
    }

    /// Writes the text `name`, an array without dimensions.
    pub(super) fn text(&mut self, name: &str, text: &str) -> io::Result<()> {
        let letters: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
        self.start(name, &format!("<U{}", letters.len() / 4), &[], letters.len())?;
        self.0.write_all(&letters)
    }

    /// Writes all arrays, with `prefix` before their names.
    pub(super) fn arrays(&mut self, prefix: &str, written: Written<'_>) -> io::Result<()> {
        for array in written.arrays {
            let name = format!("{prefix}{}", array.name);
            self.start(&name, array.descr, &array.shape, array.size)?;
            (array.fill)(&mut self.0)?;
            self.0.get_ref().map_or(Ok(()), Target::so_far)?;
        }
        Ok(())
    }

    pub(super) fn finish(self) -> io::Result<()> {
        let mut target = self.0.finish()?;
        target.flush()?;
        target.so_far()
    }

    /// Starts the array `name` with its header.
    fn start(&mut self, name: &str, descr: &str, shape: &[usize], size: usize) -> io::Result<()> {
        let shape = tuple(shape);
        let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
        // Magic, version and length take 10 bytes, the end of the line one.
        let length = (text.len() + 11).next_multiple_of(64) - 10;
        let mut header = b"\x93NUMPY\x01\x00".to_vec();
        header.extend((length as u16).to_le_bytes());
        header.extend(format!("{text:<width$}\n", width = length - 1).into_bytes());
        let is_large = (header.len() + size) as u64 >= zip::ZIP64_BYTES_THR;
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::DEFAULT)
            .system(System::Unix)
            .large_file(is_large);
        self.0.start_file(format!("{name}.npy"), options)?;
        self.0.write_all(&header)
    }
}

/// A file that keeps its first error instead of returning it: a `ZipWriter` that is dropped after an error tries again and prints.
struct Target<'a> {
    file: &'a mut BufWriter<File>,
    at: u64,
    end: u64,
    failed: bool,
    error: RefCell<Option<io::Error>>,
}

impl Target<'_> {
    fn note(&mut self, step: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) {
        if !self.failed {
            let failure = step(self.file).err();
            self.failed = failure.is_some();
            self.error.replace(failure);
        }
    }

    /// Returns the first error, once.
    fn so_far(&self) -> io::Result<()> {
        self.error.take().map_or(Ok(()), Err)
    }
}

impl Write for Target<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.note(|file| file.write_all(bytes));
        self.at += bytes.len() as u64;
        self.end = self.end.max(self.at);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.note(|file| file.flush());
        Ok(())
    }
}

impl Seek for Target<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let to = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => self.end.checked_add_signed(by),
        };
        let to = to.ok_or(io::ErrorKind::InvalidInput)?;
        if to != self.at {
            self.note(|file| file.seek(SeekFrom::Start(to)).map(drop));
            self.at = to;
        }
        Ok(to)
    }
}
