//! Results of a plan's solvers for one set of lists, computed or recalled from the observer.

use std::time::Instant;

use super::observer::{Observer, Recovery};
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
    pub(super) fn by(
        &mut self,
        at: usize,
        observer: &mut dyn Observer<D>,
    ) -> Result<(Recovered<D>, f64), Error> {
        let (solver, started) = (&*self.plan.solvers[at], Instant::now());
        let is = |builtin, solver: &dyn Solver<D>| Builtin::of(solver) == Some(builtin);
        if let Some(kept) = self.start.take_if(|_| is(Builtin::JointStart, solver)) {
            return Ok((kept, 0.0));
        }
        let options = self.options();
        let recalled = observer.recall(&self.recovery(solver, &options));
        let mut later = self.plan.solvers[at..].iter();
        let with_start =
            is(Builtin::Joint, solver) && later.any(|later| is(Builtin::JointStart, &**later));
        let recovered = match recalled {
            Some(recalled) => recalled,
            None if with_start => {
                let (joint, start) = recover_with_start(self.released, self.lists, &options)?;
                observer.keep(&self.recovery(solver, &options), &joint);
                observer.keep(&self.recovery(&Builtin::JointStart, &options), &start);
                self.start = Some(start);
                joint
            }
            None => {
                let recovered = recover(self.released, self.lists, solver, &options)?;
                observer.keep(&self.recovery(solver, &options), &recovered);
                recovered
            }
        };
        Ok((recovered, started.elapsed().as_secs_f64()))
    }

    fn options(&self) -> RecoverOptions {
        RecoverOptions { delta: self.plan.delta, seed: self.seed, ..RecoverOptions::default() }
    }

    fn recovery<'b>(
        &self,
        solver: &'b dyn Solver<D>,
        options: &'b RecoverOptions,
    ) -> Recovery<'b, D>
    where
        'a: 'b,
    {
        Recovery { released: self.released, lists: self.lists, solver, options }
    }
}
