//! Audits of images, from a source of features to results, and to the files of the output folder.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, Value};
use unlift::audit::{Outcome, Plan, run_many};
use unlift_io::hash::{hash_file, hash_files, hash_list};
use unlift_io::outputs::OutputSet;
use unlift_report::RenderOptions;
use unlift_report::document::{ImageCounts, ImageFigures, Input};
use unlift_report::inversions::Inversion as Inverted;
use unlift_report::pictures::Picture;

use super::FeatureSource;
use super::pictures::Album;
use super::stream::{Needs, Stream, Tally};
use crate::Error;
use crate::Progress;
use crate::curves::{OfItems, curves_of};
use crate::document::{self, Found, Provenance};
use crate::gate::{Gate, check_gates, gate_results};
use crate::inversion::Inversion;
use crate::outputs::{Audited, Finished};

/// The inputs of an audit of images.
pub struct ImagesJob<'a> {
    /// The source of the images.
    pub source: &'a FeatureSource,
    /// The path of the source as typed; for images in memory, their name in errors.
    pub path: &'a Path,
    /// Numbers of the images to use, ascending.
    pub chosen: Vec<usize>,
    /// The plan of the audit.
    pub plan: Plan<2>,
    /// Recorded options, in addition to those of the plan.
    pub options: Map<String, Value>,
    /// The gates.
    pub gates: Vec<Gate>,
    /// Whether some images are drawn.
    pub draws: bool,
    /// The folder of photos, if the source is a file.
    pub photos: Option<PathBuf>,
    /// The output folder.
    pub out: PathBuf,
    /// Writes figures only.
    pub share_safe: bool,
    /// Makes pictures of recovered keypoints; the plan measures with it, too.
    pub inversion: Option<Arc<Inversion>>,
    /// Receives the progress.
    pub progress: &'a dyn Progress,
    /// The command line, for the record.
    pub command: Option<String>,
    /// The start of the command.
    pub started: Instant,
}

/// The numbers of used and unusable images.
#[derive(Clone, Copy, Debug)]
pub struct Used {
    /// Images that were used.
    pub used: usize,
    /// Images that could not be read.
    pub unusable: usize,
}

/// Runs the job and writes its folder, completely or not at all. Without a usable image nothing is
/// written.
pub fn perform(job: ImagesJob<'_>, out: OutputSet) -> Result<(Option<Finished>, Used), Error> {
    let (folder, share_safe) = (job.out.clone(), job.share_safe);
    let (audited, used) = find(job)?;
    let write = |audited: Audited| audited.write(out, &folder, share_safe);
    Ok((audited.map(write).transpose()?, used))
}

/// Runs the job and writes nothing. Returns no results without a usable image. A share-safe job
/// draws no pictures.
///
/// # Errors
/// If the plan does not fit images, a gate cannot be checked, an image in memory cannot be used, or
/// `progress` stops the audit. Unusable images in files are reported, counted and skipped.
pub fn find(job: ImagesJob<'_>) -> Result<(Option<Audited>, Used), Error> {
    check_gates(&job.gates, &job.plan, false)?;
    let tally = RefCell::new(Tally::default());
    let mut figures = Vec::new();
    let mut watcher = OfItems::new(&job.plan, job.progress, |name, rows| {
        let n = tally.borrow_mut().take();
        figures.push(document::image(name, n, rows, &job.plan.thresholds));
    });
    let steps = job.progress;
    steps.show(0, job.chosen.len(), "reading images");
    for error in job.source.refused() {
        tally.borrow_mut().unusable += 1;
        steps.say(&error.to_string());
    }
    let of = (job.source, job.path);
    let needs = Needs::of_plan(&job.plan);
    let images = Stream::new(of, &job.chosen, needs, &tally, steps);
    let outcome = run_many(images, &job.plan, &mut watcher)?;
    for error in job.inversion.iter().flat_map(|inversion| inversion.failed()) {
        steps.say(&format!("note: not painted: {error}"));
    }
    let curves = watcher.curves.shares();
    let tally = tally.into_inner();
    let used = Used { used: tally.used.len(), unusable: tally.unusable };
    if used.used == 0 {
        return Ok((None, used));
    }
    let (pictures, inversions) = match job.share_safe {
        true => Default::default(),
        false => drawn(&job, &tally, &figures)?,
    };
    let input = input(&job, &tally, &outcome)?;
    let doubt = tally.doubt();
    if let Some(doubt) = &doubt {
        steps.say(&format!("note: {doubt}"));
    }
    let mut notes: Vec<String> = doubt.into_iter().collect();
    let doubts = vec![notes.first().cloned(); outcome.rows.len()];
    if let Some(moved) = tally.moved() {
        steps.say(&format!("note: {moved}"));
        notes.push(moved);
    }
    let plan = (&job.plan, tally.described);
    let gates = gate_results(&job.gates, plan, &outcome.rows, &[], &doubts, &[])?;
    let mut options = job.options;
    if let Some(inversion) = &job.inversion {
        options.insert("inverter_sha256".into(), inversion.sha256().into());
    }
    let provenance = Provenance {
        notes,
        input,
        options: document::options(&job.plan, options),
        gates,
        command: job.command,
        started: job.started,
    };
    let Outcome { rows, break_even, seconds, .. } = &outcome;
    let found = Found { rows, not_audited: &[], break_even, seconds };
    let mut document = document::document(&job.plan, &found, provenance);
    document.images = figures;
    let drawn = RenderOptions {
        error_cdf: curves_of(curves, rows),
        pictures,
        inversions,
        ..RenderOptions::default()
    };
    Ok((Some(Audited { document, scene: None, drawn }), used))
}

fn input(job: &ImagesJob<'_>, tally: &Tally, outcome: &Outcome) -> Result<Input, Error> {
    let (mut path, names) = (Some(job.path.display().to_string()), job.source.names());
    let sha256 = match job.source {
        FeatureSource::InMemory(_) => {
            path = None;
            let hashes = tally.used.iter().zip(&tally.hashes);
            hash_list(hashes.map(|(&at, hash)| (names[at].clone(), hash.clone())).collect())
        }
        FeatureSource::File(_) => hash_file(job.path)?,
        FeatureSource::Folder(folder) => {
            let photos: Vec<&Path> = tally.used.iter().map(|&at| folder.path(at)).collect();
            hash_files(&photos)?
        }
    };
    Ok(Input {
        path,
        sha256: Some(sha256),
        n_points: tally.n_points as u64,
        scale_m_per_unit: None,
        unit_in_map_units: None,
        extent_m: None,
        other_sha256: Default::default(),
        images: Some(ImageCounts {
            found: (names.len() + job.source.refused().len()) as u64,
            used: tally.used.len() as u64,
            unusable: tally.unusable as u64,
            too_small: outcome.n_too_small as u64,
        }),
    })
}

const PREVIEW: u32 = 640;
/// The inlier ratio by which images are compared; the nearest tested one is used.
const USUAL_RATIO: f64 = 0.5;

/// Audits the drawn images again, with the first solver and seed. The seed of an image depends on
/// its name, so the result is that of the audit, and no picture is kept in between.
fn drawn(
    job: &ImagesJob<'_>,
    tally: &Tally,
    figures: &[ImageFigures],
) -> Result<(Vec<Picture>, Vec<Inverted>), Error> {
    let chosen = if job.draws { telling(&job.plan, figures) } else { Vec::new() };
    if chosen.is_empty() {
        return Ok((Vec::new(), Vec::new()));
    }
    let numbers: Vec<usize> = chosen.iter().map(|(at, _)| tally.used[*at]).collect();
    let mut plan = job.plan.clone();
    plan.solvers.truncate(1);
    plan.repeats = 1;
    let needs = Needs::of_plan(&plan);
    // The album makes the pictures itself.
    plan.measures.clear();
    let mut album = Album::new(job.inversion.clone(), job.progress);
    let again = RefCell::new(Tally::default());
    let images = Stream::new((job.source, job.path), &numbers, needs, &again, job.progress);
    run_many(images, &plan, &mut album)?;
    for picture in &mut album.pictures {
        let at = numbers.iter().position(|&at| job.source.names()[at] == picture.name);
        let Some(at) = at else { continue };
        picture.note = chosen[at].1.to_owned();
        let photo = match (job.source, &job.photos) {
            (FeatureSource::Folder(folder), _) => folder.path(numbers[at]).to_owned(),
            (_, Some(photos)) => photos.join(&picture.name),
            (_, None) => continue,
        };
        match unlift_vision::features::photo::jpeg(&photo, PREVIEW, job.source.turn()) {
            Ok(jpeg) => picture.photo = Some(jpeg),
            Err(error) => job.progress.say(&format!("note: {error}")),
        }
    }
    Ok((album.pictures, album.inversions))
}

/// Returns the indices in `figures` of the images with the lowest, the median and the highest
/// share, by the mean over schemes within the headline threshold; fewer if there are fewer.
fn telling(plan: &Plan<2>, figures: &[ImageFigures]) -> Vec<(usize, &'static str)> {
    let label = &plan.thresholds[plan.headline].label;
    let away = |ratio: &f64| (ratio - USUAL_RATIO).abs();
    let per_scheme = plan.rows_per_scheme();
    let variants = plan.variants();
    // The first solver's row of the variant nearest to the usual ratio; other sources have no
    // requested ratio.
    let at = (0..variants.len())
        .min_by(|&a, &b| {
            let of = |at: usize| variants[at].inlier_ratio.as_ref().map_or(f64::INFINITY, away);
            of(a).total_cmp(&of(b))
        })
        .unwrap_or(0);
    let score = |image: &ImageFigures| -> Option<f64> {
        let enough = image.n_points as usize > plan.k;
        let rows = image.rows.iter().skip(at * plan.solvers.len()).step_by(per_scheme);
        let shares = rows.map(|row| row.recovered_percent.get(label).copied().unwrap_or(0.0));
        (enough && !image.rows.is_empty()).then(|| shares.sum())
    };
    let mut scored: Vec<(f64, usize)> =
        figures.iter().enumerate().filter_map(|(at, image)| Some((score(image)?, at))).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let n = scored.len();
    let at = |place: usize| scored[place].1;
    match n {
        0 => Vec::new(),
        1 => vec![(at(0), "")],
        2 => vec![(at(1), "most recovered"), (at(0), "least recovered")],
        _ => vec![(at(n / 2), "median"), (at(n - 1), "most recovered"), (at(0), "least recovered")],
    }
}
