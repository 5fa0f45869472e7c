//! What every step of an audit may return and report: an error, and progress.

use std::fmt;

/// Ends a function with an error of the request, whose text has the form of `format!`.
#[macro_export]
macro_rules! bail {
    ($($text:tt)*) => { return Err($crate::Error::request(format!($($text)*))) };
}

/// An error of an audit.
#[derive(Debug)]
pub struct Error {
    message: String,
    /// True if the request is wrong, not a file.
    pub is_request: bool,
    /// What the user could try instead.
    pub advice: Option<String>,
}

impl Error {
    /// Creates an error of the request, not of a file.
    pub fn request(message: impl Into<String>) -> Self {
        Self { message: message.into(), is_request: true, advice: None }
    }

    /// Creates an error that is not of the request, with a text of its own.
    pub fn failed(message: impl Into<String>) -> Self {
        Self { message: message.into(), is_request: false, advice: None }
    }

    /// Adds advice: what the user could try instead.
    #[must_use]
    pub fn advise(self, advice: impl Into<String>) -> Self {
        Self { advice: Some(advice.into()), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

// Errors of everything that an audit reads and calls become its own.
macro_rules! from {
    ($($error:ty),*) => {$(
        impl From<$error> for Error {
            fn from(error: $error) -> Self {
                use std::error::Error as _;
                let sources = std::iter::successors(error.source(), |&source| source.source());
                let texts = sources.map(|source| format!(": {source}"));
                Self::failed(error.to_string() + &texts.collect::<String>())
            }
        }
    )*};
}

from!(unlift::Error, unlift_io::Error, unlift_report::Error, serde_json::Error);

/// Receives the progress of an audit, from any thread.
pub trait Progress: Send + Sync {
    /// Reports that `done` of `total` items are finished and that `what` comes next.
    fn show(&self, _done: usize, _total: usize, _what: &str) {}

    /// Reports that another share of an item is finished. `what` is the current step, or empty.
    fn add(&self, _share: f64, _what: &str) {}

    /// Passes a line to the user.
    fn say(&self, _line: &str) {}

    /// Passes a note about the figures to the user.
    fn note(&self, text: &str) {
        self.say(&format!("note: {text}"));
    }

    /// Returns whether the work continues. The audit calls it between cells; on false, it ends with an error and writes nothing.
    fn goes_on(&self) -> bool {
        true
    }
}

/// Returns an error if the user asked to stop.
pub(crate) fn check_stop(progress: &dyn Progress) -> Result<(), Error> {
    if !progress.goes_on() {
        bail!("audit: expected to run to the end, found a request to stop");
    }
    Ok(())
}

/// A progress receiver that ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Progress for Quiet {}
