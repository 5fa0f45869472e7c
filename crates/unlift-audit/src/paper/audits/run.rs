use std::path::PathBuf;

use serde_json::{Map, Value, json};
use unlift::audit::Threshold;
use unlift_report::printed::{Measured, Printed, printed};
use unlift_vision::features::{Extraction, Extractor, SiftOptions, SuperPointOptions};
use unlift_vision::network::DescriptorKind;
use unlift_vision::pictures::Inverter;

use crate::inversion::Painter;
use crate::paper::compared::OfScene;
use crate::paper::layouts::Scene;
use crate::paper::missing::tables_of;
use crate::paper::request::{Part, Request};
use crate::{Error, Finished, Progress};

/// The state of the audits of all scenes.
pub struct Run<'a> {
    pub(super) request: &'a Request<'a>,
    pub(super) numbers: Vec<Printed>,
    /// Kinds of features whose extractor is available.
    features: Vec<(&'static str, Extraction)>,
    /// Finished audits and the paths of their pages.
    pub done: Vec<(OfScene, PathBuf)>,
    /// Missing data, one line each.
    pub missing: Vec<String>,
    /// Failed audits, one line each.
    pub failed: Vec<String>,
}

/// A threshold of the paper, and the same threshold in the unit of an audit.
pub type Within = (f64, Threshold);

impl<'a> Run<'a> {
    /// Creates the state before the first audit.
    pub fn new(request: &'a Request<'a>) -> Self {
        let numbers = request.numbers();
        let usual = SiftOptions::default();
        let side = request.dataset.shrunk_to().map(|side| side as usize);
        let max_image_size = side.unwrap_or(usual.max_image_size);
        let all = [
            ("sift", Extraction::Sift(SiftOptions { max_image_size, ..usual })),
            ("superpoint", Extraction::SuperPoint(SuperPointOptions::default())),
        ];
        let (mut features, mut missing) = (Vec::new(), Vec::new());
        for (name, extraction) in all {
            if !numbers.iter().any(|number| (number.dim, number.features) == (2, name)) {
                continue;
            }
            match Extractor::try_new(&extraction) {
                Ok(_) => features.push((name, extraction)),
                Err(error) => {
                    missing.push(format!("{}, {name}: {error}", tables_of(request, 2, name)))
                }
            }
        }
        Self { request, numbers, features, done: Vec::new(), missing, failed: Vec::new() }
    }

    /// Audits the map and the photos of a scene, if they exist.
    ///
    /// # Errors
    /// If the progress stops the audit.
    pub fn audit(&mut self, scene: &Scene) -> Result<(), Error> {
        let wants = |part| self.request.wants(part);
        if let (Some(map), true) = (&scene.map, wants(Part::Maps) || wants(Part::Pictures)) {
            let progress = (self.request.begin)();
            let found = self.map(scene, map, &*progress);
            self.keep(format!("{}, map", scene.name), found, &*progress)?;
        }
        let features = if scene.test.is_empty() { Vec::new() } else { self.features.clone() };
        for (name, extraction) in features {
            let progress = (self.request.begin)();
            let found = self.images(scene, (name, &extraction), &*progress);
            self.keep(format!("{}, {name} of photos", scene.name), found, &*progress)?;
        }
        Ok(())
    }

    fn keep(
        &mut self,
        what: String,
        found: Result<Option<(OfScene, PathBuf)>, Error>,
        progress: &dyn Progress,
    ) -> Result<(), Error> {
        match found {
            Ok(found) => self.done.extend(found),
            Err(error) if !progress.goes_on() => return Err(error),
            Err(error) => {
                let line = format!("{what}: {error}");
                progress.say(&line);
                self.failed.push(line);
            }
        }
        Ok(())
    }

    pub(super) fn lacks(&mut self, line: String) {
        if !self.missing.contains(&line) {
            self.missing.push(line);
        }
    }

    /// Returns a painter for descriptors of this kind; `None` if a network is missing.
    pub(super) fn painter(&mut self, kind: DescriptorKind) -> Option<Painter> {
        match Inverter::of(kind).and_then(Painter::try_new) {
            Ok(painter) => Some(painter),
            Err(error) => {
                self.lacks(format!("pictures: {error}"));
                None
            }
        }
    }

    /// Returns schemes and thresholds of the paper; thresholds are multiplied by `factor` in the
    /// audit.
    pub(super) fn asked(
        &self,
        dim: usize,
        features: &str,
        factor: f64,
    ) -> (Vec<&'static str>, Vec<Within>) {
        let all = printed(self.request.dataset.published());
        let (mut schemes, mut thresholds) = (Vec::new(), Vec::<Within>::new());
        for number in all.iter().filter(|n| (n.dim, n.features) == (dim, features)) {
            if number.scheme != "none" && !schemes.contains(&number.scheme) {
                schemes.push(number.scheme);
            }
            if let Measured::Within(within) = number.measured
                && !thresholds.iter().any(|(known, _)| *known == within)
            {
                let value = within * factor;
                let label = if dim == 3 { format!("{value:.2}") } else { value.to_string() };
                thresholds.push((within, Threshold { label, value }));
            }
        }
        thresholds.sort_by(|a, b| a.0.total_cmp(&b.0));
        (schemes, thresholds)
    }

    /// Returns options that are not in the plan.
    pub(super) fn options(&self) -> Map<String, Value> {
        let mut options = Map::new();
        options.insert("dataset".into(), json!(self.request.dataset.name()));
        options
    }
}

/// Returns a finished audit, ready to be compared.
pub fn of_scene(
    scene: &Scene,
    (dim, features): (usize, &'static str),
    thresholds: Vec<Within>,
    finished: Finished,
) -> (OfScene, PathBuf) {
    let thresholds = thresholds.into_iter().map(|(known, threshold)| (known, threshold.label));
    let (scene, thresholds) = (scene.name.clone(), thresholds.collect());
    let document = finished.document;
    (OfScene { scene, dim, features, thresholds, document }, finished.report)
}
