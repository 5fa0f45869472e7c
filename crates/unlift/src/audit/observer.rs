//! Who hears how an audit goes, and what they see of every row.

use std::fmt::Debug;

use super::row::Row;
use crate::evaluate::Accuracy;
use crate::neighbors::Neighborhoods;
use crate::recover::{RecoverOptions, Recovered, Solver};
use crate::released::Released;
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error};

/// Everything known about one row of one repeat, for whoever writes clouds, draws pictures or measures more.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Cell<'a, const D: usize = 3> {
    /// The name of the image, if it is one of many.
    pub name: Option<&'a str>,
    /// The row of this repeat.
    pub row: &'a Row,
    /// Which repeat, from 0.
    pub repeat: u32,
    /// The truth.
    pub original: &'a Original<D>,
    /// Descriptors of the originals, one row each, where they are at hand.
    pub descriptors: Option<&'a Descriptors>,
    /// The secret of this obfuscation, its slots counted as the rows of `recovered` are.
    pub secret: &'a Secret,
    /// What the attacker saw.
    pub released: &'a Released<D>,
    /// The lists it was recovered from: one per slot, by descriptor row for an attacker's own sources.
    pub lists: &'a Neighborhoods,
    /// What the attacker got.
    pub recovered: &'a Recovered<D>,
    /// Error per slot.
    pub accuracy: &'a Accuracy,
}

/// Everything that recovered points follow from.
#[derive(Clone, Copy, Debug)]
pub struct Recovery<'a, const D: usize = 3> {
    /// What the attacker sees.
    pub released: &'a Released<D>,
    /// Its lists.
    pub lists: &'a Neighborhoods,
    /// The solver.
    pub solver: &'a dyn Solver<D>,
    /// How it works.
    pub options: &'a RecoverOptions,
}

/// Hears how an audit goes.
pub trait Observer<const D: usize = 3> {
    /// `done` of `total` cells are finished; `what` comes next.
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// Whether the audit shall go on; asked between cells.
    fn goes_on(&self) -> bool {
        true
    }

    /// One cell is finished.
    fn cell(&mut self, cell: &Cell<'_, D>) {
        let _ = cell;
    }

    /// What was recovered of the same before, bit for bit; `None` has it done now, and [kept](Self::keep).
    fn recall(&mut self, recovery: &Recovery<'_, D>) -> Option<Recovered<D>> {
        let _ = recovery;
        None
    }

    /// What was recovered now.
    fn keep(&mut self, recovery: &Recovery<'_, D>, recovered: &Recovered<D>) {
        let _ = (recovery, recovered);
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl<const D: usize> Observer<D> for Silent {}

/// What counts once in the mean of a figure over many images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counts {
    /// Every point, so that an image counts by how many it has.
    Points,
    /// Every image, of those that have the figure: it is about an image as a whole.
    Images,
}

/// Something to be measured of every row beside errors: anybody may write one.
pub trait Measure<const D: usize>: Debug + Send + Sync {
    /// What counts once in a mean over images.
    fn counts(&self) -> Counts {
        Counts::Points
    }

    /// Figures by name. The same names for every cell: a figure that some repeats lack is left out, and one that counts
    /// points and some images lack.
    ///
    /// # Errors
    /// When it cannot be measured.
    fn measure(&self, cell: &Cell<'_, D>) -> Result<Vec<(String, f64)>, Error>;
}
