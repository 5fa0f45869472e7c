//! One audit of any input: its plan, its attack, its document and its files.

mod again;
mod album;
mod images;
mod items;
mod map;
mod output;
mod sequence;
mod tiles;

pub use again::{Again, Maps};
pub use images::Images;
pub use map::{Hidden, Map};
pub use output::{Audit, Audited, FIGURES, Files, Finished, Output, PAGE, check_file, refused};
pub use sequence::Sequence;
pub use tiles::Tiles;

use crate::{Error, Progress};

/// The input of an audit.
// There is one per audit, so its size costs nothing.
#[allow(clippy::large_enum_variant)]
pub enum Input<'a> {
    /// A map, which is hidden under each scheme.
    Map(Map<'a>),
    /// A map in tiles: each is hidden and attacked as a map of its own.
    Tiles(Map<'a>, Tiles),
    /// A map that a program of the user hid.
    Released(Map<'a>, Hidden<'a>),
    /// Images, whose keypoints are hidden.
    Images(Images<'a>),
    /// Images with known poses, each hidden under its own key.
    Sequence(Sequence<'a>),
    /// A map that is released twice.
    Again(Again<'a>),
}

impl Audit {
    /// Runs the audit of `input` and writes nothing.
    ///
    /// # Errors
    /// If the input or a file of it cannot be used, the plan does not fit it, a gate has no row, no image can be used, or `progress`
    /// stops the audit. Images of files that cannot be used are reported and counted, if there are others.
    pub fn run(&self, input: &Input<'_>, progress: &dyn Progress) -> Result<Audited, Error> {
        match input {
            Input::Map(map) => map.attack(None, None, self, progress),
            Input::Tiles(map, tiles) => map.attack(Some(*tiles), None, self, progress),
            Input::Released(map, hidden) => map.attack(None, Some(hidden), self, progress),
            Input::Images(images) => images.attack(self, progress),
            Input::Sequence(sequence) => sequence.attack(self, progress),
            Input::Again(again) => again.attack(self, progress),
        }
    }
}
