//! Writes HDF5 object headers of groups and arrays.
//!
//! Source: HDF5 File Format Specification 3.0, IV.A, headers of version 1, which every reader
//! supports.

use super::{Array, Numbers};

/// The undefined address or length.
pub(super) const UNDEFINED: u64 = u64::MAX;

pub(super) fn pad(bytes: &mut Vec<u8>) {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
}

fn message(header: &mut Vec<u8>, kind: u16, mut body: Vec<u8>) {
    pad(&mut body);
    header.extend(kind.to_le_bytes());
    header.extend((body.len() as u16).to_le_bytes());
    header.extend([0; 4]);
    header.extend(body);
}

fn header(messages: u16, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![1, 0];
    bytes.extend(messages.to_le_bytes());
    bytes.extend(1u32.to_le_bytes());
    bytes.extend((body.len() as u32).to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(body);
    bytes
}

/// Writes the header of a group with its tree and heap at these addresses.
pub(super) fn group(tree: u64, heap: u64) -> Vec<u8> {
    let mut body = Vec::new();
    let addresses = [tree.to_le_bytes(), heap.to_le_bytes()].concat();
    message(&mut body, 0x11, addresses);
    header(1, &body)
}

/// Writes the header of a dataset with `len` bytes at `address` and with `f64` attributes.
pub(super) fn dataset(
    array: &Array,
    address: u64,
    len: u64,
    attributes: &[(&str, f64)],
) -> Vec<u8> {
    let mut body = Vec::new();
    message(&mut body, 0x01, dataspace(&array.shape));
    message(&mut body, 0x03, datatype(&array.values));
    // Fill value message: late allocation, fill value written if set, none set.
    message(&mut body, 0x05, vec![2, 2, 2, 1, 0, 0, 0, 0]);
    let mut layout = vec![3, 1];
    layout.extend(if len == 0 { UNDEFINED } else { address }.to_le_bytes());
    layout.extend(len.to_le_bytes());
    message(&mut body, 0x08, layout);
    for (name, value) in attributes {
        message(&mut body, 0x0c, attribute(name, *value));
    }
    header(4 + attributes.len() as u16, &body)
}

fn dataspace(shape: &[u64]) -> Vec<u8> {
    let mut bytes = vec![1, shape.len() as u8, 0, 0, 0, 0, 0, 0];
    bytes.extend(shape.iter().flat_map(|side| side.to_le_bytes()));
    bytes
}

fn datatype(values: &Numbers) -> Vec<u8> {
    match values {
        Numbers::U8(_) => integer(1, false),
        Numbers::I64(_) => integer(8, true),
        Numbers::F16(_) => float(2, 10, 5, 15),
        Numbers::F32(_) => float(4, 23, 8, 127),
        Numbers::F64(_) => float(8, 52, 11, 1023),
    }
}

fn integer(size: u32, signed: bool) -> Vec<u8> {
    let mut bytes = vec![0x10, if signed { 8 } else { 0 }, 0, 0];
    bytes.extend(size.to_le_bytes());
    bytes.extend([0, 0]);
    bytes.extend((8 * size as u16).to_le_bytes());
    bytes
}

fn float(size: u32, mantissa: u8, exponent: u8, bias: u32) -> Vec<u8> {
    let bits = 8 * size as u16;
    // Little-endian, implied leading bit of the mantissa, sign in the highest bit.
    let mut bytes = vec![0x11, 0x20, bits as u8 - 1, 0];
    bytes.extend(size.to_le_bytes());
    bytes.extend([0, 0]);
    bytes.extend(bits.to_le_bytes());
    bytes.extend([mantissa, exponent, 0, mantissa]);
    bytes.extend(bias.to_le_bytes());
    bytes
}

fn attribute(name: &str, value: f64) -> Vec<u8> {
    let mut parts =
        [[name.as_bytes(), &[0]].concat(), datatype(&Numbers::F64(Vec::new())), dataspace(&[])];
    let mut bytes = vec![1, 0];
    bytes.extend(parts.iter().flat_map(|part| (part.len() as u16).to_le_bytes()));
    for part in &mut parts {
        pad(part);
        bytes.append(part);
    }
    bytes.extend(value.to_le_bytes());
    bytes
}
