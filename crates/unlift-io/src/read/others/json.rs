//! A JSON file, read as it comes: only what is asked for is kept.

use std::io::BufReader;
use std::path::Path;

use serde::de::DeserializeSeed;

use crate::error::{Error, Place};
use crate::input;

/// What `seed` makes of the file.
///
/// # Errors
/// When it is no JSON, or not what `seed` expects.
pub fn read<T>(
    path: &Path,
    seed: impl for<'de> DeserializeSeed<'de, Value = T>,
) -> Result<T, Error> {
    let (file, _) = input::open(path)?;
    let mut json = serde_json::Deserializer::from_reader(BufReader::new(file));
    let found = seed.deserialize(&mut json).and_then(|found| json.end().map(|()| found));
    found.map_err(|error| {
        if error.is_io() {
            return Error::read(path, error.into());
        }
        // The line is told by its number; the rest is what is wrong there.
        let text = error.to_string();
        let what = text.split(" at line ").next().unwrap_or_default().to_owned();
        Error::new(path, Place::Line(error.line() as u64), "a map in JSON", what)
    })
}
