//! Replaces `journal` in builds without the feature `parquet`: no journal opens.

use std::convert::Infallible;
use std::marker::PhantomData;
use std::path::Path;

use unlift::OneLine;
use unlift::audit::Recovery;
use unlift::recover::Recovered;

use crate::{Error, Progress};

/// A folder of recovered points, which this build does not keep.
pub struct Journal<'a>(Infallible, PhantomData<&'a dyn Progress>);

impl<'a> Journal<'a> {
    /// Opens no journal.
    ///
    /// # Errors
    /// Always. The error names the feature that opens `folder`.
    pub fn open(folder: &Path, _: String, _: &'a dyn Progress) -> Result<Self, Error> {
        let folder = OneLine(folder.display());
        Err(Error::request(format!(
            "--journal: {folder}: expected unlift-audit with the feature `parquet`, found a build without it"
        )))
    }

    pub(crate) fn recall(&mut self, _: &Recovery<'_, 3>) -> Option<Recovered<3>> {
        match self.0 {}
    }

    pub(crate) fn keep(&mut self, _: &Recovery<'_, 3>, _: &Recovered<3>) {
        match self.0 {}
    }

    pub(crate) fn note(&self) -> Option<String> {
        match self.0 {}
    }

    /// Removes nothing.
    pub fn finish(self) {
        match self.0 {}
    }
}
