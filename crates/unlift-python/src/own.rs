//! Schemes and sources that are functions in Python.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::{Needs, Neighborhoods, Source};
use unlift::obfuscate::{Lifted, Scheme};
use unlift::released::Released;
use unlift::seed::{Key, Stage};
use unlift::{Error, OneLine};

use crate::arrays::to_rows;
use crate::calls;
use crate::errors::wrong;
use crate::hidden::Released as PyReleased;
use crate::lists;
use crate::records::{Hiding, InDimension, hiding};

/// What ended functions of the user's, one of which is the cause of what the user sees; and whether none is to be called any more.
#[derive(Clone, Debug, Default)]
pub struct Raised {
    /// Exceptions, each with the line that tells it.
    errors: Arc<Mutex<Vec<(String, PyErr)>>>,
    stop: Arc<AtomicBool>,
}

impl Raised {
    /// Set where no function is to be called any more: the user has interrupted.
    pub fn stop(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }

    /// Keeps `error`, and says it in a line.
    pub fn keep(&self, py: Python<'_>, error: PyErr) -> String {
        let told = OneLine(error.to_string()).to_string();
        let mut errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        // Once for all points that a function is called with.
        if errors.iter().all(|(line, _)| *line != told) {
            errors.push((told.clone(), error.clone_ref(py)));
        }
        told
    }

    /// `error` with the exception that it came from, if it tells of one.
    pub fn as_cause_of(&self, py: Python<'_>, error: PyErr) -> PyErr {
        let text = error.value(py).to_string();
        let errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        let told = errors.iter().filter(|(line, _)| text.contains(line.as_str()));
        // Of two lines of which one begins with the other, the longer one.
        if let Some((_, cause)) = told.max_by_key(|(line, _)| line.len()) {
            error.set_cause(py, Some(cause.clone_ref(py)));
        }
        error
    }
}

/// A function in Python, and how it is called.
#[derive(Debug)]
struct Function {
    name: String,
    call: Py<PyAny>,
    /// Whether it takes a random generator, too.
    takes_random: bool,
    raised: Raised,
}

impl Function {
    fn new(function: &Bound<'_, PyAny>, what: &str, raised: &Raised) -> PyResult<Self> {
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
        let (call, raised) = (function.clone().unbind(), raised.clone());
        Ok(Self { name, call, takes_random: parameters.len()? > 1, raised })
    }

    /// What `make` makes of a call, an error where it raises, or where no function is called any more.
    fn made<T>(&self, make: impl FnOnce(Python<'_>) -> PyResult<T>) -> Result<T, Error> {
        let Self { name, raised, .. } = self;
        let made =
            calls::attached(&raised.stop, |py| make(py).map_err(|error| raised.keep(py, error)));
        let made = made.unwrap_or_else(|| Err("an interrupt".to_owned()));
        made.map_err(|found| Error::new(name, "records or lists", found))
    }

    /// What it returns for `given`; with a generator of these words of seed, if it takes one.
    fn call<'py>(&self, given: Bound<'py, PyAny>, seed: [u64; 4]) -> PyResult<Bound<'py, PyAny>> {
        let py = given.py();
        let mut arguments = vec![given];
        if self.takes_random {
            let random = py.import("numpy")?.getattr("random")?;
            arguments.push(random.call_method1("default_rng", (seed.to_vec(),))?);
        }
        self.call.bind(py).call1(PyTuple::new(py, arguments)?)
    }
}

/// A scheme that is a function: `points` (n, D), and a random generator if it takes one, to records.
#[derive(Debug)]
pub struct OwnScheme(Function);

impl OwnScheme {
    pub fn new(function: &Bound<'_, PyAny>, raised: &Raised) -> PyResult<Self> {
        Function::new(function, "schemes", raised).map(Self)
    }
}

impl<const D: usize> Scheme<D> for OwnScheme
where
    Hiding<D>: InDimension,
{
    fn name(&self) -> &str {
        &self.0.name
    }

    fn lift(
        &self,
        points: &[[f64; D]],
        _: Option<&Bounds<D>>,
        key: &Key,
    ) -> Result<Lifted<D>, Error> {
        let name = &self.0.name;
        let mut draws = key.draws(Stage::Scheme, 0);
        let seed = [(); 4].map(|()| draws.bits());
        let hiding = self.0.made(|py| {
            let returned = self.0.call(to_rows(py, points.to_vec())?.into_any(), seed)?;
            hiding(&returned, name)
        })?;
        hiding.lifted(points.len(), name)
    }
}

/// A source that is a function: a released map, and a random generator if it takes one, to lists.
#[derive(Debug)]
pub struct OwnSource {
    function: Function,
    needs: Needs,
    k: usize,
}

/// Records of a list that are looked at, unless its attribute `k` says otherwise.
const USUAL_K: usize = 50;

impl OwnSource {
    /// One that reads descriptors, unless its attribute `needs` is "nothing", with lists of `k`.
    pub fn new(function: &Bound<'_, PyAny>, raised: &Raised) -> PyResult<Self> {
        let needs: Option<String> = match function.getattr("needs") {
            Ok(needs) => Some(needs.extract()?),
            Err(_) => None,
        };
        let needs = match needs.as_deref() {
            None | Some("descriptors") => Needs::Descriptors,
            Some("nothing") => Needs::Nothing,
            Some(other) => return Err(wrong("needs", "descriptors or nothing", other)),
        };
        let k = function.getattr("k").ok().map(|k| k.extract()).transpose()?.unwrap_or(USUAL_K);
        if k == 0 {
            return Err(wrong("k", "at least 1", k));
        }
        Ok(Self { function: Function::new(function, "neighbors", raised)?, needs, k })
    }
}

impl<const D: usize> Source<D> for OwnSource
where
    PyReleased: From<Released<D>>,
{
    fn name(&self) -> &str {
        &self.function.name
    }

    fn needs(&self) -> Needs {
        self.needs
    }

    fn k(&self, _: &Released<D>) -> usize {
        self.k
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        self.function.made(|py| {
            let shown = Bound::new(py, PyReleased::from(released.clone()))?.into_any();
            let returned = self.function.call(shown, [seed, 0, 0, 0])?;
            lists::returned(&returned, released, k, self.needs)
        })
    }
}
