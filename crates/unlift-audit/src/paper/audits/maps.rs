use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::json;
use unlift::Unit;
use unlift::audit::{Measure, Plan};
use unlift_io::read;
use unlift_vision::network::DescriptorKind;

use super::run::{Run, of_scene};
use crate::inversion::MapInversion;
use crate::maps::{self, Job};
use crate::paper::compared::OfScene;
use crate::paper::layouts::Scene;
use crate::paper::missing::{tables, tables_of};
use crate::paper::request::Part;
use crate::paper::scale;
use crate::{Error, Preparation, Progress, Shown, open_audit};

const PHOTOS: usize = 12;
/// K as in the paper's runtime table; its other tables do not state it.
const K: usize = 50;

impl Run<'_> {
    /// Audits the map at `path`; `None` if its scale is unknown, or only pictures are wanted and
    /// cannot be made.
    pub(super) fn map(
        &mut self,
        scene: &Scene,
        path: &Path,
        progress: &dyn Progress,
    ) -> Result<Option<(OfScene, PathBuf)>, Error> {
        let (request, started, name) = (self.request, Instant::now(), &scene.name);
        let found = read::open(path)?;
        let images = found.model.as_deref().map(scale::images).transpose()?;
        let scale = match (request.scale, &images) {
            (Some(scale), _) => Some(scale),
            (None, Some(images)) => scale::scale(images, scene)?,
            // A single file is published with the dataset, in the frame of its poses.
            (None, None) => path.is_file().then_some(1.0),
        };
        let Some(scale) = scale else {
            let (tables, path) = (tables_of(request, 3, "sift"), path.display());
            self.lacks(format!(
                "{tables}: meters of the map of {name}: fewer than 4 images of {path} have a pose in the dataset (try \
                 --scale)"
            ));
            return Ok(None);
        };
        let wants_pictures = request.wants(Part::Pictures);
        let database = found.database.filter(|_| wants_pictures);
        if wants_pictures && database.is_none() {
            let is_picture = |number: &_| Part::of(number).contains(&Part::Pictures);
            let tables = tables(request.dataset, |n| n.dim == 3 && is_picture(n));
            self.lacks(format!(
                "{tables}: descriptors of the map of {name}: database.db of the COLMAP project, which published maps do \
                 not have"
            ));
            if !request.wants(Part::Maps) {
                return Ok(None);
            }
        }
        let preparation = Preparation {
            scale: Some(scale),
            k: K,
            max_points: request.max_points,
            seed: request.seed,
            ..Preparation::default()
        };
        let (input, prepared) = maps::open(path, database.as_deref(), &preparation)?;
        let mut inversion = None;
        if let (Some(model), Some(descriptors)) = (&input.model, &prepared.descriptors)
            && let Some(painter) = self.painter(DescriptorKind::of(descriptors, "descriptors")?)
        {
            let photos = scale::photos(images.as_ref().map_or(&[], |(_, all)| all), scene);
            let open = MapInversion::open(painter, model, photos, scale, PHOTOS, progress);
            inversion = Some(Arc::new(open?));
        }
        let usual = Plan::new(Unit::Meter).for_map(prepared.original.len(), K);
        let (schemes, thresholds) = self.asked(3, "sift", 1.0);
        let mut plan = Plan { k: K, seed: request.seed, ..usual };
        plan.schemes.retain(|scheme| schemes.contains(&scheme.name()));
        plan.thresholds = thresholds.iter().map(|(_, threshold)| threshold.clone()).collect();
        plan.measures.extend(inversion.iter().map(|one| Arc::clone(one) as Arc<dyn Measure<3>>));
        let folder = request.out.join(name).join("map");
        let out = open_audit(&folder, request.rules(), Shown::Points, progress)?;
        let mut options = self.options();
        if let Some(most) = request.max_points {
            options.insert("max_points".into(), json!(most));
        }
        let job = Job {
            plan,
            inversion,
            options,
            progress,
            command: request.command.clone(),
            ..Job::new(path, &input, &prepared, &folder, started)?
        };
        Ok(Some(of_scene(scene, (3, "sift"), thresholds, maps::perform(job, out)?)))
    }
}
