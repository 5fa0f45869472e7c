//! Ctrl-C, `kill` and `ulimit -f`: nothing half-written stays behind.

use std::process;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;

use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use unlift_io::atomic::abandon;

/// From here on an interrupt removes what is unfinished before the program ends: exit codes 130 and 143, as shells have
/// them. Parts from which `features` goes on stay.
pub fn watch() {
    // Heard, it kills nobody: the write that was one too many fails, as on a full disk.
    let _ = flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
    // Without it the program still works, and the next run clears away what an interrupt leaves.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else { return };
    let _ = thread::Builder::new().name("interrupt".into()).spawn(move || {
        if let Some(signal) = signals.forever().next() {
            abandon();
            process::exit(128 + signal);
        }
    });
}
