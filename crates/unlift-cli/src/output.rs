//! Prints results on stdout, and messages on stderr, one line each.

use std::fmt::Display;
use std::io::{self, Write};

use unlift::{OneLine, is_obeyed};

/// Prints `text`, lines or JSON. If the reader closes the pipe early (`| head`), the rest is dropped without an error.
pub fn print(text: &str) -> crate::Result<()> {
    let text = harmless(text);
    let mut stdout = io::stdout().lock();
    printed(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

/// Converts the result of a write to stdout; a broken pipe is no error.
pub fn printed(result: io::Result<()>) -> crate::Result<()> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(unlift_io::Error::write("stdout", error).into())
        }
        _ => Ok(()),
    }
}

/// Maximum number of characters of a line on stderr, because a message may quote a whole file.
const LONGEST: usize = 2000;

/// Prints `line` on stderr with control characters escaped. If stderr cannot be written (a full disk, a
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

/// Escapes terminal control characters except newlines as JSON does. In JSON they occur only within strings, so no value changes.
fn harmless(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c != '\n' && is_obeyed(c) {
            true => out.push_str(&format!("\\u{:04x}", u32::from(c))),
            false => out.push(c),
        }
    }
    out
}

/// Formats rows as aligned columns, two spaces apart. The first column and those in `left` are left-aligned.
pub fn table(rows: &[Vec<String>], left: &[usize]) -> String {
    let shown = |row: &Vec<String>| row.iter().map(|cell| OneLine(cell).to_string()).collect();
    let rows: Vec<Vec<String>> = rows.iter().map(shown).collect();
    unlift_report::align(&rows, &[&[0], left].concat())
}

/// Returns the command line, quoted for a shell.
pub fn command_line() -> String {
    let words = crate::words().iter().skip(1).map(|word| quoted(&word.to_string_lossy()));
    ["unlift".to_owned()].into_iter().chain(words).collect::<Vec<_>>().join(" ")
}

/// Quotes a word for a shell if necessary.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:@+%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_and_names_are_cells_of_one_line() {
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let rows = [row(["scheme", "10 cm", "note"]), row(["a\n\x1b]", "9.5", "x"])];
        let lines = "scheme      10 cm  note\na\\n\\u{1b}]    9.5  x\n";
        assert_eq!(table(&rows, &[2]), lines);
    }

    #[test]
    fn json_says_the_same_without_what_a_terminal_obeys() {
        let value = serde_json::json!({ "\u{9b}2J": ["\u{202e}\n\x7f", "ü"] });
        let text = harmless(&format!("{value:#}\n"));
        assert!(text.chars().all(|c| c == '\n' || !is_obeyed(c)) && text.contains('ü'), "{text}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("ppl@0.5:0.10"), "ppl@0.5:0.10");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's<=1"), r"'it'\''s<=1'");
    }
}
