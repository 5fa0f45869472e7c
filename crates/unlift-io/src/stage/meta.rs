//! The metadata of a stage file: a JSON object in the text array `unlift`.

use std::fmt::Display;
use std::path::Path;

use serde_json::{Map, Value, json};
use unlift::{About, Fingerprint, RowOrder, Unit};

use super::kind::Kind;
use crate::Error;
use crate::read::lines::shortened;

pub(super) const KEY: &str = "unlift";

/// The privacy budget of words, in the metadata.
pub(super) const EPSILON: &str = "epsilon";
/// Whether protected descriptors were bytes, in the metadata.
pub(super) const OF_BYTES: &str = "of_bytes";
/// The reason why confidence is unknown.
pub(super) const WHY_UNKNOWN: &str = "confidence_unknown";

/// The version that is written, and the only one that is read.
pub(super) const VERSION: u64 = 1;

const KEYS: &str = "kind version unit family scheme fingerprint rows_by lists_by slots_per_record delta epsilon of_bytes \
                    confidence_unknown";

#[derive(Clone, Debug)]
pub(super) struct Meta<'a> {
    path: &'a Path,
    object: Map<String, Value>,
}

impl<'a> Meta<'a> {
    pub(super) fn empty(path: &'a Path) -> Self {
        Self { path, object: Map::new() }
    }

    /// Adds the metadata `text`, which replaces earlier values.
    pub(super) fn extend(&mut self, text: &str) -> Result<(), Error> {
        let wrong = |found| Err(Error::new(self.path, "metadata unlift", "a JSON object", found));
        let object = match serde_json::from_str(text) {
            Ok(Value::Object(object)) => object,
            Ok(other) => return wrong(short(&other)),
            Err(error) => return wrong(error.to_string()),
        };
        if let Some(key) = object.keys().find(|key| KEYS.split(' ').all(|known| known != *key)) {
            let expected = format!("only {}", KEYS.replace(' ', ", "));
            return Err(Error::new(self.path, "metadata unlift", expected, key));
        }
        self.object.extend(object);
        Ok(())
    }

    fn given<'s, T>(
        &'s self,
        key: &str,
        expected: impl Display,
        read: impl FnOnce(&'s Value) -> Option<T>,
    ) -> Result<Option<T>, Error> {
        let Some(value) = self.object.get(key) else { return Ok(None) };
        read(value).map(Some).ok_or_else(|| self.wrong(key, expected))
    }

    pub(super) fn kind(&self) -> Result<Option<Kind>, Error> {
        let is_known = |version: &Value| (version.as_u64() == Some(VERSION)).then_some(());
        self.given("version", VERSION.to_string(), is_known)?;
        let expected = format!("one of {}", Kind::ALL.map(Kind::name).join(", "));
        let of_name = |name: &Value| Kind::ALL.into_iter().find(|kind| name == kind.name());
        self.given("kind", expected, of_name)
    }

    /// The unit of all lengths: as declared, else `usual`, else pixels in 2D.
    pub(super) fn unit<const D: usize>(&self, usual: Option<Unit>) -> Result<Unit, Error> {
        const UNITS: &str = "m, px or kth_neighbor";
        let stated = self.given("unit", UNITS, |unit| Unit::named(unit.as_str()?))?;
        let unit = stated.or(usual).or((D == 2).then_some(Unit::Pixel));
        unit.ok_or_else(|| self.wrong("unit", UNITS))
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
        let is_oracle = |value: &Value| (value.as_str() == Some("oracle")).then_some(());
        let by_oracle = self.given("lists_by", "oracle, or no such key", is_oracle)?;
        Ok(About {
            map: self.fingerprint()?,
            order: order.unwrap_or(RowOrder::Unstated),
            by_oracle: by_oracle.is_some(),
        })
    }

    pub(super) fn text(&self, key: &str) -> Result<Option<&str>, Error> {
        self.given(key, "text", Value::as_str)
    }

    /// The number of hidden points per record, 1 or 2.
    pub(super) fn slots_per_record(&self) -> Result<Option<usize>, Error> {
        let slots = |value: &Value| [1, 2].into_iter().find(|&n| value.as_u64() == Some(n as u64));
        self.given("slots_per_record", "1 or 2", slots)
    }

    /// The number of at least 0 at `key`, by default 0.
    pub(super) fn number(&self, key: &str) -> Result<f64, Error> {
        let number = |value: &Value| value.as_f64().filter(|&x| x >= 0.0);
        Ok(self.given(key, "a number of at least 0", number)?.unwrap_or(0.0))
    }

    /// The value of `key`, by default false.
    pub(super) fn flag(&self, key: &str) -> Result<bool, Error> {
        Ok(self.given(key, "true or false", Value::as_bool)?.unwrap_or(false))
    }

    pub(super) fn wrong(&self, key: &str, expected: impl Display) -> Error {
        let found = self.object.get(key).map_or("nothing".into(), short);
        Error::new(self.path, format!("metadata unlift, {key}"), expected, found)
    }
}

fn short(value: &Value) -> String {
    shortened(&value.to_string(), 60)
}

/// Formats `meta` with sorted keys, so that equal values make equal bytes with any map type of
/// `serde_json`.
pub(super) fn to_text(meta: &Map<String, Value>) -> String {
    let mut entries: Vec<String> =
        meta.iter().map(|(key, value)| format!("{}: {value}", json!(key))).collect();
    entries.sort();
    format!("{{{}}}", entries.join(", "))
}
