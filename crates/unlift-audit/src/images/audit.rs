//! One audit of images from a source of features to the files in its folder.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, Value};
use unlift::audit::{self, Cell, NeighborsBy, Observer, Outcome, Plan, Row, run_images};
use unlift::neighbors::{ByDescriptors, Overlap, Similarity, Source};
use unlift_io::atomic::OutputSet;
use unlift_io::hash::{hash_file, hash_files};
use unlift_nn::DescriptorKind;
use unlift_report::document::{ImageCounts, ImageFigures, Input};
use unlift_report::{RenderOptions, render};

use super::FeatureSource;
use super::pictures::Album;
use super::stream::{Needs, Stream, Tally, lacking};
use crate::Error;
use crate::document::{self, Found, Provenance};
use crate::gate::{Gate, check_gates, gate_results};
use crate::inversion::Inversion;
use crate::maps::{Finished, curve_errors, curves_of};
use crate::outputs::{PAGE, commit_audit};
use crate::progress::Progress;

/// Longest side of an embedded photo in pixels.
const PREVIEW: u32 = 640;
/// The inlier ratio by which images are compared, or the nearest one tested.
const USUAL_RATIO: f64 = 0.5;

/// Everything an audit of images needs.
pub struct ImagesJob<'a> {
    /// Where images are.
    pub source: &'a FeatureSource,
    /// The same as the user named it.
    pub path: &'a Path,
    /// Numbers of the images to be used, rising.
    pub chosen: Vec<usize>,
    /// What is to be done.
    pub plan: Plan<2>,
    /// Options for the record, beside those in the plan.
    pub options: Map<String, Value>,
    /// Bounds to hold.
    pub gates: Vec<Gate>,
    /// Numbers of the images to draw; `None` chooses.
    pub show: Option<Vec<usize>>,
    /// Folder of photos, where the source is a file.
    pub photos: Option<PathBuf>,
    /// Folder to write.
    pub out: PathBuf,
    /// Figures only.
    pub share_safe: bool,
    /// Makes pictures of what comes back; the plan measures with it, too.
    pub inversion: Option<Arc<Inversion>>,
    /// Hears how it goes.
    pub progress: &'a dyn Progress,
    /// The command line, for the record.
    pub command: Option<String>,
    /// When the command began.
    pub started: Instant,
}

/// What became of the images.
#[derive(Clone, Copy, Debug)]
pub struct Used {
    /// Images that were used.
    pub used: usize,
    /// Images that were not, as they could not be read.
    pub unusable: usize,
}

/// Runs the job and writes its folder, whole or not at all; without a single usable image none.
pub fn perform(job: ImagesJob<'_>, out: OutputSet) -> Result<(Option<Finished>, Used), Error> {
    check_gates(&job.gates, &job.plan)?;
    let tally = RefCell::new(Tally::default());
    let mut watcher = Watcher::new(&job, &tally);
    let steps = job.progress;
    for error in job.source.refused() {
        tally.borrow_mut().unusable += 1;
        steps.say(&error.to_string());
    }
    let of = (job.source, job.path);
    let needs = Needs::of_plan(&job.plan);
    let images = Stream::new(of, &job.chosen, needs, &tally, steps);
    let outcome = run_images(images, &job.plan, &mut watcher)?;
    for error in job.inversion.iter().flat_map(|inversion| inversion.failed()) {
        steps.say(&format!("note: not painted: {error}"));
    }
    let Watcher { figures, errors, curves, .. } = watcher;
    let tally = tally.into_inner();
    let used = Used { used: tally.used.len(), unusable: tally.unusable };
    if used.used == 0 {
        return Ok((None, used));
    }
    let Album { pictures, inversions, .. } = match job.share_safe {
        true => Album::default(),
        false => draw(&job, &tally, &figures)?,
    };
    let doubt = tally.doubt();
    if let Some(doubt) = &doubt {
        steps.say(&format!("note: {doubt}"));
    }
    let doubts = vec![doubt.clone(); outcome.rows.len()];
    let gates = gate_results(&job.gates, &job.plan, &outcome.rows, &[], &doubts)?;
    let mut options = job.options.clone();
    if let Some(inversion) = &job.inversion {
        options.insert("inverter_sha256".into(), inversion.sha256().into());
    }
    let provenance = Provenance {
        notes: doubt.into_iter().collect(),
        input: input(&job, &tally, &outcome)?,
        options: document::options(&job.plan, options),
        gates,
        command: job.command.clone(),
        started: job.started,
    };
    let Outcome { rows, break_even, seconds, .. } = &outcome;
    let found = Found { rows, not_audited: &[], break_even, seconds };
    let mut document = document::document(&job.plan, &found, provenance);
    document.images = figures;
    let document = if job.share_safe { document.share_safe() } else { document };
    let options = RenderOptions {
        share_safe: job.share_safe,
        error_cdf: curves_of(curves.iter().map(|curve| curve.shares(&errors)).collect(), rows),
        pictures,
        inversions,
    };
    let page = render(&document, None, &options)?;
    let json = document.to_json()?;
    commit_audit(out, &page, &json, job.share_safe)?;
    Ok((Some(Finished { document, report: job.out.join(PAGE) }), used))
}

/// What was read: of photos, those that were used.
fn input(job: &ImagesJob<'_>, tally: &Tally, outcome: &Outcome) -> Result<Input, Error> {
    let sha256 = match job.source {
        FeatureSource::File(_) => hash_file(job.path)?,
        FeatureSource::Folder(folder) => {
            let photos: Vec<&Path> = tally.used.iter().map(|&at| folder.path(at)).collect();
            hash_files(&photos)?
        }
    };
    Ok(Input {
        path: Some(job.path.display().to_string()),
        sha256: Some(sha256),
        n_points: tally.n_points as u64,
        scale_m_per_unit: None,
        unit_in_map_units: None,
        other_sha256: Default::default(),
        images: Some(ImageCounts {
            found: (job.source.names().len() + job.source.refused().len()) as u64,
            used: tally.used.len() as u64,
            unusable: tally.unusable as u64,
            too_small: outcome.n_too_small as u64,
        }),
    })
}

/// Audits the images to be drawn once more, by the first solver and seed: an image's randomness comes from
/// its name, so what is drawn is what was counted, and no picture had to be kept in between. What a server
/// sees that has no oracle is drawn as well, whether or not it was asked for.
fn draw(job: &ImagesJob<'_>, tally: &Tally, figures: &[ImageFigures]) -> Result<Album, Error> {
    let wanted: Vec<(usize, &str)> = match &job.show {
        Some(show) => {
            let usable = show.iter().filter(|at| tally.used.contains(at));
            usable.map(|&at| (at, "")).collect()
        }
        None => telling(&job.plan, figures)
            .into_iter()
            .map(|(at, note)| (tally.used[at], note))
            .collect(),
    };
    let numbers: Vec<usize> = wanted.iter().map(|(at, _)| *at).collect();
    let mut plan = job.plan.clone();
    plan.solvers.truncate(1);
    (plan.repeats, plan.reference) = (1, false);
    plan.neighbors.extend(without_oracle(job, &numbers));
    let needs = Needs::of_plan(&plan);
    // The album looks for itself.
    plan.measures.clear();
    let mut album = Album::new(job.inversion.clone());
    let again = RefCell::new(Tally::default());
    let images = Stream::new((job.source, job.path), &numbers, needs, &again, job.progress);
    run_images(images, &plan, &mut album)?;
    for picture in &mut album.pictures {
        let at = numbers.iter().position(|&at| job.source.names()[at] == picture.name);
        let Some(at) = at else { continue };
        picture.note = wanted[at].1.to_owned();
        let photo = match (job.source, &job.photos) {
            (FeatureSource::Folder(folder), _) => folder.path(numbers[at]).to_owned(),
            (FeatureSource::File(_), Some(photos)) => photos.join(&picture.name),
            (FeatureSource::File(_), None) => continue,
        };
        match unlift_features::preview::jpeg(&photo, PREVIEW) {
            Ok(jpeg) => picture.photo = Some(jpeg),
            Err(error) => job.progress.say(&format!("note: {error}")),
        }
    }
    Ok(album)
}

/// What needs no training and the plan lacks, where all images `numbers` have what it takes.
fn without_oracle(job: &ImagesJob<'_>, numbers: &[usize]) -> Vec<NeighborsBy<2>> {
    let untrained: [Arc<dyn Source<2>>; 2] = [Arc::new(Similarity), Arc::new(Overlap)];
    let fits = |source: &Arc<dyn Source<2>>| {
        let needs = Needs::of(source);
        let of_image = |&at: &usize| match job.source {
            // What was extracted as SIFT is what every source takes.
            FeatureSource::Folder(folder) if folder.extraction().kind() == DescriptorKind::Sift => {
                true
            }
            _ => job.source.get(at).is_ok_and(|image| lacking(&image, &needs).is_none()),
        };
        needs.descriptors() && numbers.iter().all(of_image)
    };
    let mut fitting: Vec<_> = untrained.into_iter().filter(fits).collect();
    let asked: Vec<&str> = job.plan.own_sources().map(|own| own.name()).collect();
    if asked.contains(&Source::<2>::name(&ByDescriptors)) {
        // It is the last of these under another name.
        fitting.pop();
    }
    fitting.retain(|source| !asked.contains(&source.name()));
    fitting.into_iter().map(NeighborsBy::Source).collect()
}

/// Positions in `figures` of the images of which least, about half and most came back, by the mean over
/// schemes within the headline threshold; fewer when there are fewer.
fn telling(plan: &Plan<2>, figures: &[ImageFigures]) -> Vec<(usize, &'static str)> {
    let label = &plan.thresholds[plan.headline].label;
    let away = |ratio: &f64| (ratio - USUAL_RATIO).abs();
    let per_scheme = plan.rows_per_scheme();
    let variants = plan.variants();
    // The first solver's row of the variant nearest to the usual ratio; an own source has no ratio yet.
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

/// An error curve over all images: counts, so that its size does not depend on their number.
struct Curve {
    /// The row of one image.
    cell: Row,
    within: Vec<usize>,
    n: usize,
}

impl Curve {
    fn shares(&self, errors: &[f64]) -> (Row, Vec<(f64, f64)>) {
        let percent = |count: usize| 100.0 * count as f64 / self.n.max(1) as f64;
        let points = errors.iter().zip(&self.within);
        (self.cell.clone(), points.map(|(&e, &n)| (e, percent(n))).collect())
    }
}

/// Shows progress and keeps the figures of every image.
struct Watcher<'a> {
    progress: &'a dyn Progress,
    tally: &'a RefCell<Tally>,
    plan: &'a Plan<2>,
    figures: Vec<ImageFigures>,
    /// Where curves are looked at.
    errors: Vec<f64>,
    curves: Vec<Curve>,
}

impl<'a> Watcher<'a> {
    fn new(job: &'a ImagesJob<'_>, tally: &'a RefCell<Tally>) -> Self {
        let most = job.plan.thresholds.iter().map(|t| t.value).fold(0.0, f64::max);
        let progress = job.progress;
        progress.show(0, job.chosen.len(), "");
        Self {
            progress,
            tally,
            plan: &job.plan,
            figures: Vec::new(),
            errors: curve_errors(most).collect(),
            curves: Vec::new(),
        }
    }
}

impl<'a> audit::Watcher for Watcher<'a> {
    type OfImage = Curves<'a>;

    fn begin(&mut self) -> Curves<'a> {
        let steps = self.progress;
        let (errors, curves) = (self.errors.clone(), Vec::new());
        Curves { errors, curves, steps, told: 0.0 }
    }

    fn progress(&mut self, _: usize, _: usize, what: &str) {
        // Images tell themselves how far they are.
        self.progress.add(0.0, what);
    }

    fn image(&mut self, name: &str, rows: &[Row], Curves { curves, .. }: Curves<'a>) {
        if self.curves.is_empty() {
            self.curves = curves;
        } else {
            for (to, more) in self.curves.iter_mut().zip(&curves) {
                to.n += more.n;
                to.within.iter_mut().zip(&more.within).for_each(|(to, more)| *to += more);
            }
        }
        let n = self.tally.borrow_mut().take();
        self.figures.push(document::image(name, n, rows, &self.plan.thresholds));
    }
}

/// The error curves of one image, of the first repeat.
struct Curves<'a> {
    errors: Vec<f64>,
    curves: Vec<Curve>,
    steps: &'a dyn Progress,
    /// The share of the image that was told to be finished.
    told: f64,
}

impl Observer<2> for Curves<'_> {
    fn progress(&mut self, done: usize, total: usize, _: &str) {
        let share = done as f64 / total.max(1) as f64;
        self.steps.add(share - self.told, "");
        self.told = share;
    }

    fn goes_on(&self) -> bool {
        self.steps.goes_on()
    }

    fn cell(&mut self, cell: &Cell<'_, 2>) {
        if cell.repeat > 0 {
            return;
        }
        let within = self.errors.iter().map(|&error| cell.accuracy.n_within(error)).collect();
        let n = cell.accuracy.n_points();
        self.curves.push(Curve { cell: cell.row.clone(), within, n });
    }
}
