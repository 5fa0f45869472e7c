//! The state of the output after a fault: all new, all old, or an error.

use crate::bench::{Ended, Known};
use crate::commands::{Case, Writes};
use crate::tree::{Tree, is_part, is_partial};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// The earlier output, or nothing.
    Before,
    New,
    /// Some files of each, all complete.
    Some,
}

/// Returns the state of the output; an error names a file that is neither old nor new.
pub fn state(known: &Known, had_old: bool, left: &Tree) -> Result<State, String> {
    let none = Tree::default();
    let earlier = if had_old { &known.old } else { &none };
    let files = left.files_without(|name| is_partial(name) || is_part(name));
    let expected = |name: &str| [known.new.get(name), earlier.get(name)];
    let stray = files.names().find(|name| !expected(name).contains(&files.get(name)));
    if let Some(name) = stray {
        let n = files.get(name).map_or(0, <[u8]>::len);
        return Err(format!("{name}, {n} bytes, is neither the old nor the new one"));
    }
    let all = |tree: &Tree| tree.files_without(|_| false);
    Ok(match () {
        () if files == all(&known.new) => State::New,
        () if files == all(earlier) => State::Before,
        () => State::Some,
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// The new output is complete.
    Worked,
    /// An error, and the earlier output.
    Told,
    /// An error per unusable image, and an output without these images.
    FewerImages,
}

/// Checks a run with a fault that ended by itself: the complete output and code 0, or the earlier
/// output, an error and its code.
pub fn of_failure(
    case: &Case,
    known: &Known,
    had_old: bool,
    (ended, left): (&Ended, &Tree),
) -> Result<Found, String> {
    let rest = left.names().find(|name| is_partial(name));
    if let Some(name) = rest {
        return Err(format!("{name} is left"));
    }
    let is_fewer = |line: &str| line.contains(" images that can be ");
    if ended.code == Some(3) && ended.stderr.lines().last().is_some_and(is_fewer) {
        return Ok(Found::FewerImages);
    }
    let state = state(known, had_old, left)?;
    match ended.code {
        Some(0) if state == State::New => Ok(Found::Worked),
        Some(2 | 3) => {
            let is_told = !ended.stderr.is_empty() && ended.stderr.lines().all(is_line);
            let is_whole = match case.writes {
                Writes::Whole => state == State::Before,
                Writes::Nothing | Writes::Each => true,
            };
            match (is_told, is_whole) {
                (true, true) => Ok(Found::Told),
                (false, _) => Err("no line, or others than ours".to_owned()),
                (_, false) => Err(format!("it failed and left {state:?}")),
            }
        }
        _ => Err(format!("left {state:?}")),
    }
}

/// Returns true for a line that the program prints on purpose.
fn is_line(line: &str) -> bool {
    line.starts_with("unlift: ") || line.starts_with("  try: ")
}
