//! Reads features in hloc's layout: a group per image, an array per kind of feature.

use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;

use super::h5::{Array, FeatureStore, Numbers, shape_text, transposed};
use super::image::ImageFeatures;
use super::writer::UPRIGHT;
use crate::atomic::Kind;
use crate::error::Error;

pub(super) struct Hloc(FeatureStore);

impl Hloc {
    pub fn open(path: &Path) -> Result<Self, Error> {
        let store = FeatureStore::open(path)?;
        let wrong = |found: &str| {
            let expected = "a group per image with keypoints and descriptors";
            Err(Error::new(path, "", expected, found))
        };
        if store.paths().is_empty() && !store.alone().is_empty() {
            return wrong("arrays outside any group");
        }
        let first = if store.paths().is_empty() { Vec::new() } else { store.names(0)? };
        let has = |name: &str| first.iter().any(|its| its == name);
        match () {
            () if has("keypoints") => Ok(Self(store)),
            () if has("matches0") || has("matches") => wrong("matches of pairs of images"),
            () if has("global_descriptor") => wrong("global descriptors of whole images"),
            () => Ok(Self(store)),
        }
    }

    pub fn refused(&self) -> &[Error] {
        self.0.broken()
    }

    pub fn names(&self) -> &[String] {
        self.0.paths()
    }

    pub fn is_upright(&self) -> bool {
        !self.0.paths().is_empty() && is_upright(&self.0, 0).unwrap_or(false)
    }

    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        image(&self.0, at)
    }
}

/// Reads the one image of a file that [`encode`](super::encode) made.
///
/// # Errors
/// When `path` cannot be read, or does not contain exactly the image `name`.
pub fn decode(path: &Path, name: &str) -> Result<ImageFeatures, Error> {
    let store = FeatureStore::open(path)?;
    match store.paths() {
        [only] if only == name => image(&store, 0),
        other => {
            let found = format!("{} images", other.len());
            Err(Error::new(path, "", format!("only the image {name}"), found))
        }
    }
}

/// unlift's first version wrote upright features without this attribute.
fn is_upright(store: &FeatureStore, at: usize) -> Result<bool, Error> {
    let number = |key: &str| store.number(at, "keypoints", key);
    Ok(match number(UPRIGHT)? {
        Some(upright) => upright != 0.0,
        None => number("uncertainty")?.is_some() && Kind::Features.is_at(store.path()),
    })
}

fn image(store: &FeatureStore, at: usize) -> Result<ImageFeatures, Error> {
    let name = &store.paths()[at][..];
    let present = store.names(at)?;
    let has = |array: &str| present.iter().any(|name| name == array);
    let optional = |array: &str| has(array).then(|| store.array(at, array)).transpose();
    let Some(places) = optional("keypoints")? else {
        let found = format!("only {}", present.join(", "));
        return Err(store.error(name, "", "an array keypoints", found));
    };
    let keypoints = keypoints(&places)
        .map_err(|(expected, found)| store.error(name, "keypoints", expected, found))?;
    let n = keypoints.len();
    let per_keypoint = |array: &str| -> Result<Option<Vec<f32>>, Error> {
        let Some(values) = optional(array)? else { return Ok(None) };
        if values.shape != [n as u64] && values.shape != [n as u64, 1] {
            let expected = format!("one value per keypoint, ({n},)");
            return Err(store.error(name, array, expected, shape_text(&values.shape)));
        }
        Ok(Some(values.values.to_f64().into_iter().map(|value| value as f32).collect()))
    };
    let descriptors = optional("descriptors")?.map(|array| descriptors(array, n)).transpose();
    Ok(ImageFeatures {
        name: name.to_owned(),
        size: optional("image_size")?
            .map(|array| size(&array))
            .transpose()
            .map_err(|(expected, found)| store.error(name, "image_size", expected, found))?,
        descriptors: descriptors
            .map_err(|(expected, found)| store.error(name, "descriptors", expected, found))?,
        scores: per_keypoint("scores")?,
        scales: per_keypoint("scales")?,
        orientations_deg: per_keypoint("oris")?,
        uncertainty_px: store.number(at, "keypoints", "uncertainty")?,
        upright: is_upright(store, at)?,
        keypoints,
        photo: None,
    })
}

/// The expected and the found value.
type Wrong = (String, String);

/// Columns after x and y are ignored.
fn keypoints(array: &Array) -> Result<Vec<[f64; 2]>, Wrong> {
    let columns = match array.shape[..] {
        [_, columns] if columns >= 2 => columns as usize,
        // Some exporters write an image without keypoints like this.
        [0] | [0, _] | [2, 0] => return Ok(Vec::new()),
        _ => return Err(("shape (N, 2)".to_owned(), shape_text(&array.shape))),
    };
    let values = array.values.to_f64();
    let rows = values.chunks_exact(columns).map(|row| [row[0], row[1]]);
    let rows: Vec<[f64; 2]> = rows.collect();
    match rows.iter().position(|row| !row.iter().all(|value| value.is_finite())) {
        None => Ok(rows),
        Some(at) => Err((
            format!("finite coordinates in row {at}"),
            format!("({}, {})", rows[at][0], rows[at][1]),
        )),
    }
}

/// Converts a `(D, N)` array to rows of `D` values.
fn descriptors(array: Array, n: usize) -> Result<Descriptors, Wrong> {
    let expected = || format!("shape (D, N) with N = {n}, one column per keypoint");
    let dim = match array.shape[..] {
        ref sides if n == 0 && array.values.len() == 0 => {
            sides.iter().copied().max().unwrap_or(0).max(1) as usize
        }
        [dim, count] if count == n as u64 && dim > 0 => dim as usize,
        [count, _] if count == n as u64 => {
            let found = format!("{}, rows and columns exchanged", shape_text(&array.shape));
            return Err((expected(), found));
        }
        _ => return Err((expected(), shape_text(&array.shape))),
    };
    let floats = |values: Vec<f32>| Values::F32(transposed(&values, dim));
    let values = match array.values {
        Numbers::U8(bytes) => Values::U8(transposed(&bytes, dim)),
        Numbers::F16(halves) => floats(halves.iter().map(|half| half.to_f32()).collect()),
        Numbers::F32(values) => floats(values),
        Numbers::F64(doubles) => floats(doubles.iter().map(|&value| value as f32).collect()),
        Numbers::I64(_) => {
            return Err(("floats, or unsigned bytes".to_owned(), "other integers".to_owned()));
        }
    };
    Descriptors::try_new(values, dim)
        .map_err(|error| (error.expected().to_owned(), describe(&error)))
}

fn describe(error: &unlift::Error) -> String {
    match error.what() {
        "descriptors" => error.found().to_owned(),
        place => format!("{} ({place})", error.found()),
    }
}

fn size(array: &Array) -> Result<[u32; 2], Wrong> {
    let sides = array.values.to_f64();
    let side = |value: f64| {
        let whole = (1.0..=f64::from(u32::MAX)).contains(&value) && value.fract() == 0.0;
        whole.then_some(value as u32)
    };
    match sides[..] {
        [width, height] => side(width).zip(side(height)).map(|(width, height)| [width, height]),
        _ => None,
    }
    .ok_or_else(|| {
        let found = match sides.len() {
            2 => format!("{} and {}", sides[0], sides[1]),
            _ => shape_text(&array.shape),
        };
        ("width and height in pixels".to_owned(), found)
    })
}
