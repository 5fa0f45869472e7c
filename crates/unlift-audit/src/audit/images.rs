//! Images: attacked one after the other, and some of them drawn.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use unlift::audit::{Plan, Row, run_many};
use unlift_io::hash::hash_list;
use unlift_report::document::{ImageCounts, ImageFigures, ImageRow};
use unlift_report::inversions::Inversion as Sheet;
use unlift_report::pictures::Picture;
use unlift_report::{Document, RenderOptions};

use super::album::Album;
use super::items::OfItems;
use super::output::{Audit, Audited};
use crate::document::{self, Attacked, Tried};
use crate::gate::check_gates;
use crate::images::Opened;
use crate::images::stream::{Tally, stream};
use crate::inversion::Inversion;
use crate::{Error, Progress};

/// Images, and how their keypoints are attacked.
pub struct Images<'a> {
    /// The images.
    pub opened: &'a Opened,
    /// The plan of the attack.
    pub plan: Plan<2>,
    /// Whether the page shows some images.
    pub draws: bool,
    /// The folder of photos, if the source is a file.
    pub photos: Option<PathBuf>,
    /// Makes pictures of recovered keypoints; the plan measures with it, too.
    pub inversion: Option<Arc<Inversion>>,
}

impl Images<'_> {
    /// Attacks the images. A share-safe audit draws no pictures.
    pub(super) fn attack(&self, audit: &Audit, progress: &dyn Progress) -> Result<Audited, Error> {
        let (plan, Opened { source, path, chosen, .. }) = (&self.plan, self.opened);
        source.passed_over.iter().for_each(|note| progress.note(note));
        check_gates(&audit.gates, &Tried::by(plan, false), None)?;
        let tally = RefCell::new(Tally::default());
        let mut images = Vec::new();
        let each = |name: &str, rows: &[Row]| {
            images.push(figures(name, tally.borrow().sizes[images.len()], rows));
        };
        progress.show(0, chosen.len(), "reading images");
        source.refused.iter().for_each(|line| progress.say(line));
        tally.borrow_mut().unusable += source.refused.len();
        let read = stream((source, path), chosen, Some(plan), &tally, progress);
        let outcome = run_many(read, plan, &mut OfItems { steps: progress, each })?;
        for error in self.inversion.iter().flat_map(|inversion| inversion.failed()) {
            progress.note(&format!("not painted: {error}"));
        }
        let tally = tally.into_inner();
        if tally.used.is_empty() {
            let expected = format!("{} images that can be used", tally.unusable);
            return Err(unlift_io::Error::new(path, "", expected, "0").into());
        }
        let (pictures, inversions) = self.pictures(&tally, &images, audit, progress)?;
        let counts = ImageCounts {
            used: tally.used.len() as u64,
            unusable: tally.unusable as u64,
            too_small: outcome.n_too_small as u64,
            ..ImageCounts::default()
        };
        let mut about = self.opened.about(&tally.used, tally.sizes.iter().sum(), counts)?;
        if source.is_in_memory() {
            let hashes = tally.used.iter().zip(&tally.hashes);
            let named = hashes.map(|(&at, hash)| (source.names[at].clone(), hash.clone()));
            about.sha256 = Some(hash_list(named.collect()));
        }
        let doubt = tally.doubt();
        let notes: Vec<String> = doubt.iter().cloned().chain(tally.moved()).collect();
        notes.iter().for_each(|note| progress.note(note));
        let inverter = self.inversion.as_ref().map(|inversion| inversion.sha256());
        let attacked = Attacked {
            tried: Tried::by(plan, tally.described),
            doubts: vec![doubt; outcome.rows.len()],
            document: Document {
                input: about,
                options: document::options(plan, &audit.options, inverter),
                results: outcome.rows,
                break_even: outcome.break_even,
                notes,
                images,
                ..Document::default()
            },
            not_audited: outcome.not_audited,
            seconds: outcome.seconds,
            rendering: RenderOptions { pictures, inversions, ..Default::default() },
        };
        audit.finish(plan, attacked)
    }

    /// Audits a few images again, with the first solver and seed, for their pictures. The seed of an image depends on
    /// its name, so the result is that of the audit, and no picture is kept in between.
    fn pictures(
        &self,
        tally: &Tally,
        figures: &[ImageFigures],
        audit: &Audit,
        progress: &dyn Progress,
    ) -> Result<(Vec<Picture>, Vec<Sheet>), Error> {
        let Opened { source, path, .. } = self.opened;
        let draws = self.draws && !audit.output.share_safe;
        let chosen = if draws { telling(&self.plan, figures) } else { Vec::new() };
        if chosen.is_empty() {
            return Ok(Default::default());
        }
        let numbers: Vec<usize> = chosen.iter().map(|(at, _)| tally.used[*at]).collect();
        // The album makes the pictures itself.
        let mut plan = Plan { measures: Vec::new(), repeats: 1, ..self.plan.clone() };
        plan.solvers.truncate(1);
        let (inverter, pictures, inversions) = (self.inversion.clone(), Vec::new(), Vec::new());
        let mut album = Album { inverter, steps: progress, pictures, inversions };
        let again = RefCell::default();
        let images = stream((source, path), &numbers, Some(&self.plan), &again, progress);
        run_many(images, &plan, &mut album)?;
        for picture in &mut album.pictures {
            let at = numbers.iter().position(|&at| source.names[at] == picture.name);
            let Some(at) = at else { continue };
            picture.note = chosen[at].1.to_owned();
            let named = || Some(self.photos.as_ref()?.join(&picture.name));
            let photo = source.photo(numbers[at]).map(Path::to_owned).or_else(named);
            let Some(photo) = photo else { continue };
            match unlift_vision::features::photo::jpeg(&photo, PREVIEW, source.turn) {
                Ok(jpeg) => picture.photo = Some(jpeg),
                Err(error) => progress.note(&error.to_string()),
            }
        }
        Ok((album.pictures, album.inversions))
    }
}

fn figures(name: &str, n_points: usize, rows: &[Row]) -> ImageFigures {
    let row = |row: &Row| ImageRow {
        recovered_percent: row.recovered_percent.clone(),
        distinct_percent: row.distinct.clone().unwrap_or_default().recovered_percent,
        inlier_ratio: row.inlier_ratio,
        median_error: row.median_error,
    };
    let rows = rows.iter().map(row).collect();
    ImageFigures { name: Some(name.to_owned()), n_points: n_points as u64, rows }
}

const PREVIEW: u32 = 640;
/// The inlier ratio by which images are compared; the nearest tested one is used.
const USUAL_RATIO: f64 = 0.5;

/// Returns the indices in `figures` of the images with the lowest, the median and the highest
/// share, by the mean over schemes within the headline threshold; fewer if there are fewer.
fn telling(plan: &Plan<2>, figures: &[ImageFigures]) -> Vec<(usize, &'static str)> {
    let label = &plan.thresholds[plan.headline].label;
    let per_scheme = plan.rows_per_scheme();
    let variants = plan.variants();
    // The first solver's row of the variant nearest to the usual ratio; other sources have no requested ratio.
    let away = |&at: &usize| {
        variants[at].inlier_ratio.map_or(f64::INFINITY, |ratio| (ratio - USUAL_RATIO).abs())
    };
    let nearest = (0..variants.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
    let score = |image: &ImageFigures| -> Option<f64> {
        let enough = image.n_points as usize > plan.k;
        let rows = image.rows.iter().skip(nearest * plan.solvers.len()).step_by(per_scheme);
        let shares = rows.map(|row| row.recovered_percent.get(label).copied().unwrap_or(0.0));
        (enough && !image.rows.is_empty()).then(|| shares.sum())
    };
    let mut scored: Vec<(f64, usize)> =
        figures.iter().enumerate().filter_map(|(at, image)| Some((score(image)?, at))).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n = scored.len();
    let at = |place: usize| scored[place].1;
    match n {
        0 => Vec::new(),
        1 => vec![(at(0), "")],
        2 => vec![(at(1), "most recovered"), (at(0), "least recovered")],
        _ => vec![(at(n / 2), "median"), (at(n - 1), "most recovered"), (at(0), "least recovered")],
    }
}
