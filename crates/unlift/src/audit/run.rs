//! Audits of one map, in the clear or obfuscated by another program.

use std::sync::Arc;

use super::break_even::{BreakEven, break_even};
use super::cells::{Owned, Rows, of_item};
use super::clock::Seconds;
use super::missing::NotAudited;
use super::observer::Observer;
use super::plan::Plan;
use super::row::Row;
use crate::evaluate::Truth;
use crate::obfuscate::{Lifted, LocalPoints, Scheme};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error};

/// Result of an audit.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// One row per scheme, source, noise model, inlier ratio and solver, over all points.
    pub rows: Vec<Row>,
    /// Parts of the plan without a row: refused schemes, and sources without lists for a scheme.
    pub not_audited: Vec<NotAudited>,
    /// Break-even ratios per scheme, noise model and solver.
    pub break_even: Vec<BreakEven>,
    /// Number of maps or images, including those without points.
    pub n_items: usize,
    /// Number of items with at most K points: their lists are shorter than K.
    pub n_too_small: usize,
    /// Time per stage.
    pub seconds: Seconds,
}

impl Outcome {
    /// Creates the result of `n_items` items, of which `n_too_small` have at most K points; an error without any row.
    pub(super) fn new<const D: usize>(
        plan: &Plan<D>,
        all: Rows,
        clock: Seconds,
        [n_items, n_too_small]: [usize; 2],
    ) -> Result<Self, Error> {
        let Rows { rows, seconds, not_audited } = all;
        if let (true, Some(first)) = (rows.is_empty(), not_audited.first()) {
            let found = format!("none: {}: {}", first.scheme, first.reason);
            return Err(Error::new("schemes", "one that can be applied to this map", found));
        }
        let break_even = break_even(plan, &rows);
        let seconds = Seconds { rows: seconds, ..clock };
        Ok(Self { rows, not_audited, break_even, n_items, n_too_small, seconds })
    }
}

/// Runs `plan` on a map. `descriptors` has one row per original.
///
/// Rows depend only on the arguments: byte-identical for any number of threads. A scheme that
/// cannot be applied is in [`not_audited`](Outcome::not_audited).
///
/// # Errors
/// When the plan does not fit the map, no scheme can be applied to it, or the observer stops the audit.
pub fn run<const D: usize>(
    original: &Original<D>,
    descriptors: Option<&Descriptors>,
    plan: &Plan<D>,
    observer: &mut dyn Observer<D>,
) -> Result<Outcome, Error> {
    plan.check(original.len(), descriptors.is_some())?;
    let every_cell: EveryCell<D> = EVERY_CELL.of()?;
    every_cell(&Owned { original, descriptors, hidden: None, name: None }, plan, observer)
}

type EveryCell<const D: usize> =
    fn(&Owned<'_, D>, &Plan<D>, &mut dyn Observer<D>) -> Result<Outcome, Error>;

unlift_attack::both! { EVERY_CELL: EveryCell = every_cell }

fn every_cell<const D: usize>(
    owned: &Owned<'_, D>,
    plan: &Plan<D>,
    observer: &mut dyn Observer<D>,
) -> Result<Outcome, Error> {
    let mut clock = Seconds::default();
    let all = of_item(owned, plan, &mut clock, observer, &mut |_| ())?;
    Outcome::new(plan, all, clock, [1, 0])
}

/// A scheme whose rule is unknown, because another program hid the points.
#[derive(Debug)]
struct Unknown(String);

impl<const D: usize> Scheme<D> for Unknown {
    fn name(&self) -> &str {
        &self.0
    }

    fn lift(&self, _: &LocalPoints<'_, D>, _: &Key) -> Result<Lifted<D>, Error> {
        Err(Error::new("scheme", "one that unlift can apply", "a scheme of another program"))
    }
}

/// Returns a placeholder for the scheme called `name` in a plan for [`run_released`].
pub fn scheme_called<const D: usize>(name: &str) -> Arc<dyn Scheme<D>> {
    Arc::new(Unknown(name.to_owned()))
}

/// Runs `plan` on given records and their secret, which the plan's first scheme stands for
/// ([`scheme_called`]). Other schemes hide the same points, with `descriptors`.
///
/// The records must be of the points `original`, in the same frame and unit. Repeats of the given records differ only
/// in the seeds of the oracle and the attacker.
///
/// # Errors
/// When the plan does not fit the map, or the three do not belong together.
pub fn run_released(
    (original, descriptors): (&Original<3>, Option<&Descriptors>),
    hidden: &(Released<3>, Secret),
    plan: &Plan<3>,
    observer: &mut dyn Observer<3>,
) -> Result<Outcome, Error> {
    let (released, secret) = hidden;
    plan.check(original.len(), released.descriptors().is_some())?;
    Truth { original, released, secret }.belongs()?;
    every_cell(&Owned { original, descriptors, hidden: Some(hidden), name: None }, plan, observer)
}
