//! The loop over schemes and repeats for one map or image. Audits of one item and of many share it.

use super::cells::{Finished, Owned, Run, cells};
use super::chance::{key_of, oracle_seed};
use super::clock::Clock;
use super::clock::RowSeconds;
use super::not_audited::{NotAudited, told};
use super::observer::Observer;
use super::plan::Plan;
use super::row::Row;
use crate::Error;
use crate::seed::Key;

/// Result of one map or image.
#[derive(Default)]
pub(super) struct Rows {
    /// One row per scheme, source, noise model, inlier ratio and solver, in this order; means over
    /// repeats.
    pub(super) rows: Vec<Row>,
    /// Seconds per row, summed over repeats.
    pub(super) seconds: Vec<RowSeconds>,
    pub(super) not_audited: Vec<NotAudited>,
}

/// Computes the rows of `owned`. Calls `finished` with every row of every repeat.
///
/// # Errors
/// Returns the errors of [`cells`].
pub(super) fn of_item<const D: usize>(
    owned: &Owned<'_, D>,
    plan: &Plan<D>,
    clock: &mut Clock,
    observer: &mut dyn Observer<D>,
    finished: &mut dyn FnMut(&Finished<'_>),
) -> Result<Rows, Error> {
    let per_scheme = plan.rows_per_scheme();
    let total = per_scheme * plan.schemes.len() * plan.repeats as usize;
    let (mut found, mut done) = (Rows::default(), 0);
    for scheme in &plan.schemes {
        let mut by_repeat: Vec<Vec<(Row, RowSeconds)>> = Vec::new();
        let mut missing: Vec<NotAudited> = Vec::new();
        let n_before = found.rows.len();
        for repeat in 0..plan.repeats {
            let (key, oracle_seed) = seeds(plan.seed.wrapping_add(u64::from(repeat)), owned.name);
            let run = Run { plan, scheme: scheme.name(), repeat, oracle_seed };
            let (mut of_repeat, before) = (Vec::new(), done);
            let hide = (&**scheme, &key);
            let lacking = cells(owned, &run, hide, clock, observer, |observer, what, one| {
                if let Some(what) = what {
                    observer.progress(done, total, &what);
                }
                if let Some(one) = one {
                    finished(&one);
                    of_repeat.push((one.row, one.seconds));
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
        for (row, _) in &by_repeat[0] {
            let same = by_repeat.iter().map(|rows| rows.iter().find(|(r, _)| r.is_same_cell(row)));
            // A mean over only the seeds that succeeded would be biased.
            let Some(same) = same.collect::<Option<Vec<_>>>() else { continue };
            let mut seconds = RowSeconds::default();
            same.iter().for_each(|(_, more)| seconds.add(more));
            found.seconds.push(seconds);
            found
                .rows
                .push(Row::mean(&same.iter().map(|(row, _)| row.clone()).collect::<Vec<_>>()));
        }
        found.not_audited.extend(told(missing, found.rows.len() > n_before));
    }
    observer.progress(done, total, "done");
    Ok(found)
}

fn seeds(seed: u64, name: Option<&str>) -> (Key, u64) {
    let key = Key::from_seed(seed);
    match name {
        None => (key, seed),
        Some(name) => (key_of(&key, name), oracle_seed(seed, name)),
    }
}
