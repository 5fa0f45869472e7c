//! Maps, from files or arrays, and hiding of maps under schemes of unlift or of the user.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use unlift::audit::check_laws;
use unlift::obfuscate::{Scheme, SchemeOptions, obfuscate as hide, scheme};
use unlift::seed::Key;
use unlift_audit::{Preparation, Prepared, check_scale, maps, prepare};
use unlift_io::hash::hash_positions;
use unlift_report::document::Input;

use crate::arrays::{descriptors, raised, rows, to_array, to_descriptors, to_rows, wrong};
use crate::hidden::{Hidden, Released, Truth};
use crate::own::{Own, Raised};
use crate::threads;

/// Points to audit, with optional descriptors. Lengths are in meters with a scale, else in median distances to the K-th neighbor.
#[pyclass(frozen, module = "unlift")]
pub struct Map {
    pub prepared: Arc<Prepared>,
    /// Origin of the points, for the report.
    pub about: Input,
}

/// Returns the options of preparation.
fn preparation(
    scale: Option<f64>,
    k: usize,
    max_points: Option<usize>,
    seed: u64,
) -> PyResult<Preparation> {
    if let Some(scale) = scale.filter(|scale| !(scale.is_finite() && *scale > 0.0)) {
        return Err(wrong("scale", "a number above 0", scale));
    }
    if k == 0 {
        return Err(wrong("k", "at least 1", k));
    }
    Ok(Preparation { scale, k, max_points, even: false, beside: false, seed })
}

#[pymethods]
impl Map {
    #[new]
    #[pyo3(signature = (positions, descriptors=None, *, scale=None, k=50, max_points=None, seed=0))]
    fn new(
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        descriptors: Option<&Bound<'_, PyAny>>,
        scale: Option<f64>,
        k: usize,
        max_points: Option<usize>,
        seed: u64,
    ) -> PyResult<Self> {
        let preparation = preparation(scale, k, max_points, seed)?;
        let given = descriptors.map(|given| self::descriptors("descriptors", given)).transpose()?;
        let rows = rows("positions", positions)?;
        if let Some(given) = given.as_ref().filter(|given| given.len() != rows.len()) {
            let expected = format!("{} rows, one per point", rows.len());
            return Err(wrong("descriptors", expected, given.len()));
        }
        threads::run(py, None, None, move || {
            check_scale(&rows, scale)?;
            let sha256 = Some(hash_positions(&rows));
            let mut prepared = prepare(rows, given.as_ref(), &preparation)?;
            let zeros = prepared.descriptors.as_ref().and_then(maps::zeros);
            prepared.remarks.notes.extend(zeros);
            let about = Input {
                sha256,
                n_points: prepared.original.len() as u64,
                scale_m_per_unit: scale,
                unit_in_map_units: Some(prepared.unit_in_map_units),
                ..Input::default()
            };
            Ok::<_, unlift_audit::Error>(Self { prepared: Arc::new(prepared), about })
        })
    }

    fn __len__(&self) -> usize {
        self.prepared.original.len()
    }

    fn __repr__(&self) -> String {
        let points = self.prepared.original.reveal();
        let descriptors = match &self.prepared.descriptors {
            Some(descriptors) => format!("descriptors of {} values", descriptors.dim()),
            None => "no descriptors".to_owned(),
        };
        format!("<unlift.Map: {} points in {}, {descriptors}>", points.len(), points.unit().name())
    }

    /// Positions `(n, 3)` in `unit`.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(to_rows(py, self.prepared.original.reveal().positions().to_vec())?.into_any())
    }

    /// Descriptors `(n, dim)`, or None.
    #[getter]
    fn descriptors<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.prepared.descriptors.as_ref().map(|rows| to_descriptors(py, rows)).transpose()
    }

    /// Unit of lengths: "m", or "kth_neighbor".
    #[getter]
    fn unit(&self) -> &'static str {
        self.prepared.original.reveal().unit().name()
    }

    /// Length of `unit` in the units of the input.
    #[getter]
    fn unit_in_map_units(&self) -> f64 {
        self.prepared.unit_in_map_units
    }

    /// Notes on reading and preparation; a report has them, too.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.prepared.remarks.doubts.iter().chain(&self.prepared.remarks.notes).cloned().collect()
    }

    /// Indices of the points that are left, ascending `(n,)`.
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        to_array(py, self.prepared.rows.clone()).into_any()
    }
}

/// Reads a map: a COLMAP model or project, PLY, NPY or a table.
#[pyfunction]
#[pyo3(signature = (path, *, descriptors=None, scale=None, k=50, max_points=None, seed=0))]
pub fn read(
    py: Python<'_>,
    path: PathBuf,
    descriptors: Option<PathBuf>,
    scale: Option<f64>,
    k: usize,
    max_points: Option<usize>,
    seed: u64,
) -> PyResult<Map> {
    let preparation = preparation(scale, k, max_points, seed)?;
    threads::run(py, None, None, move || {
        let prepared = Arc::new(maps::open(&path, descriptors.as_deref(), &preparation)?);
        Ok::<_, unlift_audit::Error>(Map { about: prepared.about(&path)?, prepared })
    })
}

/// Returns the scheme for `given`, a name or a function.
pub fn scheme_of<const D: usize>(
    given: &Bound<'_, PyAny>,
    options: &SchemeOptions,
    raised_by: &Raised,
) -> PyResult<Arc<dyn Scheme<D>>> {
    let Ok(name) = given.extract::<String>() else {
        return Ok(Arc::new(Own::scheme(given, raised_by)?));
    };
    let entry = scheme(&name).map_err(raised)?;
    let subjects = if D == 2 { "images" } else { "maps" };
    let expected = format!("one that is defined on {subjects}");
    entry.of_dimension::<D>(options).ok_or_else(|| wrong("scheme", expected, name))
}

/// Hides a map under a scheme, a name or a function. Without a seed it uses a fresh key, for maps
/// that are released. Never release a map made with a seed: whoever guesses the seed can restore
/// the order of the records and, under `cp`, the points.
#[pyfunction]
#[pyo3(signature = (map, scheme, *, seed=None))]
pub fn obfuscate(
    py: Python<'_>,
    map: &Map,
    scheme: &Bound<'_, PyAny>,
    seed: Option<u64>,
) -> PyResult<Hidden> {
    let by = Raised::default();
    let unit = map.prepared.original.reveal().unit();
    let scheme = scheme_of::<3>(scheme, &SchemeOptions::usual(unit), &by)?;
    let key = seed.map_or_else(Key::fresh, |seed| Ok(Key::from_seed(seed))).map_err(raised)?;
    let prepared = Arc::clone(&map.prepared);
    let hidden = threads::run(py, None, Some(&by.waiting), move || {
        let (original, descriptors) = (&prepared.original, prepared.descriptors.as_ref());
        let (released, secret) = hide(&*scheme, original, descriptors, &key)?;
        check_laws(&*scheme, original, &key, (&released, &secret))
            .map_err(|error| error.within(scheme.name()))?;
        Ok::<_, unlift::Error>((released, secret))
    });
    let (released, secret) = hidden.map_err(|error| by.as_cause_of(py, error))?;
    let original = Arc::clone(&map.prepared.original);
    let truth = Truth { original, secret: Arc::new(secret) };
    Ok(Hidden { released: Released::from(released), truth })
}
