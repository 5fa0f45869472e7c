//! Recovery of a map in parts.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};
use unlift::RecordId;
use unlift::neighbors;
use unlift::recover::{Estimate, Model as Learned, Part, Status, prepare as learn};

use crate::arrays::{column, indices, rows, to_array, whole};
use crate::errors::{raised, wrong};
use crate::hidden::released_of;
use crate::lists::Neighborhoods;
use crate::recovered::{Recovered, options};
use crate::work;

/// What `prepare` learns from a released map and all of its lists. Its size does not depend on the
/// size of the map.
#[pyclass(frozen, module = "unlift")]
pub struct Model(Arc<Learned<3>>);

/// Columns of solved slots, in order.
const COLUMNS: [&str; 6] = ["position", "status", "support", "axis", "evidence", "descriptor_row"];

#[pymethods]
impl Model {
    /// Restores a model from the bytes of `to_bytes`.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Learned::from_bytes(bytes).map(|model| Self(Arc::new(model))).map_err(raised)
    }

    /// Returns the model as bytes: at most a few hundred kilobytes, the same on every machine.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.to_bytes())
    }

    /// Supports pickle.
    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let from_bytes = PyType::new::<Self>(py).getattr("from_bytes")?;
        Ok((from_bytes, (self.to_bytes(py),)))
    }

    fn __repr__(&self) -> String {
        format!("<unlift.Model: delta {}>", self.delta())
    }

    /// Distance within which a listed record supports a position.
    #[getter]
    fn delta(&self) -> f64 {
        self.0.delta()
    }

    /// Solves the slots from `first` on by consensus, and returns a dict of columns with a row per
    /// slot. Their lists are joined in `records` and start at `offsets`, which has one entry more
    /// than there are slots. Other lists do not matter.
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

    /// Joins the `columns` of all slots in order to the result of `recover`, bit for bit.
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

/// Learns from a released map and all of its lists what consensus needs.
#[pyfunction]
#[pyo3(signature = (released, lists, *, delta=None, seed=0, exact_constraints=true, threads=None))]
pub fn prepare(
    py: Python<'_>,
    released: &Bound<'_, PyAny>,
    lists: &Bound<'_, Neighborhoods>,
    delta: Option<f64>,
    seed: u64,
    exact_constraints: bool,
    threads: Option<usize>,
) -> PyResult<Model> {
    let options = options(delta, seed, exact_constraints)?;
    let released = released_of(released)?.of_map()?;
    let lists = Arc::clone(&lists.get().0);
    let model = work::run(py, threads, None, move || learn(&released, &lists, &options))?;
    Ok(Model(Arc::new(model)))
}

fn columns(py: Python<'_>, part: Part<3>) -> PyResult<Bound<'_, PyDict>> {
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

/// Converts the columns of `n` slots to estimates.
fn part(columns: &Bound<'_, PyDict>, n: usize) -> PyResult<Part<3>> {
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
