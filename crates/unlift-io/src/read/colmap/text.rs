//! Reads COLMAP's text files.

use std::path::Path;

use super::camera_models::CameraModel;
use super::model::{Camera, Image, Points, Tracks, place};
use crate::error::Error;
use crate::read::columns::coordinates;
use crate::read::lines::{Lines, number, quoted, words};

fn next<'a, T: std::str::FromStr>(
    lines: &Lines,
    words: &mut impl Iterator<Item = &'a [u8]>,
    what: &str,
) -> Result<T, Error> {
    let word = words.next().ok_or_else(|| lines.error(what, "end of line"))?;
    number(word).ok_or_else(|| lines.error(what, quoted(word)))
}

pub fn cameras(path: &Path) -> Result<Vec<Camera>, Error> {
    let mut lines = Lines::open(path)?;
    let mut cameras = Vec::new();
    while lines.advance_to_data()? {
        let mut words = words(lines.line());
        let id = next(&lines, &mut words, "a camera id")?;
        let name = words.next().unwrap_or_default();
        let Some(model) = CameraModel::from_name(name) else {
            let expected = format!("a camera model of COLMAP for camera {id}");
            return Err(lines.error(expected, quoted(name)));
        };
        let width_px = next(&lines, &mut words, "a width in pixels")?;
        let height_px = next(&lines, &mut words, "a height in pixels")?;
        let params: Vec<f64> = words
            .map(|word| number(word).ok_or_else(|| lines.error("a parameter", quoted(word))))
            .collect::<Result<_, _>>()?;
        if params.len() != model.n_params {
            let expected = format!("{} parameters of {}", model.n_params, model.name);
            return Err(lines.error(expected, params.len().to_string()));
        }
        cameras.push(Camera { id, model, width_px, height_px, params });
    }
    Ok(cameras)
}

pub fn images(path: &Path) -> Result<Vec<Image>, Error> {
    let mut lines = Lines::open(path)?;
    let mut images = Vec::new();
    while lines.advance_to_data()? {
        let mut words = words(lines.line());
        let id = next(&lines, &mut words, "an image id")?;
        let rotation = coordinates(&lines, &mut words, "a rotation (4 numbers)")?;
        let translation = coordinates(&lines, &mut words, "a translation (3 numbers)")?;
        let (center, rotation) = place(rotation, translation);
        let camera_id = next(&lines, &mut words, "a camera id")?;
        drop(words);
        let name = after_words(lines.line(), 9).to_vec();
        if name.is_empty() {
            return Err(lines.error("an image name", "end of line"));
        }
        // The line of 2D points may be empty, and some tools omit it after the last image.
        let n_words = if lines.advance()? { self::words(lines.line()).count() } else { 0 };
        if !n_words.is_multiple_of(3) {
            let expected = "2D points of 3 numbers (x, y, point id)";
            return Err(lines.error(expected, format!("{n_words} numbers")));
        }
        images.push(Image {
            id,
            name,
            camera_id,
            center,
            rotation,
            n_points2d: n_words as u64 / 3,
        });
    }
    Ok(images)
}

/// Returns the rest of a line after `n` words. Names may contain spaces.
fn after_words(mut line: &[u8], n: usize) -> &[u8] {
    for _ in 0..n {
        let end = line.iter().position(u8::is_ascii_whitespace);
        line = line[end.unwrap_or(line.len())..].trim_ascii_start();
    }
    line
}

pub fn points(path: &Path, with_tracks: bool) -> Result<Points, Error> {
    let mut lines = Lines::open(path)?;
    let mut points = Points { tracks: with_tracks.then(Tracks::new), ..Points::default() };
    while lines.advance_to_data()? {
        let mut words = words(lines.line());
        let id: u64 = next(&lines, &mut words, "a point id")?;
        let position = coordinates::<3>(&lines, &mut words, "3 coordinates")?;
        let color = coordinates::<3>(&lines, &mut words, "a color (3 numbers)")?;
        coordinates::<1>(&lines, &mut words, "a reprojection error")?;
        if let Some(tracks) = &mut points.tracks {
            while let Some(word) = words.next() {
                let image_id =
                    number(word).ok_or_else(|| lines.error("an image id", quoted(word)))?;
                let index = next(&lines, &mut words, "the index of a 2D point")?;
                tracks.observations.push((image_id, index));
            }
            tracks.offsets.push(tracks.observations.len());
        } else {
            let n_words = words.count();
            if !n_words.is_multiple_of(2) {
                let expected = "observations of 2 numbers (image id, 2D point)";
                return Err(lines.error(expected, format!("{n_words} numbers")));
            }
        }
        points.ids.push(id);
        points.positions.push(position);
        // A cast saturates.
        points.colors.push(color.map(|x| x as u8));
    }
    Ok(points)
}

pub fn rigs(path: &Path) -> Result<u64, Error> {
    ids(path, "a rig id", "the number of sensors")
}

pub fn frames(path: &Path) -> Result<u64, Error> {
    ids(path, "a frame id", "a rig id")
}

fn ids(path: &Path, first: &str, second: &str) -> Result<u64, Error> {
    let mut lines = Lines::open(path)?;
    let mut n = 0;
    while lines.advance_to_data()? {
        let mut words = words(lines.line());
        next::<u32>(&lines, &mut words, first)?;
        next::<u32>(&lines, &mut words, second)?;
        n += 1;
    }
    Ok(n)
}

#[cfg(test)]
mod tests {
    use super::after_words;

    #[test]
    fn names_keep_their_spaces() {
        assert_eq!(after_words(b"1 2  a b.jpg", 2), b"a b.jpg");
        assert_eq!(after_words(b"1 2", 2), b"");
    }
}
