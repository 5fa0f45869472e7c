//! Work without the interpreter's lock, which ends for the user when the user interrupts it.
//!
//! All that computes runs here, on threads that end with it: the threads of rayon's own pool, which lasts, a forked child would
//! wait for and not have.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use unlift::guard::told;

use crate::calls;
use crate::errors::{raised, wrong};

/// How often the interpreter is asked whether the user has interrupted.
const ASKED: Duration = Duration::from_millis(50);

/// Threads at most: more than machines have cores, and few enough to be started.
const MOST_THREADS: usize = 512;

/// Runs `work` on `threads` threads (all cores without a number) and waits for it. An interrupt ends the wait at once; the work
/// ends where `stop` is asked about, and of work that never asks the result is thrown away.
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
                // Best effort: a function that runs on takes time that the user wants back.
                let _ = calls::interrupt(py, Some(stop));
            }
            return Err(interrupt);
        }
    }
}
