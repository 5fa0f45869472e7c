//! Audits of maps and of images: arguments to an `Audit`, which becomes a report.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use serde_json::{Map as Json, Value, json};
use unlift::Unit;
use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::neighbors::Source;
use unlift::neighbors::oracle::Noise;
use unlift::obfuscate::{SCHEMES, Scheme, SchemeOptions};
use unlift::recover::Solver;
use unlift_audit::images::{Opened, Opening, Wanted};
use unlift_audit::{
    Audit, Audited, Error, Gate, Images as ImagesInput, Input, Map as MapInput, Output, Request,
    Tiles, sources,
};
use unlift_vision::network::DescriptorKind;

use crate::arrays::{raised, wrong};
use crate::images::Images;
use crate::lists;
use crate::map::{Map, scheme_of};
use crate::own::{Own, Raised, solver_of};
use crate::report::Report;
use crate::threads::{self, Watcher};

/// Options of all audits; `None` means the default.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Options<'py> {
    schemes: Option<Vec<Bound<'py, PyAny>>>,
    neighbors: Vec<Bound<'py, PyAny>>,
    inlier_ratios: Option<Vec<f64>>,
    oracle_noise: Option<Vec<String>>,
    solvers: Option<Vec<Bound<'py, PyAny>>>,
    thresholds: Option<Bound<'py, PyAny>>,
    k: usize,
    #[pyo3(default)]
    tile_points: Option<usize>,
    #[pyo3(default)]
    tile: Option<usize>,
    #[pyo3(default = true)]
    records_alone: bool,
    seed: u64,
    repeats: u32,
    gates: Vec<String>,
    threads: Option<usize>,
}

/// Options of audits of images, beside the common ones.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ImageOptions {
    features: Option<String>,
    max_features: Option<NonZeroUsize>,
    max_images: Option<NonZeroUsize>,
    photos: Option<PathBuf>,
    pictures: bool,
}

/// Extracts options from the dict `given`; an error about an item is one about an argument.
fn options_of<'py, T>(given: &Bound<'py, PyAny>) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py, Error = PyErr>,
{
    let py = given.py();
    given.extract::<T>().map_err(|error| {
        let text = error.value(py).to_string();
        match (text.rsplit_once('.'), error.cause(py)) {
            (Some((_, name)), Some(cause)) => {
                let text = format!("argument '{name}': {}", cause.value(py));
                PyErr::from_type(cause.get_type(py), text)
            }
            _ => error,
        }
    })
}

/// Runs `work` with progress that `tell` receives. Returns its result, and what it reported beside notes of the report.
fn observed(
    py: Python<'_>,
    threads: Option<usize>,
    (tell, by): (Option<Py<PyAny>>, &Raised),
    work: impl FnOnce(&Watcher) -> Result<Audited, Error> + Send + 'static,
) -> PyResult<(Report, Vec<String>)> {
    let watcher = Arc::new(Watcher::new(tell, by.waiting.clone()));
    let progress = Arc::clone(&watcher);
    let result = threads::run(py, threads, Some(&by.waiting), move || work(&progress));
    let audited = result.map_err(|error| by.as_cause_of(py, renamed(py, error)))?;
    let is_note = |line: &String| {
        line.strip_prefix("note: ")
            .is_some_and(|note| audited.document.notes.iter().any(|known| known == note))
    };
    let messages = watcher.messages().into_iter().filter(|line| !is_note(line)).collect();
    Ok((Report(Arc::new(audited)), messages))
}

/// Renames options of the command line that begin an error to Python arguments.
fn renamed(py: Python<'_>, error: PyErr) -> PyErr {
    let text = error.value(py).to_string();
    let Some((option, rest)) = text.strip_prefix("--").and_then(|text| text.split_once(':')) else {
        return error;
    };
    raised(format!("{}:{}", option.replace('-', "_"), rest.replace("--", "")))
}

/// Audits `map` with the options in the dict `options`, and calls `tell` with done, total and the next item.
#[pyfunction]
pub fn audit(
    py: Python<'_>,
    map: &Map,
    options: &Bound<'_, PyAny>,
    tell: Option<Py<PyAny>>,
) -> PyResult<Report> {
    let by = Raised::default();
    let output = Output::new(Path::new(""));
    let options = options_of::<Options<'_>>(options)?;
    let unit = map.prepared.original.reveal().unit();
    let (request, gates) = (options.request::<3>(unit, &by)?, options.gates()?);
    let tiles = match (options.tile_points, options.tile) {
        (Some(max_points), only) if max_points > 0 => Some(Tiles { max_points, only }),
        (None, None) => None,
        (None, Some(at)) => return Err(wrong("tile", "tile_points beside it", at)),
        (Some(max_points), _) => return Err(wrong("tile_points", "at least 1", max_points)),
    };
    let (prepared, about) = (Arc::clone(&map.prepared), map.about.clone());
    let work = move |progress: &Watcher| {
        let n_points = prepared.original.len();
        let n_together = tiles.map_or(n_points, |tiles| n_points.min(tiles.max_points));
        let usual = Plan::new(unit).for_map(n_together, request.plan.k);
        let mut audit = Audit { about, gates, ..Audit::new(output).of_map(&prepared) };
        let (points, descriptors) = (prepared.original.reveal(), prepared.descriptors.as_ref());
        let plan = request.of_map(usual, points, (descriptors, ""), &mut audit.remarks)?;
        let map = MapInput { plan, localize: None, ..MapInput::new(&prepared) };
        let input = match tiles {
            Some(tiles) => Input::Tiles(map, tiles),
            None => Input::Map(map),
        };
        audit.run(&input, progress)
    };
    Ok(observed(py, options.threads, (tell, &by), work)?.0)
}

/// Audits `images` with the options in the dict `options`, and calls `tell` with done, total and the
/// current image. Also returns messages that the report lacks.
#[pyfunction]
pub fn audit_images(
    py: Python<'_>,
    images: &Bound<'_, PyAny>,
    options: &Bound<'_, PyAny>,
    tell: Option<Py<PyAny>>,
) -> PyResult<(Report, Vec<String>)> {
    let by = Raised::default();
    let output = Output::new(Path::new(""));
    let of_images = options_of::<ImageOptions>(options)?;
    let options = options_of::<Options<'_>>(options)?;
    let (request, gates) = (options.request::<2>(Unit::Pixel, &by)?, options.gates()?);
    let images = Images::of(images, &by)?;
    let wanted = of_images.wanted()?;
    let work = move |progress: &Watcher| {
        let mut plan = request.plan(Plan::new(Unit::Pixel), true)?;
        plan.check_for_many()?;
        let max_images = of_images.max_images.map(NonZeroUsize::get);
        let photos = of_images.photos.clone();
        let opened = match images {
            Images::InMemory(images) => {
                wanted.check_unused("arrays")?;
                Opened::of(images, Path::new("images"), max_images)
            }
            Images::Path(path) => {
                let photos = photos.as_deref();
                let opening = Opening { wanted, max_images, photos, ..Opening::default() };
                Opened::open(&path, &opening, &mut plan)?
            }
        };
        let draws = of_images.pictures;
        let images = ImagesInput { opened: &opened, plan, draws, photos, inversion: None };
        let options = of_images.record();
        let audit = Audit { options, gates, ..Audit::new(output) };
        audit.run(&Input::Images(images), progress).map_err(|error| {
            let line = error.to_string();
            match progress.messages().first().filter(|_| line.ends_with("can be used, found 0")) {
                // The reason of the first image tells most.
                Some(first) => Error::request(format!("{line}: {first}")),
                None => error,
            }
        })
    };
    observed(py, options.threads, (tell, &by), work)
}

impl ImageOptions {
    /// Returns the options for the report, with the names of the command line.
    fn record(&self) -> Json<String, Value> {
        let record = [
            ("features", self.features.as_ref().map(|name| json!(name))),
            ("max_features", self.max_features.map(|max| json!(max.get()))),
            ("max_images", self.max_images.map(|max| json!(max.get()))),
        ];
        let given = record.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?)));
        given.collect()
    }

    /// Returns the options of the extractor for photos.
    fn wanted(&self) -> PyResult<Wanted> {
        let kind = self.features.as_deref().map(DescriptorKind::from_name);
        Ok(Wanted {
            option: "--features",
            kind: kind.transpose().map_err(raised)?,
            max_features: self.max_features,
            ..Wanted::default()
        })
    }
}

impl Options<'_> {
    /// Returns these options for points in `unit`.
    fn request<const D: usize>(&self, unit: Unit, by: &Raised) -> PyResult<Request<D>>
    where
        Own: Source<D> + Solver<D>,
    {
        let noise = |name: &String| Noise::from_name(name).map_err(raised);
        let plan = Plan {
            schemes: each("schemes", self.schemes.as_deref(), |given| scheme(given, unit, by))?,
            neighbors: each("neighbors", Some(&self.neighbors), |given| source(given, by))?,
            inlier_ratios: each("inlier_ratios", self.inlier_ratios.as_deref(), |&x| Ok(x))?,
            oracle_noise: each("oracle_noise", self.oracle_noise.as_deref(), noise)?,
            solvers: each("solvers", self.solvers.as_deref(), |given| solver_of(given, by))?,
            thresholds: thresholds(self.thresholds.as_ref())?,
            k: self.k,
            records_alone: self.records_alone,
            seed: self.seed,
            repeats: self.repeats,
            ..Plan::new(unit)
        };
        Ok(Request { plan, changes: Vec::new() })
    }

    fn gates(&self) -> PyResult<Vec<Gate>> {
        self.gates.iter().map(|text| Gate::parse(text)).collect::<Result<_, _>>().map_err(raised)
    }
}

/// Converts each of `given`; an empty list is an error, and none means the default.
fn each<T, U>(
    name: &str,
    given: Option<&[T]>,
    convert: impl FnMut(&T) -> PyResult<U>,
) -> PyResult<Vec<U>> {
    match given {
        None => Ok(Vec::new()),
        Some([]) => Err(wrong(name, "at least one", "none")),
        Some(given) => given.iter().map(convert).collect(),
    }
}

/// Returns the source for a name or a function.
fn source<const D: usize>(given: &Bound<'_, PyAny>, by: &Raised) -> PyResult<NeighborsBy<D>>
where
    Own: Source<D>,
{
    Ok(match given.extract::<String>().as_deref() {
        Ok("oracle") => NeighborsBy::Oracle,
        Ok(name) => NeighborsBy::Source(lists::named(name, None)?.of_dimension().map_err(raised)?),
        Err(_) => {
            let source: Arc<dyn Source<D>> = Arc::new(Own::source(given, by)?);
            let name = source.name();
            let is_ours = ["oracle", "file"].contains(&name) || sources::named(name).is_ok();
            check_own_name("neighbors", name, is_ours)?;
            NeighborsBy::Source(source)
        }
    })
}

/// Returns the scheme for a name or a function.
fn scheme<const D: usize>(
    given: &Bound<'_, PyAny>,
    unit: Unit,
    by: &Raised,
) -> PyResult<Arc<dyn Scheme<D>>> {
    let scheme = scheme_of(given, &SchemeOptions::usual(unit), by)?;
    let is_ours = SCHEMES.iter().any(|entry| entry.name == scheme.name());
    check_own_name("schemes", scheme.name(), is_ours && given.extract::<String>().is_err())?;
    Ok(scheme)
}

/// Returns an error for a function with a built-in name, because a report would mistake it for the built-in one.
fn check_own_name(what: &str, name: &str, is_taken: bool) -> PyResult<()> {
    let expected = "functions with a name that unlift does not use";
    if is_taken { Err(wrong(what, expected, name)) } else { Ok(()) }
}

/// Returns thresholds from strings or numbers; none means the default.
pub fn thresholds(given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<Threshold>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    let given = given.try_iter()?.collect::<PyResult<Vec<_>>>()?;
    each("thresholds", Some(&given), |threshold| {
        let text = threshold.str()?.to_string();
        Threshold::parse(&text).map_err(|_| wrong("thresholds", "numbers above 0", text))
    })
}
