//! Reads text tables with a point per line.

use std::path::Path;

use super::lines::{Lines, TELLING, axes, coordinate, is_called, number, plain, quoted, words};
use super::map_input::Input;
use crate::error::Error;

/// The byte between values, or `None` for any run of spaces and tabs. The first line decides it for the whole file.
type Separator = Option<u8>;

fn separator_of(line: &[u8]) -> Separator {
    [b';', b','].into_iter().find(|byte| line.contains(byte))
}

/// Returns the separator of a header line. A tab is one, because names may contain spaces and fields may be empty.
fn separator_of_header(line: &[u8]) -> Separator {
    separator_of(line).or_else(|| line.contains(&b'\t').then_some(b'\t'))
}

fn split(line: &[u8], separator: Separator) -> Vec<&[u8]> {
    match separator {
        None => words(line).collect(),
        Some(byte) => line.split(|&b| b == byte).map(<[u8]>::trim_ascii).collect(),
    }
}

/// The maximum number of bytes of comments that are searched for names.
const COMMENTS: usize = 1 << 16;
/// Columns before the tracks in COLMAP's points.
const COLMAP_COLUMNS: usize = 8;

/// Reads positions from lines of numbers separated by commas, semicolons, spaces or tabs. Returns
/// `None` for the points of a COLMAP model in text.
///
/// The first three columns are x, y and z, unless the first line or a comment (`#` or `//`) before
/// it names columns `x`, `y` and `z` (in either case). A line of one number before points is their
/// count, as in Leica's PTS and in CloudCompare. Rows that are camera poses or begin with the row number are an error.
pub fn read(path: &Path) -> Result<Option<Input>, Error> {
    let mut lines = Lines::open(path)?;
    let mut positions = Vec::new();
    let mut comments: Vec<Vec<u8>> = Vec::new();
    let mut format: Option<(Separator, Columns)> = None;
    let mut announced: Option<(u64, u64)> = None;
    let mut form = Form::OF_NO_ROWS;
    while lines.advance()? {
        let line = lines.line();
        if let Some(comment) = line.strip_prefix(b"#").or_else(|| line.strip_prefix(b"//")) {
            let size: usize = comments.iter().map(Vec::len).sum();
            if format.is_none() && size + comment.len() <= COMMENTS {
                comments.push(comment.trim_ascii().to_vec());
            }
            continue;
        }
        // Spreadsheets write their separator into a line before the header.
        let names_separator = format.is_none() && line.to_ascii_lowercase().starts_with(b"sep=");
        if line.is_empty() || names_separator {
            continue;
        }
        let counts = positions.is_empty() || announced.is_some();
        if let (Some(n), true, None | Some((None, _))) = (number(line), counts, &format) {
            check_count(&lines, announced, positions.len() as u64)?;
            announced = Some((n, positions.len() as u64));
            continue;
        }
        if format.is_none() {
            let separator = separator_of_header(line);
            let names = split(lines.untrimmed(), separator);
            if names.len() > 1 && names.iter().all(|name| number::<f64>(name).is_none()) {
                format = Some((separator, Columns::of_header(&lines, &names)?));
                continue;
            }
        }
        let (separator, columns) = match &format {
            Some(format) => format,
            None => {
                let separator = separator_of(line);
                let n = split(lines.untrimmed(), separator).len();
                if comments.iter().any(|comment| is_colmap_header(comment)) {
                    return Ok(None);
                }
                &*format.insert((separator, Columns::of_comments(&lines, &comments, n)?))
            }
        };
        let fields = split(lines.untrimmed(), *separator);
        let mut position = [0.0_f64; 3];
        for ((value, &column), name) in position.iter_mut().zip(&columns.at).zip(["x", "y", "z"]) {
            let Some(field) = fields.get(column) else {
                let expected = match columns.named {
                    true => format!("{} columns up to {name}", column + 1),
                    false => "3 coordinates".to_owned(),
                };
                return Err(lines.error(expected, fields.len()));
            };
            *value = coordinate(field)
                .ok_or_else(|| lines.error(format!("a number for {name}"), quoted(field)))?;
        }
        if !columns.named {
            form.look(&fields, positions.len());
        }
        positions.push(position);
    }
    check_count(&lines, announced, positions.len() as u64)?;
    if let Some((expected, found)) = form.refusal() {
        return Err(Error::new(path, "", expected, found));
    }
    if form.is_colmap() {
        return Ok(None);
    }
    let doubts = format.and_then(|(_, columns)| columns.doubt).into_iter().collect();
    Ok(Some(Input { positions, format: "table", doubts, ..Input::default() }))
}

fn check_count(lines: &Lines, announced: Option<(u64, u64)>, n: u64) -> Result<(), Error> {
    match announced {
        Some((of, before)) if n - before != of => {
            let expected = format!("{of} points, as declared in the line before them");
            Err(lines.error(expected, format!("{} up to here", n - before)))
        }
        _ => Ok(()),
    }
}

struct Columns {
    at: [usize; 3],
    named: bool,
    doubt: Option<String>,
}

const FIRST: Columns = Columns { at: [0, 1, 2], named: false, doubt: None };

impl Columns {
    fn of_header(lines: &Lines, names: &[&[u8]]) -> Result<Self, Error> {
        let at = axes(names.iter().copied()).ok_or_else(|| {
            let found = of_poses(names).unwrap_or_else(|| quoted(lines.line()));
            lines.error("numbers, or columns named x, y and z", found)
        })?;
        Ok(Self { at, named: true, ..FIRST })
    }

    /// Finds the columns by a comment that names the `n` columns of the first point: the last
    /// comment with x, y and z, else one with `n` words.
    fn of_comments(lines: &Lines, comments: &[Vec<u8>], n: usize) -> Result<Self, Error> {
        let refuse = |expected: &str, comment: &[u8], names: &[&[u8]]| {
            Err(lines.error(expected, of_poses(names).unwrap_or_else(|| quoted(comment))))
        };
        let mut last_naming = None;
        for comment in comments.iter().rev() {
            let names = names(comment, n);
            if let Some(at) = axes(names.iter().copied()) {
                // Prose may mention x, y and z. With three columns they are the first three.
                return match names.len() {
                    len if len == n || at == FIRST.at => Ok(Self { at, named: true, ..FIRST }),
                    _ if n == 3 => Ok(FIRST),
                    len => {
                        refuse(&format!("{len} columns, as a comment names them"), comment, &names)
                    }
                };
            }
            let known = names.iter().filter(|name| is_quantity(name)).count();
            let is_naming = names.len() == n && n >= 3 && names.iter().all(|name| is_name(name));
            if is_naming || of_poses(&names).is_some() || known >= names.len().div_ceil(2).max(2) {
                last_naming.get_or_insert((comment, names));
            }
        }
        match last_naming {
            None => Ok(FIRST),
            Some((comment, names)) if !names.iter().any(|name| is_quantity(name)) => {
                let what = quoted(comment);
                let doubt = format!(
                    "columns: the first three are read as x, y and z, because the comment {what} has no known names"
                );
                Ok(Self { doubt: Some(doubt), ..FIRST })
            }
            Some((comment, names)) => refuse("columns named x, y and z", comment, &names),
        }
    }
}

/// Splits a comment into names of columns, without text before a colon and units in brackets.
fn names(comment: &[u8], n: usize) -> Vec<&[u8]> {
    let start = comment.iter().rposition(|&byte| byte == b':').map_or(0, |at| at + 1);
    let list = comment[start..].trim_ascii();
    let parts = split(list, separator_of_header(list));
    if parts.len() == n && parts.iter().all(|part| !part.is_empty()) {
        return parts.into_iter().map(plain).collect();
    }
    let words = list.split(|byte| byte.is_ascii_whitespace() || b",;".contains(byte));
    words.filter(|word| !word.is_empty() && !b"[(".contains(&word[0])).map(plain).collect()
}

fn is_name(word: &[u8]) -> bool {
    let joins =
        |byte: &u8| byte.is_ascii_alphanumeric() || b"_-./ ".contains(byte) || *byte >= 0x80;
    number::<f64>(word).is_none() && word.iter().all(joins)
}

/// Returns true if a column with this name is certainly not a coordinate along an axis.
fn is_quantity(name: &[u8]) -> bool {
    const NAMES: &str = "alpha class confidence error frame intensity label name point_id qx reflectance tx \
                         lat latitude lon lng long longitude r g b red green blue range azimuth elevation theta \
                         phi rho id index t time timestamp u v row col nx ny nz";
    NAMES.split(' ').any(|known| is_called(name, known.as_bytes()))
}

fn of_poses(names: &[&[u8]]) -> Option<String> {
    let has = |starts: [&str; 2]| {
        names.iter().any(|name| {
            let name = name.to_ascii_lowercase();
            starts.iter().any(|start| name.starts_with(start.as_bytes()))
        })
    };
    (has(["qw", "q_"]) || (has(["qx", "q_"]) && has(["tx", "t_"]))).then(|| POSES.to_owned())
}

const POSES: &str = "a trajectory, poses of cameras";

/// Returns true if the first row has three coordinates, and is no cut row of COLMAP (id and two).
pub(super) fn has_three_columns(path: &Path) -> Result<bool, Error> {
    let mut lines = Lines::open(path)?;
    if !lines.advance_to_data()? {
        return Ok(false);
    }
    let separator = separator_of(lines.line());
    let fields = split(lines.line(), separator);
    let begins_with_id = separator.is_none() && number::<u64>(fields[0]).is_some();
    Ok(fields.len() == 3 && !begins_with_id)
}

fn is_colmap_header(comment: &[u8]) -> bool {
    let comment = comment.to_ascii_uppercase();
    let has = |word: &[u8]| comment.windows(word.len()).any(|part| part == word);
    has(b"POINT3D_ID") && has(b"TRACK")
}

/// Properties that hold for all rows so far.
struct Form {
    n: usize,
    /// COLMAP's points: an id, a position, a color, an error, a track.
    colmap: bool,
    has_track: bool,
    ascending: bool,
    /// A trajectory: a time, a position and a unit quaternion, or the three rows of a rotation and a position.
    pose: bool,
    time: f64,
    /// The first value is the row number, counted from 0 or from 1.
    numbered: [bool; 2],
}

impl Form {
    const OF_NO_ROWS: Self = Self {
        n: 0,
        colmap: true,
        has_track: false,
        ascending: true,
        pose: true,
        time: f64::NEG_INFINITY,
        numbered: [true; 2],
    };

    fn look(&mut self, fields: &[&[u8]], row: usize) {
        self.n = row + 1;
        let first = fields.first().and_then(|word| number::<f64>(word)).unwrap_or(f64::NAN);
        self.ascending &= first > self.time;
        self.time = first;
        for (from, numbered) in self.numbered.iter_mut().enumerate() {
            *numbered &= fields.len() > 3 && first == (row + from) as f64;
        }
        if self.colmap {
            let is_whole = |word: &&[u8]| number::<u64>(word).is_some();
            let is_byte = |word: &&[u8]| number::<u8>(word).is_some();
            let track = fields.get(COLMAP_COLUMNS..).unwrap_or_default();
            self.has_track |= !track.is_empty();
            self.colmap = fields.len() >= COLMAP_COLUMNS
                && is_whole(&fields[0])
                && fields[4..7].iter().all(is_byte)
                && number::<f64>(fields[7]).is_some_and(|error| error >= 0.0 || error == -1.0)
                && track.len().is_multiple_of(2)
                && track.iter().all(is_whole);
        }
        if self.pose {
            let numbers: Vec<f64> =
                fields.iter().take(13).filter_map(|word| number(word)).collect();
            let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
            let is_one = |square: f64| (square - 1.0).abs() < 1e-2;
            self.pose = match numbers[..] {
                [_, _, _, _, ref q @ ..] if q.len() == 4 && fields.len() == 8 => {
                    self.ascending && is_one(square(q))
                }
                ref rows if rows.len() == 12 && fields.len() == 12 => {
                    rows.chunks(4).all(|row| is_one(square(&row[..3])))
                }
                _ => false,
            };
        }
    }

    /// Returns true if rows are COLMAP's points: with tracks, or at least with ascending ids.
    fn is_colmap(&self) -> bool {
        self.n > 0 && self.colmap && (self.has_track || self.ascending)
    }

    /// Returns the expected and the found text if rows are not points.
    fn refusal(&self) -> Option<(&'static str, &'static str)> {
        if self.pose && self.n > 1 {
            return Some(("points", POSES));
        }
        let numbered = self.n >= TELLING && self.numbered.contains(&true) && !self.colmap;
        numbered.then_some((
            "x, y and z first, or a line that names the columns",
            "the row number in the first column",
        ))
    }
}
