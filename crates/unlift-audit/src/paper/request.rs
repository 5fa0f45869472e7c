use std::path::Path;

use unlift_io::atomic::Rules;
use unlift_report::printed::{Measured, Points, Printed, printed};

use super::layouts::Dataset;
use crate::Progress;

/// A part of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Points of maps, with the oracle.
    Maps,
    /// Keypoints of images, with the oracle.
    Images,
    /// Keypoints of images, with neighbors that are estimated from descriptors.
    Estimated,
    /// Pictures of maps and images, and their similarity to the photos.
    Pictures,
}

impl Part {
    /// All parts.
    pub const ALL: [Self; 4] = [Self::Maps, Self::Images, Self::Estimated, Self::Pictures];

    /// Returns the name that users type.
    pub fn name(self) -> &'static str {
        match self {
            Self::Maps => "maps",
            Self::Images => "images",
            Self::Estimated => "estimated",
            Self::Pictures => "pictures",
        }
    }

    /// Returns the parts that a number needs: it is compared if all of them are wanted.
    pub(super) fn of(number: &Printed) -> Vec<Self> {
        let is_picture = !matches!(number.measured, Measured::Within(_));
        let points = match number.points {
            Points::Estimated => Some(Self::Estimated),
            _ if is_picture => None,
            _ => Some(if number.dim == 3 { Self::Maps } else { Self::Images }),
        };
        is_picture.then_some(Self::Pictures).into_iter().chain(points).collect()
    }
}

/// The options of a reproduction.
pub struct Request<'a> {
    /// The dataset.
    pub dataset: Dataset,
    /// The folder of its scenes.
    pub root: &'a Path,
    /// A folder with a map per scene, which replaces the maps of the dataset.
    pub models: Option<&'a Path>,
    /// Meters per unit of all maps, which replaces the scale from the dataset's poses.
    pub scale: Option<f64>,
    /// Names of the scenes; all if empty.
    pub scenes: Vec<String>,
    /// The wanted parts of the tables.
    pub parts: Vec<Part>,
    /// Maximum number of photos of the test split per scene, evenly spaced over their names.
    pub images: usize,
    /// Maximum number of points per map, a random subset; `None` for all.
    pub max_points: Option<usize>,
    /// The random seed.
    pub seed: u64,
    /// The output folder; the audit of each scene has a subfolder.
    pub out: &'a Path,
    /// Allows replacing files that unlift did not write.
    pub force: bool,
    /// The command line, for the record.
    pub command: Option<String>,
    /// Creates the receiver of the next audit's progress.
    pub begin: &'a (dyn Fn() -> Box<dyn Progress> + Sync),
}

impl Request<'_> {
    pub(super) fn wants(&self, part: Part) -> bool {
        self.parts.contains(&part)
    }

    pub(super) fn numbers(&self) -> Vec<Printed> {
        let mut numbers = printed(self.dataset.published());
        numbers.retain(|number| Part::of(number).iter().all(|&part| self.wants(part)));
        numbers
    }

    /// Returns the rules for replacing files, which protect the inputs.
    pub(super) fn rules(&self) -> Rules {
        Rules::new([self.root].into_iter().chain(self.models), self.force)
    }
}
