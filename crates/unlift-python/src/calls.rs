//! Calls of Python functions from Rust threads, which stop before the interpreter ends.
//!
//! A thread that takes the interpreter's lock while the interpreter ends is killed within our
//! frames, which aborts the process.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// Number of threads inside a call or waiting for the lock. The highest bit is set when the
/// interpreter is about to end.
static INSIDE: AtomicUsize = AtomicUsize::new(0);
const ENDING: usize = 1 << (usize::BITS - 1);
/// Python's ids of these threads, with the flags that stop their work. It is locked only under the
/// interpreter's lock, so that it is free in a forked child.
static NUMBERS: Mutex<Vec<(u64, Arc<AtomicBool>)>> = Mutex::new(Vec::new());
/// Maximum wait for user functions at the end of the interpreter.
const PATIENCE: Duration = Duration::from_secs(10);
const ASKED: Duration = Duration::from_millis(5);

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

/// Raises KeyboardInterrupt in running functions: in all, or in those that `stop` stops.
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

/// Prevents further calls, interrupts running functions and waits for them, unless the user
/// interrupts again.
#[pyfunction]
fn end(py: Python<'_>) -> PyResult<()> {
    INSIDE.fetch_or(ENDING, Ordering::SeqCst);
    // If this fails, the wait may be longer.
    let _ = interrupt(py, None);
    let until = Instant::now() + PATIENCE;
    while INSIDE.load(Ordering::SeqCst) != ENDING && Instant::now() < until {
        py.detach(|| std::thread::sleep(ASKED));
        py.check_signals()?;
    }
    Ok(())
}

/// Forgets the threads of the parent in a forked child.
#[pyfunction]
fn forget() {
    INSIDE.fetch_and(ENDING, Ordering::SeqCst);
    NUMBERS.lock().unwrap_or_else(PoisonError::into_inner).clear();
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
