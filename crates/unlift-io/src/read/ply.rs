//! PLY point clouds: the positions of the element `vertex`, ascii or binary.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use crate::error::{Error, Place};
use crate::input;
use crate::read::bytes::Bytes;
use crate::read::lines::{Lines, number, quoted, words};
use crate::read::undeclared::undeclared;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

#[derive(Debug)]
struct Element {
    name: Vec<u8>,
    count: u64,
    /// Name and type; the type of a list is `None`.
    properties: Vec<(Vec<u8>, Option<Scalar>)>,
}

impl Element {
    fn has_list(&self) -> bool {
        self.properties.iter().any(|(_, scalar)| scalar.is_none())
    }

    /// Bytes of one row in a binary file, without lists.
    fn stride(&self) -> usize {
        self.properties.iter().map(|(_, scalar)| scalar.map_or(0, Scalar::size)).sum()
    }
}

/// The position of a coordinate in a row: which property, at which byte, of which type.
#[derive(Clone, Copy)]
struct Axis {
    property: usize,
    offset: usize,
    is_f64: bool,
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// Index of `vertex` in `elements`.
    vertex: usize,
    axes: [Axis; 3],
    n_lines: u64,
    n_bytes: u64,
}

/// Reads the positions `(n, 3)` of a PLY file, and says which form it has, and why the points may be too few.
///
/// Coordinates are `float` or `double`; other properties and elements are skipped.
///
/// # Errors
/// When the file cannot be read, is malformed, has lists in or (if binary) before its vertices,
/// declares more or fewer vertices than it holds, or has a coordinate that is not finite.
pub fn read(path: &Path) -> Result<(Vec<[f64; 3]>, &'static str, Vec<String>), Error> {
    let (file, len) = input::open(path)?;
    let mut reader = BufReader::new(file);
    let header = header(path, &mut reader)?;
    let ((positions, more), format) = match header.encoding {
        Encoding::Ascii => (ascii(path, reader, &header, len)?, "ply ascii"),
        Encoding::Little => (binary(path, reader, &header, len)?, "ply binary little endian"),
        Encoding::Big => (binary(path, reader, &header, len)?, "ply binary big endian"),
    };
    let doubt = undeclared(positions.len() as u64, more);
    Ok((positions, format, doubt.into_iter().collect()))
}

fn header(path: &Path, reader: &mut BufReader<std::fs::File>) -> Result<Header, Error> {
    /// Longest header: long comments are fine, a file without line ends is not read to its end.
    const LONGEST: u64 = 1 << 20;
    let mut limited = reader.take(LONGEST);
    let (mut n_lines, mut n_bytes) = (0, 0);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut line = Vec::new();
    loop {
        line.clear();
        let read = limited.read_until(b'\n', &mut line).map_err(|e| Error::read(path, e))?;
        n_lines += 1;
        n_bytes += read as u64;
        let error =
            |expected: &str, found: String| Error::new(path, Place::Line(n_lines), expected, found);
        if n_lines == 1 {
            if line.trim_ascii() != b"ply" {
                let found = match read {
                    0 => "end of file".to_owned(),
                    _ => quoted(line.trim_ascii()),
                };
                return Err(error("\"ply\", as every PLY file begins", found));
            }
            continue;
        }
        if !line.ends_with(b"\n") {
            return Err(error("a header that ends with end_header", "end of file".into()));
        }
        let words: Vec<&[u8]> = words(&line).collect();
        match words[..] {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, _version] => {
                encoding = Some(match name {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    _ => {
                        let expected = "ascii, binary_little_endian or binary_big_endian";
                        return Err(error(expected, quoted(name)));
                    }
                });
            }
            [b"element", name, count] => {
                let count =
                    number(count).ok_or_else(|| error("the number of elements", quoted(count)))?;
                elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
            }
            [b"property", ref rest @ ..] => {
                let element = elements.last_mut().ok_or_else(|| {
                    error("an element before its properties", quoted(line.trim_ascii()))
                })?;
                let (name, scalar) = match *rest {
                    [kind, name] => {
                        let scalar = Scalar::from_name(kind)
                            .ok_or_else(|| error("the type of a property", quoted(kind)))?;
                        (name, Some(scalar))
                    }
                    [b"list", _, _, name] => (name, None),
                    _ => {
                        let found = quoted(line.trim_ascii());
                        return Err(error("property TYPE NAME", found));
                    }
                };
                element.properties.push((name.to_vec(), scalar));
            }
            [b"end_header"] => break,
            _ => return Err(error("a line of a PLY header", quoted(line.trim_ascii()))),
        }
    }
    let refuse = |expected: &str, found: String| Error::new(path, "header", expected, found);
    let encoding = encoding.ok_or_else(|| refuse("a line with the format", "none".into()))?;
    let vertex = elements
        .iter()
        .position(|e| e.name == b"vertex")
        .ok_or_else(|| refuse("an element vertex", "none".into()))?;
    if elements[vertex].has_list() {
        let expected = "vertices of fixed size";
        return Err(refuse(expected, "a list property in element vertex".into()));
    }
    if encoding != Encoding::Ascii
        && let Some(list) = elements[..vertex].iter().find(|e| e.has_list())
    {
        let found = format!("{} with a list property", quoted(&list.name));
        return Err(refuse("elements of fixed size before vertex", found));
    }
    let mut axes = [Axis { property: 0, offset: 0, is_f64: false }; 3];
    for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
        let mut offset = 0;
        let mut found = None;
        for (property, (its_name, scalar)) in elements[vertex].properties.iter().enumerate() {
            let scalar = scalar.expect("lists were refused above");
            if its_name == name.as_bytes() {
                found = Some((property, offset, scalar));
                break;
            }
            offset += scalar.size();
        }
        let expected = format!("a property {name} of type float or double in element vertex");
        let (property, offset, scalar) = found.ok_or_else(|| refuse(&expected, "none".into()))?;
        let is_f64 = match scalar {
            Scalar::F32 => false,
            Scalar::F64 => true,
            _ => return Err(refuse(&expected, "an integer type".into())),
        };
        *axis = Axis { property, offset, is_f64 };
    }
    Ok(Header { encoding, elements, vertex, axes, n_lines, n_bytes })
}

fn ascii(
    path: &Path,
    reader: BufReader<std::fs::File>,
    header: &Header,
    len: u64,
) -> Result<(Vec<[f64; 3]>, u64), Error> {
    let vertex = &header.elements[header.vertex];
    let n_properties = vertex.properties.len();
    // A value takes a digit and a separator; the last one of the file only the digit.
    let most = (len.saturating_sub(header.n_bytes) + 1) / (2 * n_properties as u64);
    if vertex.count > most {
        let expected = format!("at most {most} vertices (by the size of the file)");
        return Err(Error::new(path, "header", expected, vertex.count.to_string()));
    }
    let mut lines = Lines::continuing(path, reader, header.n_lines);
    let advance = |lines: &mut Lines, what: &str, row: u64, count: u64| loop {
        if !lines.advance()? {
            return Err(lines.end_error(format!("{what} {} of {count}", row + 1)));
        }
        if !lines.line().is_empty() {
            return Ok(());
        }
    };
    for element in &header.elements[..header.vertex] {
        let name = String::from_utf8_lossy(&element.name);
        for row in 0..element.count {
            advance(&mut lines, &name, row, element.count)?;
        }
    }
    let mut positions = input::Budget::new(path, len).room("vertices", vertex.count)?;
    for row in 0..vertex.count {
        advance(&mut lines, "vertex", row, vertex.count)?;
        let mut position = [f64::NAN; 3];
        let mut n_words = 0;
        for (property, word) in words(lines.line()).enumerate() {
            n_words += 1;
            for (axis, name) in [0, 1, 2].into_iter().zip(["x", "y", "z"]) {
                if header.axes[axis].property == property {
                    position[axis] = number(word)
                        .ok_or_else(|| lines.error(format!("a number for {name}"), quoted(word)))?;
                }
            }
        }
        if n_words != n_properties {
            let expected = format!("{n_properties} values of vertex {}", row + 1);
            return Err(lines.error(expected, n_words.to_string()));
        }
        if position.iter().any(|x| !x.is_finite()) {
            let expected = format!("finite coordinates of vertex {}", row + 1);
            return Err(lines.error(expected, format!("{position:?}")));
        }
        positions.push(position);
    }
    let behind = &header.elements[header.vertex + 1..];
    let mut n_rows = 0u64;
    while lines.advance()? {
        n_rows += u64::from(!lines.line().is_empty());
        if n_rows > 0 && behind.is_empty() {
            let expected = format!("end of file after {} vertices", vertex.count);
            return Err(lines.error(expected, quoted(lines.line())));
        }
    }
    let declared = behind.iter().fold(0u64, |sum, element| sum.saturating_add(element.count));
    Ok((positions, n_rows.saturating_sub(declared)))
}

fn binary(
    path: &Path,
    reader: BufReader<std::fs::File>,
    header: &Header,
    len: u64,
) -> Result<(Vec<[f64; 3]>, u64), Error> {
    let mut bytes = Bytes::continuing(path, reader, header.n_bytes, len);
    let fits = |bytes: &Bytes, element: &Element| {
        let stride = element.stride() as u64;
        let size = element.count.checked_mul(stride);
        size.filter(|&s| s <= bytes.remaining()).ok_or_else(|| {
            let name = String::from_utf8_lossy(&element.name);
            let expected = format!("{} rows of {name}, {stride} bytes each", element.count);
            bytes.error_ahead(expected, format!("{} bytes", bytes.remaining()))
        })
    };
    for element in &header.elements[..header.vertex] {
        let size = fits(&bytes, element)?;
        bytes.skip(size, "an element before vertex")?;
    }
    let vertex = &header.elements[header.vertex];
    fits(&bytes, vertex)?;
    let big = header.encoding == Encoding::Big;
    let mut row = vec![0; vertex.stride()];
    let mut positions = bytes.room("vertices", vertex.count)?;
    for number in 1..=vertex.count {
        bytes.record(number);
        bytes.fill(&mut row, "vertex")?;
        let position = header.axes.map(|axis| coordinate(&row, axis, big));
        if position.iter().any(|x| !x.is_finite()) {
            let expected = format!("finite coordinates of vertex {number}");
            return Err(bytes.error(expected, format!("{position:?}")));
        }
        positions.push(position);
    }
    let behind = &header.elements[header.vertex + 1..];
    if behind.is_empty() {
        bytes.end()?;
    }
    // Of lists only their values say how long they are.
    let size = |sum: u64, element: &Element| {
        sum.saturating_add(element.count.saturating_mul(element.stride() as u64))
    };
    let declared = match behind.iter().any(Element::has_list) {
        true => u64::MAX,
        false => behind.iter().fold(0, size),
    };
    let more = bytes.remaining().saturating_sub(declared);
    Ok((positions, more / (vertex.stride() as u64).max(1)))
}

fn coordinate(row: &[u8], axis: Axis, big: bool) -> f64 {
    let at = |n: usize| &row[axis.offset..axis.offset + n];
    if axis.is_f64 {
        let bits: [u8; 8] = at(8).try_into().expect("eight bytes");
        if big { f64::from_be_bytes(bits) } else { f64::from_le_bytes(bits) }
    } else {
        let bits: [u8; 4] = at(4).try_into().expect("four bytes");
        f64::from(if big { f32::from_be_bytes(bits) } else { f32::from_le_bytes(bits) })
    }
}
