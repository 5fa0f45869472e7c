//! The progress of an audit of many images or tiles.

use unlift::audit::{Observer, Row, Watcher};

use crate::Progress;

/// Reports the progress of an audit of many items, and passes on the rows of each.
pub struct OfItems<'a, F> {
    /// Receives the progress.
    pub steps: &'a dyn Progress,
    /// Receives the name and the rows of an item.
    pub each: F,
}

/// Reports the progress of one item.
pub struct OfItem<'a> {
    steps: &'a dyn Progress,
    /// The share of the item that was reported as finished.
    reported: f64,
}

impl<const D: usize> Observer<D> for OfItem<'_> {
    fn progress(&mut self, done: usize, total: usize, _: &str) {
        let share = done as f64 / total.max(1) as f64;
        self.steps.add(share - self.reported, "");
        self.reported = share;
    }

    fn goes_on(&self) -> bool {
        self.steps.goes_on()
    }
}

impl<'a, F: FnMut(&str, &[Row]), const D: usize> Watcher<D> for OfItems<'a, F> {
    type OfItem = OfItem<'a>;

    fn begin(&mut self) -> OfItem<'a> {
        OfItem { steps: self.steps, reported: 0.0 }
    }

    fn progress(&mut self, _: usize, _: usize, what: &str) {
        // Each item reports its own share.
        self.steps.add(0.0, what);
    }

    fn item(&mut self, name: &str, rows: &[Row], _: OfItem<'a>) {
        (self.each)(name, rows);
    }
}
