//! The paper's tables on its own datasets: ours beside the published numbers.
//!
//! ```text
//! Dataset::open ──> Scene .. ──> audits (maps, images) ──> Compared .. ──> sheets, paper.json, paper.csv
//! ```
//!
//! Nothing is measured here: every scene goes through [`crate::maps`] and [`crate::images::audit`] as any other map or
//! folder of photos would, and what is compared are the rows of their documents.

mod audits;
mod compared;
mod layouts;
mod missing;
mod result;
mod scale;

use std::path::Path;

use unlift_io::atomic::{Access, Kind, OutputSet, Rules};
use unlift_report::printed::{Measured, Points, Printed, printed};

pub use compared::Compared;
pub use layouts::{Dataset, Poses, Scene};
pub use result::{FIGURES, Reproduction, Sheet, TABLE};

use crate::{Error, Progress, refused};

/// What of the tables is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Points of maps, by an oracle.
    Maps,
    /// Keypoints of images, by an oracle.
    Images,
    /// Keypoints of images, by neighbors that are estimated from descriptors.
    Estimated,
    /// Pictures of either, and how alike they are to the photos.
    Pictures,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Maps, Self::Images, Self::Estimated, Self::Pictures];

    /// The name that users type.
    pub fn name(self) -> &'static str {
        match self {
            Self::Maps => "maps",
            Self::Images => "images",
            Self::Estimated => "estimated",
            Self::Pictures => "pictures",
        }
    }

    /// The parts that a number takes: it is there when all of them are wanted.
    fn of(number: &Printed) -> Vec<Self> {
        let is_picture = !matches!(number.measured, Measured::Within(_));
        let points = match number.points {
            Points::Estimated => Some(Self::Estimated),
            _ if is_picture => None,
            _ => Some(if number.dim == 3 { Self::Maps } else { Self::Images }),
        };
        is_picture.then_some(Self::Pictures).into_iter().chain(points).collect()
    }
}

/// What is to be reproduced.
pub struct Request<'a> {
    /// Which dataset.
    pub dataset: Dataset,
    /// The folder of its scenes.
    pub root: &'a Path,
    /// A folder with a map per scene, in place of those that lie in the dataset.
    pub models: Option<&'a Path>,
    /// Meters per unit of all maps, in place of what the dataset's poses say.
    pub scale: Option<f64>,
    /// Scenes by name; all without one.
    pub scenes: Vec<String>,
    /// What of the tables.
    pub parts: Vec<Part>,
    /// Photos of the test split per scene at most, evenly spaced over their names.
    pub images: usize,
    /// Points per map at most, a random subset; all without a number.
    pub max_points: Option<usize>,
    /// The integer that all randomness comes from.
    pub seed: u64,
    /// Folder to write; the audit of a scene has a folder of its own in it.
    pub out: &'a Path,
    /// Replace files of others.
    pub force: bool,
    /// The command line, for the record.
    pub command: Option<String>,
    /// Makes what hears how the next audit goes.
    pub begin: &'a (dyn Fn() -> Box<dyn Progress> + Sync),
}

impl Request<'_> {
    fn wants(&self, part: Part) -> bool {
        self.parts.contains(&part)
    }

    /// The numbers of the paper that are wanted.
    fn numbers(&self) -> Vec<Printed> {
        let mut numbers = printed(self.dataset.published());
        numbers.retain(|number| Part::of(number).iter().all(|&part| self.wants(part)));
        numbers
    }

    /// What must not be written over.
    fn rules(&self) -> Rules {
        Rules::new([self.root].into_iter().chain(self.models), self.force)
    }
}

/// Audits every scene that is there and holds what comes back against the paper's tables. Scenes that cannot be audited are
/// told and counted; the others go on. Without a single audit nothing is written.
///
/// # Errors
/// When there is no scene, a list of the dataset is malformed, the folder cannot be written, or `begin`'s progress says
/// stop.
pub fn reproduce(request: &Request<'_>) -> Result<Reproduction, Error> {
    let mut scenes = request.dataset.open(request.root, request.models)?;
    chosen(request, &mut scenes)?;
    let first = [(FIGURES, Kind::AuditJson), (TABLE, Kind::Table)];
    let out = OutputSet::create(request.out, request.rules(), Access::Usual, &first);
    let out = out.map_err(refused)?;
    let mut run = audits::Run::new(request);
    for scene in &scenes {
        run.audit(scene)?;
    }
    let result = Reproduction::new(request, &scenes, run);
    if !result.pages.is_empty() {
        result.write(out)?;
    }
    Ok(result)
}

/// Keeps the scenes that were asked for.
fn chosen(request: &Request<'_>, scenes: &mut Vec<Scene>) -> Result<(), Error> {
    for name in &request.scenes {
        let known = request.dataset.scenes();
        if !known.contains(&name.as_str()) {
            let known = known.join(", ");
            return Err(Error::request(format!(
                "--scenes: expected some of {known}, found {name}"
            )));
        }
        if !scenes.iter().any(|scene| scene.name == *name) {
            let there: Vec<&str> = scenes.iter().map(|scene| scene.name.as_str()).collect();
            let (root, there) = (request.root, there.join(", "));
            return Err(unlift_io::Error::new(root, "", format!("a folder {name}"), there).into());
        }
    }
    if !request.scenes.is_empty() {
        scenes.retain(|scene| request.scenes.contains(&scene.name));
    }
    Ok(())
}
