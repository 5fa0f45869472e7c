//! What is to be reproduced.

use std::path::Path;

use unlift_io::atomic::Rules;
use unlift_report::printed::{Measured, Points, Printed, printed};

use super::layouts::Dataset;
use crate::Progress;

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
    pub(super) fn wants(&self, part: Part) -> bool {
        self.parts.contains(&part)
    }

    /// The numbers of the paper that are wanted.
    pub(super) fn numbers(&self) -> Vec<Printed> {
        let mut numbers = printed(self.dataset.published());
        numbers.retain(|number| Part::of(number).iter().all(|&part| self.wants(part)));
        numbers
    }

    /// What must not be written over.
    pub(super) fn rules(&self) -> Rules {
        Rules::new([self.root].into_iter().chain(self.models), self.force)
    }
}
