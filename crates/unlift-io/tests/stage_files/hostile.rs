//! Tests files that declare more than they contain: errors before memory or time is spent.

use crate::tables::message;
use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, ListArray, PrimitiveArray};
use arrow_buffer::OffsetBuffer;
use arrow_schema::{DataType, Field};
use std::fs;
use std::sync::Arc;
use unlift_io::stage;

fn unsigned(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

fn integer(value: i64) -> Vec<u8> {
    unsigned(((value << 1) ^ (value >> 63)) as u64)
}

/// Creates a file without rows whose schema elements have these numbers of children.
fn with_schema(children: &[i64]) -> Vec<u8> {
    let mut footer = [&[0x15][..], &integer(1), &[0x19, 0xfc]].concat();
    footer.extend(unsigned(children.len() as u64));
    for &n in children {
        // The name and the number of children.
        footer.extend([0x48, 1, b'a', 0x15]);
        footer.extend(integer(n));
        footer.push(0);
    }
    footer.extend([&[0x16][..], &integer(0), &[0x19, 0x0c, 0]].concat());
    let length = footer.len() as u32;
    [b"PAR1", &footer[..], &length.to_le_bytes(), b"PAR1"].concat()
}

#[test]
fn schemas_deeper_or_larger_than_tables() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    let line = |bytes: Vec<u8>| {
        fs::write(&path, bytes).unwrap();
        message(&path, stage::peek(&path))
    };
    let deep = line(with_schema(&[1; 4900]));
    let expected = "footer: expected metadata of Parquet, found columns nested more than 32 deep";
    assert_eq!(deep, expected);
    let wide = line(with_schema(&[i64::from(i32::MAX), 0]));
    assert!(
        wide.ends_with("found a schema element with 2147483647 children where 1 elements follow"),
        "{wide}"
    );
    let many = line(with_schema(&vec![0; (1 << 16) + 1]));
    assert!(many.ends_with("found 65537 elements of the schema, more than 65536"), "{many}");
    let mut beyond = with_schema(&[1, 0]);
    let end = beyond.len();
    beyond[end - 8..end - 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let beyond = line(beyond);
    assert!(beyond.starts_with("footer: expected at most "), "{beyond}");
}

/// One list of equal values: 272 MB in memory, 2 kB in the file.
#[test]
fn values_that_nothing_stands_behind() {
    const N: usize = 34_000_000;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    let values: PrimitiveArray<Int32Type> = vec![7; N].into();
    let field = Arc::new(Field::new("item", DataType::Int32, false));
    let offsets = OffsetBuffer::from_lengths([N]);
    let lists: ArrayRef = Arc::new(ListArray::new(field, offsets, Arc::new(values), None));
    crate::tables::write(&path, "", vec![("records", lists)]);
    let size = fs::metadata(&path).unwrap().len();
    assert!(size < 100_000, "{size} bytes");
    let line = message(&path, stage::read_neighborhoods(&path, 1, 1));
    assert!(line.starts_with("column records: expected at most 256 MiB in memory of a"), "{line}");
    assert!(line.ends_with(", found 259.4 MiB"), "{line}");
}
