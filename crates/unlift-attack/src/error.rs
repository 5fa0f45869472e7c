//! The error of the library: an argument with a wrong value.

use std::fmt;

use crate::line::OneLine;

/// The kind of an [`Error`], for callers that handle some kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A value breaks a stated rule.
    Invalid,
    /// There are fewer points than lists of neighbors need.
    TooFewPoints,
    /// A source of neighbors does not support descriptors of this kind.
    Descriptors,
    /// The observer of an audit asked it to stop.
    Stopped,
}

/// An argument or a set of columns that breaks a rule.
///
/// It prints as one line: `what: expected ..., found ...` ([`OneLine`]). Errors of files have their own type, with path and place, in
/// the crate that reads them. A point that cannot be recovered is a [`Status`](crate::recover::Status), not an error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    what: String,
    expected: String,
    found: String,
}

impl Error {
    /// Creates an error about `what` (a field, an option, a row), with the rule and the value that breaks it.
    pub fn new(
        what: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        let kind = ErrorKind::Invalid;
        Self { kind, what: what.into(), expected: expected.into(), found: found.into() }
    }

    /// Sets the kind.
    #[must_use]
    pub fn of_kind(self, kind: ErrorKind) -> Self {
        Self { kind, ..self }
    }

    /// Kind of the error.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Adds the place of the error: `place: what: expected ..., found ...`.
    #[must_use]
    pub fn within(self, place: &str) -> Self {
        Self { what: format!("{place}: {}", self.what), ..self }
    }

    /// The field, option or row that is wrong.
    pub fn what(&self) -> &str {
        &self.what
    }

    /// The rule that was broken.
    pub fn expected(&self) -> &str {
        &self.expected
    }

    /// The value that broke it.
    pub fn found(&self) -> &str {
        &self.found
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [what, expected, found] = [&self.what, &self.expected, &self.found].map(OneLine);
        write!(f, "{what}: expected {expected}, found {found}")
    }
}

impl std::error::Error for Error {}
