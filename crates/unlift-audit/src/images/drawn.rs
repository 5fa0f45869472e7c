//! The choice of images that a report draws, and their pictures.

use std::cell::RefCell;

use unlift::audit::{Plan, run_many};
use unlift_report::document::ImageFigures;
use unlift_report::inversions::Inversion as Inverted;
use unlift_report::pictures::Picture;

use super::FeatureSource;
use super::job::ImagesJob;
use super::pictures::Album;
use super::stream::{Needs, Stream, Tally};
use crate::Error;

const PREVIEW: u32 = 640;
/// The inlier ratio by which images are compared; the nearest tested one is used.
const USUAL_RATIO: f64 = 0.5;

/// Audits the drawn images again, with the first solver and seed. The seed of an image depends on
/// its name, so the result is that of the audit, and no picture is kept in between.
///
/// # Errors
/// If an image cannot be audited again.
pub fn drawn(
    job: &ImagesJob<'_>,
    tally: &Tally,
    figures: &[ImageFigures],
) -> Result<(Vec<Picture>, Vec<Inverted>), Error> {
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
    if wanted.is_empty() {
        return Ok((Vec::new(), Vec::new()));
    }
    let numbers: Vec<usize> = wanted.iter().map(|(at, _)| *at).collect();
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
        picture.note = wanted[at].1.to_owned();
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
