//! Audits of images, from a source of features to results, and to the files of the output folder.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use unlift::audit::{self, Outcome, Plan, Row, run_many};
use unlift_io::atomic::OutputSet;
use unlift_io::hash::{hash_file, hash_files, hash_list};
use unlift_io::seen::Seen;
use unlift_report::RenderOptions;
use unlift_report::document::{ImageCounts, ImageFigures, Input};

use super::FeatureSource;
use super::drawn::drawn;
pub use super::job::ImagesJob;
use super::stream::{Needs, Stream, Tally};
use crate::Error;
use crate::Progress;
use crate::curves::Curves;
use crate::document::{self, Found, Provenance};
use crate::gate::{check_gates, gate_results};
use crate::maps::curves_of;
use crate::outputs::{Audited, Finished};

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
///
/// # Errors
/// See [`find`]; also if the folder cannot be written.
pub fn perform(job: ImagesJob<'_>, out: OutputSet) -> Result<(Option<Finished>, Used), Error> {
    let (folder, share_safe) = (job.out.clone(), job.share_safe);
    let (found, used) = find(job)?;
    let write = |found: Audited| found.write(out, &folder, share_safe);
    Ok((found.map(write).transpose()?, used))
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
    let mut watcher = Watcher::new(&job, &tally);
    let steps = job.progress;
    for error in job.source.refused() {
        tally.borrow_mut().unusable += 1;
        steps.say(&error.to_string());
    }
    let of = (job.source, job.path);
    let beside = beside(&job);
    let needs = Needs::of_plan(&job.plan);
    let images = Stream::new(of, &job.chosen, needs, &tally, steps);
    let outcome = run_many(images, &job.plan, &mut watcher)?;
    for error in job.inversion.iter().flat_map(|inversion| inversion.failed()) {
        steps.say(&format!("note: not painted: {error}"));
    }
    let Watcher { figures, curves, .. } = watcher;
    let curves = curves.shares();
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
    // Photos are read several times: for figures, for pictures and for their hash.
    let changed = job.source.changed(&tally.used).or_else(|| beside.changed(0..beside.len()));
    if let Some(path) = changed {
        steps.say(&format!("note: {}: {CHANGED}", path.display()));
    }
    let changed = changed.map(|_| format!("input: {CHANGED}"));
    let mut notes: Vec<String> = doubt.into_iter().chain(changed).collect();
    let doubts = vec![notes.first().cloned(); outcome.rows.len()];
    if let Some(moved) = tally.moved() {
        steps.say(&format!("note: {moved}"));
        notes.push(moved);
    }
    let gates = gate_results(&job.gates, &job.plan, &outcome.rows, &[], &doubts, &[])?;
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

/// The doubt if a file of an image has changed.
const CHANGED: &str =
    "changed since reading began: figures, hash and pictures may be of different files";

/// Returns the photos of the images if the source is a file.
fn beside(job: &ImagesJob<'_>) -> Seen {
    let names = job.source.names();
    let of_folder = |folder: &Path| -> Vec<PathBuf> {
        let paths = job.chosen.iter().map(|&at| folder.join(&names[at]));
        // Missing photos are reported as not painted.
        paths.filter(|path| path.is_file()).collect()
    };
    Seen::new(job.photos.as_deref().map(of_folder).unwrap_or_default())
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
        other_sha256: Default::default(),
        images: Some(ImageCounts {
            found: (names.len() + job.source.refused().len()) as u64,
            used: tally.used.len() as u64,
            unusable: tally.unusable as u64,
            too_small: outcome.n_too_small as u64,
        }),
    })
}

/// Reports progress and keeps the figures of every image.
struct Watcher<'a> {
    progress: &'a dyn Progress,
    tally: &'a RefCell<Tally>,
    plan: &'a Plan<2>,
    figures: Vec<ImageFigures>,
    most: f64,
    curves: Curves<'a>,
}

impl<'a> Watcher<'a> {
    fn new(job: &'a ImagesJob<'_>, tally: &'a RefCell<Tally>) -> Self {
        let most = job.plan.thresholds.iter().map(|t| t.value).fold(0.0, f64::max);
        let progress = job.progress;
        progress.show(0, job.chosen.len(), "reading images");
        Self {
            progress,
            tally,
            plan: &job.plan,
            figures: Vec::new(),
            most,
            curves: Curves::new(most, progress),
        }
    }
}

impl<'a> audit::Watcher<2> for Watcher<'a> {
    type OfItem = Curves<'a>;

    fn begin(&mut self) -> Curves<'a> {
        Curves::new(self.most, self.progress)
    }

    fn progress(&mut self, _: usize, _: usize, what: &str) {
        // Each image reports its own share.
        self.progress.add(0.0, what);
    }

    fn item(&mut self, name: &str, rows: &[Row], seen: Curves<'a>) {
        self.curves.merge(seen);
        let n = self.tally.borrow_mut().take();
        self.figures.push(document::image(name, n, rows, &self.plan.thresholds));
    }
}
