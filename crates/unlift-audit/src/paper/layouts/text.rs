//! Small files of text: splits and poses.

use std::fs;
use std::io::Read;
use std::path::Path;

use unlift_io::{Error, Place, input};

/// Bytes of such a file at most; those of the datasets have less than a tenth of it.
const LONGEST: u64 = 16 << 20;

/// The lines of a file with their numbers, from 1, without the space around them; blank ones are left out.
///
/// # Errors
/// When it cannot be read, is no text, or is longer than such files are.
pub fn lines(path: &Path) -> Result<Vec<(u64, String)>, Error> {
    let (file, len) = input::open(path)?;
    if len > LONGEST {
        let expected = format!("a list of at most {}", input::size(LONGEST));
        return Err(Error::new(path, "", expected, input::size(len)));
    }
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes).map_err(|source| Error::read(path, source))?;
    let text = String::from_utf8(bytes);
    let text = text.map_err(|_| Error::new(path, "", "text", "bytes that are no text"))?;
    let lines = text.lines().zip(1..).map(|(line, number)| (number, line.trim().to_owned()));
    Ok(lines.filter(|(_, line)| !line.is_empty()).collect())
}

/// An error in a line.
pub fn wrong(path: &Path, line: u64, expected: &str, found: &str) -> Error {
    /// Characters of what was found at most.
    const MOST: usize = 40;
    let cut: String = found.chars().take(MOST).collect();
    let dots = if cut.len() < found.len() { "..." } else { "" };
    Error::new(path, Place::Line(line), expected, format!("\"{cut}{dots}\""))
}

/// Names of the files in `folder` that end in `ending`, sorted.
///
/// # Errors
/// When the folder cannot be read.
pub fn files(folder: &Path, ending: &str) -> Result<Vec<String>, Error> {
    let failed = |source| Error::read(folder, source);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        // A name that is no text is none of the dataset's.
        if let Ok(name) = entry.map_err(failed)?.file_name().into_string()
            && name.ends_with(ending)
        {
            names.push(name);
        }
    }
    names.sort_unstable();
    Ok(names)
}
