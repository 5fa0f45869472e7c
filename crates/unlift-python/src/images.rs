//! Images of an audit: a path, or arrays by name, which are read when needed.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use unlift::OneLine;
use unlift_audit::Error;
use unlift_audit::images::InMemory;
use unlift_io::features::ImageFeatures;

use crate::arrays::{column, descriptors, rows};
use crate::calls;
use crate::errors::{UnliftError, raised, wrong};
use crate::own::Raised;

const KEYS: [&str; 5] = ["keypoints", "width", "height", "descriptors", "scores"];

/// Source of images.
pub enum Images {
    Path(PathBuf),
    InMemory(InMemory),
}

impl Images {
    /// Accepts a path, a mapping of names to arrays, or pairs of both.
    pub fn of(given: &Bound<'_, PyAny>, by: &Raised) -> PyResult<Self> {
        if let Ok(path) = given.extract::<PathBuf>() {
            return Ok(Self::Path(path));
        }
        let by_name = match is_mapping(given)? {
            true => given.clone(),
            false => pairs(given)?.into_any(),
        };
        let mut names = Vec::new();
        for name in by_name.call_method0("keys")?.try_iter()? {
            names.push(name_of(&name?)?);
        }
        names.sort_unstable();
        let (by, by_name, keys) = (by.clone(), by_name.unbind(), names.clone());
        let get = move |at: usize| {
            let (stop, name) = (by.stop(), &keys[at]);
            let place = place(name);
            let features = calls::attached(&stop, |py| {
                let given = by_name.bind(py).get_item(name);
                let features = given.and_then(|given| features_of(&place, &given));
                // The user's mapping may fail to read an image.
                features.map_err(|error| raised_by(py, &place, &by, error).value(py).to_string())
            });
            features
                .unwrap_or_else(|| Err(format!("{place}: expected arrays, found an interrupt")))
                .map_err(Error::request)
        };
        InMemory::try_new(names, get).map(Self::InMemory).map_err(raised)
    }
}

/// Returns the place of an image in errors, in Python notation.
fn place(name: &str) -> String {
    format!("images[{name:?}]")
}

/// Converts an exception of the user's mapping to an error about the place; keeps our own
/// exceptions.
fn raised_by(py: Python<'_>, place: &str, by: &Raised, error: PyErr) -> PyErr {
    match error.is_instance_of::<UnliftError>(py) {
        true => error,
        false => wrong(place, "arrays", by.keep(py, error)),
    }
}

fn is_mapping(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(given.hasattr("keys")? && given.hasattr("__getitem__")?)
}

fn name_of(name: &Bound<'_, PyAny>) -> PyResult<String> {
    let Ok(text) = name.cast::<PyString>() else {
        return Err(wrong("images", "names that are texts", OneLine(name.repr()?)));
    };
    text.extract()
}

/// Converts pairs of a name and arrays to a dict. All pairs are read, because an audit must know
/// every name first; arrays are not copied.
fn pairs<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let expected = "a path, a dict of names to arrays, or pairs of both";
    let by_name = PyDict::new(given.py());
    let Ok(items) = given.try_iter() else {
        return Err(wrong("images", expected, given.get_type()));
    };
    for item in items {
        let item = item?;
        let both = item.cast::<PyTuple>().ok().filter(|both| both.len() == 2);
        let Some(both) = both else {
            return Err(wrong("images", expected, item.get_type()));
        };
        let name = name_of(&both.get_item(0)?)?;
        if by_name.contains(&name)? {
            return Err(wrong("images", "each name once", format!("{name} again")));
        }
        by_name.set_item(name, both.get_item(1)?)?;
    }
    Ok(by_name)
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
    let has = |key: &str| given.contains(key);
    let item = |key: &str| -> PyResult<Option<Bound<'_, PyAny>>> {
        if !has(key)? {
            return Ok(None);
        }
        Ok(Some(given.get_item(key)?).filter(|item| !item.is_none()))
    };
    let needed = |key: &str| -> PyResult<Bound<'_, PyAny>> {
        let [least @ .., _, _] = &KEYS;
        let found = || wrong(place, least.join(", "), format!("no {key}"));
        item(key)?.ok_or_else(found)
    };
    let keypoints = rows::<2>(&at(place, "keypoints"), &needed("keypoints")?)?;
    let n = keypoints.len();
    let side = |key: &str| -> PyResult<u32> {
        let given = needed(key)?;
        let side = given.extract::<u32>().ok().filter(|side| *side > 0);
        let expected = "a whole number of pixels above 0";
        side.ok_or_else(|| wrong(&at(place, key), expected, OneLine(told_as(&given))))
    };
    let size = [side("width")?, side("height")?];
    let per_keypoint = |key: &str, found: usize| match found == n {
        true => Ok(()),
        false => Err(wrong(&at(place, key), format!("{n} rows, one per keypoint"), found)),
    };
    let descriptors = match item("descriptors")? {
        Some(given) => {
            let rows = descriptors(&at(place, "descriptors"), &given)?;
            per_keypoint("descriptors", rows.len())?;
            Some(rows)
        }
        None => None,
    };
    let scores = item("scores")?.map(|given| column(&at(place, "scores"), &given)).transpose()?;
    if let Some(scores) = &scores {
        per_keypoint("scores", scores.len())?;
    }
    let scores = scores.map(|scores| scores.into_iter().map(|score| score as f32).collect());
    Ok(ImageFeatures { size: Some(size), keypoints, descriptors, scores, ..Default::default() })
}

fn at(place: &str, key: &str) -> String {
    format!("{place}[{key:?}]")
}

fn told_as(given: &Bound<'_, PyAny>) -> String {
    given.repr().map_or_else(|_| "no number".to_owned(), |text| text.to_string())
}
