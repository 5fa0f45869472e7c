//! Feature images: what the inverter sees of places and descriptors.

use unlift::{Descriptors, Error};
use unlift_nn::Tensor;

/// Side of a cell in pixels.
pub const CELL: usize = 4;
/// Beside a descriptor's columns: the place inside the cell, and the weight.
const MORE: usize = 3;

/// Points of one image.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Where they are, `(n, 2)`, in pixels, the middle of the first one at (0, 0).
    pub places: &'a [[f32; 2]],
    /// Their descriptors, of any length.
    pub descriptors: &'a Descriptors,
    /// How much each is trusted, 0 to 1.
    pub weights: &'a [f32],
    /// How far from the camera each is, where that is known: then the nearest of a cell is taken in place of a mean.
    pub depths: Option<&'a [f32]>,
}

impl Points<'_> {
    /// # Errors
    /// When the columns differ in length.
    fn check(&self) -> Result<(), Error> {
        let n = self.places.len();
        let depths = self.depths.map_or(n, <[f32]>::len);
        for (what, rows) in [
            ("descriptors", self.descriptors.len()),
            ("weights", self.weights.len()),
            ("depths", depths),
        ] {
            if rows != n {
                return Err(Error::new(what, format!("{n}, one per point"), rows.to_string()));
            }
        }
        Ok(())
    }

    /// The cell of point `at` in an image of `size` cells of pixels; `None` outside, and without weight.
    fn cell(&self, at: usize, size: [usize; 2]) -> Option<([usize; 2], [f32; 2])> {
        // The corner of the first pixel at (0, 0), so that cells begin where pixels do.
        let place = self.places[at].map(|x| x + 0.5);
        let inside = (0..2).all(|c| place[c] >= 0.0 && place[c] < size[c] as f32);
        // Comparisons are false for what is not a number.
        let trusted = self.weights[at] > 0.0;
        if !inside || !trusted {
            return None;
        }
        let place = place.map(|x| x / CELL as f32);
        let cell = place.map(|x| x as usize);
        Some((cell, [0, 1].map(|c| 2.0 * (place[c] - cell[c] as f32) - 1.0)))
    }
}

/// As many pixels as a photo may have: a network holds a gigabyte for so many.
const MOST_PIXELS: usize = 1 << 24;

/// Refuses sizes that no picture has, as files may claim any.
pub(crate) fn check_size([width, height]: [usize; 2]) -> Result<(), Error> {
    let sides = 2..=1 << 24;
    if sides.contains(&width) && sides.contains(&height) && width * height <= MOST_PIXELS {
        return Ok(());
    }
    let found = format!("{width} x {height}");
    Err(Error::new("image size", "at least 2 x 2 and at most 16777216 pixels", found))
}

/// The feature image `(1, columns + 3, height, width)` of points in an image of `size` (width, height) pixels, in cells
/// of [`CELL`] pixels.
///
/// Channels: the descriptor (of unit length, times the root of its columns), the place inside the cell from -1 to 1,
/// the weight. Of several points in a cell the mean by weight, and the largest weight; the nearest one where depths are
/// known. Zero where no point is.
///
/// # Errors
/// When the columns of `points` differ in length, or a side has less than 2 pixels or the image more than 2^24.
pub fn feature_image(points: &Points<'_>, size: [usize; 2]) -> Result<Tensor, Error> {
    points.check()?;
    check_size(size)?;
    let columns = points.descriptors.dim();
    let [width, height] = size.map(|side| side.div_ceil(CELL));
    let plane = width * height;
    let mut values = vec![0.0; (columns + MORE) * plane];
    let mut total = vec![0.0_f32; plane];
    let mut nearest = vec![f32::INFINITY; plane];
    let mut row = vec![0.0; columns + 2];
    for at in 0..points.places.len() {
        let Some((cell, inside)) = points.cell(at, size) else { continue };
        let (cell, mut weight) = (cell[1] * width + cell[0], points.weights[at]);
        if let Some(depths) = points.depths {
            let nearer = depths[at] < nearest[cell];
            if !nearer {
                continue;
            }
            nearest[cell] = depths[at];
            // What was behind it is forgotten.
            (0..=columns + 2).for_each(|channel| values[channel * plane + cell] = 0.0);
            total[cell] = 0.0;
        }
        points.descriptors.read_row(at, &mut row[..columns]);
        let length = row[..columns].iter().map(|x| x * x).sum::<f32>().sqrt();
        let scale = (columns as f32).sqrt() / length.max(1e-12);
        row[..columns].iter_mut().for_each(|x| *x *= scale);
        row[columns..].copy_from_slice(&inside);
        for (channel, value) in row.iter().enumerate() {
            values[channel * plane + cell] += weight * value;
        }
        total[cell] += weight;
        let largest = &mut values[(columns + 2) * plane + cell];
        weight = weight.max(*largest);
        *largest = weight;
    }
    for channel in values.chunks_exact_mut(plane).take(columns + 2) {
        for (value, total) in channel.iter_mut().zip(&total) {
            if *total > 0.0 {
                *value /= total;
            }
        }
    }
    Tensor::try_new(&[1, columns + MORE, height, width], values)
}
