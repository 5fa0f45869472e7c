//! Recovered positions against the truth: numbers, no opinions.

mod accuracy;
mod blind;

pub use accuracy::{Accuracy, evaluate};
pub use blind::blind;
