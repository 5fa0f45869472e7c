//! A scheme with protected descriptors.

use std::sync::Arc;

use super::protect::Protection;
use super::scheme::{Lifted, Scheme};
use crate::geometry::frame::Bounds;
use crate::seed::Key;
use crate::{Descriptors, Error};

/// A scheme that releases protected descriptors.
#[derive(Clone, Debug)]
pub struct Protected<const D: usize> {
    scheme: Arc<dyn Scheme<D>>,
    protection: Protection,
    name: String,
}

impl<const D: usize> Protected<D> {
    /// Creates the scheme.
    pub fn new(scheme: Arc<dyn Scheme<D>>, protection: Protection) -> Self {
        let name = format!("{}_{}", scheme.name(), protection.name());
        Self { scheme, protection, name }
    }
}

impl<const D: usize> Scheme<D> for Protected<D> {
    fn name(&self) -> &str {
        &self.name
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        self.scheme.parameters()
    }

    fn lift(
        &self,
        points: &[[f64; D]],
        bounds: Option<&Bounds<D>>,
        key: &Key,
    ) -> Result<Lifted<D>, Error> {
        self.scheme.lift(points, bounds, key)
    }

    fn descriptors(
        &self,
        descriptors: &Descriptors,
        key: &Key,
    ) -> Result<Option<Descriptors>, Error> {
        self.scheme.descriptors(descriptors, key)
    }

    fn changes_descriptors(&self) -> bool {
        true
    }

    fn protection(&self) -> Option<&Protection> {
        Some(&self.protection)
    }
}
