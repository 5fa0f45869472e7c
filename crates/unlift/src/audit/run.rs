//! An audit of one map.

use super::break_even::{BreakEven, break_even};
use super::cells::{Cell, Owned, Run, cells, per_scheme};
use super::clock::Clock;
use super::not_audited::{NotAudited, told};
use super::plan::Plan;
use super::row::Row;
use crate::neighbors::oracle;
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error};

/// Hears how an audit goes.
pub trait Observer<const D: usize = 3> {
    /// `done` of `total` cells are finished; `what` comes next.
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// One cell is finished.
    fn cell(&mut self, cell: &Cell<'_, D>) {
        let _ = cell;
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl<const D: usize> Observer<D> for Silent {}

/// Where the time went. Never part of results.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Searching nearest neighbors of the originals.
    pub search: f64,
    /// Obfuscating, over all schemes and repeats.
    pub obfuscate: f64,
    /// Making neighborhoods.
    pub neighbors: f64,
    /// Recovering.
    pub recover: f64,
    /// Attacking the records alone, evaluated.
    pub records_alone: f64,
    /// Evaluating, the blind attacker included.
    pub evaluate: f64,
    /// Per row, summed over repeats.
    pub rows: Vec<RowSeconds>,
}

/// Where the time of one row went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowSeconds {
    /// Making its neighborhoods; 0 where another solver's row already has the time.
    pub neighbors: f64,
    /// Recovering; 0 for what joint recovery started from, as the row of `joint` has the time.
    pub recover: f64,
}

impl RowSeconds {
    pub(super) fn add(&mut self, more: &Self) {
        self.neighbors += more.neighbors;
        self.recover += more.recover;
    }
}

/// What an audit found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One row per scheme, source, noise model, inlier ratio and solver, in this order.
    pub rows: Vec<Row>,
    /// What the plan asked for and has no row: schemes that cannot be applied to the map, and sources
    /// that have no lists for a scheme.
    pub not_audited: Vec<NotAudited>,
    /// The ratio at which half of the points come back, per scheme, noise model and solver.
    pub break_even: Vec<BreakEven>,
    /// Where the time went.
    pub seconds: Seconds,
}

/// Runs `plan` on the owner's map. `descriptors` has one row per original.
///
/// Rows depend on the map, the descriptors and the plan alone: the same bytes for any number of
/// threads.
///
/// A scheme that cannot be applied to the map has no rows and is told in
/// [`not_audited`](Outcome::not_audited).
///
/// # Errors
/// When the plan does not fit the map, or no scheme can be applied to it.
pub fn run(
    original: &Original<3>,
    descriptors: Option<&Descriptors>,
    plan: &Plan,
    observer: &mut dyn Observer,
) -> Result<Outcome, Error> {
    plan.check(original.len(), descriptors.is_some())?;
    every_cell((original, descriptors), None, plan, observer)
}

/// The same for a map that is `hidden` already, if so for the one scheme of the plan.
pub(super) fn every_cell(
    (original, descriptors): (&Original<3>, Option<&Descriptors>),
    hidden: Option<&(Released<3>, Secret)>,
    plan: &Plan,
    observer: &mut dyn Observer,
) -> Result<Outcome, Error> {
    let mut clock = Clock::default();
    let search = clock.time(|s| &mut s.search, || oracle::search(original))?;
    let owned = Owned { original, descriptors, hidden, search: &search, one_of_many: false };
    let per_scheme = per_scheme(plan);
    let total = per_scheme * plan.schemes.len() * plan.repeats as usize;
    let mut done = 0;
    let (mut rows, mut not_audited) = (Vec::new(), Vec::new());
    for &entry in &plan.schemes {
        let mut by_repeat: Vec<Vec<(Row, RowSeconds)>> = Vec::new();
        let mut missing: Vec<NotAudited> = Vec::new();
        for repeat in 0..plan.repeats {
            let seed = plan.seed.wrapping_add(u64::from(repeat));
            let key = Key::from_seed(seed);
            let run = Run { plan, entry, repeat, key: &key, oracle_seed: seed };
            let (mut of_repeat, before) = (Vec::new(), done);
            let lacking = cells(&owned, &run, &mut clock, observer, |observer, what, finished| {
                if let Some(what) = what {
                    observer.progress(done, total, &what);
                }
                if let Some(finished) = finished {
                    of_repeat.push((finished.row, finished.seconds));
                    done += 1;
                }
            })?;
            done = before + per_scheme;
            by_repeat.push(of_repeat);
            for one in lacking {
                if !missing.iter().any(|other| other.is_same_cell(&one)) {
                    missing.push(one);
                }
            }
        }
        let n_before = rows.len();
        for (row, _) in &by_repeat[0] {
            let same = by_repeat.iter().map(|rows| rows.iter().find(|(r, _)| r.is_same_cell(row)));
            // A mean over those seeds that went well would be no mean over seeds.
            let Some(same) = same.collect::<Option<Vec<_>>>() else { continue };
            let mut seconds = RowSeconds::default();
            same.iter().for_each(|(_, more)| seconds.add(more));
            clock.seconds.rows.push(seconds);
            rows.push(Row::mean(&same.iter().map(|(row, _)| row.clone()).collect::<Vec<_>>()));
        }
        not_audited.extend(told(missing, rows.len() > n_before));
    }
    if let (true, Some(first)) = (rows.is_empty(), not_audited.first()) {
        let expected = "one that can be applied to this map";
        let found = format!("none: {}: {}", first.scheme, first.reason);
        return Err(Error::new("schemes", expected, found));
    }
    observer.progress(done, total, "done");
    let break_even = break_even(plan, &rows);
    Ok(Outcome { rows, not_audited, break_even, seconds: clock.seconds })
}
