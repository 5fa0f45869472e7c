//! Reads LAS 1.0 to 1.4, uncompressed.
//!
//! Our own reader: the crate `las` allocates what records after the points declare, and a position
//! is just three integers.
//!
//! Source: ASPRS, "LAS Specification 1.4 - R15".

use std::path::Path;

use super::is_geographic;
use crate::error::Error;
use crate::read::bytes::Bytes;
use crate::read::lines::quoted;
use crate::read::map_input::Input;
use crate::read::undeclared::undeclared;

/// The common part of all headers, up to scale and offset of positions.
const HEAD: usize = 179;
/// The offset of the number of points in version 1.4, and the size of its header.
const COUNT_1_4: usize = 247;
const HEAD_1_4: usize = 375;
/// The minimum size of a point in bytes, by point format.
const LEAST: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
/// Header offsets: where waveforms start (1.3, 1.4), and where extended records start (1.4).
const WAVES: usize = 227;
const EXTENDED_1_4: usize = 235;
const COMPRESSED: u8 = 0b1100_0000;

pub fn read(path: &Path) -> Result<Input, Error> {
    let mut bytes = Bytes::open(path)?;
    let mut head = [0; HEAD_1_4];
    bytes.fill(&mut head[..HEAD], "the header")?;
    if &head[..4] != b"LASF" {
        return Err(bytes.error("\"LASF\", as every LAS file begins", quoted(&head[..4])));
    }
    let (version, format) = ((head[24], head[25]), head[104]);
    if version.0 != 1 || version.1 > 4 {
        let found = format!("{}.{}", version.0, version.1);
        return Err(bytes.error("LAS 1.0 to 1.4", found));
    }
    if format & COMPRESSED != 0 {
        let found = "compressed points, LAZ (convert it: pdal translate IN.laz OUT.las)";
        return Err(bytes.error("uncompressed points", found));
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
    let mut at = HEAD as u64;
    if version.1 == 4 && usize::from(head_size) >= HEAD_1_4 {
        bytes.fill(&mut head[HEAD..], "the header")?;
        at = HEAD_1_4 as u64;
        let all = wide(&head, COUNT_1_4);
        n = if all == 0 { n } else { all };
    }
    if start < at {
        let expected = format!("points after the header of {at} bytes");
        return Err(bytes.error(expected, format!("at byte {start}")));
    }
    // The offsets of data that may follow the points.
    let behind = match at > HEAD as u64 {
        true => [wide(&head, WAVES), wide(&head, EXTENDED_1_4)],
        false => [0; 2],
    };
    let mut system = System::default();
    if let Some(gap) = u64::from(head_size).checked_sub(at).filter(|gap| at + gap <= start) {
        bytes.skip(gap, "the header")?;
        system.look(&mut bytes, long(&head, 100), start - at - gap, false)?;
    }
    let gap = start - bytes.at();
    bytes.skip(gap, "data before the points")?;
    bytes.expect_rows(n, "points", u64::from(record))?;
    let mut row = vec![0; usize::from(record)];
    let mut positions = bytes.room("points", n)?;
    for number in 1..=n {
        bytes.record(number);
        bytes.fill(&mut row, "point")?;
        let integer =
            |axis: usize| i32::from_le_bytes(std::array::from_fn(|at| row[4 * axis + at]));
        let position: [f64; 3] =
            std::array::from_fn(|axis| f64::from(integer(axis)) * scale[axis] + offset[axis]);
        positions.push(position);
    }
    let end = bytes.at();
    let next = behind.into_iter().filter(|&next| next >= end).min();
    let more = next.map_or(bytes.remaining(), |next| next - end) / u64::from(record);
    // The start of waveforms in version 1.3 is not read, so data after the points is not a doubt.
    let doubts = undeclared(n, more).filter(|_| version.1 != 3).into_iter().collect();
    let (gap, number) = (behind[1].checked_sub(end), long(&head, EXTENDED_1_4 + 8));
    if let Some(gap) = gap.filter(|&gap| number > 0 && gap <= bytes.remaining()) {
        bytes.skip(gap, "data after the points")?;
        let left = bytes.remaining();
        system.look(&mut bytes, number, left, true)?;
    }
    let is_geographic = system.is_geographic();
    Ok(Input { positions, format: "LAS", is_geographic, doubts, ..Input::default() })
}

#[derive(Default)]
struct System {
    wkt: Option<bool>,
    keys: Option<bool>,
}

impl System {
    /// Reads at most `number` records in `left` bytes. Records after the points are `long`. Points
    /// do not depend on records, so a truncated one is not an error.
    fn look(&mut self, bytes: &mut Bytes, number: u64, left: u64, long: bool) -> Result<(), Error> {
        /// Descriptions of coordinate systems are shorter.
        const LONGEST: u64 = 1 << 20;
        let mut head = [0; 60];
        let head = if long { &mut head[..] } else { &mut head[..54] };
        let mut taken = 0;
        for _ in 0..number {
            if left.min(bytes.remaining() + taken) - taken < head.len() as u64 {
                break;
            }
            bytes.fill(head, "a record")?;
            taken += head.len() as u64;
            let len = match long {
                true => u64::from_le_bytes(std::array::from_fn(|byte| head[20 + byte])),
                false => u64::from(u16::from_le_bytes([head[20], head[21]])),
            };
            if len > left - taken || len > bytes.remaining() {
                break;
            }
            taken += len;
            let id = u16::from_le_bytes([head[18], head[19]]);
            if !head[2..18].starts_with(b"LASF_Projection") || len > LONGEST {
                bytes.skip(len, "a record")?;
                continue;
            }
            let mut content = vec![0; len as usize];
            bytes.fill(&mut content, "a record")?;
            match id {
                2112 => self.wkt = Some(is_geographic(&String::from_utf8_lossy(&content))),
                34735 => self.keys = Some(is_geographic_by_keys(&content)),
                _ => {}
            }
        }
        Ok(())
    }

    /// WKT is newer than GeoTIFF keys.
    fn is_geographic(&self) -> bool {
        self.wkt.or(self.keys).unwrap_or(false)
    }
}

fn is_geographic_by_keys(directory: &[u8]) -> bool {
    const MODEL: u16 = 1024;
    const GEOGRAPHIC_SYSTEM: u16 = 2048;
    const PROJECTED_SYSTEM: u16 = 3072;
    let shorts: Vec<u16> =
        directory.as_chunks::<2>().0.iter().map(|&two| u16::from_le_bytes(two)).collect();
    let keys = shorts.get(4..).unwrap_or_default().as_chunks::<4>().0;
    let value = |key: u16| keys.iter().find(|entry| entry[0] == key).map(|entry| entry[3]);
    match value(MODEL) {
        Some(model) if model != 0 => model == 2,
        _ => value(GEOGRAPHIC_SYSTEM).is_some() && value(PROJECTED_SYSTEM).is_none(),
    }
}
