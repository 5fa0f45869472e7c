use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, Value};
use unlift::audit::Plan;

use super::FeatureSource;
use crate::Progress;
use crate::gate::Gate;
use crate::inversion::Inversion;

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
    /// Numbers of the images to draw; with `None` the audit chooses.
    pub show: Option<Vec<usize>>,
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
