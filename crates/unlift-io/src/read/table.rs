//! CSV and XYZ: a point per line.

use std::path::Path;

use crate::error::Error;
use crate::read::lines::{Lines, number, quoted, words};

/// What stands between the values of a line; decided by the first line for the whole file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Byte(u8),
    /// Any run of spaces and tabs.
    Space,
}

impl Separator {
    fn of(line: &[u8]) -> Self {
        [b';', b','].into_iter().find(|byte| line.contains(byte)).map_or(Self::Space, Self::Byte)
    }

    /// The separator of a header line: names may hold spaces and fields may be empty, so that a tab counts.
    fn of_header(line: &[u8]) -> Self {
        match Self::of(line) {
            Self::Space if line.contains(&b'\t') => Self::Byte(b'\t'),
            separator => separator,
        }
    }

    fn split(self, line: &[u8]) -> Vec<&[u8]> {
        match self {
            Self::Space => words(line).collect(),
            Self::Byte(byte) => line.split(|&b| b == byte).map(<[u8]>::trim_ascii).collect(),
        }
    }
}

/// Reads positions `(n, 3)` from lines of numbers between commas, semicolons, spaces or tabs.
///
/// The first three columns are x, y and z, unless the first line names its columns: then those called
/// `x`, `y` and `z` (in either case). Other columns are ignored, and so are blank lines and lines that begin
/// with `#` or `//`.
///
/// # Errors
/// When the file cannot be read or a line does not hold three finite numbers.
pub fn read(path: &Path) -> Result<Vec<[f64; 3]>, Error> {
    let mut lines = Lines::open(path)?;
    let mut positions = Vec::new();
    let mut columns = [0, 1, 2];
    let mut named = false;
    let mut separator = None;
    while lines.advance_to_data()? {
        if lines.line().starts_with(b"//") {
            continue;
        }
        if separator.is_none() {
            let fields = Separator::of_header(lines.line()).split(lines.untrimmed());
            if fields.iter().all(|field| number::<f64>(field).is_none()) && fields.len() > 1 {
                separator = Some(Separator::of_header(lines.line()));
                columns = named_columns(&lines, &fields)?;
                named = true;
                continue;
            }
        }
        let separator = *separator.get_or_insert_with(|| Separator::of(lines.line()));
        let fields = separator.split(lines.untrimmed());
        let mut position = [0.0_f64; 3];
        for ((value, column), name) in position.iter_mut().zip(columns).zip(["x", "y", "z"]) {
            let Some(field) = fields.get(column) else {
                let found = fields.len().to_string();
                return Err(if named {
                    lines.error(format!("{} columns up to {name}", column + 1), found)
                } else {
                    lines.error("3 coordinates", found)
                });
            };
            *value = number(field)
                .ok_or_else(|| lines.error(format!("a number for {name}"), quoted(field)))?;
        }
        if position.iter().any(|x| !x.is_finite()) {
            let expected = format!("finite coordinates of point {}", positions.len());
            return Err(lines.error(expected, format!("{position:?}")));
        }
        positions.push(position);
    }
    Ok(positions)
}

fn named_columns(lines: &Lines, names: &[&[u8]]) -> Result<[usize; 3], Error> {
    let find = |wanted: &str| {
        names.iter().position(|name| {
            let name = name.strip_prefix(b"\"").unwrap_or(name);
            let name = name.strip_suffix(b"\"").unwrap_or(name);
            name.eq_ignore_ascii_case(wanted.as_bytes())
        })
    };
    match (find("x"), find("y"), find("z")) {
        (Some(x), Some(y), Some(z)) => Ok([x, y, z]),
        _ => Err(lines.error("numbers, or columns named x, y and z", quoted(lines.line()))),
    }
}
