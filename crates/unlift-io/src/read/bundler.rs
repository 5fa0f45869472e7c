//! Reads Bundler's `bundle.out`: a line with counts, five lines per camera, three per point.

use std::path::Path;

use super::lines::{Lines, coordinates, number, quoted, words};
use super::map_input::{Input, center, undeclared};
use crate::error::Error;

/// Reads the next line of three numbers.
fn row(lines: &mut Lines, what: &str) -> Result<[f64; 3], Error> {
    lines.expect_data(what)?;
    coordinates(lines, &mut words(lines.line()), what)
}

/// Reads points and cameras.
pub fn read(path: &Path) -> Result<Input, Error> {
    let mut lines = Lines::open(path)?;
    lines.expect_data("numbers of cameras and points")?;
    let counts = words(lines.line()).map(number::<u64>).collect::<Option<Vec<_>>>();
    let Some([n_cameras, n_points]) = counts.as_deref() else {
        let found = quoted(lines.line());
        return Err(lines.error("numbers of cameras and points, as Bundler writes them", found));
    };
    let mut input = Input { format: "Bundler", ..Input::default() };
    for at in 0..*n_cameras {
        let what = format!("camera {at}");
        let [focal, ..] = row(&mut lines, &what)?;
        let mut rotation = [[0.0; 3]; 3];
        for its_row in &mut rotation {
            *its_row = row(&mut lines, &what)?;
        }
        let translation = row(&mut lines, &what)?;
        // A focal length of zero marks photos that were not registered. The y axis points up.
        input.camera((focal != 0.0).then(|| (center(&rotation, &translation), rotation[1])));
    }
    for at in 0..*n_points {
        let what = format!("point {at}");
        input.positions.push(row(&mut lines, &what)?);
        lines.expect_data(&format!("the color of {what}"))?;
        lines.expect_data(&format!("the views of {what}"))?;
    }
    let mut more = 0;
    while lines.advance_to_data()? {
        more += 1;
    }
    // A point has three lines.
    input.doubts.extend(undeclared(*n_points, more / 3));
    Ok(input)
}
