/// Receives the progress of an audit, from any thread.
pub trait Progress: Send + Sync {
    /// Reports that `done` of `total` items are finished and that `what` comes next.
    fn show(&self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// Reports that another share of an item is finished. `what` is the current step, or empty.
    fn add(&self, share: f64, what: &str) {
        let _ = (share, what);
    }

    /// Passes a note to the user.
    fn say(&self, line: &str) {
        let _ = line;
    }

    /// Returns whether the work continues. The audit calls it between cells; on false, it ends with
    /// an error and writes nothing.
    fn goes_on(&self) -> bool {
        true
    }
}

/// A progress receiver that ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Progress for Quiet {}
