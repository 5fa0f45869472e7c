//! Audit of a map that another program obfuscated.

use std::sync::Arc;

use super::observer::Observer;
use super::plan::Plan;
use super::run::{Outcome, every_cell};
use crate::Error;
use crate::evaluate::belongs;
use crate::geometry::frame::Bounds;
use crate::obfuscate::{Lifted, Scheme};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};

/// A scheme whose rule is unknown, because another program hid the points.
#[derive(Debug)]
struct Unknown {
    name: String,
}

impl<const D: usize> Scheme<D> for Unknown {
    fn name(&self) -> &str {
        &self.name
    }

    fn lift(&self, _: &[[f64; D]], _: Option<&Bounds<D>>, _: &Key) -> Result<Lifted<D>, Error> {
        Err(Error::new("scheme", "one that unlift can apply", "a scheme of another program"))
    }
}

/// Returns a placeholder for the scheme called `name` in a plan for [`run_released`].
pub fn scheme_called<const D: usize>(name: &str) -> Arc<dyn Scheme<D>> {
    Arc::new(Unknown { name: name.to_owned() })
}

/// Runs `plan` on given records and their secret. The plan's only scheme comes from
/// [`scheme_called`].
///
/// The records must be of the points `original`, in the same frame and unit. Repeats differ only in
/// the seeds of the oracle and the attacker.
///
/// # Errors
/// When the plan does not fit the map, or when the three do not belong together: wrong ground truth
/// would make the map look safe.
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
