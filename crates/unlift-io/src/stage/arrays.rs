//! Reads the arrays of one map, or of one image, by name.

use std::fmt::Display;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use unlift::descriptors::Values;

use super::kind::Kind;
use super::meta::{KEY, Meta};
use crate::Error;
use crate::read::archive::{Archive, ArrayBytes};
use crate::read::npy::{Header, tuple};

/// Stands for -1, "none", in whole numbers.
pub(super) const NONE: u32 = u32::MAX;

/// The longest metadata in bytes. It holds a few names and numbers.
const MAX_TEXT: u64 = 1 << 16;

/// The arrays of one map or image.
pub(super) struct Arrays<'a> {
    pub(super) path: &'a Path,
    /// Shared by the images of a file, which several threads read.
    archive: Arc<Mutex<Archive>>,
    /// Index in the archive and name of each array.
    pub(super) arrays: Vec<(usize, String)>,
    pub(super) meta: Meta<'a>,
}

impl<'a> Arrays<'a> {
    pub(super) fn open(path: &'a Path) -> Result<Self, Error> {
        let archive = Archive::open(path)?;
        let arrays = archive.arrays();
        let archive = Arc::new(Mutex::new(archive));
        Self { path, archive, arrays, meta: Meta::empty(path) }.with_meta()
    }

    /// Returns the arrays of one image of this file, each with its index and its name below that of the image.
    pub(super) fn of_image(&self, arrays: Vec<(usize, String)>) -> Result<Self, Error> {
        let (path, archive, meta) = (self.path, self.archive.clone(), self.meta.clone());
        Self { path, archive, arrays, meta }.with_meta()
    }

    /// Reads the metadata, which replaces that of the file.
    fn with_meta(mut self) -> Result<Self, Error> {
        if let Some(text) = self.text()? {
            self.meta.extend(&text)?;
        }
        Ok(self)
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.arrays.iter().map(|(_, name)| &**name)
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.names().any(|known| known == name)
    }

    pub(super) fn optional<'n, T>(
        &self,
        name: &'n str,
        read: impl FnOnce(&'n str) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        self.has(name).then(|| read(name)).transpose()
    }

    /// Lists the names for an error.
    pub(super) fn list(&self) -> String {
        let first = self.names().take(5).collect::<Vec<_>>().join(", ");
        match self.arrays.len() {
            0 => "no array".to_owned(),
            1..=5 => format!("arrays {first}"),
            _ => format!("arrays {first}, .."),
        }
    }

    /// The kind by the metadata, else by the arrays.
    pub(super) fn kind(&self) -> Result<Option<Kind>, Error> {
        let names = self.names().map(|name| name.rsplit_once('/').map_or(name, |name| name.1));
        Ok(self.meta.kind()?.or_else(|| Kind::of_arrays(names)))
    }

    /// Checks that these are arrays of `kind` only. Ambiguous ones are taken for it.
    pub(super) fn expect(&self, kind: Kind) -> Result<(), Error> {
        if let Some(other) = self.kind()?.filter(|its| *its != kind) {
            return Err(Error::new(self.path, "", kind, other));
        }
        let known: Vec<&str> = [KEY].into_iter().chain(kind.arrays()).collect();
        match self.names().find(|name| !known.contains(name)) {
            None => Ok(()),
            Some(name) => {
                let expected = format!("only {}", known.join(", "));
                Err(Error::new(self.path, format!("array {name}"), expected, "an unknown array"))
            }
        }
    }

    pub(super) fn refused(&self, source: unlift::Error) -> Error {
        Error::core(self.path, source)
    }

    /// An error about row `row` of the array `name`.
    pub(super) fn wrong(
        &self,
        name: &str,
        row: usize,
        expected: impl Display,
        found: impl Display,
    ) -> Error {
        Error::new(self.path, format!("array {name}, row {row}"), expected, found)
    }

    /// Reads finite numbers, whose array has `sides`; `None` is any.
    pub(super) fn floats<const N: usize>(
        &self,
        name: &str,
        sides: [Option<usize>; N],
    ) -> Result<(Vec<f64>, [usize; N]), Error> {
        let finite = |x: f64| Some(x).filter(|x| x.is_finite());
        self.numbers(name, sides, Class::Any, "a finite number", finite)
    }

    /// Reads a row of `D` finite numbers for each of `n` rows, or for any number of them.
    pub(super) fn vectors<const D: usize>(
        &self,
        name: &str,
        n: Option<usize>,
    ) -> Result<Vec<[f64; D]>, Error> {
        let (values, _) = self.floats(name, [n, Some(D)])?;
        Ok(values.as_chunks().0.to_vec())
    }

    /// Reads the origin, by default 0.
    pub(super) fn origin<const D: usize>(&self) -> Result<[f64; D], Error> {
        let values = self.optional("origin", |name| self.floats(name, [Some(D)]))?;
        Ok(values.map_or([0.0; D], |(values, _)| std::array::from_fn(|axis| values[axis])))
    }

    /// Reads whole numbers from 0 to `below - 1`, and -1 for [`NONE`] if `or_none`.
    pub(super) fn integers<const N: usize>(
        &self,
        name: &str,
        sides: [Option<usize>; N],
        below: usize,
        or_none: bool,
    ) -> Result<(Vec<u32>, [usize; N]), Error> {
        let none = if or_none { ", or -1 for none" } else { "" };
        let rule = format!("a whole number below {below}{none}");
        let below = (below as u64).min(u64::from(NONE)) as f64;
        self.numbers(name, sides, Class::Whole, &rule, |x| match x {
            -1.0 if or_none => Some(NONE),
            x => (0.0..below).contains(&x).then_some(x as u32),
        })
    }

    /// Reads whole numbers below a bound, one for each of `n` rows, if there is the array `name`.
    pub(super) fn column(
        &self,
        name: &str,
        n: usize,
        below: usize,
        or_none: bool,
    ) -> Result<Option<Vec<u32>>, Error> {
        self.optional(name, |name| Ok(self.integers(name, [Some(n)], below, or_none)?.0))
    }

    /// Reads integers from 0 to 255 as bytes, or finite floats. Returns also the length of a row.
    pub(super) fn bytes_or_floats<const N: usize>(
        &self,
        name: &str,
        sides: [Option<usize>; N],
    ) -> Result<(Values, usize), Error> {
        if self.file(name, |bytes| Ok(Header::read(bytes)?.is_whole()))? {
            let byte = |x: f64| (0.0..256.0).contains(&x).then_some(x as u8);
            let rule = "a whole number below 256, or a float";
            let (values, shape) = self.numbers(name, sides, Class::Whole, rule, byte)?;
            return Ok((Values::U8(values), shape[N - 1]));
        }
        let single = |x: f64| Some(x as f32).filter(|x| x.is_finite());
        let rule = "a finite number (as a float of 4 bytes)";
        let (values, shape) = self.numbers(name, sides, Class::Any, rule, single)?;
        Ok((Values::F32(values), shape[N - 1]))
    }

    /// Reads numbers of `class` from the array `name` of `sides`, each converted by `convert`; a
    /// `None` breaks `rule`.
    pub(super) fn numbers<T: Copy + Default, const N: usize>(
        &self,
        name: &str,
        sides: [Option<usize>; N],
        class: Class,
        rule: &str,
        convert: impl Fn(f64) -> Option<T>,
    ) -> Result<(Vec<T>, [usize; N]), Error> {
        let wrong = |expected: &str, found: &str| {
            Error::new(self.path, format!("array {name}"), expected, found)
        };
        if !self.has(name) {
            return Err(wrong(&format!("an array of shape {}", shown(&sides)), "no such array"));
        }
        self.file(name, |bytes| {
            let header = Header::read(bytes)?;
            let is_right = class == Class::Any || header.is_whole();
            let Some(numbers) = header.numbers(bytes)?.filter(|_| is_right) else {
                let expected = if class == Class::Any { "numbers" } else { "whole numbers" };
                return Err(wrong(expected, &format!("dtype {}", header.type_text())));
            };
            let fits = |shape: &[u64; N]| {
                shape.iter().zip(&sides).all(|(n, side)| side.is_none_or(|side| side as u64 == *n))
            };
            let shape = <[u64; N]>::try_from(&*numbers.shape).ok();
            let Some(shape) = shape.filter(fits) else {
                return Err(wrong(&format!("shape {}", shown(&sides)), &tuple(&numbers.shape)));
            };
            let shape = shape.map(|side| side as usize);
            let values = numbers.read(bytes, convert, |_: &ArrayBytes<'_>, at, x| {
                let per_row: usize = shape[1..].iter().product();
                self.wrong(name, at / per_row, rule, format!("{x:?}"))
            })?;
            Ok((values, shape))
        })
    }

    fn text(&self) -> Result<Option<String>, Error> {
        let wrong = |found: String| {
            let expected = "a text without dimensions, as np.array(json.dumps(..))";
            Error::new(self.path, format!("array {KEY}"), expected, found)
        };
        let read = |bytes: &mut ArrayBytes<'_>| {
            let header = Header::read(bytes)?;
            let kind = header.type_text();
            if let Some(shape) = header.shape().filter(|shape| !shape.is_empty()) {
                return Err(wrong(format!("shape {}", tuple(&shape))));
            }
            let width = match kind.trim_start_matches(['<', '>', '|']).as_bytes().first() {
                Some(b'U') => 4,
                Some(b'S') => 1,
                _ => return Err(wrong(format!("dtype {kind}"))),
            };
            let size = bytes.remaining();
            if size > MAX_TEXT {
                return Err(wrong(format!("{size} bytes")));
            }
            let mut text = vec![0; size as usize];
            bytes.fill(&mut text, "text")?;
            bytes.end_of_array()?;
            let letter = |bytes: &[u8]| match *bytes {
                [a] => Some(char::from(a)).filter(char::is_ascii),
                [a, b, c, d] if kind.starts_with('>') => {
                    char::from_u32(u32::from_be_bytes([a, b, c, d]))
                }
                [a, b, c, d] => char::from_u32(u32::from_le_bytes([a, b, c, d])),
                _ => None,
            };
            let text: Option<String> = text.chunks(width).map(letter).collect();
            let text = text.ok_or_else(|| wrong("bytes that are no text".to_owned()))?;
            Ok(text.trim_end_matches('\0').to_owned())
        };
        self.optional(KEY, |name| self.file(name, read))
    }

    /// Calls `read` with a reader of the array `name`.
    fn file<T>(
        &self,
        name: &str,
        read: impl FnOnce(&mut ArrayBytes<'_>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let Some((at, _)) = self.arrays.iter().find(|(_, known)| known == name) else {
            return Err(Error::new(self.path, format!("array {name}"), "an array", "none"));
        };
        let mut archive = self.archive.lock().unwrap_or_else(PoisonError::into_inner);
        read(&mut archive.array(*at, name)?)
    }
}

/// The numbers that an array may have.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    Any,
    Whole,
}

/// Formats an expected shape, with letters for sides of any length.
fn shown(sides: &[Option<usize>]) -> String {
    let letter = |(at, side): (usize, &Option<usize>)| match side {
        Some(n) => n.to_string(),
        None => ["n", "k", "d"][at.min(2)].to_owned(),
    };
    tuple(&sides.iter().enumerate().map(letter).collect::<Vec<_>>())
}
