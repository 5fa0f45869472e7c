//! Learned perceptual distance (LPIPS).
//!
//! Source: Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric",
//! CVPR 2018: version 0.1 on SqueezeNet 1.1, as in the paper's tables.

use crate::features::ColorImage;
use crate::network::{Network, Tensor};
use unlift::Error;

use crate::pictures::sizes::check_sizes;

const MODEL: &str = "lpips-squeeze";
/// Smallest side; pooling leaves nothing of smaller pictures.
const LEAST: usize = 16;

/// The distance network; threads can share it.
#[derive(Debug)]
pub struct Lpips {
    network: Network,
}

impl Lpips {
    /// Loads the embedded model, or the file that replaces it.
    ///
    /// # Errors
    /// If the replacing file cannot be loaded.
    pub fn try_new() -> Result<Self, Error> {
        Ok(Self { network: Network::load(MODEL)? })
    }

    /// Returns the distance of two pictures: 0 for equal ones, about 0.7 for unrelated ones. Uses
    /// about a kilobyte of memory per pixel.
    ///
    /// # Errors
    /// If the pictures differ in size, or a side has less than 16 pixels.
    pub fn distance(&self, a: &ColorImage, b: &ColorImage) -> Result<f64, Error> {
        check_sizes(a, b, LEAST)?;
        let inputs = vec![("a", tensor(a)?), ("b", tensor(b)?)];
        let [distance] = self.network.run(inputs, ["distance"])?;
        Ok(f64::from(distance.values()[0]))
    }
}

/// Returns planes (1, 3, height, width) with values from 0 to 1.
fn tensor(image: &ColorImage) -> Result<Tensor, Error> {
    let plane = |color: usize| image.pixels().iter().skip(color).step_by(3);
    let values = (0..3).flat_map(plane).map(|&value| f32::from(value) / 255.0).collect();
    Tensor::try_new(&[1, 3, image.height(), image.width()], values)
}
