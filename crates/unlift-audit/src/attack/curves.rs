//! Error curves over many images or tiles. They are counts, so their size does not depend on the
//! number of items.

use unlift::audit::{Cell, Observer, Plan, Row, Watcher};
use unlift_report::ErrorCdf;

use crate::Progress;

const CURVE_POINTS: i32 = 80;

struct Curve {
    cell: Row,
    within: Vec<usize>,
    n: usize,
}

/// The error curves of the first repeat of one item, or of many items merged.
pub struct Curves<'a> {
    errors: Vec<f64>,
    curves: Vec<Curve>,
    steps: &'a dyn Progress,
    /// The share of the item that was reported as finished.
    reported: f64,
}

impl<'a> Curves<'a> {
    /// Creates an empty set of curves over errors from 0.01 to 10 times the largest threshold of
    /// `plan`, evenly on a logarithmic axis.
    pub fn new<const D: usize>(plan: &Plan<D>, steps: &'a dyn Progress) -> Self {
        let largest = plan.thresholds.iter().map(|t| t.value).fold(0.0, f64::max);
        let exponent = |step: i32| -2.0 + 3.0 * f64::from(step) / f64::from(CURVE_POINTS);
        let error = |step: i32| largest * 10f64.powf(exponent(step));
        let errors = (0..=CURVE_POINTS).map(error).collect();
        Self { errors, curves: Vec::new(), steps, reported: 0.0 }
    }

    fn merge(&mut self, more: Self) {
        for more in more.curves {
            match self.curves.iter_mut().find(|to| to.cell.is_same_cell(&more.cell)) {
                Some(to) => {
                    to.n += more.n;
                    to.within.iter_mut().zip(&more.within).for_each(|(to, more)| *to += more);
                }
                None => self.curves.push(more),
            }
        }
    }

    /// Returns the curve of every row of `rows` that has one, in percent.
    pub fn of_rows(&self, rows: &[Row]) -> Vec<ErrorCdf> {
        let of_row = |curve: &Curve| {
            // A cell that failed under another seed has no row.
            let row = rows.iter().position(|row| row.is_same_cell(&curve.cell))?;
            let percent = |count: usize| 100.0 * count as f64 / curve.n.max(1) as f64;
            let points = self.errors.iter().zip(&curve.within);
            let points = points.map(|(&error, &n)| (error, percent(n))).collect();
            Some(ErrorCdf { row, points })
        };
        self.curves.iter().filter_map(of_row).collect()
    }
}

impl<const D: usize> Observer<D> for Curves<'_> {
    fn progress(&mut self, done: usize, total: usize, _: &str) {
        let share = done as f64 / total.max(1) as f64;
        self.steps.add(share - self.reported, "");
        self.reported = share;
    }

    fn goes_on(&self) -> bool {
        self.steps.goes_on()
    }

    fn cell(&mut self, cell: &Cell<'_, D>) {
        if cell.repeat > 0 {
            return;
        }
        let within = self.errors.iter().map(|&error| cell.accuracy.n_within(error)).collect();
        let n = cell.accuracy.n_points();
        self.curves.push(Curve { cell: cell.row.clone(), within, n });
    }
}

/// Reports the progress of an audit of many items, merges their curves, and passes on the rows of
/// each.
pub struct OfItems<'a, F, const D: usize> {
    pub curves: Curves<'a>,
    plan: &'a Plan<D>,
    each: F,
}

impl<'a, F: FnMut(&str, &[Row]), const D: usize> OfItems<'a, F, D> {
    /// Creates the watcher of an audit by `plan` that calls `each` with the name and rows of an
    /// item.
    pub fn new(plan: &'a Plan<D>, steps: &'a dyn Progress, each: F) -> Self {
        Self { curves: Curves::new(plan, steps), plan, each }
    }
}

impl<'a, F: FnMut(&str, &[Row]), const D: usize> Watcher<D> for OfItems<'a, F, D> {
    type OfItem = Curves<'a>;

    fn begin(&mut self) -> Curves<'a> {
        Curves::new(self.plan, self.curves.steps)
    }

    fn progress(&mut self, _: usize, _: usize, what: &str) {
        // Each item reports its own share.
        self.curves.steps.add(0.0, what);
    }

    fn item(&mut self, name: &str, rows: &[Row], curves: Curves<'a>) {
        self.curves.merge(curves);
        (self.each)(name, rows);
    }
}
