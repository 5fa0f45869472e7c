//! Replaces `database.rs` in builds without the feature `sqlite`: no database opens.

use std::convert::Infallible;
use std::path::Path;

use crate::error::Error;

#[expect(dead_code)]
pub(crate) enum Kind {
    Bytes,
    Floats,
}

pub(crate) struct Rows {
    pub kind: Kind,
    pub n: usize,
    pub row_bytes: usize,
    pub data: Vec<u8>,
}

/// A database that cannot be opened.
pub(crate) struct Database(Infallible);

impl Database {
    /// Names the feature that reads `path`.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Err(Error::needs_feature(path, "sqlite"))
    }

    pub fn names(&self) -> Vec<Vec<u8>> {
        match self.0 {}
    }

    pub fn error(&self, _: &[u8], _: impl Into<String>, _: impl Into<String>) -> Error {
        match self.0 {}
    }

    pub fn descriptors(&self, _: &[u8]) -> Result<Rows, Error> {
        match self.0 {}
    }

    pub fn matrix(&self, _: &[u8], _: &str) -> Result<Option<Rows>, Error> {
        match self.0 {}
    }

    pub fn size(&self, _: &[u8]) -> Result<Option<[u32; 2]>, Error> {
        match self.0 {}
    }
}
