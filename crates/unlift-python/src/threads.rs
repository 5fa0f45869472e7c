//! Work on threads of its own, which an interrupt can end, and calls of Python functions from there.
//!
//! Work runs without the interpreter's lock, on threads that end with it. rayon's global pool lasts, but a
//! forked child would wait for its threads, which it does not have. Calls stop before the interpreter ends: a
//! thread that takes its lock while it ends is killed within our frames, which aborts the process.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use unlift::guard::told;
use unlift_audit::Progress;

use crate::arrays::{raised, wrong};

/// Interval of checks for an interrupt.
const POLL: Duration = Duration::from_millis(50);

/// Maximum number of threads: more than machines have cores, and few enough to start.
const MAX_THREADS: usize = 512;

/// Runs `work` on `threads` threads (default: all cores) and waits for it. An interrupt ends the
/// wait at once; the work ends at its next check of `stop`, and its result is dropped.
pub fn run<T: Send + 'static, E: Display>(
    py: Python<'_>,
    threads: Option<usize>,
    stop: Option<Arc<AtomicBool>>,
    work: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> PyResult<T> {
    if let Some(n) = threads.filter(|n| *n > MAX_THREADS) {
        return Err(wrong("threads", format!("at most {MAX_THREADS}"), n));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    let pool = pool.map_err(raised)?;
    let slot = Arc::new((Mutex::new(None), Condvar::new()));
    let done = Arc::clone(&slot);
    let begun = std::thread::Builder::new().spawn(move || {
        let work = || work().map_err(|error| error.to_string());
        let result = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
        let result = result.unwrap_or_else(|panic| Err(told(&*panic)));
        *locked(&done.0) = Some(result);
        done.1.notify_all();
    });
    begun.map_err(raised)?;
    loop {
        let result = py.detach(|| {
            let waiting = locked(&slot.0);
            let waited = slot.1.wait_timeout_while(waiting, POLL, |result| result.is_none());
            waited.unwrap_or_else(PoisonError::into_inner).0.take()
        });
        if let Some(result) = result {
            return result.map_err(raised);
        }
        if let Err(error) = py.check_signals() {
            if let Some(stop) = &stop {
                stop.store(true, Ordering::SeqCst);
                // If this fails, the user's function continues for a while.
                let _ = interrupt(py, Some(stop));
            }
            return Err(error);
        }
    }
}

/// Number of threads inside a call or waiting for the lock. The highest bit is set when the
/// interpreter is about to end.
static INSIDE: AtomicUsize = AtomicUsize::new(0);
const ENDING: usize = 1 << (usize::BITS - 1);
/// Python's ids of these threads, with the flags that stop their work. It is locked only under the
/// interpreter's lock, so that it is free in a forked child.
static NUMBERS: Mutex<Vec<(u64, Arc<AtomicBool>)>> = Mutex::new(Vec::new());
/// Maximum wait for user functions at the end of the interpreter.
const PATIENCE: Duration = Duration::from_secs(10);

/// Calls `call` with the interpreter's lock, which this thread must not hold. Returns `None` if
/// `stop` is set or the interpreter is about to end.
pub fn attached<T>(stop: &Arc<AtomicBool>, call: impl FnOnce(Python<'_>) -> T) -> Option<T> {
    let _inside = Inside::new()?;
    Python::attach(|py| {
        // The flags may have been set while this thread waited.
        if ending() || stop.load(Ordering::SeqCst) {
            return None;
        }
        let _numbered = Numbered::new(py, stop);
        Some(call(py))
    })
}

/// Returns true if no further call may begin.
pub fn ending() -> bool {
    INSIDE.load(Ordering::SeqCst) & ENDING != 0
}

/// Counts a thread until it is dropped.
struct Inside;

impl Inside {
    fn new() -> Option<Self> {
        // Count before reading the bit: then either `end` waits for this thread, or this thread
        // sees the bit.
        let earlier = INSIDE.fetch_add(1, Ordering::SeqCst);
        let inside = Self;
        (earlier & ENDING == 0).then_some(inside)
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        INSIDE.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Registers a thread's id until it is dropped, if Python provides one.
struct Numbered(Option<u64>);

impl Numbered {
    fn new(py: Python<'_>, stop: &Arc<AtomicBool>) -> Self {
        let number = py
            .import("threading")
            .and_then(|threading| threading.call_method0("get_ident")?.extract::<u64>());
        let number = number.ok();
        let mut numbers = locked(&NUMBERS);
        numbers.extend(number.map(|number| (number, Arc::clone(stop))));
        Self(number)
    }
}

impl Drop for Numbered {
    fn drop(&mut self) {
        let mut numbers = locked(&NUMBERS);
        if let Some(at) = numbers.iter().position(|(number, _)| Some(*number) == self.0) {
            numbers.swap_remove(at);
        }
    }
}

/// Raises KeyboardInterrupt in running functions: in all, or in those that `stop` stops.
pub fn interrupt(py: Python<'_>, stop: Option<&Arc<AtomicBool>>) -> PyResult<()> {
    let numbers = locked(&NUMBERS).clone();
    let numbers = numbers.iter().filter(|(_, own)| stop.is_none_or(|stop| Arc::ptr_eq(own, stop)));
    let ctypes = py.import("ctypes")?;
    let exception = ctypes.call_method1("py_object", (py.get_type::<PyKeyboardInterrupt>(),))?;
    for (number, _) in numbers {
        let number = ctypes.call_method1("c_ulong", (*number,))?;
        let api = ctypes.getattr("pythonapi")?;
        api.call_method1("PyThreadState_SetAsyncExc", (number, &exception))?;
    }
    Ok(())
}

/// Prevents further calls, interrupts running functions and waits for them, unless the user
/// interrupts again.
#[pyfunction]
fn end(py: Python<'_>) -> PyResult<()> {
    INSIDE.fetch_or(ENDING, Ordering::SeqCst);
    // If this fails, the wait may be longer.
    let _ = interrupt(py, None);
    let until = Instant::now() + PATIENCE;
    while INSIDE.load(Ordering::SeqCst) != ENDING && Instant::now() < until {
        py.detach(|| std::thread::sleep(Duration::from_millis(5)));
        py.check_signals()?;
    }
    Ok(())
}

/// Forgets the threads of the parent in a forked child.
#[pyfunction]
fn forget() {
    INSIDE.fetch_and(ENDING, Ordering::SeqCst);
    locked(&NUMBERS).clear();
}

/// Registers `end` with `atexit`, and `forget` with `register_at_fork`.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    py.import("atexit")?.call_method1("register", (wrap_pyfunction!(end, module)?,))?;
    // Windows has no fork.
    if let Ok(at_fork) = py.import("os")?.getattr("register_at_fork") {
        let options = pyo3::types::PyDict::new(py);
        options.set_item("after_in_child", wrap_pyfunction!(forget, module)?)?;
        at_fork.call((), Some(&options))?;
    }
    Ok(())
}

/// Largest rounding error of fractions that add up to whole items.
const ROUNDING: f64 = 1e-6;

/// An observer that calls a Python function and stops the audit if the function raises.
pub struct Watcher {
    tell: Option<Py<PyAny>>,
    stop: Arc<AtomicBool>,
    failed: Mutex<Option<PyErr>>,
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
    /// Creates an observer for work that `stop` stops.
    pub fn new(tell: Option<Py<PyAny>>, stop: Arc<AtomicBool>) -> Self {
        let (failed, messages, counted) = Default::default();
        Self { tell, stop, failed, messages, counted }
    }

    /// Returns the exception of the function.
    pub fn failed(&self) -> Option<PyErr> {
        locked(&self.failed).take()
    }

    /// Returns the messages.
    pub fn messages(&self) -> Vec<String> {
        locked(&self.messages).clone()
    }

    fn tell(&self, done: usize, total: usize, what: &str) {
        let Some(tell) = &self.tell else { return };
        let result = attached(&self.stop, |py| tell.call1(py, (done, total, what)).map(drop));
        if let Some(Err(error)) = result {
            locked(&self.failed).get_or_insert(error);
            self.stop.store(true, Ordering::Relaxed);
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
        // The lock is held during the call, so that calls do not overlap and numbers never
        // decrease.
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
        !self.stop.load(Ordering::Relaxed) && !ending()
    }
}

/// Locks `mutex`, also after a panic.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
