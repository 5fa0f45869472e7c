//! Reads the vertices of PLY point clouds, and the centers of splats.

use std::path::Path;

use super::bytes::{Bytes, Scalar};
use super::lines::{Lines, coordinate, is_called, number, quoted, words};
use super::map_input::{Input, undeclared};
use crate::error::Error;

/// An encoding: its name for users, and, of a binary one, whether it is big-endian.
type Encoding = (&'static str, Option<bool>);

fn scalar(name: &[u8]) -> Option<Scalar> {
    let (kind, size) = match name {
        b"char" | b"int8" => (b'i', 1),
        b"uchar" | b"uint8" => (b'u', 1),
        b"short" | b"int16" => (b'i', 2),
        b"ushort" | b"uint16" => (b'u', 2),
        b"int" | b"int32" => (b'i', 4),
        b"uint" | b"uint32" => (b'u', 4),
        b"int64" => (b'i', 8),
        b"uint64" => (b'u', 8),
        b"float" | b"float32" => (b'f', 4),
        b"double" | b"float64" => (b'f', 8),
        _ => return None,
    };
    Scalar::of_kind(kind, size)
}

struct Property {
    name: Vec<u8>,
    scalar: Scalar,
    /// The type of the length, for a list.
    list: Option<Scalar>,
}

struct Element {
    name: Vec<u8>,
    count: u64,
    properties: Vec<Property>,
}

impl Element {
    fn has_list(&self) -> bool {
        self.properties.iter().any(|property| property.list.is_some())
    }

    /// Bytes of one row in a binary file, with empty lists.
    fn stride(&self) -> usize {
        let size = |property: &Property| property.list.unwrap_or(property.scalar).size;
        self.properties.iter().map(size).sum()
    }

    /// Finds the properties with these names that are not lists.
    fn find<const N: usize>(&self, names: [&'static str; N]) -> Result<[usize; N], &'static str> {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            let called = |p: &Property| p.list.is_none() && is_called(&p.name, name.as_bytes());
            *place = self.properties.iter().position(called).ok_or(name)?;
        }
        Ok(places)
    }
}

/// Reads the positions of the vertices, of any numeric type.
pub fn read(path: &Path) -> Result<Input, Error> {
    let mut lines = Lines::open(path)?;
    let ((format, big_endian), elements) = header(path, &mut lines)?;
    let refuse = |expected: String| Error::new(path, "header", expected, "none");
    let vertex = elements.iter().position(|e| e.name == b"vertex");
    let vertex = vertex.ok_or_else(|| refuse("an element vertex".to_owned()))?;
    let element = &elements[vertex];
    let axes =
        element.find(["x", "y", "z"]).map_err(|name| match element.find(["packed_position"]) {
            Ok(_) => {
                Error::new(path, "header", "x, y and z", "packed splats (export them unpacked)")
            }
            Err(_) => refuse(format!("a property {name} in element vertex")),
        })?;
    let mut rows = match big_endian {
        None => {
            lines.expect_room(element.count, "vertices", element.properties.len() as u64)?;
            Rows::Ascii(lines)
        }
        Some(big) => Rows::Binary(lines.into_bytes(), big),
    };
    for before in &elements[..vertex] {
        rows.read(before, [])?;
    }
    let positions = rows.read(element, axes)?;
    let more = rows.more(element, &elements[vertex + 1..])?;
    let is_splat = element.find(["opacity", "scale_0", "rot_0"]).is_ok();
    Ok(Input {
        positions,
        format,
        notes: is_splat.then(|| SPLATS.to_owned()).into_iter().collect(),
        doubts: undeclared(element.count, more).into_iter().collect(),
        ..Input::default()
    })
}

const SPLATS: &str = "Gaussian splats: only their centers are read";
/// Reads the centers of splats in antimatter15's format: 32 bytes each, which begin with three floats.
pub fn splats(path: &Path) -> Result<Input, Error> {
    const SPLAT: u64 = 32;
    let mut bytes = Bytes::open(path)?;
    let n = bytes.remaining() / SPLAT;
    if !bytes.remaining().is_multiple_of(SPLAT) {
        let found = format!("{} bytes", bytes.remaining());
        return Err(bytes.error_ahead(format!("splats of {SPLAT} bytes each"), found));
    }
    let mut row = [0; SPLAT as usize];
    let mut positions = bytes.room("splats", n)?;
    for _ in 0..n {
        bytes.fill(&mut row, "splat")?;
        let floats = row.as_chunks().0;
        positions.push(std::array::from_fn(|axis| f64::from(f32::from_le_bytes(floats[axis]))));
    }
    Ok(Input { positions, format: "splat", notes: vec![SPLATS.to_owned()], ..Input::default() })
}

fn header(path: &Path, lines: &mut Lines) -> Result<(Encoding, Vec<Element>), Error> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let begins = "\"ply\", as every PLY file begins";
    lines.expect_line(begins)?;
    if lines.line() != b"ply" {
        return Err(lines.error(begins, quoted(lines.line())));
    }
    loop {
        lines.expect_line("a header that ends with end_header")?;
        let line = lines.line();
        let words: Vec<&[u8]> = words(line).collect();
        match words[..] {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, _version] => {
                let expected = "ascii, binary_little_endian or binary_big_endian";
                encoding = Some(match name {
                    b"ascii" => ("ply ascii", None),
                    b"binary_little_endian" => ("ply binary little endian", Some(false)),
                    b"binary_big_endian" => ("ply binary big endian", Some(true)),
                    _ => return Err(lines.error(expected, quoted(name))),
                });
            }
            [b"element", name, count] => {
                let count = number(count)
                    .ok_or_else(|| lines.error("the number of elements", quoted(count)))?;
                elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
            }
            [b"property", ref rest @ ..] => {
                let Some(element) = elements.last_mut() else {
                    return Err(lines.error("an element before its properties", quoted(line)));
                };
                let known = |kind: &[u8]| {
                    scalar(kind).ok_or_else(|| lines.error("the type of a property", quoted(kind)))
                };
                let (name, scalar, list) = match *rest {
                    [kind, name] => (name, known(kind)?, None),
                    [b"list", count, kind, name] => (name, known(kind)?, Some(known(count)?)),
                    _ => return Err(lines.error("property TYPE NAME", quoted(line))),
                };
                element.properties.push(Property { name: name.to_vec(), scalar, list });
            }
            [b"end_header"] => break,
            _ => return Err(lines.error("a line of a PLY header", quoted(line))),
        }
    }
    let encoding =
        encoding.ok_or_else(|| Error::new(path, "header", "a line with the format", "none"))?;
    Ok((encoding, elements))
}

enum Rows {
    Ascii(Lines),
    /// True if the file is big-endian.
    Binary(Bytes, bool),
}

impl Rows {
    /// Reads the values of the properties `wanted` in every row of `element`.
    fn read<const N: usize>(
        &mut self,
        element: &Element,
        wanted: [usize; N],
    ) -> Result<Vec<[f64; N]>, Error> {
        match self {
            Self::Ascii(lines) => ascii(lines, element, wanted),
            Self::Binary(bytes, big) => binary(bytes, *big, element, wanted),
        }
    }

    /// Returns how many undeclared vertices fit into the rest of the file, given the elements after
    /// `vertex`. If there are none, the file must end.
    fn more(&mut self, vertex: &Element, behind: &[Element]) -> Result<u64, Error> {
        match self {
            Self::Ascii(lines) => {
                let mut n_rows = 0u64;
                while lines.advance()? {
                    n_rows += u64::from(!lines.line().is_empty());
                    if n_rows > 0 && behind.is_empty() {
                        let expected = format!("end of file after {} vertices", vertex.count);
                        return Err(lines.error(expected, quoted(lines.line())));
                    }
                }
                let declared = behind.iter().fold(0, |sum: u64, it| sum.saturating_add(it.count));
                Ok(n_rows.saturating_sub(declared))
            }
            Self::Binary(bytes, _) => {
                // The size of lists is unknown until they are read.
                if behind.iter().any(Element::has_list) {
                    return Ok(0);
                }
                if behind.is_empty() {
                    bytes.end()?;
                }
                let size = |it: &Element| it.count.saturating_mul(it.stride() as u64);
                let declared = behind.iter().fold(0, |sum: u64, it| sum.saturating_add(size(it)));
                Ok(bytes.remaining().saturating_sub(declared) / vertex.stride() as u64)
            }
        }
    }
}

fn ascii<const N: usize>(
    lines: &mut Lines,
    element: &Element,
    wanted: [usize; N],
) -> Result<Vec<[f64; N]>, Error> {
    let name = String::from_utf8_lossy(&element.name);
    let mut rows = lines.room(&name, if N == 0 { 0 } else { element.count })?;
    for row in 1..=element.count {
        loop {
            if !lines.advance()? {
                return Err(lines.end_error(format!("{name} {row} of {}", element.count)));
            }
            if !lines.line().is_empty() {
                break;
            }
        }
        if N == 0 {
            continue;
        }
        let mut values = [f64::NAN; N];
        let mut all = words(lines.line());
        let (mut n_words, mut n_expected) = (0, element.properties.len());
        for (at, property) in element.properties.iter().enumerate() {
            let Some(word) = all.next() else { break };
            n_words += 1;
            if property.list.is_some() {
                let n: usize = number(word)
                    .ok_or_else(|| lines.error("the length of a list", quoted(word)))?;
                n_expected = n_expected.saturating_add(n);
                n_words += all.by_ref().take(n).count();
            } else if let Some(slot) = wanted.iter().position(|&wanted| wanted == at) {
                values[slot] = coordinate(word).ok_or_else(|| {
                    let name = String::from_utf8_lossy(&property.name);
                    lines.error(format!("a number for {name}"), quoted(word))
                })?;
            }
        }
        n_words += all.count();
        if n_words != n_expected {
            return Err(lines.error(format!("{n_expected} values of {name} {row}"), n_words));
        }
        rows.push(values);
    }
    Ok(rows)
}

fn binary<const N: usize>(
    bytes: &mut Bytes,
    big: bool,
    element: &Element,
    wanted: [usize; N],
) -> Result<Vec<[f64; N]>, Error> {
    let name = String::from_utf8_lossy(&element.name);
    let what = format!("rows of {name}");
    let size = bytes.expect_rows(element.count, &what, element.stride() as u64)?;
    if N == 0 && !element.has_list() {
        bytes.skip(size, "an element before vertex")?;
        return Ok(Vec::new());
    }
    let mut rows = bytes.room(&name, if N == 0 { 0 } else { element.count })?;
    for number in 1..=element.count {
        bytes.record(number);
        let mut values = [f64::NAN; N];
        for (at, Property { scalar, list, .. }) in element.properties.iter().enumerate() {
            let stored = list.unwrap_or(*scalar);
            let buffer = &mut [0; 8][..stored.size];
            bytes.fill(buffer, &name)?;
            let value = stored.read(buffer, big);
            if list.is_some() {
                if value < 0.0 || value.fract() != 0.0 {
                    return Err(bytes.error("the length of a list", value));
                }
                bytes.skip((value as u64).saturating_mul(scalar.size as u64), "a list")?;
            } else if let Some(slot) = wanted.iter().position(|&wanted| wanted == at) {
                values[slot] = value;
            }
        }
        rows.push(values);
    }
    Ok(rows)
}
