//! An audit of a map that somebody else hid.

use std::sync::Arc;

use super::observer::Observer;
use super::plan::Plan;
use super::run::{Outcome, every_cell};
use crate::Error;
use crate::evaluate::belongs;
use crate::geometry::frame::Bounds;
use crate::obfuscate::{Facts, Lifted, Scheme};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};

/// The rule by which somebody else hid points: nobody here knows it.
#[derive(Debug)]
struct Unknown {
    name: String,
}

impl<const D: usize> Scheme<D> for Unknown {
    fn name(&self) -> &str {
        &self.name
    }

    fn facts(&self) -> Facts {
        Facts { summary: "records that somebody else made", ..Facts::default() }
    }

    fn lift(&self, _: &[[f64; D]], _: Option<&Bounds<D>>, _: &Key) -> Result<Lifted<D>, Error> {
        Err(Error::new("scheme", "one of our own", "one of somebody else"))
    }
}

/// What stands for the scheme called `name` in a plan for [`run_released`].
pub fn scheme_called<const D: usize>(name: &str) -> Arc<dyn Scheme<D>> {
    Arc::new(Unknown { name: name.to_owned() })
}

/// Runs `plan`, whose one scheme is what [`scheme_called`] gives, on records and their secret, which are of the points
/// `original` and in their frame and unit. Repeats differ in the oracle and the attacker alone.
///
/// # Errors
/// When the plan does not fit the map, or the three do not belong together: the figures would be next to nothing,
/// and read as "safe".
pub fn run_released(
    original: &Original<3>,
    hidden: &(Released<3>, Secret),
    plan: &Plan<3>,
    observer: &mut dyn Observer<3>,
) -> Result<Outcome, Error> {
    let (released, secret) = hidden;
    plan.check(original.len(), released.descriptors().is_some())?;
    belongs(original, released, secret)?;
    every_cell((original, None), Some(hidden), plan, observer)
}
