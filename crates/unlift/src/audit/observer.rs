//! Interfaces for progress, rows and additional measures of an audit.

use std::fmt::Debug;

use super::row::Row;
use crate::evaluate::Accuracy;
use crate::neighbors::Neighborhoods;
use crate::recover::Recovered;
use crate::released::Released;
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error};

/// All data of one row of one repeat, for observers and measures.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Cell<'a, const D: usize = 3> {
    /// Name of the image or tile, if the audit has several.
    pub name: Option<&'a str>,
    /// The row of this repeat.
    pub row: &'a Row,
    /// Number of the repeat, from 0.
    pub repeat: u32,
    /// Ground truth.
    pub original: &'a Original<D>,
    /// Descriptors of the originals, one row each, if present.
    pub descriptors: Option<&'a Descriptors>,
    /// Secret of this obfuscation, with slots in the order of `recovered`.
    pub secret: &'a Secret,
    /// Released map.
    pub released: &'a Released<D>,
    /// Lists used for recovery, one per slot, in the order that they state.
    pub lists: &'a Neighborhoods,
    /// Recovered points.
    pub recovered: &'a Recovered<D>,
    /// Error of each slot.
    pub accuracy: &'a Accuracy,
}

/// Receives progress and rows of an audit, and can stop it.
pub trait Observer<const D: usize = 3> {
    /// Called when `done` of `total` cells are finished; `what` comes next.
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// Returns false to stop the audit. Called between cells.
    fn goes_on(&self) -> bool {
        true
    }

    /// Called for each finished cell.
    fn cell(&mut self, cell: &Cell<'_, D>) {
        let _ = cell;
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl<const D: usize> Observer<D> for Silent {}

/// A custom figure of every row, besides errors.
pub trait Measure<const D: usize>: Debug + Send + Sync {
    /// Returns true if the figures describe an image as a whole. In a mean over images, every image that
    /// has such a figure counts once; otherwise every point does.
    fn is_of_images(&self) -> bool {
        false
    }

    /// Returns figures by name.
    ///
    /// The names must be the same for every cell. A figure that is missing in some repeats is
    /// omitted, and so is one that counts points and is missing in some images.
    ///
    /// # Errors
    /// When the figures cannot be computed.
    fn measure(&self, cell: &Cell<'_, D>) -> Result<Vec<(String, f64)>, Error>;
}
