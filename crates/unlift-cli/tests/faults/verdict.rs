//! What is left after a fault: all of the new output, all of the old one, or what must never be.

use crate::bench::{Ended, Known};
use crate::commands::{Case, Writes};
use crate::tree::{Tree, is_part, is_partial};

/// What stands at the place of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// What stood there before, be it nothing.
    Before,
    /// The complete output.
    New,
    /// Some files of each, every one of them whole.
    Some,
}

/// What stands at the place of the output; an error names a file that is neither old nor new.
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

/// How a run ended that something failed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// With the whole output.
    Worked,
    /// With a line, and what stood there before.
    Told,
    /// With a line for each image that could not be used, and an output without these.
    FewerImages,
}

/// What must hold of a run that something failed for and that ended by itself: the whole output and code 0; or what
/// stood there before, a line, and a code that says so.
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

/// Whether a line is one that the program tells on purpose.
fn is_line(line: &str) -> bool {
    line.starts_with("unlift: ") || line.starts_with("  try: ")
}
