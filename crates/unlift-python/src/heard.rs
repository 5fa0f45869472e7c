//! Progress and messages of a running audit.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use unlift_audit::Progress;

use crate::calls;

/// Largest rounding error of fractions that add up to whole items.
const ROUNDING: f64 = 1e-6;

/// An observer that calls a Python function and stops the audit if the function raises.
pub struct Heard {
    tell: Option<Py<PyAny>>,
    stop: Arc<AtomicBool>,
    failed: Mutex<Option<PyErr>>,
    said: Mutex<Vec<String>>,
    counted: Mutex<Counted>,
}

/// Progress of an audit that processes several items at a time.
#[derive(Default)]
struct Counted {
    done: f64,
    /// Number of whole items that were reported.
    told: usize,
    total: usize,
    what: String,
}

impl Heard {
    /// Creates an observer for work that `stop` stops.
    pub fn new(tell: Option<Py<PyAny>>, stop: Arc<AtomicBool>) -> Self {
        let (failed, said, counted) = Default::default();
        Self { tell, stop, failed, said, counted }
    }

    /// Returns the exception of the function.
    pub fn failed(&self) -> Option<PyErr> {
        locked(&self.failed).take()
    }

    /// Returns the messages.
    pub fn said(&self) -> Vec<String> {
        locked(&self.said).clone()
    }

    fn tell(&self, done: usize, total: usize, what: &str) {
        let Some(tell) = &self.tell else { return };
        let told = calls::attached(&self.stop, |py| tell.call1(py, (done, total, what)).map(drop));
        if let Some(Err(error)) = told {
            locked(&self.failed).get_or_insert(error);
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

impl Progress for Heard {
    fn show(&self, done: usize, total: usize, what: &str) {
        let mut counted = locked(&self.counted);
        *counted = Counted { done: done as f64, told: done, total, what: what.to_owned() };
        self.tell(done, total, what);
    }

    fn add(&self, share: f64, what: &str) {
        // The lock is held during the call, so that calls do not overlap and numbers never
        // decrease.
        let mut counted = locked(&self.counted);
        counted.done += share;
        let done = (counted.done + ROUNDING) as usize;
        if done == counted.told && (what.is_empty() || what == counted.what) {
            return;
        }
        counted.told = done;
        if !what.is_empty() {
            what.clone_into(&mut counted.what);
        }
        self.tell(done, counted.total, &counted.what);
    }

    fn say(&self, line: &str) {
        locked(&self.said).push(line.to_owned());
    }

    fn goes_on(&self) -> bool {
        !self.stop.load(Ordering::Relaxed) && !calls::ending()
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
