//! Exit codes, and errors as one line with advice.

use unlift::{OneLine, is_obeyed};

use crate::args::Cli;
use crate::output::{printed, tell};
use crate::words;

/// Exit code if more points come back than a gate allows.
const GATE_FAILED: u8 = 1;
/// Exit code for a wrong command line, as in clap.
const USAGE: u8 = 2;
/// Exit code for files that cannot be read, written or used, even a single image of many, and for a
/// stdout that cannot be written. A place that cannot be written is found before the work starts;
/// on the command line it is a usage error, see [`unlift_audit::check_file`].
const BAD_INPUT: u8 = 3;

/// Prints help or a usage error, and returns the exit code.
pub fn refused(error: clap::Error) -> u8 {
    // clap's message quotes the command line: parse it again without terminal control characters.
    let words = words().iter().map(|word| OneLine(word.display()).to_string());
    let error = Cli::read(words).err().unwrap_or(error);
    let text = error.render().to_string();
    if !error.use_stderr() {
        // Help is a result and goes to stdout, in clap's colors.
        return finish(printed(error.print()).map(|()| true));
    }
    if text.chars().any(|c| c != '\n' && is_obeyed(c)) {
        text.lines().for_each(tell);
    } else {
        // A message that cannot be written is dropped.
        let _ = error.print();
    }
    USAGE
}

/// Prints the error of a command, if any, and returns the exit code. A result of false means that a gate or a comparison failed.
pub fn finish(result: crate::Result<bool>) -> u8 {
    match result {
        Ok(true) => 0,
        Ok(false) => GATE_FAILED,
        Err(error) => {
            tell(format_args!("unlift: {error}"));
            if let Some(advice) = &error.advice {
                tell(format_args!("  try: {advice}"));
            }
            if error.is_request { USAGE } else { BAD_INPUT }
        }
    }
}
