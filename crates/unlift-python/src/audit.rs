//! Audits of maps and of images: arguments to a plan, and the plan to a report.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use pyo3::prelude::*;
use serde_json::{Map as Json, Value, json};
use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::{Needs as Need, Source};
use unlift::obfuscate::{SCHEMES, Scheme, SchemeOptions};
use unlift::recover::{Delta, Solver};
use unlift::{Descriptors, Unit};
use unlift_audit::images::FeatureSource;
use unlift_audit::images::audit::{ImagesJob, find as find_images};
use unlift_audit::images::choice;
use unlift_audit::images::extraction::{Wanted, sample};
use unlift_audit::images::stream::Needs;
use unlift_audit::maps::{Tiles, find};
use unlift_audit::{Error, Gate, Job, Prepared, check_thresholds, sources};
use unlift_vision::network::DescriptorKind;

use crate::arrays::{raised, wrong};
use crate::images::Images;
use crate::lists;
use crate::map::{Map, scheme_of};
use crate::own::{OwnSolver, OwnSource, Raised, solver_of};
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
    delta: Option<f64>,
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

/// Audits `map` with the options in the dict `options`, and calls `tell` with done, total and the
/// next item.
#[pyfunction]
pub fn audit(
    py: Python<'_>,
    map: &Map,
    options: &Bound<'_, PyAny>,
    tell: Option<Py<PyAny>>,
) -> PyResult<Report> {
    let (started, by) = (Instant::now(), Raised::default());
    let options = options_of::<Options<'_>>(options)?;
    let (plan, notes, doubt) = options.plan_of_map(py, &map.prepared, &by)?;
    let gates = options.gates()?;
    let tiles = match (options.tile_points, options.tile) {
        (Some(most), only) if most > 0 => Some(Tiles { most, only }),
        (None, None) => None,
        (None, Some(at)) => return Err(wrong("tile", "tile_points beside it", at)),
        (Some(most), _) => return Err(wrong("tile_points", "at least 1", most)),
    };
    let watcher = Arc::new(Watcher::new(tell, by.stop()));
    let progress = Arc::clone(&watcher);
    let (prepared, input) = (Arc::clone(&map.prepared), map.input.clone());
    let (cameras, up) = (map.cameras.clone(), map.up);
    let notes = map.notes.iter().cloned().chain(notes).collect();
    let result = threads::run(py, options.threads, Some(by.stop()), move || {
        let job = Job {
            descriptors: prepared.descriptors.as_ref(),
            cameras,
            up,
            plan,
            input,
            notes,
            doubts: prepared.doubts.iter().cloned().chain(doubt).collect(),
            gates,
            tiles,
            progress: &*progress,
            ..Job::of(&prepared.original, started)
        };
        find(job)
    });
    if let Some(error) = watcher.failed() {
        return Err(error);
    }
    result.map(Report::of).map_err(|error| by.as_cause_of(py, error))
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
    let (started, by) = (Instant::now(), Raised::default());
    let of_images = options_of::<ImageOptions>(options)?;
    let options = options_of::<Options<'_>>(options)?;
    let (plan, gates) = (options.plan_of_images(&by)?, options.gates()?);
    let images = Images::of(images, &by)?;
    let wanted = of_images.wanted()?;
    let watcher = Arc::new(Watcher::new(tell, by.stop()));
    let progress = Arc::clone(&watcher);
    let result = threads::run(py, options.threads, Some(by.stop()), move || {
        let opened = open(images, &wanted, &of_images, &plan)?;
        if let Some(note) = opened.source.passed_over() {
            unlift_audit::Progress::say(&*progress, note);
        }
        let job = ImagesJob {
            source: &opened.source,
            path: &opened.path,
            chosen: opened.chosen,
            plan,
            options: of_images.record(),
            gates,
            draws: of_images.pictures,
            photos: of_images.photos,
            out: PathBuf::new(),
            share_safe: false,
            inversion: None,
            progress: &*progress,
            command: None,
            started,
        };
        let (audited, used) = find_images(job)?;
        audited.ok_or_else(|| {
            let (n, path) = (used.unusable, opened.path.display());
            let line = format!("{path}: expected {n} images that can be used, found 0");
            let first = progress.messages().into_iter().next();
            Error::request(first.map_or(line.clone(), |first| format!("{line}: {first}")))
        })
    });
    if let Some(error) = watcher.failed() {
        return Err(error);
    }
    let audited = result.map_err(|error| by.as_cause_of(py, renamed(py, error)))?;
    let notes: Vec<String> =
        audited.document.notes.iter().map(|note| format!("note: {note}")).collect();
    let messages = watcher.messages().into_iter().filter(|line| !notes.contains(line)).collect();
    Ok((Report::of(audited), messages))
}

/// Renames options of the command line in an error to Python arguments.
fn renamed(py: Python<'_>, error: PyErr) -> PyErr {
    let text = error.value(py).to_string();
    let names = ["features", "max-features", "max-images"];
    let option =
        |text: String, name: &&str| text.replace(&format!("--{name}"), &name.replace('-', "_"));
    let renamed = names.iter().fold(text.clone(), option);
    if renamed == text { error } else { raised(renamed) }
}

impl ImageOptions {
    /// Returns the options for the report, with the names of the command line.
    fn record(&self) -> Json<String, Value> {
        let record = [
            ("features", self.features.as_ref().map(|name| json!(name))),
            ("max_features", self.max_features.map(|most| json!(most.get()))),
            ("max_images", self.max_images.map(|most| json!(most.get()))),
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

struct Opened {
    source: FeatureSource,
    path: PathBuf,
    chosen: Vec<usize>,
}

fn open(
    images: Images,
    wanted: &Wanted,
    options: &ImageOptions,
    plan: &Plan<2>,
) -> Result<Opened, Error> {
    let (source, path) = match images {
        Images::InMemory(images) => {
            wanted.check_unused("arrays")?;
            (FeatureSource::InMemory(images), Path::new("images").to_owned())
        }
        Images::Path(path) => {
            if options.photos.is_some() && path.is_dir() {
                let expected = "photos: expected with features, found a folder of photos";
                return Err(Error::request(expected));
            }
            let extraction = wanted.extraction(&path)?;
            if let (true, Some(rows)) = (path.is_dir(), sample(&extraction)) {
                fit(plan, Some(&rows))?;
            }
            (FeatureSource::open(&path, &extraction)?, path)
        }
    };
    let chosen = choice::evenly(source.names().len(), options.max_images.map(|most| most.get()));
    // One error instead of one per image.
    if let (FeatureSource::File(_), true) = (&source, Needs::of_plan(plan).descriptors())
        && let Some(first) = source.first(&chosen)
    {
        fit(plan, first.descriptors.as_ref())?;
    }
    Ok(Opened { source, path, chosen })
}

/// Returns an error if a source of `plan` does not support the descriptors.
fn fit(plan: &Plan<2>, descriptors: Option<&Descriptors>) -> Result<(), Error> {
    for source in plan.own_sources() {
        let (expected, found) = match descriptors {
            Some(rows) => match source.takes(rows) {
                Ok(()) => continue,
                Err(error) => (error.expected().to_owned(), error.found().to_owned()),
            },
            None if source.needs() == Need::Nothing => continue,
            None => ("descriptors".to_owned(), "none".to_owned()),
        };
        let name = source.name();
        return Err(Error::request(format!(
            "neighbors: {name}: expected {expected}, found {found}"
        )));
    }
    Ok(())
}

impl Options<'_> {
    /// Returns the plan for `prepared`, notes for the user, and doubts about the results.
    fn plan_of_map(
        &self,
        py: Python<'_>,
        prepared: &Arc<Prepared>,
        by: &Raised,
    ) -> PyResult<(Plan<3>, Vec<String>, Option<String>)> {
        let points = prepared.original.reveal();
        let at_once = self.tile_points.map_or(points.len(), |most| points.len().min(most));
        let usual = Plan::<3>::new(points.unit()).for_map(at_once, self.k);
        let plan = self.plan(usual, points.unit(), by)?;
        plan.check(points.len(), prepared.descriptors.is_some()).map_err(raised)?;
        let (prepared, typed) = (Arc::clone(prepared), self.thresholds.is_some());
        threads::run(py, self.threads, None, move || {
            let points = prepared.original.reveal();
            let (positions, unit) = (points.positions(), points.unit());
            let checked = check_thresholds(positions, unit, &plan.thresholds, typed)?;
            let mut notes: Vec<String> = checked.note.into_iter().collect();
            for source in plan.neighbors.iter().filter_map(NeighborsBy::source) {
                if let Some(descriptors) = &prepared.descriptors {
                    source.takes(descriptors)?;
                }
                notes.extend(source.note(points.len()));
            }
            Ok::<_, Error>((plan, notes, checked.doubt))
        })
    }

    /// Returns the plan for images.
    fn plan_of_images(&self, by: &Raised) -> PyResult<Plan<2>> {
        let plan = self.plan(Plan::<2>::new(Unit::Pixel), Unit::Pixel, by)?;
        let plan = Plan { headline: choice::headline(&plan.thresholds), ..plan };
        plan.check_for_many().map_err(raised)?;
        Ok(plan)
    }

    /// Returns the plan `usual` with these options, for points in `unit`.
    fn plan<const D: usize>(&self, usual: Plan<D>, unit: Unit, by: &Raised) -> PyResult<Plan<D>>
    where
        OwnSource: Source<D>,
        OwnSolver: Solver<D>,
    {
        let schemes = match &self.schemes {
            Some(schemes) => schemes
                .iter()
                .map(|given| own_or_named(given, unit, by))
                .collect::<PyResult<_>>()?,
            None => usual.schemes.clone(),
        };
        let noise = self.oracle_noise.as_deref().map(|names| {
            let all = names.iter().map(|name| Noise::from_name(name));
            all.collect::<Result<_, _>>().map(distinct).map_err(raised)
        });
        let solvers = self.solvers.as_deref().map(|given| solvers(given, by));
        let neighbors = self.sources(by)?;
        let of_oracle = [
            ("inlier_ratios", self.inlier_ratios.is_some()),
            ("oracle_noise", self.oracle_noise.is_some()),
        ];
        if let Some((name, _)) = of_oracle.iter().find(|(_, given)| *given)
            && !neighbors.iter().any(NeighborsBy::is_oracle)
        {
            let found: Vec<&str> = neighbors.iter().map(NeighborsBy::name).collect();
            let found = format!("only {}", found.join(", "));
            return Err(wrong(name, "neighbors with \"oracle\"", found));
        }
        Ok(Plan {
            schemes,
            neighbors,
            inlier_ratios: self.inlier_ratios.clone().map_or(usual.inlier_ratios, distinct),
            oracle_noise: noise.transpose()?.unwrap_or(usual.oracle_noise),
            solvers: solvers.transpose()?.unwrap_or(usual.solvers),
            k: self.k,
            delta: delta(self.delta)?,
            records_alone: self.records_alone,
            thresholds: thresholds(self.thresholds.as_ref(), &usual.thresholds)?,
            seed: self.seed,
            repeats: self.repeats,
            ..usual
        })
    }

    fn gates(&self) -> PyResult<Vec<Gate>> {
        self.gates.iter().map(|text| Gate::parse(text)).collect::<Result<_, _>>().map_err(raised)
    }

    /// Returns the sources; each name may occur once.
    fn sources<const D: usize>(&self, by: &Raised) -> PyResult<Vec<NeighborsBy<D>>>
    where
        OwnSource: Source<D>,
    {
        let mut kept: Vec<NeighborsBy<D>> = Vec::new();
        for given in &self.neighbors {
            let name = given.extract::<String>();
            let source = match name.as_deref() {
                Ok("oracle") => NeighborsBy::Oracle,
                Ok(name) => {
                    let named = lists::named(name, None)?.of_dimension();
                    NeighborsBy::Source(named.map_err(raised)?)
                }
                Err(_) => NeighborsBy::Source(Arc::new(OwnSource::new(given, by)?)),
            };
            let is_ours = ["oracle", "file"].contains(&source.name())
                || sources::all().into_iter().any(|entry| entry.name == source.name());
            check_own_name("neighbors", given, source.name(), is_ours)?;
            match (kept.iter().any(|other| other.name() == source.name()), name) {
                (false, _) => kept.push(source),
                // As on the command line.
                (true, Ok(_)) => {}
                (true, Err(_)) => {
                    return Err(wrong("neighbors", "each name once", source.name()));
                }
            }
        }
        Ok(kept)
    }
}

/// Returns the scheme for a name or a function.
fn own_or_named<const D: usize>(
    given: &Bound<'_, PyAny>,
    unit: Unit,
    by: &Raised,
) -> PyResult<Arc<dyn Scheme<D>>> {
    let scheme = scheme_of(given, &SchemeOptions::usual(unit), by)?;
    let is_ours = SCHEMES.iter().any(|entry| entry.name == scheme.name());
    check_own_name("schemes", given, scheme.name(), is_ours)?;
    Ok(scheme)
}

/// Returns an error for a function with a built-in name, because a report would mistake it for the
/// built-in one.
fn check_own_name(what: &str, given: &Bound<'_, PyAny>, name: &str, taken: bool) -> PyResult<()> {
    match taken && given.extract::<String>().is_err() {
        true => Err(wrong(what, "functions with a name that unlift does not use", name)),
        false => Ok(()),
    }
}

/// Returns the solvers for names or functions, without repeated names, as on the command line.
fn solvers<const D: usize>(
    given: &[Bound<'_, PyAny>],
    by: &Raised,
) -> PyResult<Vec<Arc<dyn Solver<D>>>>
where
    OwnSolver: Solver<D>,
{
    let mut kept: Vec<Arc<dyn Solver<D>>> = Vec::new();
    for one in given {
        let solver = solver_of::<D>(one, by)?;
        let is_name = one.extract::<String>().is_ok();
        if !(is_name && kept.iter().any(|other| other.name() == solver.name())) {
            kept.push(solver);
        }
    }
    Ok(kept)
}

/// Removes items that repeat an earlier one, because an audit has one row per combination.
fn distinct<T: PartialEq>(items: Vec<T>) -> Vec<T> {
    let mut kept = Vec::with_capacity(items.len());
    for item in items {
        if !kept.contains(&item) {
            kept.push(item);
        }
    }
    kept
}

/// Returns thresholds from strings or numbers, or the default.
pub fn thresholds(
    given: Option<&Bound<'_, PyAny>>,
    usual: &[Threshold],
) -> PyResult<Vec<Threshold>> {
    let Some(given) = given else { return Ok(usual.to_vec()) };
    let one = |threshold: PyResult<Bound<'_, PyAny>>| {
        let text = threshold?.str()?.to_string();
        Threshold::parse(&text).map_err(|_| wrong("thresholds", "numbers above 0", text))
    };
    let thresholds = given.try_iter()?.map(one).collect::<PyResult<Vec<_>>>()?;
    for (at, threshold) in thresholds.iter().enumerate() {
        if thresholds[..at].iter().any(|other| other.value == threshold.value) {
            return Err(wrong("thresholds", "each once", format!("{} again", threshold.label)));
        }
    }
    if thresholds.is_empty() {
        return Err(wrong("thresholds", "at least one", "none"));
    }
    Ok(thresholds)
}

/// Returns the distance within which a record supports a position.
pub fn delta(given: Option<f64>) -> PyResult<Delta> {
    match given {
        None => Ok(Delta::Auto),
        Some(length) if length.is_finite() && length > 0.0 => Ok(Delta::Fixed(length)),
        Some(other) => Err(wrong("delta", "a number above 0, or None", other)),
    }
}
