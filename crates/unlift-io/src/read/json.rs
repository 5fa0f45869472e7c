//! Reads maps in JSON as a stream, distinguished by their keys: OpenSfM's `reconstruction.json` and nerfstudio's `transforms.json`.

use std::fmt;
use std::io::{self, BufRead, BufReader, Read};
use std::iter::Peekable;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, MapAccess, Visitor};
use unlift::geometry::camera::Pose;

use super::map_input::{Input, center};
use super::ply;
use crate::error::Error;
use crate::input;

/// The mark that editors on Windows write first.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Reads points and cameras of the largest reconstruction.
pub fn read(path: &Path) -> Result<Input, Error> {
    let (file, _) = input::open(path)?;
    let mut file = BufReader::new(file);
    if file.fill_buf().map_err(|error| Error::read(path, error))?.starts_with(BYTE_ORDER_MARK) {
        file.consume(BYTE_ORDER_MARK.len());
    }
    let is_list = file.buffer().trim_ascii_start().starts_with(b"[");
    let bytes = file.bytes().peekable();
    let strict = Strict { bytes, ahead: b"", in_text: false, is_escaped: false };
    let mut json = serde_json::Deserializer::from_reader(strict);
    let maps = match is_list {
        true => Vec::<Map>::deserialize(&mut json),
        false => Map::deserialize(&mut json).map(|map| vec![map]),
    };
    let maps = maps.and_then(|maps| json.end().map(|()| maps)).map_err(|error| {
        if error.is_io() {
            return Error::read(path, error.into());
        }
        let text = error.to_string();
        let what = text.split(" at line ").next().unwrap_or_default().to_owned();
        let (expected, what) = match error.is_data() {
            true => (MAPS, format!("other JSON ({what})")),
            false => ("a map in JSON", what),
        };
        Error::at_line(path, error.line() as u64, expected, what)
    })?;
    let n = maps.len();
    // Of equal ones, `max_by_key` returns the last.
    let largest =
        maps.into_iter().rev().max_by_key(|map| map.points.as_ref().map(|all| all.0.len()));
    let mut input = Input::default();
    match largest {
        Some(Map { frames: Some(frames), ply_file_path, .. }) => {
            input.format = "nerfstudio";
            for Frame { transform_matrix: rows } in frames {
                let at = |row: usize, c: usize| rows.get(row).and_then(|row| row[c]);
                let column = |c| [0, 1, 2].map(|row| at(row, c).unwrap_or(f64::NAN));
                input.camera(Some((column(3), column(1))));
            }
            with_cloud(path, &mut input, ply_file_path)?;
        }
        Some(Map { shots: Some(shots), points: Some(points), .. }) => {
            input.format = "OpenSfM";
            for Shot { rotation: [x, y, z], translation } in shots.0 {
                let rotation = Pose::IDENTITY.moved(&[x, y, z, 0.0, 0.0, 0.0]).rotation;
                let up = rotation[1].map(|x| -x);
                input.camera(Some((center(&rotation, &translation), up)));
            }
            input.positions.extend(points.0.iter().map(|point| point.coordinates));
            if input.positions.is_empty() {
                return Err(Error::new(path, "", "points", "only cameras"));
            }
        }
        _ => return Err(Error::new(path, "", MAPS, "other JSON")),
    }
    if n > 1 {
        let points = input.positions.len();
        input.notes.push(format!("read, the largest of {n} reconstructions ({points} points)"));
    }
    Ok(input)
}

const MAPS: &str = "a map of OpenSfM or nerfstudio";

/// A reader that replaces `NaN` and `Infinity`, which other programs write, by `null`.
struct Strict<R: Read> {
    bytes: Peekable<io::Bytes<R>>,
    /// The bytes to return next.
    ahead: &'static [u8],
    in_text: bool,
    is_escaped: bool,
}

impl<R: BufRead> Strict<R> {
    fn next(&mut self) -> io::Result<Option<u8>> {
        if let Some((byte, rest)) = self.ahead.split_first() {
            self.ahead = rest;
            return Ok(Some(*byte));
        }
        let Some(byte) = self.bytes.next().transpose()? else { return Ok(None) };
        if self.in_text {
            self.in_text = self.is_escaped || byte != b'"';
            self.is_escaped = !self.is_escaped && byte == b'\\';
            return Ok(Some(byte));
        }
        // Outside strings, JSON has no such letters.
        let n_behind = match byte {
            b'N' => 2,
            b'I' => 7,
            b'-' if matches!(self.bytes.peek(), Some(Ok(b'I'))) => 8,
            _ => {
                self.in_text = byte == b'"';
                return Ok(Some(byte));
            }
        };
        for _ in 0..n_behind {
            self.bytes.next().transpose()?;
        }
        self.ahead = b"ull";
        Ok(Some(b'n'))
    }
}

impl<R: BufRead> Read for Strict<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        for (at, place) in to.iter_mut().enumerate() {
            match self.next()? {
                Some(byte) => *place = byte,
                None => return Ok(at),
            }
        }
        Ok(to.len())
    }
}

/// Adds the points of the point cloud that nerfstudio's file names.
fn with_cloud(path: &Path, input: &mut Input, cloud: Option<PathBuf>) -> Result<(), Error> {
    let Some(cloud) = cloud else {
        let expected = "ply_file_path, a point cloud beside the cameras";
        return Err(Error::new(path, "", expected, "none"));
    };
    // nerfstudio on Windows writes backslashes.
    let written = cloud.to_string_lossy();
    let exists = path.with_file_name("").join(&cloud).exists();
    let cloud = match written.contains('\\') && !exists {
        true => PathBuf::from(written.replace('\\', "/")),
        false => cloud,
    };
    // A file of unknown origin must not name files outside its folder.
    if !cloud.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        let found = cloud.display().to_string();
        return Err(Error::new(path, "ply_file_path", "a path within the folder", found));
    }
    let cloud = path.with_file_name("").join(cloud);
    let points = ply::read(&cloud)?;
    input.positions = points.positions;
    input.notes.extend(points.notes);
    input.files.push(cloud);
    Ok(())
}

/// A map of OpenSfM, which has shots and points, or of nerfstudio, which has frames.
#[derive(Deserialize)]
struct Map {
    shots: Option<Items<Shot>>,
    points: Option<Items<Point>>,
    frames: Option<Vec<Frame>>,
    ply_file_path: Option<PathBuf>,
}

/// A shot of OpenSfM. Its rotation is the axis times the angle.
#[derive(Deserialize)]
struct Shot {
    #[serde(deserialize_with = "place")]
    rotation: [f64; 3],
    #[serde(deserialize_with = "place")]
    translation: [f64; 3],
}

#[derive(Deserialize)]
struct Point {
    #[serde(deserialize_with = "place")]
    coordinates: [f64; 3],
}

/// Reads three numbers, of which missing ones are NaN.
fn place<'de, D: Deserializer<'de>>(json: D) -> Result<[f64; 3], D::Error> {
    let place = <[Option<f64>; 3]>::deserialize(json)?;
    Ok(place.map(|x| x.unwrap_or(f64::NAN)))
}

#[derive(Deserialize)]
struct Frame {
    /// The pose from camera (y is up) to world.
    transform_matrix: Vec<[Option<f64>; 4]>,
}

/// The values of an object, in the order of the file.
struct Items<T>(Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Items<T> {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        json.deserialize_map(Self(Vec::new()))
    }
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Items<T> {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object, as in a map")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut object: A) -> Result<Self, A::Error> {
        while let Some((_, value)) = object.next_entry::<IgnoredAny, T>()? {
            self.0.push(value);
        }
        Ok(self)
    }
}
