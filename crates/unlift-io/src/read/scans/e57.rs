//! Reads E57: scans, each in its own frame, which are transformed to the common frame.
//!
//! The crate `e57` decodes. Its memory is limited by checks of the length of the XML, the number of
//! points, and the number of values per byte.
//!
//! Source: ASTM E2807.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use std::rc::Rc;

use e57::RecordName::{
    CartesianInvalidState, CartesianX, CartesianY, CartesianZ, SphericalAzimuth,
    SphericalElevation, SphericalInvalidState, SphericalRange,
};
use e57::{E57Reader, PointCloud, RawValues, RecordDataType};

use super::is_geographic;
use crate::error::{Error, Place};
use crate::guard::without_panic;
use crate::input::{self, Budget};
use crate::read::map_input::Input;
use crate::read::pose::scaled_rotation;

/// The size of the header, and the offset of the XML's length.
const HEAD: usize = 48;
const XML_LENGTH: usize = 32;
/// Bytes of memory per byte of XML. The shortest element has four bytes and becomes a node.
const TREE: u64 = 32;
/// The maximum number of bytes read per point. Four packets fit, and each has values of every
/// field; only damaged files need more.
const AHEAD: u64 = 1 << 18;
/// Bytes of memory per value.
const VALUE: u64 = 32;

pub fn read(path: &Path) -> Result<Input, Error> {
    let damaged = || Error::new(path, "", "an E57 file", "a damaged one");
    without_panic(|| scans(path)).unwrap_or_else(|| Err(damaged()))
}

fn scans(path: &Path) -> Result<Input, Error> {
    let (mut file, len) = input::open(path)?;
    let budget = Budget::new(path, len);
    let mut head = [0; HEAD];
    let complete = file.read_exact(&mut head).is_ok();
    if !complete || &head[..8] != b"ASTM-E57" {
        let expected = "\"ASTM-E57\", as every E57 file begins";
        let found = if complete { "something else" } else { "end of file" };
        return Err(Error::new(path, "header", expected, found));
    }
    let xml = u64::from_le_bytes(std::array::from_fn(|at| head[XML_LENGTH + at]));
    if xml > len {
        let expected = format!("an XML part of at most {len} bytes (by the size of the file)");
        return Err(Error::new(path, "header", expected, xml.to_string()));
    }
    budget.admit("the XML part", xml.saturating_mul(TREE))?;
    file.seek(SeekFrom::Start(0)).map_err(|source| Error::read(path, source))?;
    let left = Rc::new(Cell::new(xml + AHEAD));
    let source = Watched { reader: BufReader::new(file), left: Rc::clone(&left) };
    let mut reader = E57Reader::new(source).map_err(|error| wrong(path, Place::Whole, &error))?;
    let clouds = reader.pointclouds();
    let n = clouds.iter().fold(0u64, |n, cloud| n.saturating_add(cloud.records));
    budget.admit("points", n.saturating_mul(24))?;
    let (mut positions, mut notes) = (Vec::new(), Vec::new());
    for (at, cloud) in clouds.iter().enumerate() {
        let place = || Place::from(format!("scan {}", at + 1));
        check(path, cloud, &budget, place())?;
        let frame = Frame::of(cloud).unwrap_or_else(|| {
            notes.push(format!("scan {}: the rotation is zero and is ignored", at + 1));
            Frame::shifted(cloud)
        });
        left.set(AHEAD);
        let fields = Fields::of(cloud);
        // The crate converts spherical coordinates with functions that differ between machines.
        let points = reader.pointcloud_raw(cloud);
        for values in points.map_err(|error| wrong(path, place(), &error))? {
            let values = values.map_err(|error| wrong(path, place(), &error))?;
            left.set(AHEAD);
            let found = fields.place(cloud, &values);
            let found = found.map_err(|error| wrong(path, place(), &error))?;
            positions.push(found.map_or([f64::NAN; 3], |found| frame.common(found)));
        }
    }
    if clouds.len() > 1 {
        notes.push(format!("read, all {} scans, in one frame", clouds.len()));
    }
    let is_geographic = reader.coordinate_metadata().is_some_and(is_geographic);
    Ok(Input { positions, format: "E57", notes, is_geographic, ..Input::default() })
}

/// Returns an error for a scan whose packets would exceed the budget, or whose values all take no
/// bits, which would never end.
fn check(path: &Path, cloud: &PointCloud, budget: &Budget, place: Place) -> Result<(), Error> {
    let bits = || cloud.prototype.iter().map(|record| bits(&record.data_type));
    let Some(least) = bits().filter(|&bits| bits > 0).min() else {
        return Err(Error::new(path, place, "points with a value that takes a bit", "none"));
    };
    // Values of no bits are repeated as often as the shortest other value.
    let lists = 1 + bits().filter(|&bits| bits == 0).count() as u64;
    budget.admit(place, (8 * AHEAD / least).saturating_mul(VALUE * lists))
}

/// Indices of the values with the position of a point, and of the flags that it is invalid.
struct Fields {
    cartesian: Option<[usize; 3]>,
    cartesian_state: Option<usize>,
    spherical: Option<[usize; 3]>,
    spherical_state: Option<usize>,
}

impl Fields {
    fn of(cloud: &PointCloud) -> Self {
        let of = |name| cloud.prototype.iter().position(|record| record.name == name);
        let all = |[a, b, c]: [Option<usize>; 3]| Some([a?, b?, c?]);
        Self {
            cartesian: all([of(CartesianX), of(CartesianY), of(CartesianZ)]),
            cartesian_state: of(CartesianInvalidState),
            spherical: all([of(SphericalRange), of(SphericalAzimuth), of(SphericalElevation)]),
            spherical_state: of(SphericalInvalidState),
        }
    }

    /// Returns the position of a point in the frame of its scan, or `None` for a beam without a
    /// return.
    fn place(&self, cloud: &PointCloud, values: &RawValues) -> e57::Result<Option<[f64; 3]>> {
        let number = |at: usize| values[at].to_f64(&cloud.prototype[at].data_type);
        let of = |fields: Option<[usize; 3]>, state: Option<usize>| -> e57::Result<_> {
            let is_valid = state.map_or(Ok(0.0), number)? == 0.0;
            let Some([a, b, c]) = fields.filter(|_| is_valid) else { return Ok(None) };
            Ok(Some([number(a)?, number(b)?, number(c)?]))
        };
        if let Some(place) = of(self.cartesian, self.cartesian_state)? {
            return Ok(Some(place));
        }
        let angles = of(self.spherical, self.spherical_state)?;
        Ok(angles.map(|[range, azimuth, elevation]| {
            let (flat, z) = (range * libm::cos(elevation), range * libm::sin(elevation));
            [flat * libm::cos(azimuth), flat * libm::sin(azimuth), z]
        }))
    }
}

struct Frame {
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

const UPRIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Frame {
    fn shifted(cloud: &PointCloud) -> Self {
        let t = cloud.transform.as_ref().map(|pose| &pose.translation);
        Self { rotation: UPRIGHT, translation: t.map_or([0.0; 3], |t| [t.x, t.y, t.z]) }
    }

    /// Returns the pose of `cloud`, unless its quaternion is zero.
    fn of(cloud: &PointCloud) -> Option<Self> {
        let shifted = Self::shifted(cloud);
        let Some(pose) = &cloud.transform else { return Some(shifted) };
        let q = &pose.rotation;
        let (rows, norm2) = scaled_rotation([q.w, q.x, q.y, q.z]);
        let rotation = rows.map(|row| row.map(|value| value / norm2));
        (norm2 != 0.0).then_some(Self { rotation, ..shifted })
    }

    fn common(&self, place: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|row| {
            let turned: f64 = self.rotation[row].iter().zip(place).map(|(r, x)| r * x).sum();
            turned + self.translation[row]
        })
    }
}

fn bits(kind: &RecordDataType) -> u64 {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => {
            let range = i128::from(*max) - i128::from(*min);
            u64::from(128 - range.max(0).leading_zeros())
        }
    }
}

fn wrong(path: &Path, place: Place, error: &e57::Error) -> Error {
    Error::new(path, place, "an E57 file", error.to_string())
}

/// A file of which at most `left` bytes are read.
struct Watched {
    reader: BufReader<File>,
    left: Rc<Cell<u64>>,
}

impl Read for Watched {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.reader.read(buffer)?;
        match self.left.get().checked_sub(n as u64) {
            Some(left) => self.left.set(left),
            None => return Err(io::Error::other("no point in a large part of the file")),
        }
        Ok(n)
    }
}

impl Seek for Watched {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.reader.seek(to)
    }
}
