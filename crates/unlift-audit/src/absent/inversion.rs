//! Pictures, which this build of unlift-audit does not make: it lacks the feature `networks`.

use std::convert::Infallible;

use unlift::Error;
use unlift::audit::Cell;
use unlift_report::inversions::Inversion as Sheet;

/// Pictures of images, which this build does not make.
#[derive(Debug)]
pub struct Inversion(Infallible);

impl Inversion {
    pub(crate) fn sha256(&self) -> &str {
        match self.0 {}
    }

    pub(crate) fn failed(&self) -> Vec<Error> {
        match self.0 {}
    }

    pub(crate) fn add(&self, _: &Cell<'_, 2>, _: &mut Sheet) -> Result<(), Error> {
        match self.0 {}
    }
}

/// Pictures of a map, which this build does not make.
#[derive(Debug)]
pub struct MapInversion(Infallible);

impl MapInversion {
    pub(crate) fn sha256(&self) -> &str {
        match self.0 {}
    }

    pub(crate) fn n_photos(&self) -> usize {
        match self.0 {}
    }

    pub(crate) fn add(&self, _: &Cell<'_>, _: &mut [Sheet]) -> Result<(), Error> {
        match self.0 {}
    }
}
