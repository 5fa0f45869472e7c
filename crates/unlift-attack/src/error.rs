//! The error of the library, an argument with a wrong value, and text of unknown origin as one harmless line.

use std::fmt::{self, Display, Write};

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
    pub fn new(what: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        let kind = ErrorKind::Invalid;
        Self { kind, what: what.into(), expected: expected.into(), found: found.to_string() }
    }

    /// Rejects a number of rows other than `expected`; `rule` follows this number in the message, as in ` rows, one per slot`.
    ///
    /// # Errors
    /// When `found` is another number.
    pub fn check_len(what: &str, found: usize, expected: usize, rule: &str) -> Result<(), Self> {
        match found == expected {
            true => Ok(()),
            false => Err(Self::new(what, format!("{expected}{rule}"), found)),
        }
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

/// Displays text as one line, with everything escaped that a terminal would obey.
///
/// Names of files and images may contain a newline that fakes a second line, a sequence that sets the window title or clears the
/// screen, or a mark that changes the direction of text. Escaped text stays as it is.
///
/// ```
/// # use unlift_attack::OneLine;
/// assert_eq!(OneLine("a\u{1b}[2J\u{202e}gpj.ü\n").to_string(), r"a\u{1b}[2J\u{202e}gpj.ü\n");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct OneLine<T>(pub T);

/// Whether a terminal or a reader of lines interprets `c`: C0, C1 and DEL, marks of direction, separators of lines.
#[must_use]
pub fn is_obeyed(c: char) -> bool {
    let directs = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2066}'..='\u{2069}');
    // The separators of lines and paragraphs and five marks of direction.
    c.is_control() || directs || matches!(c, '\u{2028}'..='\u{202e}')
}

impl<T: Display> Display for OneLine<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.to_string().chars().try_for_each(|c| match is_obeyed(c) {
            true => write!(f, "{}", c.escape_default()),
            false => f.write_char(c),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_escaped_and_nothing_else() {
        let obeyed = "\0\t\n\r\x1b\x7f\u{80}\u{85}\u{9b}\u{61c}\u{200e}\u{200f}\u{2028}\u{2029}\
                      \u{202a}\u{202e}\u{2066}\u{2069}";
        for c in obeyed.chars() {
            let line = OneLine(format!("a{c}b")).to_string();
            assert!(line.starts_with("a\\") && !line.contains(c), "{line}");
            assert_eq!(OneLine(&line).to_string(), line);
        }
        let kept = "b/ü d.webp 'x' \"y\" \\ 画像 \u{2027}\u{202f}\u{2065}\u{206a}";
        assert_eq!(OneLine(kept).to_string(), kept);
    }
}
