//! An audit of a map that somebody else hid.

use super::plan::Plan;
use super::run::{Observer, Outcome, every_cell};
use crate::Error;
use crate::evaluate::belongs;
use crate::geometry::frame::Bounds;
use crate::obfuscate::{Entry, Lifted, Scheme, SchemeOptions};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};

/// The rule by which somebody else hid points: nobody here knows it.
struct Unknown;

impl Scheme<3> for Unknown {
    fn lift(
        &self,
        _: &[[f64; 3]],
        _: Option<&Bounds<3>>,
        _: &SchemeOptions,
        _: &Key,
    ) -> Result<Lifted<3>, Error> {
        Err(Error::new("scheme", "one of our own", "one of somebody else"))
    }
}

/// What stands for the scheme called `name` in a plan for [`run_released`]. It lives as long as the program, as names
/// of schemes do.
pub fn scheme_called(name: &str) -> &'static Entry {
    Box::leak(Box::new(Entry {
        name: Box::leak(name.to_owned().into_boxed_str()),
        summary: "records that somebody else made",
        source: "not stated",
        hidden: "not stated",
        patents: "not stated",
        in_2d: None,
        in_3d: Some(&Unknown),
    }))
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
    plan: &Plan,
    observer: &mut dyn Observer,
) -> Result<Outcome, Error> {
    let (released, secret) = hidden;
    plan.check(original.len(), released.descriptors().is_some())?;
    belongs(original, released, secret)?;
    every_cell((original, None), Some(hidden), plan, observer)
}
