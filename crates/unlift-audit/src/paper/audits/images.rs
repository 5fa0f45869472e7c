use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde_json::json;
use unlift::audit::{Measure, NeighborsBy, Plan};
use unlift::{Descriptors, Unit};
use unlift_vision::features::Extraction;

use super::run::{Run, of_scene};
use crate::images::audit::{ImagesJob, perform};
use crate::images::{FeatureSource, choice};
use crate::inversion::Inversion;
use crate::paper::compared::OfScene;
use crate::paper::layouts::Scene;
use crate::paper::request::Part;
use crate::{Error, Progress, Shown, open_audit, sources};

/// Sources that estimate neighbors, each in its own rows; the stronger one counts.
const SOURCES: [&str; 2] = ["descriptors", "learned"];

impl Run<'_> {
    /// Audits the requested number of photos; `None` if no number with these features is wanted.
    pub(super) fn images(
        &mut self,
        scene: &Scene,
        (features, extraction): (&'static str, &Extraction),
        progress: &dyn Progress,
    ) -> Result<Option<(OfScene, PathBuf)>, Error> {
        let (request, started, name) = (self.request, Instant::now(), &scene.name);
        let source = FeatureSource::open(&scene.photos, extraction)?;
        let chosen = choice::evenly(scene.test.len(), Some(request.images));
        let number = |at: usize| source.names().binary_search(&scene.test[at]).ok();
        let chosen: Vec<usize> = chosen.into_iter().filter_map(number).collect();
        let usable = chosen.iter().filter_map(|&at| source.get(at).ok());
        let Some(first) = usable.into_iter().find(|image| !image.keypoints.is_empty()) else {
            let expected = format!("a photo of the test split of {name} with keypoints");
            return Err(unlift_io::Error::new(&scene.photos, "", expected, "none").into());
        };
        // The paper measures in pixels of its downsized photos, unlift in pixels of the original
        // photo.
        let longest = first.size.map_or(0, |[width, height]| width.max(height));
        let side = request.dataset.shrunk_to().filter(|&side| side < longest);
        let factor = side.map_or(1.0, |side| f64::from(longest) / f64::from(side));
        let (schemes, thresholds) = self.asked(2, features, factor);
        let neighbors = self.neighbors(features, first.descriptors.as_ref(), progress)?;
        if neighbors.is_empty() {
            return Ok(None);
        }
        let painter = request.wants(Part::Pictures).then(|| self.painter(extraction.kind()));
        let inversion = painter.flatten();
        let inversion = inversion
            .map(|painter| Arc::new(Inversion::new(painter, &scene.photos, source.turn())));
        let mut plan = Plan { neighbors, seed: request.seed, ..Plan::new(Unit::Pixel) };
        plan.schemes.retain(|scheme| schemes.contains(&scheme.name()));
        plan.thresholds = thresholds.iter().map(|(_, threshold)| threshold.clone()).collect();
        // The second largest threshold of the paper, 10 pixels, is the headline.
        plan.headline = plan.thresholds.len().saturating_sub(2);
        plan.measures.extend(inversion.iter().map(|one| Arc::clone(one) as Arc<dyn Measure<2>>));
        let of_features = if features == "sift" { String::new() } else { format!("-{features}") };
        let folder = request.out.join(name).join(format!("images{of_features}"));
        let out = open_audit(&folder, request.rules(), Shown::Points, progress)?;
        let mut options = self.options();
        options.insert("features".into(), json!(features));
        options.insert("max_images".into(), json!(request.images));
        let job = ImagesJob {
            source: &source,
            path: &scene.photos,
            chosen,
            plan,
            options,
            gates: Vec::new(),
            show: None,
            photos: None,
            out: folder,
            share_safe: false,
            inversion,
            progress,
            command: request.command.clone(),
            started,
        };
        let (finished, used) = perform(job, out)?;
        if used.unusable > 0 {
            let (n, of) = (used.unusable, used.used + used.unusable);
            self.failed.push(format!("{name}: {n} of {of} photos cannot be used"));
        }
        Ok(finished.map(|finished| of_scene(scene, (2, features), thresholds, finished)))
    }

    /// Returns the oracle, and the sources that accept these descriptors, as far as they are
    /// wanted.
    fn neighbors(
        &self,
        features: &str,
        descriptors: Option<&Descriptors>,
        progress: &dyn Progress,
    ) -> Result<Vec<NeighborsBy<2>>, Error> {
        let of_features = self.numbers.iter().filter(|n| (n.dim, n.features) == (2, features));
        let is_estimated = |part: &Part| *part == Part::Estimated;
        let mut parts = of_features.map(Part::of);
        let (mut by_oracle, mut estimated) = (false, false);
        parts.by_ref().for_each(|parts| match parts.iter().any(is_estimated) {
            true => estimated = true,
            false => by_oracle = true,
        });
        let mut neighbors = Vec::new();
        if by_oracle {
            neighbors.push(NeighborsBy::Oracle);
        }
        for name in SOURCES.into_iter().filter(|_| estimated) {
            let source = sources::named(name)?.of_dimension::<2>()?;
            match descriptors.map(|descriptors| source.takes(descriptors)) {
                Some(Ok(())) => neighbors.push(NeighborsBy::Source(source)),
                Some(Err(error)) => progress.say(&format!("note: without {name}: {error}")),
                None => {}
            }
        }
        Ok(neighbors)
    }
}
