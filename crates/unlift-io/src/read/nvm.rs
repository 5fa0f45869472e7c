//! Reads VisualSFM's NVM, version 3: models with a line per camera and a line per point.

use std::path::Path;

use super::lines::{Lines, coordinates, number, quoted, words};
use super::map_input::{Input, pose_of, undeclared};
use crate::error::Error;

fn count(lines: &Lines, what: &str) -> Result<u64, Error> {
    number(lines.line()).ok_or_else(|| lines.error(what, quoted(lines.line())))
}

/// Parses the camera in the current line: its name, which may contain spaces, and ten numbers.
fn pose(lines: &Lines, what: &str) -> Result<([f64; 3], [f64; 3]), Error> {
    let all: Vec<&[u8]> = words(lines.line()).collect();
    let start = all.len().checked_sub(10).filter(|&start| start > 0);
    let start = start.ok_or_else(|| lines.error(what, format!("{} words", all.len())))?;
    let values = coordinates::<10>(lines, &mut all[start..].iter().copied(), what)?;
    // NVM stores the center itself.
    let [_focal, w, x, y, z, a, b, c, ..] = values;
    let down = pose_of([w, x, y, z], [0.0; 3]).rotation[1];
    Ok(([a, b, c], down.map(|value| -value)))
}

/// Reads points and cameras of the largest model.
pub fn read(path: &Path) -> Result<Input, Error> {
    let mut lines = Lines::open(path)?;
    // NVM_V3_R9T, with matrices instead of quaternions, is another format.
    let is_nvm = lines.advance_to_data()? && words(lines.line()).next() == Some(b"NVM_V3");
    if !is_nvm {
        return Err(lines.error("NVM_V3, as VisualSFM writes it", quoted(lines.line())));
    }
    let (mut largest, mut n_models, mut n_without) = (Input::default(), 0, 0);
    let mut more = 0;
    loop {
        if !lines.advance_to_data()? {
            // A zero ends the list of models; some programs omit it.
            if n_models + n_without == 0 {
                return Err(lines.end_error("a number of cameras"));
            }
            break;
        }
        let n_cameras = match count(&lines, "a number of cameras") {
            // A line that is no count is a point beyond the declared number.
            Err(_) if n_models + n_without > 0 => {
                more += 1;
                continue;
            }
            n_cameras => n_cameras?,
        };
        if n_cameras == 0 {
            break;
        }
        let model = model(&mut lines, n_cameras)?;
        if model.positions.is_empty() {
            n_without += n_cameras;
            continue;
        }
        n_models += 1;
        if model.positions.len() > largest.positions.len() {
            largest = model;
        }
    }
    largest.doubts.extend(undeclared(largest.positions.len() as u64, more));
    if n_models > 1 {
        let points = largest.positions.len();
        largest.notes.push(format!("read, the largest of {n_models} models ({points} points)"));
    }
    if n_without > 0 {
        largest.notes.push(format!("{n_without} photos without a pose"));
    }
    Ok(Input { format: "NVM", ..largest })
}

fn model(lines: &mut Lines, n_cameras: u64) -> Result<Input, Error> {
    let mut found = Input::default();
    for at in 0..n_cameras {
        let what = format!("camera {at}: name, focal length, quaternion, center, distortion and 0");
        lines.expect_line(&what)?;
        found.camera(Some(pose(lines, &what)?));
    }
    lines.expect_data("a number of points")?;
    for at in 0..count(lines, "a number of points")? {
        let what = format!("3 coordinates of point {at}");
        lines.expect_line(&what)?;
        found.positions.push(coordinates(lines, &mut words(lines.line()), &what)?);
    }
    Ok(found)
}
