//! Audits of images, from arrays or a path.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use pyo3::prelude::*;
use serde_json::{Map, json};
use unlift::Descriptors;
use unlift::audit::Plan;
use unlift::neighbors::Needs as Need;
use unlift_audit::images::FeatureSource;
use unlift_audit::images::audit::{ImagesJob, Used, find};
use unlift_audit::images::choice;
use unlift_audit::images::extraction::{Wanted, sample};
use unlift_audit::images::stream::Needs;
use unlift_audit::{Audited, Error};
use unlift_nn::DescriptorKind;

use crate::audit::{asked_of, gates_of};
use crate::errors::{raised, wrong};
use crate::heard::Heard;
use crate::images::Images;
use crate::own::Raised;
use crate::plan::Asked;
use crate::report::Report;
use crate::work;

/// Name of images in arrays, for errors.
const ARRAYS: &str = "images";

/// Options of audits of images, beside the common ones.
#[derive(FromPyObject)]
struct OfImages {
    #[pyo3(item)]
    features: Option<String>,
    #[pyo3(item)]
    max_features: Option<std::num::NonZeroUsize>,
    #[pyo3(item)]
    min_score: Option<f32>,
    #[pyo3(item)]
    max_images: Option<std::num::NonZeroUsize>,
    #[pyo3(item)]
    photos: Option<PathBuf>,
    #[pyo3(item)]
    show: Option<Vec<String>>,
}

impl OfImages {
    /// Returns the options for the report, with the names of the command line.
    fn options(&self) -> Map<String, serde_json::Value> {
        let mut options = Map::new();
        if let Some(name) = &self.features {
            options.insert("features".into(), json!(name));
        }
        if let Some(most) = self.max_features {
            options.insert("max_features".into(), json!(most.get()));
        }
        if let Some(score) = self.min_score {
            options.insert("min_score".into(), json!(score));
        }
        if let Some(most) = self.max_images {
            options.insert("max_images".into(), json!(most.get()));
        }
        if let Some(names) = self.show.as_ref().filter(|names| !names.is_empty()) {
            options.insert("show".into(), json!(names));
        }
        options
    }

    /// Returns the options of the extractor for photos at `path`, checked against the sources of
    /// `plan`. Arrays, whose path is [`ARRAYS`], must not have such options.
    fn wanted(&self) -> PyResult<Wanted> {
        let kind = self.features.as_deref().map(DescriptorKind::from_name);
        if let Some(score) = self.min_score.filter(|score| !(0.0..1.0).contains(score)) {
            return Err(wrong("min_score", "a number from 0 to below 1", score));
        }
        Ok(Wanted {
            option: "--features",
            kind: kind.transpose().map_err(raised)?,
            max_features: self.max_features,
            min_score: self.min_score,
            ..Wanted::default()
        })
    }
}

/// Audits `images` with the options in the dict `asked`, and calls `tell` with done, total and the
/// current image. Also returns messages that the report lacks.
#[pyfunction]
pub fn audit_images(
    py: Python<'_>,
    images: &Bound<'_, PyAny>,
    asked: &Bound<'_, PyAny>,
    tell: Option<Py<PyAny>>,
) -> PyResult<(Report, Vec<String>)> {
    let (started, by) = (Instant::now(), Raised::default());
    let (options, of_images) = (asked_of::<Asked<'_>>(asked)?, asked_of::<OfImages>(asked)?);
    let (plan, gates) = (options.plan_of_images(&by)?, gates_of(&options.gates)?);
    let images = Images::of(images, &by)?;
    let wanted = of_images.wanted()?;
    let mut record = of_images.options();
    if let Some(k) = options.source_k {
        record.insert("source_k".to_owned(), k.into());
    }
    let stop = by.stop();
    let heard = Arc::new(Heard::new(tell, Arc::clone(&stop)));
    let progress = Arc::clone(&heard);
    let found = work::run(py, options.threads, Some(stop), move || {
        let opened = open(images, &wanted, &of_images, &plan)?;
        if let Some(note) = opened.source.passed_over() {
            unlift_audit::Progress::say(&*progress, note);
        }
        let job = ImagesJob {
            source: &opened.source,
            path: &opened.path,
            chosen: opened.chosen,
            plan,
            options: record,
            gates,
            show: opened.show,
            photos: of_images.photos,
            out: PathBuf::new(),
            share_safe: false,
            inversion: None,
            progress: &*progress,
            command: None,
            started,
        };
        found(find(job)?, &opened.path, &progress)
    });
    if let Some(error) = heard.failed() {
        return Err(error);
    }
    let found = found.map_err(|error| by.as_cause_of(py, renamed(py, error)))?;
    let notes: Vec<String> =
        found.document.notes.iter().map(|note| format!("note: {note}")).collect();
    let said = heard.said().into_iter().filter(|line| !notes.contains(line)).collect();
    Ok((Report::of(found), said))
}

struct Opened {
    source: FeatureSource,
    path: PathBuf,
    chosen: Vec<usize>,
    show: Option<Vec<usize>>,
}

fn open(
    images: Images,
    wanted: &Wanted,
    asked: &OfImages,
    plan: &Plan<2>,
) -> Result<Opened, Error> {
    let (source, path) = match images {
        Images::InMemory(images) => {
            wanted.check_unused("arrays")?;
            (FeatureSource::InMemory(images), PathBuf::from(ARRAYS))
        }
        Images::Path(path) => {
            if asked.photos.is_some() && path.is_dir() {
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
    let names = source.names();
    let chosen = choice::evenly(names.len(), asked.max_images.map(|most| most.get()));
    let place = path.display().to_string();
    let show = match asked.show.as_deref() {
        None => None,
        Some(wanted) => Some(choice::shown(wanted, names, &chosen, &place)?),
    };
    // One error instead of one per image.
    if let (FeatureSource::File(_), true) = (&source, Needs::of_plan(plan).descriptors())
        && let Some(first) = source.first(&chosen)
    {
        fit(plan, first.descriptors.as_ref())?;
    }
    Ok(Opened { source, path, chosen, show })
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

/// Returns the results; an error with that of the first image if no image can be used.
fn found(
    (found, used): (Option<Audited>, Used),
    path: &Path,
    heard: &Heard,
) -> Result<Audited, Error> {
    found.ok_or_else(|| {
        let n = used.unusable;
        let line = format!("{}: expected {n} images that can be used, found 0", path.display());
        match heard.said().into_iter().next() {
            Some(first) => Error::request(format!("{line}: {first}")),
            None => Error::request(line),
        }
    })
}

/// Renames options of the command line in an error to Python arguments.
fn renamed(py: Python<'_>, error: PyErr) -> PyErr {
    let text = error.value(py).to_string();
    let names = ["features", "max-features", "min-score", "max-images", "show"];
    let option =
        |text: String, name: &&str| text.replace(&format!("--{name}"), &name.replace('-', "_"));
    let renamed = names.iter().fold(text.clone(), option);
    if renamed == text { error } else { raised(renamed) }
}
