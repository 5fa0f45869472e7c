//! The command line of unlift: parses arguments, calls the library, prints results.
//!
//! The program `unlift` and the Python package call [`run`]. For audits in Rust, use `unlift-audit`.

mod args;
mod commands;
mod demo;
mod exit;
mod output;
mod progress;
mod stderr;
mod values;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

/// How the program was called.
struct Call {
    program: PathBuf,
    words: Vec<OsString>,
}

static CALL: OnceLock<Call> = OnceLock::new();

/// Returns how the program was called. Before [`run`], the program has no name and no words.
fn call() -> &'static Call {
    CALL.get_or_init(|| Call { program: PathBuf::new(), words: Vec::new() })
}

/// Runs the command line `words`, of which the first is the name of the program, and returns the
/// exit code. `program` is the file whose hash identifies this build.
///
/// Call it once per process: it handles signals, and later calls would run the first command line.
pub fn run(program: PathBuf, words: Vec<OsString>) -> u8 {
    let _ = CALL.set(Call { program, words });
    match args::Cli::read(call().words.iter().cloned()) {
        Ok(cli) => {
            if let Some(bytes) = cli.memory_limit {
                unlift_io::input::limit_memory(bytes);
            }
            exit::finish(commands::run(cli.command))
        }
        Err(told) => exit::told(told),
    }
}
