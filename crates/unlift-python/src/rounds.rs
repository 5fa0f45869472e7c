//! Joint recovery whose edges are spread: what a part does with its own, and who leads.

use std::io::{Read, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict};
use unlift::RecordId;
use unlift::neighbors;
use unlift::recover::{
    Edges as Rows, Lead as Leading, Moved, NamedBy, Outline as Outlined, RecoverOptions,
    prepare_rounds as learn, prepare_rounds_shelved as learn_shelved,
};
use unlift_io::atomic::{Access, write_file};
use unlift_io::input;

use crate::arrays::{column, indices, to_array, whole};
use crate::errors::{raised, wrong};
use crate::hidden::released_of;
use crate::parts::{Map, Model, columns, part, with_lists};
use crate::recovered::{Recovered, options};
use crate::work;

/// Who lists whom about some slots, one after the other.
#[pyclass(frozen, module = "unlift._unlift")]
pub struct Edges(Arc<Rows>);

#[pymethods]
impl Edges {
    /// The edges of the slots from `first` on: ends and classes end to end, a row per slot from `offsets` on.
    #[new]
    fn new(
        released: &Bound<'_, PyAny>,
        first: usize,
        offsets: &Bound<'_, PyAny>,
        ends: &Bound<'_, PyAny>,
        classes: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let released = released_of(released)?.of_map()?;
        let offsets = starts(offsets)?;
        let map = (released.n_records(), released.slots_per_record());
        let (ends, _) = indices("ends", ends, &[1], u32::MAX)?;
        let (classes, _) = indices("classes", classes, &[1], 256)?;
        let classes = classes.into_iter().map(|class| class as u8).collect();
        let slots = first..first.saturating_add(offsets.len().saturating_sub(1));
        let edges = Rows::try_new(slots, offsets, ends, classes, map).map_err(raised)?;
        Ok(Self(Arc::new(edges)))
    }

    /// The same from lists: those of the slots from `first` on, and all entries of any lists that name records of these slots
    /// (`named`, by the lists of the slots `by`). Scores, where the model's lists have them.
    #[staticmethod]
    #[pyo3(signature = (model, released, first, offsets, records, named, by, *, scores=None, named_scores=None, threads=None))]
    #[allow(clippy::too_many_arguments)]
    fn of_lists(
        py: Python<'_>,
        model: &Model,
        released: &Bound<'_, PyAny>,
        first: usize,
        offsets: &Bound<'_, PyAny>,
        records: &Bound<'_, PyAny>,
        named: &Bound<'_, PyAny>,
        by: &Bound<'_, PyAny>,
        scores: Option<&Bound<'_, PyAny>>,
        named_scores: Option<&Bound<'_, PyAny>>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let released = released_of(released)?.of_map()?;
        let offsets = starts(offsets)?;
        let most = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let (records, _) = indices("records", records, &[1], most(released.n_records()))?;
        let (named, _) = indices("named", named, &[1], most(released.n_records()))?;
        let (by, _) = indices("by", by, &[1], most(released.n_slots()))?;
        let floats = |name: &str, given: Option<&Bound<'_, PyAny>>| -> PyResult<Option<Vec<f32>>> {
            let values = given.map(|given| column(name, given)).transpose()?;
            Ok(values.map(|values| values.into_iter().map(|x| x as f32).collect()))
        };
        let scores = floats("scores", scores)?;
        let named_scores = floats("named_scores", named_scores)?;
        let records = records.into_iter().map(RecordId).collect();
        let model = Arc::clone(&model.0);
        let edges = work::run(py, threads, None, move || {
            let map = (released.n_records(), released.slots_per_record());
            let slots = first..first.saturating_add(offsets.len().saturating_sub(1));
            let lists = neighbors::Neighborhoods::of_slots(first, &offsets, records, scores, map)?;
            let named_by = NamedBy { records: &named, slots: &by, scores: named_scores.as_deref() };
            model.edges(&released, &lists, slots, named_by)
        })?;
        Ok(Self(Arc::new(edges)))
    }

    /// Columns: where rows start, the other ends, and the class of each.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        found.set_item("offsets", to_array(py, self.0.offsets().to_vec()))?;
        found.set_item("ends", to_array(py, self.0.ends().to_vec()))?;
        found.set_item("classes", to_array(py, self.0.class().to_vec()))?;
        Ok(found)
    }

    /// Where these slots are before the first round: a dict of columns, a row per slot.
    #[pyo3(signature = (model, released, *, threads=None))]
    fn start<'py>(
        &self,
        py: Python<'py>,
        model: &Model,
        released: &Bound<'_, PyAny>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let released = released_of(released)?.of_map()?;
        let (edges, model) = (Arc::clone(&self.0), Arc::clone(&model.0));
        let part = work::run(py, threads, None, move || model.start_part(&released, &edges))?;
        columns(py, part)
    }

    /// Where those of them go whose turn it is, that have edges: the same columns, `slot` and `ahead`.
    #[pyo3(signature = (model, released, standing, *, threads=None))]
    fn move_on<'py>(
        &self,
        py: Python<'py>,
        model: &Model,
        released: &Bound<'_, PyAny>,
        standing: PyBackedBytes,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let released = released_of(released)?.of_map()?;
        let (edges, model) = (Arc::clone(&self.0), Arc::clone(&model.0));
        let moved =
            work::run(py, threads, None, move || model.move_part(&released, &edges, &standing))?;
        let estimates = moved.iter().map(|one| one.estimate).collect();
        let found = columns(py, unlift::recover::Part { estimates, descriptor_row: None })?;
        found.set_item("slot", to_array(py, moved.iter().map(|one| one.slot).collect()))?;
        found.set_item("ahead", to_array(py, moved.iter().map(|one| one.ahead).collect()))?;
        Ok(found)
    }

    /// Whom their jumps concern, and how many each: two columns.
    #[pyo3(signature = (model, released, news, *, threads=None))]
    fn tell<'py>(
        &self,
        py: Python<'py>,
        model: &Model,
        released: &Bound<'_, PyAny>,
        news: PyBackedBytes,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let released = released_of(released)?.of_map()?;
        let (edges, model) = (Arc::clone(&self.0), Arc::clone(&model.0));
        let told = work::run(py, threads, None, move || model.tell_part(&released, &edges, &news))?;
        let found = PyDict::new(py);
        found.set_item("slot", to_array(py, told.iter().map(|one| one.0).collect()))?;
        found.set_item("jumps", to_array(py, told.iter().map(|one| one.1).collect()))?;
        Ok(found)
    }
}

/// What is known of the edges of a map to whoever leads its rounds without them.
#[pyclass(frozen, module = "unlift._unlift")]
pub struct Outline(Vec<u8>);

#[pymethods]
impl Outline {
    /// The outline that `to_bytes` gave.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Outlined::from_bytes(bytes).map(|_| Self(bytes.to_vec())).map_err(raised)
    }

    /// The outline as bytes: 8 of a slot and a few million more.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0)
    }
}

/// `prepare` for rounds whose edges are spread: the model for all, and what their lead must know of the edges.
#[pyfunction]
#[pyo3(signature = (released, lists, *, delta=None, seed=0, exact_constraints=true, memory_limit=None, threads=None))]
#[allow(clippy::too_many_arguments)]
pub fn prepare_rounds(
    py: Python<'_>,
    released: &Bound<'_, PyAny>,
    lists: &Bound<'_, PyAny>,
    delta: Option<f64>,
    seed: u64,
    exact_constraints: bool,
    memory_limit: Option<u64>,
    threads: Option<usize>,
) -> PyResult<(Model, Outline)> {
    let options = options("joint", delta, seed, exact_constraints)?;
    let options = RecoverOptions { confidence: false, ..options };
    let (model, outline) = with_lists(
        py,
        (released, lists),
        (memory_limit, threads),
        move |released, lists| learn(released, lists, &options),
        move |released, lists, files| learn_shelved(released, lists, &options, files),
    )?;
    Ok((Model(Arc::new(model)), Outline(outline.to_bytes())))
}

/// Leads the rounds of a map whose edges others have.
#[pyclass(frozen, module = "unlift._unlift")]
pub struct Lead {
    model: Arc<unlift::recover::Model<3>>,
    released: Arc<Map>,
    rounds: Arc<Mutex<Leading<3>>>,
}

#[pymethods]
impl Lead {
    /// Before the first round. `start`: columns of all slots in order; `lengths`: how many edges each has in its part.
    #[new]
    fn new(
        py: Python<'_>,
        model: &Model,
        released: &Bound<'_, PyAny>,
        outline: &Outline,
        start: &Bound<'_, PyDict>,
        lengths: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let map = released_of(released)?.of_map()?;
        let start = part(start, map.n_slots())?.estimates;
        Self::made(py, (model, map, outline), lengths, move |model, map, outline, lengths| {
            Leading::new(model, map, outline, (&start, lengths))
        })
    }

    /// The lead that `save` put in a file. `lengths`: how many edges each slot has in its part.
    #[staticmethod]
    fn resume(
        py: Python<'_>,
        model: &Model,
        released: &Bound<'_, PyAny>,
        outline: &Outline,
        lengths: &Bound<'_, PyAny>,
        path: PathBuf,
    ) -> PyResult<Self> {
        let map = released_of(released)?.of_map()?;
        let (mut file, _) = input::open(&path).map_err(raised)?;
        let (mut kept, place) = (Vec::new(), path.display().to_string());
        file.read_to_end(&mut kept).map_err(|error| wrong(&place, "a file", error))?;
        Self::made(py, (model, map, outline), lengths, move |model, map, outline, lengths| {
            Leading::resume(model, map, outline, (lengths, &kept))
                .map_err(|error| error.within(&place))
        })
    }

    /// Puts the lead between two rounds in a file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let kept = self.with(py, |rounds| rounds.to_bytes())?;
        py.detach(|| write_file(&path, Access::Private, |to| to.write_all(&kept))).map_err(raised)
    }

    /// Whether all rounds are done.
    #[getter]
    fn is_done(&self, py: Python<'_>) -> PyResult<bool> {
        self.with(py, |rounds| Ok(rounds.is_done()))
    }

    /// Where the round stands, as bytes for all parts.
    fn standing<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let standing = self.with(py, |rounds| Ok(rounds.standing()))?;
        Ok(PyBytes::new(py, &standing))
    }

    /// Takes what all parts said of the slots whose turn it was, in any order: the news as bytes for all parts, None without any.
    fn moved<'py>(
        &self,
        py: Python<'py>,
        columns: &Bound<'_, PyDict>,
    ) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let given = |name: &str| -> PyResult<Bound<'_, PyAny>> {
            let missing = || wrong("columns", format!("a column {name}"), "none");
            columns.get_item(name)?.ok_or_else(missing)
        };
        let (slots, _) = indices("slot", &given("slot")?, &[1], u32::MAX)?;
        let ahead = column("ahead", &given("ahead")?)?;
        let estimates = part(columns, slots.len())?.estimates;
        if ahead.len() != slots.len() {
            return Err(wrong("ahead", format!("{} rows", slots.len()), ahead.len()));
        }
        let rows = slots.into_iter().zip(ahead).zip(estimates);
        let moved: Vec<Moved<3>> = rows
            .map(|((slot, ahead), estimate)| Moved { slot, ahead: ahead as f32, estimate })
            .collect();
        let news = self.with(py, move |rounds| rounds.moved(&moved))?;
        Ok(news.map(|news| PyBytes::new(py, &news)))
    }

    /// Ends the round: how many `jumps` concern which slots, as all parts say.
    fn told(
        &self,
        py: Python<'_>,
        slots: &Bound<'_, PyAny>,
        jumps: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let (slots, _) = indices("slot", slots, &[1], u32::MAX)?;
        let (jumps, _) = indices("jumps", jumps, &[1], u32::MAX)?;
        if slots.len() != jumps.len() {
            return Err(wrong("jumps", format!("{} rows", slots.len()), jumps.len()));
        }
        let told: Vec<(u32, u32)> = slots.into_iter().zip(jumps).collect();
        let (model, released) = (Arc::clone(&self.model), Arc::clone(&self.released));
        self.with(py, move |rounds| rounds.told(&model, &released, &told))
    }

    /// What came back, once all rounds are done: what `recover` gives without confidence, bit for bit.
    #[pyo3(signature = (descriptor_row=None))]
    fn finish(
        &self,
        py: Python<'_>,
        descriptor_row: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Recovered> {
        let rows = descriptor_row.map(|rows| indices("descriptor_row", rows, &[1], u32::MAX));
        let rows = rows.transpose()?.map(|(rows, _)| rows);
        let (model, released) = (Arc::clone(&self.model), Arc::clone(&self.released));
        let found = self.with(py, move |rounds| rounds.finish(&model, &released, rows))?;
        Ok(Recovered(Arc::new(found)))
    }
}

impl Lead {
    /// The lead that `make` makes of model, map, outline and lengths.
    fn made(
        py: Python<'_>,
        (model, released, outline): (&Model, Arc<Map>, &Outline),
        lengths: &Bound<'_, PyAny>,
        make: impl FnOnce(
            &unlift::recover::Model<3>,
            &Map,
            Outlined,
            &[u32],
        ) -> Result<Leading<3>, unlift::Error>
        + Send
        + 'static,
    ) -> PyResult<Self> {
        let (lengths, _) = indices("lengths", lengths, &[1], u32::MAX)?;
        let outline = Outlined::from_bytes(&outline.0).map_err(raised)?;
        let (model, map) = (Arc::clone(&model.0), Arc::clone(&released));
        let of = Arc::clone(&model);
        let rounds = work::run(py, None, None, move || make(&of, &map, outline, &lengths))?;
        Ok(Self { model, released, rounds: Arc::new(Mutex::new(rounds)) })
    }

    /// Does something with the rounds, without the interpreter's lock.
    fn with<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Leading<3>) -> Result<T, unlift::Error> + Send + 'static,
    ) -> PyResult<T> {
        let rounds = Arc::clone(&self.rounds);
        work::run(py, None, None, move || {
            work(&mut rounds.lock().unwrap_or_else(PoisonError::into_inner))
        })
    }
}

/// Where rows start.
fn starts(offsets: &Bound<'_, PyAny>) -> PyResult<Vec<u64>> {
    let (offsets, _) = whole("offsets", offsets, &[1], 0..=i64::MAX)?;
    Ok(offsets.into_iter().map(|at| at as u64).collect())
}
