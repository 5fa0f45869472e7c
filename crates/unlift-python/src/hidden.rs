//! Hidden maps: the released part, and the truth.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use unlift::released::{self, Obfuscation};
use unlift::truth::{Original, Secret};
use unlift_audit::check_file;
use unlift_io::outputs;
use unlift_io::stage::{Kind, read_released, read_truth, write_released, write_truth};

use crate::arrays::{raised, to_array, to_descriptors, to_rows, wrong};

/// A value of an image (2D) or of a map (3D).
#[derive(Clone, Debug)]
pub enum Either<I, M> {
    Image(I),
    Map(M),
}

/// Evaluates `$made` with `$one` as the content of `$either`.
macro_rules! of_either {
    ($either:expr, $one:ident => $made:expr) => {
        match $either {
            $crate::hidden::Either::Image($one) => $made,
            $crate::hidden::Either::Map($one) => $made,
        }
    };
}

pub(crate) use of_either;

/// Everything that an attacker sees of a map or an image.
#[pyclass(frozen, module = "unlift")]
#[derive(Clone)]
pub struct Released(pub Either<Arc<released::Released<2>>, Arc<released::Released<3>>>);

impl From<released::Released<2>> for Released {
    fn from(of_image: released::Released<2>) -> Self {
        Self(Either::Image(Arc::new(of_image)))
    }
}

impl From<released::Released<3>> for Released {
    fn from(of_map: released::Released<3>) -> Self {
        Self(Either::Map(Arc::new(of_map)))
    }
}

impl Released {
    /// Returns the released map; an error for an image.
    pub fn of_map(self) -> PyResult<Arc<released::Released<3>>> {
        match self.0 {
            Either::Map(of_map) => Ok(of_map),
            Either::Image(_) => Err(wrong("released", "that of a map", "that of an image")),
        }
    }
}

#[pymethods]
impl Released {
    /// Reads a released map (`.npz`).
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| read_released::<3>(&path)).map(Self::from).map_err(raised)
    }

    /// Writes the released map (`.npz`), as `unlift obfuscate` does. Replaces other files only with `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        let write =
            |path: &Path| of_either!(&self.0, released => write_released(path, released, None));
        save(py, (path, force), Kind::Released, write)
    }

    fn __len__(&self) -> usize {
        of_either!(&self.0, released => released.n_records())
    }

    fn __repr__(&self) -> String {
        let (n, family) = (self.__len__(), self.family());
        format!("<unlift.Released: {n} {family} hiding {} points>", self.n_slots())
    }

    /// Kind of records: "lines", "rays", "axis_planes" or "axis_candidates".
    #[getter]
    fn family(&self) -> &'static str {
        of_either!(&self.0, released => released.obfuscation().family())
    }

    /// Unit of lengths.
    #[getter]
    fn unit(&self) -> &'static str {
        of_either!(&self.0, released => released.unit().name())
    }

    /// Number of hidden points per record.
    #[getter]
    fn slots_per_record(&self) -> usize {
        of_either!(&self.0, released => released.slots_per_record())
    }

    /// Number of hidden points.
    #[getter]
    fn n_slots(&self) -> usize {
        of_either!(&self.0, released => released.n_slots())
    }

    /// Origin `(3,)` of the stored records; for an image, its middle `(2,)`.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        of_either!(&self.0, released => to_array(py, released.origin().to_vec()).into_any())
    }

    /// Lower and upper corner of an image `(2, 2)`, in pixels; None for a map.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Either::Image(of_image) = &self.0 else { return Ok(None) };
        let corners = of_image.bounds().map(|bounds| vec![bounds.low, bounds.high]);
        corners.map(|corners| Ok(to_rows(py, corners)?.into_any())).transpose()
    }

    /// Hash of this map, in hexadecimal.
    #[getter]
    fn fingerprint(&self) -> String {
        of_either!(&self.0, released => released.fingerprint().to_string())
    }

    /// Descriptors `(n_slots, dim)`, or None.
    #[getter]
    fn descriptors<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let rows = of_either!(&self.0, released => released.descriptors());
        rows.map(|rows| to_descriptors(py, rows)).transpose()
    }

    /// Columns of the records by name, relative to `origin`. Lines: foot and direction `(n, 3)`.
    /// Rays: centers `(m, 3)`, center `(n,)` and direction `(n, 3)`. Planes: axis and offset
    /// `(n,)`. Candidates: position `(n, 3)`. Images have 2 instead of 3.
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        of_either!(&self.0, released => columns(py, released.obfuscation()))
    }
}

/// Returns the columns of records by name.
fn columns<'py, const D: usize>(
    py: Python<'py>,
    records: &Obfuscation<D>,
) -> PyResult<Bound<'py, PyDict>> {
    let vectors = |rows: &[[f32; D]]| to_rows(py, rows.to_vec()).map(Bound::into_any);
    let columns = match records {
        Obfuscation::Lines(lines) => {
            vec![("foot", vectors(lines.foot())?), ("direction", vectors(lines.direction())?)]
        }
        Obfuscation::Rays(rays) => vec![
            ("centers", vectors(rays.centers())?),
            ("center", to_array(py, rays.center().to_vec()).into_any()),
            ("direction", vectors(rays.direction())?),
        ],
        Obfuscation::AxisPlanes(planes) => vec![
            ("axis", to_array(py, planes.axis().to_vec()).into_any()),
            ("offset", to_array(py, planes.offset().to_vec()).into_any()),
        ],
        Obfuscation::AxisCandidates(points) => vec![("position", vectors(points.position())?)],
    };
    columns.into_py_dict(py)
}

/// What only the owner of a map has: its points, and the record that hides each.
#[pyclass(frozen, module = "unlift")]
#[derive(Clone)]
pub struct Truth {
    pub original: Arc<Original<3>>,
    pub secret: Arc<Secret>,
}

#[pymethods]
impl Truth {
    /// Reads a truth file (`.npz`).
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let (original, secret) = py.detach(|| read_truth::<3>(&path)).map_err(raised)?;
        Ok(Self { original: Arc::new(original), secret: Arc::new(secret) })
    }

    /// Writes the truth (`.npz`), as `unlift obfuscate` does, readable only by you. Replaces other files only with `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        let write = |path: &Path| write_truth(path, &self.original, &self.secret);
        save(py, (path, force), Kind::Truth, write)
    }

    /// Points `(n, 3)`.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(to_rows(py, self.original.reveal().positions().to_vec())?.into_any())
    }

    /// Index of the point in each slot `(n_slots,)`.
    #[getter]
    fn hidden<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        to_array(py, self.secret.hidden().iter().map(|id| id.0).collect()).into_any()
    }

    /// Number of points without a record, by reason.
    #[getter]
    fn dropped(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        for dropped in self.secret.dropped() {
            *counts.entry(dropped.reason.name()).or_default() += 1;
        }
        counts
    }

    fn __repr__(&self) -> String {
        format!("<unlift.Truth: {} points>", self.secret.n_slots())
    }
}

/// A hidden map: `released` for the attacker, `truth` for the owner.
#[pyclass(frozen, module = "unlift", get_all)]
pub struct Hidden {
    pub released: Released,
    pub truth: Truth,
}

#[pymethods]
impl Hidden {
    fn __repr__(&self) -> String {
        let released = &self.released;
        format!("<unlift.Hidden: {} points in {}>", released.n_slots(), released.__repr__())
    }
}

/// Extracts the released map from a Released or a Hidden, without reading the truth.
pub fn released_of(given: &Bound<'_, PyAny>) -> PyResult<Released> {
    if let Ok(hidden) = given.cast::<Hidden>() {
        return Ok(hidden.get().released.clone());
    }
    let released = given.cast::<Released>().map(|released| released.get().clone());
    released.map_err(|_| wrong("released", "a Released or a Hidden", given.get_type()))
}

/// Extracts the truth from a Truth or a Hidden.
pub fn truth_of(given: &Bound<'_, PyAny>) -> PyResult<Truth> {
    if let Ok(hidden) = given.cast::<Hidden>() {
        return Ok(hidden.get().truth.clone());
    }
    let truth = given.cast::<Truth>().map(|truth| truth.get().clone());
    truth.map_err(|_| wrong("truth", "a Truth or a Hidden", given.get_type()))
}

/// Writes a stage file of `kind` to `path` by `write`; with `force`, also over foreign files.
pub fn save(
    py: Python<'_>,
    (path, force): (PathBuf, bool),
    kind: Kind,
    write: impl FnOnce(&Path) -> Result<(), unlift_io::Error> + Send,
) -> PyResult<()> {
    py.detach(|| {
        let rules = outputs::Rules::new([], force);
        check_file("path", &path, outputs::Kind::Stage(kind), &rules).map_err(refused)?;
        write(&path).map_err(raised)
    })
}

/// Renames the option that an error advises to its Python name.
pub fn refused(error: unlift_audit::Error) -> PyErr {
    raised(error.to_string().replace("--out", "out"))
}
