//! The metadata of a stage file: a JSON object under the key `unlift`.

use crate::Error;
use serde_json::{Map, Value, json};
use std::fmt;
use std::path::Path;
use unlift::geometry::frame::Bounds;
use unlift::{About, Fingerprint, ListsBy, RowOrder, Unit};

pub(super) const KEY: &str = "unlift";

/// The version that is written, and the only one that is read.
pub(super) const VERSION: u64 = 1;

/// The content of a stage file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An obfuscated map: the attacker's side.
    Released,
    /// Originals and the secret of an obfuscation: the owner's side.
    Truth,
    /// Lists of records, one per slot.
    Neighborhoods,
    /// Lists of original points, one per point.
    PointNeighborhoods,
    /// Recovered points, one per slot.
    Recovered,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 5] = [
        Self::Released,
        Self::Truth,
        Self::Neighborhoods,
        Self::PointNeighborhoods,
        Self::Recovered,
    ];

    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Released => "released",
            Self::Truth => "truth",
            Self::Neighborhoods => "neighborhoods",
            Self::PointNeighborhoods => "point_neighborhoods",
            Self::Recovered => "recovered",
        }
    }

    /// Returns the kind with the name `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Released => "a released map",
            Self::Truth => "a truth file",
            Self::Neighborhoods => "neighborhoods of slots",
            Self::PointNeighborhoods => "neighborhoods of points",
            Self::Recovered => "a file of recovered points",
        })
    }
}

#[derive(Debug)]
pub(super) struct Meta<'a> {
    path: &'a Path,
    object: Map<String, Value>,
}

impl<'a> Meta<'a> {
    /// Parses `text`. `None` is an empty object.
    pub(super) fn parse(path: &'a Path, text: Option<&str>) -> Result<Self, Error> {
        let place = "metadata unlift";
        let object = match text.map(serde_json::from_str::<Value>) {
            None => Map::new(),
            Some(Ok(Value::Object(object))) => object,
            Some(Ok(other)) => {
                return Err(Error::new(path, place, "a JSON object", short(&other)));
            }
            Some(Err(error)) => {
                return Err(Error::new(path, place, "a JSON object", error.to_string()));
            }
        };
        Ok(Self { path, object })
    }

    /// Adds the metadata `text` of one image, which replaces that of the file.
    pub(super) fn of_image(&self, text: Option<&str>) -> Result<Self, Error> {
        let mut object = self.object.clone();
        object.extend(Self::parse(self.path, text)?.object);
        Ok(Self { path: self.path, object })
    }

    pub(super) fn into_object(self) -> Map<String, Value> {
        self.object
    }

    fn given<T>(
        &self,
        key: &str,
        expected: impl Into<String>,
        read: impl FnOnce(&Value) -> Option<T>,
    ) -> Result<Option<T>, Error> {
        let Some(value) = self.object.get(key) else { return Ok(None) };
        read(value).map(Some).ok_or_else(|| self.wrong(key, expected))
    }

    pub(super) fn kind(&self) -> Result<Option<Kind>, Error> {
        let is_known = |version: &Value| (version.as_u64() == Some(VERSION)).then_some(());
        self.given("version", VERSION.to_string(), is_known)?;
        let expected = format!("one of {}", Kind::ALL.map(Kind::name).join(", "));
        self.given("kind", expected, |kind| Kind::from_name(kind.as_str()?))
    }

    pub(super) fn dimension(&self) -> Result<Option<usize>, Error> {
        let known = |value: &Value| [2, 3].into_iter().find(|&d| value.as_u64() == Some(d as u64));
        self.given("dimension", "2 or 3", known)
    }

    pub(super) fn unit(&self) -> Result<Option<Unit>, Error> {
        self.given("unit", UNITS, |unit| Unit::from_name(unit.as_str()?))
    }

    pub(super) fn wrong_unit(&self) -> Error {
        self.wrong("unit", UNITS)
    }

    /// The origin, by default 0.
    pub(super) fn origin<const D: usize>(&self) -> Result<[f64; D], Error> {
        let origin = self.given("origin", format!("a list of {D} numbers"), vector)?;
        Ok(origin.unwrap_or([0.0; D]))
    }

    pub(super) fn centers<const D: usize>(&self) -> Result<Vec<[f64; D]>, Error> {
        let expected = format!("a list of lists of {D} numbers");
        let rows = |value: &Value| value.as_array()?.iter().map(vector).collect();
        let centers = self.given("centers", &*expected, rows)?;
        centers.ok_or_else(|| self.wrong("centers", expected))
    }

    /// The bounding box of all hidden points in the frame of the map.
    pub(super) fn bounds<const D: usize>(&self) -> Result<Option<Bounds<D>>, Error> {
        self.given("bounds", rule_of_corners::<D>(), corners)
    }

    /// The bounding box of the points of each center, relative to the origin.
    pub(super) fn regions<const D: usize>(&self) -> Result<Option<Vec<Bounds<D>>>, Error> {
        let expected = format!("per center {}", rule_of_corners::<D>());
        self.given("regions", expected, |rows| rows.as_array()?.iter().map(corners).collect())
    }

    pub(super) fn fingerprint(&self) -> Result<Option<Fingerprint>, Error> {
        let expected = "32 hexadecimal digits, the fingerprint of a released map";
        self.given("fingerprint", expected, |value| Fingerprint::from_hex(value.as_str()?))
    }

    /// The released map, the order of rows, and the author of lists, as far as given.
    pub(super) fn about(&self) -> Result<About, Error> {
        let names = RowOrder::STATED.map(|order| order.name().unwrap_or_default());
        let expected = format!("one of {}", names.join(", "));
        let order =
            self.given("rows_by", expected, |value| RowOrder::from_name(value.as_str()?))?;
        let is_oracle =
            |value: &Value| (value.as_str() == ListsBy::Oracle.name()).then_some(ListsBy::Oracle);
        let lists_by = self.given("lists_by", "oracle, or no such key", is_oracle)?;
        Ok(About {
            map: self.fingerprint()?,
            order: order.unwrap_or(RowOrder::Unstated),
            lists_by: lists_by.unwrap_or(ListsBy::Unstated),
        })
    }

    /// Returns the text of `key`, or `None` if it is missing or has another type.
    pub(super) fn text(&self, key: &str) -> Option<&str> {
        self.object.get(key).and_then(Value::as_str)
    }

    pub(super) fn optional_text(&self, key: &str) -> Result<Option<String>, Error> {
        self.given(key, "text", |value| value.as_str().map(str::to_owned))
    }

    /// Returns a whole number of at least 1.
    pub(super) fn count(&self, key: &str) -> Result<Option<usize>, Error> {
        self.given(key, "a whole number of at least 1", |value| {
            usize::try_from(value.as_u64()?).ok().filter(|&n| n >= 1)
        })
    }

    /// Returns a number of at least 0, by default 0.
    pub(super) fn number_or_0(&self, key: &str) -> Result<f64, Error> {
        let number = self
            .given(key, "a number of at least 0", |value| value.as_f64().filter(|&x| x >= 0.0))?;
        Ok(number.unwrap_or(0.0))
    }

    pub(super) fn wrong(&self, key: &str, expected: impl Into<String>) -> Error {
        let found = self.object.get(key).map_or("nothing".into(), short);
        Error::new(self.path, format!("metadata unlift, {key}"), expected, found)
    }
}

fn vector<const D: usize>(value: &Value) -> Option<[f64; D]> {
    let row: Option<Vec<f64>> = value.as_array()?.iter().map(Value::as_f64).collect();
    row?.try_into().ok()
}

fn corners<const D: usize>(value: &Value) -> Option<Bounds<D>> {
    let [low, high] = value.as_array()?.as_slice() else { return None };
    Bounds::try_new(vector(low)?, vector(high)?).ok()
}

const UNITS: &str = "m, px or kth_neighbor";

fn rule_of_corners<const D: usize>() -> String {
    format!("a low and a high corner of {D} numbers")
}

fn short(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(60) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text,
    }
}

pub(super) fn new_meta(kind: Kind) -> Map<String, Value> {
    let mut object = Map::new();
    object.insert("kind".into(), json!(kind.name()));
    object.insert("version".into(), json!(VERSION));
    object
}

pub(super) fn insert_fingerprint(meta: &mut Map<String, Value>, map: Option<Fingerprint>) {
    meta.extend(map.map(|map| ("fingerprint".to_owned(), json!(map.to_string()))));
}

pub(super) fn insert_about(meta: &mut Map<String, Value>, about: About) {
    insert_fingerprint(meta, about.map);
    meta.extend(about.order.name().map(|name| ("rows_by".to_owned(), json!(name))));
    meta.extend(about.lists_by.name().map(|name| ("lists_by".to_owned(), json!(name))));
}

/// Formats `meta` with sorted keys, so that equal values make equal bytes with any map type of
/// `serde_json`.
pub(super) fn to_text(meta: Map<String, Value>) -> String {
    let mut entries: Vec<(String, Value)> = meta.into_iter().collect();
    entries.sort_by(|a, b| a.0.cmp(&b.0));
    let entries: Vec<String> =
        entries.into_iter().map(|(key, value)| format!("{}:{value}", Value::String(key))).collect();
    format!("{{{}}}", entries.join(","))
}
