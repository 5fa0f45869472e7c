//! VisualSFM's NVM, version 3: a line per camera, a line per point, in one or more models of which the first is the map.

use std::path::Path;

use super::found::{DOWNWARD, Found, camera};
use crate::error::Error;
use crate::read::lines::{Lines, number, quoted, words};
use crate::read::undeclared::undeclared;

/// The next line that is not blank, as a count.
fn count(lines: &mut Lines, what: &str) -> Result<u64, Error> {
    if !lines.advance_to_data()? {
        return Err(lines.end_error(what));
    }
    number(lines.line()).ok_or_else(|| lines.error(what, quoted(lines.line())))
}

/// Numbers from word `first` on.
fn numbers<const N: usize>(lines: &Lines, first: usize, what: &str) -> Result<[f64; N], Error> {
    let mut values = [0.0; N];
    let mut words = words(lines.line()).skip(first);
    for value in &mut values {
        let word = words.next().ok_or_else(|| lines.error(what, "end of line"))?;
        *value = number(word).ok_or_else(|| lines.error(what, quoted(word)))?;
    }
    Ok(values)
}

/// The rotation of a quaternion (w, x, y, z).
fn rotation([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    let norm2 = w * w + x * x + y * y + z * z;
    let rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ];
    rows.map(|row| row.map(|value| value / norm2))
}

/// Reads points and cameras of the first model.
///
/// # Errors
/// When the file is not NVM, or a coordinate is not finite.
pub fn read(path: &Path) -> Result<Found, Error> {
    let mut lines = Lines::open(path)?;
    let is_nvm = lines.advance_to_data()? && lines.line().starts_with(b"NVM_V3");
    if !is_nvm {
        return Err(lines.error("NVM_V3, as VisualSFM writes it", quoted(lines.line())));
    }
    let mut found = Found::default();
    let n_cameras = count(&mut lines, "a number of cameras")?;
    for at in 0..n_cameras {
        let what = format!("camera {at}: name, focal length, quaternion and center");
        if !lines.advance()? {
            return Err(lines.end_error(what));
        }
        let values = numbers::<7>(&lines, 2, &what)?;
        let [w, x, y, z, center @ ..] = values;
        // The pose is a rotation and the center itself.
        match camera(&rotation([w, x, y, z]), &[0.0; 3], DOWNWARD) {
            Some((_, up)) if center.iter().all(|x| x.is_finite()) => {
                found.cameras.push(center);
                found.up.push(up);
            }
            _ => {
                return Err(
                    lines.error(format!("a finite pose of camera {at}"), format!("{values:?}"))
                );
            }
        }
    }
    let n_points = count(&mut lines, "a number of points")?;
    for at in 0..n_points {
        let what = format!("3 coordinates of point {at}");
        if !lines.advance()? {
            return Err(lines.end_error(what));
        }
        let position = numbers::<3>(&lines, 0, &what)?;
        if position.iter().any(|x| !x.is_finite()) {
            return Err(
                lines.error(format!("finite coordinates of point {at}"), format!("{position:?}"))
            );
        }
        found.positions.push(position);
    }
    // A count of cameras begins another model, and a zero ends the list of them.
    let mut more = 0;
    while lines.advance_to_data()? {
        if let Some(n) = number::<u64>(lines.line()) {
            found.notes.extend((n > 0).then(|| "read, the first of several models".to_owned()));
            break;
        }
        more += 1;
    }
    found.doubts.extend(undeclared(n_points, more));
    Ok(found)
}
