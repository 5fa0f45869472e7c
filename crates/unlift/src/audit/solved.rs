//! Results of a plan's solvers for one set of lists.

use std::time::Instant;

use super::plan::Plan;
use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::recover::{Builtin, RecoverOptions, Recovered, Solver, recover, recover_with_start};
use crate::released::Released;

/// A released map with lists, on which the solvers of a plan run in order.
pub(super) struct Solved<'a, const D: usize> {
    plan: &'a Plan<D>,
    released: &'a Released<D>,
    lists: &'a Neighborhoods,
    seed: u64,
    /// Estimates that joint recovery started from, kept for the solver `joint-start`.
    start: Option<Recovered<D>>,
}

impl<'a, const D: usize> Solved<'a, D> {
    pub(super) fn new(
        plan: &'a Plan<D>,
        (released, lists): (&'a Released<D>, &'a Neighborhoods),
        seed: u64,
    ) -> Self {
        Self { plan, released, lists, seed, start: None }
    }

    /// Returns the result of the solver numbered `at`, and its seconds.
    ///
    /// # Errors
    /// Returns the errors of [`recover`].
    pub(super) fn by(&mut self, at: usize) -> Result<(Recovered<D>, f64), Error> {
        let (solver, started) = (&*self.plan.solvers[at], Instant::now());
        let is = |builtin, solver: &dyn Solver<D>| Builtin::of(solver) == Some(builtin);
        if let Some(kept) = self.start.take_if(|_| is(Builtin::JointStart, solver)) {
            return Ok((kept, 0.0));
        }
        let options =
            RecoverOptions { delta: self.plan.delta, seed: self.seed, ..RecoverOptions::default() };
        let mut later = self.plan.solvers[at..].iter();
        let with_start =
            is(Builtin::Joint, solver) && later.any(|later| is(Builtin::JointStart, &**later));
        let recovered = if with_start {
            let (joint, start) = recover_with_start(self.released, self.lists, &options)?;
            self.start = Some(start);
            joint
        } else {
            recover(self.released, self.lists, solver, &options)?
        };
        Ok((recovered, started.elapsed().as_secs_f64()))
    }
}
