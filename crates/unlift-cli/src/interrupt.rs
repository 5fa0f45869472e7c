//! Handles Ctrl-C, `kill` and `ulimit -f`, so that no half-written file stays behind.

use std::process;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;

use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use unlift_io::atomic::abandon;

/// Starts the handler that removes unfinished files on an interrupt, then exits with 130 or 143, as
/// shells do. Parts from which `features` resumes stay.
pub fn watch() {
    // With a handler, a write beyond the limit fails as on a full disk instead of killing the
    // process.
    let _ = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    // Without the handler the next run removes what an interrupt leaves.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else { return };
    let _ = thread::Builder::new().name("interrupt".into()).spawn(move || {
        if let Some(signal) = signals.forever().next() {
            abandon();
            process::exit(128 + signal);
        }
    });
}
