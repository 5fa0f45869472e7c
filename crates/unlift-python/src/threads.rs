//! Work on threads of its own, which an interrupt can end, and calls of Python functions from there.
//!
//! Work runs without the interpreter's lock, on threads that end with it. rayon's global pool lasts, but a
//! forked child would wait for its threads, which it does not have. Python functions run on the thread that
//! waits for the work, so that an interrupt ends them as any other function. No other thread takes the
//! interpreter's lock: one that does while the interpreter ends is killed within our frames, which aborts the process.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use unlift::guard::told;
use unlift_audit::Progress;

use crate::arrays::{raised, wrong};

/// Interval of checks for an interrupt.
const POLL: Duration = Duration::from_millis(50);

/// Maximum number of threads: more than machines have cores, and few enough to start.
const MAX_THREADS: usize = 512;

type Call = Box<dyn FnOnce(Python<'_>) -> PyResult<()> + Send>;

/// The thread that waits for work, which calls Python functions for it.
#[derive(Clone, Debug, Default)]
pub struct Waiting {
    calls: Arc<OnceLock<Sender<Call>>>,
    stopped: Arc<AtomicBool>,
}

impl Waiting {
    /// Runs `call` on the waiting thread. An exception ends the wait. Returns `None` if it did, or if the wait has ended before.
    pub fn call<T: Send + 'static>(
        &self,
        call: impl FnOnce(Python<'_>) -> PyResult<T> + Send + 'static,
    ) -> Option<T> {
        let (reply, result) = mpsc::channel();
        let call = move |py: Python<'_>| {
            let _ = reply.send(call(py)?);
            Ok(())
        };
        self.calls.get()?.send(Box::new(call)).ok()?;
        result.recv().ok()
    }
}

/// Runs `work` on `threads` threads (default: all cores) and waits for it. An interrupt ends the
/// wait at once; the work ends at its next check of `waiting`, and its result is dropped.
pub fn run<T: Send + 'static, E: Display>(
    py: Python<'_>,
    threads: Option<usize>,
    waiting: Option<&Waiting>,
    work: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> PyResult<T> {
    if let Some(n) = threads.filter(|n| *n > MAX_THREADS) {
        return Err(wrong("threads", format!("at most {MAX_THREADS}"), n));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    let pool = pool.map_err(raised)?;
    let (send, calls) = mpsc::channel::<Call>();
    let calls = Mutex::new(calls);
    let (done, result) = mpsc::channel();
    let waiting = waiting.cloned().unwrap_or_default();
    waiting.calls.get_or_init(|| send.clone());
    let begun = std::thread::Builder::new().spawn(move || {
        let work = || work().map_err(|error| error.to_string());
        let result = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
        let _ = done.send(result.unwrap_or_else(|panic| Err(told(&*panic))));
        // Wakes the waiting thread.
        let _ = send.send(Box::new(|_| Ok(())));
    });
    begun.map_err(raised)?;
    loop {
        let call = py.detach(|| locked(&calls).recv_timeout(POLL));
        if let Ok(result) = result.try_recv() {
            return result.map_err(raised);
        }
        let called = call.map_or(Ok(()), |call| call(py)).and_then(|()| py.check_signals());
        if let Err(error) = called {
            waiting.stopped.store(true, Ordering::Relaxed);
            return Err(error);
        }
    }
}

/// Largest rounding error of fractions that add up to whole items.
const ROUNDING: f64 = 1e-6;

/// An observer that calls a Python function.
pub struct Watcher {
    tell: Option<Arc<Py<PyAny>>>,
    waiting: Waiting,
    messages: Mutex<Vec<String>>,
    counted: Mutex<Counted>,
}

/// Progress of an audit that processes several items at a time.
#[derive(Default)]
struct Counted {
    done: f64,
    /// Number of whole items that were reported.
    reported: usize,
    total: usize,
    what: String,
}

impl Watcher {
    /// Creates an observer for work that `waiting` waits for.
    pub fn new(tell: Option<Py<PyAny>>, waiting: Waiting) -> Self {
        let (messages, counted) = Default::default();
        Self { tell: tell.map(Arc::new), waiting, messages, counted }
    }

    /// Returns the messages.
    pub fn messages(&self) -> Vec<String> {
        locked(&self.messages).clone()
    }

    fn tell(&self, done: usize, total: usize, what: &str) {
        if let Some(tell) = self.tell.clone() {
            let given = (done, total, what.to_owned());
            self.waiting.call(move |py| tell.call1(py, given).map(drop));
        }
    }
}

impl Progress for Watcher {
    fn show(&self, done: usize, total: usize, what: &str) {
        let mut counted = locked(&self.counted);
        *counted = Counted { done: done as f64, reported: done, total, what: what.to_owned() };
        self.tell(done, total, what);
    }

    fn add(&self, share: f64, what: &str) {
        // The lock is held during the call, so that calls do not overlap and numbers never decrease.
        let mut counted = locked(&self.counted);
        counted.done += share;
        let done = (counted.done + ROUNDING) as usize;
        if done == counted.reported && (what.is_empty() || what == counted.what) {
            return;
        }
        counted.reported = done;
        if !what.is_empty() {
            what.clone_into(&mut counted.what);
        }
        self.tell(done, counted.total, &counted.what);
    }

    fn say(&self, line: &str) {
        locked(&self.messages).push(line.to_owned());
    }

    fn goes_on(&self) -> bool {
        !self.waiting.stopped.load(Ordering::Relaxed)
    }
}

/// Locks `mutex`, also after a panic.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
