//! Messages on stderr: one line each, and lost where nobody can hear them.

use std::fmt::Display;
use std::io::{self, Write};

use unlift::OneLine;

/// Characters of a line at most: what is found in a file may be all of it.
const LONGEST: usize = 2000;

/// Tells `line`, whatever text of others is in it. Where stderr cannot be written (a full disk, a closed pipe) the line
/// is lost and the work goes on: its result is elsewhere.
pub fn tell(line: impl Display) {
    let mut line = OneLine(line).to_string();
    if let Some((end, _)) = line.char_indices().nth(LONGEST) {
        line.truncate(end);
        line.push_str(" ..");
    }
    line.push('\n');
    // In one piece: other threads tell lines, too.
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

/// Tells what a user should know about a result.
pub fn note(text: impl Display) {
    tell(format_args!("unlift: note: {text}"));
}
