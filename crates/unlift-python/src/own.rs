//! Schemes, sources and solvers that are Python functions, and property tests of them.

use std::sync::{Arc, Mutex};

use pyo3::exceptions::{PyAssertionError, PyKeyboardInterrupt};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use unlift::guard::caught;
use unlift::neighbors::{Needs, Neighborhoods, Source};
use unlift::obfuscate::{Lifted, LocalPoints, Scheme};
use unlift::recover::{Builtin, RecoverOptions, Recovered, Solver};
use unlift::released::Released;
use unlift::seed::{Key, Stage};
use unlift::{Error, OneLine};

use crate::arrays::{raised, rows, to_rows, wrong};
use crate::hidden::{Released as PyReleased, released_of};
use crate::lists::{self, Neighborhoods as PyNeighborhoods};
use crate::records::hiding;
use crate::threads::{self, Waiting, locked};

/// Exceptions of user functions, and the thread that calls them.
#[derive(Clone, Debug, Default)]
pub struct Raised {
    /// Exceptions, each with its message.
    errors: Arc<Mutex<Vec<(String, PyErr)>>>,
    pub waiting: Waiting,
}

impl Raised {
    /// Runs `make` on the waiting thread. Stores an exception, and returns its message. An interrupt ends the wait.
    pub fn made<T: Send + 'static>(
        &self,
        make: impl FnOnce(Python<'_>) -> PyResult<T> + Send + 'static,
    ) -> Result<T, String> {
        let raised = self.clone();
        let made = self.waiting.call(move |py| match make(py) {
            Err(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) => Err(error),
            made => Ok(made.map_err(|error| raised.keep(error))),
        });
        made.unwrap_or_else(|| Err("an interrupt".to_owned()))
    }

    /// Stores `error`, and returns its message.
    fn keep(&self, error: PyErr) -> String {
        let message = OneLine(error.to_string()).to_string();
        let mut errors = locked(&self.errors);
        // One exception may concern several points: store it once.
        if errors.iter().all(|(line, _)| *line != message) {
            errors.push((message.clone(), error));
        }
        message
    }

    /// Sets the stored exception whose message `error` contains as its cause.
    pub fn as_cause_of(&self, py: Python<'_>, error: PyErr) -> PyErr {
        let text = error.value(py).to_string();
        let errors = locked(&self.errors);
        let known = errors.iter().filter(|(line, _)| text.contains(line.as_str()));
        // If one message is the beginning of another, the longer one is the cause.
        if let Some((_, cause)) = known.max_by_key(|(line, _)| line.len()) {
            error.set_cause(py, Some(cause.clone_ref(py)));
        }
        error
    }
}

/// A Python function that is a scheme, a source or a solver:
/// - a scheme returns the records of `points` (n, D),
/// - a source returns the lists of a released map,
/// - a solver returns positions `(n_slots, D)` from a released map and its lists, relative to the
///   released origin; rows that are not finite were not recovered.
#[derive(Clone, Debug)]
pub struct Own {
    name: String,
    function: Arc<Py<PyAny>>,
    /// True if it takes a random generator.
    takes_random: bool,
    /// What a source reads: descriptors unless the attribute `needs` is "nothing".
    needs: Needs,
    /// Number of records of a source's list that are used.
    k: usize,
    raised: Raised,
}

/// Default number of records of a list that are used; the attribute `k` changes it.
const USUAL_K: usize = 50;

impl Own {
    /// Accepts a scheme.
    pub fn scheme(function: &Bound<'_, PyAny>, raised: &Raised) -> PyResult<Self> {
        Self::new(function, ("schemes", 1), raised)
    }

    /// Accepts a source.
    pub fn source(function: &Bound<'_, PyAny>, raised: &Raised) -> PyResult<Self> {
        let needs = match function.getattr("needs") {
            Ok(needs) => lists::needs_of(&needs.extract::<String>()?)?,
            Err(_) => Needs::Descriptors,
        };
        let k = function.getattr("k").ok().map(|k| k.extract()).transpose()?.unwrap_or(USUAL_K);
        if k == 0 {
            return Err(wrong("k", "at least 1", k));
        }
        Ok(Self { needs, k, ..Self::new(function, ("neighbors", 1), raised)? })
    }

    /// Accepts a solver.
    pub fn solver(function: &Bound<'_, PyAny>, raised: &Raised) -> PyResult<Self> {
        Self::new(function, ("solvers", 2), raised)
    }

    /// Accepts a function of `n_given` arguments, or one more for a random generator.
    fn new(
        function: &Bound<'_, PyAny>,
        (what, n_given): (&str, usize),
        raised: &Raised,
    ) -> PyResult<Self> {
        if !function.is_callable() {
            let found = function.repr()?.to_string();
            return Err(wrong(what, "a name or a function", OneLine(found)));
        }
        let attribute = |name: &str| -> Option<String> {
            function.getattr(name).ok().and_then(|name| name.extract().ok())
        };
        let name = attribute("name").or_else(|| attribute("__name__"));
        let name = name.unwrap_or_else(|| "own".to_owned());
        let inspect = function.py().import("inspect")?;
        let parameters = inspect.call_method1("signature", (function,))?.getattr("parameters")?;
        Ok(Self {
            name,
            function: Arc::new(function.clone().unbind()),
            takes_random: parameters.len()? > n_given,
            needs: Needs::Nothing,
            k: USUAL_K,
            raised: raised.clone(),
        })
    }

    /// Calls `make`; returns an error if it raises, or if calls are no longer allowed.
    fn made<T: Send + 'static>(
        &self,
        make: impl FnOnce(&Self, Python<'_>) -> PyResult<T> + Send + 'static,
    ) -> Result<T, Error> {
        let own = self.clone();
        let made = self.raised.made(move |py| make(&own, py));
        made.map_err(|found| Error::new(&self.name, "records, lists or positions", found))
    }

    /// Calls the function with `given`, and a generator seeded by these words if it takes one.
    fn call<'py>(
        &self,
        py: Python<'py>,
        mut arguments: Vec<Bound<'py, PyAny>>,
        seed: [u64; 4],
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.takes_random {
            let random = py.import("numpy")?.getattr("random")?;
            arguments.push(random.call_method1("default_rng", (seed.to_vec(),))?);
        }
        self.function.bind(py).call1(PyTuple::new(py, arguments)?)
    }
}

impl<const D: usize> Scheme<D> for Own {
    fn name(&self) -> &str {
        &self.name
    }

    fn lift(&self, points: &LocalPoints<'_, D>, key: &Key) -> Result<Lifted<D>, Error> {
        let (n, points) = (points.positions.len(), points.positions.to_vec());
        let mut draws = key.draws(Stage::Scheme, 0);
        let seed = [(); 4].map(|()| draws.bits());
        let hiding = self.made(move |own, py| {
            let returned = own.call(py, vec![to_rows(py, points)?.into_any()], seed)?;
            hiding(&returned, &own.name)
        })?;
        hiding.lifted(n, &self.name)
    }
}

impl<const D: usize> Source<D> for Own
where
    PyReleased: From<Released<D>>,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn needs(&self) -> Needs {
        self.needs
    }

    fn k(&self, _: &Released<D>) -> usize {
        self.k
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        let released = released.clone();
        self.made(move |own, py| {
            let shown = Bound::new(py, PyReleased::from(released.clone()))?.into_any();
            let returned = own.call(py, vec![shown], [seed, 0, 0, 0])?;
            lists::returned(&returned, &released, k, own.needs)
        })
    }
}

impl<const D: usize> Solver<D> for Own
where
    PyReleased: From<Released<D>>,
{
    fn name(&self) -> &str {
        &self.name
    }

    fn recover(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        options: &RecoverOptions,
    ) -> Result<Recovered<D>, Error> {
        let (shown, listed, seed) = (released.clone(), Arc::new(lists.clone()), options.seed);
        let positions = self.made(move |own, py| {
            let shown = Bound::new(py, PyReleased::from(shown))?.into_any();
            let listed = Bound::new(py, PyNeighborhoods(listed))?.into_any();
            let returned = own.call(py, vec![shown, listed], [seed, 0, 0, 0])?;
            rows::<D>("positions", &returned)
        })?;
        let positions: Vec<[f32; D]> = positions.iter().map(|x| x.map(|x| x as f32)).collect();
        Recovered::from_positions(released, lists, &positions)
    }
}

/// Returns the solver for `given`, a name or a function.
pub fn solver_of<const D: usize>(
    given: &Bound<'_, PyAny>,
    raised_by: &Raised,
) -> PyResult<Arc<dyn Solver<D>>>
where
    Own: Solver<D>,
{
    match given.extract::<String>() {
        Ok(name) => Ok(Arc::new(Builtin::from_name(&name).map_err(raised)?)),
        Err(_) => Ok(Arc::new(Own::solver(given, raised_by)?)),
    }
}

/// Runs `laws`; a failure becomes an AssertionError with the property, the points and the result.
fn kept(py: Python<'_>, by: &Raised, laws: impl FnOnce() + Send + 'static) -> PyResult<()> {
    let result = threads::run(py, None, Some(&by.waiting), move || Ok::<_, String>(caught(laws)))?;
    result.map_err(|text| by.as_cause_of(py, PyAssertionError::new_err(text)))
}

/// Checks that a scheme hides every point, on its record, by its key alone, and in an order that reveals nothing.
///
/// It calls the scheme with 0, 1, 2, 3, 7, 120, 200, 300, 301, 600 and 700 points: of a made-up
/// room, at random, many in one place; with `images`, keypoints `(n, 2)`. A scheme may refuse
/// points by an exception, except 200, 600 and 700 points of a room.
#[pyfunction]
#[pyo3(signature = (scheme, *, images=false))]
pub fn check_scheme(py: Python<'_>, scheme: &Bound<'_, PyAny>, images: bool) -> PyResult<()> {
    let by = Raised::default();
    let scheme = Own::scheme(scheme, &by)?;
    kept(py, &by, move || match images {
        true => unlift_testkit::scheme_laws::<2>(&scheme),
        false => unlift_testkit::scheme_laws::<3>(&scheme),
    })
}

/// Checks that a source returns a list for every hidden point of `released`, of records of this map, by its seed alone.
///
/// It calls the source three times.
#[pyfunction]
pub fn check_source(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    released: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let (by, released) = (Raised::default(), released_of(released)?.of_map()?);
    let source = Own::source(source, &by)?;
    kept(py, &by, move || unlift_testkit::source_laws::<3>(&source, &released))
}

/// Checks that a solver returns a row for every hidden point of `released`, and the same positions again.
///
/// It calls the solver three times, the last time with empty lists.
#[pyfunction]
pub fn check_solver(
    py: Python<'_>,
    solver: &Bound<'_, PyAny>,
    released: &Bound<'_, PyAny>,
    lists: &PyNeighborhoods,
) -> PyResult<()> {
    let (by, released) = (Raised::default(), released_of(released)?.of_map()?);
    let (solver, lists) = (Own::solver(solver, &by)?, Arc::clone(&lists.0));
    kept(py, &by, move || unlift_testkit::solver_laws::<3>(&solver, &released, &lists))
}
