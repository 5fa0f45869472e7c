//! Reads PCD files of the Point Cloud Library.
//!
//! Our own reader: the crate `pcd-rs` allocates what the header declares, and does not support
//! compression.
//!
//! Source: PCL's documentation, "The PCD (Point Cloud Data) file format", version 0.7.

use std::path::Path;

use super::lzf::unpacked;
use crate::error::Error;
use crate::read::bytes::Bytes;
use crate::read::columns::{self, coordinate};
use crate::read::lines::{Lines, number, quoted, words};
use crate::read::map_input::Input;
use crate::read::scalar::Scalar;
use crate::read::undeclared::undeclared;

#[derive(Clone, Copy, Debug)]
struct Field {
    /// Bytes per value.
    size: u64,
    count: u64,
}

/// A coordinate: its index in a line, its offset in a binary row, and its type.
#[derive(Clone, Copy, Debug)]
struct Axis {
    value: u64,
    byte: u64,
    scalar: Scalar,
}

#[derive(Debug)]
struct Header {
    axes: [Axis; 3],
    /// Values per point.
    n_values: u64,
    /// Bytes per point.
    stride: u64,
    n: u64,
    data: Vec<u8>,
}

pub fn read(path: &Path) -> Result<Input, Error> {
    let mut lines = Lines::open(path)?;
    let header = header(path, &mut lines)?;
    let mut doubt = None;
    let (positions, format) = match &*header.data {
        // Without points, the file size limits nothing.
        _ if header.n == 0 => (Vec::new(), "PCD"),
        b"ascii" => (ascii(lines, &header)?, "PCD ascii"),
        b"binary" => {
            let (positions, more) = binary(lines.into_bytes(), &header)?;
            doubt = undeclared(header.n, more);
            (positions, "PCD binary")
        }
        _ => (compressed(lines.into_bytes(), &header)?, "PCD compressed"),
    };
    Ok(Input { positions, format, doubts: doubt.into_iter().collect(), ..Input::default() })
}

fn header(path: &Path, lines: &mut Lines) -> Result<Header, Error> {
    let (mut names, mut sizes, mut kinds, mut counts) = (Vec::new(), Vec::new(), Vec::new(), None);
    let (mut width, mut height, mut points) = (None, 1, None);
    let data = loop {
        lines.advance_in_header("a PCD header that ends with DATA")?;
        let error = |expected: &str, found| lines.error(expected, found);
        let line = lines.line();
        let words: Vec<&[u8]> = words(line).collect();
        let [word, values @ ..] = &words[..] else { continue };
        let numbers =
            || values.iter().map(|value| number::<u64>(value)).collect::<Option<Vec<_>>>();
        let one = || match numbers().as_deref() {
            Some([one]) => Ok(*one),
            _ => Err(error("one number", quoted(line))),
        };
        match &*word.to_ascii_uppercase() {
            [b'#', ..] | b"VERSION" | b"VIEWPOINT" => {}
            b"FIELDS" | b"COLUMNS" => names = values.iter().map(|name| name.to_vec()).collect(),
            b"SIZE" => {
                let known =
                    numbers().filter(|sizes| sizes.iter().all(|s| [1, 2, 4, 8].contains(s)));
                sizes = known.ok_or_else(|| error("sizes of 1, 2, 4 or 8", quoted(line)))?;
            }
            b"TYPE" => kinds = values.iter().map(|kind| kind.to_vec()).collect(),
            b"COUNT" => {
                let known = numbers().ok_or_else(|| error("counts", quoted(line)))?;
                counts = Some(known);
            }
            b"WIDTH" => width = Some(one()?),
            b"HEIGHT" => height = one()?,
            b"POINTS" => points = Some(one()?),
            b"DATA" => {
                let known: [&[u8]; 3] = [b"ascii", b"binary", b"binary_compressed"];
                match values.iter().map(|data| data.to_ascii_lowercase()).next() {
                    Some(data) if values.len() == 1 && known.contains(&&*data) => break data,
                    _ => {
                        let expected = "DATA ascii, binary or binary_compressed";
                        return Err(error(expected, quoted(line)));
                    }
                }
            }
            _ => return Err(error("a line of a PCD header", quoted(line))),
        }
    };
    let refuse = |expected: &str, found: String| Error::new(path, "header", expected, found);
    let counts = counts.unwrap_or_else(|| vec![1; names.len()]);
    if [sizes.len(), kinds.len(), counts.len()] != [names.len(); 3] {
        let found =
            format!("{}, {}, {} and {}", names.len(), sizes.len(), kinds.len(), counts.len());
        return Err(refuse("as many FIELDS as SIZE, TYPE and COUNT", found));
    }
    let fields = sizes.iter().zip(&counts).map(|(&size, &count)| Field { size, count });
    let fields: Vec<Field> = fields.collect();
    let sum = |part: &dyn Fn(&Field) -> u64, of: &[Field]| {
        of.iter().try_fold(0u64, |sum, field| sum.checked_add(part(field)))
    };
    let bytes = |field: &Field| field.size.saturating_mul(field.count);
    let (Some(n_values), Some(stride)) = (sum(&|f| f.count, &fields), sum(&bytes, &fields)) else {
        return Err(refuse("points of less than 2^64 bytes", "more".to_owned()));
    };
    let at = columns::axes(names.iter().map(Vec::as_slice));
    let at = at.map_err(|name| refuse(&format!("a field {name}"), "none".to_owned()))?;
    let axis = |at: usize| {
        let (field, kind) = (fields[at], &kinds[at]);
        let scalar = kind.first().and_then(|&kind| Scalar::of_kind(kind, field.size));
        let scalar = scalar.filter(|_| field.count == 1 && kind.len() == 1).ok_or_else(|| {
            let (name, kind) = (String::from_utf8_lossy(&names[at]), String::from_utf8_lossy(kind));
            let expected = format!("one value of type F, I or U for {name}");
            refuse(&expected, format!("{kind} {} {}", field.size, field.count))
        })?;
        // The totals were checked above.
        let before = &fields[..at];
        let value = before.iter().map(|field| field.count).sum();
        Ok(Axis { value, byte: before.iter().map(bytes).sum(), scalar })
    };
    let axes = [axis(at[0])?, axis(at[1])?, axis(at[2])?];
    let of_width = width.and_then(|width: u64| width.checked_mul(height));
    let n = points
        .or(of_width)
        .ok_or_else(|| refuse("POINTS, or WIDTH and HEIGHT", "neither".to_owned()))?;
    Ok(Header { axes, n_values, stride, n, data })
}

fn ascii(mut lines: Lines, header: &Header) -> Result<Vec<[f64; 3]>, Error> {
    lines.expect_room(header.n, "points", header.n_values)?;
    let mut positions = lines.room("points", header.n)?;
    for at in 1..=header.n {
        if !lines.advance_to_data()? {
            return Err(lines.end_error(format!("point {at} of {}", header.n)));
        }
        let mut position = [f64::NAN; 3];
        let mut n_words = 0;
        let words = lines.line().split(|byte| byte.is_ascii_whitespace() || *byte == b',');
        for word in words.filter(|word| !word.is_empty()) {
            for (axis, value) in header.axes.iter().zip(&mut position) {
                if axis.value == n_words {
                    *value = coordinate(word)
                        .ok_or_else(|| lines.error("a number for a coordinate", quoted(word)))?;
                }
            }
            n_words += 1;
        }
        if n_words != header.n_values {
            let expected = format!("{} values of point {at}", header.n_values);
            return Err(lines.error(expected, n_words.to_string()));
        }
        positions.push(position);
    }
    if lines.advance_to_data()? {
        let expected = format!("end of file after {} points", header.n);
        return Err(lines.error(expected, quoted(lines.line())));
    }
    Ok(positions)
}

/// Reads the points, and returns how many more fit into the rest of the file.
fn binary(mut bytes: Bytes, header: &Header) -> Result<(Vec<[f64; 3]>, u64), Error> {
    let (n, stride) = (header.n, header.stride);
    bytes.expect_rows(n, "points", stride)?;
    let mut row = vec![0; stride as usize];
    let mut positions = bytes.room("points", n)?;
    for number in 1..=n {
        bytes.record(number);
        bytes.fill(&mut row, "point")?;
        positions.push(header.axes.map(|axis| axis.scalar.read(&row[axis.byte as usize..], false)));
    }
    let more = bytes.remaining() / stride;
    Ok((positions, if bytes.is_padding()? { 0 } else { more }))
}

/// The decompressed data has all values of the first field, then of the next one.
fn compressed(mut bytes: Bytes, header: &Header) -> Result<Vec<[f64; 3]>, Error> {
    let packed = u64::from(bytes.u32("the size of the compressed points")?);
    let size = u64::from(bytes.u32("the size of the points")?);
    let (n, stride) = (header.n, header.stride);
    if n.checked_mul(stride) != Some(size) {
        return Err(
            bytes.error(format!("{n} points, {stride} bytes each"), format!("{size} bytes"))
        );
    }
    if packed > bytes.remaining() {
        let expected = format!("{packed} bytes of compressed points");
        return Err(bytes.error_ahead(expected, bytes.remaining().to_string()));
    }
    bytes.admit("points", size.saturating_add(n.saturating_mul(24)))?;
    let mut values = vec![0; packed as usize];
    bytes.fill(&mut values, "compressed points")?;
    let Some(values) = unpacked(&values, size as usize) else {
        let expected = format!("{size} bytes after decompression");
        return Err(bytes.error(expected, "another size, or damaged data"));
    };
    let at = |axis: &Axis, point: u64| {
        let start = n * axis.byte + axis.scalar.size() as u64 * point;
        axis.scalar.read(&values[start as usize..], false)
    };
    Ok((0..n).map(|point| header.axes.each_ref().map(|axis| at(axis, point))).collect())
}
