//! Checks the footer of a Parquet file first, because the `parquet` crate recurses and allocates as
//! it declares.

use super::thrift::{Field, Walk, Wrong};
use crate::Error;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// A list of numbers has three levels.
const DEEPEST: usize = 32;
/// Two elements for a column, four for a column of lists.
const MOST_ELEMENTS: u64 = 1 << 16;
/// The number of row groups that Parquet can count.
const MOST_GROUPS: u64 = 1 << 15;
/// The length of the footer, and `PAR1`.
const TAIL: u64 = 8;

/// Checks the footer of the Parquet file `path` of `n_bytes` bytes.
pub(super) fn check(path: &Path, file: &mut File, n_bytes: u64) -> Result<(), Error> {
    let failed = |source| Error::read(path, source);
    let mut tail = [0; TAIL as usize];
    file.seek(SeekFrom::End(-(TAIL as i64))).map_err(failed)?;
    file.read_exact(&mut tail).map_err(failed)?;
    let length = u64::from(u32::from_le_bytes([tail[0], tail[1], tail[2], tail[3]]));
    let most = n_bytes.saturating_sub(TAIL);
    if length > most {
        let expected = format!("at most {most} bytes, by the size of the file");
        return Err(Error::new(path, "footer", expected, length.to_string()));
    }
    file.seek(SeekFrom::Start(most - length)).map_err(failed)?;
    let mut footer = vec![0; length as usize];
    file.read_exact(&mut footer).map_err(failed)?;
    let wrong = |wrong: Wrong| Error::new(path, "footer", "metadata of Parquet", wrong.found());
    walk(&footer).map_err(wrong)
}

/// Checks `FileMetaData` of the Parquet format.
fn walk(footer: &[u8]) -> Result<(), Wrong> {
    Walk::new(footer).fields(|walk, (id, kind)| {
        match id {
            2 => {
                let n = walk.structs(kind, MOST_ELEMENTS, "elements of the schema")?;
                schema(walk, n)?;
            }
            4 => {
                for _ in 0..walk.structs(kind, MOST_GROUPS, "row groups")? {
                    walk.fields(row_group)?;
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    })
}

fn row_group(walk: &mut Walk<'_>, (id, kind): Field) -> Result<bool, Wrong> {
    if id == 1 {
        let n = walk.structs(kind, MOST_ELEMENTS, "columns of a row group")?;
        (0..n).try_for_each(|_| column(walk))?;
    }
    Ok(id == 1)
}

/// Checks a column of a row group. A real one has a few dozen bytes; a shorter one would take far
/// more memory than it has bytes.
fn column(walk: &mut Walk<'_>) -> Result<(), Wrong> {
    const LEAST: usize = 16;
    let before = walk.remaining();
    walk.fields(|_, _| Ok(false))?;
    if before - walk.remaining() < LEAST {
        return Err(Wrong::Content("a column of a row group without content".to_owned()));
    }
    Ok(())
}

/// Checks the schema: a tree of `n` elements in depth-first order.
fn schema(walk: &mut Walk<'_>, n: u64) -> Result<(), Wrong> {
    // The number of missing children of each open element.
    let mut open: Vec<u64> = Vec::new();
    for at in 0..n {
        let mut children = 0;
        walk.fields(|walk, (id, kind)| {
            if id == 5 {
                children = walk.integer(kind)?;
            }
            Ok(id == 5)
        })?;
        if let Some(left) = open.last_mut() {
            *left -= 1;
        }
        let left = n - at - 1;
        match u64::try_from(children) {
            Ok(0) => {}
            Ok(children) if children <= left => open.push(children),
            _ => {
                let found = format!(
                    "a schema element with {children} children where {left} elements follow"
                );
                return Err(Wrong::Content(found));
            }
        }
        if open.len() > DEEPEST {
            return Err(Wrong::Content(format!("columns nested more than {DEEPEST} deep")));
        }
        while open.last() == Some(&0) {
            open.pop();
        }
    }
    Ok(())
}
