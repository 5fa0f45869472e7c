//! Neighbor lists: of the oracle, of a source, or given.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use unlift::audit::staged::oracle_lists;
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::sources::Named;
use unlift::neighbors::{self, Needs};
use unlift::released;
use unlift::{About, RecordId, RowOrder};
use unlift_audit::sources;
use unlift_io::stage::{Kind, read_neighborhoods, write_neighborhoods};

use crate::arrays::{numbers, raised, shape_text, to_array, whole, wrong};
use crate::hidden::{Hidden, of_either, released_of, save};
use crate::threads;

/// For every hidden point, a list of records that probably hide its nearest neighbors, likeliest first.
#[pyclass(frozen, module = "unlift")]
pub struct Neighborhoods(pub Arc<neighbors::Neighborhoods>);

#[pymethods]
impl Neighborhoods {
    /// Converts an array `(n_slots, k)` of records of `released`, padded by -1, and optional scores of the same shape. For lines through
    /// two points, `slots` may have the slot of each record that is meant: lists that say it recover more.
    #[new]
    #[pyo3(signature = (released, records, scores=None, *, slots=None, needs="descriptors"))]
    fn new(
        released: &Bound<'_, PyAny>,
        records: &Bound<'_, PyAny>,
        scores: Option<&Bound<'_, PyAny>>,
        slots: Option<&Bound<'_, PyAny>>,
        needs: &str,
    ) -> PyResult<Self> {
        let needs = needs_of(needs)?;
        let lists = of_either!(&released_of(released)?.0, released => {
            lists_of(released, records, (scores, slots), usize::MAX, needs)
        });
        Ok(Self(Arc::new(lists?)))
    }

    /// Reads lists of `released` (`.npz`).
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, released: &Bound<'_, PyAny>) -> PyResult<Self> {
        let of = released_of(released)?.of_map()?;
        let lists = py.detach(|| read_neighborhoods(&path, of.n_records(), of.slots_per_record()));
        Ok(Self(Arc::new(lists.map_err(raised)?)))
    }

    /// Writes the lists (`.npz`), as `unlift neighbors` does. Replaces other files only with
    /// `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        save(py, (path, force), Kind::Neighborhoods, |path| write_neighborhoods(path, &self.0))
    }

    /// Number of lists.
    fn __len__(&self) -> usize {
        self.0.n_slots()
    }

    fn __repr__(&self) -> String {
        format!("<unlift.Neighborhoods: {} lists of up to {}>", self.0.n_slots(), self.0.longest())
    }

    /// Record numbers of all lists, one list after the other.
    #[getter]
    fn records<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        to_array(py, self.0.records().iter().map(|record| record.0).collect()).into_any()
    }

    /// The slot of each record that is meant, or None.
    #[getter]
    fn slots<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.0.slots().map(|slots| to_array(py, slots.to_vec()).into_any())
    }

    /// Start of each list in `records`, and the total number of entries.
    #[getter]
    fn offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        to_array(py, self.0.offsets().to_vec()).into_any()
    }

    /// Scores of the entries, higher for likelier ones, or None.
    #[getter]
    fn scores<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.0.scores().map(|scores| to_array(py, scores.to_vec()).into_any())
    }
}

/// Returns what a source needs, by its name.
pub fn needs_of(name: &str) -> PyResult<Needs> {
    match name {
        "descriptors" => Ok(Needs::Descriptors),
        "nothing" => Ok(Needs::Nothing),
        unknown => Err(wrong("needs", "descriptors or nothing", unknown)),
    }
}

/// Converts an array `(n_slots, k)`, padded by -1, to lists of `released` with at most `k` entries each.
fn lists_of<const D: usize>(
    released: &released::Released<D>,
    records: &Bound<'_, PyAny>,
    (scores, slots): (Option<&Bound<'_, PyAny>>, Option<&Bound<'_, PyAny>>),
    k: usize,
    needs: Needs,
) -> PyResult<neighbors::Neighborhoods> {
    let (n, n_slots) = (released.n_records(), released.n_slots());
    let (rows, shape) = whole::<i64>("records", records, &[2], -1..=n as i64 - 1)?;
    if shape[0] != n_slots {
        let expected = format!("an array of shape ({n_slots}, k), one row per hidden point");
        return Err(wrong("records", expected, shape_text(&shape)));
    }
    let check_shape = |name: &str, own: &[usize]| {
        let expected = || format!("the shape of the records, {}", shape_text(&shape));
        if own == shape { Ok(()) } else { Err(wrong(name, expected(), shape_text(own))) }
    };
    let scores = scores.map(|scores| numbers("scores", scores)).transpose()?;
    scores.iter().try_for_each(|(_, own)| check_shape("scores", own))?;
    let slots = slots.map(|slots| whole::<i64>("slots", slots, &[2], -1..=n_slots as i64 - 1));
    let slots = slots.transpose()?;
    slots.iter().try_for_each(|(_, own)| check_shape("slots", own))?;
    let columns = shape[1];
    let (mut offsets, mut kept) = (vec![0], Vec::new());
    for slot in 0..n_slots {
        let row = slot * columns..(slot + 1) * columns;
        kept.extend(row.filter(|&at| rows[at] >= 0).take(k));
        offsets.push(kept.len() as u64);
    }
    let records = kept.iter().map(|&at| RecordId(rows[at] as u32)).collect();
    let scores = scores.map(|(scores, _)| kept.iter().map(|&at| scores[at] as f32).collect());
    let slots_per_record = released.slots_per_record();
    let lists = neighbors::Neighborhoods::try_new(offsets, records, scores, n, slots_per_record);
    let mut lists = lists.map_err(raised)?;
    if let Some((slots, _)) = slots {
        let slots = kept.iter().map(|&at| slots[at] as u32).collect();
        lists = lists.with_slots(slots).map_err(raised)?;
    }
    let order = match needs {
        Needs::Nothing => RowOrder::Either,
        _ => RowOrder::DescriptorRows,
    };
    let map = Some(released.fingerprint());
    Ok(lists.with_about(About { map, order, ..About::default() }))
}

/// Converts the result of a function: Neighborhoods, an array of records, or records and scores.
pub fn returned<const D: usize>(
    given: &Bound<'_, PyAny>,
    released: &released::Released<D>,
    k: usize,
    needs: Needs,
) -> PyResult<neighbors::Neighborhoods> {
    if let Ok(lists) = given.cast::<Neighborhoods>() {
        return Ok((*lists.get().0).clone());
    }
    if let Ok(both) = given.cast::<PyTuple>() {
        let (records, scores): (Bound<'_, PyAny>, Bound<'_, PyAny>) = both.extract()?;
        return lists_of(released, &records, (Some(&scores), None), k, needs);
    }
    lists_of(released, given, (None, None), k, needs)
}

/// Id of the process that has used networks, or 0. Forked children lack the threads of the networks.
static NETWORKS_OF: AtomicU32 = AtomicU32::new(0);

/// Returns the source called `name`, with lists of `k` if given.
pub fn named(name: &str, k: Option<usize>) -> PyResult<Named> {
    let named = sources::named(name).map_err(raised)?;
    if named.name() == "learned" {
        let own = std::process::id();
        let earlier = NETWORKS_OF.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed);
        if earlier.is_err_and(|earlier| earlier != own) {
            // The call would wait forever for the missing threads.
            let expected = "a process whose parent has not used it (get_context(\"spawn\"))";
            return Err(wrong("learned", expected, "a forked child"));
        }
    }
    Ok(if let Some(k) = k { named.with_k(k) } else { named })
}

/// Makes lists from released data alone, as `unlift neighbors` does.
#[pyfunction]
#[pyo3(signature = (released, source, *, k=None, seed=0, threads=None))]
pub fn find(
    py: Python<'_>,
    released: &Bound<'_, PyAny>,
    source: &str,
    k: Option<usize>,
    seed: u64,
    threads: Option<usize>,
) -> PyResult<Neighborhoods> {
    let released = released_of(released)?.of_map()?;
    let source = named(source, k)?.of_dimension::<3>().map_err(raised)?;
    let lists = threads::run(py, threads, None, move || {
        source.supports(&released)?;
        source.lists(&released, source.k(&released), seed)
    })?;
    Ok(Neighborhoods(Arc::new(lists)))
}

/// Makes lists from the truth: a share `inlier_ratio` of each are among the `k` true neighbors.
#[pyfunction]
#[pyo3(signature = (hidden, inlier_ratio, *, k=50, noise="uniform", seed=0))]
pub fn oracle(
    py: Python<'_>,
    hidden: &Hidden,
    inlier_ratio: f64,
    k: usize,
    noise: &str,
    seed: u64,
) -> PyResult<Neighborhoods> {
    let how = (Noise::from_name(noise).map_err(raised)?, inlier_ratio, k);
    let (released, truth) = (hidden.released.clone().of_map()?, hidden.truth.clone());
    let lists = threads::run(py, None, None, move || {
        let hidden = ((*released).clone(), (*truth.secret).clone());
        oracle_lists(&truth.original, &hidden, how, seed)
    })?;
    Ok(Neighborhoods(Arc::new(lists)))
}
