//! How the program ends: exit codes, and errors as one line with a way out.

use std::fmt;
use std::process::ExitCode;

/// How a command ended that did its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Exit code 0.
    Done,
    /// Exit code 1: the audit was done, and the map comes back further than the user allows.
    GateFailed,
}

/// Exit code of a wrong command line; clap uses the same.
const USAGE: u8 = 2;
/// Exit code of files that cannot be read, written or used; of many images, a single one.
const BAD_INPUT: u8 = 3;

/// The command line asks for something that cannot be done (exit code 2).
#[derive(Debug)]
pub struct Usage(String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// An error in the command line.
pub fn usage(message: impl Into<String>) -> anyhow::Error {
    Usage(message.into()).into()
}

/// An error with a line of advice below it.
#[derive(Debug)]
struct Advised {
    error: anyhow::Error,
    advice: String,
}

impl fmt::Display for Advised {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#}", self.error)
    }
}

impl std::error::Error for Advised {}

/// `error` with a way out: what the user could try instead.
pub fn advise(error: impl Into<anyhow::Error>, advice: impl Into<String>) -> anyhow::Error {
    Advised { error: error.into(), advice: advice.into() }.into()
}

/// Prints what is left to say and returns the exit code.
pub fn finish(result: anyhow::Result<Outcome>) -> ExitCode {
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::GateFailed) => ExitCode::FAILURE,
        Err(error) => {
            eprint!("{}", text(&error));
            ExitCode::from(code(&error))
        }
    }
}

/// The lines on stderr.
fn text(error: &anyhow::Error) -> String {
    let line = line(error);
    let of_audit = |error: &anyhow::Error| {
        let error = error.downcast_ref::<unlift_audit::Error>();
        error.and_then(|error| error.advice().map(str::to_owned))
    };
    let advised = error.downcast_ref::<Advised>().map(|advised| advised.advice.clone());
    match advised.or_else(|| of_audit(error)) {
        Some(advice) => format!("{line}\n  try: {advice}\n"),
        None => format!("{line}\n"),
    }
}

/// One line per error: a newline in a file name must not fake a second one.
pub fn line(error: &anyhow::Error) -> String {
    format!("unlift: {}", format!("{error:#}").replace(['\n', '\r'], " "))
}

fn code(error: &anyhow::Error) -> u8 {
    if let Some(advised) = error.downcast_ref::<Advised>() {
        return code(&advised.error);
    }
    let of_audit = error.downcast_ref::<unlift_audit::Error>();
    let is_usage =
        error.downcast_ref::<Usage>().is_some() || of_audit.is_some_and(|error| error.is_request());
    if is_usage { USAGE } else { BAD_INPUT }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn advice_keeps_the_code_and_adds_a_line() {
        let error = advise(usage("--k: expected at most 10, found 50"), "--k 10");
        assert_eq!(code(&error), USAGE);
        assert_eq!(text(&error), "unlift: --k: expected at most 10, found 50\n  try: --k 10\n");
    }

    #[test]
    fn everything_else_is_bad_input_on_one_line() {
        let error = unlift::Error::new("points", "51", "3");
        let error = Err::<(), _>(error).context("a\nb.ply").unwrap_err();
        assert_eq!(code(&error), BAD_INPUT);
        assert_eq!(text(&error), "unlift: a b.ply: points: expected 51, found 3\n");
    }
}
