//! Small text files: splits and poses.

use std::fs;
use std::io::Read;
use std::path::Path;

use unlift_io::{Error, Place, input};

/// Maximum size in bytes; files of the datasets have less than a tenth.
const LONGEST: u64 = 16 << 20;

/// Returns the trimmed lines of a file with their numbers, from 1, without blank lines.
///
/// # Errors
/// If it cannot be read, is not text, or is too long.
pub fn lines(path: &Path) -> Result<Vec<(u64, String)>, Error> {
    let (file, len) = input::open(path)?;
    if len > LONGEST {
        let expected = format!("a list of at most {}", input::size(LONGEST));
        return Err(Error::new(path, "", expected, input::size(len)));
    }
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes).map_err(|source| Error::read(path, source))?;
    let text = String::from_utf8(bytes);
    let text = text.map_err(|_| Error::new(path, "", "text in UTF-8", "another encoding"))?;
    let lines = text.lines().zip(1..).map(|(line, number)| (number, line.trim().to_owned()));
    Ok(lines.filter(|(_, line)| !line.is_empty()).collect())
}

/// Returns an error about a line.
pub fn wrong(path: &Path, line: u64, expected: &str, found: &str) -> Error {
    const MOST: usize = 40;
    let cut: String = found.chars().take(MOST).collect();
    let dots = if cut.len() < found.len() { "..." } else { "" };
    Error::new(path, Place::Line(line), expected, format!("\"{cut}{dots}\""))
}

/// Lists the files in `folder` whose names end in `ending`, sorted.
///
/// # Errors
/// If the folder cannot be read.
pub fn files(folder: &Path, ending: &str) -> Result<Vec<String>, Error> {
    let failed = |source| Error::read(folder, source);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        // Names in the datasets are valid UTF-8.
        if let Ok(name) = entry.map_err(failed)?.file_name().into_string()
            && name.ends_with(ending)
        {
            names.push(name);
        }
    }
    names.sort_unstable();
    Ok(names)
}
