//! Calls of functions in Python from threads of ours: none begins or goes on where the interpreter ends.
//!
//! A thread that takes the interpreter's lock while it ends is ended by the system within our frames, which aborts the process.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// How many threads are inside a call or wait for the lock; the highest bit is set once the interpreter is about to end.
static INSIDE: AtomicUsize = AtomicUsize::new(0);
const ENDING: usize = 1 << (usize::BITS - 1);
/// Python's numbers of these threads, and what stops their work. Held only with the interpreter's lock, so that no forked child
/// finds it held.
static NUMBERS: Mutex<Vec<(u64, Arc<AtomicBool>)>> = Mutex::new(Vec::new());
/// How long the end of the interpreter waits for functions of users.
const PATIENCE: Duration = Duration::from_secs(10);
const ASKED: Duration = Duration::from_millis(5);

/// What `call` makes with the interpreter's lock, which this thread does not hold, for work that `stop` stops; `None` once it is
/// stopped, or the interpreter is about to end.
pub fn attached<T>(stop: &Arc<AtomicBool>, call: impl FnOnce(Python<'_>) -> T) -> Option<T> {
    let _inside = Inside::new()?;
    Python::attach(|py| {
        // That may have come while this thread waited.
        if ending() || stop.load(Ordering::SeqCst) {
            return None;
        }
        let _numbered = Numbered::new(py, stop);
        Some(call(py))
    })
}

/// Whether no call begins any more.
pub fn ending() -> bool {
    INSIDE.load(Ordering::SeqCst) & ENDING != 0
}

/// A thread that is counted until it is dropped.
struct Inside;

impl Inside {
    fn new() -> Option<Self> {
        // Counted before the bit is looked at: who sets it waits for this thread, or this thread sees it.
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

/// A thread whose number is known until it is dropped, if Python tells it.
struct Numbered(Option<u64>);

impl Numbered {
    fn new(py: Python<'_>, stop: &Arc<AtomicBool>) -> Self {
        let number = py
            .import("threading")
            .and_then(|threading| threading.call_method0("get_ident")?.extract::<u64>());
        let number = number.ok();
        let mut numbers = NUMBERS.lock().unwrap_or_else(PoisonError::into_inner);
        numbers.extend(number.map(|number| (number, Arc::clone(stop))));
        Self(number)
    }
}

impl Drop for Numbered {
    fn drop(&mut self) {
        let mut numbers = NUMBERS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = numbers.iter().position(|(number, _)| Some(*number) == self.0) {
            numbers.swap_remove(at);
        }
    }
}

/// Interrupts the functions that run, as the user would those of the main thread: all, or those for work that `stop` stops.
pub fn interrupt(py: Python<'_>, stop: Option<&Arc<AtomicBool>>) -> PyResult<()> {
    let numbers = NUMBERS.lock().unwrap_or_else(PoisonError::into_inner).clone();
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

/// Lets no call begin, interrupts those that run, and waits for them, unless the user interrupts once more.
#[pyfunction]
fn end(py: Python<'_>) -> PyResult<()> {
    INSIDE.fetch_or(ENDING, Ordering::SeqCst);
    // Best effort: without it a function is waited for that takes its time.
    let _ = interrupt(py, None);
    let until = Instant::now() + PATIENCE;
    while INSIDE.load(Ordering::SeqCst) != ENDING && Instant::now() < until {
        py.detach(|| std::thread::sleep(ASKED));
        py.check_signals()?;
    }
    Ok(())
}

/// Forgets the threads of the parent, which a forked child has not.
#[pyfunction]
fn forget() {
    INSIDE.fetch_and(ENDING, Ordering::SeqCst);
    NUMBERS.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// Has Python call both when it is time.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    py.import("atexit")?.call_method1("register", (wrap_pyfunction!(end, module)?,))?;
    // There is no fork on Windows.
    if let Ok(at_fork) = py.import("os")?.getattr("register_at_fork") {
        let options = pyo3::types::PyDict::new(py);
        options.set_item("after_in_child", wrap_pyfunction!(forget, module)?)?;
        at_fork.call((), Some(&options))?;
    }
    Ok(())
}
