//! From feature images to pictures.

use std::path::Path;

use unlift::{Descriptors, Error};
use unlift_features::ColorImage;
use unlift_nn::{DescriptorKind, Entry, Network, Tensor, entry};

use crate::feature_image::{Points, feature_image};

/// A network that was trained to make pictures of points and their descriptors.
#[derive(Debug)]
pub struct Inverter {
    kind: DescriptorKind,
    network: Network,
}

impl Inverter {
    /// The inverter of descriptors of `kind`.
    ///
    /// # Errors
    /// When the program carries none and there is none among the models of its user, or a file of the model cannot be
    /// used.
    pub fn of(kind: DescriptorKind) -> Result<Self, Error> {
        Ok(Self { kind, network: Network::load(model(kind))? })
    }

    /// The inverter of descriptors of `kind` in a file, as `training/inversion` exports them: input `features`
    /// `(1, columns + 3, h, w)`, which is a [`feature_image`], output `picture` `(1, 3, 2 h, 2 w)`.
    ///
    /// # Errors
    /// When the file cannot be read, or has other inputs and outputs.
    pub fn read(path: &Path, kind: DescriptorKind) -> Result<Self, Error> {
        let entry = Entry { sha256: None, ..*entry(model(kind))? };
        Ok(Self { kind, network: Network::read_plain(path, &entry)? })
    }

    /// SHA-256 of the model, in hexadecimal.
    pub fn sha256(&self) -> &str {
        self.network.sha256()
    }

    /// The picture of points in an image of `size` (width, height) pixels, at half that size, rounded down.
    ///
    /// # Errors
    /// When the columns of `points` differ in length, their descriptors are not of the kind that the network knows, or
    /// a side has less than 2 pixels or the image more than 2^24.
    pub fn invert(&self, points: &Points<'_>, size: [usize; 2]) -> Result<ColorImage, Error> {
        self.takes(points.descriptors)?;
        let features = feature_image(points, size)?;
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

    /// Whether `descriptors` are of the kind that the network knows.
    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        let found = match descriptors.is_empty() {
            true => return Ok(()),
            false => DescriptorKind::of(descriptors, "pictures")?,
        };
        if found == self.kind {
            return Ok(());
        }
        let expected = format!("descriptors as the network knows them ({:?})", self.kind);
        Err(Error::new("pictures", expected, format!("{found:?}")))
    }
}

/// The model that paints descriptors of `kind`.
fn model(kind: DescriptorKind) -> &'static str {
    match kind {
        DescriptorKind::Sift => "inverter-sift",
        DescriptorKind::Aliked => "inverter-aliked",
        DescriptorKind::SuperPoint => "inverter-superpoint",
    }
}

/// The upper-left part of planes `(1, 3, height, width)` from 0 to 1, rounded to bytes.
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
