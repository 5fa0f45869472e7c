//! Reads maps in JSON as a stream, distinguished by their keys: OpenSfM's `reconstruction.json` and
//! nerfstudio's `transforms.json`.

use std::fmt;
use std::io::{self, BufRead, BufReader, Read};
use std::iter::Peekable;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use unlift::geometry::camera::Pose;

use super::map_input::{Input, center};
use super::ply;
use crate::error::{Error, Place};
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
    let bytes = file.bytes().peekable();
    let strict = Strict { bytes, ahead: b"", in_text: false, is_escaped: false };
    let mut json = serde_json::Deserializer::from_reader(strict);
    let object = Object::deserialize(&mut json).and_then(|object| json.end().map(|()| object));
    let object = object.map_err(|error| {
        if error.is_io() {
            return Error::read(path, error.into());
        }
        let text = error.to_string();
        let what = text.split(" at line ").next().unwrap_or_default().to_owned();
        let (expected, what) = match error.is_data() {
            true => (MAPS, format!("other JSON ({what})")),
            false => ("a map in JSON", what),
        };
        Error::new(path, Place::Line(error.line() as u64), expected, what)
    })?;
    let Some(format) = object.format() else {
        let names = object.names.iter().take(5).map(|name| name.escape_debug().to_string());
        let found = match object.names.is_empty() {
            true => "JSON without names".to_owned(),
            false => format!("JSON with {}", names.collect::<Vec<_>>().join(", ")),
        };
        return Err(Error::new(path, "", MAPS, found));
    };
    let Object { mut input, cloud, n, .. } = object;
    input.format = format;
    if n > 1 {
        let points = input.positions.len();
        input.notes.push(format!("read, the largest of {n} reconstructions ({points} points)"));
    }
    if format == "nerfstudio" {
        with_cloud(path, &mut input, cloud)?;
    } else if input.positions.is_empty() {
        return Err(Error::new(path, "", "points", "only cameras"));
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
        return Err(Error::new(
            path,
            "",
            "ply_file_path, a point cloud beside the cameras",
            "none",
        ));
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

/// An object, or the one with the most points of OpenSfM's list of objects.
#[derive(Default)]
struct Object {
    names: Vec<String>,
    input: Input,
    cloud: Option<PathBuf>,
    /// The number of objects in the list.
    n: usize,
}

/// Numbers, of which missing ones are NaN.
fn numbers<const N: usize>(numbers: [Option<f64>; N]) -> [f64; N] {
    numbers.map(|number| number.unwrap_or(f64::NAN))
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

fn place<'de, D: Deserializer<'de>>(json: D) -> Result<[f64; 3], D::Error> {
    <[Option<f64>; 3]>::deserialize(json).map(numbers)
}

#[derive(Deserialize)]
struct Frame {
    /// The pose from camera (y is up) to world.
    transform_matrix: Vec<[Option<f64>; 4]>,
}

impl Object {
    fn format(&self) -> Option<&'static str> {
        let has = |name: &str| self.names.iter().any(|its| its == name);
        if has("frames") {
            return Some("nerfstudio");
        }
        (has("shots") && has("points")).then_some("OpenSfM")
    }

    fn take<'de, A: MapAccess<'de>>(&mut self, name: &str, json: &mut A) -> Result<(), A::Error> {
        match name {
            "shots" => {
                for Shot { rotation, translation } in json.next_value::<Items<_>>()?.0 {
                    let [x, y, z] = rotation;
                    let rotation = Pose::IDENTITY.moved(&[x, y, z, 0.0, 0.0, 0.0]).rotation;
                    let up = rotation[1].map(|x| -x);
                    self.input.camera(Some((center(&rotation, &translation), up)));
                }
            }
            "points" => {
                let points = json.next_value::<Items<Point>>()?.0.into_iter();
                self.input.positions.extend(points.map(|point| point.coordinates));
            }
            "frames" => {
                for Frame { transform_matrix } in json.next_value::<Items<_>>()?.0 {
                    let mut rows = transform_matrix.into_iter().map(numbers);
                    let rows: [_; 3] =
                        std::array::from_fn(|_| rows.next().unwrap_or([f64::NAN; 4]));
                    self.input.camera(Some((rows.map(|row| row[3]), rows.map(|row| row[1]))));
                }
            }
            "ply_file_path" => self.cloud = json.next_value()?,
            _ => drop(json.next_value::<IgnoredAny>()?),
        }
        Ok(())
    }
}

impl<'de> Deserialize<'de> for Object {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        json.deserialize_any(Self::default())
    }
}

impl<'de> Visitor<'de> for Object {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object, or a list of them")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut json: A) -> Result<Self, A::Error> {
        while let Some(name) = json.next_key::<String>()? {
            self.take(&name, &mut json)?;
            self.names.push(name);
        }
        Ok(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut list: A) -> Result<Self, A::Error> {
        let mut n = 0;
        while let Some(object) = list.next_element::<Self>()? {
            n += 1;
            if n == 1 || object.input.positions.len() > self.input.positions.len() {
                self = object;
            }
        }
        Ok(Self { n, ..self })
    }
}

/// The values of a list or an object.
struct Items<T>(Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Items<T> {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        json.deserialize_any(Self(Vec::new()))
    }
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Items<T> {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list or an object, as in a map")
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut list: A) -> Result<Self, A::Error> {
        while let Some(value) = list.next_element()? {
            self.0.push(value);
        }
        Ok(self)
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut object: A) -> Result<Self, A::Error> {
        while let Some((_, value)) = object.next_entry::<IgnoredAny, T>()? {
            self.0.push(value);
        }
        Ok(self)
    }
}
