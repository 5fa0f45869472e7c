//! The command line of unlift: parses arguments, calls the library, prints results.
//!
//! The program `unlift` and the Python package call [`run`]. For audits in Rust, use `unlift-audit`.

mod args;
mod commands;
mod demo;
mod exit;
mod output;
mod progress;
mod values;

use std::ffi::OsString;
use std::sync::OnceLock;

use unlift_audit::Error;

type Result<T> = std::result::Result<T, Error>;

static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Returns the words of the command line, none before [`run`].
fn words() -> &'static [OsString] {
    WORDS.get().map_or(&[], Vec::as_slice)
}

/// Runs the command line `words`, of which the first is the name of the program, and returns the exit code.
///
/// Call it once per process: later calls would run the first command line.
pub fn run(words: Vec<OsString>) -> u8 {
    let words = WORDS.get_or_init(|| words);
    match args::Cli::read(words.iter().cloned()) {
        Ok(cli) => exit::finish(commands::run(cli.command)),
        Err(error) => exit::refused(error),
    }
}
