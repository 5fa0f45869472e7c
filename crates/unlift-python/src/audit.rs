//! The audit: a map in, a report out.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use pyo3::prelude::*;
use unlift_audit::maps::find;
use unlift_audit::{Gate, Job};

use crate::errors::raised;
use crate::map::Map;
use crate::own::Raised;
use crate::plan::Asked;
use crate::report::Report;
use crate::work::{self, Heard};

/// Audits `map` as `asked` says, a dict of all options; `tell` hears of every cell: done, total, what comes next.
#[pyfunction]
pub fn audit(
    py: Python<'_>,
    map: &Map,
    asked: &Bound<'_, PyAny>,
    tell: Option<Py<PyAny>>,
) -> PyResult<Report> {
    let (started, by) = (Instant::now(), Raised::default());
    let asked = asked.extract::<Asked<'_>>().map_err(|error| of_argument(py, error))?;
    let (plan, notes) = asked.plan(py, &map.prepared, &by)?;
    let gates = asked.gates.iter().map(|text| Gate::parse(text));
    let gates = gates.collect::<Result<Vec<_>, _>>().map_err(raised)?;
    let mut options = serde_json::Map::new();
    if let Some(k) = asked.source_k {
        options.insert("source_k".to_owned(), k.into());
    }
    let stop = by.stop();
    let heard = Heard { tell, stop: Arc::clone(&stop), failed: Mutex::new(None) };
    let heard = Arc::new(heard);
    let progress = Arc::clone(&heard);
    let (prepared, input) = (Arc::clone(&map.prepared), map.input.clone());
    let (cameras, up) = (map.cameras.clone(), map.up);
    let notes = map.notes.iter().cloned().chain(notes).collect();
    let found = work::run(py, asked.threads, Some(stop), move || {
        let job = Job {
            original: &prepared.original,
            descriptors: prepared.descriptors.as_ref(),
            hidden: None,
            cameras,
            up,
            plan,
            input,
            options,
            notes,
            gates,
            out: PathBuf::new(),
            unit_in_map_units: prepared.unit_in_map_units,
            write_clouds: false,
            share_safe: false,
            inversion: None,
            journal: None,
            progress: &*progress,
            command: None,
            started,
        };
        find(job, None)
    });
    if let Some(error) = heard.failed.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(error);
    }
    found.map(Report::of).map_err(|error| by.as_cause_of(py, error))
}

/// An error about an item of the dict, as Python tells it of an argument.
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
