//! Work without the interpreter's lock, which an interrupt can end.
//!
//! All work runs on threads that end with it. rayon's global pool lasts, but a forked child would
//! wait for its threads, which it does not have.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use unlift::guard::told;

use crate::calls;
use crate::errors::{raised, wrong};

/// Interval of checks for an interrupt.
const ASKED: Duration = Duration::from_millis(50);

/// Maximum number of threads: more than machines have cores, and few enough to start.
const MOST_THREADS: usize = 512;

/// Runs `work` on `threads` threads (default: all cores) and waits for it. An interrupt ends the
/// wait at once; the work ends at its next check of `stop`, and its result is dropped.
pub fn run<T: Send + 'static, E: Display>(
    py: Python<'_>,
    threads: Option<usize>,
    stop: Option<Arc<AtomicBool>>,
    work: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> PyResult<T> {
    if let Some(n) = threads.filter(|n| *n > MOST_THREADS) {
        return Err(wrong("threads", format!("at most {MOST_THREADS}"), n));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    let pool = pool.map_err(raised)?;
    let slot = Arc::new((Mutex::new(None), Condvar::new()));
    let done = Arc::clone(&slot);
    let begun = std::thread::Builder::new().spawn(move || {
        let work = || work().map_err(|error| error.to_string());
        let result = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
        let result = result.unwrap_or_else(|panic| Err(told(&*panic)));
        *done.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        done.1.notify_all();
    });
    begun.map_err(raised)?;
    loop {
        let result = py.detach(|| {
            let waiting = slot.0.lock().unwrap_or_else(PoisonError::into_inner);
            let waited = slot.1.wait_timeout_while(waiting, ASKED, |result| result.is_none());
            waited.unwrap_or_else(PoisonError::into_inner).0.take()
        });
        if let Some(result) = result {
            return result.map_err(raised);
        }
        if let Err(interrupt) = py.check_signals() {
            if let Some(stop) = &stop {
                stop.store(true, Ordering::SeqCst);
                // If this fails, the user's function continues for a while.
                let _ = calls::interrupt(py, Some(stop));
            }
            return Err(interrupt);
        }
    }
}
