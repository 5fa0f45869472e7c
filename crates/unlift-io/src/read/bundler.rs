//! Reads Bundler's `bundle.out`: a line with counts, five lines per camera, three per point.

use std::path::Path;

use super::lines::{Lines, coordinate, number, quoted, words};
use super::map_input::{Input, center, undeclared};
use crate::error::Error;

fn numbers<const N: usize>(lines: &Lines, what: &str) -> Result<[f64; N], Error> {
    let mut values = [0.0; N];
    let mut words = words(lines.line());
    for (at, value) in values.iter_mut().enumerate() {
        let word = words.next();
        let word =
            word.ok_or_else(|| lines.error(format!("{N} numbers of {what}"), at.to_string()))?;
        *value = coordinate(word)
            .ok_or_else(|| lines.error(format!("a number of {what}"), quoted(word)))?;
    }
    Ok(values)
}

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
        lines.expect_data(&what)?;
        let [focal, ..] = numbers::<3>(&lines, &what)?;
        let mut rotation = [[0.0; 3]; 3];
        for row in &mut rotation {
            lines.expect_data(&what)?;
            *row = numbers(&lines, &what)?;
        }
        lines.expect_data(&what)?;
        let translation = numbers(&lines, &what)?;
        // A focal length of zero marks photos that were not registered. The y axis points up.
        input.camera((focal != 0.0).then(|| (center(&rotation, &translation), rotation[1])));
    }
    for at in 0..*n_points {
        let what = format!("point {at}");
        lines.expect_data(&what)?;
        input.positions.push(numbers(&lines, &what)?);
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
