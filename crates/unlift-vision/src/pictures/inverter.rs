//! Feature images, made from positions and descriptors, and the network that paints them.

use std::path::Path;

use image::Rgb;
use unlift::{Descriptors, Error};

use crate::features::ColorImage;
use crate::network::{DescriptorKind, Entry, Network, Tensor, entry};

/// Side of a cell in pixels.
pub const CELL: usize = 4;
/// Channels after descriptor and color: the position inside the cell (two), and the weight.
const PLACE: usize = 3;
/// Channels of the color: red, green, blue, and whether it is known.
const COLOR: usize = 4;

/// Points of one image.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// Positions `(n, 2)` in pixels, the middle of the first pixel at (0, 0).
    pub places: &'a [[f32; 2]],
    /// Descriptors of any length, with colors or without.
    pub descriptors: &'a Descriptors,
    /// Confidence of each point, 0 to 1.
    pub weights: &'a [f32],
    /// Distances from the camera, if known: then the nearest point of a cell replaces the mean.
    pub depths: Option<&'a [f32]>,
}

impl Points<'_> {
    fn check(&self) -> Result<(), Error> {
        let n = self.places.len();
        let depths = self.depths.map_or(n, <[f32]>::len);
        let lengths = [self.descriptors.len(), self.weights.len(), depths];
        for (what, rows) in ["descriptors", "weights", "depths"].into_iter().zip(lengths) {
            Error::check_len(what, rows, n, ", one per point")?;
        }
        Ok(())
    }

    /// Returns the cell of point `at` in an image of `size` pixels, and the position inside it from
    /// -1 to 1. `None` outside the image and without weight.
    fn cell(&self, at: usize, size: [usize; 2]) -> Option<([usize; 2], [f32; 2])> {
        // Shifts the corner of the first pixel to (0, 0), where the first cell begins.
        let place = self.places[at].map(|x| x + 0.5);
        let inside = (0..2).all(|c| place[c] >= 0.0 && place[c] < size[c] as f32);
        // NaN fails every comparison.
        let is_trusted = self.weights[at] > 0.0;
        let place = place.map(|x| x / CELL as f32);
        let cell = place.map(|x| x as usize);
        let within = [0, 1].map(|c| 2.0 * (place[c] - cell[c] as f32) - 1.0);
        (inside && is_trusted).then_some((cell, within))
    }
}

/// Same limit as for photos; a network needs a gigabyte for this size.
const MOST_PIXELS: usize = 1 << 24;

/// Rejects implausible sizes, because files may contain any.
pub(crate) fn check_size([width, height]: [usize; 2]) -> Result<(), Error> {
    let sides = 2..=1 << 24;
    if sides.contains(&width) && sides.contains(&height) && width * height <= MOST_PIXELS {
        return Ok(());
    }
    let expected = "at least 2 x 2 and at most 16777216 pixels";
    Err(Error::new("image size", expected, format!("{width} x {height}")))
}

/// Makes the feature image of points in an image of `size` (width, height) pixels, in cells of [`CELL`] pixels: `(1, columns + 3,
/// height, width)`, or `(1, columns + 7, height, width)` with `colored`.
///
/// Channels: the descriptor (of unit length, times the root of its columns); with `colored`, four for the color of the point, which
/// is not known; the position inside the cell from -1 to 1; the weight. Several points in a cell give their weighted mean and the
/// largest weight; with depths, the nearest point. Cells without points are zero.
///
/// # Errors
/// If columns differ in length, a side has less than 2 pixels, or the image more than 2^24.
pub fn feature_image(
    points: &Points<'_>,
    size: [usize; 2],
    colored: bool,
) -> Result<Tensor, Error> {
    points.check()?;
    check_size(size)?;
    let dim = points.descriptors.dim();
    let columns = dim + if colored { COLOR } else { 0 };
    let [width, height] = size.map(|side| side.div_ceil(CELL));
    let plane = width * height;
    let mut values = vec![0.0; (columns + PLACE) * plane];
    let mut total = vec![0.0_f32; plane];
    let mut nearest = vec![f32::INFINITY; plane];
    let mut row = vec![0.0; columns + 2];
    for at in 0..points.places.len() {
        let Some((cell, inside)) = points.cell(at, size) else { continue };
        let (cell, weight) = (cell[1] * width + cell[0], points.weights[at]);
        if let Some(depths) = points.depths {
            let nearer = depths[at] < nearest[cell];
            if !nearer {
                continue;
            }
            nearest[cell] = depths[at];
            // Removes farther points of the cell.
            (0..=columns + 2).for_each(|channel| values[channel * plane + cell] = 0.0);
            total[cell] = 0.0;
        }
        points.descriptors.read_row(at, &mut row[..dim]);
        let length = row[..dim].iter().map(|x| x * x).sum::<f32>().sqrt();
        let scale = (dim as f32).sqrt() / length.max(1e-12);
        row[..dim].iter_mut().for_each(|x| *x *= scale);
        row[columns..].copy_from_slice(&inside);
        for (channel, value) in row.iter().enumerate() {
            values[channel * plane + cell] += weight * value;
        }
        total[cell] += weight;
        let largest = &mut values[(columns + 2) * plane + cell];
        *largest = weight.max(*largest);
    }
    for channel in values.chunks_exact_mut(plane).take(columns + 2) {
        let seen = channel.iter_mut().zip(&total).filter(|(_, total)| **total > 0.0);
        seen.for_each(|(value, total)| *value /= total);
    }
    Tensor::try_new(&[1, columns + PLACE, height, width], values)
}

/// A network trained to make pictures from points and their descriptors.
#[derive(Debug)]
pub struct Inverter {
    kind: DescriptorKind,
    network: Network,
}

impl Inverter {
    /// Loads the inverter of descriptors of `kind` from a file, or the known one.
    ///
    /// A file is as `training/inversion` exports it: input `features`, which is a [`feature_image`]
    /// (`colored` for SIFT), output `picture` `(1, 3, 2 h, 2 w)`.
    ///
    /// # Errors
    /// If the file cannot be read, or has other inputs and outputs, or the known one is neither
    /// embedded nor in the user's folders.
    pub fn open(kind: DescriptorKind, file: Option<&Path>) -> Result<Self, Error> {
        let entry = entry(&format!("inverter-{}", kind.name()))?;
        let network = match file {
            Some(path) => Network::read(path, &Entry { sha256: None, ..*entry }),
            None => Network::load(entry.name),
        };
        Ok(Self { kind, network: network? })
    }

    /// Returns the SHA-256 of the model, in hexadecimal.
    pub fn sha256(&self) -> &str {
        self.network.sha256()
    }

    /// Makes the picture of points in an image of `size` (width, height), at half that size.
    ///
    /// # Errors
    /// If the descriptors are of another kind, and when [`feature_image`] returns an error.
    pub fn invert(&self, points: &Points<'_>, size: [usize; 2]) -> Result<ColorImage, Error> {
        let kind = match points.descriptors.is_empty() {
            true => self.kind,
            false => DescriptorKind::of(points.descriptors, "pictures")?,
        };
        if kind != self.kind {
            let expected = format!("descriptors of the network's kind ({:?})", self.kind);
            return Err(Error::new("pictures", expected, format!("{kind:?}")));
        }
        let features = feature_image(points, size, self.kind == DescriptorKind::Sift)?;
        let [picture] = self.network.run(vec![("features", features)], ["picture"])?;
        let [width, height] = size.map(|side| side / 2);
        match *picture.shape() {
            [1, 3, rows, columns] if columns >= width && rows >= height => {
                Ok(ColorImage::from_fn(width as u32, height as u32, |x, y| {
                    let at = y as usize * columns + x as usize;
                    let value = |color: usize| picture.values()[color * rows * columns + at];
                    Rgb([0, 1, 2]
                        .map(|color| (255.0 * value(color)).round().clamp(0.0, 255.0) as u8))
                }))
            }
            ref shape => {
                let expected =
                    format!("a picture of 3 planes of {width} x {height} pixels at least");
                Err(Error::new("inverter", expected, format!("one of shape {shape:?}")))
            }
        }
    }
}
