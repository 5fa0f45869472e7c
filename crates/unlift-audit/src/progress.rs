//! How long work is heard of, and stopped.

/// Hears how an audit goes, from any thread.
pub trait Progress: Send + Sync {
    /// `done` of `total` items are finished; `what` comes next.
    fn show(&self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// A share of an item more is finished; `what` is at work, unless it is empty.
    fn add(&self, share: f64, what: &str) {
        let _ = (share, what);
    }

    /// Something that a user should know.
    fn say(&self, line: &str) {
        let _ = line;
    }

    /// Whether the work shall go on. Asked between cells; once it does not, the audit ends with an error and
    /// nothing is written.
    fn goes_on(&self) -> bool {
        true
    }
}

/// Nobody listens.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Progress for Quiet {}
