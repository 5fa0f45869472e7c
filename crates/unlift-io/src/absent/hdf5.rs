//! Replaces `features/h5/read.rs` in builds without the feature `hdf5`: no file opens.

use std::convert::Infallible;
use std::path::Path;

use super::Array;
use crate::error::Error;

/// An HDF5 file that cannot be opened.
pub(crate) struct FeatureStore(Infallible);

impl FeatureStore {
    /// Names the feature that reads `path`.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Err(Error::needs_feature(path, "hdf5"))
    }

    pub fn broken(&self) -> &[Error] {
        match self.0 {}
    }

    pub fn alone(&self) -> &[String] {
        match self.0 {}
    }

    pub fn path(&self) -> &Path {
        match self.0 {}
    }

    pub fn paths(&self) -> &[String] {
        match self.0 {}
    }

    pub fn names(&self, _: usize) -> Result<Vec<String>, Error> {
        match self.0 {}
    }

    pub fn array(&self, _: usize, _: &str) -> Result<Array, Error> {
        match self.0 {}
    }

    pub fn number(&self, _: usize, _: &str, _: &str) -> Result<Option<f64>, Error> {
        match self.0 {}
    }

    pub fn error(&self, _: &str, _: &str, _: impl Into<String>, _: impl Into<String>) -> Error {
        match self.0 {}
    }
}
