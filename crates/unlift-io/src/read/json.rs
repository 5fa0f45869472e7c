//! Reads maps in JSON as a stream, distinguished by their keys: OpenSfM's `reconstruction.json` and
//! nerfstudio's `transforms.json`.

use std::fmt;
use std::io::{self, BufRead, BufReader, Read};
use std::marker::PhantomData;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
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
    let mut json = serde_json::Deserializer::from_reader(Strict::new(file));
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
        let names: Vec<String> = names.collect();
        let found = match &names[..] {
            [] => "JSON without names".to_owned(),
            names => format!("JSON with {}", names.join(", ")),
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
struct Strict<R> {
    bytes: io::Bytes<R>,
    /// The bytes to return next, in reverse order.
    ahead: Vec<u8>,
    in_text: bool,
    is_escaped: bool,
}

impl<R: BufRead> Strict<R> {
    fn new(from: R) -> Self {
        Self { bytes: from.bytes(), ahead: Vec::new(), in_text: false, is_escaped: false }
    }

    fn next(&mut self) -> io::Result<Option<u8>> {
        if let Some(byte) = self.ahead.pop() {
            return Ok(Some(byte));
        }
        let Some(byte) = self.bytes.next().transpose()? else { return Ok(None) };
        if self.in_text {
            self.in_text = self.is_escaped || byte != b'"';
            self.is_escaped = !self.is_escaped && byte == b'\\';
            return Ok(Some(byte));
        }
        match byte {
            b'"' => self.in_text = true,
            // Outside strings, JSON has no such letters.
            b'N' => return self.no_number(2),
            b'I' => return self.no_number(7),
            b'-' => match self.bytes.next().transpose()? {
                Some(b'I') => return self.no_number(7),
                other => self.ahead.extend(other),
            },
            _ => {}
        }
        Ok(Some(byte))
    }

    fn no_number(&mut self, n: usize) -> io::Result<Option<u8>> {
        for _ in 0..n {
            self.bytes.next().transpose()?;
        }
        self.ahead.extend(b"llu");
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
    rotation: [Option<f64>; 3],
    translation: [Option<f64>; 3],
}

#[derive(Deserialize)]
struct Point {
    coordinates: [Option<f64>; 3],
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

    /// Reads the value of the last key in `names`.
    fn take<'de, A: MapAccess<'de>>(&mut self, json: &mut A) -> Result<(), A::Error> {
        let Self { names, input, cloud, .. } = self;
        match names.last().map_or("", String::as_str) {
            "shots" => json.next_value_seed(Items::new(|Shot { rotation, translation }| {
                let [x, y, z] = numbers(rotation);
                let rotation = Pose::IDENTITY.moved(&[x, y, z, 0.0, 0.0, 0.0]).rotation;
                let up = rotation[1].map(|x| -x);
                input.camera(Some((center(&rotation, &numbers(translation)), up)));
            })),
            "points" => json.next_value_seed(Items::new(|Point { coordinates }| {
                input.positions.push(numbers(coordinates));
            })),
            "frames" => json.next_value_seed(Items::new(|frame: Frame| {
                let mut rows = frame.transform_matrix.into_iter().map(numbers);
                let rows: [_; 3] = std::array::from_fn(|_| rows.next().unwrap_or([f64::NAN; 4]));
                input.camera(Some((rows.map(|row| row[3]), rows.map(|row| row[1]))));
            })),
            "ply_file_path" => json.next_value().map(|path| *cloud = path),
            _ => json.next_value::<IgnoredAny>().map(drop),
        }
    }
}

impl<'de> Deserialize<'de> for Object {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        json.deserialize_any(Largest)
    }
}

struct Largest;

impl<'de> Visitor<'de> for Largest {
    type Value = Object;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object, or a list of them")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut json: A) -> Result<Object, A::Error> {
        let mut object = Object::default();
        while let Some(name) = json.next_key()? {
            object.names.push(name);
            object.take(&mut json)?;
        }
        Ok(object)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Object, A::Error> {
        let (mut largest, mut n) = (Object::default(), 0);
        while let Some(object) = list.next_element::<Object>()? {
            n += 1;
            if n == 1 || object.input.positions.len() > largest.input.positions.len() {
                largest = object;
            }
        }
        Ok(Object { n, ..largest })
    }
}

/// Applies a function to each value of a list or an object.
struct Items<T, F>(F, PhantomData<T>);

impl<T, F: FnMut(T)> Items<T, F> {
    fn new(each: F) -> Self {
        Self(each, PhantomData)
    }
}

impl<'de, T: Deserialize<'de>, F: FnMut(T)> DeserializeSeed<'de> for Items<T, F> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<(), D::Error> {
        json.deserialize_any(self)
    }
}

impl<'de, T: Deserialize<'de>, F: FnMut(T)> Visitor<'de> for Items<T, F> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list or an object, as in a map")
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut list: A) -> Result<(), A::Error> {
        while let Some(value) = list.next_element()? {
            (self.0)(value);
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut object: A) -> Result<(), A::Error> {
        while object.next_key::<IgnoredAny>()?.is_some() {
            (self.0)(object.next_value()?);
        }
        Ok(())
    }
}
