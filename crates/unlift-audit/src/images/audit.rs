//! Images: attacked one after the other, and some of them drawn.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use unlift::audit::{Outcome, Plan, run_many};
use unlift_io::hash::hash_list;
use unlift_report::RenderOptions;
use unlift_report::document::{ImageCounts, ImageFigures, Input};
use unlift_report::inversions::Inversion as Inverted;
use unlift_report::pictures::Picture;

use super::Opened;
use super::pictures::Album;
use super::stream::{Needs, Stream, Tally};
use crate::audit::{Attacked, Audit};
use crate::curves::{OfItems, curves_of};
use crate::gate::Tried;
use crate::inversion::Inversion;
use crate::{Error, Progress, document};

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
    pub(crate) fn attack(
        &self,
        audit: &Audit<'_>,
        progress: &dyn Progress,
    ) -> Result<Attacked, Error> {
        let (plan, Opened { source, path, chosen, .. }) = (&self.plan, self.opened);
        source.passed_over.iter().for_each(|note| progress.say(&format!("note: {note}")));
        audit.begin(&Tried::by(plan, false), None, [], progress)?;
        let tally = RefCell::new(Tally::default());
        let mut images = Vec::new();
        let mut watcher = OfItems::new(plan, progress, |name, rows| {
            let n = tally.borrow_mut().take();
            images.push(document::image(name, n, rows));
        });
        progress.show(0, chosen.len(), "reading images");
        source.refused.iter().for_each(|line| progress.say(line));
        tally.borrow_mut().unusable += source.refused.len();
        let needs = Needs::of_plan(plan);
        let stream = Stream::new((source, path), chosen, needs, &tally, progress);
        let outcome = run_many(stream, plan, &mut watcher)?;
        for error in self.inversion.iter().flat_map(|inversion| inversion.failed()) {
            progress.say(&format!("note: not painted: {error}"));
        }
        let curves = watcher.curves.shares();
        let tally = tally.into_inner();
        if tally.used.is_empty() {
            let expected = format!("{} images that can be used", tally.unusable);
            return Err(unlift_io::Error::new(path, "", expected, "0").into());
        }
        let (pictures, inversions) = match audit.output.share_safe {
            true => Default::default(),
            false => self.drawn(&tally, &images, progress)?,
        };
        let about = self.about(&tally, &outcome)?;
        let doubt = tally.doubt();
        let notes: Vec<String> = doubt.iter().cloned().chain(tally.moved()).collect();
        notes.iter().for_each(|note| progress.say(&format!("note: {note}")));
        let mut options = audit.options.clone();
        if let Some(inversion) = &self.inversion {
            options.insert("inverter_sha256".into(), inversion.sha256().into());
        }
        let error_cdf = curves_of(curves, &outcome.rows);
        Ok(Attacked {
            tried: Tried::by(plan, tally.described),
            about: Some(about),
            options: document::options(plan, options),
            notes,
            doubts: vec![doubt; outcome.rows.len()],
            images,
            drawn: RenderOptions { error_cdf, pictures, inversions, ..RenderOptions::default() },
            rows: outcome.rows,
            break_even: outcome.break_even,
            seconds: outcome.seconds,
            ..Attacked::default()
        })
    }

    fn about(&self, tally: &Tally, outcome: &Outcome) -> Result<Input, Error> {
        let Opened { source, path, .. } = self.opened;
        let (path, sha256) = match source.is_in_memory() {
            true => {
                let hashes = tally.used.iter().zip(&tally.hashes);
                let named = hashes.map(|(&at, hash)| (source.names[at].clone(), hash.clone()));
                (None, hash_list(named.collect()))
            }
            false => (Some(path.display().to_string()), source.hash(path, &tally.used)?),
        };
        Ok(Input {
            path,
            sha256: Some(sha256),
            n_points: tally.n_points as u64,
            images: Some(ImageCounts {
                found: (source.names.len() + source.refused.len()) as u64,
                used: tally.used.len() as u64,
                unusable: tally.unusable as u64,
                too_small: outcome.n_too_small as u64,
            }),
            ..Input::default()
        })
    }

    /// Audits the drawn images again, with the first solver and seed. The seed of an image depends on
    /// its name, so the result is that of the audit, and no picture is kept in between.
    fn drawn(
        &self,
        tally: &Tally,
        figures: &[ImageFigures],
        progress: &dyn Progress,
    ) -> Result<(Vec<Picture>, Vec<Inverted>), Error> {
        let Opened { source, path, .. } = self.opened;
        let chosen = if self.draws { telling(&self.plan, figures) } else { Vec::new() };
        if chosen.is_empty() {
            return Ok((Vec::new(), Vec::new()));
        }
        let numbers: Vec<usize> = chosen.iter().map(|(at, _)| tally.used[*at]).collect();
        let mut plan = self.plan.clone();
        plan.solvers.truncate(1);
        plan.repeats = 1;
        let needs = Needs::of_plan(&plan);
        // The album makes the pictures itself.
        plan.measures.clear();
        let mut album = Album::new(self.inversion.clone(), progress);
        let again = RefCell::new(Tally::default());
        let images = Stream::new((source, path), &numbers, needs, &again, progress);
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
                Err(error) => progress.say(&format!("note: {error}")),
            }
        }
        Ok((album.pictures, album.inversions))
    }
}

const PREVIEW: u32 = 640;
/// The inlier ratio by which images are compared; the nearest tested one is used.
const USUAL_RATIO: f64 = 0.5;

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
