//! LAS 1.0 to 1.4, uncompressed: a head that says where points begin, how long each is and what its integers are multiplied by.
//!
//! A reader of our own rather than the crate `las`: that takes as much memory as a record behind the points says that it
//! has, so that all heads would have to be read before it is asked; behind them, positions are three integers.
//!
//! Source: ASPRS, "LAS Specification 1.4 - R15".

use std::path::Path;

use super::scan::Scan;
use crate::error::Error;
use crate::read::bytes::Bytes;
use crate::read::lines::quoted;
use crate::read::undeclared::undeclared;

/// Bytes of the heads of all versions up to the numbers that positions are made with.
const HEAD: usize = 179;
/// Where version 1.4 has the number of points, and the bytes of its head.
const COUNT_1_4: usize = 247;
const HEAD_1_4: usize = 375;
/// Bytes of a point at least, by format.
const LEAST: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
/// Where the heads of versions 1.3 and 1.4 say that waveforms begin, and that of 1.4 more records.
const WAVES: usize = 227;
const EXTENDED_1_4: usize = 235;
/// Formats have these bits where a program compressed the points.
const COMPRESSED: u8 = 0b1100_0000;

/// Reads the positions.
///
/// # Errors
/// When the file is none, is compressed, is cut off, or has a coordinate that is not finite.
pub fn read(path: &Path) -> Result<Scan, Error> {
    let mut bytes = Bytes::open(path)?;
    let mut head = [0; HEAD_1_4];
    bytes.fill(&mut head[..HEAD], "the head")?;
    if &head[..4] != b"LASF" {
        return Err(bytes.error("\"LASF\", as every LAS file begins", quoted(&head[..4])));
    }
    let (version, format) = ((head[24], head[25]), head[104]);
    if version.0 != 1 || version.1 > 4 {
        let found = format!("{}.{}", version.0, version.1);
        return Err(bytes.error("LAS 1.0 to 1.4", found));
    }
    if format & COMPRESSED != 0 {
        let found = "compressed points, LAZ (pdal translate IN.laz OUT.las makes one that is read)";
        return Err(bytes.error("points as they are", found));
    }
    let short = |at: usize| u16::from_le_bytes([head[at], head[at + 1]]);
    let (head_size, record) = (short(94), short(105));
    let least = LEAST.get(usize::from(format)).copied();
    let Some(least) = least else {
        return Err(bytes.error("a point format from 0 to 10", format.to_string()));
    };
    if record < least {
        let expected = format!("points of at least {least} bytes, as format {format} has them");
        return Err(bytes.error(expected, record.to_string()));
    }
    let long = |head: &[u8], at: usize| {
        u64::from(u32::from_le_bytes(std::array::from_fn(|byte| head[at + byte])))
    };
    let wide =
        |head: &[u8], at: usize| u64::from_le_bytes(std::array::from_fn(|byte| head[at + byte]));
    let (start, mut n) = (long(&head, 96), long(&head, 107));
    let double = |at: usize| f64::from_le_bytes(std::array::from_fn(|byte| head[at + byte]));
    let scale: [f64; 3] = std::array::from_fn(|axis| double(131 + 8 * axis));
    let offset: [f64; 3] = std::array::from_fn(|axis| double(155 + 8 * axis));
    let mut at = HEAD;
    if version.1 == 4 && usize::from(head_size) >= HEAD_1_4 {
        bytes.fill(&mut head[HEAD..], "the head")?;
        at = HEAD_1_4;
        let all = wide(&head, COUNT_1_4);
        n = if all == 0 { n } else { all };
    }
    let Some(behind) = start.checked_sub(at as u64) else {
        let expected = format!("points behind the head of {at} bytes");
        return Err(bytes.error(expected, format!("at byte {start}")));
    };
    bytes.skip(behind, "what stands before the points")?;
    // What may stand behind the points.
    let behind = match version.1 {
        4 if at == HEAD_1_4 => [wide(&head, WAVES), wide(&head, EXTENDED_1_4)],
        _ => [0; 2],
    };
    let size = n.checked_mul(u64::from(record));
    if size.is_none_or(|size| size > bytes.remaining()) {
        let expected = format!("{n} points, {record} bytes each");
        return Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())));
    }
    let mut row = vec![0; usize::from(record)];
    let mut positions = bytes.room("points", n)?;
    for number in 1..=n {
        bytes.record(number);
        bytes.fill(&mut row, "point")?;
        let integer =
            |axis: usize| i32::from_le_bytes(std::array::from_fn(|at| row[4 * axis + at]));
        let position: [f64; 3] =
            std::array::from_fn(|axis| f64::from(integer(axis)) * scale[axis] + offset[axis]);
        if position.iter().any(|x| !x.is_finite()) {
            let expected = format!("finite coordinates of point {number}");
            return Err(bytes.error(expected, format!("{position:?}")));
        }
        positions.push(position);
    }
    let end = bytes.at();
    let next = behind.into_iter().filter(|&next| next >= end).min();
    let more = next.map_or(bytes.remaining(), |next| next - end) / u64::from(record);
    let mut scan = Scan::new(positions, "LAS", 0);
    // Of 1.3 the head does not say where waveforms are.
    scan.doubts.extend(undeclared(n, more).filter(|_| version.1 != 3));
    Ok(scan)
}
