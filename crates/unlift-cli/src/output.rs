//! Results on stdout, and nothing else there.

use std::io::{self, Write};

/// Prints `text`. A reader that closes the pipe early (`| head`) ends the output, not the program.
///
/// # Errors
/// When stdout cannot be written for another reason.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Rows of text with columns as wide as their widest cell, two spaces apart; the first column is
/// left-aligned, as are those in `left`.
pub fn table(rows: &[Vec<String>], left: &[usize]) -> String {
    let n_columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| {
        rows.iter().filter_map(|row| row.get(c)).map(|s| s.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..n_columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (c, cell) in row.iter().enumerate() {
            if c > 0 {
                line.push_str("  ");
            }
            let pad = " ".repeat(widths[c] - cell.chars().count());
            if c == 0 || left.contains(&c) {
                line.push_str(cell);
                line.push_str(&pad);
            } else {
                line.push_str(&pad);
                line.push_str(cell);
            }
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// The command line as a shell would need it, for the record.
pub fn command_line() -> String {
    let words = std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy()));
    ["unlift".to_owned()].into_iter().chain(words).collect::<Vec<_>>().join(" ")
}

/// A word of the command line as a shell would need it.
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
    fn columns_line_up() {
        let row = |cells: [&str; 3]| cells.map(str::to_owned).to_vec();
        let rows = [row(["scheme", "10 cm", "note"]), row(["ppl+", "9.5", "x"])];
        assert_eq!(table(&rows, &[2]), "scheme  10 cm  note\nppl+      9.5  x\n");
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("ppl@0.5:0.10"), "ppl@0.5:0.10");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's<=1"), r"'it'\''s<=1'");
    }
}
