//! A map solved in parts, each by whoever has its records and the lists of some slots.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};
use unlift::RecordId;
use unlift::neighbors;
use unlift::recover::{
    Estimate, Model as Learned, Part, RecoverOptions, Status, prepare as learn, prepare_shelved,
};
use unlift_io::shelf::Files;
use unlift_io::stage::{read_neighborhoods, shelve_neighborhoods};

use crate::arrays::{column, indices, rows, to_array, whole};
use crate::errors::{raised, wrong};
use crate::hidden::released_of;
use crate::lists::Neighborhoods;
use crate::recovered::{Recovered, options};
use crate::work;

/// What is learned of a released map and its lists before any point is placed: small, whatever the size of the map.
#[pyclass(frozen, module = "unlift")]
pub struct Model(pub(crate) Arc<Learned<3>>);

/// The columns of solved slots, in order.
const COLUMNS: [&str; 6] = ["position", "status", "support", "axis", "evidence", "descriptor_row"];

#[pymethods]
impl Model {
    /// The model that `to_bytes` gave.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Learned::from_bytes(bytes).map(|model| Self(Arc::new(model))).map_err(raised)
    }

    /// The model as bytes: a few hundred kilobytes at most, the same on every machine.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.to_bytes())
    }

    /// How it is pickled.
    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let from_bytes = PyType::new::<Self>(py).getattr("from_bytes")?;
        Ok((from_bytes, (self.to_bytes(py),)))
    }

    fn __repr__(&self) -> String {
        format!("<unlift.Model: {}, delta {}>", self.solver(), self.delta())
    }

    /// The distance up to which a record agrees.
    #[getter]
    fn delta(&self) -> f64 {
        self.0.delta()
    }

    /// The solver that it was made for.
    #[getter]
    fn solver(&self) -> &'static str {
        self.0.options().solver.name()
    }

    /// Solves the slots from `first` on by consensus. Their lists stand one after the other in `records` and start at `offsets`, which
    /// has an entry more than there are slots; whatever other lists say changes nothing. A dict of columns, a row per slot.
    #[pyo3(signature = (released, first, offsets, records, *, threads=None))]
    #[allow(clippy::too_many_arguments)]
    fn solve_part<'py>(
        &self,
        py: Python<'py>,
        released: &Bound<'py, PyAny>,
        first: usize,
        offsets: &Bound<'py, PyAny>,
        records: &Bound<'py, PyAny>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let released = released_of(released)?.of_map()?;
        let (offsets, _) = whole("offsets", offsets, &[1], 0..=i64::MAX)?;
        let offsets: Vec<u64> = offsets.into_iter().map(|at| at as u64).collect();
        let most = u32::try_from(released.n_records()).unwrap_or(u32::MAX);
        let (records, _) = indices("records", records, &[1], most)?;
        let records = records.into_iter().map(RecordId).collect();
        let model = Arc::clone(&self.0);
        let part = work::run(py, threads, None, move || {
            let map = (released.n_records(), released.slots_per_record());
            let slots = first..first + offsets.len().saturating_sub(1);
            let lists = neighbors::Neighborhoods::of_slots(first, &offsets, records, None, map)?;
            model.solve_part(&released, &lists, slots)
        })?;
        columns(py, part)
    }

    /// What came back of the whole map, from the `columns` of all slots in order: what `recover` gives, bit for bit.
    fn join(
        &self,
        py: Python<'_>,
        released: &Bound<'_, PyAny>,
        columns: &Bound<'_, PyDict>,
    ) -> PyResult<Recovered> {
        let released = released_of(released)?.of_map()?;
        let part = part(columns, released.n_slots())?;
        let model = Arc::clone(&self.0);
        let found = work::run(py, None, None, move || model.join(&released, [part]))?;
        Ok(Recovered(Arc::new(found)))
    }
}

/// Learns what a solver must know of a released map and all of its lists, or the file of them. With a `memory_limit` (bytes) that file is
/// read a window at a time, and what takes more is put in files of the folder for temporary ones (`TMPDIR`).
#[pyfunction]
#[pyo3(signature = (released, lists, *, solver="consensus", delta=None, seed=0, exact_constraints=true, memory_limit=None, threads=None))]
#[allow(clippy::too_many_arguments)]
pub fn prepare(
    py: Python<'_>,
    released: &Bound<'_, PyAny>,
    lists: &Bound<'_, PyAny>,
    solver: &str,
    delta: Option<f64>,
    seed: u64,
    exact_constraints: bool,
    memory_limit: Option<u64>,
    threads: Option<usize>,
) -> PyResult<Model> {
    let options = options(solver, delta, seed, exact_constraints)?;
    // Nobody who has a part can say how sure it is.
    let options = RecoverOptions { confidence: false, ..options };
    let model = with_lists(
        py,
        (released, lists),
        (memory_limit, threads),
        move |released, lists| learn(released, lists, &options),
        move |released, lists, files| prepare_shelved(released, lists, &options, files),
    )?;
    Ok(Model(Arc::new(model)))
}

/// Does something with a released map and its lists, which are `here` in memory or, under a limit, `away` in files.
pub(crate) fn with_lists<T: Send + 'static>(
    py: Python<'_>,
    (released, lists): (&Bound<'_, PyAny>, &Bound<'_, PyAny>),
    (memory_limit, threads): (Option<u64>, Option<usize>),
    here: impl FnOnce(&Map, &neighbors::Neighborhoods) -> Result<T, unlift::Error> + Send + 'static,
    away: impl FnOnce(&Map, &neighbors::ShelvedLists, &Files) -> Result<T, unlift::Error>
    + Send
    + 'static,
) -> PyResult<T> {
    let released = released_of(released)?.of_map()?;
    if let Ok(lists) = lists.cast::<Neighborhoods>() {
        if memory_limit.is_some() {
            return Err(wrong("lists", "the path of a file, with memory_limit", "Neighborhoods"));
        }
        let lists = Arc::clone(&lists.get().0);
        return work::run(py, threads, None, move || here(&released, &lists));
    }
    let Ok(path) = lists.extract::<PathBuf>() else {
        let found = lists.get_type().name()?.to_string();
        return Err(wrong("lists", "Neighborhoods, or the path of their file", found));
    };
    let map = (released.n_records(), released.slots_per_record());
    work::run(py, threads, None, move || {
        let done = match memory_limit {
            None => here(&released, &read_neighborhoods(&path, map.0, map.1)?),
            Some(limit) => {
                let files = Files::new(std::env::temp_dir(), limit);
                away(&released, &shelve_neighborhoods(&path, map, &files)?, &files)
            }
        };
        done.map_err(|error| unlift_io::Error::core(&path, error))
    })
}

/// What is released of a map.
pub(crate) type Map = unlift::released::Released<3>;

/// Estimates as columns.
pub(crate) fn columns(py: Python<'_>, part: Part<3>) -> PyResult<Bound<'_, PyDict>> {
    let rows = &part.estimates;
    let values = [
        to_array(py, rows.iter().flat_map(|row| row.position).collect())
            .call_method1("reshape", ((-1, 3),))?,
        to_array(py, rows.iter().map(|row| row.status as u8).collect()).into_any(),
        to_array(py, rows.iter().map(|row| row.support).collect()).into_any(),
        to_array(py, rows.iter().map(|row| row.axis).collect()).into_any(),
        to_array(py, rows.iter().map(|row| row.evidence).collect()).into_any(),
    ];
    let found = PyDict::new(py);
    for (name, column) in COLUMNS.into_iter().zip(values) {
        found.set_item(name, column)?;
    }
    found.set_item(COLUMNS[5], part.descriptor_row.map(|rows| to_array(py, rows)))?;
    Ok(found)
}

/// The columns of `n` slots as estimates.
pub(crate) fn part(columns: &Bound<'_, PyDict>, n: usize) -> PyResult<Part<3>> {
    let given = |name: &str| -> PyResult<Bound<'_, PyAny>> {
        let missing = || wrong("columns", format!("a column {name}"), "none");
        columns.get_item(name)?.ok_or_else(missing)
    };
    let long = |name: &str, found: usize| match found == n {
        true => Ok(()),
        false => Err(wrong(name, format!("{n} rows, one per slot"), found)),
    };
    let small = |name: &str, most: u32| -> PyResult<Vec<u32>> {
        let (values, shape) = indices(name, &given(name)?, &[1], most)?;
        long(name, shape[0])?;
        Ok(values)
    };
    let positions = rows::<3>("position", &given("position")?)?;
    long("position", positions.len())?;
    let status = small("status", Status::ALL.len() as u32)?;
    let support = small("support", 1 << 16)?;
    let axis = small("axis", 3)?;
    let evidence = column("evidence", &given("evidence")?)?;
    long("evidence", evidence.len())?;
    let estimates = (0..n).map(|slot| Estimate {
        position: positions[slot].map(|x| x as f32),
        status: Status::ALL[status[slot] as usize],
        support: support[slot] as u16,
        axis: axis[slot] as u8,
        evidence: evidence[slot] as f32,
    });
    let descriptor_row = match given("descriptor_row")? {
        none if none.is_none() => None,
        _ => Some(small("descriptor_row", u32::try_from(n).unwrap_or(u32::MAX))?),
    };
    Ok(Part { estimates: estimates.collect(), descriptor_row })
}
