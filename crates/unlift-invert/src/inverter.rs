//! From feature images to pictures.

use unlift::Error;
use unlift::neighbors::{Overlap, Source};
use unlift_features::ColorImage;
use unlift_nn::{Network, Tensor};

use crate::feature_image::{Points, feature_image};

/// Name of the model.
const SIFT: &str = "inverter-sift";

/// A network that was trained to make pictures of points and their descriptors.
#[derive(Debug)]
pub struct Inverter {
    network: Network,
}

impl Inverter {
    /// The inverter of SIFT descriptors, as `unlift features` and COLMAP make them.
    ///
    /// # Errors
    /// When a file of the model that is to be taken in place of the one carried cannot be.
    pub fn sift() -> Result<Self, Error> {
        Ok(Self { network: Network::load(SIFT)? })
    }

    /// SHA-256 of the model, in hexadecimal.
    pub fn sha256(&self) -> &str {
        self.network.sha256()
    }

    /// The picture of points in an image of `size` (width, height) pixels, at half that size, rounded down.
    ///
    /// # Errors
    /// When the columns of `points` differ in length, their descriptors are not of the kind that the network knows, or
    /// a side has less than 2 pixels or the image more than 2^28.
    pub fn invert(&self, points: &Points<'_>, size: [usize; 2]) -> Result<ColorImage, Error> {
        // What overlaps patches and what was trained on SIFT read the same descriptors.
        Source::<2>::takes(&Overlap, points.descriptors)?;
        let features = feature_image(points, size)?;
        let [picture] = self.network.run(vec![("features", features)], ["picture"])?;
        color_image(&picture, size.map(|side| side / 2))
    }
}

/// The upper-left part of planes `(1, 3, height, width)` from 0 to 1, rounded to bytes.
fn color_image(planes: &Tensor, [width, height]: [usize; 2]) -> Result<ColorImage, Error> {
    let [.., rows, columns] = planes.shape() else { unreachable!("the registry says four sides") };
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
