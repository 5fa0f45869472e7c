//! Learned perceptual distance.
//!
//! Source: Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric", CVPR 2018: version
//! 0.1 on SqueezeNet 1.1, as the paper's tables have it.

use unlift::Error;
use unlift_features::ColorImage;
use unlift_nn::{Network, Tensor};

use crate::sizes::check_sizes;

/// Name of the model.
const MODEL: &str = "lpips-squeeze";
/// What is left of a smaller picture after all pooling is nothing.
const LEAST: usize = 16;

/// The distance, ready to be taken of many pairs from many threads.
#[derive(Debug)]
pub struct Lpips {
    network: Network,
}

impl Lpips {
    /// The distance by the model that the program carries.
    ///
    /// # Errors
    /// When a file of the model that is to be taken in its place cannot be.
    pub fn try_new() -> Result<Self, Error> {
        Ok(Self { network: Network::load(MODEL)? })
    }

    /// How far apart two pictures look: 0 for equal ones, about 0.7 for unlike ones. Takes about a kilobyte per pixel.
    ///
    /// # Errors
    /// When the pictures differ in size or a side has less than 16 pixels.
    pub fn distance(&self, a: &ColorImage, b: &ColorImage) -> Result<f64, Error> {
        check_sizes(a, b, LEAST)?;
        let inputs = vec![("a", tensor(a)?), ("b", tensor(b)?)];
        let [distance] = self.network.run(inputs, ["distance"])?;
        Ok(f64::from(distance.values()[0]))
    }
}

/// Planes (1, 3, height, width) from 0 to 1.
fn tensor(image: &ColorImage) -> Result<Tensor, Error> {
    let plane = |color: usize| image.pixels().iter().skip(color).step_by(3);
    let values = (0..3).flat_map(plane).map(|&value| f32::from(value) / 255.0).collect();
    Tensor::try_new(&[1, 3, image.height(), image.width()], values)
}
