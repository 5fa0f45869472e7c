//! What an audit of images needs.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, Value};
use unlift::audit::Plan;

use super::FeatureSource;
use crate::gate::Gate;
use crate::inversion::Inversion;
use crate::progress::Progress;

/// Everything an audit of images needs.
pub struct ImagesJob<'a> {
    /// Where images are.
    pub source: &'a FeatureSource,
    /// The same as the user named it; of images in memory what errors call them.
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
