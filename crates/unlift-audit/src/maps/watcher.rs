use std::sync::Arc;

use unlift::audit::{Cell, Observer, Plan, Row};
use unlift::recover::Builtin;
use unlift_report::ErrorCdf;
use unlift_report::inversions::Inversion as Sheet;

use crate::Error;
use crate::Progress;
use crate::curves::curve_errors;
use crate::inversion::MapInversion;
use crate::scene::Pictures;

/// Reports progress and collects what the page draws.
pub(super) struct Watcher<'a> {
    pub(super) progress: &'a dyn Progress,
    pub(super) pictures: Option<Pictures>,
    pub(super) curves: Vec<(Row, Vec<(f64, f64)>)>,
    pub(super) drawn: Vec<String>,
    pub(super) thresholds: Vec<f64>,
    pub(super) inversion: Option<Arc<MapInversion>>,
    /// One sheet for each of the first cameras.
    pub(super) sheets: Vec<Sheet>,
    pub(super) failed: Option<Error>,
}

/// Returns the names of the solvers whose points are drawn. `joint-start` is not drawn beside
/// `joint`.
pub(super) fn drawn<const D: usize>(plan: &Plan<D>) -> Vec<String> {
    let hides_start = plan.has_solver(Builtin::Joint);
    let solvers = plan.solvers.iter();
    let drawn = solvers.filter(|s| !hides_start || Builtin::of(&***s) != Some(Builtin::JointStart));
    drawn.map(|solver| solver.name().to_owned()).collect()
}

/// Returns the curve of every row of `rows` that has one.
pub fn curves_of(cells: Vec<(Row, Vec<(f64, f64)>)>, rows: &[Row]) -> Vec<ErrorCdf> {
    let curve = |(cell, points): (Row, Vec<(f64, f64)>)| {
        // A cell that failed under another seed has no row.
        let row = rows.iter().position(|row| row.is_same_cell(&cell))?;
        Some(ErrorCdf { row, points })
    };
    cells.into_iter().filter_map(curve).collect()
}

impl Observer for Watcher<'_> {
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        self.progress.show(done, total, what);
    }

    fn goes_on(&self) -> bool {
        self.progress.goes_on()
    }

    fn cell(&mut self, cell: &Cell<'_>) {
        if cell.repeat > 0 {
            return;
        }
        let most = self.thresholds.iter().copied().fold(0.0, f64::max);
        let points = curve_errors(most).map(|at| (at, cell.accuracy.percent_within(at))).collect();
        self.curves.push((cell.row.clone(), points));
        if let (Some(pictures), true) = (&mut self.pictures, self.drawn.contains(&cell.row.solver))
        {
            pictures.add(cell);
        }
        if let (Some(inversion), true, None) =
            (&self.inversion, self.drawn.contains(&cell.row.solver), &self.failed)
        {
            self.failed = inversion.add(cell, &mut self.sheets).err().map(Error::from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_joint_starts_from_is_drawn_only_by_itself() {
        let mut plan = Plan::<3>::new(unlift::Unit::Meter);
        assert_eq!(drawn(&plan), ["ranking", "joint"]);
        plan.solvers = vec![Arc::new(Builtin::JointStart), Arc::new(Builtin::Ransac)];
        assert_eq!(drawn(&plan), ["joint-start", "ransac"]);
    }
}
