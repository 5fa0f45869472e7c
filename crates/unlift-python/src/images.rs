//! Images of an audit: a path, or arrays by name, which are read when needed.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use unlift::OneLine;
use unlift_audit::Error;
use unlift_audit::images::FeatureSource;
use unlift_io::features::ImageFeatures;

use crate::arrays::{UnliftError, descriptors, raised, rows, wrong};
use crate::own::Raised;

const KEYS: [&str; 4] = ["keypoints", "width", "height", "descriptors"];

/// Source of images.
// There is one per audit, so its size costs nothing.
#[allow(clippy::large_enum_variant)]
pub enum Images {
    Path(PathBuf),
    InMemory(FeatureSource),
}

impl Images {
    /// Accepts a path, or a mapping of names to arrays.
    pub fn of(given: &Bound<'_, PyAny>, by: &Raised) -> PyResult<Self> {
        if let Ok(path) = given.extract::<PathBuf>() {
            return Ok(Self::Path(path));
        }
        if !is_mapping(given)? {
            return Err(wrong("images", "a path, or a dict of names to arrays", given.get_type()));
        }
        let mut names = Vec::new();
        for name in given.call_method0("keys")?.try_iter()? {
            let name = name?;
            let wrong = |_| wrong("images", "names that are texts", OneLine(&name));
            names.push(name.extract::<String>().map_err(wrong)?);
        }
        names.sort_unstable();
        let (by, by_name, keys) = (by.clone(), Arc::new(given.clone().unbind()), names.clone());
        let get = move |image: usize| {
            let (by_name, name) = (Arc::clone(&by_name), keys[image].clone());
            let place = at("images", &name);
            let of = place.clone();
            let features = by.made(move |py| {
                let given = by_name.bind(py).get_item(name);
                match given.and_then(|given| features_of(&of, &given)) {
                    // Our own exceptions name the image.
                    Err(error) if error.is_instance_of::<UnliftError>(py) => {
                        Ok(Err(error.value(py).to_string()))
                    }
                    features => features.map(Ok),
                }
            });
            // The user's mapping may fail to read an image.
            let failed = |found| Err(format!("{place}: expected arrays, found {found}"));
            features.unwrap_or_else(failed).map_err(Error::request)
        };
        FeatureSource::in_memory(names, get).map(Self::InMemory).map_err(raised)
    }
}

fn is_mapping(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(given.hasattr("keys")? && given.hasattr("__getitem__")?)
}

/// Converts the dict of one image to features.
fn features_of(place: &str, given: &Bound<'_, PyAny>) -> PyResult<ImageFeatures> {
    if !is_mapping(given)? {
        return Err(wrong(place, "a dict of arrays", given.get_type()));
    }
    for key in given.call_method0("keys")?.try_iter()? {
        let key = key?.str()?.to_string();
        if !KEYS.contains(&&*key) {
            return Err(wrong(place, format!("only {}", KEYS.join(", ")), OneLine(key)));
        }
    }
    let item = |key: &str| -> PyResult<Option<Bound<'_, PyAny>>> {
        let item = given.contains(key)?.then(|| given.get_item(key)).transpose()?;
        Ok(item.filter(|item| !item.is_none()))
    };
    let needed = |key: &str| {
        let [needed @ .., _] = &KEYS;
        item(key)?.ok_or_else(|| wrong(place, needed.join(", "), format!("no {key}")))
    };
    let keypoints = rows::<2>(&at(place, "keypoints"), &needed("keypoints")?)?;
    let n = keypoints.len();
    let side = |key: &str| -> PyResult<u32> {
        let given = needed(key)?;
        let side = given.extract::<u32>().ok().filter(|side| *side > 0);
        let expected = "a whole number of pixels above 0";
        side.ok_or_else(|| wrong(&at(place, key), expected, OneLine(&given)))
    };
    let size = [side("width")?, side("height")?];
    let place = at(place, "descriptors");
    let descriptors = item("descriptors")?.map(|given| descriptors(&place, &given)).transpose()?;
    if let Some(rows) = descriptors.as_ref().filter(|rows| rows.len() != n) {
        return Err(wrong(&place, format!("{n} rows, one per keypoint"), rows.len()));
    }
    Ok(ImageFeatures { size: Some(size), keypoints, descriptors, ..Default::default() })
}

/// Returns the place of an item in errors, in Python notation.
fn at(place: &str, key: &str) -> String {
    format!("{place}[{key:?}]")
}
