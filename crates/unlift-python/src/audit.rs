//! Audits of maps.

use std::sync::Arc;
use std::time::Instant;

use pyo3::prelude::*;
use unlift_audit::maps::{Tiles, find};
use unlift_audit::{Gate, Job};

use crate::errors::{raised, wrong};
use crate::heard::Heard;
use crate::map::Map;
use crate::own::Raised;
use crate::plan::Asked;
use crate::report::Report;
use crate::work;

/// Audits `map` with the options in the dict `asked`, and calls `tell` with done, total and the
/// next item.
#[pyfunction]
pub fn audit(
    py: Python<'_>,
    map: &Map,
    asked: &Bound<'_, PyAny>,
    tell: Option<Py<PyAny>>,
) -> PyResult<Report> {
    let (started, by) = (Instant::now(), Raised::default());
    let asked = asked_of::<Asked<'_>>(asked)?;
    let (plan, notes, doubt) = asked.plan(py, &map.prepared, &by)?;
    let gates = gates_of(&asked.gates)?;
    let mut options = serde_json::Map::new();
    if let Some(k) = asked.source_k {
        options.insert("source_k".to_owned(), k.into());
    }
    let tiles = match (asked.tile_points, asked.tile) {
        (Some(most), only) if most > 0 => Some(Tiles { most, only }),
        (None, None) => None,
        (None, Some(at)) => return Err(wrong("tile", "tile_points beside it", at)),
        (Some(most), _) => return Err(wrong("tile_points", "at least 1", most)),
    };
    let stop = by.stop();
    let heard = Arc::new(Heard::new(tell, Arc::clone(&stop)));
    let progress = Arc::clone(&heard);
    let (prepared, input) = (Arc::clone(&map.prepared), map.input.clone());
    let (cameras, up) = (map.cameras.clone(), map.up);
    let notes = map.notes.iter().cloned().chain(notes).collect();
    let found = work::run(py, asked.threads, Some(stop), move || {
        let job = Job {
            descriptors: prepared.descriptors.as_ref(),
            cameras,
            up,
            plan,
            input,
            options,
            notes,
            doubts: prepared.doubts.iter().cloned().chain(doubt).collect(),
            gates,
            unit_in_map_units: prepared.unit_in_map_units,
            tiles,
            progress: &*progress,
            ..Job::of(&prepared.original, started)
        };
        find(job, None)
    });
    if let Some(error) = heard.failed() {
        return Err(error);
    }
    found.map(Report::of).map_err(|error| by.as_cause_of(py, error))
}

/// Extracts options from the dict `asked`.
pub fn asked_of<'py, T>(asked: &Bound<'py, PyAny>) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py, Error = PyErr>,
{
    asked.extract::<T>().map_err(|error| of_argument(asked.py(), error))
}

pub fn gates_of(texts: &[String]) -> PyResult<Vec<Gate>> {
    texts.iter().map(|text| Gate::parse(text)).collect::<Result<_, _>>().map_err(raised)
}

/// Converts an error about an item of the dict to one about an argument.
fn of_argument(py: Python<'_>, error: PyErr) -> PyErr {
    let text = error.value(py).to_string();
    match (text.rsplit_once('.'), error.cause(py)) {
        (Some((_, name)), Some(cause)) => {
            let text = format!("argument '{name}': {}", cause.value(py));
            PyErr::from_type(cause.get_type(py), text)
        }
        _ => error,
    }
}
