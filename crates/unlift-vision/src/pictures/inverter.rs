use std::path::Path;

use crate::features::ColorImage;
use crate::network::{DescriptorKind, Entry, Network, Tensor, entry};
use unlift::{Descriptors, Error};

use crate::pictures::feature_image::{Points, feature_image};

/// A network trained to make pictures from points and their descriptors.
#[derive(Debug)]
pub struct Inverter {
    kind: DescriptorKind,
    network: Network,
}

impl Inverter {
    /// Loads the inverter of descriptors of `kind`.
    ///
    /// # Errors
    /// If it is neither embedded nor in the user's folders, or its file cannot be loaded.
    pub fn of(kind: DescriptorKind) -> Result<Self, Error> {
        Ok(Self { kind, network: Network::load(model(kind))? })
    }

    /// Loads an inverter from a file, as `training/inversion` exports it: input `features`, which
    /// is a [`feature_image`] (with colors for SIFT), output `picture` `(1, 3, 2 h, 2 w)`.
    ///
    /// # Errors
    /// If the file cannot be read, or has other inputs and outputs.
    pub fn read(path: &Path, kind: DescriptorKind) -> Result<Self, Error> {
        let entry = Entry { sha256: None, ..*entry(model(kind))? };
        Ok(Self { kind, network: Network::read_plain(path, &entry)? })
    }

    /// Returns the SHA-256 of the model, in hexadecimal.
    pub fn sha256(&self) -> &str {
        self.network.sha256()
    }

    /// Returns true if the network uses the colors of points that have some.
    pub fn takes_colors(&self) -> bool {
        self.kind == DescriptorKind::Sift
    }

    /// Makes the picture of points in an image of `size` (width, height) pixels, at half that size,
    /// rounded down.
    ///
    /// # Errors
    /// If the columns of `points` differ in length, their descriptors are of another kind, a side
    /// has less than 2 pixels, or the image has more than 2^24 pixels.
    pub fn invert(&self, points: &Points<'_>, size: [usize; 2]) -> Result<ColorImage, Error> {
        self.takes(points.descriptors)?;
        let features = feature_image(points, size, self.takes_colors())?;
        let [picture] = self.network.run(vec![("features", features)], ["picture"])?;
        let size = size.map(|side| side / 2);
        match *picture.shape() {
            [1, 3, rows, columns] if columns >= size[0] && rows >= size[1] => {
                color_image(&picture, size)
            }
            ref shape => {
                let expected =
                    format!("a picture of 3 planes of {} x {} pixels at least", size[0], size[1]);
                Err(Error::new("inverter", expected, format!("one of shape {shape:?}")))
            }
        }
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        let found = match descriptors.is_empty() {
            true => return Ok(()),
            false => DescriptorKind::of(descriptors, "pictures")?,
        };
        if found == self.kind {
            return Ok(());
        }
        let expected = format!("descriptors of the network's kind ({:?})", self.kind);
        Err(Error::new("pictures", expected, format!("{found:?}")))
    }
}

fn model(kind: DescriptorKind) -> &'static str {
    match kind {
        DescriptorKind::Sift => "inverter-sift",
        DescriptorKind::Aliked => "inverter-aliked",
        DescriptorKind::SuperPoint => "inverter-superpoint",
    }
}

/// Crops planes `(1, 3, height, width)` with values from 0 to 1 and rounds them to bytes.
fn color_image(planes: &Tensor, [width, height]: [usize; 2]) -> Result<ColorImage, Error> {
    let [.., rows, columns] = planes.shape() else { unreachable!("four sides were seen") };
    let (plane, columns) = (rows * columns, *columns);
    let mut pixels = Vec::with_capacity(3 * width * height);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        for color in 0..3 {
            let value = planes.values()[color * plane + y * columns + x];
            pixels.push((255.0 * value).round().clamp(0.0, 255.0) as u8);
        }
    }
    ColorImage::try_new(width, height, pixels)
}
