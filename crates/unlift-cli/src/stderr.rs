//! Prints messages on stderr, one line each.

use std::fmt::Display;
use std::io::{self, Write};

use unlift::OneLine;

/// Maximum number of characters of a line, because a message may quote a whole file.
const LONGEST: usize = 2000;

/// Prints `line` with control characters escaped. If stderr cannot be written (a full disk, a
/// closed pipe), the line is lost and the work continues.
pub fn tell(line: impl Display) {
    let mut line = OneLine(line).to_string();
    if let Some((end, _)) = line.char_indices().nth(LONGEST) {
        line.truncate(end);
        line.push_str(" ..");
    }
    line.push('\n');
    // In one write, so that lines of several threads do not mix.
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

pub fn note(text: impl Display) {
    tell(format_args!("unlift: note: {text}"));
}
